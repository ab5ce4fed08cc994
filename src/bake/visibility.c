/* Irradiance transfer: what the hemisphere over every position sees of the light far away, and
 * of the body itself.
 *
 *   E_i(x) = integral of V(x, s) max(0, n.s) Ft(n.s) y_i(s) ds
 *
 * Visibility V comes from the sweep: a direction s with n.s > 0 is free where no triangle is
 * crossed ahead. A ray that enters matter at its very start, below the horizon of the triangles
 * around its position, leaves it again, and is not free. As in the bake of thickness (bake.c), a
 * block of direction pairs is swept by all threads into a panel of columns, and all threads then
 * add the panel to their positions' sums in the order of the directions.
 *
 * Light that the body reflects on itself (Sloan, Kautz, Snyder 2002) needs what is hit and
 * where: the sweep knows the triangle and the distance of the nearest crossing. One pass over
 * the directions makes one bounce; nothing is kept of the rays between passes, since sweeping
 * again is faster than reading that much memory would be worth. */
#include "bake/visibility.h"

#include "bake/dipole.h"
#include "bake/sweep.h"
#include "bake/sweep_kernel.h"
#include "bake/visibility_kernel.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/simd.h"
#include "core/threads.h"
#include "sh/project.h"

#include <diaphan/mesh.h>

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A panel is at most this many pairs and, above the least number, this many bytes; positions of
 * one task, a multiple of 8. None of them changes the result. */
enum { MOST_PAIRS = 64, LEAST_PAIRS = 16, PANEL_BYTES = 96 << 20, TASK_POSITIONS = 512 };

struct dph_visibility {
    struct dph_visibility_params params;
    struct dph_sweep *sweep;
    struct dph_projector *projector;
    struct dph_sweep_scratch **scratch; /* (threads)                                               */
    const struct dph_visibility_kernel *kernel;
    size_t npos, padded, ncoef, nsum;
    float *direction;  /* (directions x 3)                                                         */
    float *normal;     /* (npos x 3) in the caller's order                                         */
    float *nx, *ny, *nz; /* (padded) in the sweep's order                                          */
    double seconds_sweep, seconds_project;
    /* the pass at hand */
    double ior;
    const float *from;      /* bounce: (npos x stride)                                             */
    int first, count;       /* pairs of the block                                                  */
    float *plus, *minus;    /* (count x padded)                                                    */
    int32_t *near_plus, *near_minus; /* (count x padded) bounce                                    */
    float *sums, *coefficient, *out;
    atomic_bool cancelled, failed;
};

struct dph_visibility *dph_visibility_create(const float *position, size_t npos, const uint32_t *index,
                                             size_t ntri, const struct dph_visibility_params *params,
                                             struct dph_error *err)
{
    struct dph_visibility *v = calloc(1, sizeof *v);
    if (!v) {
        dph_fail_memory(err);
        return NULL;
    }
    v->params = *params;
    v->npos = npos;
    v->padded = (npos + 7) & ~(size_t)7;
    v->ncoef = (size_t)(params->bands * params->bands);
    v->kernel = &dph_visibility_kernel_portable;
#ifdef DPH_HAVE_AVX2
    if (!params->portable && dph_cpu_has_avx2())
        v->kernel = &dph_visibility_kernel_avx2;
#endif
    v->sweep = dph_sweep_create(position, npos, index, ntri, params->portable, err);
    v->projector = dph_projector_create(params->bands, params->directions, DPH_FIT_SPHERE, 0,
                                        params->portable, err);
    if (!v->sweep || !v->projector)
        goto error;
    v->nsum = dph_projector_sums(v->projector);
    v->scratch = dph_alloc_zero((size_t)params->threads, sizeof *v->scratch);
    v->direction = dph_alloc((size_t)params->directions, 3 * sizeof *v->direction);
    v->normal = dph_alloc(npos, 3 * sizeof *v->normal);
    v->nx = dph_alloc_aligned(v->padded, sizeof *v->nx);
    v->ny = dph_alloc_aligned(v->padded, sizeof *v->ny);
    v->nz = dph_alloc_aligned(v->padded, sizeof *v->nz);
    if (!v->scratch || !v->direction || !v->normal || !v->nx || !v->ny || !v->nz)
        goto memory;
    for (int i = 0; i < params->threads; i++)
        if (!(v->scratch[i] = dph_sweep_scratch_create(v->sweep, err)))
            goto error;
    dph_sh_directions(params->directions, v->direction);
    dph_mesh_position_normals(position, npos, index, ntri, v->normal);
    for (size_t i = 0; i < v->padded; i++) {
        const float *n = i < npos ? v->normal + 3 * (size_t)dph_sweep_order(v->sweep)[i] : NULL;
        v->nx[i] = n ? n[0] : 0;
        v->ny[i] = n ? n[1] : 0;
        v->nz[i] = n ? n[2] : 0;
    }
    return v;
memory:
    dph_fail_memory(err);
error:
    dph_visibility_destroy(v);
    return NULL;
}

