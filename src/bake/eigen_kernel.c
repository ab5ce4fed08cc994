/* Eigenvalues and eigenvectors of a symmetric matrix: Householder's reduction to tridiagonal form,
 * then QL with implicit shifts (Wilkinson, Reinsch, Handbook for Automatic Computation II, 1971;
 * Golub, Van Loan, Matrix Computations, 8.3).
 *
 * A = Q T Q^T with Q a product of reflections I - b v v^T, each of which clears a column below the
 * first subdiagonal. T is made diagonal by plane rotations, Wilkinson's shift making the last
 * off-diagonal number vanish cubically; the rotations act on Q^T, whose rows become the
 * eigenvectors.
 *
 * All long loops add multiples of rows to rows, so they run as wide as the processor's registers
 * without changing the order of any sum. */
#include "bake/eigen.h"
#include "core/simd.h"

#include <float.h>
#include <math.h>

static inline void add_row(int n, double factor, const double *from, double *to)
{
    for (int i = 0; i < n; i++)
        to[i] += factor * from[i];
}

/* Row k of `a` keeps the vector of reflection k from column k + 1 on, factor[k] its b (0: no
 * reflection). `p` is scratch. */
static void reduce(int n, double *a, double *diagonal, double *beside, double *factor, double *p)
{
    for (int k = 0; k < n; k++) {
        double *row = a + (long)k * n; /* by symmetry also the column */
        int first = k + 1, rest = n - first;
        diagonal[k] = row[k];
        beside[k] = factor[k] = 0;
        if (!rest)
            break;
        double tail = 0;
        for (int i = first + 1; i < n; i++)
            tail += row[i] * row[i];
        beside[k] = row[first];
        if (!(tail > 0))
            continue;
        double length = sqrt(row[first] * row[first] + tail);
        double alpha = row[first] > 0 ? -length : length;
        row[first] -= alpha;
        beside[k] = alpha;
        double b = factor[k] = 2 / (row[first] * row[first] + tail);
        if (!(b < DBL_MAX)) {
            factor[k] = 0;
            continue;
        }
        /* A - v q^T - q v^T with q = b (A v - b (v.Av) v / 2) */
        double *v = row + first, *q = p + first, along = 0;
        for (int i = 0; i < rest; i++)
            q[i] = 0;
        for (int i = 0; i < rest; i++)
            add_row(rest, b * v[i], a + (long)(first + i) * n + first, q);
        for (int i = 0; i < rest; i++)
            along += v[i] * q[i];
        add_row(rest, -b * along / 2, v, q);
        for (int i = 0; i < rest; i++) {
            double *target = a + (long)(first + i) * n + first, vi = v[i], qi = q[i];
            for (int j = 0; j < rest; j++)
                target[j] -= vi * q[j] + qi * v[j];
        }
    }
}

/* `vector` = Q, from the last reflection to the first: each touches only the block behind its row. */
static void accumulate_reflections(int n, const double *a, const double *factor, double *vector, double *p)
{
    for (long i = 0; i < (long)n * n; i++)
        vector[i] = i % (n + 1) == 0;
    for (int k = n - 3; k >= 0; k--) {
        int first = k + 1, rest = n - first;
        const double *v = a + (long)k * n + first;
        if (!(factor[k] > 0))
            continue;
        for (int i = 0; i < rest; i++)
            p[i] = 0;
        for (int i = 0; i < rest; i++)
            add_row(rest, v[i], vector + (long)(first + i) * n + first, p);
        for (int i = 0; i < rest; i++)
            add_row(rest, -factor[k] * v[i], p, vector + (long)(first + i) * n + first);
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++) {
            double keep = vector[(long)i * n + j];
            vector[(long)i * n + j] = vector[(long)j * n + i];
            vector[(long)j * n + i] = keep;
        }
}

static inline void rotate_rows(int n, double c, double s, double *low, double *high)
{
    for (int i = 0; i < n; i++) {
        double h = high[i], l = low[i];
        high[i] = s * l + c * h;
        low[i] = c * l - s * h;
    }
}

