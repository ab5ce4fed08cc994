/* Precomputed radiance transfer for the kinds of transfer.h.
 *
 * Diffuse (P.-P. Sloan, J. Kautz, J. Snyder, "Precomputed radiance transfer for real-time
 * rendering in dynamic, low-frequency lighting environments", SIGGRAPH 2002). With the
 * irradiance transfer E_i of visibility.c, radiance is albedo / pi E_i; without shadows E_i =
 * A_l y_i(n), A_l the coefficients of the clamped cosine. Light that the body reflects on itself
 * is a series in the albedo,
 *
 *   b = sum over k of  albedo^(k+1) T_k,   T_0 = E / pi,   T_(k+1)(x) = 1/pi integral of (1 - V) max(0, n.s) T_k(q(s)) ds
 *
 * whose terms do not depend on it: one series serves all channels.
 *
 * Translucent (P.-P. Sloan, J. Hall, J. Hart, J. Snyder, "Clustered principal components for
 * precomputed radiance transfer", SIGGRAPH 2003, with the light transport of Jensen et al.
 * 2001). Irradiance enters, the dipole carries it to x, and it leaves evenly in all directions:
 *
 *   M_i(x) = sum over samples q of  Rd(|x - q|) A_q E_i(q),   b_i = M_i / pi
 *
 * Fresnel's transmittance stands once at the entry, in E; the reflection inside is part of Rd,
 * which counts flux that has left. */
#include <diaphan/transfer.h>

#include "bake/octree.h"
#include "bake/refine.h"
#include "bake/visibility.h"
#include "bake/welded.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <diaphan/environment.h>
#include <diaphan/mesh.h>

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { TASK_POSITIONS = 128 };

struct dph_transfer_params dph_transfer_defaults(void)
{
    return (struct dph_transfer_params){
        .bands = 6, .directions = 1024, .albedo = {1, 1, 1}, .bounces = 2, .scattering = {1, 1, 1},
        .ior = 1, .solid_angle = .05, .most_samples = 200000,
    };
}

void dph_transfer_finish(struct dph_transfer *transfer)
{
    free(transfer->vector);
    free(transfer->area);
    free(transfer->position_of);
    *transfer = (struct dph_transfer){0};
}

static bool check_params(const struct dph_transfer_params *p, struct dph_error *err)
{
    if (p->kind < DPH_TRANSFER_TRANSLUCENT || p->kind > DPH_TRANSFER_IRRADIANCE)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "unknown kind of transfer");
    if (p->bands < 1 || p->bands > DPH_MAX_BANDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "bands are 1 to %d, not %d", DPH_MAX_BANDS, p->bands);
    if (p->directions < 16 || p->directions > 65536)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "directions are 16 to 65536, not %d", p->directions);
    if (p->bounces < 1 || p->bounces > 16)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "bounces are 1 to 16, not %d", p->bounces);
    if (!(p->ior >= 1 && p->ior <= 4))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "the relative index is 1 to 4, not %g", p->ior);
    if (!(p->solid_angle >= 0 && p->solid_angle <= 1))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "the solid angle of a group is 0 to 1, not %g", p->solid_angle);
    for (int c = 0; c < 3; c++) {
        if (!(p->albedo[c] >= 0 && p->albedo[c] <= 1))
            return dph_fail(err, DPH_ERROR_ARGUMENT, "an albedo is 0 to 1, not %g", p->albedo[c]);
        if (!(p->scattering[c] >= 0 && p->scattering[c] < 1e30 && p->absorption[c] >= 0 && p->absorption[c] < 1e30))
            return dph_fail(err, DPH_ERROR_ARGUMENT, "scattering and absorption are finite and not negative");
    }
    return true;
}

/* Thirds of the triangles' areas. */
static void vertex_areas(const float *position, const uint32_t *index, size_t ntri, double *area)
{
    for (size_t t = 0; t < ntri; t++) {
        const float *p[3];
        double e[2][3], n[3], square = 0;
        for (size_t k = 0; k < 3; k++)
            p[k] = position + 3 * (size_t)index[3 * t + k];
        for (size_t k = 0; k < 3; k++) {
            e[0][k] = (double)p[1][k] - (double)p[0][k];
            e[1][k] = (double)p[2][k] - (double)p[0][k];
        }
        for (size_t k = 0; k < 3; k++) {
            n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
            square += n[k] * n[k];
        }
        for (size_t k = 0; k < 3; k++)
            area[index[3 * t + k]] += sqrt(square) / 6;
    }
}

