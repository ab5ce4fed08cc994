// surface.glsl - what the fragment stages begin with: the varyings of body.vert, made into a point
// of a surface.
#include "frame.glsl"
#include "material.glsl"

centroid in vec3 v_position;
#if DPH_VECTORS > 0
centroid in vec4 v_surface;
#if DPH_LIGHTS > 1
centroid in vec4 v_more[(DPH_LIGHTS + 2) / 4];
#endif
#define v_normal v_surface.xyz
#else
centroid in vec3 v_normal;
#endif

layout(location = 0) out vec4 o_color; // linear radiance; alpha is coverage

// The normal of the side that is seen: an open sheet looks the same from both.
vec3 surface_normal()
{
    float side = gl_FrontFacing ? 1.0 : -1.0;
    return v_normal * (side * inversesqrt(max(dot(v_normal, v_normal), 1e-30)));
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

#if DPH_VECTORS > 0
// Thickness towards a light, interpolated, in mm.
float surface_thickness(int i)
{
#if DPH_LIGHTS > 1
    if (i > 0)
        return v_more[(i - 1) / 4][(i - 1) % 4];
#endif
    return v_surface.w;
}
#endif
