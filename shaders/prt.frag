// prt.frag - interpolated radiance; only here it is cut off at 0. A highlight is not in the transfer
// vectors and comes from the lights themselves.
#include "surface.glsl"

centroid in vec3 v_radiance;

void main()
{
    vec3 radiance = max(v_radiance, 0.0) + dph_ambient(u_material);
    if (dph_shines(u_material))
        for (int i = 0; i < DPH_LIGHTS; i++)
            radiance += u_light[i].irradiance * dph_specular(u_material, surface_normal(),
                                                             u_light[i].to_light, surface_to_eye());
    o_color = vec4(radiance, 1.0);
}
