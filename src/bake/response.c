/* The forms of a response: from RGB rows to what vertices hold.
 *
 * Rows are turned into one channel or cut to fewer bands, packed as thickness is, and compared with
 * what they were made from, in their packed state. The linear forms are plain cuts, which is the
 * best fit over the sphere since the basis is orthonormal; the square root has bake/root_kernel.c,
 * the colours of one channel bake/ramp.c. */
#include <diaphan/response.h>

#include "bake/ramp.h"
#include "bake/root_kernel.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/simd.h"
#include "core/threads.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 8,
    RAMP_POSITIONS = 4096,
    RAMP_DIRECTIONS = 128,
    ERROR_POSITIONS = 8192,
    ERROR_DIRECTIONS = 96,
    MOST = DPH_MAX_BANDS * DPH_MAX_BANDS
};

static const char *const form_names[] = {"root", "linear", "rgb"};

const char *dph_response_form_name(enum dph_response_form form)
{
    return (size_t)form < sizeof form_names / sizeof *form_names ? form_names[form] : NULL;
}

double dph_response_luminance(const double color[3])
{
    return .2126 * color[0] + .7152 * color[1] + .0722 * color[2];
}

struct dph_response_params dph_response_defaults(void)
{
    return (struct dph_response_params){.form = DPH_RESPONSE_ROOT,
                                        .bands = 6,
                                        .store = DPH_STORE_SNORM8,
                                        .cpca = dph_cpca_defaults()};
}

bool dph_response_preset(int bytes, struct dph_response_params *params)
{
    static const int presets[] = {2, 3, 4, 6};
    for (size_t i = 0; i < sizeof presets / sizeof *presets; i++)
        if (presets[i] * presets[i] == bytes) {
            params->form = DPH_RESPONSE_ROOT;
            params->bands = presets[i];
            params->store = DPH_STORE_SNORM8;
            return true;
        }
    return false;
}

void dph_response_destroy(struct dph_response *response)
{
    if (!response)
        return;
    for (int c = 0; c < 3; c++)
        dph_thickness_destroy(response->channel[c]);
    dph_cpca_destroy(response->clusters);
    free(response->position_of);
    free(response);
}

/* ---- rows of one channel ---- */

/* Channel `channel` of the first `bands` bands of every row, -1: the luminance. */
static void cut_rows(const struct dph_transfer *full, int channel, int bands, float *out)
{
    size_t given = (size_t)(full->bands * full->bands), n = (size_t)(bands * bands);
    for (size_t p = 0; p < full->npos; p++) {
        const float *row = full->vector + p * full->length;
        for (size_t i = 0; i < n; i++) {
            double color[3] = {0};
            for (size_t c = 0; c < 3 && i < given; c++)
                color[c] = (double)row[c * given + i];
            out[p * n + i] = (float)(channel < 0 ? dph_response_luminance(color) : color[channel]);
        }
    }
}

struct root_job {
    struct dph_root_model model;
    const float *target; /* (npos padded to BLOCK x target_bands^2) */
    float *root;         /* (npos padded to BLOCK x bands^2)        */
    int *iterations;     /* (blocks)                                */
    bool avx2;
};

static void root_block(void *context, size_t i, int worker)
{
    const struct root_job *job = context;
    size_t n = (size_t)(job->model.bands * job->model.bands);
    size_t given = (size_t)(job->model.target_bands * job->model.target_bands);
    int (*fit)(const struct dph_root_model *, const float *, float *) = dph_root_fit_portable;
    (void)worker;
#ifdef DPH_HAVE_AVX2
    if (job->avx2)
        fit = dph_root_fit_avx2;
#endif
    job->iterations[i] =
        fit(&job->model, job->target + i * BLOCK * given, job->root + i * BLOCK * n);
}

