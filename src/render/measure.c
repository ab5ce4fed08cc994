/* Milliseconds a frame, of several descriptions in turns.
 *
 * A machine's speed drifts: clocks rise and fall, neighbours come and go. What drifts slowly
 * slows all that is measured within a short time alike, so the descriptions take turns. A round
 * gives each of them a block of a few frames, in an order that shifts by one from round to
 * round, so that nobody always follows the same neighbour; a block's first frame, which finds
 * the caches full of the neighbour's data, does not count. What a block says is its shortest
 * frame, since whatever interrupts a frame only adds to it. In every round this is divided by
 * that of the first description, the base line, and the median of these ratios over the rounds
 * is the ratio. Times themselves are quantiles over all frames. A description with long frames
 * sits out some rounds, spread evenly: its time is bounded, and the base line is always there.
 *
 * Lights turn about the vertical before every frame, so that what the CPU computes once a light
 * is part of the frame, and depth maps are drawn anew: a little from frame to frame, by the
 * golden angle from round to round. So the frames of a round show every description under the
 * same light, and the rounds, however many there are, spread over the circle evenly.
 *
 * With a driver whose timers count, each frame is enclosed by a query of GL_TIME_ELAPSED, some
 * frames are under way at once, and the time is that of the GPU. Software rasterisers have the
 * query, too, but it does not contain the work of their threads: there, glFinish follows every
 * frame and a clock runs from its first call to the end of glFinish. In both cases the CPU's
 * time is that until all calls of a frame are made; a software rasteriser has shaded the
 * vertices by then. */
#include "render/draw.h"

#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    QUERIES = 4,
    WARM_LEAST = 3,
    WARM_MOST = 50,
    BLOCK_LEAST = 2, /* frames that count */
    ROUNDS_LEAST = 12,
    MOST_ROUNDS = 1000
};
static const double WARM_SECONDS = .15;
static const double STRETCH = 1.8; /* times the seconds asked for: where rounds are left out */
static const double GOLDEN = 2.39996322972865332; /* pi (3 - sqrt(5)) */
static const double STEP = .01;                   /* radians a frame  */

/* The frames of one description. */
struct series {
    size_t count, room;
    double *ms;
    size_t cpu_count, cpu_room;
    double *cpu;
    double *round; /* (rounds) shortest frame of a block; 0: sat out */
    int rounds;    /* that it takes part in */
};

struct measurement {
    const struct dph_timing_job *job;
    struct dph_target target; /* one for all, so that no picture lies better in memory */
    GLuint query[QUERIES];
    bool gpu;
    struct series *series;
};

struct dph_timing_params dph_timing_defaults(void)
{
    return (struct dph_timing_params){.seconds = 1, .rounds = 24};
}

