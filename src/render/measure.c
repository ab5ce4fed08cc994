/* Milliseconds a frame, of several descriptions in turns.
 *
 * A machine's speed drifts: clocks rise and fall, neighbours come and go. What drifts slowly
 * slows all that is measured within a short time alike, so the descriptions take turns. A round
 * gives each of them a block of a few frames, in an order that shifts by one from round to
 * round, so that nobody always follows the same neighbour; a block's first frame, which finds
 * the caches full of the neighbour's data, does not count. What a block says is its shortest frame,
 * since whatever interrupts a frame only adds to it: on a busy machine ratios of halves of the
 * rounds differ by a quarter less than with medians of blocks. In every round this is divided by
 * that of the first description, the base line, and the median of these ratios over the rounds is
 * the ratio. Times themselves are quantiles over all frames. A description with long frames sits out
 * some rounds, spread evenly: its time is bounded, and the base line is always there.
 *
 * Work of others is not fair: through what the units of a core share it slows the vertices of a
 * software rasteriser, which one thread works at, more than pixels, which all threads do. So
 * rounds during which others took more than a little of a processor do not count towards a ratio,
 * if enough remain. A ratio's error is that of a median, 1.253 s / sqrt(n), with s half the width
 * of the middle 68 percent of its rounds. Where it is too large after all rounds, or too many of
 * them were disturbed, some more follow for these descriptions and the base line.
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
    ROUNDS_QUIET = 6, /* undisturbed ones that are enough for a ratio */
    MOST_ROUNDS = 1000
};
static const double WARM_SECONDS = .15;
static const double STRETCH = 1.8; /* times the seconds asked for: where rounds are left out */
static const double GOLDEN = 2.39996322972865332; /* pi (3 - sqrt(5)) */
static const double STEP = .01;                   /* radians a frame  */
static const double MORE = .1; /* of the rounds asked for may follow */
static const double UNCERTAIN = .02; /* a relative error of a ratio that asks for them */
static const double DISTURBED = .15; /* processors that others take: the clock has steps of .06 */

/* The frames of one description. */
struct series {
    size_t count, room;
    double *ms;
    size_t cpu_count, cpu_room;
    double *cpu;
    double *round; /* (rounds) shortest frame of a block; 0: sat out */
    int rounds;    /* that it takes part in, of those asked for      */
};

struct measurement {
    const struct dph_timing_job *job;
    struct dph_target target; /* one for all, so that no picture lies better in memory */
    GLuint query[QUERIES];
    bool gpu;
    struct series *series;
    double *others; /* (rounds) processors that others took  */
    double *ratio;  /* (rounds) room for those of a series   */
    int rounds;     /* made so far                           */
};

