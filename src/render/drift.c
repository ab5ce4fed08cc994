/* Ratios of times that were taken in turns on a machine whose speed drifts.
 *
 * A processor that is shared with strangers changes its speed by a third within a few frames, and
 * no counter says so. What is sought is a_j in
 *
 *     log t_i = a_j(i) + d_i + noise,
 *
 * the i-th time in order, taken of series j(i), with d the drift, which is about the same for times
 * that are neighbours, whatever series they are of. It is found as by J. W. Tukey's median polish
 * ("Exploratory Data Analysis", 1977, chapter 11), by turns:
 *
 *     d_i = median over k near i, but not i, of  log t_k - a_j(k)
 *     a_j = middle over i of series j of         log t_i - d_i
 *
 * Medians, because a frame that is interrupted is much longer and there is no such thing as a frame
 * much shorter. For the a_j the median is replaced by the mean of what is left without the TRIM of
 * the largest and as many of the smallest, which is as safe and steadier: times of frames that
 * stream through memory, or that several threads work at, come in two heaps, and a median jumps from
 * one to the other. A time's own residual is left out of its drift, or it would be explained by itself.
 * Neighbours are NEAR times on either side: fewer are noisy themselves, more reach past the drift.
 * The ratio is exp(a_j - a_0). A constant that moves from all a_j to d leaves it alone.
 *
 * A start with a_j = median of log t_i is off by drift that happened to meet one series more than
 * another. A step leaves of that about the share of a series among the neighbours of its own times,
 * half with two series, so a dozen steps are plenty.
 *
 * Not everything slows alike. A frame that waits for memory, or for other threads, feels a busy
 * neighbour less than one that computes, so that its ratio is smaller in slow times, and two runs
 * that met other neighbours disagree. What is left of log t_i, r_i = log t_i - d_i - a_j, then has
 * a slope on d_i, found by least squares with P. J. Huber's weights ("Robust Statistics", 1981),
 * and a ratio is told for a machine whose neighbours leave it in peace, at a low quantile D of the
 * drift:
 *
 *     log ratio_j = a_j - a_0 + g (b_j - b_0) (D - median d_i of series j).
 *
 * Most series have the base line's slope, and a slope that is only noise must not move them: g
 * shrinks the difference by its own uncertainty, g = max(0, 1 - (2 error / (b_j - b_0))^2), L.
 * Breiman's nonnegative garrote ("Better subset regression", 1995).
 *
 * The error of a_j is that of a trimmed mean of n values, w / (1 - 2 TRIM) / sqrt(n), with w the
 * standard deviation after every value that is left out has been put to the nearest that is not
 * (J. W. Tukey and D. H. McLaughlin, "Less vulnerable confidence and significance procedures for
 * location", 1963); those of a_j, a_0 and the slope's part are added as independent. */
#include "render/drift.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>

enum { NEAR = 4, STEPS = 12, SLOPE_STEPS = 10 };
static const double TRIM = .2;   /* of a series' times, on either side                   */
static const double PEACE = .1; /* the quantile of the drift at which ratios are told */
static const double HUBER = 1.3; /* times s: a residual from which on weights fall       */
static const double DOUBT = 2;   /* times its error: a slope that does not count at all  */

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void dph_sort(double *value, size_t count)
{
    qsort(value, count, sizeof *value, compare);
}

double dph_quantile(const double *sorted, size_t count, double q)
{
    double at = q * (double)(count - 1);
    size_t i = (size_t)at;
    return i + 1 < count ? sorted[i] + (at - (double)i) * (sorted[i + 1] - sorted[i]) : sorted[i];
}

/* Median of a few values, which are put in order. */
static double middle_of(double *value, size_t count)
{
    for (size_t i = 1; i < count; i++) {
        double moved = value[i];
        size_t k = i;
        for (; k > 0 && value[k - 1] > moved; k--)
            value[k] = value[k - 1];
        value[k] = moved;
    }
    return dph_quantile(value, count, .5);
}

struct polish {
    const struct dph_turn *turn;
    size_t count, nseries;
    double *log_ms, *drift; /* (count)                                      */
    double *value, *error;  /* (nseries) a_j and its error                  */
    size_t *number;         /* (nseries) turns                              */
    size_t *first;          /* (nseries) where a series begins in `sorted`  */
    double *sorted;         /* (count) room: values, series by series       */
    struct slope *slope;    /* (nseries)                                    */
};

/* Of what is left of a series on the drift. */
struct slope {
    double s, b, error; /* half the width of what is left, the slope, its error */
    double middle;      /* median drift of the series' turns                    */
};

/* Fills `sorted` with log t - d, or d itself, every series in order. */
static void sort_series(struct polish *p, bool drift)
{
    size_t start = 0;
    for (size_t j = 0; j < p->nseries; j++) {
        p->first[j] = start;
        start += p->number[j];
        p->number[j] = 0;
    }
    for (size_t i = 0; i < p->count; i++) {
        size_t j = p->turn[i].series;
        p->sorted[p->first[j] + p->number[j]++] = drift ? p->drift[i] : p->log_ms[i] - p->drift[i];
    }
    for (size_t j = 0; j < p->nseries; j++)
        dph_sort(p->sorted + p->first[j], p->number[j]);
}

