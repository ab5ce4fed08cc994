// patro.frag - lambert.frag for changed normals: they are used at the length they have.
#include "surface.glsl"

void main()
{
    vec3 normal = gl_FrontFacing ? v_normal : -v_normal, to_eye = surface_to_eye();
    vec3 radiance = dph_ambient(u_material);
    for (int i = 0; i < DPH_LIGHTS; i++) {
        vec3 to_light, irradiance;
        surface_light(i, to_light, irradiance);
        radiance += dph_lambert(u_material, normal, to_light, to_eye, irradiance);
    }
    o_color = vec4(radiance, 1.0);
}
