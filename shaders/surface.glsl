// surface.glsl - what the fragment stages begin with: the varyings of body.vert, made into a point
// of a surface.
#include "frame.glsl"

centroid in vec3 v_position;
centroid in vec3 v_normal;
#if DPH_VECTORS > 0
centroid in float v_thickness[DPH_LIGHTS];
#endif

layout(location = 0) out vec4 o_color; // linear radiance; alpha is coverage

// The normal of the side that is seen: an open sheet looks the same from both.
vec3 surface_normal()
{
    vec3 n = dph_unit(v_normal);
    return gl_FrontFacing ? n : -n;
}

vec3 surface_to_eye()
{
    return dph_unit(-v_position);
}