/* Fits the rows of `root` (blocks x BLOCK x bands^2). */
static bool fit_root(const struct dph_transfer *full, const struct dph_response_params *params,
                     size_t blocks, float *root, int *iterations, struct dph_error *err)
{
    int most = full->bands > params->bands ? full->bands : params->bands;
    size_t given = (size_t)(full->bands * full->bands);
    struct root_job job = {.model = {.bands = params->bands, .target_bands = full->bands},
                           .root = root,
                           .avx2 = !params->portable && dph_cpu_has_avx2()};
    float *target = dph_alloc_zero(blocks * BLOCK, given * sizeof *target);
    float *value = dph_alloc(ROOT_DIRECTIONS, (size_t)(most * most) * sizeof *value);
    float direction[3 * ROOT_DIRECTIONS];
    bool ok = dph_gaunt_init(&job.model.gaunt, params->bands);
    job.target = target;
    job.model.value = value;
    job.iterations = dph_alloc_zero(blocks, sizeof *job.iterations);
    if (!(ok = ok && target && value && job.iterations)) {
        dph_fail_memory(err);
        goto error;
    }
    dph_sh_directions(ROOT_DIRECTIONS, direction);
    for (int d = 0; d < ROOT_DIRECTIONS; d++) {
        double y[MOST];
        dph_sh_eval(most,
                    (double[3]){(double)direction[3 * d], (double)direction[3 * d + 1],
                                (double)direction[3 * d + 2]},
                    y);
        for (int i = 0; i < most * most; i++)
            value[d * most * most + i] = (float)y[i];
    }
    cut_rows(full, -1, full->bands, target);
    dph_parallel(dph_thread_count(params->threads), blocks, root_block, &job);
    *iterations = 0;
    for (size_t i = 0; i < blocks; i++)
        *iterations = job.iterations[i] > *iterations ? job.iterations[i] : *iterations;

error:
    dph_gaunt_finish(&job.model.gaunt);
    free(target);
    free(value);
    free(job.iterations);
    return ok;
}

/* ---- packing ---- */

static struct dph_cpca *compress(const struct dph_transfer *full, const float *row, int n,
                                 const struct dph_response_params *params, struct dph_error *err)
{
    struct dph_cpca_params cpca = params->cpca;
    cpca.threads = params->threads;
    cpca.portable = params->portable;
    cpca.progress = NULL;
    return dph_cpca_create(row, full->npos, n, full->area, &cpca, err);
}

static struct dph_thickness *pack(const struct dph_transfer *full, const float *row,
                                  const struct dph_response_params *params, struct dph_error *err)
{
    if (params->store != DPH_STORE_CPCA)
        return dph_thickness_create(row, full->npos, params->bands, full->position_of, full->nvert,
                                    params->store, err);
    struct dph_cpca *cpca = compress(full, row, params->bands * params->bands, params, err);
    if (!cpca)
        return NULL;
    struct dph_thickness *packed =
        dph_cpca_thickness(cpca, params->bands, full->position_of, full->nvert, err);
    dph_cpca_destroy(cpca);
    return packed;
}

/* RGB: three packed sets, or one compressed signal. */
static bool pack_rgb(const struct dph_transfer *full, const struct dph_response_params *params,
                     struct dph_response *response, struct dph_error *err)
{
    size_t n = (size_t)(params->bands * params->bands), given = (size_t)(full->bands * full->bands);
    float *row = dph_alloc_zero(full->npos, 3 * n * sizeof *row);
    bool ok = false;
    if (!row)
        return dph_fail_memory(err);
    if (params->store != DPH_STORE_CPCA) {
        for (int c = 0; c < 3; c++) {
            cut_rows(full, c, params->bands, row);
            if (!(response->channel[c] = pack(full, row, params, err)))
                goto error;
        }
        ok = true;
        goto error;
    }
    for (size_t p = 0; p < full->npos; p++)
        for (size_t c = 0; c < 3; c++)
            memcpy(row + (3 * p + c) * n, full->vector + p * full->length + c * given,
                   (n < given ? n : given) * sizeof *row);
    response->position_of = dph_alloc(full->nvert, sizeof *response->position_of);
    if (!response->position_of) {
        dph_fail_memory(err);
        goto error;
    }
    memcpy(response->position_of, full->position_of, full->nvert * sizeof *full->position_of);
    if (!(response->clusters = compress(full, row, 3 * (int)n, params, err)))
        goto error;
    if (response->clusters->vectors > DPH_THICKNESS_MAX_VECTORS) {
        dph_fail(err, DPH_ERROR_ARGUMENT,
                 "%d vectors a cluster, a response is stored with at most %d",
                 response->clusters->vectors, DPH_THICKNESS_MAX_VECTORS);
        goto error;
    }
    ok = true;

error:
    free(row);
    return ok;
}

