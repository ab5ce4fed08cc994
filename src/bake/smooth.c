/* Smoothing over the surface, its strength chosen by cross-validation.
 *
 * A smoothing F_j gives a position the value at its place of a plane fitted to its n_j nearest
 * neighbours along the mesh: linear in two coordinates of the tangent plane and in two of the
 * normal, weighted with nearness and likeness of the normals (local regression; Cleveland and
 * Devlin 1988). So slopes are kept, and so is most of what follows the normal. F_0 does nothing.
 *
 * What follows the normal in the same way everywhere needs no smoothing: rows z_l y_lm(n), zonal
 * functions about the normal n with z_l fitted to all rows, are a control variate. It is taken from
 * the rows before and given back after, F_j A + z_l (y - F_j y): a sphere loses nothing at all.
 *
 * With halves A and B of independent noise, v(.) a variance and b_j what F_j distorts,
 *
 *     E |F_j A - B|^2 = b_j^2 + v(F_j A) + v(B),        E |F_j A - F_j B|^2 = 2 v(F_j A),
 *
 * so variance v(F_j A) / 2 and distortion b_j^2 of the smoothed mean of both are known. They are
 * found for each position and band and summed over the neighbourhood, and the least sum is chosen
 * (as Rousselle, Knaus and Zwicker 2012 do for pixels); choices are then blended over the
 * neighbourhood, so that no border shows. By chance a distortion is found below 0: it counts as 0
 * in every sum. And what is least is partly so by chance: on spheres, boxes and scans the squared
 * error was up to a fifth more than the sum told, CAUTION makes up for that. */
#include "bake/smooth.h"

#include "bake/neighbours.h"
#include "core/cholesky.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <diaphan/sh.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    LEVELS = 5,
    MOST = DPH_NEIGHBOURS,
    WINDOW = 62,        /* over which errors are averaged */
    LEAST_WINDOW = 30,  /* fewer tell too little: nothing is smoothed */
    BLEND = 30,         /* over which choices are */
    MOST_BANDS = 8,
    MOST_COEF = MOST_BANDS * MOST_BANDS,
    MOST_LENGTH = 3 * MOST_COEF,
    TASK = 64,
};
static const int MEMBERS[LEVELS] = {6, 14, 30, 62, MOST};
static const double NORMALS = .3;   /* width of the likeness of normals */
static const double RIDGE = .02;    /* keeps slopes flat that the neighbours do not determine */
static const double CAUTION = 1.15;

struct dph_smoother {
    const float *position, *normal, *area;
    size_t npos;
    int threads, bands;
    struct dph_neighbours near;
    float *normal_sh;    /* (npos x bands * bands) of the normals */
    float *zonal;        /* (3 x bands) z, of the answer */
    float *error;        /* (npos x bands x PARTS) times the area */
    uint8_t *choice;     /* (npos x bands) 0: none, else level + 1 */
};

/* Parts of a squared error: variance without smoothing, then variance and distortion by level. */
enum { PLAIN, VARIANCE, DISTORTION = VARIANCE + LEVELS, PARTS = DISTORTION + LEVELS };

static double square_of(double x)
{
    return x * x;
}

struct dph_smoother *dph_smoother_create(const float *position, const float *normal,
                                         const float *area, size_t npos, const uint32_t *index,
                                         size_t ntri, int threads, struct dph_error *err)
{
    struct dph_smoother *s = dph_alloc_zero(1, sizeof *s);
    if (!s) {
        dph_fail_memory(err);
        return NULL;
    }
    s->position = position, s->normal = normal, s->area = area, s->npos = npos;
    s->threads = dph_thread_count(threads);
    if (!dph_neighbours_init(&s->near, position, npos, index, ntri, threads, err)) {
        dph_smoother_destroy(s);
        return NULL;
    }
    return s;
}

