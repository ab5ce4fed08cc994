/* Clustered principal component analysis (Sloan, Hall, Hart, Snyder, "Clustered Principal
 * Components for Precomputed Radiance Transfer", SIGGRAPH 2003).
 *
 * Signals are points of a space of n dimensions. Clusters are affine subspaces, a mean and a few
 * orthonormal vectors, and a signal belongs to the one that comes nearest to it. As with k-means,
 * two steps alternate: each signal goes to its best cluster; each cluster takes the mean of its
 * signals and the leading eigenvectors of their covariance, which is the best subspace there is
 * (between the rounds a few steps towards them do, which cost less). No step raises the error.
 * Where this ends depends on where it began, so it begins with the seeds of k-means++ (Arthur,
 * Vassilvitskii 2007) from a fixed random sequence, and the subspaces grow: no vector at first,
 * then 1, 2, 4, ... A cluster that is left with no more signals than its vectors could hold
 * exactly is given up and set down at the signal that fares worst, with the vectors of that
 * signal's cluster: it takes one half of it.
 *
 * At the end every weight of a cluster is divided by the largest of its column, and the vector
 * multiplied by it, so that signed normalized bytes use all of their range; rounding is then far
 * below what the missing vectors leave out.
 *
 * Signals are centred as a whole, scaled by a power of two and kept in tiles of 16
 * (cpca_kernel.c). Signals are assigned and clusters analysed by tasks that share nothing, sums
 * over tasks are made in the order of the tasks: the number of threads changes no bit. */
#include <diaphan/cpca.h>

#include "bake/cpca_kernel.h"
#include "bake/eigen.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/simd.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Signals of a task, tiles of a seeding task, and the most tiles that seeds are drawn from. */
enum { TASK_TILES = 32, SEED_TILES = 16, SAMPLE_TILES = 1024, MOST_NUMBERS = 1024 };

/* Rounds without vectors, and with each number of vectors on the way to all of them. */
enum { FIRST_ROUNDS = 3, GROWTH_ROUNDS = 2 };

/* The last rounds end where they lower the error by less than this share. */
static const double STANDSTILL = 1e-3;

struct work {
    const struct dph_cpca_params *params;
    const float *signal, *importance;
    size_t count, n, ntile, ntask;
    int threads, clusters, vectors;
    bool avx2;
    double scale, norm;     /* power of two; sum of importance |scaled signal|^2 before centring    */
    double *centre;         /* (n)                                                                  */
    float *tile;            /* (ntile x n x 16) centred, scaled                                     */
    int used;               /* vectors in use                                                       */
    bool exact;             /* eigenvectors are to be found anew, not improved                      */
    double *mean, *vector;  /* (clusters x n), (clusters x vectors x n)                             */
    float *column, *offset; /* of struct dph_cpca_model                                             */
    int32_t *cluster;       /* (ntile x 16)                                                         */
    float *error;           /* (ntile x 16)                                                         */
    uint32_t *member, *start; /* (count), (clusters + 1): the signals of each cluster, ascending     */
    double *partial;        /* (ntask x 3)                                                          */
    double *scratch;        /* (threads x room)                                                     */
    size_t room;
    const float *seed_column, *seed_offset;
    size_t seed_step, nsample;
    struct dph_cpca *result;
};

struct dph_cpca_params dph_cpca_defaults(void)
{
    return (struct dph_cpca_params){.clusters = 128, .vectors = 8, .iterations = 20, .seed = 1};
}

int8_t dph_cpca_snorm8(float weight)
{
    float q = weight * 127;
    q = q > -127 ? q : -127;
    q = q < 127 ? q : 127;
    return (int8_t)(q + (q < 0 ? -.5f : .5f));
}

/* Steele, Lea, Flood 2014 (SplitMix): equidistributed, and any seed will do. Uniform in [0, 1). */
static double next_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static double weight_of(const struct work *w, size_t signal)
{
    return w->importance ? (double)w->importance[signal] : 1;
}

