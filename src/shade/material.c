/* Homogeneous scattering media: the published ones, what follows from them, and the curve T(d).
 *
 * Measured media: H. W. Jensen, S. Marschner, M. Levoy, P. Hanrahan, "A practical model for
 * subsurface light transport", SIGGRAPH 2001, table of section 5: reduced scattering and absorption
 * in 1/mm. "wax" is this project's own choice: no measured values that could be trusted were found.
 *
 * With the reduced scattering s' = (1 - g) s, the reduced extinction t' = s' + a and the albedo s'
 * / t':
 *
 *   effective transport   str = sqrt(3 a t')
 *   diffuse reflectance   Rd = albedo / 2 (1 + exp(-4/3 q)) exp(-q),  q = sqrt(3 (1 - albedo))
 *                         (same paper, A = 1: index matched)
 *   slab                  T(d) = sinh(str (zr + ze)) / sinh(str (d + 2 ze)),
 *                         zr = 1 / t',  ze = 2 / (3 t')
 *
 * T is the diffuse transmittance of a slab lit by a source one mean free path deep, with
 * extrapolated boundaries: the standard solution of the diffusion equation. It exceeds 1 where d <
 * zr - ze, where diffusion does not hold; there it is capped. */
#define _XOPEN_SOURCE 700
#include <diaphan/material.h>

#include "shade/material_json.h"

#include "core/fail.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define PI 3.14159265358979323846
#define DERIVED {NAN, NAN, NAN}
#define PRESET(name_, s0, s1, s2, a0, a1, a2, ior_)                                            \
    {                                                                                          \
        .name = name_, .scattering = {s0, s1, s2}, .absorption = {a0, a1, a2}, .ior = ior_,    \
        .sigma = DERIVED, .base = DERIVED, .front = DERIVED, .back = DERIVED, .shininess = 40, \
        .rim_power = 3                                                                         \
    }

static const struct dph_material presets[] = {
    PRESET("wax", 1.6, 1.5, 1.3, .0012, .0035, .016, 1.45),
    PRESET("apple", 2.29, 2.39, 1.97, .0030, .0034, .046, 1.3),
    PRESET("chicken1", .15, .21, .38, .015, .077, .19, 1.3),
    PRESET("chicken2", .19, .25, .32, .018, .088, .20, 1.3),
    PRESET("cream", 7.38, 5.47, 3.15, .0002, .0028, .0163, 1.3),
    PRESET("ketchup", .18, .07, .03, .061, .97, 1.45, 1.3),
    PRESET("marble", 2.19, 2.62, 3.00, .0021, .0041, .0071, 1.5),
    PRESET("potato", .68, .70, .55, .0024, .0090, .12, 1.3),
    PRESET("skimmilk", .70, 1.22, 1.90, .0014, .0025, .0142, 1.3),
    PRESET("skin1", .74, .88, 1.01, .032, .17, .48, 1.3),
    PRESET("skin2", 1.09, 1.59, 1.79, .013, .070, .145, 1.3),
    PRESET("spectralon", 11.6, 20.4, 14.9, 0, 0, 0, 1.3),
    PRESET("wholemilk", 2.55, 3.21, 3.77, .0011, .0024, .014, 1.3),
};

const struct dph_material *dph_material_preset(size_t i)
{
    return i < sizeof presets / sizeof *presets ? &presets[i] : NULL;
}

bool dph_material_load(const char *name_or_path, struct dph_material *material,
                       struct dph_error *err)
{
    const struct dph_material *preset;
    for (size_t i = 0; (preset = dph_material_preset(i)); i++)
        if (!strcasecmp(preset->name, name_or_path)) {
            *material = *preset;
            return true;
        }
    /* What looks like a file is one; anything else that cannot be opened is a misspelt name. */
    bool file = strchr(name_or_path, '/') || strchr(name_or_path, '.');
    if (!file && access(name_or_path, F_OK)) {
        char list[256] = "";
        for (size_t i = 0, at = 0; (preset = dph_material_preset(i)) && at < sizeof list; i++)
            at += (size_t)snprintf(list + at, sizeof list - at, "%s%s", i ? ", " : "",
                                   preset->name);
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "unknown material '%.60s': neither a file nor one of %s", name_or_path,
                        list);
    }
    struct dph_material base = presets[0];
    base.ior = 1.3;
    base.anisotropy = 0;
    return dph_material_load_json(name_or_path, &base, material, err);
}

