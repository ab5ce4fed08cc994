/* The start-up stage: thickness from every position in all directions (sweep.c), projected to
 * spherical harmonics (sh/project.c).
 *
 * Directions are independent, and so are positions. A block of direction pairs is swept by all
 * threads, a pair each, into a panel of columns over the positions; then all threads add the
 * panel to the positions' running sums, a range of positions each. So never more than a panel of
 * samples is in memory, and every sum is made in the order of the directions, whatever the
 * number of threads. */
#include <diaphan/bake.h>
#include <diaphan/mesh.h>

#include "bake/sweep.h"
#include "bake/welded.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"
#include "sh/project.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A panel is at most this many pairs and, above the least number, this many bytes. Neither
 * changes the result. */
enum { MOST_PAIRS = 64, LEAST_PAIRS = 16, PANEL_BYTES = 96 << 20 };

/* Positions of one projection task: a multiple of 8. */
enum { TASK_POSITIONS = 512 };

struct dph_bake_params dph_bake_defaults(void)
{
    return (struct dph_bake_params){.bands = 6, .directions = 1024, .fit = DPH_FIT_WEIGHTED};
}

size_t dph_bake_size(const struct dph_bake_input *input, const struct dph_bake_params *params)
{
    return input->nvert * (size_t)(params->bands * params->bands);
}

/* The s of the weights exp(-2 s S), from the material's effective transport coefficient and the
 * largest side (docs/theory.md, "Weighted fit"). */
static double weight_extinction(const struct dph_bake_params *params, const struct dph_welded *welded)
{
    double side = params->largest_side > 0 ? params->largest_side : welded->side;
    double per_side = side > 0 ? 3 / side : 0;
    return 0.5 * sqrt(params->extinction * params->extinction + per_side * per_side);
}

static bool check_params(const struct dph_bake_params *params, struct dph_error *err)
{
    if (params->bands < 1 || params->bands > DPH_MAX_BANDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "bands are 1 to %d, not %d", DPH_MAX_BANDS, params->bands);
    if (params->directions < 16 || params->directions > 65536)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "directions are 16 to 65536, not %d", params->directions);
    if (!dph_definition_name(params->definition) || !dph_fit_name(params->fit))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "unknown thickness definition or fit");
    if (!(params->extinction >= 0 && params->extinction < INFINITY) ||
        !(params->largest_side >= 0 && params->largest_side < INFINITY))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "extinction and largest side are finite and not negative");
    return true;
}

/* Everything that the tasks of one bake share. */
struct bake {
    const struct dph_bake_params *params;
    struct dph_sweep *sweep;
    struct dph_projector *projector;
    struct dph_sweep_scratch **scratch; /* (threads)                                               */
    const float *direction;             /* (directions x 3)                                        */
    size_t npos, padded, nsum, ncoef;
    int pairs;                          /* of the whole bake                                       */
    int first, count;                   /* pairs of the current block                              */
    float *plus, *minus;                /* (count x padded)                                        */
    size_t *bad;                        /* (threads)                                               */
    float *normal;                      /* (padded x 3) in the sweep's order                       */
    float *sums, *coefficient;          /* (padded x nsum), (padded x ncoef)                       */
    atomic_bool cancelled;
};

/* Worker 0 is the thread that called the library; its tasks come in order. */
static void report_progress(struct bake *bake, double fraction, int worker)
{
    const struct dph_bake_params *params = bake->params;
    if (worker == 0 && params->progress && !params->progress(params->progress_user, fraction))
        atomic_store(&bake->cancelled, true);
}

static void sweep_pair(void *context, size_t i, int worker)
{
    struct bake *bake = context;
    if (atomic_load(&bake->cancelled))
        return;
    const float *f = bake->direction + 6 * ((size_t)bake->first + i);
    double d[3] = {f[0], f[1], f[2]}, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int k = 0; k < 3; k++)
        d[k] /= length;
    bake->bad[worker] += dph_sweep_run(bake->sweep, bake->scratch[worker], bake->params->definition,
                                       d, bake->plus + i * bake->padded, bake->minus + i * bake->padded,
                                       NULL, NULL);
    report_progress(bake, ((double)bake->first + (double)i) / bake->pairs, worker);
}

static void range_of(const struct bake *bake, size_t i, size_t *begin, size_t *end)
{
    *begin = i * TASK_POSITIONS;
    *end = *begin + TASK_POSITIONS < bake->padded ? *begin + TASK_POSITIONS : bake->padded;
}

