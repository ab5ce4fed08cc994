/* Milliseconds a frame, of several descriptions in turns.
 *
 * A machine's speed drifts: clocks rise and fall, neighbours come and go, within seconds and within
 * tenths of them. Nothing but frames themselves tells by how much: loops of arithmetic or through
 * memory, timed before and after a frame, explain little of its length, and what they leave is more
 * than what frames say of their neighbours. What drifts slows all that is measured within a short
 * time alike, so the descriptions take turns that are as short as can be. A round gives each of
 * them one, in an order that is shuffled anew every time, so that nobody always follows the same
 * neighbour, and the base line, the first description, several, since every ratio has its error,
 * too. The drift is estimated from all turns, and ratios are those of what remains (drift.c). Times
 * themselves are quantiles over all frames. A description with long frames sits out some rounds,
 * spread evenly: its time is bounded, and the base line is always there.
 *
 * Work of others is not fair: through what the units of a core share it slows the vertices of a
 * software rasteriser, which one thread works at, more than pixels, which all threads do. So turns
 * during which others took more than a little of a processor do not count towards ratios, if enough
 * remain. After all rounds there is some time left for those descriptions whose ratios are the
 * least certain, and the base line: long frames have few turns.
 *
 * Lights turn about the vertical before every frame, so that what the CPU computes once a light is
 * part of the frame, and depth maps are drawn anew: a little from frame to frame of a turn, by the
 * golden angle from round to round. So the turns of a round show every description under the same
 * light, and the rounds, however many there are, spread over the circle evenly.
 *
 * With a driver whose timers count, each frame is enclosed by a query of GL_TIME_ELAPSED, some
 * frames are under way at once, and the time is that of the GPU. A turn is a block of frames there:
 * its first frame, which finds the caches full of the neighbour's data, does not count, and what it
 * says is its shortest frame, since whatever interrupts a frame only adds to it. Software
 * rasterisers have the query, too, but it does not contain the work of their threads: there,
 * glFinish follows every frame and a clock runs from its first call to the end of glFinish. A turn
 * is one frame, and there are as many rounds as it takes: a frame after somebody else's is not
 * found to be longer there than one after its like, and turns of one frame halve what the drift
 * leaves of errors, and more. In both cases the CPU's time is that until all calls of a frame are
 * made; a software rasteriser has shaded the vertices by then. */
#include "render/draw.h"
#include "render/drift.h"

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
    BLOCK_LEAST = 2, /* frames that count in a turn on a GPU          */
    ROUNDS_LEAST = 12,
    ROUNDS_FINEST = 2000, /* shorter turns than these make do not help */
    MOST_ROUNDS = 1000,   /* that may be asked for                     */
    BASE_TURNS = 2,       /* of the base line in a round               */
    LONGEST = 2,          /* times the rounds: for what has not had its seconds */
    LOOKS = 20            /* at what is uncertain, in the time for that */
};
static const double WARM_SECONDS = .06;
static const double STRETCH = 1.8; /* times the seconds asked for: where rounds are left out */
static const double GOLDEN = 2.39996322972865332; /* pi (3 - sqrt(5)) */
static const double STEP = .01;                   /* radians a frame  */
static const double MORE = .3; /* of the time of the rounds may follow for what is uncertain: ... */
static const double UNCERTAIN = .012; /* ... for ratios whose relative error is above this ... */
static const double AMONG_WORST = .7; /* ... and at least so many times the largest */
static const double DISTURBED = .15;  /* processors that others take ...                */
static const double OVER = 1; /* ... on the mean over so many seconds: the clock has steps of .01 */
static const double ENOUGH = .3; /* part of the turns that makes the others unnecessary */

/* The frames of one description. */
struct series {
    size_t count, room;
    double *ms;
    size_t cpu_count, cpu_room;
    double *cpu;
    double total; /* milliseconds                         */
    int rounds;   /* that it takes part in, of m->planned */
};

struct measurement {
    const struct dph_timing_job *job;
    size_t jobs;
    const struct dph_timing_params *params;
    struct dph_target target; /* one for all, so that no picture lies better in memory */
    GLuint query[QUERIES];
    bool gpu;
    struct series *series;
    struct dph_turn *turn; /* in the order in which they were taken */
    size_t turns, turn_room;
    bool *disturbed; /* (turns) others took too much            */
    size_t known, known_room; /* turns of which that is known             */
    struct dph_turn *kept;    /* those that count                         */
    size_t *order; /* (jobs + BASE_TURNS) room: who has a turn in a round */
    uint32_t random;
    double *ratio, *error; /* (jobs)                                         */
    int planned, rounds;   /* rounds that were asked for, and made so far    */
    double began, planned_seconds; /* clock at the first round; what planned rounds took, or 0 */
    double told;                    /* progress, 0 to 1 */
    double start, others;  /* clocks when the first turn of unknown ones began */
    double seconds, others_seconds; /* sums over all that is known            */
};