static float number(const struct work *w, size_t signal, size_t i)
{
    return w->tile[signal / CPCA_TILE * CPCA_TILE * w->n + i * CPCA_TILE + signal % CPCA_TILE];
}

/* Fills centre, scale, norm and the tiles. Differences from the mean that are no more than the
 * rounding of the signals are taken for none. */
static void fill_tiles(struct work *w)
{
    double total = 0, largest = 0, spread = 0;
    for (size_t s = 0; s < w->count; s++) {
        double weight = weight_of(w, s);
        total += weight;
        for (size_t i = 0; i < w->n; i++)
            w->centre[i] += weight * (double)w->signal[s * w->n + i];
    }
    for (size_t i = 0; i < w->n; i++)
        w->centre[i] = total > 0 ? w->centre[i] / total : 0;
    for (size_t s = 0; s < w->count; s++)
        for (size_t i = 0; i < w->n; i++) {
            double x = w->signal[s * w->n + i];
            largest = fmax(largest, fabs(x));
            spread = fmax(spread, fabs(x - w->centre[i]));
        }
    int exponent = 0;
    bool flat = !(spread > 1e-7 * largest);
    frexp(flat ? largest : spread, &exponent);
    w->scale = ldexp(1, -exponent);
    for (size_t s = 0; s < w->count; s++) {
        float *to = w->tile + s / CPCA_TILE * CPCA_TILE * w->n + s % CPCA_TILE;
        double square = 0;
        for (size_t i = 0; i < w->n; i++) {
            double x = w->signal[s * w->n + i];
            square += x * w->scale * (x * w->scale);
            to[i * CPCA_TILE] = flat ? 0 : (float)((x - w->centre[i]) * w->scale);
        }
        w->norm += weight_of(w, s) * square;
    }
}

static void assign(const struct work *w, const struct dph_cpca_model *model, const float *tile,
                   size_t ntile, int32_t *cluster, float *error)
{
#ifdef DPH_HAVE_AVX2
    if (w->avx2) {
        dph_cpca_assign_avx2(model, tile, ntile, cluster, error);
        return;
    }
#else
    (void)w;
#endif
    dph_cpca_assign_portable(model, tile, ntile, cluster, error);
}

/* ---- the first clusters ---- */

/* Signals i of the sample: those of every seed_step-th tile. */
static size_t sampled(const struct work *w, size_t i)
{
    return i / CPCA_TILE * w->seed_step * CPCA_TILE + i % CPCA_TILE;
}

/* error = min(error, squared distance to the newest seed), for some tiles of the sample. */
static void measure_seed(void *context, size_t task, int worker)
{
    (void)worker;
    struct work *w = context;
    struct dph_cpca_model model = {.n = (int)w->n, .clusters = 1, .column = w->seed_column, .offset = w->seed_offset};
    int32_t cluster[CPCA_TILE];
    float error[CPCA_TILE];
    for (size_t t = task * SEED_TILES; t < (task + 1) * SEED_TILES && t * w->seed_step < w->ntile; t++) {
        assign(w, &model, w->tile + t * w->seed_step * CPCA_TILE * w->n, 1, cluster, error);
        for (size_t k = 0; k < CPCA_TILE; k++) {
            float *least = &w->error[t * CPCA_TILE + k];
            *least = error[k] < *least ? error[k] : *least;
        }
    }
}

static void place_column(struct work *w, int cluster);

/* k-means++: each seed is a signal, drawn with a chance proportional to the squared distance from
 * the seeds before. Ends early where every signal is a seed. */