/* Everything that the kinds share. */
struct job {
    const struct dph_transfer_params *params;
    const struct dph_welded *welded;
    struct dph_transfer *transfer;
    struct dph_transfer_report *report;
    size_t ncoef;
    int directions, threads;
    struct dph_visibility *visibility;
};

static bool start_visibility(struct job *job, const float *position, size_t npos, const uint32_t *index,
                             size_t ntri, double span, struct dph_error *err)
{
    const struct dph_visibility_params params = {
        .bands = job->params->bands, .directions = job->directions, .threads = job->threads,
        .portable = job->params->portable, .progress = job->params->progress,
        .progress_user = job->params->progress_user, .progress_span = span,
    };
    job->visibility = dph_visibility_create(position, npos, index, ntri, &params, err);
    return job->visibility != NULL;
}

static bool done(struct job *job, struct dph_error *err)
{
    const struct dph_transfer_params *p = job->params;
    if (p->progress && !p->progress(p->progress_user, 1))
        return dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
    return true;
}

static bool unshadowed(struct job *job, struct dph_error *err)
{
    struct dph_transfer *out = job->transfer;
    const struct dph_welded *w = job->welded;
    float *normal = dph_alloc(w->npos, 3 * sizeof *normal);
    if (!normal)
        return dph_fail_memory(err);
    dph_mesh_position_normals(w->position, w->npos, w->index, w->ntri, normal);
    for (size_t p = 0; p < w->npos; p++) {
        const double n[3] = {normal[3 * p], normal[3 * p + 1], normal[3 * p + 2]};
        double y[DPH_MAX_BANDS * DPH_MAX_BANDS];
        dph_sh_eval(out->bands, n, y);
        for (int l = 0; l < out->bands; l++)
            for (size_t i = (size_t)(l * l); i < (size_t)((l + 1) * (l + 1)); i++)
                for (size_t c = 0; c < 3; c++)
                    out->vector[p * out->length + c * job->ncoef + i] =
                        (float)(job->params->albedo[c] / PI * dph_sh_cosine(l) * y[i]);
    }
    free(normal);
    return done(job, err);
}

/* Adds `factor[c]` times the rows in the sweep's order to the result's channels. */
static void add_rows(struct job *job, const float *row, const double factor[3])
{
    struct dph_transfer *out = job->transfer;
    const uint32_t *order = dph_visibility_order(job->visibility);
    size_t stride = dph_visibility_stride(job->visibility);
    for (size_t k = 0; k < out->npos; k++)
        for (size_t c = 0; c < (size_t)out->channels; c++) {
            float *to = out->vector + order[k] * out->length + c * job->ncoef;
            for (size_t i = 0; i < job->ncoef; i++)
                to[i] += (float)factor[c] * row[k * stride + i];
        }
}

/* Shadowed, interreflected, and irradiance. */
static bool shadowed(struct job *job, struct dph_error *err)
{
    const struct dph_transfer_params *params = job->params;
    const struct dph_welded *w = job->welded;
    bool enters = params->kind == DPH_TRANSFER_IRRADIANCE, ok = false;
    int bounces = params->kind == DPH_TRANSFER_INTERREFLECTED ? params->bounces : 0;
    double factor[3];
    float *row[2] = {NULL, NULL};
    memset(job->transfer->vector, 0, job->transfer->npos * job->transfer->length * sizeof(float));
    if (!start_visibility(job, w->position, w->npos, w->index, w->ntri, 1.0 / (bounces + 1), err))
        return false;
    size_t stride = dph_visibility_stride(job->visibility);
    for (int i = 0; i < (bounces ? 2 : 1); i++)
        if (!(row[i] = dph_alloc_aligned(w->npos, stride * sizeof **row))) {
            dph_fail_memory(err);
            goto end;
        }
    if (!dph_visibility_irradiance(job->visibility, enters ? params->ior : 1, row[0], err))
        goto end;
    for (int c = 0; c < 3; c++)
        factor[c] = enters ? 1 : params->albedo[c] / PI;
    add_rows(job, row[0], factor);
    for (int k = 0; k < bounces; k++) {
        if (!dph_visibility_bounce(job->visibility, row[k & 1], row[~k & 1], err))
            goto end;
        for (int c = 0; c < 3; c++)
            factor[c] *= params->albedo[c] / PI;
        add_rows(job, row[~k & 1], factor);
    }
    ok = done(job, err);
end:
    free(row[0]);
    free(row[1]);
    return ok;
}