void dph_smoother_destroy(struct dph_smoother *smoother)
{
    if (!smoother)
        return;
    dph_neighbours_finish(&smoother->near);
    free(smoother->normal_sh);
    free(smoother->zonal);
    free(smoother->error);
    free(smoother->choice);
    free(smoother);
}

/* What local regression knows of a neighbour. The position itself has zeros but for `one`. */
enum { ONE, U, V, NORMAL_U, NORMAL_V, FEATURES };

/* Two unit vectors that span the plane perpendicular to a unit vector. */
static void tangents(const float n[3], double u[3], double v[3])
{
    int least = fabsf(n[0]) < .6f ? 0 : 1, i = (least + 1) % 3, j = (least + 2) % 3;
    double length = sqrt((double)n[i] * (double)n[i] + (double)n[j] * (double)n[j]);
    u[least] = 0;
    u[i] = -(double)n[j] / length;
    u[j] = (double)n[i] / length;
    for (int k = 0; k < 3; k++)
        v[k] = (double)n[(k + 1) % 3] * u[(k + 2) % 3] - (double)n[(k + 2) % 3] * u[(k + 1) % 3];
}

/* Weights of position p itself (0) and of its neighbours for all levels; 0 beyond a level. Returns
 * how many levels there are. */
static int weights_of(const struct dph_smoother *s, size_t p, float weight[LEVELS][MOST + 1])
{
    double feature[MOST + 1][FEATURES], likeness[MOST + 1], distance[MOST + 1], axis[2][3];
    const float *x = s->position + 3 * p, *n = s->normal + 3 * p;
    int count = s->near.count[p], levels = 0;
    tangents(n, axis[0], axis[1]);
    for (int i = 0; i <= count; i++) {
        size_t q = i ? s->near.list[p * MOST + (size_t)i - 1] : p;
        const float *y = s->position + 3 * q, *m = s->normal + 3 * q;
        double *f = feature[i];
        f[ONE] = 1;
        for (int a = 0; a < 2; a++) {
            f[U + a] = f[NORMAL_U + a] = 0;
            for (int k = 0; k < 3; k++) {
                f[U + a] += axis[a][k] * ((double)y[k] - (double)x[k]);
                f[NORMAL_U + a] += axis[a][k] * ((double)m[k] - (double)n[k]) / NORMALS;
            }
        }
        distance[i] = sqrt(dph_square_between(x, y));
        likeness[i] = exp(-.5 * dph_square_between(n, m) / (NORMALS * NORMALS));
    }
    for (; levels < LEVELS && count >= MEMBERS[levels]; levels++) {
        int members = MEMBERS[levels];
        double reach = 1.1 * distance[members], matrix[FEATURES * (FEATURES + 1) / 2] = {0};
        double solution[FEATURES] = {1}, w[MOST + 1];
        if (!(reach > 0))
            break;
        for (int i = 0; i <= members; i++) {
            double near = 1 - distance[i] * distance[i] / (reach * reach);
            w[i] = near * near * likeness[i];
            const double *f = feature[i];
            for (int a = 0, k = 0; a < FEATURES; a++)
                for (int b = 0; b <= a; b++)
                    matrix[k++] += w[i] * f[a] * f[b] * (a == U || a == V ? 1 / reach : 1) *
                                   (b == U || b == V ? 1 / reach : 1);
        }
        for (int a = U; a < FEATURES; a++)
            matrix[a * (a + 3) / 2] += RIDGE * matrix[0];
        dph_cholesky_solve(FEATURES, matrix, solution); /* the first row of the inverse */
        for (int i = 0; i <= count; i++) {
            double sum = solution[ONE];
            for (int a = U; a < FEATURES; a++)
                sum += solution[a] * feature[i][a] * (a == U || a == V ? 1 / reach : 1);
            weight[levels][i] = i <= members ? (float)(w[i] * sum) : 0;
        }
    }
    return levels;
}

