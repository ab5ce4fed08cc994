// frame.glsl - what the stages of the drawing methods share: lights, material, varyings.
//
// DPH_LIGHTS lights, each with DPH_VECTORS vec4 of values (0: the method needs no thickness).
// With DPH_LOCAL some of them are point or spot lights: `irradiance` is then that at a distance of one
// radius of the scene, and a spot's `to_light` the axis of its cone. Positions are relative to the camera, in axes of the world, the scene's radius being 1; normals
// and directions are in axes of the world.
#include "diaphan.glsl"

struct DphLight {
    vec3 to_light;
    vec3 irradiance;
#ifdef DPH_LOCAL
    vec4 position; // of a point or a spot light; w is 0 for a distant one
    vec2 cone;     // cosines: from x on all of a spot's light, below y none
#endif
#if DPH_VECTORS > 0
    vec4 sh[DPH_VECTORS];
#endif
#ifdef DPH_VIEW
    DphView view; // what the eye sees of a response
#endif
};

uniform DphLight u_light[DPH_LIGHTS];