static void seed(struct work *w)
{
    uint64_t state = w->params->seed;
    w->seed_step = (w->ntile + SAMPLE_TILES - 1) / SAMPLE_TILES;
    size_t tiles = (w->ntile + w->seed_step - 1) / w->seed_step;
    size_t last = (tiles - 1) * w->seed_step * CPCA_TILE;
    w->nsample = (tiles - 1) * CPCA_TILE + (w->count - last < CPCA_TILE ? w->count - last : CPCA_TILE);
    for (size_t i = 0; i < tiles * CPCA_TILE; i++)
        w->error[i] = INFINITY;
    for (int c = 0; c < w->clusters; c++) {
        double total = 0, sum = 0;
        size_t chosen = 0;
        for (size_t i = 0; i < w->nsample; i++)
            total += weight_of(w, sampled(w, i)) * (c ? (double)w->error[i] : 1);
        /* float leaves this much of a distance of 0 */
        if (c && !(total > 1e-12 * (double)w->nsample)) {
            w->clusters = c;
            return;
        }
        double wanted = next_random(&state) * total;
        for (size_t i = 0; i < w->nsample; i++) {
            double share = weight_of(w, sampled(w, i)) * (c ? (double)w->error[i] : 1);
            sum += share;
            chosen = share > 0 ? i : chosen;
            if (sum > wanted)
                break;
        }
        for (size_t i = 0; i < w->n; i++)
            w->mean[(size_t)c * w->n + i] = (double)number(w, sampled(w, chosen), i);
        place_column(w, c);
        w->seed_column = w->column + (size_t)c * w->n;
        w->seed_offset = w->offset + c;
        dph_parallel(w->threads, (tiles + SEED_TILES - 1) / SEED_TILES, measure_seed, w);
    }
}

/* ---- the two steps ---- */

/* The float table of a cluster from its mean and the vectors in use. */
static void place_column(struct work *w, int cluster)
{
    size_t c = (size_t)cluster, columns = 1 + (size_t)w->used;
    const double *mean = w->mean + c * w->n;
    float *column = w->column + c * w->n * columns, *offset = w->offset + c * columns;
    double square = 0;
    for (size_t i = 0; i < w->n; i++) {
        column[i * columns] = (float)mean[i];
        square += mean[i] * mean[i];
    }
    offset[0] = (float)square;
    for (size_t j = 0; j < (size_t)w->used; j++) {
        const double *vector = w->vector + (c * (size_t)w->vectors + j) * w->n;
        double dot = 0;
        for (size_t i = 0; i < w->n; i++) {
            column[i * columns + 1 + j] = (float)vector[i];
            dot += mean[i] * vector[i];
        }
        offset[1 + j] = (float)dot;
    }
}

static void assign_task(void *context, size_t task, int worker)
{
    (void)worker;
    struct work *w = context;
    size_t first = task * TASK_TILES, tiles = w->ntile - first < TASK_TILES ? w->ntile - first : TASK_TILES;
    struct dph_cpca_model model = {(int)w->n, w->clusters, w->used, w->column, w->offset};
    assign(w, &model, w->tile + first * CPCA_TILE * w->n, tiles, w->cluster + first * CPCA_TILE,
           w->error + first * CPCA_TILE);
    double sum = 0;
    for (size_t s = first * CPCA_TILE; s < (first + tiles) * CPCA_TILE && s < w->count; s++)
        sum += weight_of(w, s) * (double)w->error[s];
    w->partial[3 * task] = sum;
}

/* Sends every signal to its best cluster and lists members. Returns the relative error. */
static double assign_all(struct work *w)
{
    dph_parallel(w->threads, w->ntask, assign_task, w);
    double sum = 0;
    for (size_t i = 0; i < w->ntask; i++)
        sum += w->partial[3 * i];
    memset(w->start, 0, ((size_t)w->clusters + 1) * sizeof *w->start);
    for (size_t s = 0; s < w->count; s++)
        w->start[w->cluster[s] + 1]++;
    for (int c = 0; c < w->clusters; c++)
        w->start[c + 1] += w->start[c];
    for (size_t s = 0; s < w->count; s++)
        w->member[w->start[w->cluster[s]]++] = (uint32_t)s;
    for (int c = w->clusters; c > 0; c--)
        w->start[c] = w->start[c - 1];
    w->start[0] = 0;
    return w->norm > 0 ? sqrt(sum / w->norm) : 0;
}

