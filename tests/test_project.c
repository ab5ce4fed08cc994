/* Projection and the weighted fit against dense sums in double; equal bytes for any cutting and any
 * processor. */
#include "sh_oracle.h"

#include "core/memory.h"
#include "core/simd.h"
#include "sh/gaunt.h"
#include "sh/project.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { POSITIONS = 40, MOST = 64 };

/* Samples of positions in a body: an ellipsoid seen from points on it, so the front side is 0 and
 * the inside smooth, and a slab that some rays cross as well, which adds jumps. */
struct samples {
    int directions;
    size_t stride;
    float *direction, *plus, *minus, *normal;
};

static double thickness(size_t p, const double n[3], const double w[3])
{
    double along = n[0] * w[0] + n[1] * w[1] * .6 + n[2] * w[2] * .3;
    double length = along < 0 ? -2 * along * (1 + .1 * (double)(p % 7)) : 0;
    return length + (w[2] > .3 + .01 * (double)p && p % 3 == 0 ? .4 / w[2] : 0);
}

static struct samples make_samples(int directions, double unit)
{
    struct samples s = {.directions = directions, .stride = POSITIONS + 8};
    size_t pairs = (size_t)directions / 2;
    s.direction = malloc((size_t)directions * 3 * sizeof(float));
    s.plus = calloc(pairs * s.stride, sizeof(float));
    s.minus = calloc(pairs * s.stride, sizeof(float));
    s.normal = calloc(s.stride * 3, sizeof(float));
    assert_true(s.direction && s.plus && s.minus && s.normal);
    dph_sh_directions(directions, s.direction);
    uint64_t seed = 21;
    for (size_t p = 0; p < POSITIONS; p++) {
        double n[3];
        oracle_direction(&seed, n);
        for (size_t i = 0; i < 3; i++)
            s.normal[3 * p + i] = (float)n[i];
        for (size_t k = 0; k < pairs; k++) {
            double w[3], opposite[3];
            for (size_t i = 0; i < 3; i++)
                opposite[i] = -(w[i] = s.direction[6 * k + i]);
            s.plus[k * s.stride + p] = (float)(unit * thickness(p, n, w));
            s.minus[k * s.stride + p] = (float)(unit * thickness(p, n, opposite));
        }
    }
    return s;
}

static void free_samples(struct samples *s)
{
    free(s->direction);
    free(s->plus);
    free(s->minus);
    free(s->normal);
}

/* Runs a projector over all samples, `step` pairs and `block` positions at a time. */
static void project(const struct samples *s, int bands, enum dph_fit fit, double extinction,
                    bool portable, int step, size_t block, float *coefficient)
{
    struct dph_projector *projector = dph_projector_create(bands, s->directions, fit, extinction,
                                                           portable, NULL);
    assert_non_null(projector);
    size_t sums = dph_projector_sums(projector), bytes = POSITIONS * sums * sizeof(float);
    float *sum = dph_alloc_aligned(bytes, 1);
    assert_non_null(sum);
    memset(sum, 0, bytes);
    for (int k = 0; k < s->directions / 2; k += step) {
        int count = s->directions / 2 - k < step ? s->directions / 2 - k : step;
        for (size_t p = 0; p < POSITIONS; p += block) {
            size_t end = p + block < POSITIONS ? p + block : POSITIONS;
            dph_projector_add(projector, k, count, s->plus + (size_t)k * s->stride,
                              s->minus + (size_t)k * s->stride, s->stride, s->normal, p, end, sum);
        }
    }
    for (size_t p = 0; p < POSITIONS; p += block)
        dph_projector_solve(projector, sum, p, p + block < POSITIONS ? p + block : POSITIONS,
                            coefficient);
    free(sum);
    dph_projector_destroy(projector);
}