/* What the tasks of the gathering share. */
struct spread {
    const struct job *job;
    const struct dph_octree *tree;
    struct dph_gather gather;
    const float *position; /* (samples x 3) scaled, in the sweep's order                            */
    const uint32_t *order;
    size_t samples, stride;
    atomic_bool cancelled;
};

static void spread_range(void *context, size_t task, int worker)
{
    struct spread *s = context;
    const struct job *job = s->job;
    struct dph_transfer *out = job->transfer;
    size_t begin = task * TASK_POSITIONS, end = begin + TASK_POSITIONS;
    if (atomic_load(&s->cancelled))
        return;
    float sum[3 * DPH_MAX_BANDS * DPH_MAX_BANDS];
    for (size_t k = begin; k < end && k < s->samples; k++) {
        if (s->order[k] >= out->npos) /* only a sample */
            continue;
        dph_octree_gather(s->tree, &s->gather, s->position + 3 * k, NULL, sum);
        float *to = out->vector + s->order[k] * out->length;
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < job->ncoef; i++)
                to[c * job->ncoef + i] = sum[c * s->stride + i] * (float)(1 / PI);
    }
    const struct dph_transfer_params *params = job->params;
    if (worker == 0 && params->progress &&
        !params->progress(params->progress_user, .8 + .2 * (double)begin / (double)s->samples))
        atomic_store(&s->cancelled, true);
}

/* The ratio of outgoing and incoming flux under light from everywhere, by the positions' areas. */
static void measure_flux(const struct job *job, const float *row, const uint32_t *order, size_t stride,
                         size_t samples)
{
    const struct dph_transfer *out = job->transfer;
    double in = 0, leaves[3] = {0, 0, 0};
    for (size_t k = 0; k < samples; k++) {
        size_t p = order[k];
        if (p >= out->npos)
            continue;
        in += (double)out->area[p] * (double)row[k * stride];
        for (size_t c = 0; c < 3; c++)
            leaves[c] += (double)out->area[p] * (double)out->vector[p * out->length + c * job->ncoef] * PI;
    }
    for (int c = 0; c < 3; c++)
        job->report->returned[c] = in > 0 ? leaves[c] / in : 0;
}

static bool translucent(struct job *job, struct dph_error *err)
{
    const struct dph_transfer_params *params = job->params;
    const struct dph_welded *w = job->welded;
    struct dph_refined mesh = {0};
    struct spread s = {.job = job, .gather = {.kind = DPH_KERNEL_DIPOLE, .channels = 3, .reach = INFINITY,
                                              .solid_angle = params->solid_angle,
                                              .portable = params->portable}};
    float *row = NULL, *position = NULL, *area = NULL;
    double *thirds = NULL;
    struct dph_octree *tree = NULL;
    bool ok = false;

    /* Samples an area of pi mean free paths squared apart, which an even lattice of triangles
     * has at this length of edges. */
    double extinction = 0;
    for (int c = 0; c < 3; c++)
        if (params->scattering[c] > 0)
            extinction = fmax(extinction, params->scattering[c] + params->absorption[c]);
    double spacing = extinction > 0 ? sqrt(2 * PI / sqrt(3)) / extinction : INFINITY;
    if (!dph_refine(w->position, w->npos, w->index, w->ntri, spacing, params->most_samples, &mesh, err))
        return false;
    size_t samples = mesh.npos;
    job->report->samples = samples;
    job->report->spacing = mesh.longest;
    job->report->spacing_wanted = spacing;
    if (!start_visibility(job, mesh.position, samples, mesh.index, mesh.ntri, .8, err))
        goto end;
    s.order = dph_visibility_order(job->visibility);
    s.samples = samples;
    s.stride = dph_visibility_stride(job->visibility);
    row = dph_alloc_aligned(samples, s.stride * sizeof *row);
    position = dph_alloc(samples, 3 * sizeof *position);
    area = dph_alloc(samples, sizeof *area);
    thirds = dph_alloc_zero(samples, sizeof *thirds);
    if (!row || !position || !area || !thirds) {
        dph_fail_memory(err);
        goto end;
    }
    if (!dph_visibility_irradiance(job->visibility, params->ior, row, err))
        goto end;

    double start = dph_seconds(), low[3], high[3], square = 0;
    vertex_areas(mesh.position, mesh.index, mesh.ntri, thirds);
    for (size_t k = 0; k < 3; k++) {
        low[k] = INFINITY, high[k] = -INFINITY;
        for (size_t p = 0; p < samples; p++) {
            low[k] = fmin(low[k], mesh.position[3 * p + k]);
            high[k] = fmax(high[k], mesh.position[3 * p + k]);
        }
        square += samples ? (high[k] - low[k]) * (high[k] - low[k]) / 4 : 0;
    }
    double unit = square > 0 ? sqrt(square) : 1; /* single precision has room for any unit of length then */
    for (size_t i = 0; i < samples; i++) {
        size_t p = s.order[i];
        for (size_t k = 0; k < 3; k++)
            position[3 * i + k] = (float)((mesh.position[3 * p + k] - (low[k] + high[k]) / 2) / unit);
        area[i] = (float)(thirds[p] / (unit * unit));
    }
    for (int c = 0; c < 3; c++) {
        /* Opaque, or all but nothing: single precision has limits, which no surface's samples
         * can show. */
        double reduced = params->scattering[c] * unit, absorbed = params->absorption[c] * unit;
        double scale = fmin(1, 1e9 / (reduced + absorbed));
        dph_dipole_init(&s.gather.dipole[c], reduced < 1e-9 ? 0 : reduced * scale, absorbed * scale, params->ior);
    }
    const struct dph_octree_input input = {.count = samples, .stride = s.stride, .position = position,
                                           .area = area, .row = row};
    if (!(tree = dph_octree_create(&input, err)))
        goto end;
    s.tree = tree;
    s.position = position;
    dph_parallel(job->threads, (samples + TASK_POSITIONS - 1) / TASK_POSITIONS, spread_range, &s);
    if (atomic_load(&s.cancelled)) {
        dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
        goto end;
    }
    measure_flux(job, row, s.order, s.stride, samples);
    job->report->seconds_gather = dph_seconds() - start;
    ok = done(job, err);
end:
    dph_octree_destroy(tree);
    free(row);
    free(position);
    free(area);
    free(thirds);
    dph_refined_finish(&mesh);
    return ok;
}

