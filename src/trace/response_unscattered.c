/* The part of the response that is light not scattered at all. Along a direction w it is
 *
 *     U_c(x, w) = max(0, -n.w) / pi exp(-st_c S(x, w)),
 *
 * S being the length inside the body from x towards the light: the thickness that the sweep gives
 * for all positions at once. Projected over an even set of directions, without noise. */
#include "trace/response.h"

#include "bake/sweep.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"
#include "sh/project.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { TASK_POSITIONS = 128, MOST_PAIRS = 32, LEAST_PAIRS = 4, PANEL_BYTES = 64 << 20 };

struct job {
    const struct dph_response_body *body;
    struct dph_sweep *sweep;
    struct dph_sweep_scratch **scratch; /* (threads) */
    struct dph_projector *projector;
    const uint32_t *order;
    float *direction;        /* (directions x 3) */
    float *plus[3], *minus[3]; /* by channel (pairs of a block x padded) */
    float *sums, *coefficient; /* (3 x padded x sums), (3 x padded x ncoef) */
    float *row;
    size_t npos, padded, nsum;
    int first, count, pairs;
    double progress_span;
    atomic_bool cancelled;
};

/* From thickness in plus[0] to the radiance that comes through, all channels. */
static void attenuate(const struct job *job, const float direction[3], float sign,
                      float *const column[3], size_t at)
{
    const struct dph_response_body *body = job->body;
    for (size_t k = 0; k < job->padded; k++) {
        float cosine = 0, length = column[0][at + k];
        if (k < job->npos) {
            const float *n = body->normal + 3 * (size_t)job->order[k];
            cosine = -sign * (n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2]);
        }
        for (int c = 0; c < 3; c++) {
            float depth = (float)body->space.volume.extinction[c] * length;
            column[c][at + k] =
                cosine > 0 && depth < 40 ? cosine * (float)(1 / PI) * expf(-depth) : 0;
        }
    }
}

static void sweep_pair(void *context, size_t i, int worker)
{
    struct job *job = context;
    const struct dph_response_bake_params *params = job->body->params;
    if (atomic_load(&job->cancelled))
        return;
    const float *f = job->direction + 6 * ((size_t)job->first + i);
    double d[3] = {f[0], f[1], f[2]}, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int k = 0; k < 3; k++)
        d[k] /= length;
    size_t at = i * job->padded;
    dph_sweep_run(job->sweep, job->scratch[worker], DPH_THICKNESS_INSIDE, d, job->plus[0] + at,
                  job->minus[0] + at, NULL, NULL);
    attenuate(job, f, 1, job->plus, at);
    attenuate(job, f, -1, job->minus, at);
    if (worker == 0 && params->progress &&
        !params->progress(params->progress_user,
                          job->progress_span * ((double)job->first + (double)i) / job->pairs))
        atomic_store(&job->cancelled, true);
}

static void range_of(const struct job *job, size_t task, size_t *begin, size_t *end)
{
    *begin = task * TASK_POSITIONS;
    *end = *begin + TASK_POSITIONS < job->padded ? *begin + TASK_POSITIONS : job->padded;
}

static void project_range(void *context, size_t task, int worker)
{
    struct job *job = context;
    size_t begin, end;
    (void)worker;
    range_of(job, task, &begin, &end);
    for (size_t c = 0; c < 3; c++)
        dph_projector_add(job->projector, job->first, job->count, job->plus[c], job->minus[c],
                          job->padded, NULL, begin, end, job->sums + c * job->padded * job->nsum);
}

static void solve_range(void *context, size_t task, int worker)
{
    struct job *job = context;
    size_t begin, end, ncoef = job->body->ncoef;
    (void)worker;
    range_of(job, task, &begin, &end);
    for (size_t c = 0; c < 3; c++) {
        float *coefficient = job->coefficient + c * job->padded * ncoef;
        dph_projector_solve(job->projector, job->sums + c * job->padded * job->nsum, begin, end,
                            coefficient);
        for (size_t k = begin; k < end && k < job->npos; k++)
            memcpy(job->row + job->order[k] * job->body->length + c * ncoef,
                   coefficient + k * ncoef, ncoef * sizeof *coefficient);
    }
}

static bool prepare(struct job *job, int *block, struct dph_error *err)
{
    const struct dph_response_body *body = job->body;
    const struct dph_response_bake_params *params = body->params;
    const struct dph_welded *mesh = body->mesh;
    int directions = (params->directions + 1) & ~1;
    job->npos = mesh->npos;
    job->padded = (mesh->npos + 7) & ~(size_t)7;
    job->pairs = directions / 2;
    job->sweep = dph_sweep_create(mesh->position, mesh->npos, mesh->index, mesh->ntri,
                                  params->portable, err);
    job->projector =
        dph_projector_create(params->bands, directions, DPH_FIT_SPHERE, 0, params->portable, err);
    if (!job->sweep || !job->projector)
        return false;
    job->order = dph_sweep_order(job->sweep);
    job->nsum = dph_projector_sums(job->projector);
    size_t column = 6 * job->padded * sizeof(float);
    *block = (int)fmin(MOST_PAIRS, fmax(LEAST_PAIRS, PANEL_BYTES / ((double)column + 1)));
    for (int c = 0; c < 3; c++) {
        job->plus[c] = dph_alloc_aligned(job->padded, (size_t)*block * sizeof(float));
        job->minus[c] = dph_alloc_aligned(job->padded, (size_t)*block * sizeof(float));
        if (!job->plus[c] || !job->minus[c])
            return dph_fail_memory(err);
    }
    job->direction = dph_alloc((size_t)directions, 3 * sizeof(float));
    job->scratch = dph_alloc_zero((size_t)body->threads, sizeof *job->scratch);
    job->sums = dph_alloc_aligned(job->padded, 3 * job->nsum * sizeof(float));
    job->coefficient = dph_alloc_aligned(job->padded, 3 * body->ncoef * sizeof(float));
    if (!job->direction || !job->scratch || !job->sums || !job->coefficient)
        return dph_fail_memory(err);
    memset(job->sums, 0, job->padded * 3 * job->nsum * sizeof(float));
    dph_sh_directions(directions, job->direction);
    for (int i = 0; i < body->threads; i++)
        if (!(job->scratch[i] = dph_sweep_scratch_create(job->sweep, err)))
            return false;
    return true;
}

bool dph_response_unscattered(const struct dph_response_body *body, double progress_span,
                              float *row, struct dph_error *err)
{
    struct job job = {.body = body, .row = row, .progress_span = progress_span};
    int block;
    bool ok = false;
    if (!prepare(&job, &block, err))
        goto error;
    size_t tasks = (job.padded + TASK_POSITIONS - 1) / TASK_POSITIONS;
    for (; job.first < job.pairs; job.first += job.count) {
        job.count = job.pairs - job.first < block ? job.pairs - job.first : block;
        dph_parallel(body->threads, (size_t)job.count, sweep_pair, &job);
        if (atomic_load(&job.cancelled)) {
            dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
            goto error;
        }
        dph_parallel(body->threads, tasks, project_range, &job);
    }
    dph_parallel(body->threads, tasks, solve_range, &job);
    ok = true;

error:
    for (int i = 0; job.scratch && i < body->threads; i++)
        dph_sweep_scratch_destroy(job.scratch[i]);
    for (int c = 0; c < 3; c++) {
        free(job.plus[c]);
        free(job.minus[c]);
    }
    free(job.scratch);
    free(job.direction);
    free(job.sums);
    free(job.coefficient);
    dph_projector_destroy(job.projector);
    dph_sweep_destroy(job.sweep);
    return ok;
}