void dph_visibility_destroy(struct dph_visibility *v)
{
    if (!v)
        return;
    for (int i = 0; v->scratch && i < v->params.threads; i++)
        dph_sweep_scratch_destroy(v->scratch[i]);
    free(v->scratch);
    free(v->direction);
    free(v->normal);
    free(v->nx);
    free(v->ny);
    free(v->nz);
    dph_projector_destroy(v->projector);
    dph_sweep_destroy(v->sweep);
    free(v);
}

size_t dph_visibility_stride(const struct dph_visibility *v)
{
    return (v->ncoef + 7) & ~(size_t)7;
}

const uint32_t *dph_visibility_order(const struct dph_visibility *v)
{
    return dph_sweep_order(v->sweep);
}

const float *dph_visibility_normals(const struct dph_visibility *v)
{
    return v->normal;
}

void dph_visibility_seconds(const struct dph_visibility *v, double *sweep, double *project)
{
    *sweep = v->seconds_sweep;
    *project = v->seconds_project;
}

/* Worker 0 is the thread that called the library; its tasks come in order. */
static void report_progress(struct dph_visibility *v, double share, int worker)
{
    const struct dph_visibility_params *p = &v->params;
    if (worker == 0 && p->progress &&
        !p->progress(p->progress_user, p->progress_begin + p->progress_span * share))
        atomic_store(&v->cancelled, true);
}

/* Distances into what the free part of the hemisphere lets in: V max(0, n.s) Ft(n.s). */
static void weigh(const struct dph_visibility *v, const float d[3], float sign, float *column)
{
    for (size_t p = 0; p < v->padded; p++) {
        float mu = sign * (v->nx[p] * d[0] + v->ny[p] * d[1] + v->nz[p] * d[2]);
        column[p] = column[p] == INFINITY && mu > 0 ? mu : 0;
    }
    for (size_t p = 0; v->ior > 1 && p < v->padded; p++)
        if (column[p] > 0)
            column[p] *= (float)dph_fresnel_transmittance(v->ior, fmin((double)column[p], 1));
}

static void sweep_pair(void *context, size_t i, int worker)
{
    struct dph_visibility *v = context;
    if (atomic_load(&v->cancelled) || atomic_load(&v->failed))
        return;
    const float *f = v->direction + 6 * ((size_t)v->first + i);
    double d[3] = {f[0], f[1], f[2]}, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int k = 0; k < 3; k++)
        d[k] /= length;
    float *plus = v->plus + i * v->padded, *minus = v->minus + i * v->padded;
    int32_t *near_plus = v->from ? v->near_plus + i * v->padded : NULL;
    int32_t *near_minus = v->from ? v->near_minus + i * v->padded : NULL;
    if (!dph_sweep_nearest(v->sweep, v->scratch[worker], d, plus, minus, near_plus, near_minus, NULL))
        atomic_store(&v->failed, true);
    if (!v->from) {
        weigh(v, f, 1, plus);
        weigh(v, f, -1, minus);
    }
    report_progress(v, ((double)v->first + (double)i) / (v->params.directions / 2), worker);
}

static void range_of(const struct dph_visibility *v, size_t i, size_t *begin, size_t *end)
{
    *begin = i * TASK_POSITIONS;
    *end = *begin + TASK_POSITIONS < v->padded ? *begin + TASK_POSITIONS : v->padded;
}

static void project_range(void *context, size_t i, int worker)
{
    (void)worker;
    struct dph_visibility *v = context;
    size_t begin, end;
    range_of(v, i, &begin, &end);
    dph_projector_add(v->projector, v->first, v->count, v->plus, v->minus, v->padded, NULL, begin, end,
                      v->sums);
}

