/* bake/smooth.h - takes noise out of SH rows by smoothing them over the surface, as much as they
 * bear.      Tier 2, private.
 *
 * Rows come as two halves, each the truth and noise of its own. What a smoothing loses in detail
 * and gains in noise follows from comparing one smoothed half with the other as it is; so every
 * place and band gets the smoothing that serves it, which may be none. */
#ifndef DPH_BAKE_SMOOTH_H
#define DPH_BAKE_SMOOTH_H

#include <diaphan/error.h>

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The answer sought is (half[0] + half[1]) times `scale`, whose halves, twice that, have noise of
 * equal strength. */
struct dph_smooth_rows {
    const float *half[2]; /* (npos x channels x bands * bands) */
    float scale;
    int channels, bands;
};

struct dph_smoother;

/* For positions (npos x 3) with unit normals (npos x 3), areas (npos) and triangles (ntri x 3,
 * indices < npos), which it borrows. NULL: DPH_ERROR_MEMORY. */
struct dph_smoother *dph_smoother_create(const float *position, const float *normal,
                                         const float *area, size_t npos, const uint32_t *index,
                                         size_t ntri, int threads, struct dph_error *err);
void dph_smoother_destroy(struct dph_smoother *smoother);

/* Chooses how much to smooth where. `left`: the share of the plain answer's squared error that the
 * smoothed one is expected to have, at most 1; first `checked` bands, weighted with
 * the areas. False: DPH_ERROR_MEMORY. */
bool dph_smoother_choose(struct dph_smoother *smoother, const struct dph_smooth_rows *rows,
                         int checked, double *left, struct dph_error *err);

/* Adds the smoothed answer to `row` (npos x channels x bands * bands), as chosen. */
void dph_smoother_add(const struct dph_smoother *smoother, const struct dph_smooth_rows *rows,
                      float *row);

#endif
