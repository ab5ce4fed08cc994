/* Ratios under drift: made-up times of a machine whose speed jumps, with ratios that are known. */
#include "render/drift.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { MOST = 8000 };

static uint32_t seed;

static double uniform(void)
{
    seed = seed * 1664525U + 1013904223U;
    return ((seed >> 8) + .5) / 16777216.0;
}

static double normal(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += uniform();
    return sum;
}

/* A machine that is slower by `slow` now and then: phases are some tenths of a second long. */
struct machine {
    double until, now;
    bool slow;
};

static double speed(struct machine *machine, double slow)
{
    while (machine->now >= machine->until) {
        machine->slow = !machine->slow;
        machine->until += .2 - .8 * log(uniform());
    }
    return machine->slow ? slow : 1;
}

/* `rounds` in which series take turns: of one time each in a shuffled order. A series whose `every`
 * is above 1 has a turn in every so manieth round only. */
static size_t make(struct dph_turn *turn, const double *ms, const int *every, size_t nseries,
                   int rounds, double slow, double noise, double spikes)
{
    struct machine machine = {0};
    size_t n = 0;
    for (int r = 0; r < rounds; r++) {
        size_t order[16], count = 0;
        for (size_t j = 0; j < nseries; j++)
            if (!every || r % every[j] == 0)
                order[count++] = j;
        for (size_t i = count; i > 1; i--) {
            size_t k = (size_t)(uniform() * (double)i), moved = order[i - 1];
            order[i - 1] = order[k];
            order[k] = moved;
        }
        for (size_t i = 0; i < count; i++) {
            double t = ms[order[i]] * speed(&machine, slow) * exp(noise * normal());
            if (uniform() < spikes)
                t *= 1 + 4 * uniform();
            machine.now += 1e-3 * t;
            assert_true(n < MOST);
            turn[n++] = (struct dph_turn){order[i], t};
        }
    }
    return n;
}

static void ratios(const struct dph_turn *turn, size_t n, size_t nseries, double *ratio,
                   double *error)
{
    struct dph_error err = {0};
    if (!dph_drift_ratios(turn, n, nseries, ratio, error, &err))
        fail_msg("%s", err.message);
}

static const double known[] = {10, 11, 9, 13, 30, 25};

/* Without noise ratios are exact, however the speed jumps: two thirds of the neighbours agree. */
static void test_exact(void **state)
{
    (void)state;
    static struct dph_turn turn[MOST];
    double ratio[6], error[6];
    seed = 1;
    size_t n = make(turn, known, NULL, 6, 60, 1, 0, 0);
    ratios(turn, n, 6, ratio, error);
    for (int j = 0; j < 6; j++) {
        assert_true(fabs(ratio[j] / (known[j] / known[0]) - 1) < 1e-12);
        assert_true(error[j] >= 0 && error[j] < 1e-12);
    }
    assert_true(ratio[0] == 1 && error[0] == 0);
    n = make(turn, known, NULL, 6, 60, 1.4, 0, 0);
    ratios(turn, n, 6, ratio, error);
    for (int j = 0; j < 6; j++)
        assert_true(fabs(ratio[j] / (known[j] / known[0]) - 1) < 1e-6);
}

/* The root of the mean square of log (ratio / truth) over many runs; beside it what the errors say,
 * and what it is for ratios of medians of each series. */
static double spread(int nseries, const int *every, double slow, double noise, double spikes,
                     double *told, double *medians)
{
    static struct dph_turn turn[MOST];
    static double one[MOST];
    double sum = 0, plain = 0, errors = 0;
    enum { RUNS = 40 };
    for (int run = 0; run < RUNS; run++) {
        double ratio[6], error[6], middle[6];
        size_t n = make(turn, known, every, (size_t)nseries, 60, slow, noise, spikes);
        ratios(turn, n, (size_t)nseries, ratio, error);
        for (size_t j = 0; j < (size_t)nseries; j++) {
            size_t m = 0;
            for (size_t i = 0; i < n; i++)
                if (turn[i].series == j) {
                    size_t k = m++;
                    for (; k > 0 && one[k - 1] > turn[i].ms; k--)
                        one[k] = one[k - 1];
                    one[k] = turn[i].ms;
                }
            middle[j] = one[m / 2];
            if (!j)
                continue;
            sum += pow(log(ratio[j] * known[0] / known[j]), 2);
            plain += pow(log(middle[j] / middle[0] * known[0] / known[j]), 2);
            errors += pow(error[j] / ratio[j], 2);
        }
    }
    *told = sqrt(errors / (RUNS * (nseries - 1)));
    *medians = sqrt(plain / (RUNS * (nseries - 1)));
    return sqrt(sum / (RUNS * (nseries - 1)));
}

/* Phases of a third and noise of 4 percent: with 60 turns each, or fewer, ratios are known to a
 * percent or so, and the errors say that; medians that know nothing of drift are far worse. */