/* What the smoothed normals took from coefficient k of band l. */
static double given_back(const struct dph_smoother *s, size_t p, const float *turned, size_t channel,
                         int l, size_t k)
{
    const float *y = s->normal_sh + p * (size_t)(s->bands * s->bands);
    return (double)s->zonal[channel * (size_t)s->bands + (size_t)l] *
           ((double)y[k] - (double)turned[k]);
}

/* z_l: least squares over positions and orders m, weighted with the areas. */
static void fit_zonal(struct dph_smoother *s, const struct dph_smooth_rows *rows)
{
    size_t ncoef = (size_t)(s->bands * s->bands), length = (size_t)rows->channels * ncoef;
    for (size_t c = 0; c < (size_t)rows->channels; c++)
        for (int l = 0; l < s->bands; l++) {
            double product = 0, square = 0;
            for (size_t p = 0; p < s->npos; p++)
                for (size_t k = (size_t)(l * l); k < (size_t)((l + 1) * (l + 1)); k++) {
                    size_t at = p * length + c * ncoef + k;
                    double y = (double)s->normal_sh[p * ncoef + k], area = (double)s->area[p];
                    product += area * y * ((double)rows->half[0][at] + (double)rows->half[1][at]);
                    square += area * y * y;
                }
            s->zonal[c * (size_t)s->bands + (size_t)l] =
                square > 0 ? (float)((double)rows->scale * product / square) : 0;
        }
}

/* Finds the gains of all levels. */
struct trial {
    struct dph_smoother *smoother;
    const struct dph_smooth_rows *rows;
};

static void try_range(void *context, size_t task, int worker)
{
    const struct trial *trial = context;
    const struct dph_smooth_rows *rows = trial->rows;
    struct dph_smoother *s = trial->smoother;
    size_t ncoef = (size_t)(rows->bands * rows->bands), length = (size_t)rows->channels * ncoef;
    (void)worker;
    for (size_t p = task * TASK; p < s->npos && p < (task + 1) * TASK; p++) {
        float weight[LEVELS][MOST + 1], sum[2][LEVELS][MOST_LENGTH], turned[LEVELS][MOST_COEF];
        float *error = s->error + p * PARTS * (size_t)rows->bands;
        int levels = weights_of(s, p, weight);
        memset(sum, 0, sizeof sum);
        memset(turned, 0, sizeof turned);
        for (int i = 0; levels && i <= MEMBERS[levels - 1]; i++) {
            size_t q = i ? s->near.list[p * MOST + (size_t)i - 1] : p;
            int first = 0;
            while (i > MEMBERS[first])
                first++;
            for (int j = first; j < levels; j++)
                for (size_t k = 0; k < ncoef; k++)
                    turned[j][k] += weight[j][i] * s->normal_sh[q * ncoef + k];
            for (int h = 0; h < 2; h++) {
                const float *from = rows->half[h] + q * length;
                for (int j = first; j < levels; j++) {
                    float w = weight[j][i], *to = sum[h][j];
                    for (size_t k = 0; k < length; k++)
                        to[k] += w * from[k];
                }
            }
        }
        const float *a = rows->half[0] + p * length, *b = rows->half[1] + p * length;
        double half = 2 * (double)rows->scale, scale = half * half * (double)s->area[p];
        for (int l = 0; l < rows->bands; l++, error += PARTS) {
            size_t begin = (size_t)(l * l), end = (size_t)((l + 1) * (l + 1));
            double plain = 0;
            for (size_t c = 0; c < (size_t)rows->channels; c++)
                for (size_t k = c * ncoef + begin; k < c * ncoef + end; k++)
                    plain += .5 * square_of((double)a[k] - (double)b[k]);
            error[PLAIN] = (float)(scale * .5 * plain);
            for (int j = 0; j < levels; j++) {
                double crossed = 0, between = 0;
                for (size_t c = 0; c < (size_t)rows->channels; c++)
                    for (size_t k = c * ncoef + begin; k < c * ncoef + end; k++) {
                        double back = given_back(s, p, turned[j], c, l, k - c * ncoef) / half;
                        double fa = (double)sum[0][j][k] + back, fb = (double)sum[1][j][k] + back;
                        crossed += .5 * (square_of(fa - (double)b[k]) + square_of(fb - (double)a[k]));
                        between += .5 * square_of(fa - fb);
                    }
                error[VARIANCE + j] = (float)(scale * .5 * between);
                error[DISTORTION + j] = (float)(scale * (crossed - between - plain));
            }
            /* a position without a level takes the widest that it has */
            for (int j = levels; j < LEVELS; j++) {
                error[VARIANCE + j] = error[levels ? VARIANCE + levels - 1 : PLAIN];
                error[DISTORTION + j] = levels ? error[DISTORTION + levels - 1] : 0;
            }
        }
    }
}

