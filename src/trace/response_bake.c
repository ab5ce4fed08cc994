/* The response bake: passes of walks until the noise is low enough.
 *
 * A pass is an independent, unbiased estimate of all coefficients. With s_b the rows of pass b of
 * B, m their mean and |.| the norm over all positions weighted with their area,
 *
 *     V = (sum of |s_b|^2 / B - |m|^2) / (B - 1)
 *
 * estimates |error of m|^2 without bias, and sqrt(V / (|m + U|^2 - V)) is the noise: what is left
 * below the root is the answer's own norm, light that was not scattered, U, included.
 *
 * Passes of even and of odd numbers make two halves, by which smooth.h finds how far m may be
 * smoothed over the surface, and what share of V is left then, its distortion included. U is not
 * smoothed.
 *
 * Passes have the same size whatever the noise, and only sums are kept: |s_b|^2 is a number a
 * position. All sums run in a fixed order. */
#include "trace/response.h"

#include "bake/smooth.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <diaphan/mesh.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum {
    CHECKED_BANDS = 6,
    MOST_MEMBERS = 48, /* of a group: one more saves less in walks than it costs in rays */
    SPLITS = 12,
    FEWEST_PASSES = 8, /* even, as all numbers of passes */
};
static const double REACH = 4;          /* of a group, mean free paths */
static const double NEAR = 1.2, NEAR_SPACING = .5; /* see near_share: spacings; mean free paths */
static const double SWEEP_SHARE = .02, FIRST_SHARE = .1, NEXT_SHARE = .8; /* of the progress */

struct dph_response_bake_params dph_response_bake_defaults(void)
{
    return (struct dph_response_bake_params){
        .bands = DPH_MAX_BANDS, .scattering = {1, 1, 1}, .noise = .05, .most_walks = 65536,
        .directions = 1024, .seed = 1, .straight = true, .smooth = true,
    };
}

static bool check_params(const struct dph_response_bake_params *p, struct dph_error *err)
{
    if (p->bands < 1 || p->bands > DPH_MAX_BANDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "bands are 1 to %d, not %d", DPH_MAX_BANDS,
                        p->bands);
    for (int c = 0; c < 3; c++)
        if (!(p->scattering[c] >= 0 && p->scattering[c] < 1e30 && p->absorption[c] >= 0 &&
              p->absorption[c] < 1e30))
            return dph_fail(err, DPH_ERROR_ARGUMENT,
                            "scattering and absorption are finite and not negative");
    if (!(fabs(p->anisotropy) < 1))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "anisotropy is between -1 and 1, not %g",
                        p->anisotropy);
    if (!(p->noise >= 0 && p->noise < INFINITY))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "the noise is not negative, not %g", p->noise);
    if (!(p->most_walks >= 1 && p->most_walks <= 1e9))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "walks a position are 1 to 1e9, not %g",
                        p->most_walks);
    if (p->directions < 16 || p->directions > 65536)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "directions are 16 to 65536, not %d",
                        p->directions);
    return true;
}

void dph_response_areas(const struct dph_welded *mesh, double *area)
{
    for (size_t t = 0; t < mesh->ntri; t++) {
        const uint32_t *corner = mesh->index + 3 * t;
        double e[2][3], square = 0;
        for (size_t k = 0; k < 3; k++)
            for (size_t i = 0; i < 2; i++)
                e[i][k] = (double)mesh->position[3 * (size_t)corner[i + 1] + k] -
                          (double)mesh->position[3 * (size_t)corner[0] + k];
        for (size_t k = 0; k < 3; k++) {
            size_t i = (k + 1) % 3, j = (k + 2) % 3;
            double n = e[0][i] * e[1][j] - e[0][j] * e[1][i];
            square += n * n;
        }
        for (size_t k = 0; k < 3; k++)
            area[corner[k]] += sqrt(square) / 6;
    }
}

static bool vertex_areas(const struct dph_welded *mesh, float *area, struct dph_error *err)
{
    double *sum = dph_alloc_zero(mesh->npos, sizeof *sum);
    if (!sum)
        return dph_fail_memory(err);
    dph_response_areas(mesh, sum);
    for (size_t p = 0; p < mesh->npos; p++)
        area[p] = (float)sum[p];
    free(sum);
    return true;
}

/* Everything of one call. */
struct job {
    struct dph_response_body body;
    struct dph_welded mesh;
    struct dph_groups groups;
    struct dph_smoother *smoother; /* NULL: nothing is smoothed */
    struct dph_transfer *transfer; /* its rows: light not scattered, in the end the answer */
    struct dph_response_bake_report report;
    float *half[2];     /* (npos x length) sums of the passes of even and odd numbers */
    double *square;     /* (npos) of the last pass */
    void *scratch;
    double squares;     /* sum of |s_b|^2 */
    double fraction;    /* progress */
};

