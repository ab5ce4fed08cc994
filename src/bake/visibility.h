/* bake/visibility.h - light that reaches the positions of a body from far away, past the body
 * itself.      Tier 2, private. */
#ifndef DPH_BAKE_VISIBILITY_H
#define DPH_BAKE_VISIBILITY_H

#include <diaphan/error.h>
#include <stdint.h>

/* A mesh ready for it. Results have a row a position, in the sweep's order, in which neighbours
 * in space are neighbours in memory; rows are padded to a multiple of eight floats with zeros. */
struct dph_visibility;

struct dph_visibility_params {
    int bands, directions; /* directions even                                                      */
    int threads;           /* at least 1                                                           */
    bool portable;
    dph_progress *progress; /* Nullable                                                            */
    void *progress_user;
    double progress_begin, progress_span; /* of one pass over the directions                       */
};

/* Keeps a pointer to `position`; takes the angle-weighted normals. NULL: DPH_ERROR_MEMORY. */
struct dph_visibility *dph_visibility_create(const float *position, size_t npos, const uint32_t *index,
                                             size_t ntri, const struct dph_visibility_params *params,
                                             struct dph_error *err);
void dph_visibility_destroy(struct dph_visibility *visibility);

/* Floats of a row. */
size_t dph_visibility_stride(const struct dph_visibility *visibility);

/* Row k belongs to position order[k]. (npos) */
const uint32_t *dph_visibility_order(const struct dph_visibility *visibility);

/* Unit normals in the caller's order. (npos x 3) */
const float *dph_visibility_normals(const struct dph_visibility *visibility);

/* E_i = integral of V max(0, n.s) Ft(ior, n.s) y_i(s) ds. `out` (npos x stride). False:
 * DPH_ERROR_MEMORY, _CANCELLED. */
bool dph_visibility_irradiance(struct dph_visibility *visibility, double ior, float *out,
                               struct dph_error *err);

/* Irradiance from the body's own surface, which sends out what `from` says evenly: integral of
 * (1 - V) max(0, n.s) from(q(s)) ds, with q the surface point seen along s from outside,
 * interpolated between its triangle's positions. Both (npos x stride). False: DPH_ERROR_MEMORY,
 * _CANCELLED. */
bool dph_visibility_bounce(struct dph_visibility *visibility, const float *from, float *out,
                           struct dph_error *err);

/* Wall clock of all passes so far. */
void dph_visibility_seconds(const struct dph_visibility *visibility, double *sweep, double *project);

#endif
