/* The root form of a response: SH coefficients s whose sum, squared, fits a function f that is not
 * negative.
 *
 * What is minimised for every row is the integral over the sphere of (q - f)^2, q = (sum s_i
 * y_i)^2. A square needs half the degrees of what it stands for: s of n bands makes q of 2n - 1
 * bands, and it has no light below 0 to cut off. Gauss and Newton's step with Levenberg's damping
 * (K. Levenberg, Quarterly of Applied Mathematics 2, 1944) has, with r = q - f,
 *
 *     sum_j (4 integral q y_i y_j + d delta_ij) step_j = -2 sum_j (integral r y_i y_j) s_j.
 *
 * Both integrals are short sums, integral of u y_i y_j = sum_L G(i, j; L) u_L, with the
 * coefficients of sh/gaunt.c: exact, where quadrature over directions would be 40 times the work.
 * The trace of the matrix without damping is n^2 |s|^2 / pi, its mean diagonal |s|^2 / pi, which is
 * what damping is measured in. The fit starts from s0, the projection of the root of f (what of f
 * lies below 0, ringing and noise, counts as 0), where the damping is small from the first step on;
 * it ends where a step gains less than 1e-5 of what is left. s and -s are the same answer, and the
 * start makes the mean positive.
 *
 * Where f is dim a root of either sign will do, and neighbouring positions would come to different
 * ones: between them the sum crosses 0, which shows as a dark line. So P |s - s0|^2 is minimised
 * along with the rest, P being a fifth of the mean diagonal at s0: s0 errs least where f is dim
 * (near the answer the square's error is 2 sqrt(f) times the root's), and elsewhere the pull is
 * weak. On bunny and wax this raises the error by 3 %, and lowers that of the logarithm from behind
 * by a fifth. Not for two bands, which need a second lobe of the other sign.
 *
 * Eight rows share each operation; a row that has ended keeps its answer, so it does not depend on
 * its neighbours. */
#include "bake/root_kernel.h"

#include "core/simd.h"
#include "sh/system.h"

#include <diaphan/sh.h>

#include <math.h>

enum {
    MOST = DPH_DRAW_BANDS * DPH_DRAW_BANDS,
    MOST_SQUARE = (2 * DPH_DRAW_BANDS - 1) * (2 * DPH_DRAW_BANDS - 1),
    MOST_TARGET = DPH_MAX_BANDS * DPH_MAX_BANDS,
};

#define PULL .2f /* of the mean diagonal */
#define DAMPING 1e-3f
#define GAIN    1e-5f /* of what is left: ends the fit                                            */
#define SMALL   1e-30f /* keeps rows without light from dividing by 0 */

/* Lane by lane, since vectors have no root of their own. */
static inline dph_f8 root_of(dph_f8 x)
{
    for (int lane = 0; lane < 8; lane++)
        x[lane] = x[lane] > 0 ? sqrtf(x[lane]) : 0;
    return x;
}

static void project_root(const struct dph_root_model *model, const dph_f8 *f, dph_f8 *s)
{
    int n = model->bands * model->bands, given = model->target_bands * model->target_bands;
    int most = n > given ? n : given;
    for (int i = 0; i < n; i++)
        s[i] = dph_f8_set(0);
    for (int d = 0; d < ROOT_DIRECTIONS; d++) {
        const float *y = model->value + d * most;
        dph_f8 value = dph_f8_set(0);
        for (int i = 0; i < given; i++)
            value += f[i] * y[i];
        value = root_of(value);
        for (int i = 0; i < n; i++)
            s[i] += value * y[i];
    }
    for (int i = 0; i < n; i++)
        s[i] *= dph_f8_set((float)(4 * 3.14159265358979323846 / ROOT_DIRECTIONS));
}

/* Coefficients of the square of s into q, and q - f, which is also returned as a sum of squares.
 * What f has beyond the square's degrees no s can change; it is left out. */
static dph_f8 residual(const struct dph_root_model *model, const dph_f8 *f, const dph_f8 *s,
                       const dph_f8 *start, dph_f8 pull, dph_f8 *q, dph_f8 *r)
{
    const struct dph_gaunt *gaunt = &model->gaunt;
    int n = model->bands * model->bands, given = model->target_bands * model->target_bands;
    int wide = (2 * model->bands - 1) * (2 * model->bands - 1), pair = 0;
    for (int i = 0; i < wide; i++)
        q[i] = dph_f8_set(0);
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++, pair++) {
            dph_f8 product = i == j ? s[i] * s[i] : s[i] * s[j] + s[i] * s[j];
            for (uint32_t t = gaunt->start[pair]; t < gaunt->start[pair + 1]; t++)
                q[gaunt->index[t]] += product * gaunt->factor[t];
        }
    dph_f8 sum = dph_f8_set(0);
    for (int i = 0; i < wide; i++) {
        r[i] = i < given ? q[i] - f[i] : q[i];
        sum += r[i] * r[i];
    }
    for (int i = 0; i < n; i++)
        sum += pull * (s[i] - start[i]) * (s[i] - start[i]);
    return sum;
}