/* Mean of sorted values without the outer ones, and its error. */
static double trimmed_mean(const double *sorted, size_t count, double *error)
{
    const size_t cut = (size_t)(TRIM * (double)count), kept = count - 2 * cut;
    double sum = 0, square = 0;
    for (size_t i = cut; i < count - cut; i++)
        sum += sorted[i];
    const double mean = sum / (double)kept;
    for (size_t i = 0; i < count; i++) {
        const size_t at = i < cut ? cut : i < count - cut ? i : count - cut - 1;
        square += (sorted[at] - mean) * (sorted[at] - mean);
    }
    *error = sqrt(square) / (double)kept;
    return mean;
}

static void find_values(struct polish *p)
{
    sort_series(p, false);
    for (size_t j = 0; j < p->nseries; j++)
        if (p->number[j])
            p->value[j] = trimmed_mean(p->sorted + p->first[j], p->number[j], &p->error[j]);
}

static void find_drift(struct polish *p)
{
    for (size_t i = 0; i < p->count; i++) {
        double near[2 * NEAR];
        size_t n = 0;
        for (size_t k = i > NEAR ? i - NEAR : 0; k < p->count && k <= i + NEAR; k++)
            if (k != i)
                near[n++] = p->log_ms[k] - p->value[p->turn[k].series];
        p->drift[i] = n ? middle_of(near, n) : 0;
    }
}

static void find_slope(const struct polish *p, size_t j, struct slope *slope)
{
    double centre = 0, level = 0, sum = 0;
    for (int step = 0; step < SLOPE_STEPS; step++) {
        double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
        for (size_t i = 0; i < p->count; i++) {
            if (p->turn[i].series != j)
                continue;
            double x = p->drift[i] - slope->middle, y = p->log_ms[i] - p->drift[i] - p->value[j];
            double far = fabs(y - level - slope->b * (x - centre));
            double weight = far > HUBER * slope->s ? HUBER * slope->s / far : 1;
            w += weight;
            wx += weight * x;
            wy += weight * y;
            wxx += weight * x * x;
            wxy += weight * x * y;
        }
        sum = wxx - wx * wx / w;
        if (!(w > 0 && sum > 0)) {
            slope->b = 0;
            break;
        }
        slope->b = (wxy - wx * wy / w) / sum;
        centre = wx / w;
        level = wy / w;
    }
    slope->error = sum > 0 ? slope->s / sqrt(sum) : INFINITY;
}

/* Everything that is said of slopes; `sorted` is lost. Returns the drift in peace. */
static double find_slopes(struct polish *p)
{
    for (size_t j = 0; j < p->nseries; j++)
        if (p->number[j])
            p->slope[j].s = (dph_quantile(p->sorted + p->first[j], p->number[j], .84) -
                             dph_quantile(p->sorted + p->first[j], p->number[j], .16)) / 2;
    sort_series(p, true);
    for (size_t j = 0; j < p->nseries; j++)
        if (p->number[j]) {
            p->slope[j].middle = dph_quantile(p->sorted + p->first[j], p->number[j], .5);
            find_slope(p, j, &p->slope[j]);
        }
    dph_sort(p->sorted, p->count);
    return p->count ? dph_quantile(p->sorted, p->count, PEACE) : 0;
}

bool dph_drift_ratios(const struct dph_turn *turn, size_t nturn, size_t nseries, double *ratio,
                      double *error, struct dph_error *err)
{
    bool ok = false;
    struct polish p = {.turn = turn,
                       .count = nturn,
                       .nseries = nseries,
                       .log_ms = dph_alloc(nturn + 1, sizeof(double)),
                       .drift = dph_alloc_zero(nturn + 1, sizeof(double)),
                       .sorted = dph_alloc(nturn + 1, sizeof(double)),
                       .value = dph_alloc_zero(nseries, sizeof(double)),
                       .error = dph_alloc_zero(nseries, sizeof(double)),
                       .number = dph_alloc_zero(nseries, sizeof(size_t)),
                       .first = dph_alloc_zero(nseries, sizeof(size_t)),
                       .slope = dph_alloc_zero(nseries, sizeof(struct slope))};
    if (!p.log_ms || !p.drift || !p.sorted || !p.value || !p.error || !p.number || !p.first || !p.slope) {
        dph_fail_memory(err);
        goto error;
    }
    for (size_t i = 0; i < nturn; i++) {
        p.log_ms[i] = log(turn[i].ms);
        p.number[turn[i].series]++;
    }
    find_values(&p);
    for (int step = 0; step < STEPS; step++) {
        find_drift(&p);
        find_values(&p);
    }
    const double peace = find_slopes(&p);
    for (size_t j = 0; j < nseries; j++) {
        const struct slope *own = &p.slope[j], *base = &p.slope[0];
        if (!p.number[j] || !p.number[0]) {
            ratio[j] = error[j] = NAN;
            continue;
        }
        const double b = own->b - base->b, doubt = hypot(own->error, base->error);
        const double part = DOUBT * doubt / fabs(b);
        const double g = part < 1 ? 1 - part * part : 0, reach = g * (peace - own->middle);
        ratio[j] = exp(p.value[j] - p.value[0] + (g > 0 ? reach * b : 0));
        const double wide = hypot(p.error[j], p.error[0]);
        error[j] = j ? ratio[j] * hypot(wide, g > 0 ? reach * doubt : 0) : 0;
    }
    ok = true;

error:
    free(p.log_ms);
    free(p.drift);
    free(p.sorted);
    free(p.value);
    free(p.error);
    free(p.number);
    free(p.first);
    free(p.slope);
    return ok;
}
