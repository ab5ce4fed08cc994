// response.frag - light that comes out of the body, all of it: the varying sum of every light read
// off the colours of the ramp. Front light is in it.
#include "surface.glsl"

uniform DPH_RAMP_SAMPLER u_ramp;

// The light's irradiance here.
vec3 light_here(int i)
{
    vec3 to_light, irradiance;
    surface_light(i, to_light, irradiance);
    return irradiance;
}

void main()
{
    vec3 radiance = dph_ambient(u_material);
#ifdef DPH_ROOT
    for (int i = 0; i < DPH_LIGHTS; i++)
        radiance += light_here(i) * dph_response_root(u_ramp, surface_thickness(i));
#elif DPH_LIGHTS == 1
    radiance += light_here(0) * dph_response_linear(u_ramp, surface_thickness(0));
#else
    // what all lights cause together has the hue of their mean value, and each channel its own share
    vec3 all = vec3(0.0), caused = vec3(0.0);
    for (int i = 0; i < DPH_LIGHTS; i++) {
        vec3 irradiance = light_here(i);
        all += irradiance;
        caused += irradiance * surface_thickness(i);
    }
    radiance += dph_response_sum(u_ramp, caused, all);
#endif
    if (dph_shines(u_material))
        for (int i = 0; i < DPH_LIGHTS; i++) {
            vec3 to_light, irradiance;
            surface_light(i, to_light, irradiance);
            radiance += irradiance *
                        dph_specular(u_material, surface_normal(), to_light, surface_to_eye());
        }
    o_color = vec4(radiance, 1.0);
}
