/* sh/project.h - from thickness samples to coefficients, many positions at once.      Tier 1,
 * private.
 *
 * Samples come in antipodal pairs, pair k along directions 2k and 2k+1 of dph_sh_directions, as
 * columns over positions: plus[k * stride + p], minus[k * stride + p]. Projection is a blocked
 * matrix product; T(d) + T(-d) goes to the even bands and T(d) - T(-d) to the odd ones. Arrays over
 * positions are padded to a multiple of 8 and positions are processed 8 at a time, one a lane. Sums
 * run over the pairs in their order with one rounding a step, so the result does not depend on how
 * the pairs are cut into blocks, on threads, or on the processor. */
#ifndef DPH_SH_PROJECT_H
#define DPH_SH_PROJECT_H

#include <diaphan/thickness.h>

/* Tables for one set of directions. Read-only after creation, safe to share between threads. */
struct dph_projector;

/* `directions` even. `extinction` (fit weighted): the s of the weights exp(-2 s S), 1 / unit of the
 * samples. NULL: DPH_ERROR_MEMORY. */
struct dph_projector *dph_projector_create(int bands, int directions, enum dph_fit fit,
                                           double extinction, bool portable, struct dph_error *err);
void dph_projector_destroy(struct dph_projector *projector);

/* Floats of running sums a position (the caller keeps (npos rounded up to 8) * this many, zeroed,
 * 32-byte aligned). */
size_t dph_projector_sums(const struct dph_projector *projector);

/* Adds pairs first .. first + count - 1 of positions begin .. end - 1 (multiples of 8) to `sums`.
 * `plus` and `minus` are the panel's first column, `normal` (npos padded x 3) the positions' unit
 * normals (used by the weighted fit only). */
void dph_projector_add(const struct dph_projector *projector, int first, int count,
                       const float *plus, const float *minus, size_t stride, const float *normal,
                       size_t begin, size_t end, float *sums);

/* Turns the sums of positions begin .. end - 1 (multiples of 8) into coefficients (npos padded x
 * bands * bands). */
void dph_projector_solve(const struct dph_projector *projector, const float *sums, size_t begin,
                         size_t end, float *coefficient);

#endif
