/* The slab's transmittance as the reciprocal of a polynomial, fitted to one medium.
 *
 * 1 / T(d) = sinh(str (d + 2 ze)) / sinh(str (zr + ze)) is smooth and grows, and where it has grown
 * past some thousands T is dark. So a polynomial P of degree six serves where T counts, beyond it
 * only has to stay large, and a shader that knows the medium when it is compiled needs six
 * multiplications and a quotient a channel.
 *
 * The largest of |min(1, 1 / P) - T| over d is to be as small as possible. That is a minimax problem,
 * solved by C. L. Lawson's reweighting (thesis, University of California, 1961): least squares whose
 * weights are multiplied by the errors that they leave, until the errors are level. The error is
 * (1 - P T) / P, linear in P once 1 / P is taken from the step before. Where T is capped there is
 * none as long as P is at most 1.
 *
 * Scaled by extinction, media differ in their albedo only: over all of it the error is below 2e-4,
 * but for albedos so close to 1 that P is nearly linear and its highest terms are rounding. What is
 * returned was tried in floats, at thicknesses much closer than those of the fit. */
#include <diaphan/material.h>

#include <float.h>
#include <math.h>
#include <string.h>

enum { N = DPH_FIT_TERMS, POINTS = 160, CAPPED = 16, STEPS = 60, TRIALS = 1500 };

static const double DARK = 2e-4;  /* T from which on a fit has no points   */
static const double FAR = 1e8;    /* times the depth of the cap: last trial */
static const double LIMIT = 1e-3; /* the largest error that passes          */

/* Solves a x = b in place by Gaussian elimination; x comes in b. False: singular. */
static bool solve(double a[N][N], double b[N])
{
    for (int i = 0; i < N; i++) {
        int pivot = i;
        for (int r = i + 1; r < N; r++)
            if (fabs(a[r][i]) > fabs(a[pivot][i]))
                pivot = r;
        if (!(fabs(a[pivot][i]) > 0))
            return false;
        for (int c = 0; c < N; c++) {
            double swap = a[i][c];
            a[i][c] = a[pivot][c];
            a[pivot][c] = swap;
        }
        const double swap = b[i];
        b[i] = b[pivot];
        b[pivot] = swap;
        for (int r = i + 1; r < N; r++) {
            double factor = a[r][i] / a[i][i];
            for (int c = i; c < N; c++)
                a[r][c] -= factor * a[i][c];
            b[r] -= factor * b[i];
        }
    }
    for (int i = N; i-- > 0;) {
        for (int c = i + 1; c < N; c++)
            b[i] -= a[i][c] * b[c];
        b[i] /= a[i][i];
    }
    return true;
}

static double polynomial(const double c[N], double x)
{
    double sum = 0;
    for (int j = N; j-- > 0;)
        sum = sum * x + c[j];
    return sum;
}

/* Lawson's steps at the points x, thickness over the largest; c: the best that was met. */
static void minimax(const double x[POINTS], const double t[POINTS], double c[N])
{
    double weight[POINTS], share[POINTS], best = INFINITY;
    for (int i = 0; i < POINTS; i++) {
        weight[i] = 1;
        share[i] = t[i];
    }
    for (int step = 0; step < STEPS; step++) {
        double a[N][N] = {{0}}, b[N] = {0}, error[POINTS], largest = 0, sum = 0;
        for (int i = 0; i < POINTS; i++) {
            double power[N] = {1}, w = weight[i] * share[i] * share[i];
            for (int j = 1; j < N; j++)
                power[j] = power[j - 1] * x[i];
            for (int r = 0; r < N; r++) {
                for (int k = 0; k < N; k++)
                    a[r][k] += w * t[i] * t[i] * power[r] * power[k];
                b[r] += w * t[i] * power[r];
            }
        }
        if (!solve(a, b))
            return;
        for (int i = 0; i < POINTS; i++) {
            double p = polynomial(b, x[i]), got = p > 0 ? fmin(1, 1 / p) : i < CAPPED ? 1 : 2;
            error[i] = fabs(got - t[i]);
            largest = fmax(largest, error[i]);
            share[i] = fmin(fmax(p > 0 ? 1 / p : INFINITY, .3 * t[i]), 3 * t[i]);
        }
        if (largest < best) {
            best = largest;
            memcpy(c, b, sizeof b);
        }
        for (int i = 0; i < POINTS; i++)
            sum += weight[i] *= error[i] / fmax(largest, 1e-300) + 1e-3;
        for (int i = 0; i < POINTS; i++)
            weight[i] *= POINTS / sum;
    }
}

/* 1 / P as a shader has it, see dph_transmittance in diaphan.glsl; NaN where P is not above 0. */
static double reciprocal(const float c[N], float d)
{
    float s = d * d;
    float p = (c[0] + c[1] * d) + s * ((c[2] + c[3] * d) + s * ((c[4] + c[5] * d) + s * c[6]));
    return p > 0 ? fmin(1, 1 / (double)p) : (double)NAN;
}

/* Fits one channel; returns the largest error that was found, infinite where there is no fit. */
static double fit_channel(const struct dph_material_constants *constants, int channel, float out[N])
{
    double rate = (double)constants->rate[channel], offset = (double)constants->offset[channel];
    double numerator = (double)constants->numerator[channel];
    double x[POINTS], t[POINTS], c[N] = {0};
    memset(out, 0, N * sizeof *out);
    if (numerator >= 1e30) { /* nothing is lost in there */
        out[0] = 1;
        return 0;
    }
    const double cap = offset / 4; /* zr - ze = 1 / (3 t'), where T reaches 1 */
    double dark = cap;
    while (dark < FAR * cap && dph_material_transmittance(constants, channel, dark) > DARK)
        dark *= 1.1;
    if (rate > 0) {
        for (int i = 0; i < POINTS; i++) {
            double d = i < CAPPED ? cap * i / CAPPED
                                  : cap * pow(dark / cap, (double)(i - CAPPED) /
                                                              (POINTS - 1 - CAPPED));
            x[i] = d / dark;
            t[i] = dph_material_transmittance(constants, channel, d);
        }
        minimax(x, t, c);
        for (int j = 0; j < N; j++)
            c[j] /= pow(dark, j);
    } else { /* a polynomial already */
        c[0] = offset / numerator;
        c[1] = 1 / numerator;
    }
    double leading = 0, worst = 0;
    for (int j = 0; j < N; j++) {
        out[j] = fabs(c[j]) < (double)FLT_MIN ? 0 : (float)c[j];
        leading = out[j] != 0 ? c[j] : leading;
    }
    if (!(leading > 0))
        return INFINITY;
    for (int i = 0; i <= TRIALS; i++) {
        double d = i < TRIALS / 10 ? cap * i / (TRIALS / 10.)
                                   : cap * pow(FAR, (i - TRIALS / 10.) / (.9 * TRIALS));
        double error = fabs(reciprocal(out, (float)d) -
                            dph_material_transmittance(constants, channel, (double)(float)d));
        if (!(error <= worst))
            worst = isnan(error) ? INFINITY : error;
    }
    return worst;
}

bool dph_material_fit(const struct dph_material_constants *constants, struct dph_material_fit *fit)
{
    *fit = (struct dph_material_fit){.error = INFINITY};
    if (constants->curve != DPH_CURVE_SLAB)
        return false;
    double worst = 0;
    for (int channel = 0; channel < 3; channel++) {
        float c[N];
        worst = fmax(worst, fit_channel(constants, channel, c));
        for (int j = 0; j < N; j++)
            fit->term[j][channel] = c[j];
    }
    fit->error = worst;
    return worst <= LIMIT;
}
