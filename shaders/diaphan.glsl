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

// Members of a material that decide what is computed. An engine that knows one when it compiles
// defines it as a constant before the include, `#define DPH_SPECULAR 0.0` say, and what it decides
// against costs nothing.
#ifndef DPH_FORMULA
#define DPH_FORMULA m.formula
#endif
#ifndef DPH_CURVE
#define DPH_CURVE m.curve
#endif
#ifndef DPH_SPECULAR
#define DPH_SPECULAR m.specular
#endif
#ifndef DPH_RIM
#define DPH_RIM m.rim
#endif
#ifndef DPH_AMBIENT
#define DPH_AMBIENT m.ambient
#endif

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

// Whether it has a highlight.
bool dph_shines(DphMaterial m)
{
    return DPH_SPECULAR > 0.0;
}

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
//
// Of the slab, numerator * rate / sinh(rate w) with w = d + offset. sinh(x) / x is a polynomial in
// x^2 here, which costs no exponential and needs no series near 0: its coefficients minimise the
// largest error of the result over all media and thicknesses, which is below 5e-4
// (dph_material_transmittance is exact).
//
// Of a medium that is known when this is compiled, 1 / T is a polynomial in d itself, with an error
// below 2e-4: define DPH_SLAB_FIT as the seven vec3 of dph_material_fit, with commas. Even and odd
// powers in pairs keep a processor with several units busier than Horner's scheme.
vec3 dph_transmittance(DphMaterial m, float d)
{
    d = max(d, 0.0);
    if (DPH_CURVE == DPH_CURVE_EXP)
        return exp(-m.rate * d);
#ifdef DPH_SLAB_FIT
    const vec3 c[7] = vec3[7](DPH_SLAB_FIT);
    float s = d * d;
    vec3 p = (c[0] + d * c[1]) + s * ((c[2] + d * c[3]) + s * ((c[4] + d * c[5]) + s * c[6]));
    return min(1.0 / p, 1.0);
#else
    vec3 w = m.offset + d, y = m.rate * w;
    y *= y;
    vec3 sinh_over_x =
        1.0 + y * (0.16575616 + y * (8.7985078e-3 + y * (1.3569344e-4 + y * 5.4375459e-6)));
    return min(m.numerator / (w * sinh_over_x), 1.0);
#endif
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
    vec3 result = DPH_FORMULA == DPH_FORMULA_PAPER
                      ? m.front * max(mu, 0.0) + m.base * t
                      : t * (m.base + m.front * max(mu, 0.0) + m.back * max(-mu, 0.0));
    if (dph_shines(m))
        result += dph_specular(m, normal, to_light, to_eye);
    if (DPH_RIM > 0.0)
        result += t * m.rim / DPH_PI * pow(clamp(1.0 - dot(normal, to_eye), 1e-6, 1.0), m.rim_power);
    return irradiance * result;
}

// The same of an opaque surface whose albedo is the material's diffuse reflectance: the base line.
vec3 dph_lambert(DphMaterial m, vec3 normal, vec3 to_light, vec3 to_eye, vec3 irradiance)
{
    vec3 result = m.albedo * (max(dot(normal, to_light), 0.0) / DPH_PI);
    if (dph_shines(m))
        result += dph_specular(m, normal, to_light, to_eye);
    return irradiance * result;
}

// The response: radiance per irradiance of light from one direction, front light included. The
// vertex stage's sum is dph_thickness() with values that docs/theory.md describes; the ramp's colours
// lie in a texture of DPH_RAMP texels, filtered linearly: of one dimension, which is read faster, or
// in GLSL ES, which has none such, of DPH_RAMP by 1.
#define DPH_RAMP 24.0
#ifdef GL_ES
#define DPH_RAMP_SAMPLER sampler2D
#define DPH_RAMP_AT(u) vec2(u, 0.5)
#else
#define DPH_RAMP_SAMPLER sampler1D
#define DPH_RAMP_AT(u) (u)
#endif

// `u`: root of the value, over that of the ramp's end
vec3 dph_ramp(DPH_RAMP_SAMPLER ramp, float u)
{
    return texture(ramp, DPH_RAMP_AT(u * ((DPH_RAMP - 1.0) / DPH_RAMP) + 0.5 / DPH_RAMP)).rgb;
}

// How much more than the average of all views the eye gets: struct dph_view_constants of
// diaphan/response.h.
struct DphView {
    float mean;
    vec3 eye, light;
    float even;
    vec4 linear, square;
    vec3 mixed, cross;
};

// Root form, vertex stage: what to hand on in the place of the sum, for the eye that `view` is for.
// `first`: the vertex's first four coefficients.
float dph_response_seen(DphView view, vec4 first, float sum)
{
    float u = abs(sum);
    vec4 q = vec4(view.mean * first.x, dot(view.eye, first.yzw), dot(view.light, first.yzw), u);
    float gain = view.even + dot(q, view.linear + view.square * q) +
                 q.x * dot(view.mixed, q.yzw) + dot(view.cross, q.yyz * q.zww);
    return u * sqrt(clamp(gain, 0.0, 4.0));
}

// Root form, fragment stage: the sum is the root.
vec3 dph_response_root(DPH_RAMP_SAMPLER ramp, float sum)
{
    return dph_ramp(ramp, abs(sum));
}

// Linear form, one light, or several of one hue that were summed before.
vec3 dph_response_linear(DPH_RAMP_SAMPLER ramp, float sum)
{
    return dph_ramp(ramp, sqrt(max(sum, 0.0)));
}

// Linear form, several lights: `caused` is the sum of irradiance times sum, `irradiance` that of
// irradiances. The hue is that of the mean value by luminance, and every channel gets as much as it
// has caused; a value of 1e-4 is added to both so that black stays finite.
vec3 dph_response_sum(DPH_RAMP_SAMPLER ramp, vec3 caused, vec3 irradiance)
{
    const vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
    float value = max(dot(caused, luminance) / max(dot(irradiance, luminance), 1e-20), 0.0);
    return dph_ramp(ramp, sqrt(value)) * (max(caused, 0.0) + 1e-4 * irradiance) / (value + 1e-4);
}

// What a finer normal does to the response, per light, as a factor. The response knows the normals of
// the vertices only; how a piece of surface is turned to the light changes what enters there.
// `vertex_normal`: interpolated, not made unit length. The factor is the ratio of cosines, each
// raised by a quarter, because light also comes from around; it is 1 where both look away. Meant for
// normal maps: the methods here leave it out, since the normal that is interpolated adds little.
float dph_response_detail(vec3 normal, vec3 vertex_normal, vec3 to_light)
{
    return (0.25 + max(dot(normal, to_light), 0.0)) / (0.25 + max(dot(vertex_normal, to_light), 0.0));
}

// Radiance caused by light of equal radiance from everywhere.
vec3 dph_ambient(DphMaterial m)
{
    return m.albedo * DPH_AMBIENT;
}

#endif
