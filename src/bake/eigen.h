/* bake/eigen.h - eigenvalues and eigenvectors of symmetric matrices.      Tier 2, private. */
#ifndef DPH_BAKE_EIGEN_H
#define DPH_BAKE_EIGEN_H

#include <stdbool.h>

/* Decomposes the symmetric matrix `a` (n x n), which is destroyed. `value` (n) gets the
 * eigenvalues, falling; row j of `vector` (n x n) the unit eigenvector of value[j], its largest
 * number positive. `scratch`: 3 n doubles. The same bits on every processor. */
void dph_eigen_avx2(int n, double *a, double *value, double *vector, double *scratch);
void dph_eigen_portable(int n, double *a, double *value, double *vector, double *scratch);

/* Turns `rows` orthonormal vectors (rows x n) towards the leading eigenvectors of `a`, a positive
 * semidefinite matrix, by a few steps that cost little; the better they are before, the better
 * they are after. `scratch`: rows x n doubles. False: `a` has not that many directions, `vector`
 * holds nothing of use. The same bits on every processor. */
bool dph_subspace_avx2(int n, int rows, const double *a, double *vector, double *scratch);
bool dph_subspace_portable(int n, int rows, const double *a, double *vector, double *scratch);

#endif