static struct dph_smooth_rows rows_of(const struct job *job)
{
    return (struct dph_smooth_rows){
        .half = {job->half[0], job->half[1]}, .scale = 1 / (float)job->report.passes,
        .channels = 3, .bands = job->body.params->bands,
    };
}

static void add_squares(struct job *job)
{
    for (size_t p = 0; p < job->transfer->npos; p++)
        job->squares += (double)job->transfer->area[p] * job->square[p];
}

/* Estimates the noise as it is and, where there is a smoother, as smoothing leaves it. INFINITY
 * where it cannot be told. */
static bool measure_noise(struct job *job, struct dph_error *err)
{
    const struct dph_transfer *out = job->transfer;
    struct dph_response_bake_report *report = &job->report;
    size_t ncoef = job->body.ncoef, checked = CHECKED_BANDS * CHECKED_BANDS;
    double scattered = 0, all = 0, left = 1;
    checked = checked < ncoef ? checked : ncoef;
    for (size_t p = 0; p < out->npos; p++) {
        double m = 0, a = 0;
        for (size_t c = 0; c < 3; c++) {
            size_t at = p * out->length + c * ncoef;
            for (size_t i = at; i < at + checked; i++) {
                double mean = ((double)job->half[0][i] + (double)job->half[1][i]) / report->passes;
                double sum = mean + (double)out->vector[i];
                m += mean * mean;
                a += sum * sum;
            }
        }
        scattered += (double)out->area[p] * m;
        all += (double)out->area[p] * a;
    }
    double variance =
        fmax(0, job->squares / report->passes - scattered) / (report->passes - 1);
    if (job->smoother) {
        struct dph_smooth_rows rows = rows_of(job);
        if (!dph_smoother_choose(job->smoother, &rows, CHECKED_BANDS, &left, err))
            return false;
    }
    report->noise_walks = variance > 0 ? all > variance ? sqrt(variance / (all - variance)) : INFINITY
                                       : 0;
    report->noise = report->noise_walks * sqrt(left);
    return true;
}

static bool walk(struct job *job, struct dph_error *err)
{
    const struct dph_response_bake_params *params = job->body.params;
    const struct dph_volume *volume = &job->body.space.volume;
    struct dph_response_bake_report *report = &job->report;
    struct dph_transfer *out = job->transfer;
    double densest = 0, mean_path;
    bool scatters = false, shares = !params->plain && params->anisotropy == 0;
    for (int c = 0; c < 3; c++) {
        densest = fmax(densest, volume->extinction[c]);
        scatters = scatters || volume->albedo[c] > 0;
    }
    report->reached = true;
    if (!scatters || !out->npos)
        return true;
    mean_path = 1 / densest;
    size_t most = shares ? MOST_MEMBERS : 1;
    if (!(job->scratch = dph_response_scratch_create(&job->body, most)))
        return dph_fail_memory(err);
    if (params->smooth &&
        !(job->smoother = dph_smoother_create(job->mesh.position, job->body.normal, out->area,
                                              out->npos, job->mesh.index, job->mesh.ntri,
                                              job->body.threads, err)))
        return false;
    for (size_t p = 0; p < out->npos && shares; p++) {
        double spacing = sqrt((double)out->area[p]);
        job->body.near[p] = spacing < NEAR_SPACING * mean_path ? (float)(NEAR * spacing) : 0;
    }
    double limit = fmax(FEWEST_PASSES, 2 * floor(params->most_walks / SPLITS / 2));
    double wanted = params->noise > 0 ? FEWEST_PASSES : limit;
    for (bool told = false;; told = true) {
        /* before the first measurement nobody knows how many will be wanted */
        double begin = job->fraction, share = told ? NEXT_SHARE : FIRST_SHARE;
        double end = params->noise > 0 ? begin + share * (1 - begin) : 1;
        for (int first = report->passes; report->passes < wanted;) {
            struct dph_response_pass pass = {
                .body = &job->body, .groups = &job->groups, .number = report->passes,
                .splits = SPLITS, .row = job->half[report->passes % 2], .square = job->square,
                .scratch = job->scratch, .progress_begin = job->fraction,
                .progress_span = (end - begin) / (wanted - first),
            };
            struct dph_random random =
                dph_random_seed(params->seed, (uint64_t)pass.number, UINT64_MAX);
            dph_groups_make(&job->groups, job->mesh.position, job->body.normal, out->npos,
                            shares ? REACH * mean_path : INFINITY, most, random);
            if (!dph_response_pass_run(&pass))
                return dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
            job->fraction += pass.progress_span;
            report->passes++;
            add_squares(job);
        }
        if (!measure_noise(job, err))
            return false;
        report->reached = report->noise <= params->noise;
        if (report->reached || report->passes >= limit)
            return true;
        /* smoothed noise falls slower than the root of the passes: narrower smoothing suits */
        double more = pow(report->noise / params->noise, 2.4);
        wanted = fmin(limit, 2 * ceil(report->passes * fmin(fmax(more, 1.1), 4) / 2));
    }
}