void dph_material_medium(const struct dph_material *material, struct dph_medium *medium)
{
    for (int c = 0; c < 3; c++) {
        double reduced = (1 - material->anisotropy) * material->scattering[c];
        double absorption = material->absorption[c], extinction = reduced + absorption;
        medium->reduced_scattering[c] = reduced;
        medium->transport[c] = sqrt(3 * absorption * extinction);
        medium->reflectance[c] = 0;
        if (reduced > 0) {
            double q = sqrt(3 * absorption / extinction); /* 1 - albedo, without cancellation */
            medium->reflectance[c] = reduced / extinction / 2 * (1 + exp(-4 / 3. * q)) * exp(-q);
        }
    }
}

/* The slab's three numbers for one channel. */
static void slab_constants(double extinction, double transport, struct dph_material_constants *out,
                           int c)
{
    /* Light crosses kilometres of it undimmed: a vacuum as far as floats are concerned, T = 1. */
    if (extinction < 1e-6) {
        out->rate[c] = 0;
        out->offset[c] = 1;
        out->numerator[c] = 1e30F;
        return;
    }
    double zr = 1 / extinction, ze = 2 / (3 * extinction);
    double x = transport * (zr + ze); /* at most 5 / sqrt 3, since absorption <= extinction */
    out->rate[c] = (float)transport;
    out->offset[c] = (float)(2 * ze);
    out->numerator[c] = (float)(transport > 0 ? sinh(x) / transport : zr + ze);
}

void dph_material_constants(const struct dph_material *material, struct dph_material_constants *out)
{
    struct dph_medium medium;
    dph_material_medium(material, &medium);
    memset(out, 0, sizeof *out);
    bool paper = material->formula == DPH_FORMULA_PAPER;
    out->formula = (int)material->formula;
    out->curve = (int)material->curve;
    for (int c = 0; c < 3; c++) {
        double albedo = medium.reflectance[c];
        if (material->curve == DPH_CURVE_EXP)
            out->rate[c] =
                (float)(isnan(material->sigma[c]) ? medium.transport[c] : material->sigma[c]);
        else
            slab_constants(medium.reduced_scattering[c] + material->absorption[c],
                           medium.transport[c], out, c);
        /* The factors of formula G: of the first two, rounded medians of fits to random walks in 24
         * cases; the third is the closest to path-traced pictures (docs/theory.md). */
        double base = (paper ? 1 : .25) * albedo / PI, front = (paper ? 1 : .6) * albedo / PI;
        double back = paper ? 0 : .35 / PI;
        out->base[c] = (float)(isnan(material->base[c]) ? base : material->base[c]);
        out->front[c] = (float)(isnan(material->front[c]) ? front : material->front[c]);
        out->back[c] = (float)(isnan(material->back[c]) ? back : material->back[c]);
        out->albedo[c] = (float)albedo;
    }
    double r = (material->ior - 1) / (material->ior + 1);
    out->f0 = (float)(r * r);
    out->specular = (float)material->specular;
    out->shininess = (float)material->shininess;
    out->rim = (float)material->rim;
    out->rim_power = (float)material->rim_power;
    out->ambient = (float)material->ambient;
}

double dph_material_transmittance(const struct dph_material_constants *constants, int channel,
                                  double d)
{
    double rate = (double)constants->rate[channel];
    d = fmax(d, 0);
    if (constants->curve == DPH_CURVE_EXP)
        return exp(-rate * d);
    /* rate / sinh(rate w), by its series where the exponentials would cancel, and without overflow
     * where they are large */
    double w = d + (double)constants->offset[channel], x = rate * w, x2 = x * x;
    double inverse =
        x < .25 ? 1 / (w * (1 + x2 / 6 * (1 + x2 / 20))) : 2 * rate * exp(-x) / (1 - exp(-2 * x));
    return fmin(1, (double)constants->numerator[channel] * inverse);
}
