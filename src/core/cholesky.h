/* core/cholesky.h - a small symmetric positive definite system of linear equations.  Tier 0, private.
 *
 * In a header, so that a constant size becomes straight code. Eight systems at once: sh/system.h. */
#ifndef DPH_CORE_CHOLESKY_H
#define DPH_CORE_CHOLESKY_H

#include <math.h>
#include <stdbool.h>

/* A pivot that is less than this part of its diagonal element is rounding. */
#define DPH_CHOLESKY_LEAST 1e-12

/* Solves A x = b by Cholesky's factors, A = L L^T. `matrix` (n (n + 1) / 2): the lower triangle of A,
 * row after row, is replaced by L; `x` (n): b, is replaced by the solution. False: an equation says
 * nothing that those before it do not say; its unknown is 0. */
static inline bool dph_cholesky_solve(int n, double *matrix, double *x)
{
    bool definite = true;
    for (int i = 0; i < n; i++) {
        double *row = matrix + i * (i + 1) / 2;
        const double whole = row[i];
        for (int j = 0; j <= i; j++) {
            const double *above = matrix + j * (j + 1) / 2;
            for (int k = 0; k < j; k++)
                row[j] -= row[k] * above[k];
            if (j < i)
                row[j] /= above[j];
        }
        if (row[i] > DPH_CHOLESKY_LEAST * whole) {
            row[i] = sqrt(row[i]);
        } else {
            row[i] = INFINITY; /* what is divided by it is 0 */
            definite = false;
        }
        for (int k = 0; k < i; k++)
            x[i] -= row[k] * x[k];
        x[i] /= row[i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= matrix[k * (k + 1) / 2 + i] * x[k];
        x[i] /= matrix[i * (i + 1) / 2 + i];
    }
    return definite;
}

#endif