/* Adds the mean of the passes, smoothed as was chosen, to the light that came straight. */
static void finish_rows(struct job *job)
{
    struct dph_transfer *out = job->transfer;
    struct dph_response_bake_report *report = &job->report;
    double area = 0;
    if (job->smoother) {
        struct dph_smooth_rows rows = rows_of(job);
        dph_smoother_add(job->smoother, &rows, out->vector);
    } else if (report->passes) {
        for (size_t i = 0; i < out->npos * out->length; i++)
            out->vector[i] += (job->half[0][i] + job->half[1][i]) / (float)report->passes;
    }
    for (size_t p = 0; p < out->npos; p++) {
        area += (double)out->area[p];
        for (size_t c = 0; c < 3; c++)
            report->returned[c] += (double)out->area[p] * sqrt(4 * PI) *
                                   (double)out->vector[p * out->length + c * job->body.ncoef];
    }
    for (int c = 0; c < 3; c++)
        report->returned[c] = area > 0 ? report->returned[c] / area : 0;
    if (job->scratch) {
        struct dph_response_count count = dph_response_counted(job->scratch, job->body.threads);
        report->walks = (double)count.walks;
        report->scatterings = (double)count.scatterings;
        report->lost = (double)count.lost;
        report->capped = (double)count.capped;
    }
}

static bool prepare(struct job *job, const struct dph_bake_input *input, struct dph_error *err)
{
    const struct dph_welded *mesh = &job->mesh;
    struct dph_transfer *out = job->transfer;
    out->npos = mesh->npos;
    out->nvert = input->nvert;
    out->bands = job->body.params->bands;
    out->channels = 3;
    out->length = job->body.length;
    out->vector = dph_alloc_zero(mesh->npos, out->length * sizeof *out->vector);
    out->area = dph_alloc(mesh->npos, sizeof *out->area);
    out->position_of = job->mesh.position_of;
    job->mesh.position_of = NULL;
    for (int h = 0; h < 2; h++)
        if (!(job->half[h] = dph_alloc_zero(mesh->npos, out->length * sizeof *job->half[h])))
            return dph_fail_memory(err);
    job->square = dph_alloc_zero(mesh->npos, sizeof *job->square);
    job->body.normal = dph_alloc(mesh->npos, 3 * sizeof *job->body.normal);
    job->body.near = dph_alloc_zero(mesh->npos, sizeof *job->body.near);
    if (!out->vector || !out->area || !job->square || !job->body.normal || !job->body.near)
        return dph_fail_memory(err);
    dph_mesh_position_normals(mesh->position, mesh->npos, mesh->index, mesh->ntri,
                              job->body.normal);
    return dph_space_init(&job->body.space, mesh->position, mesh->npos, mesh->index, mesh->ntri,
                          job->body.threads, err) &&
           vertex_areas(mesh, out->area, err) &&
           dph_groups_init(&job->groups, mesh->npos, err);
}

bool dph_response_bake(const struct dph_bake_input *input,
                       const struct dph_response_bake_params *params, struct dph_transfer *transfer,
                       struct dph_response_bake_report *report, struct dph_error *err)
{
    *transfer = (struct dph_transfer){0};
    if (!check_params(params, err))
        return false;
    size_t ncoef = (size_t)(params->bands * params->bands);
    struct job job = {.transfer = transfer, .fraction = SWEEP_SHARE};
    job.body = (struct dph_response_body){
        .params = params, .mesh = &job.mesh, .ncoef = ncoef, .length = 3 * ncoef,
        .threads = dph_thread_count(params->threads),
    };
    dph_volume_init(&job.body.space.volume, params->scattering, params->absorption,
                    params->anisotropy);
    double start = dph_seconds(), middle;
    bool ok = dph_welded_init(&job.mesh, input, err) && prepare(&job, input, err) &&
              (!params->straight ||
               dph_response_unscattered(&job.body, SWEEP_SHARE, transfer->vector, err));
    middle = dph_seconds();
    ok = ok && walk(&job, err);
    if (ok && params->progress && !params->progress(params->progress_user, 1))
        ok = dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
    if (ok) {
        job.report.positions = transfer->npos;
        job.report.threads = job.body.threads;
        job.report.seconds_sweep = middle - start;
        job.report.seconds_walk = dph_seconds() - middle;
        finish_rows(&job);
        if (report)
            *report = job.report;
    } else {
        dph_transfer_finish(transfer);
    }
    dph_response_scratch_destroy(job.scratch, job.body.threads);
    dph_smoother_destroy(job.smoother);
    dph_groups_finish(&job.groups);
    dph_space_finish(&job.body.space);
    free(job.body.normal);
    free(job.body.near);
    free(job.half[0]);
    free(job.half[1]);
    free(job.square);
    dph_welded_finish(&job.mesh);
    return ok;
}