/* d: diagonal, e[i] beside d[i] and d[i + 1]. Matrices that resist for more than 60 rounds do not
 * occur; vectors stay orthonormal in any case. */
static void diagonalise(int n, double *d, double *e, double *vector)
{
    double largest = 0;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, fmax(fabs(d[i]), fabs(e[i])));
    for (int l = 0; l < n; l++)
        for (int round = 0; round < 60; round++) {
            int m = l;
            while (m < n - 1 && fabs(e[m]) > DBL_EPSILON * (fabs(d[m]) + fabs(d[m + 1])) &&
                   fabs(e[m]) > DBL_EPSILON * DBL_EPSILON * largest)
                m++;
            if (m == l)
                break;
            double g = (d[l + 1] - d[l]) / (2 * e[l]), r = sqrt(g * g + 1);
            g = d[m] - d[l] + e[l] / (g + (g < 0 ? -r : r));
            double s = 1, c = 1, p = 0;
            int i;
            for (i = m - 1; i >= l; i--) {
                double f = s * e[i], b = c * e[i];
                r = sqrt(f * f + g * g);
                e[i + 1] = r;
                if (!(r > 0)) { /* the matrix falls apart here */
                    d[i + 1] -= p;
                    e[m] = 0;
                    break;
                }
                s = f / r;
                c = g / r;
                g = d[i + 1] - p;
                r = (d[i] - g) * s + 2 * c * b;
                p = s * r;
                d[i + 1] = g + p;
                g = c * r - b;
                rotate_rows(n, c, s, vector + (long)i * n, vector + (long)(i + 1) * n);
            }
            if (i >= l)
                continue;
            d[l] -= p;
            e[l] = g;
            e[m] = 0;
        }
}

static void sort(int n, double *value, double *vector)
{
    for (int i = 0; i < n; i++) {
        int best = i;
        for (int j = i + 1; j < n; j++)
            best = value[j] > value[best] ? j : best;
        double keep = value[i];
        value[i] = value[best];
        value[best] = keep;
        double *a = vector + (long)i * n, *b = vector + (long)best * n, largest = 0;
        for (int k = 0; k < n && best != i; k++) {
            keep = a[k];
            a[k] = b[k];
            b[k] = keep;
        }
        for (int k = 0; k < n; k++)
            largest = fabs(a[k]) > fabs(largest) ? a[k] : largest;
        for (int k = 0; k < n && largest < 0; k++)
            a[k] = -a[k];
    }
}

void DPH_KERNEL(dph_eigen)(int n, double *a, double *value, double *vector, double *scratch)
{
    double *beside = scratch, *factor = scratch + n, *p = scratch + 2 * n;
    reduce(n, a, value, beside, factor, p);
    accumulate_reflections(n, a, factor, vector, p);
    diagonalise(n, value, beside, vector);
    sort(n, value, vector);
}

static double dot(int n, const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Orthogonal iteration (Golub, Van Loan, 7.3.2): products with the matrix, made orthonormal by
 * Gram and Schmidt's method, twice against rounding. */
bool DPH_KERNEL(dph_subspace)(int n, int rows, const double *a, double *vector, double *scratch)
{
    enum { STEPS = 3 };
    for (int step = 0; step < STEPS; step++) {
        for (int j = 0; j < rows; j++) {
            double *to = scratch + (long)j * n, *from = vector + (long)j * n;
            for (int i = 0; i < n; i++)
                to[i] = 0;
            for (int i = 0; i < n; i++)
                add_row(n, from[i], a + (long)i * n, to);
        }
        for (int j = 0; j < rows; j++) {
            double *row = scratch + (long)j * n, before = dot(n, row, row);
            for (int pass = 0; pass < 2; pass++)
                for (int k = 0; k < j; k++) {
                    const double *other = vector + (long)k * n;
                    add_row(n, -dot(n, row, other), other, row);
                }
            double after = dot(n, row, row);
            if (!(after > 1e-20 * before && after > 1e-200))
                return false;
            double length = sqrt(after);
            for (int i = 0; i < n; i++)
                vector[(long)j * n + i] = row[i] / length;
        }
    }
    return true;
}
