// green.frag - as shsss.frag, with the thickness of the depth maps.
#include "surface.glsl"
#include "green.glsl"

void main()
{
    vec3 normal = surface_normal(), to_eye = surface_to_eye();
    vec3 radiance = dph_ambient(u_material);
    for (int i = 0; i < DPH_LIGHTS; i++) {
        vec3 to_light, irradiance;
        surface_light(i, to_light, irradiance);
        radiance += dph_radiance(u_material, green_thickness(i, v_position + u_eye), normal, to_light,
                                 to_eye, irradiance);
    }
    o_color = vec4(radiance, 1.0);
}
