/* bake/cpca_kernel.h - the two loops of CPCA in which the time goes.      Tier 2, private.
 *
 * Signals lie in tiles of 16: number i of signal s of a tile is at 16 i + s. */
#ifndef DPH_BAKE_CPCA_KERNEL_H
#define DPH_BAKE_CPCA_KERNEL_H

#include <stddef.h>
#include <stdint.h>

enum { CPCA_TILE = 16, CPCA_GROUP = 4 };

/* All clusters with the vectors in use: columns of a cluster's table are the mean and then the
 * vectors. */
struct dph_cpca_model {
    int n, clusters, vectors;
    const float *column; /* (clusters x n x (1 + vectors))                                          */
    const float *offset; /* (clusters x (1 + vectors)) |mean|^2, then mean . vector                  */
};

/* The cluster with the least squared error of each signal of `ntile` tiles; equal ones: the first.
 * The error is 0 at least. */
void dph_cpca_assign_avx2(const struct dph_cpca_model *model, const float *tile, size_t ntile,
                          int32_t *cluster, float *error);
void dph_cpca_assign_portable(const struct dph_cpca_model *model, const float *tile, size_t ntile,
                              int32_t *cluster, float *error);

/* covariance (n x n) += sum of r_s r_s^T over `count` signals, those of one cluster in `member`,
 * with r = root of importance * (signal - mean). Only the part j <= i is filled. `importance` is
 * Nullable; `scratch`: 4 n doubles. */
void dph_cpca_covariance_avx2(int n, const float *tile, const uint32_t *member, size_t count,
                              const float *importance, const double *mean, double *covariance,
                              double *scratch);
void dph_cpca_covariance_portable(int n, const float *tile, const uint32_t *member, size_t count,
                                  const float *importance, const double *mean, double *covariance,
                                  double *scratch);

#endif