static void bounce_range(void *context, size_t i, int worker)
{
    (void)worker;
    struct dph_visibility *v = context;
    size_t begin, end;
    range_of(v, i, &begin, &end);
    const struct dph_bounce bounce = {
        .x = v->sweep->x, .y = v->sweep->y, .z = v->sweep->z, .nx = v->nx, .ny = v->ny, .nz = v->nz,
        .corner = dph_sweep_corners(v->sweep), .unit = (float)v->sweep->unit,
        .weight = (float)(4 * 3.14159265358979323846 / v->params.directions),
        .stride = dph_visibility_stride(v), .from = v->from, .out = v->out,
    };
    for (int k = 0; k < v->count; k++) {
        const float *d = v->direction + 6 * (size_t)(v->first + k), opposite[3] = {-d[0], -d[1], -d[2]};
        size_t column = (size_t)k * v->padded;
        size_t last = end < v->npos ? end : v->npos;
        v->kernel->bounce(&bounce, d, v->plus + column, v->near_plus + column, begin, last);
        v->kernel->bounce(&bounce, opposite, v->minus + column, v->near_minus + column, begin, last);
    }
}

static void solve_range(void *context, size_t i, int worker)
{
    (void)worker;
    struct dph_visibility *v = context;
    size_t begin, end, stride = dph_visibility_stride(v);
    range_of(v, i, &begin, &end);
    dph_projector_solve(v->projector, v->sums, begin, end, v->coefficient);
    for (size_t p = begin; p < end && p < v->npos; p++)
        memcpy(v->out + p * stride, v->coefficient + p * v->ncoef, v->ncoef * sizeof(float));
}

/* All directions once: bounces of v->from where that is given, else visibility. */
static bool pass(struct dph_visibility *v, struct dph_error *err)
{
    int pairs = v->params.directions / 2, threads = v->params.threads;
    size_t tasks = (v->padded + TASK_POSITIONS - 1) / TASK_POSITIONS;
    size_t column = v->padded * (v->from ? 4 : 2) * sizeof(float);
    int block = column ? (int)fmin(MOST_PAIRS, fmax(LEAST_PAIRS, (double)PANEL_BYTES / (double)column)) : 1;
    bool ok = false;
    size_t panel = v->padded * (size_t)block;
    memset(v->out, 0, v->npos * dph_visibility_stride(v) * sizeof *v->out);
    v->plus = dph_alloc_aligned(panel, sizeof *v->plus);
    v->minus = dph_alloc_aligned(panel, sizeof *v->minus);
    if (v->from) {
        v->near_plus = dph_alloc_aligned(panel, sizeof *v->near_plus);
        v->near_minus = dph_alloc_aligned(panel, sizeof *v->near_minus);
    } else {
        v->sums = dph_alloc_aligned(v->padded, v->nsum * sizeof *v->sums);
        v->coefficient = dph_alloc_aligned(v->padded, v->ncoef * sizeof *v->coefficient);
    }
    if (!v->plus || !v->minus || (v->from ? !v->near_plus || !v->near_minus : !v->sums || !v->coefficient)) {
        dph_fail_memory(err);
        goto end;
    }
    if (!v->from)
        memset(v->sums, 0, v->padded * v->nsum * sizeof *v->sums);
    for (v->first = 0; v->first < pairs; v->first += v->count) {
        v->count = pairs - v->first < block ? pairs - v->first : block;
        double start = dph_seconds();
        dph_parallel(threads, (size_t)v->count, sweep_pair, v);
        if (atomic_load(&v->failed) || atomic_load(&v->cancelled)) {
            if (atomic_load(&v->failed))
                dph_fail_memory(err);
            else
                dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
            goto end;
        }
        double swept = dph_seconds();
        dph_parallel(threads, tasks, v->from ? bounce_range : project_range, v);
        v->seconds_sweep += swept - start;
        v->seconds_project += dph_seconds() - swept;
    }
    if (!v->from)
        dph_parallel(threads, tasks, solve_range, v);
    v->params.progress_begin += v->params.progress_span;
    ok = true;
end:
    free(v->plus);
    free(v->minus);
    free(v->near_plus);
    free(v->near_minus);
    free(v->sums);
    free(v->coefficient);
    v->plus = v->minus = v->sums = v->coefficient = NULL;
    v->near_plus = v->near_minus = NULL;
    return ok;
}

bool dph_visibility_irradiance(struct dph_visibility *v, double ior, float *out, struct dph_error *err)
{
    v->ior = ior;
    v->from = NULL;
    v->out = out;
    return pass(v, err);
}

bool dph_visibility_bounce(struct dph_visibility *v, const float *from, float *out, struct dph_error *err)
{
    v->from = from;
    v->out = out;
    return pass(v, err);
}