/* Solves a x = b for a symmetric positive matrix by elimination with a pivot search, in double. */
static void dense_solve(int n, double (*a)[MOST], double *b)
{
    for (int j = 0; j < n; j++) {
        int best = j;
        for (int i = j + 1; i < n; i++)
            best = fabs(a[i][j]) > fabs(a[best][j]) ? i : best;
        for (int k = 0; k < n; k++) {
            double t = a[j][k];
            a[j][k] = a[best][k];
            a[best][k] = t;
        }
        double t = b[j];
        b[j] = b[best];
        b[best] = t;
        for (int i = j + 1; i < n; i++) {
            double f = a[i][j] / a[j][j];
            for (int k = j; k < n; k++)
                a[i][k] -= f * a[j][k];
            b[i] -= f * b[j];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            b[i] -= a[i][k] * b[k];
        b[i] /= a[i][i];
    }
}

/* One position by the definition, in double. */
static void reference(const struct samples *s, size_t p, int bands, enum dph_fit fit,
                      double extinction, double *c)
{
    static double a[MOST][MOST];
    double y[MOST], mean = 0;
    int n = bands * bands;
    memset(a, 0, sizeof a);
    memset(c, 0, MOST * sizeof *c);
    for (int k = 0; k < s->directions; k++) {
        double w[3], length = 0, cosine = 0, weight = 1;
        for (int i = 0; i < 3; i++) {
            w[i] = s->direction[3 * k + i];
            cosine += w[i] * s->normal[3 * p + (size_t)i];
            length += w[i] * w[i];
        }
        for (int i = 0; i < 3; i++)
            w[i] /= sqrt(length);
        double sample = (k % 2 ? s->minus : s->plus)[(size_t)(k / 2) * s->stride + p];
        if (fit == DPH_FIT_WEIGHTED) {
            weight = (exp(-2 * extinction * sample) + .02) * (cosine > 0 ? .3 : 1);
            if (extinction > 0 && sample > 4 / extinction)
                sample = 4 / extinction;
        }
        mean += weight / s->directions;
        dph_sh_eval(bands, w, y);
        for (int i = 0; i < n; i++) {
            c[i] += weight * sample * y[i] * 4 * ORACLE_PI / s->directions;
            for (int j = 0; j < n; j++)
                a[i][j] += weight * y[i] * y[j] * 4 * ORACLE_PI / s->directions;
        }
    }
    if (fit == DPH_FIT_SPHERE)
        return;
    for (int i = 0; i < n; i++)
        a[i][i] += 1e-3 * mean;
    dense_solve(n, a, c);
}

/* Relative error of all coefficients of all positions; *worst: of the worst position. */
static double compare(const struct samples *s, int bands, enum dph_fit fit, double extinction,
                      double *worst)
{
    static float c[(POSITIONS + 8) * MOST];
    int n = bands * bands;
    double wrong = 0, all = 0;
    *worst = 0;
    project(s, bands, fit, extinction, false, 37, 16, c);
    for (size_t p = 0; p < POSITIONS; p++) {
        double expected[MOST], here = 0, size = 0;
        reference(s, p, bands, fit, extinction, expected);
        for (int i = 0; i < n; i++) {
            double d = c[p * (size_t)n + (size_t)i] - expected[i];
            here += d * d;
            size += expected[i] * expected[i];
        }
        wrong += here;
        all += size;
        if (size > 0 && sqrt(here / size) > *worst)
            *worst = sqrt(here / size);
    }
    return sqrt(wrong / all);
}

static void test_plain(void **state)
{
    (void)state;
    static const int directions[] = {2, 16, 130, 1024};
    for (int d = 0; d < 4; d++) {
        struct samples s = make_samples(directions[d], 1);
        for (int bands = 1; bands <= DPH_MAX_BANDS; bands++) {
            double worst, error = compare(&s, bands, DPH_FIT_SPHERE, 1, &worst);
            assert_true(error < 1e-6);
            assert_true(worst < 2e-6);
        }
        free_samples(&s);
    }
}

static void test_weighted(void **state)
{
    (void)state;
    static const double extinctions[] = {0, .3, 1.5, 6, 60};
    struct samples s = make_samples(1024, 1);
    for (int e = 0; e < 5; e++) {
        for (int bands = 1; bands <= DPH_MAX_BANDS; bands++) {
            if (bands != 6 && bands != DPH_MAX_BANDS && e != 2)
                continue;
            double worst, error = compare(&s, bands, DPH_FIT_WEIGHTED, extinctions[e], &worst);
            print_message("weighted, s = %g, %d bands: %.1e, worst position %.1e\n",
                          extinctions[e], bands, error, worst);
            assert_true(error < 1e-4);
            assert_true(worst < 1e-4);
        }
    }
    free_samples(&s);
}

/* More coefficients than samples: the ridge decides, and pivots are tiny. */
static void test_weighted_few_directions(void **state)
{
    (void)state;
    struct samples s = make_samples(16, 1);
    double worst, error = compare(&s, 6, DPH_FIT_WEIGHTED, 1.5, &worst);
    assert_true(error < 2e-3 && worst < 2e-3);
    free_samples(&s);
}

/* Weights that are all equal (s = 0, nothing in front) leave a plain least-squares fit, which is
 * the projection up to the ridge and the quadrature. */
static void test_weighted_limit(void **state)
{
    (void)state;
    static float plain[(POSITIONS + 8) * MOST], fitted[(POSITIONS + 8) * MOST];
    struct samples s = make_samples(4096, 1);
    memset(s.normal, 0, s.stride * 3 * sizeof(float));
    project(&s, 6, DPH_FIT_SPHERE, 0, false, 64, POSITIONS, plain);
    project(&s, 6, DPH_FIT_WEIGHTED, 0, false, 64, POSITIONS, fitted);
    for (size_t p = 0; p < POSITIONS; p++) {
        double wrong = 0, size = 0;
        for (size_t i = 0; i < 36; i++) {
            double d = (double)fitted[p * 36 + i] * (1 + 1e-3) - plain[p * 36 + i];
            wrong += d * d;
            size += (double)plain[p * 36 + i] * plain[p * 36 + i];
        }
        assert_true(sqrt(wrong / size) < 3e-3);
    }
    free_samples(&s);
}

/* Lengths times u and extinction over u give coefficients times u, for units from a micron to a
 * kilometre. */
static void test_weighted_units(void **state)
{
    (void)state;
    static float c[(POSITIONS + 8) * MOST], scaled[(POSITIONS + 8) * MOST];
    struct samples s = make_samples(256, 1);
    project(&s, 6, DPH_FIT_WEIGHTED, 1.5, false, 64, POSITIONS, c);
    free_samples(&s);
    for (double unit = 1e-6; unit < 2e6; unit *= 1e6) {
        s = make_samples(256, unit);
        project(&s, 6, DPH_FIT_WEIGHTED, 1.5 / unit, false, 64, POSITIONS, scaled);
        for (size_t i = 0; i < POSITIONS * 36; i++)
            assert_true(fabs(scaled[i] / unit - c[i]) < 2e-4);
        free_samples(&s);
    }
}

static void test_zero(void **state)
{
    (void)state;
    static float c[(POSITIONS + 8) * MOST];
    struct samples s = make_samples(64, 0);
    for (int fit = DPH_FIT_SPHERE; fit <= DPH_FIT_WEIGHTED; fit++) {
        for (int e = 0; e < 2; e++) {
            memset(c, 0xff, sizeof c);
            project(&s, 6, (enum dph_fit)fit, e * 1.5, false, 64, POSITIONS, c);
            for (size_t i = 0; i < POSITIONS * 36; i++)
                assert_true(c[i] == 0);
        }
    }
    /* no samples at all: a cancelled bake may still solve */
    memset(c, 0xff, sizeof c);
    struct samples none = s;
    none.directions = 64;
    struct dph_projector *projector = dph_projector_create(6, 64, DPH_FIT_WEIGHTED, 1, false, NULL);
    assert_non_null(projector);
    size_t bytes = POSITIONS * dph_projector_sums(projector) * sizeof(float);
    float *sum = dph_alloc_aligned(bytes, 1);
    assert_non_null(sum);
    memset(sum, 0, bytes);
    dph_projector_solve(projector, sum, 0, POSITIONS, c);
    for (size_t i = 0; i < POSITIONS * 36; i++)
        assert_true(c[i] == 0);
    free(sum);
    dph_projector_destroy(projector);
    free_samples(&none);
}

/* Blocks of pairs, blocks of positions and the kind of processor change no bit. */
static void test_equal_bytes(void **state)
{
    (void)state;
    static float one[(POSITIONS + 8) * MOST], other[(POSITIONS + 8) * MOST];
    static const int steps[] = {1, 7, 32, 100, 512};
    static const size_t blocks[] = {8, 16, 24, POSITIONS, POSITIONS};
    struct samples s = make_samples(1024, 1);
    if (!dph_cpu_has_avx2())
        print_message("no AVX2 here: portable code is compared with itself\n");
    for (int fit = DPH_FIT_SPHERE; fit <= DPH_FIT_WEIGHTED; fit++) {
        for (int bands = 1; bands <= DPH_MAX_BANDS; bands += bands < 5 ? 2 : 1) {
            size_t bytes = POSITIONS * (size_t)(bands * bands) * sizeof(float);
            project(&s, bands, (enum dph_fit)fit, 1.5, false, 512, POSITIONS, one);
            for (int t = 0; t < 5; t++) {
                memset(other, 0, sizeof other);
                project(&s, bands, (enum dph_fit)fit, 1.5, t % 2 == 0, steps[t], blocks[t], other);
                assert_memory_equal(one, other, bytes);
            }
        }
    }
    free_samples(&s);
}

/* Every product of two functions, at random directions, from the table. */
static void test_products(void **state)
{
    (void)state;
    uint64_t seed = 22;
    for (int bands = 1; bands <= DPH_MAX_BANDS; bands++) {
        struct dph_gaunt gaunt;
        assert_true(dph_gaunt_init(&gaunt, bands));
        for (int t = 0; t < 5; t++) {
            double w[3], y[256];
            size_t pair = 0;
            oracle_direction(&seed, w);
            dph_sh_eval(16, w, y);
            for (int i = 0; i < bands * bands; i++)
                for (int j = 0; j <= i; j++, pair++) {
                    double sum = 0;
                    for (uint32_t k = gaunt.start[pair]; k < gaunt.start[pair + 1]; k++)
                        sum += (double)gaunt.factor[k] * y[gaunt.index[k]];
                    assert_true(fabs(sum - y[i] * y[j]) < 3e-7);
                }
        }
        dph_gaunt_finish(&gaunt);
    }
}

static void test_exponential(void **state)
{
    (void)state;
    for (double x = -80; x <= 80; x += .001) {
        dph_f8 e = dph_f8_exp(dph_f8_set((float)x));
        double expected = exp((double)(float)x);
        assert_true(fabs((double)e[3] / expected - 1) < 4e-7);
    }
    assert_true(dph_f8_exp(dph_f8_set(0))[0] == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plain),
        cmocka_unit_test(test_weighted),
        cmocka_unit_test(test_weighted_few_directions),
        cmocka_unit_test(test_weighted_limit),
        cmocka_unit_test(test_weighted_units),
        cmocka_unit_test(test_zero),
        cmocka_unit_test(test_equal_bytes),
        cmocka_unit_test(test_products),
        cmocka_unit_test(test_exponential),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