/* The level of the least error around a position. */
static void choose_range(void *context, size_t task, int worker)
{
    struct dph_smoother *s = context;
    (void)worker;
    for (size_t p = task * TASK; p < s->npos && p < (task + 1) * TASK; p++) {
        int window = s->near.count[p] < WINDOW ? s->near.count[p] : WINDOW;
        for (int l = 0; l < s->bands; l++) {
            uint8_t *choice = &s->choice[p * (size_t)s->bands + (size_t)l];
            double sum[PARTS] = {0};
            for (int i = 0; i <= window; i++) {
                size_t q = i ? s->near.list[p * MOST + (size_t)i - 1] : p;
                const float *error = s->error + (q * (size_t)s->bands + (size_t)l) * PARTS;
                for (int k = 0; k < PARTS; k++)
                    sum[k] += (double)error[k];
            }
            *choice = 0;
            for (int j = 0; window >= LEAST_WINDOW && j < LEVELS; j++) {
                double error = sum[VARIANCE + j] + fmax(0, sum[DISTORTION + j]);
                if (error < sum[PLAIN]) {
                    sum[PLAIN] = error;
                    *choice = (uint8_t)(j + 1);
                }
            }
        }
    }
}

/* Shares of the levels at a position: choices around it. Only levels that it has itself. */
static void blend_of(const struct dph_smoother *s, size_t p, int levels,
                     float blend[LEVELS][MOST_BANDS])
{
    int window = s->near.count[p] < BLEND ? s->near.count[p] : BLEND;
    memset(blend, 0, LEVELS * sizeof *blend);
    for (int i = 0; i <= window; i++) {
        size_t q = i ? s->near.list[p * MOST + (size_t)i - 1] : p;
        for (int l = 0; l < s->bands; l++) {
            int choice = s->choice[q * (size_t)s->bands + (size_t)l];
            choice = choice < levels ? choice : levels;
            if (choice)
                blend[choice - 1][l] += 1 / (float)(window + 1);
        }
    }
}

/* Levels for which there are neighbours. */
static int levels_of(const struct dph_smoother *s, size_t p)
{
    int levels = 0;
    while (levels < LEVELS && s->near.count[p] >= MEMBERS[levels])
        levels++;
    return levels;
}

