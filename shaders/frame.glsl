// frame.glsl - what the stages of the drawing methods share: lights, material, varyings.
//
// DPH_LIGHTS lights, each with DPH_VECTORS vec4 of values (0: the method needs no thickness).
// Positions are relative to the camera, in axes of the world, the scene's radius being 1; normals
// and directions are in axes of the world.
#include "diaphan.glsl"

struct DphLight {
    vec3 to_light;
    vec3 irradiance;
#if DPH_VECTORS > 0
    vec4 sh[DPH_VECTORS];
#endif
};

uniform DphLight u_light[DPH_LIGHTS];
