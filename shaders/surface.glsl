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

// Direction to a light and its irradiance at this point.
void surface_light(int i, out vec3 to_light, out vec3 irradiance)
{
    to_light = u_light[i].to_light;
    irradiance = u_light[i].irradiance;
#ifdef DPH_LOCAL
    if (u_light[i].position.w > 0.0) {
        vec3 path = u_light[i].position.xyz - v_position;
        float square = max(dot(path, path), 1e-12);
        path *= inversesqrt(square);
        irradiance *= smoothstep(u_light[i].cone.y, u_light[i].cone.x, dot(path, to_light)) / square;
        to_light = path;
    }
#endif
}

vec3 surface_to_eye()
{
    return dph_unit(-v_position);
}