/* Mean and leading eigenvectors of one cluster; one whose signals count for nothing stays as it
 * is. */
static void analyse_task(void *context, size_t c, int worker)
{
    struct work *w = context;
    size_t n = w->n, count = w->start[c + 1] - w->start[c];
    const uint32_t *member = w->member + w->start[c];
    double *mean = w->mean + c * n, total = 0;
    for (size_t k = 0; k < count; k++)
        total += weight_of(w, member[k]);
    if (total > 0) {
        memset(mean, 0, n * sizeof *mean);
        for (size_t k = 0; k < count; k++)
            for (size_t i = 0; i < n; i++)
                mean[i] += weight_of(w, member[k]) * (double)number(w, member[k], i);
        for (size_t i = 0; i < n; i++)
            mean[i] /= total;
    }
    if (total > 0 && w->used) {
        double *covariance = w->scratch + (size_t)worker * w->room, *vector = covariance + n * n;
        double *value = vector + n * n, *scratch = value + n;
        bool avx2 = false;
        memset(covariance, 0, n * n * sizeof *covariance);
#ifdef DPH_HAVE_AVX2
        if ((avx2 = w->avx2))
            dph_cpca_covariance_avx2((int)n, w->tile, member, count, w->importance, mean, covariance, scratch);
#endif
        if (!avx2)
            dph_cpca_covariance_portable((int)n, w->tile, member, count, w->importance, mean, covariance, scratch);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < i; j++)
                covariance[j * n + i] = covariance[i * n + j];
        /* all vectors are kept up, those not yet in use, too; where there are none, eigenvectors are found anew */
        double *own = w->vector + c * (size_t)w->vectors * n;
        bool done = false;
#ifdef DPH_HAVE_AVX2
        if (avx2) {
            done = !w->exact && dph_subspace_avx2((int)n, w->vectors, covariance, own, vector);
            if (!done)
                dph_eigen_avx2((int)n, covariance, value, vector, scratch);
        }
#endif
        if (!avx2) {
            done = !w->exact && dph_subspace_portable((int)n, w->vectors, covariance, own, vector);
            if (!done)
                dph_eigen_portable((int)n, covariance, value, vector, scratch);
        }
        if (!done)
            memcpy(own, vector, (size_t)w->vectors * n * sizeof *vector);
    }
    place_column(w, (int)c);
}

/* Gives tiny clusters a new place. A cluster that has been halved in this round is left alone.
 * Returns how many were moved. */
static int relocate(struct work *w)
{
    int moved = 0;
    size_t size = (size_t)w->vectors * w->n;
    for (int c = 0; c < w->clusters; c++) {
        if (w->start[c + 1] - w->start[c] > (uint32_t)w->used)
            continue;
        size_t worst = SIZE_MAX;
        double most = 1e-11; /* float leaves this much of 0 */
        for (size_t s = 0; s < w->count; s++) {
            double error = weight_of(w, s) * (double)w->error[s];
            int32_t home = w->cluster[s];
            if (error > most && home >= 0 && w->start[home + 1] - w->start[home] > (uint32_t)w->used + 1) {
                most = error;
                worst = s;
            }
        }
        if (worst == SIZE_MAX)
            break;
        int32_t home = w->cluster[worst];
        for (size_t i = 0; i < w->n; i++)
            w->mean[(size_t)c * w->n + i] = (double)number(w, worst, i);
        memcpy(w->vector + (size_t)c * size, w->vector + (size_t)home * size, size * sizeof *w->vector);
        place_column(w, c);
        for (uint32_t k = w->start[home]; k < w->start[home + 1]; k++)
            w->error[w->member[k]] = 0;
        moved++;
    }
    return moved;
}