/* ---- what a packed response says ---- */

/* The coefficients of one vertex: one channel, or three in turn. */
static void unpack_row(const struct dph_response *response, size_t vertex, float *row)
{
    int n = response->bands * response->bands;
    if (response->clusters) {
        const struct dph_cpca *cpca = response->clusters;
        size_t p = response->position_of[vertex], vectors = (size_t)cpca->vectors;
        const float *table = cpca->table + cpca->cluster[p] * (1 + vectors) * (size_t)cpca->n;
        for (int i = 0; i < 3 * n; i++)
            row[i] = table[i];
        for (size_t j = 0; j < vectors; j++) {
            float weight = (float)dph_cpca_snorm8(cpca->weight[p * vectors + j]) / 127;
            for (int i = 0; i < 3 * n; i++)
                row[i] += weight * table[(1 + j) * (size_t)(3 * n) + (size_t)i];
        }
        return;
    }
    for (int c = 0; c < 3 && response->channel[c]; c++)
        dph_thickness_row(response->channel[c], vertex, row + c * n);
}

static double dot(const float *row, const double *y, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += (double)row[i] * y[i];
    return sum;
}

/* The value of one channel from the sum of its coefficients. */
static double value_of(const struct dph_response *response, double sum)
{
    return response->form == DPH_RESPONSE_ROOT ? sum * sum : fmax(sum, 0);
}

static void color_of(const struct dph_response *response, const float *row, const double *y,
                     int bands, double color[3])
{
    int n = response->bands * response->bands, used = bands * bands;
    if (response->form != DPH_RESPONSE_RGB) {
        dph_ramp_color(&response->ramp, value_of(response, dot(row, y, used)), color);
        return;
    }
    for (int c = 0; c < 3; c++)
        color[c] = fmax(dot(row + c * n, y, used), 0);
}

void dph_response_along(const struct dph_response *response, size_t vertex,
                        const double direction[3], int bands, double color[3])
{
    float row[3 * MOST];
    double y[MOST];
    assert(vertex < response->nvert);
    if (bands <= 0 || bands > response->bands || response->form == DPH_RESPONSE_ROOT)
        bands = response->bands;
    unpack_row(response, vertex, row);
    dph_sh_eval(bands, direction, y);
    color_of(response, row, y, bands, color);
}

double dph_response_value(const struct dph_response *response, size_t vertex,
                          const double direction[3])
{
    float row[3 * MOST];
    double y[MOST];
    assert(vertex < response->nvert && response->form != DPH_RESPONSE_RGB);
    unpack_row(response, vertex, row);
    dph_sh_eval(response->bands, direction, y);
    return value_of(response, dot(row, y, response->bands * response->bands));
}

/* ---- ramp and errors: samples of positions and directions ---- */

struct sampling {
    const struct dph_transfer *full;
    const struct dph_response *response;
    const uint32_t *vertex; /* (npos) a vertex of each position, UINT32_MAX: none */
    size_t stride;          /* every so many positions                            */
    int directions;
    double *y;                      /* (directions x MOST)                                */
    struct dph_ramp_sample *sample; /* ramp: (positions x directions)             */
    double (
        *square)[4]; /* errors: (positions) sums of squares: luminance, its error, RGB, its error */
};

static void sample_position(void *context, size_t i, int worker)
{
    const struct sampling *s = context;
    size_t p = i * s->stride;
    const float *given = s->full->vector + p * s->full->length;
    float row[3 * MOST];
    int n = s->full->bands * s->full->bands;
    double area = s->vertex[p] == UINT32_MAX ? 0 : (double)s->full->area[p], sum[4] = {0};
    (void)worker;
    if (area > 0)
        unpack_row(s->response, s->vertex[p], row);
    for (int d = 0; d < s->directions; d++) {
        const double *y = s->y + (size_t)d * MOST;
        double truth[3], color[3] = {0}, difference[3];
        for (int c = 0; c < 3; c++)
            truth[c] = dot(given + c * n, y, n);
        if (s->sample) {
            int own = s->response->bands * s->response->bands;
            double value = area > 0 ? value_of(s->response, dot(row, y, own)) : 0;
            s->sample[i * (size_t)s->directions + (size_t)d] = (struct dph_ramp_sample){
                (float)value, {(float)truth[0], (float)truth[1], (float)truth[2]}, (float)area};
            continue;
        }
        if (area > 0)
            color_of(s->response, row, y, s->response->bands, color);
        for (int c = 0; c < 3; c++) {
            difference[c] = color[c] - truth[c];
            sum[2] += truth[c] * truth[c];
            sum[3] += difference[c] * difference[c];
        }
        sum[0] += dph_response_luminance(truth) * dph_response_luminance(truth);
        sum[1] += dph_response_luminance(difference) * dph_response_luminance(difference);
    }
    for (int k = 0; k < 4 && s->square; k++)
        s->square[i][k] = area * sum[k];
}