bool dph_transfer_bake(const struct dph_bake_input *input, const struct dph_transfer_params *params,
                       struct dph_transfer *transfer, struct dph_transfer_report *report,
                       struct dph_error *err)
{
    *transfer = (struct dph_transfer){0};
    if (!check_params(params, err))
        return false;
    struct dph_welded welded = {0};
    struct dph_transfer_report local = {.directions = (params->directions + 1) & ~1,
                                        .threads = dph_thread_count(params->threads)};
    struct job job = {.params = params, .welded = &welded, .transfer = transfer, .report = &local,
                      .ncoef = (size_t)(params->bands * params->bands), .directions = local.directions,
                      .threads = local.threads};
    double *area = NULL;
    bool ok = dph_welded_init(&welded, input, err);
    if (!ok)
        goto end;
    local.positions = welded.npos;
    transfer->npos = welded.npos;
    transfer->nvert = input->nvert;
    transfer->bands = params->bands;
    transfer->channels = params->kind == DPH_TRANSFER_IRRADIANCE ? 1 : 3;
    transfer->length = (size_t)transfer->channels * job.ncoef;
    transfer->vector = dph_alloc(welded.npos, transfer->length * sizeof *transfer->vector);
    transfer->area = dph_alloc(welded.npos, sizeof *transfer->area);
    area = dph_alloc_zero(welded.npos, sizeof *area);
    transfer->position_of = welded.position_of;
    welded.position_of = NULL;
    if (!transfer->vector || !transfer->area || !area) {
        ok = dph_fail_memory(err);
        goto end;
    }
    vertex_areas(welded.position, welded.index, welded.ntri, area);
    for (size_t p = 0; p < welded.npos; p++)
        transfer->area[p] = (float)area[p];
    ok = params->kind == DPH_TRANSFER_TRANSLUCENT  ? translucent(&job, err)
         : params->kind == DPH_TRANSFER_UNSHADOWED ? unshadowed(&job, err)
                                                   : shadowed(&job, err);
    if (ok && job.visibility)
        dph_visibility_seconds(job.visibility, &local.seconds_sweep, &local.seconds_project);
    if (ok && report)
        *report = local;
end:
    if (!ok)
        dph_transfer_finish(transfer);
    free(area);
    dph_visibility_destroy(job.visibility);
    dph_welded_finish(&welded);
    return ok;
}