static void test_phases(void **state)
{
    (void)state;
    static const int every[6] = {1, 1, 1, 1, 3, 2};
    double told, medians, found;
    seed = 2;
    found = spread(6, NULL, 1.35, .04, 0, &told, &medians);
    if (!(found < .013 && medians > 2.5 * found && told > .8 * found && told < 1.5 * found))
        fail_msg("six series: %.4f, told %.4f, medians %.4f", found, told, medians);
    found = spread(6, NULL, 1.35, .04, .1, &told, &medians);
    if (!(found < .016 && medians > 2.5 * found && told > .8 * found && told < 2.5 * found))
        fail_msg("with spikes: %.4f, told %.4f, medians %.4f", found, told, medians);
    found = spread(6, every, 1.35, .04, .05, &told, &medians);
    if (!(found < .017 && medians > 2.5 * found && told > .8 * found && told < 1.5 * found))
        fail_msg("some sit out: %.4f, told %.4f, medians %.4f", found, told, medians);
    found = spread(2, NULL, 1.35, .04, 0, &told, &medians);
    if (!(found < .014 && medians > 1.7 * found && told > .7 * found && told < 1.5 * found))
        fail_msg("two series: %.4f, told %.4f, medians %.4f", found, told, medians);
}

/* Of two machines one is slow most of the time, the other hardly ever. The last series feels four
 * tenths of it: its ratio is that of the fast times on both, and the others' are as good as
 * ever. */
static void test_sensitivity(void **state)
{
    (void)state;
    static struct dph_turn turn[MOST];
    enum { RUNS = 40 };
    double bias[2] = {0}, scatter = 0;
    seed = 4;
    for (int run = 0; run < 2 * RUNS; run++) {
        double ratio[6], error[6], share = run % 2 ? .75 : .2;
        size_t n = make(turn, known, NULL, 6, 80, 1, .04, .02);
        for (size_t i = 0, slow = 0, left = 0; i < n; i++) {
            if (!left--) {
                slow = uniform() < share;
                left = (size_t)(20 * uniform());
            }
            if (slow)
                turn[i].ms *= pow(1.4, turn[i].series == 5 ? .4 : 1);
        }
        ratios(turn, n, 6, ratio, error);
        bias[run % 2] += log(ratio[5] * known[0] / known[5]) / RUNS;
        for (int j = 1; j < 5; j++)
            scatter += pow(log(ratio[j] * known[0] / known[j]), 2) / (2 * RUNS * 4);
    }
    if (!(fabs(bias[0]) < .03 && fabs(bias[1]) < .03 && sqrt(scatter) < .02))
        fail_msg("biases %.4f and %.4f, scatter %.4f", bias[0], bias[1], sqrt(scatter));
}

/* Times of the last series are in two heaps, 8 percent to either side, as those of frames that stream
 * through memory can be. A median jumps from one to the other, and is off by half as much again. */
static void test_heaps(void **state)
{
    (void)state;
    static struct dph_turn turn[MOST];
    enum { RUNS = 60 };
    double sum = 0, told = 0;
    seed = 5;
    for (int run = 0; run < RUNS; run++) {
        double ratio[6], error[6];
        size_t n = make(turn, known, NULL, 6, 60, 1.3, .04, .02);
        for (size_t i = 0; i < n; i++)
            if (turn[i].series == 5)
                turn[i].ms *= exp(uniform() < .5 ? .08 : -.08);
        ratios(turn, n, 6, ratio, error);
        sum += pow(log(ratio[5] * known[0] / known[5]), 2) / RUNS;
        told += pow(error[5] / ratio[5], 2) / RUNS;
    }
    if (!(sqrt(sum) < .022 && told > .5 * sum && told < 2 * sum))
        fail_msg("%.4f, told %.4f", sqrt(sum), sqrt(told));
}

/* Machines with a unit of time that is twice as long, and series in another order, give the
 * same. */
static void test_invariance(void **state)
{
    (void)state;
    static struct dph_turn turn[MOST], other[MOST];
    double a[6], b[6], ea[6], eb[6];
    seed = 3;
    size_t n = make(turn, known, NULL, 6, 30, 1.3, .05, .05);
    for (size_t i = 0; i < n; i++)
        other[i] = (struct dph_turn){turn[i].series ? 6 - turn[i].series : 0, 2 * turn[i].ms};
    ratios(turn, n, 6, a, ea);
    ratios(other, n, 6, b, eb);
    for (int j = 1; j < 6; j++) {
        assert_true(fabs(a[j] / b[6 - j] - 1) < 1e-9);
        assert_true(fabs(ea[j] - eb[6 - j]) < 1e-9);
    }
}

static void test_few(void **state)
{
    (void)state;
    double ratio[3], error[3];
    const struct dph_turn turn[] = {{0, 2}, {1, 3}, {0, 2}};
    ratios(turn, 3, 3, ratio, error);
    assert_true(ratio[0] == 1 && fabs(ratio[1] - 1.5) < 1e-12);
    assert_true(isnan(ratio[2]) && isnan(error[2]));
    ratios(turn, 1, 1, ratio, error);
    assert_true(ratio[0] == 1 && error[0] == 0);
    ratios(turn + 1, 1, 2, ratio, error);
    assert_true(isnan(ratio[0]) && isnan(ratio[1]));
    ratios(turn, 0, 2, ratio, error);
    assert_true(isnan(ratio[0]) && isnan(ratio[1]));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact),
        cmocka_unit_test(test_phases),
        cmocka_unit_test(test_sensitivity),
        cmocka_unit_test(test_heaps),
        cmocka_unit_test(test_invariance),
        cmocka_unit_test(test_few),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