bool dph_smoother_choose(struct dph_smoother *s, const struct dph_smooth_rows *rows, int checked,
                         double *left, struct dph_error *err)
{
    struct trial trial = {s, rows};
    size_t bands = (size_t)rows->bands;
    if (s->bands != rows->bands) {
        free(s->normal_sh);
        free(s->zonal);
        free(s->error);
        free(s->choice);
        s->normal_sh = dph_alloc(s->npos, bands * bands * sizeof *s->normal_sh);
        s->zonal = dph_alloc(3 * bands, sizeof *s->zonal);
        s->error = dph_alloc(s->npos, PARTS * bands * sizeof *s->error);
        s->choice = dph_alloc(s->npos, bands * sizeof *s->choice);
        s->bands = rows->bands;
        if (!s->normal_sh || !s->zonal || !s->error || !s->choice) {
            s->bands = 0;
            return dph_fail_memory(err);
        }
        for (size_t p = 0; p < s->npos; p++) {
            const float *n = s->normal + 3 * p;
            const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
            double y[MOST_COEF];
            dph_sh_eval(s->bands, normal, y);
            for (size_t k = 0; k < bands * bands; k++)
                s->normal_sh[p * bands * bands + k] = (float)y[k];
        }
    }
    fit_zonal(s, rows);
    dph_parallel(s->threads, (s->npos + TASK - 1) / TASK, try_range, &trial);
    dph_parallel(s->threads, (s->npos + TASK - 1) / TASK, choose_range, s);
    double plain = 0, all = 0;
    for (int l = 0; l < checked && l < rows->bands; l++) {
        double distortion = 0;
        for (size_t p = 0; p < s->npos; p++) {
            const float *error = s->error + (p * bands + (size_t)l) * PARTS;
            float blend[LEVELS][MOST_BANDS];
            double kept = 1;
            int levels = levels_of(s, p);
            blend_of(s, p, levels, blend);
            for (int j = 0; j < levels; j++) {
                all += CAUTION * (double)blend[j][l] * (double)error[VARIANCE + j];
                distortion += (double)blend[j][l] * (double)error[DISTORTION + j];
                kept -= (double)blend[j][l];
            }
            all += fmax(0, kept) * (double)error[PLAIN];
            plain += (double)error[PLAIN];
        }
        all += CAUTION * fmax(0, distortion);
    }
    *left = plain > 0 ? fmin(1, all / plain) : 1;
    return true;
}

struct addition {
    const struct dph_smoother *smoother;
    const struct dph_smooth_rows *rows;
    float *row;
};

static void add_range(void *context, size_t task, int worker)
{
    const struct addition *addition = context;
    const struct dph_smooth_rows *rows = addition->rows;
    const struct dph_smoother *s = addition->smoother;
    size_t ncoef = (size_t)(rows->bands * rows->bands), length = (size_t)rows->channels * ncoef;
    (void)worker;
    for (size_t p = task * TASK; p < s->npos && p < (task + 1) * TASK; p++) {
        float weight[LEVELS][MOST + 1], blend[LEVELS][MOST_BANDS], turned[MOST_COEF];
        float *to = addition->row + p * length;
        int levels = weights_of(s, p, weight), last = levels ? MEMBERS[levels - 1] : 0;
        blend_of(s, p, levels, blend);
        memset(turned, 0, sizeof turned);
        for (int i = 0; i <= last; i++) {
            size_t q = i ? s->near.list[p * MOST + (size_t)i - 1] : p;
            const float *a = rows->half[0] + q * length, *b = rows->half[1] + q * length;
            for (int l = 0; l < rows->bands; l++) {
                size_t begin = (size_t)(l * l), end = (size_t)((l + 1) * (l + 1));
                float w = 0, kept = 1;
                for (int j = 0; j < levels; j++) {
                    w += i <= MEMBERS[j] ? blend[j][l] * weight[j][i] : 0;
                    kept -= blend[j][l];
                }
                w = i ? w : w + kept;
                for (size_t k = begin; k < end; k++)
                    turned[k] += w * s->normal_sh[q * ncoef + k];
                for (size_t c = 0; w != 0 && c < (size_t)rows->channels; c++)
                    for (size_t k = c * ncoef + begin; k < c * ncoef + end; k++)
                        to[k] += w * rows->scale * (a[k] + b[k]);
            }
        }
        for (size_t c = 0; c < (size_t)rows->channels; c++)
            for (int l = 0; l < rows->bands; l++)
                for (size_t k = (size_t)(l * l); k < (size_t)((l + 1) * (l + 1)); k++)
                    to[c * ncoef + k] += (float)given_back(s, p, turned, c, l, k);
    }
}

void dph_smoother_add(const struct dph_smoother *smoother, const struct dph_smooth_rows *rows,
                      float *row)
{
    struct addition addition = {smoother, rows, row};
    dph_parallel(smoother->threads, (smoother->npos + TASK - 1) / TASK, add_range, &addition);
}
