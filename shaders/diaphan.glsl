// diaphan.glsl - every formula that a shader needs to draw a body baked by Diaphan.
//
// Pure functions: no uniforms, no attributes, no #version. Works in GLSL 3.30 core and later, and
// in GLSL ES 3.00 with highp floats. The numbers come from the C library: dph_light_constants()
// fills what belongs to a light and an instance, dph_material_constants() what belongs to a
// material (the members have the same names), and dph_material_transmittance() is
// dph_transmittance() in C.
//
// Directions are unit vectors of one common space (of the world, say). Lengths are millimetres.
// Results are radiance, linear.
//
//   vertex stage     for every light:  t = dph_thickness(coefficients, light values)
//                    handed on as it is: it may be negative, clamping it here would bend gradients
//   fragment stage   for every light:  radiance += dph_radiance(material, t, normal, to_light,
//                                                               to_eye, irradiance)
//                    once:             radiance += dph_ambient(material)

#ifndef DPH_DIAPHAN_GLSL
#define DPH_DIAPHAN_GLSL

// How many vec4 of coefficients a vertex has: 1, 3, 4, 7, 9 for 2 to 6 bands. Define it before the
// include for fewer.
#ifndef DPH_VECTORS
#define DPH_VECTORS 9
#endif

#define DPH_PI 3.14159265358979

#define DPH_FORMULA_G 0
#define DPH_FORMULA_PAPER 1
#define DPH_CURVE_SLAB 0
#define DPH_CURVE_EXP 1

// A material's constants: struct dph_material_constants of diaphan/material.h, where each is
// explained.
struct DphMaterial {
    int formula;
    int curve;
    vec3 rate, offset, numerator;
    vec3 base, front, back;
    vec3 albedo;
    float specular, shininess, f0;
    float rim, rim_power, ambient;
};

// v made unit length; 0 stays 0.
vec3 dph_unit(vec3 v)
{
    return v * inversesqrt(max(dot(v, v), 1e-30));
}

#if DPH_VECTORS > 0
// Thickness towards a light in mm, not clamped: the vertex's stored components (after GL's
// normalization of integers) times the light's values in the body's space, in which the scale of
// each band, the window and millimetres are folded.
float dph_thickness(vec4 coefficient[DPH_VECTORS], vec4 light[DPH_VECTORS])
{
    float sum = 0.0;
    for (int i = 0; i < DPH_VECTORS; i++)
        sum += dot(coefficient[i], light[i]);
    return sum;
}
#endif

// Share of light that comes through `d` mm of the material, per channel; 1 where d <= 0. Diffusion
// slab with extrapolated boundaries, capped at 1, or an exponential.
vec3 dph_transmittance(DphMaterial m, float d)
{
    d = max(d, 0.0);
    if (m.curve == DPH_CURVE_EXP)
        return exp(-m.rate * d);
    // rate / sinh(rate w): a series where the exponentials would cancel, no overflow for large w
    vec3 w = m.offset + d;
    vec3 x = m.rate * w;
    vec3 x2 = x * x;
    vec3 series = 1.0 / (w * (1.0 + x2 / 6.0 * (1.0 + x2 / 20.0)));
    vec3 e = exp(-max(x, 0.25));
    vec3 exponential = 2.0 * m.rate * e / (1.0 - e * e);
    return min(m.numerator * mix(exponential, series, lessThan(x, vec3(0.25))), 1.0);
}

// Highlight of a dielectric: normalised Blinn-Phong (the factor keeps its energy for every
// exponent) with Schlick's Fresnel term; per unit of irradiance.
float dph_specular(DphMaterial m, vec3 normal, vec3 to_light, vec3 to_eye)
{
    vec3 h = dph_unit(to_light + to_eye);
    float fresnel = m.f0 + (1.0 - m.f0) * pow(1.0 - clamp(dot(to_eye, h), 0.0, 1.0), 5.0);
    float lobe = pow(clamp(dot(normal, h), 1e-6, 1.0), m.shininess);
    lobe *= (m.shininess + 8.0) / (8.0 * DPH_PI);
    return m.specular * lobe * fresnel * max(dot(normal, to_light), 0.0);
}

// Radiance towards the eye that one light causes. `thickness`: from dph_thickness, interpolated.
// Formula G:
//   E T(d) (base + front max(0, mu) + back max(0, -mu)),   mu = normal . to_light
// T multiplies the front term too, where it acts as a soft shadow; back |mu| is the cosine at which
// light enters. Formula "paper":
//   E (front max(0, mu) + base T(d)).
vec3 dph_radiance(DphMaterial m, float thickness, vec3 normal, vec3 to_light, vec3 to_eye,
                  vec3 irradiance)
{
    float mu = dot(normal, to_light);
    vec3 t = dph_transmittance(m, thickness);
    vec3 result = m.formula == DPH_FORMULA_PAPER
                      ? m.front * max(mu, 0.0) + m.base * t
                      : t * (m.base + m.front * max(mu, 0.0) + m.back * max(-mu, 0.0));
    if (m.specular > 0.0)
        result += dph_specular(m, normal, to_light, to_eye);
    if (m.rim > 0.0)
        result += t * m.rim / DPH_PI * pow(clamp(1.0 - dot(normal, to_eye), 1e-6, 1.0), m.rim_power);
    return irradiance * result;
}

// The same of an opaque surface whose albedo is the material's diffuse reflectance: the base line.
vec3 dph_lambert(DphMaterial m, vec3 normal, vec3 to_light, vec3 to_eye, vec3 irradiance)
{
    vec3 result = m.albedo * (max(dot(normal, to_light), 0.0) / DPH_PI);
    if (m.specular > 0.0)
        result += dph_specular(m, normal, to_light, to_eye);
    return irradiance * result;
}

// Radiance caused by light of equal radiance from everywhere.
vec3 dph_ambient(DphMaterial m)
{
    return m.albedo * m.ambient;
}

#endif