static bool report(const struct work *w, double done, double all, struct dph_error *err)
{
    if (w->params->progress && !w->params->progress(w->params->progress_user, done / all))
        return dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
    return true;
}

/* Everything up to the last assignment and the clusters that fit it. */
static bool iterate(struct work *w, struct dph_error *err)
{
    struct dph_cpca *result = w->result;
    double error = 0, done = 0, all = w->params->iterations + 1;
    for (int used = 0; used < w->vectors; used = used ? 2 * used : 1)
        all += used ? GROWTH_ROUNDS : FIRST_ROUNDS;
    seed(w);
    error = assign_all(w);
    for (int used = 0; used < w->vectors; used = used ? 2 * used : 1)
        for (int round = 0; round < (used ? GROWTH_ROUNDS : FIRST_ROUNDS); round++) {
            w->used = used;
            dph_parallel(w->threads, (size_t)w->clusters, analyse_task, w);
            relocate(w);
            error = assign_all(w);
            if (!report(w, ++done, all, err))
                return false;
        }
    w->used = w->vectors;
    for (int round = 0; round < w->params->iterations; round++) {
        double before = error;
        dph_parallel(w->threads, (size_t)w->clusters, analyse_task, w);
        /* the last rounds only settle what there is */
        int moved = 2 * round < w->params->iterations ? relocate(w) : 0;
        error = assign_all(w);
        result->history[result->iterations++] = error;
        if (!report(w, ++done, all, err))
            return false;
        if (round && !moved && !(before - error > STANDSTILL * before))
            break;
    }
    w->exact = true;
    dph_parallel(w->threads, (size_t)w->clusters, analyse_task, w);
    return true;
}

/* ---- the result ---- */

/* Weights of a cluster's members, its table row, in the unit of the signals. */
static void finish_task(void *context, size_t c, int worker)
{
    (void)worker;
    struct work *w = context;
    struct dph_cpca *result = w->result;
    size_t n = w->n, vectors = (size_t)w->vectors;
    const double *mean = w->mean + c * n;
    if (w->start[c] == w->start[c + 1])
        return;
    size_t place = result->cluster[w->member[w->start[c]]];
    float *table = result->table + place * (1 + vectors) * n;
    for (size_t i = 0; i < n; i++)
        table[i] = (float)(w->centre[i] + mean[i] / w->scale);
    for (size_t j = 0; j < vectors; j++) {
        const double *vector = w->vector + (c * vectors + j) * n;
        double most = 0;
        for (int pass = 0; pass < 2; pass++)
            for (uint32_t k = w->start[c]; k < w->start[c + 1]; k++) {
                size_t s = w->member[k];
                double dot = 0;
                for (size_t i = 0; i < n; i++)
                    dot += ((double)number(w, s, i) - mean[i]) * vector[i];
                if (pass == 0)
                    most = fmax(most, fabs(dot));
                else
                    result->weight[s * vectors + j] = most > 1e-12 ? (float)(dot / most) : 0;
            }
        for (size_t i = 0; i < n; i++)
            table[(1 + j) * n + i] = most > 1e-12 ? (float)(vector[i] * (most / w->scale)) : 0;
    }
}

/* A signal from a cluster's table and any weights. */
static void decode(const struct dph_cpca *cpca, size_t s, const float *weight, float *signal)
{
    size_t n = (size_t)cpca->n, vectors = (size_t)cpca->vectors;
    const float *table = cpca->table + cpca->cluster[s] * (1 + vectors) * n;
    memcpy(signal, table, n * sizeof *signal);
    for (size_t j = 0; j < vectors; j++)
        for (size_t i = 0; i < n; i++)
            signal[i] += weight[j] * table[(1 + j) * n + i];
}

