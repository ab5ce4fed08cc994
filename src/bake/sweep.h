/* bake/sweep.h - thickness of all positions along a direction and its opposite, without rays.
 * Tier 2, private. */
#ifndef DPH_BAKE_SWEEP_H
#define DPH_BAKE_SWEEP_H

#include <diaphan/thickness.h>

/* A mesh prepared for sweeps: centred, scaled to unit size, ordered in space. Read-only, safe to
 * share between threads. It keeps a pointer to the caller's positions. */
struct dph_sweep;

/* `position` (npos x 3): distinct, finite, and kept by the caller as long as the sweep lives.
 * `index` (ntri x 3), each < npos. NULL: DPH_ERROR_MEMORY. */
struct dph_sweep *dph_sweep_create(const float *position, size_t npos, const uint32_t *index,
                                   size_t ntri, bool portable, struct dph_error *err);
void dph_sweep_destroy(struct dph_sweep *sweep);

/* Results come in the sweep's own order, in which neighbours in space are neighbours in memory:
 * value k belongs to position order[k]. (npos) */
const uint32_t *dph_sweep_order(const struct dph_sweep *sweep);

/* Scratch memory of one thread. NULL: DPH_ERROR_MEMORY. */
struct dph_sweep_scratch;
struct dph_sweep_scratch *dph_sweep_scratch_create(const struct dph_sweep *sweep,
                                                   struct dph_error *err);
void dph_sweep_scratch_destroy(struct dph_sweep_scratch *scratch);

/* Thickness along +direction and -direction (unit length) of every position, in the unit of the
 * input, in the sweep's order. `plus`, `minus` (npos rounded up to a multiple of 8; the padding
 * is set to 0). `bad_plus`, `bad_minus` (npos), Nullable: 1 where the hit balance is wrong and
 * the value is the first exit (0: none). Returns the number of bad values. */
size_t dph_sweep_run(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                     enum dph_definition definition, const double direction[3], float *plus,
                     float *minus, uint8_t *bad_plus, uint8_t *bad_minus);

/* The nearest crossing along +direction and -direction of every position, in the sweep's order:
 * its distance in the unit of the input, positive where matter is entered there (the triangle
 * shows its outside), negative where it is left (its inside), INFINITY where there is no
 * crossing, so that the ray is free. (npos rounded up to a multiple of 8; the padding is free.)
 * `near_plus`, `near_minus` (npos rounded up likewise), both or neither Nullable: the crossed
 * triangles, in the sweep's own numbering, -1 where there is none. False: DPH_ERROR_MEMORY (only
 * where triangles are asked for, at the scratch's first time). */
bool dph_sweep_nearest(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                       const double direction[3], float *plus, float *minus, int32_t *near_plus,
                       int32_t *near_minus, struct dph_error *err);

/* Corners of the sweep's triangles (x 3), positions in the sweep's order. */
const uint32_t *dph_sweep_corners(const struct dph_sweep *sweep);

#endif
