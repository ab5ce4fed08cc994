/* Least squares of up to three unknowns that must not be negative.
 *
 * The answer is free in some unknowns and 0 in the others (C. L. Lawson, R. J. Hanson, "Solving
 * least squares problems", 1974, chapter 23). With three there are seven sets that can be free:
 * each is solved by Cholesky's factors, and the best of the answers without a negative number is
 * it. */
#include "judge/protocol.h"

#include <math.h>
#include <string.h>

/* Solves the k x k system in place; false where it is singular. */
static bool solve(int k, double a[3][3], double b[3])
{
    for (int j = 0; j < k; j++) {
        double whole = a[j][j];
        for (int i = 0; i < j; i++)
            a[j][j] -= a[j][i] * a[j][i];
        if (!(a[j][j] > 1e-12 * whole)) /* this picture is a sum of the others, or black */
            return false;
        a[j][j] = sqrt(a[j][j]);
        for (int i = j + 1; i < k; i++) {
            for (int l = 0; l < j; l++)
                a[i][j] -= a[i][l] * a[j][l];
            a[i][j] /= a[j][j];
        }
    }
    for (int j = 0; j < k; j++) {
        for (int i = 0; i < j; i++)
            b[j] -= a[j][i] * b[i];
        b[j] /= a[j][j];
    }
    for (int j = k - 1; j >= 0; j--) {
        for (int i = j + 1; i < k; i++)
            b[j] -= a[i][j] * b[i];
        b[j] /= a[j][j];
    }
    return true;
}

double dph_solve_nonnegative(int n, const double *matrix, const double *right, double *x)
{
    double best = 0; /* that of zeros */
    memset(x, 0, (size_t)n * sizeof *x);
    for (int set = 1; set < 1 << n; set++) {
        int member[3], k = 0;
        double a[3][3], b[3], value = 0;
        for (int i = 0; i < n; i++)
            if (set >> i & 1)
                member[k++] = i;
        for (int i = 0; i < k; i++) {
            for (int j = 0; j < k; j++)
                a[i][j] = matrix[member[i] * n + member[j]];
            b[i] = right[member[i]];
        }
        if (!solve(k, a, b))
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