/* Samples at most so many positions; returns how many, 0: out of memory. */
static size_t begin_sampling(struct sampling *s, size_t most, int directions)
{
    float *direction = dph_alloc((size_t)directions, 3 * sizeof *direction);
    s->stride = (s->full->npos + most - 1) / most;
    s->directions = directions;
    s->y = dph_alloc((size_t)directions, MOST * sizeof *s->y);
    int bands = s->full->bands > s->response->bands ? s->full->bands : s->response->bands;
    bool ok = direction && s->y;
    if (ok)
        dph_sh_directions(directions, direction);
    for (int d = 0; d < directions && ok; d++)
        dph_sh_eval(bands,
                    (double[3]){(double)direction[3 * d], (double)direction[3 * d + 1],
                                (double)direction[3 * d + 2]},
                    s->y + (size_t)d * MOST);
    free(direction);
    return ok ? (s->full->npos + s->stride - 1) / s->stride : 0;
}

static bool fit_ramp(struct sampling s, int threads, struct dph_ramp *ramp, struct dph_error *err)
{
    size_t count = begin_sampling(&s, RAMP_POSITIONS, RAMP_DIRECTIONS);
    s.sample = dph_alloc(count * RAMP_DIRECTIONS, sizeof *s.sample);
    bool ok = count && s.sample;
    if (ok) {
        dph_parallel(threads, count, sample_position, &s);
        dph_ramp_fit(s.sample, count * RAMP_DIRECTIONS, ramp);
    }
    free(s.sample);
    free(s.y);
    return ok || dph_fail_memory(err);
}

static bool measure(struct sampling s, int threads, struct dph_response_report *report,
                    struct dph_error *err)
{
    double sum[4] = {0};
    size_t count = begin_sampling(&s, ERROR_POSITIONS, ERROR_DIRECTIONS);
    s.square = dph_alloc_zero(count, sizeof *s.square);
    bool ok = count && s.square;
    if (ok) {
        dph_parallel(threads, count, sample_position, &s);
        for (size_t i = 0; i < count; i++)
            for (int k = 0; k < 4; k++)
                sum[k] += s.square[i][k];
    }
    report->error = sum[0] > 0 ? sqrt(sum[1] / sum[0]) : 0;
    report->error_rgb = sum[2] > 0 ? sqrt(sum[3] / sum[2]) : 0;
    free(s.square);
    free(s.y);
    return ok || dph_fail_memory(err);
}

/* ---- all of it ---- */

static bool check(const struct dph_transfer *full, const struct dph_response_params *params,
                  struct dph_error *err)
{
    if (params->form < DPH_RESPONSE_ROOT || params->form > DPH_RESPONSE_RGB)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "form %d of a response is not known",
                        (int)params->form);
    if (params->bands < 1 || params->bands > DPH_DRAW_BANDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d bands of a response: 1 to %d are drawn",
                        params->bands, DPH_DRAW_BANDS);
    if (!dph_store_name(params->store))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "store %d is not known", (int)params->store);
    if (full->channels != 3 || full->bands < 1 || full->bands > DPH_MAX_BANDS || !full->area ||
        full->length != 3 * (size_t)(full->bands * full->bands))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a response is made of RGB rows with areas");
    for (size_t i = 0; i < full->npos * full->length; i++)
        if (!isfinite(full->vector[i]))
            return dph_fail(err, DPH_ERROR_INPUT, "number %zu of response row %zu is not finite",
                            i % full->length, i / full->length);
    return true;
}

