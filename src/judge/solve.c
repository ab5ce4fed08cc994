/* Least squares of up to three unknowns that must not be negative.
 *
 * The answer is free in some unknowns and 0 in the others (C. L. Lawson, R. J. Hanson, "Solving
 * least squares problems", 1974, chapter 23). With three there are seven sets that can be free:
 * each is solved, and the best of the answers without a negative number is it. */
#include "judge/protocol.h"

#include "core/cholesky.h"

#include <string.h>

double dph_solve_nonnegative(int n, const double *matrix, const double *right, double *x)
{
    double best = 0; /* that of zeros */
    memset(x, 0, (size_t)n * sizeof *x);
    for (int set = 1; set < 1 << n; set++) {
        int member[3], k = 0;
        double a[6], b[3], value = 0;
        for (int i = 0; i < n; i++)
            if (set >> i & 1)
                member[k++] = i;
        for (int i = 0, at = 0; i < k; i++) {
            for (int j = 0; j <= i; j++)
                a[at++] = matrix[member[i] * n + member[j]];
            b[i] = right[member[i]];
        }
        if (!dph_cholesky_solve(k, a, b)) /* a picture is a sum of the others, or black */
            continue;
        bool positive = true;
        for (int i = 0; i < k; i++) {
            positive = positive && b[i] >= 0;
            value -= b[i] * right[member[i]]; /* at the least, x'Gx = h'x */
        }
        if (!positive || !(value < best))
            continue;
        best = value;
        memset(x, 0, (size_t)n * sizeof *x);
        for (int i = 0; i < k; i++)
            x[member[i]] = b[i];
    }
    return best;
}