bool dph_gl_timers(void)
{
    static const char *const software[] = {"llvmpipe", "softpipe", "swrast", "SwiftShader",
                                           "Software Rasterizer", "Microsoft Basic Render"};
    const char *renderer = (const char *)glGetString(GL_RENDERER);
    GLint bits = 0;
    for (size_t i = 0; i < sizeof software / sizeof *software; i++)
        if (!renderer || strstr(renderer, software[i]))
            return false;
    glGetQueryiv(GL_TIME_ELAPSED, GL_QUERY_COUNTER_BITS, &bits);
    return bits > 0;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The quantile q of sorted values, between neighbours where it falls between them. */
static double quantile(const double *sorted, size_t count, double q)
{
    double at = q * (double)(count - 1);
    size_t i = (size_t)at;
    return i + 1 < count ? sorted[i] + (at - (double)i) * (sorted[i + 1] - sorted[i]) : sorted[i];
}

static bool push(double **list, size_t *count, size_t *room, double value, struct dph_error *err)
{
    double *grown = dph_grow(*list, *count, room, sizeof *grown);
    if (!grown)
        return dph_fail_memory(err);
    *list = grown;
    grown[(*count)++] = value;
    return true;
}

/* All lights of a frame about the vertical through the scene's centre. */
static void turn_lights(struct dph_frame *frame, const struct dph_renderer *renderer, double angle)
{
    double c = cos(angle), s = sin(angle);
    for (int i = 0; i < frame->nlight; i++) {
        struct dph_light *light = &frame->light[i];
        double x = light->to_light[0], z = light->to_light[2];
        light->to_light[0] = c * x + s * z;
        light->to_light[2] = c * z - s * x;
        x = light->position[0] - renderer->centre[0];
        z = light->position[2] - renderer->centre[2];
        light->position[0] = renderer->centre[0] + c * x + s * z;
        light->position[2] = renderer->centre[2] + c * z - s * x;
    }
}

/* Makes all calls of a frame whose lights are turned by an angle. */
static bool submit(struct measurement *m, size_t j, double angle, struct dph_error *err)
{
    struct dph_frame frame = m->job[j].frame;
    struct dph_draw draw;
    turn_lights(&frame, m->job[j].renderer, angle);
    return dph_draw_begin(&draw, m->job[j].renderer, &frame, err) &&
           dph_draw_frame(&draw, &m->target, NULL, err);
}

/* Frames that do not count, and by their length the number of rounds. */
static bool warm_up(struct measurement *m, size_t j, const struct dph_timing_params *params,
                    struct dph_error *err)
{
    double start = dph_seconds(), least = INFINITY;
    for (int i = 0; i < WARM_LEAST || (i < WARM_MOST && dph_seconds() - start < WARM_SECONDS);
         i++) {
        double before = dph_seconds();
        if (!submit(m, j, STEP * i, err))
            return false;
        glFinish();
        least = fmin(least, dph_seconds() - before);
    }
    double wanted = STRETCH * params->seconds / ((1 + BLOCK_LEAST) * fmax(least, 1e-9));
    if (j && wanted < params->rounds) /* the base line is in all of them */
        m->series[j].rounds =
            wanted > ROUNDS_LEAST ? (int)wanted
                                  : params->rounds < ROUNDS_LEAST ? params->rounds : ROUNDS_LEAST;
    else
        m->series[j].rounds = params->rounds;
    return true;
}

/* The time of the frame that holds a query, once it is there. */
static bool collect(struct measurement *m, struct series *series, size_t frame,
                    struct dph_error *err)
{
    GLuint64 elapsed = 0;
    glGetQueryObjectui64v(m->query[frame % QUERIES], GL_QUERY_RESULT, &elapsed);
    return push(&series->ms, &series->count, &series->room, 1e-6 * (double)elapsed, err);
}

/* A block of at least `seconds`. */
static bool run_block(struct measurement *m, size_t j, int round, double seconds,
                      struct dph_error *err)
{
    struct series *series = &m->series[j];
    const size_t first = series->count;
    const double angle = GOLDEN * round;
    size_t done = 0, collected = 0;
    if (!submit(m, j, angle, err))
        return false;
    glFinish();
    for (double start = dph_seconds(), now = start;
         done < BLOCK_LEAST || now - start < seconds; done++) {
        double before = dph_seconds();
        if (m->gpu)
            glBeginQuery(GL_TIME_ELAPSED, m->query[done % QUERIES]);
        bool ok = submit(m, j, angle + STEP * (double)(1 + done), err);
        if (m->gpu)
            glEndQuery(GL_TIME_ELAPSED);
        double submitted = dph_seconds();
        ok = ok && push(&series->cpu, &series->cpu_count, &series->cpu_room,
                        1e3 * (submitted - before), err);
        if (ok && m->gpu && done + 1 >= QUERIES)
            ok = collect(m, series, collected++, err);
        if (!m->gpu)
            glFinish();
        now = dph_seconds();
        if (ok && !m->gpu)
            ok = push(&series->ms, &series->count, &series->room, 1e3 * (now - before), err);
        if (!ok)
            return false;
    }
    while (m->gpu && collected < done)
        if (!collect(m, series, collected++, err))
            return false;
    double least = INFINITY;
    for (size_t i = first; i < series->count; i++)
        least = fmin(least, series->ms[i]);
    series->round[round] = fmax(least, 1e-9); /* a timer may say 0 */
    return dph_gl_check("measurement", err);
}

static void summarise(const struct measurement *m, size_t j, int rounds, double *ratio,
                      struct dph_timing *timing)
{
    struct series *series = &m->series[j];
    size_t part = 0;
    for (int r = 0; r < rounds; r++)
        if (series->round[r] > 0)
            ratio[part++] = series->round[r] / m->series[0].round[r];
    qsort(ratio, part, sizeof *ratio, compare);
    qsort(series->ms, series->count, sizeof *series->ms, compare);
    qsort(series->cpu, series->cpu_count, sizeof *series->cpu, compare);
    *timing = (struct dph_timing){.frames = series->count,
                                  .ms_median = quantile(series->ms, series->count, .5),
                                  .ms_p05 = quantile(series->ms, series->count, .05),
                                  .ms_p95 = quantile(series->ms, series->count, .95),
                                  .cpu_ms = quantile(series->cpu, series->cpu_count, .5),
                                  .ratio = j ? quantile(ratio, part, .5) : 1,
                                  .gpu = m->gpu};
}

bool dph_renderer_measure(const struct dph_timing_job *job, size_t count,
                          const struct dph_timing_params *params, struct dph_timing *timing,
                          struct dph_error *err)
{
    struct measurement m = {.job = job};
    double *ratio = NULL;
    bool ok = false;
    if (!count || !(params->seconds > 0 && params->seconds <= 3600) || params->rounds < 1 ||
        params->rounds > MOST_ROUNDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%zu measurements of %g s in %d rounds", count,
                        params->seconds, params->rounds);
    const size_t rounds = (size_t)params->rounds;
    m.gpu = dph_gl_timers();
    if (m.gpu)
        glGenQueries(QUERIES, m.query);
    m.series = dph_alloc_zero(count, sizeof *m.series);
    ratio = dph_alloc(rounds, sizeof *ratio);
    for (size_t j = 0; m.series && j < count; j++)
        m.series[j].round = dph_alloc_zero(rounds, sizeof *m.series[j].round);
    for (size_t j = 0; j < count; j++)
        if (!ratio || !m.series || !m.series[j].round) {
            dph_fail_memory(err);
            goto error;
        }
    for (size_t j = 0; j < count; j++)
        if (!warm_up(&m, j, params, err))
            goto error;
    for (size_t round = 0, step = 0; round < rounds; round++)
        for (size_t i = 0; i < count; i++) {
            const size_t j = (round + i) % count, part = (size_t)m.series[j].rounds;
            if ((round + 1) * part / rounds > round * part / rounds &&
                !run_block(&m, j, (int)round, params->seconds / (double)part, err))
                goto error;
            if (params->progress && !params->progress(params->progress_user,
                                                      (double)++step / (double)(rounds * count))) {
                dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
                goto error;
            }
        }
    for (size_t j = count; j-- > 0;) /* the base line last: its blocks are still needed */
        summarise(&m, j, params->rounds, ratio, &timing[j]);
    ok = true;

error:
    for (size_t j = 0; m.series && j < count; j++) {
        free(m.series[j].ms);
        free(m.series[j].cpu);
        free(m.series[j].round);
    }
    free(m.series);
    free(ratio);
    dph_target_finish(&m.target);
    if (m.gpu)
        glDeleteQueries(QUERIES, m.query);
    return ok;
}