static bool report_progress(const struct dph_response_params *params, double fraction,
                            struct dph_error *err)
{
    return !params->progress || params->progress(params->progress_user, fraction) ||
           dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
}

struct dph_response *dph_response_create(const struct dph_transfer *full,
                                         const struct dph_response_params *params,
                                         struct dph_response_report *report, struct dph_error *err)
{
    struct dph_response_report done = {.positions = full->npos};
    if (!check(full, params, err))
        return NULL;
    int threads = dph_thread_count(params->threads);
    size_t n = (size_t)(params->bands * params->bands), blocks = (full->npos + BLOCK - 1) / BLOCK;
    uint32_t *vertex = dph_alloc(full->npos, sizeof *vertex);
    float *row = dph_alloc(blocks * BLOCK, n * sizeof *row);
    struct dph_response *response = dph_alloc_zero(1, sizeof *response);
    double start = dph_seconds();
    bool ok = false;
    if (!vertex || !row || !response) {
        dph_fail_memory(err);
        goto error;
    }
    response->form = params->form;
    response->bands = params->bands;
    response->nvert = full->nvert;
    response->view = dph_view_even();
    memset(vertex, 0xff, full->npos * sizeof *vertex);
    for (size_t v = full->nvert; v-- > 0;)
        vertex[full->position_of[v]] = (uint32_t)v;

    if (!report_progress(params, 0, err))
        goto error;
    if (params->form == DPH_RESPONSE_ROOT) {
        if (!fit_root(full, params, blocks, row, &done.iterations, err))
            goto error;
    } else if (params->form == DPH_RESPONSE_LINEAR) {
        cut_rows(full, -1, params->bands, row);
    }
    done.seconds_fit = dph_seconds() - start;
    if (!report_progress(params, .6, err))
        goto error;
    start = dph_seconds();
    if (params->form == DPH_RESPONSE_RGB ? !pack_rgb(full, params, response, err)
                                         : !(response->channel[0] = pack(full, row, params, err)))
        goto error;
    done.seconds_store = dph_seconds() - start;
    if (!report_progress(params, .8, err))
        goto error;
    start = dph_seconds();
    struct sampling sampling = {.full = full, .response = response, .vertex = vertex};
    dph_ramp_fit(NULL, 0, &response->ramp);
    if (full->npos &&
        ((params->form != DPH_RESPONSE_RGB && !fit_ramp(sampling, threads, &response->ramp, err)) ||
         !measure(sampling, threads, &done, err)))
        goto error;
    done.seconds_ramp = dph_seconds() - start;
    if (!report_progress(params, 1, err))
        goto error;
    if (report)
        *report = done;
    ok = true;

error:
    free(vertex);
    free(row);
    if (!ok) {
        dph_response_destroy(response);
        return NULL;
    }
    return response;
}

/* ---- what it takes ---- */

static size_t sum_channels(const struct dph_response *response,
                           size_t (*of)(const struct dph_thickness *))
{
    size_t sum = 0;
    for (int c = 0; c < 3; c++)
        sum += response->channel[c] ? of(response->channel[c]) : 0;
    return sum;
}

size_t dph_response_payload(const struct dph_response *response)
{
    const struct dph_cpca *cpca = response->clusters;
    return cpca ? (size_t)cpca->vectors + (cpca->clusters <= 256 ? 1 : 2)
                : sum_channels(response, dph_thickness_payload);
}

size_t dph_response_fetched(const struct dph_response *response)
{
    const struct dph_cpca *cpca = response->clusters;
    return cpca ? ((size_t)cpca->vectors + 3) / 4 * 4 + 4
                : sum_channels(response, dph_thickness_fetched);
}

size_t dph_response_shared(const struct dph_response *response)
{
    const struct dph_cpca *cpca = response->clusters;
    size_t ramp = response->form == DPH_RESPONSE_RGB ? 0 : sizeof response->ramp.color;
    return ramp + (cpca ? (size_t)cpca->clusters * (1 + (size_t)cpca->vectors) * (size_t)cpca->n *
                              sizeof *cpca->table
                        : sum_channels(response, dph_thickness_shared));
}
