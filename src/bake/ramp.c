/* The ramp of a response of one channel: colour as a function of the value.
 *
 * In a body of one material the hue of what comes out goes with its brightness: light that is dim
 * has gone a long way, and the longer the way, the more of the colour that is absorbed is gone. So
 * one channel and a curve through colours hold nearly all that three channels do. The curve also
 * mends what the one channel gets wrong everywhere alike: where a sum of few bands is 0, the light
 * on the average is not.
 *
 * With u = sqrt(value / top) and h_k the hat function around u = k / (entries - 1), the colours g_k
 * minimise, a channel each,
 *
 *     sum w (sum_k h_k(u) g_k - p)^2 + r sum_k (g_k - 3 g_k-1 + 3 g_k-2 - g_k-3)^2,
 *     w = weight / (v + e)^2,   g_k >= 0,
 *
 * v being the value that the vertex's own coefficients give for a direction, and p the colour of
 * the response that they are made from. The weight makes the error relative, down to e, a fiftieth
 * of the mean value, below which ringing and the noise of the bake are all there is. The second
 * term (r: 1e-4 of the mean diagonal of the equations) leads the curve on through entries without
 * samples; it is 0 for g = u^2 and its multiples, hence for a grey body. Of the
 * 24 unknowns those that come out negative are held at 0, and the rest is solved for again. */
#include "bake/ramp.h"

#include "core/cholesky.h"

#include <math.h>
#include <string.h>

enum { N = DPH_RAMP_ENTRIES };

#define FLOOR  .02
#define SMOOTH 1e-4
#define ANCHOR 1e-7 /* of grey, so that few samples leave nothing open */

/* Which entries a value lies between, and its share of the second. */
static int locate(double top, double value, double *share)
{
    double u = sqrt(fmax(value, 0) / top) * (N - 1);
    int k = u < N - 2 ? (int)u : N - 2;
    *share = fmin(u - k, 1);
    return k;
}

/* The solution of A x = b for those unknowns that are free; the others are 0. */
static void solve_free(double (*a)[N], const double b[N], const bool is_free[N], double x[N])
{
    double factor[N * (N + 1) / 2], some[N];
    int free_one[N], n = 0;
    for (int k = 0; k < N; k++) {
        x[k] = 0;
        if (is_free[k])
            free_one[n++] = k;
    }
    for (int i = 0, k = 0; i < n; i++) {
        some[i] = b[free_one[i]];
        for (int j = 0; j <= i; j++)
            factor[k++] = a[free_one[i]][free_one[j]];
    }
    dph_cholesky_solve(n, factor, some);
    for (int i = 0; i < n; i++)
        x[free_one[i]] = some[i];
}

static void solve_positive(double (*a)[N], const double b[N], double x[N])
{
    bool is_free[N], again = true;
    for (int k = 0; k < N; k++)
        is_free[k] = true;
    while (again) { /* at most N times */
        again = false;
        solve_free(a, b, is_free, x);
        for (int k = 0; k < N; k++)
            if (is_free[k] && x[k] < 0) {
                is_free[k] = false;
                again = true;
            }
    }
}

void dph_ramp_fit(const struct dph_ramp_sample *sample, size_t count, struct dph_ramp *ramp)
{
    static const double third[4] = {-1, 3, -3, 1};
    double a[N][N] = {{0}}, right[3][N] = {{0}}, mean = 0, all = 0, top = 0, trace = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(sample[i].weight > 0))
            continue;
        top = fmax(top, (double)sample[i].value);
        mean += (double)sample[i].weight * fmax((double)sample[i].value, 0);
        all += (double)sample[i].weight;
    }
    bool light = mean > 0;
    ramp->top = light ? (float)top : 1;
    for (int k = 0; k < N; k++)
        for (int c = 0; c < 3; c++)
            ramp->color[k][c] = (float)((double)ramp->top * k * k / ((N - 1) * (N - 1)));
    if (!light)
        return;
    top = (double)ramp->top;
    for (size_t i = 0; i < count; i++) {
        double v = fmax((double)sample[i].value, 0), share, e = v + FLOOR * mean / all;
        double w = (double)sample[i].weight / (e * e);
        int k = locate(top, v, &share);
        a[k][k] += w * (1 - share) * (1 - share);
        a[k + 1][k + 1] += w * share * share;
        a[k + 1][k] += w * share * (1 - share);
        for (int c = 0; c < 3; c++) {
            right[c][k] += w * (1 - share) * (double)sample[i].color[c];
            right[c][k + 1] += w * share * (double)sample[i].color[c];
        }
    }
    for (int k = 0; k < N; k++)
        trace += a[k][k];
    for (int k = 0; k + 3 < N; k++)
        for (int i = 0; i < 4; i++)
            for (int j = 0; j <= i; j++)
                a[k + i][k + j] += SMOOTH * trace / N * third[i] * third[j];
    for (int c = 0; c < 3; c++) {
        double color[N];
        for (int k = 0; k < N; k++) {
            a[k][k] += c == 0 ? ANCHOR * trace / N : 0;
            right[c][k] += ANCHOR * trace / N * (double)ramp->color[k][c];
        }
        solve_positive(a, right[c], color);
        for (int k = 0; k < N; k++)
            ramp->color[k][c] = (float)color[k];
    }
}

void dph_ramp_color(const struct dph_ramp *ramp, double value, double color[3])
{
    double share;
    int k = locate((double)ramp->top, value, &share);
    for (int c = 0; c < 3; c++)
        color[c] = (double)ramp->color[k][c] * (1 - share) + (double)ramp->color[k + 1][c] * share;
}