/* The step for the residual at hand, both sides of its equation halved. */
static void find_step(const struct dph_root_model *model, const dph_f8 *s, const dph_f8 *start,
                      dph_f8 pull, const dph_f8 *q, const dph_f8 *r, dph_f8 damping, dph_f8 *step)
{
    const struct dph_gaunt *gaunt = &model->gaunt;
    dph_f8 matrix[MOST * (MOST + 1) / 2];
    int n = model->bands * model->bands, pair = 0;
    pull *= dph_f8_set(.5f);
    for (int i = 0; i < n; i++)
        step[i] = pull * (start[i] - s[i]);
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++, pair++) {
            dph_f8 square = dph_f8_set(0), rest = dph_f8_set(0);
            for (uint32_t t = gaunt->start[pair]; t < gaunt->start[pair + 1]; t++) {
                square += q[gaunt->index[t]] * gaunt->factor[t];
                rest += r[gaunt->index[t]] * gaunt->factor[t];
            }
            matrix[pair] = square + square;
            step[i] -= rest * s[j];
            if (i != j)
                step[j] -= rest * s[i];
        }
    for (int i = 0; i < n; i++)
        matrix[i * (i + 1) / 2 + i] += damping + pull;
    dph_system_solve(n, matrix, dph_f8_max(damping * dph_f8_set(.1f), dph_f8_set(SMALL)), step);
}

int DPH_KERNEL(dph_root_fit)(const struct dph_root_model *model, const float *target, float *root)
{
    dph_f8 f[MOST_TARGET], s[MOST], q[MOST_SQUARE], r[MOST_SQUARE];
    dph_f8 step[MOST], trial_q[MOST_SQUARE], trial_r[MOST_SQUARE];
    int n = model->bands * model->bands, given = model->target_bands * model->target_bands;
    int wide = (2 * model->bands - 1) * (2 * model->bands - 1), iterations = 0;
    for (int i = 0; i < given; i++)
        for (int lane = 0; lane < 8; lane++)
            f[i][lane] = target[lane * given + i];
    dph_f8 start[MOST], pull = dph_f8_set(0);
    project_root(model, f, start);
    for (int i = 0; i < n; i++) {
        s[i] = start[i];
        pull += s[i] * s[i];
    }
    pull *= dph_f8_set(model->bands > 2 ? (float)(PULL / 3.14159265358979323846) : 0);
    dph_f8 left = residual(model, f, s, start, pull, q, r), share = dph_f8_set(DAMPING);
    dph_i8 going = dph_i8_set(-1);
    while (iterations < ROOT_ITERATIONS) {
        dph_f8 size = dph_f8_set(0);
        for (int i = 0; i < n; i++)
            size += s[i] * s[i];
        size *= dph_f8_set((float)(.5 / 3.14159265358979323846));
        find_step(model, s, start, pull, q, r, share * size, step);
        for (int i = 0; i < n; i++)
            step[i] += s[i];
        dph_f8 trial = residual(model, f, step, start, pull, trial_q, trial_r);
        dph_i8 better = (dph_i8)(trial < left) & going;
        dph_i8 ends = (dph_i8)(left - trial <= left * dph_f8_set(GAIN)) & better;
        for (int i = 0; i < n; i++)
            s[i] = dph_f8_select(better, step[i], s[i]);
        for (int i = 0; i < wide; i++) {
            q[i] = dph_f8_select(better, trial_q[i], q[i]);
            r[i] = dph_f8_select(better, trial_r[i], r[i]);
        }
        left = dph_f8_select(better, trial, left);
        share *= dph_f8_select(better, dph_f8_set(.1f), dph_f8_set(10));
        share = dph_f8_max(share, dph_f8_set(1e-7f));
        going &= ~ends & (dph_i8)(share < dph_f8_set(10));
        iterations++;
        int any = 0;
        for (int lane = 0; lane < 8; lane++)
            any |= going[lane];
        if (!any)
            break;
    }
    for (int lane = 0; lane < 8; lane++) {
        float sign = s[0][lane] < 0 ? -1 : 1;
        for (int i = 0; i < n; i++)
            root[lane * n + i] = sign * s[i][lane];
    }
    return iterations;
}