static void project_range(void *context, size_t i, int worker)
{
    (void)worker;
    struct bake *bake = context;
    size_t begin, end;
    range_of(bake, i, &begin, &end);
    dph_projector_add(bake->projector, bake->first, bake->count, bake->plus, bake->minus,
                      bake->padded, bake->normal, begin, end, bake->sums);
}

static void solve_range(void *context, size_t i, int worker)
{
    (void)worker;
    struct bake *bake = context;
    size_t begin, end;
    range_of(bake, i, &begin, &end);
    dph_projector_solve(bake->projector, bake->sums, begin, end, bake->coefficient);
}

/* One normal a position, angle-weighted, in the sweep's order and padded. NULL: out of memory. */
static float *ordered_normals(const struct dph_welded *welded, const struct dph_sweep *sweep, size_t padded)
{
    float *normal = dph_alloc(welded->npos, 3 * sizeof *normal);
    float *ordered = dph_alloc_zero(padded, 3 * sizeof *ordered);
    if (normal && ordered) {
        dph_mesh_position_normals(welded->position, welded->npos, welded->index, welded->ntri, normal);
        const uint32_t *order = dph_sweep_order(sweep);
        for (size_t i = 0; i < welded->npos; i++)
            memcpy(ordered + 3 * i, normal + 3 * (size_t)order[i], 3 * sizeof *normal);
    }
    free(normal);
    return ordered;
}

/* Sweeps and projects; bake->coefficient is then filled, in the sweep's order. */
static bool run(struct bake *bake, int threads, struct dph_bake_report *report, struct dph_error *err)
{
    size_t tasks = (bake->padded + TASK_POSITIONS - 1) / TASK_POSITIONS;
    size_t column = bake->padded * 2 * sizeof(float);
    int block = column ? (int)fmin(MOST_PAIRS, fmax(LEAST_PAIRS, (double)PANEL_BYTES / (double)column)) : 1;
    bake->plus = dph_alloc_aligned(bake->padded * (size_t)block, sizeof(float));
    bake->minus = dph_alloc_aligned(bake->padded * (size_t)block, sizeof(float));
    if (!bake->plus || !bake->minus)
        return dph_fail_memory(err);
    for (bake->first = 0; bake->first < bake->pairs; bake->first += bake->count) {
        bake->count = bake->pairs - bake->first < block ? bake->pairs - bake->first : block;
        double start = dph_seconds();
        dph_parallel(threads, (size_t)bake->count, sweep_pair, bake);
        /* on a busy machine the other workers may have left none of the tasks to this thread */
        report_progress(bake, (double)(bake->first + bake->count) / bake->pairs, 0);
        if (atomic_load(&bake->cancelled))
            return dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
        double swept = dph_seconds();
        dph_parallel(threads, tasks, project_range, bake);
        report->seconds_sweep += swept - start;
        report->seconds_project += dph_seconds() - swept;
    }
    double start = dph_seconds();
    dph_parallel(threads, tasks, solve_range, bake);
    report->seconds_project += dph_seconds() - start;
    return true;
}

