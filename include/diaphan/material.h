/* diaphan/material.h - homogeneous scattering media and the numbers that shading needs of them.      Tier 2.
 *
 * Coefficients are in 1/mm, per RGB channel. `scattering` is not reduced; the presets (Jensen et
 * al. 2001) give the reduced coefficient with anisotropy 0. */
#ifndef DIAPHAN_MATERIAL_H
#define DIAPHAN_MATERIAL_H

#include <diaphan/error.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How thickness becomes light. E: irradiance perpendicular to the light, mu: normal . to_light, d:
 * thickness. */
enum dph_formula {
    DPH_FORMULA_G = 0,  /* E T(d) (b + f max(0, mu) + g max(0, -mu)), docs/theory.md           */
    DPH_FORMULA_PAPER,  /* E (f max(0, mu) + b T(d)): the paper's own sum                       */
};

/* The transmittance T(d) of thickness d. */
enum dph_curve {
    DPH_CURVE_SLAB = 0, /* diffusion slab, capped at 1                                         */
    DPH_CURVE_EXP,      /* exp(-sigma d)                                                       */
};

/* A medium and how it is drawn. Plain data, copy it as you like. */
struct dph_material {
    char name[64];
    double scattering[3];  /* 1/mm, >= 0                                                         */
    double absorption[3];  /* 1/mm, >= 0                                                         */
    double anisotropy;     /* g of Henyey-Greenstein, -1 < g < 1                                 */
    double ior;            /* >= 1                                                               */

    /* Drawing parameters. NaN in a channel: derived from the medium. */
    enum dph_formula formula;
    enum dph_curve curve;
    double sigma[3];       /* of DPH_CURVE_EXP, 1/mm; derived: the effective transport coefficient */
    double base[3];        /* b; derived: .25 Rd / pi (formula G), Rd / pi (paper)        */
    double front[3];       /* f; derived: .6 Rd / pi (formula G), Rd / pi (paper)                 */
    double back[3];        /* g; derived: .35 / pi (formula G)                                   */
    double specular;       /* scale of the Blinn-Phong highlight, 0: off                         */
    double shininess;      /* its exponent; 40                                                   */
    double rim;            /* scale of the rim term, 0: off                                      */
    double rim_power;      /* 3                                                                  */
    double ambient;        /* radiance from everywhere times Rd; 0                               */
};

/* The presets in a fixed order; NULL beyond the last. */
const struct dph_material *dph_material_preset(size_t i);

/* A preset by name (case does not matter), else a JSON file at that path. The file holds one
 * object:
 *
 *   "scattering", "absorption"   [r, g, b], required; 1/mm, 0 to 1e6
 *   "anisotropy"                 -1 < g < 1; 0
 *   "ior"                        1 to 4; 1.3
 *   "name"                       text; the file name
 *   "formula"                    "g" or "paper"; "g"
 *   "curve"                      "slab" or "exp"; "slab" with formula g, "exp" with paper
 *   "sigma", "base", "front", "back"   [r, g, b], >= 0; derived from the medium
 *   "specular", "shininess", "rim", "rim_power", "ambient"   >= 0; 0, 40, 0, 3, 0
 *
 * Any other key is an error, so that a misspelt one does not pass in silence. False:
 * DPH_ERROR_ARGUMENT where it is neither a preset nor a file (the message lists the presets),
 * DPH_ERROR_INPUT for a bad file (with the line, or the key and its value), DPH_ERROR_LIMIT,
 * DPH_ERROR_MEMORY. */
bool dph_material_load(const char *name_or_path, struct dph_material *material, struct dph_error *err);

/* Writes a material as such a file, numbers with nine digits; what is derived from the medium is
 * left out. The file appears whole or not at all. False: DPH_ERROR_OUTPUT or DPH_ERROR_MEMORY. */
bool dph_material_save(const struct dph_material *material, const char *path,
                       struct dph_error *err);

/* What follows from a medium, per channel. */
struct dph_medium {
    double reduced_scattering[3]; /* (1 - g) scattering, 1/mm                                    */
    double transport[3];          /* effective transport coefficient sqrt(3 sa (sa + ss')), 1/mm */
    double reflectance[3];        /* index-matched diffuse reflectance of a half space (Jensen's dipole, eta 1) */
};
void dph_material_medium(const struct dph_material *material, struct dph_medium *medium);

/* The constants that a shader takes for a material, per channel: struct DphMaterial of
 * shaders/diaphan.glsl has the same members. Lengths are in mm. The curves:
 *
 *   slab         T(d) = min(1, numerator * rate / sinh(rate * (d + offset))),
 *                in the limit of rate 0 min(1, numerator / (d + offset))
 *   exponential  T(d) = exp(-rate * d) */
struct dph_material_constants {
    int formula;              /* enum dph_formula                                                 */
    int curve;                /* enum dph_curve                                                   */
    float rate[3];            /* 1/mm                                                             */
    float offset[3];          /* mm                                                               */
    float numerator[3];       /* mm                                                               */
    float base[3], front[3], back[3];
    float albedo[3];          /* index-matched diffuse reflectance                                */
    float specular, shininess, f0; /* f0: reflectance at normal incidence, from the index         */
    float rim, rim_power, ambient;
};
void dph_material_constants(const struct dph_material *material, struct dph_material_constants *out);

/* T(d) of one channel on the CPU, the same formula as the shader's; d in mm, negative counts as 0. */
double dph_material_transmittance(const struct dph_material_constants *constants, int channel, double d);

/* The slab's curve as a polynomial: T(d) = min(1, 1 / sum term[j] d^j), d >= 0, per channel, to
 * within `error` at every thickness (below 2e-4 in any medium). For a shader that knows the
 * material when it is compiled; takes about a millisecond. */
#define DPH_FIT_TERMS 7
struct dph_material_fit {
    float term[DPH_FIT_TERMS][3]; /* 1/mm^j                                                      */
    double error;                 /* largest error of T in a channel                             */
};

/* False: there is none, or its error is above 1e-3, and the curve itself has to be computed. That is so
 * with another curve than the slab's, and may be with an extinction below 1e-4 or less absorbed of it
 * than 1e-4. */
bool dph_material_fit(const struct dph_material_constants *constants, struct dph_material_fit *fit);

#ifdef __cplusplus
}
#endif
#endif