static void compare_task(void *context, size_t task, int worker)
{
    (void)worker;
    struct work *w = context;
    size_t first = task * TASK_TILES * CPCA_TILE, vectors = (size_t)w->vectors;
    size_t last = first + TASK_TILES * CPCA_TILE;
    double sum[2] = {0};
    for (size_t s = first; s < last && s < w->count; s++) {
        float exact[MOST_NUMBERS], rounded[MOST_NUMBERS], weight[MOST_NUMBERS];
        const float *signal = w->signal + s * w->n;
        double square[2] = {0};
        for (size_t j = 0; j < vectors; j++)
            weight[j] = (float)dph_cpca_snorm8(w->result->weight[s * vectors + j]) / 127;
        decode(w->result, s, w->result->weight + s * vectors, exact);
        decode(w->result, s, weight, rounded);
        for (size_t i = 0; i < w->n; i++) {
            double d = ((double)exact[i] - (double)signal[i]) * w->scale;
            double r = ((double)rounded[i] - (double)signal[i]) * w->scale;
            square[0] += d * d;
            square[1] += r * r;
        }
        sum[0] += weight_of(w, s) * square[0];
        sum[1] += weight_of(w, s) * square[1];
    }
    w->partial[3 * task + 1] = sum[0];
    w->partial[3 * task + 2] = sum[1];
}

/* Numbers the clusters that have signals, in their order, and fills the result. */
static bool finish(struct work *w, struct dph_error *err)
{
    struct dph_cpca *result = w->result;
    int places = 0;
    for (int c = 0; c < w->clusters; c++) {
        for (uint32_t k = w->start[c]; k < w->start[c + 1]; k++)
            result->cluster[w->member[k]] = (uint16_t)places;
        places += w->start[c] < w->start[c + 1];
    }
    result->clusters = places;
    result->table = dph_alloc_zero((size_t)places * (1 + (size_t)w->vectors), w->n * sizeof *result->table);
    if (!result->table)
        return dph_fail_memory(err);
    dph_parallel(w->threads, (size_t)w->clusters, finish_task, w);
    dph_parallel(w->threads, w->ntask, compare_task, w);
    double sum[2] = {0};
    for (size_t i = 0; i < w->ntask; i++) {
        sum[0] += w->partial[3 * i + 1];
        sum[1] += w->partial[3 * i + 2];
    }
    result->error = w->norm > 0 ? sqrt(sum[0] / w->norm) : 0;
    result->error_snorm8 = w->norm > 0 ? sqrt(sum[1] / w->norm) : 0;
    return true;
}

static bool check(const float *signal, size_t count, int n, const float *importance,
                  const struct dph_cpca_params *params, struct dph_error *err)
{
    if (n < 1 || n > MOST_NUMBERS || count > INT32_MAX)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%zu signals of %d numbers: at most 2^31 - 1 of 1 to %d",
                        count, n, MOST_NUMBERS);
    if (params->clusters < 1 || params->clusters > DPH_CPCA_MAX_CLUSTERS || params->vectors < 1 ||
        params->iterations < 1 || params->iterations > DPH_CPCA_MAX_ITERATIONS)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "%d clusters of %d vectors in %d iterations: clusters are 1 to %d, vectors at least 1, "
                        "iterations 1 to %d", params->clusters, params->vectors, params->iterations,
                        DPH_CPCA_MAX_CLUSTERS, DPH_CPCA_MAX_ITERATIONS);
    for (size_t i = 0; i < count * (size_t)n; i++)
        if (!isfinite(signal[i]))
            return dph_fail(err, DPH_ERROR_INPUT, "number %zu of signal %zu is not finite", i % (size_t)n,
                            i / (size_t)n);
    for (size_t s = 0; importance && s < count; s++)
        if (!(importance[s] >= 0 && importance[s] < INFINITY))
            return dph_fail(err, DPH_ERROR_INPUT, "the importance of signal %zu is %g", s, (double)importance[s]);
    return true;
}

