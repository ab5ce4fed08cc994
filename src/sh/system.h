/* sh/system.h - eight small systems of linear equations at once.      Tier 1, private to kernels.
 *
 * Symmetric and positive definite ones, one a lane, by L D L^T (Cholesky without roots). The matrix
 * is its lower triangle, row after row. */
#ifndef DPH_SH_SYSTEM_H
#define DPH_SH_SYSTEM_H

#include "core/simd.h"

enum { DPH_SYSTEM_MAX = 64 }; /* unknowns */

/* `rows` (a constant) consecutive entries of column j below the diagonal: (A_ij - sum_k<j L_ik D_k
 * L_jk) / D_j. `scaled` holds D_k L_jk. Several rows at once use each of those for several
 * products. */
static inline __attribute__((always_inline)) void
eliminate(const int rows, dph_f8 *matrix, int i, int j, const dph_f8 *scaled, dph_f8 inverse)
{
    dph_f8 *row0 = matrix + i * (i + 1) / 2, *row1 = row0 + (rows > 1 ? i + 1 : 0);
    dph_f8 *row2 = row1 + (rows > 2 ? i + 2 : 0), *row3 = row2 + (rows > 3 ? i + 3 : 0);
    dph_f8 a0 = row0[j], a1 = row1[j], a2 = row2[j], a3 = row3[j];
    for (int k = 0; k < j; k++) {
        dph_f8 m = scaled[k];
        a0 -= row0[k] * m;
        if (rows > 1) {
            a1 -= row1[k] * m;
            a2 -= row2[k] * m;
            a3 -= row3[k] * m;
        }
    }
    row0[j] = a0 * inverse;
    if (rows > 1) {
        row1[j] = a1 * inverse;
        row2[j] = a2 * inverse;
        row3[j] = a3 * inverse;
    }
}

/* Solves A x = b for `matrix` A and `x` b (n): replaces A by L below the diagonal and 1 / D on it,
 * then x by the solution. `least`: what a pivot is at least. */
static inline void dph_system_solve(int n, dph_f8 *matrix, dph_f8 least, dph_f8 *x)
{
    dph_f8 diagonal[DPH_SYSTEM_MAX], scaled[DPH_SYSTEM_MAX];
    for (int j = 0; j < n; j++) {
        dph_f8 *row = matrix + j * (j + 1) / 2, pivot = row[j];
        for (int k = 0; k < j; k++) {
            scaled[k] = row[k] * diagonal[k];
            pivot -= row[k] * scaled[k];
        }
        diagonal[j] = dph_f8_max(pivot, least);
        dph_f8 inverse = dph_f8_set(1) / diagonal[j];
        row[j] = inverse;
        int i = j + 1;
        for (; i + 4 <= n; i += 4)
            eliminate(4, matrix, i, j, scaled, inverse);
        for (; i < n; i++)
            eliminate(1, matrix, i, j, scaled, inverse);
    }
    for (int i = 1; i < n; i++) {
        const dph_f8 *row = matrix + i * (i + 1) / 2;
        for (int k = 0; k < i; k++)
            x[i] -= row[k] * x[k];
    }
    for (int i = 0; i < n; i++)
        x[i] *= matrix[i * (i + 1) / 2 + i];
    for (int i = n - 1; i > 0; i--) {
        const dph_f8 *row = matrix + i * (i + 1) / 2;
        for (int k = 0; k < i; k++)
            x[k] -= row[k] * x[i];
    }
}

#endif
