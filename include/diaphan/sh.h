/* diaphan/sh.h - real spherical harmonics: values, directions, windows.      Tier 1.
 *
 * "n bands" means degrees l = 0 .. n-1, n*n functions; function (l, m) has index l(l+1)+m. The
 * basis is real, orthonormal over the sphere, and carries the Condon-Shortley sign (-1)^m: band
 * 1 is -y, z, -x times 0.4886. The polar axis is the third component of the direction, whatever
 * "up" is in the caller's scene. */
#ifndef DIAPHAN_SH_H
#define DIAPHAN_SH_H

#include <diaphan/error.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DPH_MAX_BANDS 8  /* of what is baked and stored                          */
#define DPH_DRAW_BANDS 6 /* of what is drawn: nine vec4 attributes               */

/* The bands * bands values at a unit direction. `bands`: 1 to 16 (beyond DPH_MAX_BANDS for
 * products of functions). Recurrences in Cartesian form, exact to rounding at the poles. */
void dph_sh_eval(int bands, const double direction[3], double *value /* (bands * bands) */);

/* Fills `count` unit directions, even over the sphere and of equal weight 4 pi / count: a
 * spherical Fibonacci set of count / 2 points and their opposites, direction 2k and 2k+1
 * opposite, turned as a whole so that no direction lies in a plane spanned by coordinate axes.
 * The same bits on every machine. `count`: even, 2 to 65536. */
void dph_sh_directions(int count, float *direction /* (count x 3) */);

/* Factors by band that damp ringing, applied to a light's values, never to what is stored. */
enum dph_window { DPH_WINDOW_NONE = 0, DPH_WINDOW_HANN, DPH_WINDOW_LANCZOS };

/* The factor of band `l` (0 <= l < bands) when `bands` bands are in use: Hann (1 + cos(pi l /
 * bands)) / 2, Lanczos sin(x) / x with x = pi l / bands. */
double dph_sh_window(enum dph_window window, int l, int bands);

#ifdef __cplusplus
}
#endif
#endif