static bool allocate(struct work *w)
{
    size_t clusters = (size_t)w->clusters, vectors = (size_t)w->vectors, n = w->n;
    size_t padded = w->ntile * CPCA_TILE;
    w->room = 2 * n * n + 5 * n; /* covariance, vectors, values, and 4 n for either kernel */
    w->centre = dph_alloc_zero(n, sizeof *w->centre);
    w->tile = dph_alloc_aligned(padded, n * sizeof *w->tile);
    w->mean = dph_alloc_zero(clusters, n * sizeof *w->mean);
    w->vector = dph_alloc_zero(clusters * vectors, n * sizeof *w->vector);
    w->column = dph_alloc(clusters * (1 + vectors), n * sizeof *w->column);
    w->offset = dph_alloc(clusters, (1 + vectors) * sizeof *w->offset);
    w->cluster = dph_alloc_zero(padded, sizeof *w->cluster);
    w->error = dph_alloc(padded, sizeof *w->error);
    w->member = dph_alloc(w->count, sizeof *w->member);
    w->start = dph_alloc(clusters + 1, sizeof *w->start);
    w->partial = dph_alloc(w->ntask, 3 * sizeof *w->partial);
    w->scratch = dph_alloc((size_t)w->threads, w->room * sizeof *w->scratch);
    w->result->cluster = dph_alloc_zero(w->count, sizeof *w->result->cluster);
    w->result->weight = dph_alloc_zero(w->count, vectors * sizeof *w->result->weight);
    if (!w->tile)
        return false;
    memset(w->tile, 0, padded * n * sizeof *w->tile);
    return w->centre && w->mean && w->vector && w->column && w->offset && w->cluster && w->error &&
           w->member && w->start && w->partial && w->scratch && w->result->cluster && w->result->weight;
}

struct dph_cpca *dph_cpca_create(const float *signal, size_t count, int n, const float *importance,
                                 const struct dph_cpca_params *params, struct dph_error *err)
{
    if (!check(signal, count, n, importance, params, err))
        return NULL;
    bool ok = false;
    struct work w = {
        .params = params,
        .signal = signal,
        .importance = importance,
        .count = count,
        .n = (size_t)n,
        .ntile = (count + CPCA_TILE - 1) / CPCA_TILE,
        .threads = dph_thread_count(params->threads),
        .clusters = (size_t)params->clusters < count ? params->clusters : (int)count,
        .vectors = params->vectors < n ? params->vectors : n,
        .avx2 = !params->portable && dph_cpu_has_avx2(),
        .result = dph_alloc_zero(1, sizeof *w.result),
    };
    w.ntask = (w.ntile + TASK_TILES - 1) / TASK_TILES;
    if (!w.result) {
        dph_fail_memory(err);
        return NULL;
    }
    w.result->count = count;
    w.result->n = n;
    w.result->vectors = w.vectors;
    if (!allocate(&w)) {
        dph_fail_memory(err);
        goto error;
    }
    if (count) {
        fill_tiles(&w);
        ok = iterate(&w, err) && finish(&w, err);
    } else {
        ok = true;
    }

error:
    free(w.centre);
    free(w.tile);
    free(w.mean);
    free(w.vector);
    free(w.column);
    free(w.offset);
    free(w.cluster);
    free(w.error);
    free(w.member);
    free(w.start);
    free(w.partial);
    free(w.scratch);
    if (ok)
        return w.result;
    dph_cpca_destroy(w.result);
    return NULL;
}

void dph_cpca_destroy(struct dph_cpca *cpca)
{
    if (!cpca)
        return;
    free(cpca->cluster);
    free(cpca->weight);
    free(cpca->table);
    free(cpca);
}

void dph_cpca_row(const struct dph_cpca *cpca, size_t i, float *signal)
{
    decode(cpca, i, cpca->weight + i * (size_t)cpca->vectors, signal);
}