struct dph_timing_params dph_timing_defaults(void)
{
    return (struct dph_timing_params){.seconds = 1, .rounds = 20};
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

/* The ratio of a series and its error: of undisturbed rounds, or of all where these are few. */
static double ratio_of(const struct measurement *m, size_t j, double *error)
{
    const struct series *series = &m->series[j];
    size_t n = 0;
    for (int all = 0; all < 2 && n < ROUNDS_QUIET; all++) {
        n = 0;
        for (int r = 0; r < m->rounds; r++)
            if (series->round[r] > 0 && (all || m->others[r] <= DISTURBED))
                m->ratio[n++] = series->round[r] / m->series[0].round[r];
    }
    qsort(m->ratio, n, sizeof *m->ratio, compare);
    double middle = quantile(m->ratio, n, .5);
    double width = quantile(m->ratio, n, .84) - quantile(m->ratio, n, .16);
    *error = 1.2533 * width / 2 / sqrt((double)n);
    return middle;
}

/* Whether another round is made, and for whom. */
static bool wants_more(const struct measurement *m, size_t count, bool *more)
{
    bool any = false;
    for (size_t j = 1; j < count; j++) {
        double error;
        int quiet = 0;
        for (int r = 0; r < m->rounds; r++)
            quiet += m->series[j].round[r] > 0 && m->others[r] <= DISTURBED;
        const double ratio = ratio_of(m, j, &error);
        more[j] = error > UNCERTAIN * ratio || quiet < ROUNDS_QUIET;
        any = any || more[j];
    }
    more[0] = any;
    return any;
}

static void summarise(const struct measurement *m, size_t j, struct dph_timing *timing)
{
    struct series *series = &m->series[j];
    double error, ratio = ratio_of(m, j, &error), others = 0;
    for (int r = 0; r < m->rounds; r++)
        others += m->others[r] / m->rounds;
    qsort(series->ms, series->count, sizeof *series->ms, compare);
    qsort(series->cpu, series->cpu_count, sizeof *series->cpu, compare);
    *timing = (struct dph_timing){.frames = series->count,
                                  .ms_median = quantile(series->ms, series->count, .5),
                                  .ms_p05 = quantile(series->ms, series->count, .05),
                                  .ms_p95 = quantile(series->ms, series->count, .95),
                                  .cpu_ms = quantile(series->cpu, series->cpu_count, .5),
                                  .ratio = j ? ratio : 1,
                                  .ratio_error = j ? error : 0,
                                  .others = others,
                                  .gpu = m->gpu};
}

/* Round number m->rounds, for those with `more`, or, NULL, for those whose turn it is. */
static bool run_round(struct measurement *m, size_t count, const struct dph_timing_params *params,
                      const bool *more, struct dph_error *err)
{
    const size_t round = (size_t)m->rounds, rounds = (size_t)params->rounds;
    const size_t last = rounds + (size_t)(MORE * params->rounds);
    const double start = dph_seconds(), others = dph_seconds_others();
    for (size_t i = 0; i < count; i++) {
        const size_t j = (round + i) % count, part = (size_t)m->series[j].rounds;
        const bool turn =
            more ? more[j] : (round + 1) * part / rounds > round * part / rounds;
        if (turn && !run_block(m, j, (int)round, params->seconds / (double)part, err))
            return false;
        if (params->progress &&
            !params->progress(params->progress_user, (double)(round * count + i + 1) /
                                                         (double)(last * count)))
            return dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
    }
    m->others[round] = fmax(dph_seconds_others() - others, 0) / (dph_seconds() - start);
    m->rounds++;
    return true;
}

bool dph_renderer_measure(const struct dph_timing_job *job, size_t count,
                          const struct dph_timing_params *params, struct dph_timing *timing,
                          struct dph_error *err)
{
    struct measurement m = {.job = job};
    bool *more = NULL, ok = false;
    if (!count || !(params->seconds > 0 && params->seconds <= 3600) || params->rounds < 1 ||
        params->rounds > MOST_ROUNDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%zu measurements of %g s in %d rounds", count,
                        params->seconds, params->rounds);
    const int last = params->rounds + (int)(MORE * params->rounds);
    m.gpu = dph_gl_timers();
    if (m.gpu)
        glGenQueries(QUERIES, m.query);
    m.series = dph_alloc_zero(count, sizeof *m.series);
    m.others = dph_alloc_zero((size_t)last, sizeof *m.others);
    m.ratio = dph_alloc((size_t)last, sizeof *m.ratio);
    more = dph_alloc_zero(count, sizeof *more);
    for (size_t j = 0; m.series && j < count; j++)
        m.series[j].round = dph_alloc_zero((size_t)last, sizeof *m.series[j].round);
    for (size_t j = 0; j < count; j++)
        if (!m.ratio || !m.others || !more || !m.series || !m.series[j].round) {
            dph_fail_memory(err);
            goto error;
        }
    for (size_t j = 0; j < count; j++)
        if (!warm_up(&m, j, params, err))
            goto error;
    while (m.rounds < params->rounds)
        if (!run_round(&m, count, params, NULL, err))
            goto error;
    while (m.rounds < last && wants_more(&m, count, more))
        if (!run_round(&m, count, params, more, err))
            goto error;
    if (m.rounds < last && params->progress && !params->progress(params->progress_user, 1)) {
        dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
        goto error;
    }
    for (size_t j = count; j-- > 0;)
        summarise(&m, j, &timing[j]);
    ok = true;

error:
    for (size_t j = 0; m.series && j < count; j++) {
        free(m.series[j].ms);
        free(m.series[j].cpu);
        free(m.series[j].round);
    }
    free(m.series);
    free(m.others);
    free(m.ratio);
    free(more);
    dph_target_finish(&m.target);
    if (m.gpu)
        glDeleteQueries(QUERIES, m.query);
    return ok;
}
