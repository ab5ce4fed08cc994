/* diaphan/environment.h - distant light as spherical harmonics: surroundings, discs, and what may
 * be done to them. Tier 1.
 *
 * Radiance L(s) of light from far away in direction s (to the light) becomes l_i = integral of L
 * y_i, so that a transfer vector's dot product with l is what the light causes. World space is
 * right-handed, y up, as for dph_light_direction; coefficients are in the world's own axes until
 * they are turned into a body's. */
#ifndef DIAPHAN_ENVIRONMENT_H
#define DIAPHAN_ENVIRONMENT_H

#include <diaphan/sh.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The direction that a latitude-longitude picture shows at (x, y), pixels from the left upper
 * corner, of the centre of a pixel at .5: azimuth 180 - 360 x / width degrees and elevation 90 -
 * 180 y / height, hence +z in the middle, +x to the left of it and +y at the top, as OpenEXR has
 * it. */
void dph_environment_direction(int width, int height, double x, double y, double direction[3]);

/* Projects a latitude-longitude picture of linear radiance: `pixel` (height x width x
 * components), rows from the top, `components` >= 3, of which the first three are taken. Pixels
 * count by their exact solid angles. Radiance that is not a number or is negative counts as 0,
 * and above 1e30 as that. `coefficient` (3 x bands * bands), by channel. `bands`: 1 to
 * DPH_MAX_BANDS. `threads`: 0: as many as there are processors; the result does not depend on
 * it. False: DPH_ERROR_ARGUMENT (a side below 1, bands), DPH_ERROR_MEMORY. */
bool dph_environment_project(const float *pixel, int width, int height, int components, int bands,
                             int threads, double *coefficient, struct dph_error *err);

/* Light of irradiance 1 (on a plane perpendicular to it) that comes evenly from a disc of
 * `half_angle` degrees (0: a point; to 90) around a unit direction. `coefficient` (bands *
 * bands). No factor beyond that of the definition; see dph_sh_normalization. */
void dph_environment_disc(int bands, const double direction[3], double half_angle, double *coefficient);

/* The disc's zonal coefficients around the polar axis, `zonal` (bands): l_lm = sqrt(4 pi /
 * (2l+1)) zonal[l] y_lm(direction). */
void dph_environment_disc_zonal(int bands, double half_angle, double *zonal);

/* A_l of the clamped cosine: integral of max(0, n.s) y_lm(s) ds = A_l y_lm(n). pi, 2 pi / 3, pi
 * / 4, 0, -pi / 24, 0, ... `l` >= 0. */
double dph_sh_cosine(int l);

/* The factor that a point light needs so that an unshadowed surface facing it gets the full
 * irradiance from so few bands: 4/3, 16/17, 16/17, 32/31, 32/31 for 2 to 6. A matter of looks;
 * comparisons leave it out. */
double dph_sh_normalization(int bands);

/* Convolves a function (bands * bands), in place, with a kernel around the polar axis whose
 * zonal coefficients are `zonal` (bands). */
void dph_sh_convolve(int bands, const double *zonal, double *coefficient);

/* Turns a function: out(rotation s) = in(s), with a proper rotation, `rotation[3 * row +
 * column]`. `in` and `out` (bands * bands) may be the same. `bands`: 1 to DPH_MAX_BANDS. Exact
 * to rounding, by a quadrature that is exact for these degrees. */
void dph_sh_rotate(int bands, const double rotation[9], const double *in, double *out);

#ifdef __cplusplus
}
#endif
#endif