struct dph_timing_params dph_timing_defaults(void)
{
    return (struct dph_timing_params){.seconds = 1, .rounds = 30};
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
static bool warm_up(struct measurement *m, size_t j, struct dph_error *err)
{
    const struct dph_timing_params *params = m->params;
    double seconds[WARM_MOST];
    const double start = dph_seconds();
    int count = 0;
    while (count < WARM_LEAST || (count < WARM_MOST && dph_seconds() - start < WARM_SECONDS)) {
        double before = dph_seconds();
        if (!submit(m, j, STEP * count, err))
            return false;
        glFinish();
        seconds[count++] = dph_seconds() - before;
    }
    dph_sort(seconds, (size_t)count);
    const double usual = fmax(dph_quantile(seconds, (size_t)count, .5), 1e-9);
    double wanted = params->rounds;
    if (!m->gpu)
        wanted = fmax(wanted, fmin(params->seconds / usual, ROUNDS_FINEST));
    else if (j) /* the base line is in all of them */
        wanted = fmin(wanted, fmax(STRETCH * params->seconds / ((1 + BLOCK_LEAST) * usual),
                                   ROUNDS_LEAST));
    m->series[j].rounds = (int)ceil(wanted);
    if (m->planned < m->series[j].rounds)
        m->planned = m->series[j].rounds;
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

/* A turn of description j. */
static bool run_turn(struct measurement *m, size_t j, struct dph_error *err)
{
    struct series *series = &m->series[j];
    const size_t first = series->count, frames = m->gpu ? BLOCK_LEAST : 1;
    const double seconds =
        m->params->seconds / (m->gpu ? (double)series->rounds : (double)ROUNDS_FINEST);
    const double angle = GOLDEN * m->rounds;
    size_t done = 0, collected = 0;
    if (m->gpu) {
        if (!submit(m, j, angle, err))
            return false;
        glFinish();
    }
    for (double start = dph_seconds(), now = start;
         done < frames || now - start < seconds; done++) {
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
    for (size_t i = first; i < series->count; i++) {
        least = fmin(least, series->ms[i]);
        series->total += series->ms[i];
    }
    struct dph_turn *turn = dph_grow(m->turn, m->turns, &m->turn_room, sizeof *turn);
    if (!turn)
        return dph_fail_memory(err);
    m->turn = turn;
    turn[m->turns++] = (struct dph_turn){j, fmax(least, 1e-9)}; /* a timer may say 0 */
    return dph_gl_check("measurement", err);
}

/* Whether others disturbed the turns since this was known last, if that is long enough ago or
 * `now`. */
static bool watch_others(struct measurement *m, bool now, struct dph_error *err)
{
    const double seconds = dph_seconds() - m->start;
    if (!now && seconds < OVER)
        return true;
    const double others = fmax(dph_seconds_others() - m->others, 0);
    while (m->known < m->turns) {
        bool *grown = dph_grow(m->disturbed, m->known, &m->known_room, sizeof *grown);
        if (!grown)
            return dph_fail_memory(err);
        m->disturbed = grown;
        grown[m->known++] = others > DISTURBED * fmax(seconds, OVER);
    }
    m->seconds += seconds;
    m->others_seconds += others;
    m->start += seconds;
    m->others += others;
    return true;
}

/* All ratios: of undisturbed turns, or of all where these are few of a description's. */
static bool find_ratios(struct measurement *m, struct dph_error *err)
{
    size_t n = 0;
    bool quiet = true;
    for (size_t j = 0; j < m->jobs; j++) {
        size_t all = 0, kept = 0;
        for (size_t i = 0; i < m->turns; i++)
            if (m->turn[i].series == j) {
                all++;
                kept += !m->disturbed[i];
            }
        quiet = quiet && (double)kept >= ENOUGH * (double)all;
    }
    free(m->kept);
    m->kept = dph_alloc(m->turns, sizeof *m->kept);
    if (!m->kept)
        return dph_fail_memory(err);
    for (size_t i = 0; i < m->turns; i++)
        if (!quiet || !m->disturbed[i])
            m->kept[n++] = m->turn[i];
    return dph_drift_ratios(m->kept, n, m->jobs, m->ratio, m->error, err);
}

static void summarise(const struct measurement *m, size_t j, struct dph_timing *timing)
{
    struct series *series = &m->series[j];
    dph_sort(series->ms, series->count);
    dph_sort(series->cpu, series->cpu_count);
    *timing = (struct dph_timing){.frames = series->count,
                                  .ms_median = dph_quantile(series->ms, series->count, .5),
                                  .ms_p05 = dph_quantile(series->ms, series->count, .05),
                                  .ms_p95 = dph_quantile(series->ms, series->count, .95),
                                  .cpu_ms = dph_quantile(series->cpu, series->cpu_count, .5),
                                  .ratio = m->ratio[j],
                                  .ratio_error = m->error[j],
                                  .others = m->others_seconds / m->seconds,
                                  .gpu = m->gpu};
}

static bool tell_progress(struct measurement *m, double fraction, struct dph_error *err)
{
    m->told = fmin(fmax(fraction, m->told), 1);
    return !m->params->progress || m->params->progress(m->params->progress_user, m->told) ||
           dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
}

/* A round for those whose turn it is by m->rounds, or, if not NULL, for those that are `chosen`,
 * with the base line. */
static bool run_round(struct measurement *m, const bool *chosen, struct dph_error *err)
{
    const int64_t round = m->rounds, planned = m->planned;
    size_t count = 0;
    for (size_t j = 0; j < m->jobs; j++) {
        const int64_t part = m->series[j].rounds;
        if (chosen ? chosen[j] : (round + 1) * part / planned > round * part / planned)
            m->order[count++] = j;
    }
    const size_t base = !count ? 0 : m->jobs > 1 ? BASE_TURNS : 1;
    for (size_t have = count && !m->order[0]; have < base; have++)
        m->order[count++] = 0;
    for (size_t i = count; i > 1; i--) { /* shuffled, as R. A. Fisher and F. Yates do it */
        m->random = m->random * 1664525U + 1013904223U;
        size_t k = (m->random >> 8) % i, moved = m->order[i - 1];
        m->order[i - 1] = m->order[k];
        m->order[k] = moved;
    }
    for (size_t i = 0; i < count; i++) {
        if (!run_turn(m, m->order[i], err))
            return false;
        double done = m->planned_seconds > 0
                          ? (dph_seconds() - m->began) / m->planned_seconds
                          : ((double)round + (double)(i + 1) / (double)count) / m->planned;
        if (!tell_progress(m, done / (1 + MORE), err))
            return false;
    }
    m->rounds++;
    return watch_others(m, false, err);
}

/* Chooses those that have not had their seconds, and if there is still time for them those whose
 * ratios are the least certain. False: there are none. */
static bool choose(const struct measurement *m, bool in_time, bool *chosen)
{
    double worst = 0;
    bool any = false;
    for (size_t j = 1; j < m->jobs; j++)
        worst = fmax(worst, m->error[j] / m->ratio[j]);
    for (size_t j = 0; j < m->jobs; j++) {
        chosen[j] = !m->gpu && m->series[j].total < 1e3 * m->params->seconds;
        if (j && in_time)
            chosen[j] |= m->error[j] > fmax(AMONG_WORST * worst, UNCERTAIN) * m->ratio[j];
        any = any || chosen[j];
    }
    return any;
}

/* As many rounds as were planned, and more where ratios are uncertain, or where frames turn out to
 * be shorter than they seemed. */
static bool run_rounds(struct measurement *m, bool *chosen, struct dph_error *err)
{
    m->start = m->began = dph_seconds();
    m->others = dph_seconds_others();
    while (m->rounds < m->planned)
        if (!run_round(m, NULL, err))
            return false;
    m->planned_seconds = dph_seconds() - m->began;
    for (;;) {
        if (!watch_others(m, true, err) || !find_ratios(m, err))
            return false;
        const double look = dph_seconds(), time = MORE * m->planned_seconds,
                     used = look - m->began - m->planned_seconds;
        if (m->rounds >= LONGEST * m->planned || !choose(m, used < time, chosen))
            break;
        do {
            if (!run_round(m, chosen, err))
                return false;
        } while (dph_seconds() - look < time / LOOKS);
    }
    return tell_progress(m, 1, err);
}

bool dph_renderer_measure(const struct dph_timing_job *job, size_t count,
                          const struct dph_timing_params *params, struct dph_timing *timing,
                          struct dph_error *err)
{
    struct measurement m = {.job = job, .jobs = count, .params = params, .random = 1};
    bool *chosen = NULL, ok = false;
    if (!count || !(params->seconds > 0 && params->seconds <= 3600) || params->rounds < 1 ||
        params->rounds > MOST_ROUNDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%zu measurements of %g s in %d rounds", count,
                        params->seconds, params->rounds);
    m.gpu = dph_gl_timers();
    if (m.gpu)
        glGenQueries(QUERIES, m.query);
    m.series = dph_alloc_zero(count, sizeof *m.series);
    m.order = dph_alloc(count + BASE_TURNS, sizeof *m.order);
    m.ratio = dph_alloc(count, sizeof *m.ratio);
    m.error = dph_alloc(count, sizeof *m.error);
    chosen = dph_alloc_zero(count, sizeof *chosen);
    if (!m.series || !m.order || !m.ratio || !m.error || !chosen) {
        dph_fail_memory(err);
        goto error;
    }
    for (size_t j = 0; j < count; j++)
        if (!warm_up(&m, j, err))
            goto error;
    if (!run_rounds(&m, chosen, err))
        goto error;
    for (size_t j = count; j-- > 0;)
        summarise(&m, j, &timing[j]);
    ok = true;

error:
    for (size_t j = 0; m.series && j < count; j++) {
        free(m.series[j].ms);
        free(m.series[j].cpu);
    }
    free(m.series);
    free(m.turn);
    free(m.disturbed);
    free(m.kept);
    free(m.order);
    free(m.ratio);
    free(m.error);
    free(chosen);
    dph_target_finish(&m.target);
    if (m.gpu)
        glDeleteQueries(QUERIES, m.query);
    return ok;
}