bool dph_bake(const struct dph_bake_input *input, const struct dph_bake_params *params,
              float *coefficient, struct dph_bake_report *report, struct dph_error *err)
{
    if (!check_params(params, err))
        return false;
    bool ok = false;
    int threads = dph_thread_count(params->threads), directions = (params->directions + 1) & ~1;
    struct dph_bake_report local = {.directions = directions, .threads = threads};
    struct dph_welded welded = {0};
    struct bake bake = {.params = params, .pairs = directions / 2};
    float *direction = NULL;
    uint32_t *place = NULL;
    if (!dph_welded_init(&welded, input, err))
        goto end;
    double start = dph_seconds();
    bake.npos = welded.npos;
    bake.padded = (welded.npos + 7) & ~(size_t)7;
    bake.ncoef = (size_t)(params->bands * params->bands);
    bake.sweep = dph_sweep_create(welded.position, welded.npos, welded.index, welded.ntri,
                                  params->portable, err);
    bake.projector = dph_projector_create(params->bands, directions, params->fit,
                                          weight_extinction(params, &welded), params->portable, err);
    if (!bake.sweep || !bake.projector)
        goto end;
    bake.nsum = dph_projector_sums(bake.projector);
    bake.direction = direction = dph_alloc((size_t)directions, 3 * sizeof *direction);
    bake.normal = ordered_normals(&welded, bake.sweep, bake.padded);
    bake.sums = dph_alloc_aligned(bake.padded, bake.nsum * sizeof *bake.sums);
    bake.bad = dph_alloc_zero((size_t)threads, sizeof *bake.bad);
    bake.scratch = dph_alloc_zero((size_t)threads, sizeof *bake.scratch);
    if (!bake.direction || !bake.normal || !bake.sums || !bake.bad || !bake.scratch)
        goto memory;
    for (int i = 0; i < threads; i++)
        if (!(bake.scratch[i] = dph_sweep_scratch_create(bake.sweep, err)))
            goto end;
    memset(bake.sums, 0, bake.padded * bake.nsum * sizeof *bake.sums);
    dph_sh_directions(directions, direction);
    bake.coefficient = dph_alloc_aligned(bake.padded, bake.ncoef * sizeof *bake.coefficient);
    place = dph_alloc(welded.npos, sizeof *place);
    if (!bake.coefficient || !place)
        goto memory;
    local.seconds_sweep = dph_seconds() - start;
    if (!run(&bake, threads, &local, err))
        goto end;

    for (size_t i = 0; i < welded.npos; i++)
        place[dph_sweep_order(bake.sweep)[i]] = (uint32_t)i;
    for (size_t v = 0; v < input->nvert; v++)
        memcpy(coefficient + v * bake.ncoef,
               bake.coefficient + (size_t)place[welded.position_of[v]] * bake.ncoef,
               bake.ncoef * sizeof *coefficient);
    local.positions = welded.npos;
    size_t bad = 0;
    for (int i = 0; i < threads; i++)
        bad += bake.bad[i];
    local.untrusted = welded.npos ? (double)bad / ((double)welded.npos * directions) : 0;
    if (report)
        *report = local;
    ok = true;
    goto end;

memory:
    dph_fail_memory(err);
end:
    for (int i = 0; bake.scratch && i < threads; i++)
        dph_sweep_scratch_destroy(bake.scratch[i]);
    free(bake.scratch);
    free(bake.bad);
    free(bake.plus);
    free(bake.minus);
    free(bake.normal);
    free(bake.sums);
    free(bake.coefficient);
    free(direction);
    free(place);
    dph_projector_destroy(bake.projector);
    dph_sweep_destroy(bake.sweep);
    dph_welded_finish(&welded);
    return ok;
}

bool dph_bake_direction(const struct dph_bake_input *input, const struct dph_bake_params *params,
                        const double direction[3], float *plus, float *minus, uint8_t *bad_plus,
                        uint8_t *bad_minus, struct dph_error *err)
{
    double length = sqrt(direction[0] * direction[0] + direction[1] * direction[1] +
                         direction[2] * direction[2]);
    if (!check_params(params, err))
        return false;
    if (!(length > 0 && length < INFINITY))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a direction needs a length");
    const double d[3] = {direction[0] / length, direction[1] / length, direction[2] / length};
    bool ok = false;
    struct dph_welded welded = {0};
    struct dph_sweep *sweep = NULL;
    struct dph_sweep_scratch *scratch = NULL;
    float *length_of = NULL;
    uint8_t *bad_of = NULL;
    uint32_t *place = NULL;
    if (!dph_welded_init(&welded, input, err) ||
        !(sweep = dph_sweep_create(welded.position, welded.npos, welded.index, welded.ntri,
                                   params->portable, err)) ||
        !(scratch = dph_sweep_scratch_create(sweep, err)))
        goto end;
    size_t padded = (welded.npos + 7) & ~(size_t)7;
    length_of = dph_alloc(2 * padded, sizeof *length_of);
    bad_of = dph_alloc(2 * padded, sizeof *bad_of);
    place = dph_alloc(welded.npos, sizeof *place);
    if (!length_of || !bad_of || !place) {
        dph_fail_memory(err);
        goto end;
    }
    dph_sweep_run(sweep, scratch, params->definition, d, length_of, length_of + padded, bad_of,
                  bad_of + padded);
    for (size_t i = 0; i < welded.npos; i++)
        place[dph_sweep_order(sweep)[i]] = (uint32_t)i;
    for (size_t v = 0; v < input->nvert; v++) {
        size_t p = place[welded.position_of[v]];
        if (plus)
            plus[v] = length_of[p];
        if (minus)
            minus[v] = length_of[padded + p];
        if (bad_plus)
            bad_plus[v] = bad_of[p];
        if (bad_minus)
            bad_minus[v] = bad_of[padded + p];
    }
    ok = true;
end:
    free(length_of);
    free(bad_of);
    free(place);
    dph_sweep_scratch_destroy(scratch);
    dph_sweep_destroy(sweep);
    dph_welded_finish(&welded);
    return ok;
}
