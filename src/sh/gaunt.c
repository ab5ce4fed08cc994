/* Products of spherical harmonics: the coefficients of J. A. Gaunt (Phil. Trans. R. Soc. A 228,
 * 1929) for the real basis.
 *
 * The product of two functions of degrees l1 and l2 is a polynomial of degree l1 + l2, so it is a
 * finite sum of functions,
 *
 *     y_i y_j = sum_LM G(i, j; LM) y_LM,     G(i, j; LM) = integral of y_i y_j y_LM over the sphere.
 *
 * Few terms are there: |l1 - l2| <= L <= l1 + l2 with l1 + l2 + L even, and, because cos(a phi)
 * cos(b phi) and its likes are sums over a + b and |a - b|, |M| is |m1| + |m2| or their difference;
 * M is negative (a sine) when one of m1, m2 is.
 *
 * The integral needs no closed form with factorials: Gauss-Legendre nodes in z times equal steps in
 * longitude integrate polynomials of degree 4 (bands - 1) exactly, which makes it one short sum,
 * right to 1e-14. */
#include "sh/gaunt.h"

#include "core/memory.h"

#include <diaphan/sh.h>

#include <assert.h>
#include <math.h>
#include <stdlib.h>

enum { MERIDIANS = 32 }; /* more than 4 (8 - 1) */

/* Node `i` of n on [-1, 1] and its weight, by Newton's method on the Legendre polynomial
 * (Abramowitz and Stegun, 25.4.29). */
static double gauss_legendre(int n, int i, double *weight)
{
    double z = cos(3.14159265358979323846 * (i + .75) / (n + .5)), slope = 1;
    for (int step = 0; step < 8; step++) {
        double before = 1, p = z;
        for (int k = 2; k <= n; k++) {
            double next = ((2 * k - 1) * z * p - (k - 1) * before) / k;
            before = p;
            p = next;
        }
        slope = n * (z * p - before) / (z * z - 1);
        z -= p / slope;
    }
    *weight = 2 / ((1 - z * z) * slope * slope);
    return z;
}

/* Values of `bands` bands at all nodes, one function after the other: value[f * points + node];
 * weights likewise. */
static void tabulate(int bands, int rings, double *value, double *weight)
{
    int functions = bands * bands, points = rings * MERIDIANS, node = 0;
    double y[16 * 16];
    /* an eighth of a quarter turn, from square roots alone */
    double quarter = sqrt(.5), eighth = sqrt((1 + quarter) / 2);
    double step_cos = sqrt((1 + eighth) / 2), step_sin = sqrt((1 - eighth) / 2);
    for (int ring = 0; ring < rings; ring++) {
        double share, z = gauss_legendre(rings, ring, &share), r = sqrt(1 - z * z);
        double c = 1, s = 0;
        for (int k = 0; k < MERIDIANS; k++, node++) {
            dph_sh_eval(bands, (double[3]){r * c, r * s, z}, y);
            weight[node] = share * 2 * 3.14159265358979323846 / MERIDIANS;
            for (int f = 0; f < functions; f++)
                value[(size_t)f * (size_t)points + (size_t)node] = y[f];
            double turned = step_cos * c - step_sin * s;
            s = step_cos * s + step_sin * c;
            c = turned;
        }
    }
}

/* The terms of one product; the caller's arrays hold 2 * 8 of them for every one of 8 degrees. */
static uint32_t expand(int l1, int m1, int l2, int m2, const double *value, const double *product,
                       int points, uint16_t *index, float *factor)
{
    uint32_t count = 0;
    int sign = (m1 < 0) != (m2 < 0) ? -1 : 1;
    int orders[2] = {abs(m1) + abs(m2), abs(abs(m1) - abs(m2))};
    for (int l = abs(l1 - l2); l <= l1 + l2; l += 2) {
        for (int o = 0; o < (orders[0] == orders[1] ? 1 : 2); o++) {
            int m = sign * orders[o];
            if (orders[o] > l || (sign < 0 && m == 0))
                continue;
            int f = l * (l + 1) + m;
            const double *y = value + (size_t)f * (size_t)points;
            double sum = 0;
            for (int k = 0; k < points; k++)
                sum += product[k] * y[k];
            if (fabs(sum) < 1e-9)
                continue;
            index[count] = (uint16_t)f;
            factor[count++] = (float)sum;
        }
    }
    return count;
}

bool dph_gaunt_init(struct dph_gaunt *gaunt, int bands)
{
    assert(bands >= 1 && bands <= 8);
    int n = bands * bands, rings = 2 * bands, points = rings * MERIDIANS;
    size_t pairs = (size_t)(n * (n + 1) / 2), room = pairs * (size_t)(2 * bands);
    size_t functions = (size_t)((2 * bands - 1) * (2 * bands - 1));
    double *value = dph_alloc(functions * (size_t)points, sizeof *value);
    double *weight = dph_alloc((size_t)points, sizeof *weight);
    double *product = dph_alloc((size_t)points, sizeof *product);
    *gaunt = (struct dph_gaunt){
        .start = dph_alloc(pairs + 1, sizeof *gaunt->start),
        .index = dph_alloc(room, sizeof *gaunt->index),
        .factor = dph_alloc(room, sizeof *gaunt->factor),
    };
    bool ok = value && weight && product && gaunt->start && gaunt->index && gaunt->factor;
    if (ok) {
        size_t pair = 0;
        uint32_t terms = 0;
        tabulate(2 * bands - 1, rings, value, weight);
        for (int l1 = 0; l1 < bands; l1++) {
            for (int m1 = -l1; m1 <= l1; m1++) {
                int i = l1 * (l1 + 1) + m1;
                const double *yi = value + (size_t)i * (size_t)points;
                for (int j = 0; j <= i; j++) {
                    int l2 = (int)sqrt((double)j), m2 = j - l2 * (l2 + 1);
                    const double *yj = value + (size_t)j * (size_t)points;
                    for (int k = 0; k < points; k++)
                        product[k] = weight[k] * yi[k] * yj[k];
                    gaunt->start[pair++] = terms;
                    terms += expand(l1, m1, l2, m2, value, product, points, gaunt->index + terms,
                                    gaunt->factor + terms);
                }
            }
        }
        gaunt->start[pair] = terms;
        assert(terms <= room);
    } else {
        dph_gaunt_finish(gaunt);
    }
    free(value);
    free(weight);
    free(product);
    return ok;
}

void dph_gaunt_finish(struct dph_gaunt *gaunt)
{
    free(gaunt->start);
    free(gaunt->index);
    free(gaunt->factor);
    *gaunt = (struct dph_gaunt){0};
}
