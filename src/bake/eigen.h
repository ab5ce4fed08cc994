/* bake/eigen.h - eigenvalues and eigenvectors of symmetric matrices.      Tier 2, private. */
#ifndef DPH_BAKE_EIGEN_H
#define DPH_BAKE_EIGEN_H

/* Decomposes the symmetric matrix `a` (n x n), which is destroyed. `value` (n) gets the eigenvalues, falling; row j of `vector` (n x n) the
 * unit eigenvector of value[j], its largest number positive. `scratch`: 3 n doubles. The same bits on every processor. */
void dph_eigen_avx2(int n, double *a, double *value, double *vector, double *scratch);
void dph_eigen_portable(int n, double *a, double *value, double *vector, double *scratch);

#endif
