/* Scores beside a noisy reference, the small solver, and the lights: closed forms, no drawing. */
#include "judge/protocol.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846
enum { SIDE = 128, PIXELS = SIDE * SIDE };

static uint64_t seed = 1;

static double uniform(void)
{
    seed = seed * 6364136223846793005U + 1442695040888963407U;
    return (double)(seed >> 11) / 9007199254740992.0;
}

static double normal(void)
{
    double u = uniform(), v = uniform();
    return sqrt(-2 * log(1 - u)) * cos(2 * PI * v);
}

/* A truth between .2 and .6 that varies smoothly; the object is all but the first rows. */
struct pictures {
    struct dph_image truth, reference, test;
    float *half;
    uint8_t *mask;
};

static double truth_at(size_t i)
{
    return .4 + .2 * sin((double)(i % SIDE) / 9) * cos((double)(i / SIDE) / 7);
}

/* A reference whose halves have noise of `sigma` each, the same in all channels; the test picture is
 * the truth times `factor`. */
static struct pictures make(double sigma, double factor)
{
    struct pictures p = {.half = malloc(3 * PIXELS * sizeof *p.half), .mask = malloc(PIXELS)};
    assert_true(p.half && p.mask);
    assert_true(dph_image_init(&p.truth, SIDE, SIDE, NULL));
    assert_true(dph_image_init(&p.reference, SIDE, SIDE, NULL));
    assert_true(dph_image_init(&p.test, SIDE, SIDE, NULL));
    for (size_t i = 0; i < PIXELS; i++) {
        double t = truth_at(i), a = t + sigma * normal(), b = t + sigma * normal();
        p.mask[i] = i >= 10 * SIDE;
        for (size_t c = 0; c < 3; c++) {
            p.truth.pixel[4 * i + c] = (float)t;
            p.reference.pixel[4 * i + c] = (float)((a + b) / 2);
            p.half[3 * i + c] = (float)a;
            p.test.pixel[4 * i + c] = p.mask[i] ? (float)(factor * t) : 9;
        }
    }
    return p;
}

static void finish(struct pictures *p)
{
    dph_image_finish(&p->truth);
    dph_image_finish(&p->reference);
    dph_image_finish(&p->test);
    free(p->half);
    free(p->mask);
}

static void near(double value, double wanted, double tolerance)
{
    if (!(fabs(value - wanted) <= tolerance))
        fail_msg("%.9g is not %.9g +- %g", value, wanted, tolerance);
}

/* A tenth too bright is an error of a tenth, whatever the noise of the reference. */
static void test_noise_is_taken_out(void **state)
{
    (void)state;
    for (int step = 0; step < 4; step++) {
        const double sigma = .04 * step, variance = sigma * sigma / 2;
        struct pictures p = make(sigma, 1.1);
        struct dph_noise noise;
        struct dph_scores scores;
        double square = 0, count = 0;
        for (size_t i = 0; i < PIXELS; i++)
            if (p.mask[i]) {
                square += truth_at(i) * truth_at(i);
                count++;
            }
        square /= count;
        assert_true(dph_noise_measure(&p.reference, p.half, .5, p.mask, 2, &noise, NULL));
        assert_true(dph_scores_measure(&p.reference, &noise, &p.test, p.mask, 2, &scores, NULL,
                                       NULL));
        near(noise.variance, variance, .04 * variance); /* 15,000 pixels: 3 standard deviations */
        near(noise.rmse, sqrt(variance / square), .03 * sigma + 1e-6);
        near(scores.rmse, .1, .002 + .03 * sigma);
        near(scores.rmse_raw, sqrt((.01 * square + variance) / (square + variance)),
             1e-6 + .02 * sigma);
        if (step)
            assert_true(scores.rmse_raw > scores.rmse + 5e-4 * step);
        finish(&p);
    }
}

/* PSNR of the noise alone: that of the reference beside the truth, which the halves do not know. */
static void test_noise_floor(void **state)
{
    (void)state;
    struct pictures p = make(.03, 1);
    struct dph_noise noise, uneven, none;
    struct dph_scores scores;
    assert_true(dph_noise_measure(&p.reference, p.half, .5, p.mask, 2, &noise, NULL));
    assert_true(dph_scores_measure(&p.reference, NULL, &p.truth, p.mask, 2, &scores, NULL, NULL));
    near(noise.psnr, scores.psnr, .15);
    assert_true(noise.flip > scores.flip);
    assert_true(noise.ssim < scores.ssim);
    assert_true(scores.rmse == scores.rmse_raw);

    /* the same law where the parts are not equal: `half` is a third of the samples */
    for (size_t i = 0; i < 3 * PIXELS; i += 3)
        for (size_t c = 0; c < 3; c++) {
            double t = truth_at(i / 3), whole = (double)p.reference.pixel[4 * (i / 3) + c];
            /* variance of a third is three times that of the whole, its covariance with it 1 */
            static double extra;
            extra = c ? extra : sqrt(2.) * .03 / sqrt(2.) * normal();
            (void)t;
            p.half[i + c] = (float)(whole + extra);
        }
    assert_true(dph_noise_measure(&p.reference, p.half, 1 / 3., p.mask, 2, &uneven, NULL));
    near(uneven.variance, noise.variance, .05 * noise.variance);
    near(uneven.psnr, noise.psnr, .3);

    assert_true(dph_noise_measure(&p.reference, p.half, 1, p.mask, 2, &none, NULL));
    assert_true(isnan(none.psnr) && isnan(none.ssim) && isnan(none.flip) && isnan(none.rmse));
    finish(&p);
}

static void test_equal_pictures(void **state)
{
    (void)state;
    struct pictures p = make(0, 1);
    struct dph_noise noise;
    struct dph_scores scores;
    float *map = malloc(PIXELS * sizeof *map);
    assert_non_null(map);
    assert_true(dph_noise_measure(&p.reference, p.half, .5, p.mask, 1, &noise, NULL));
    assert_true(dph_scores_measure(&p.reference, &noise, &p.reference, p.mask, 1, &scores, map,
                                   NULL));
    assert_true(isinf(scores.psnr) && scores.ssim == 1 && scores.flip == 0 && scores.rmse == 0);
    assert_true(isinf(noise.psnr) && noise.ssim == 1 && noise.flip == 0 && noise.rmse == 0);
    for (size_t i = 0; i < PIXELS; i++)
        assert_true(map[i] == 0);
    /* no more wrong than the noise: 0, not the root of a negative number */
    noise.variance = 1e-3;
    assert_true(dph_scores_measure(&p.reference, &noise, &p.reference, p.mask, 1, &scores, NULL,
                                   NULL));
    assert_true(scores.rmse == 0);
    memset(p.mask, 0, PIXELS);
    assert_false(dph_scores_measure(&p.reference, &noise, &p.reference, p.mask, 1, &scores, NULL,
                                    NULL));
    free(map);
    finish(&p);
}

/* The conditions that only the answer satisfies (Karush, Kuhn, Tucker): where x is 0 the slope is
 * not negative, elsewhere it is 0. */
static void test_solver(void **state)
{
    (void)state;
    int bound = 0;
    for (int round = 0; round < 2000; round++) {
        int n = 1 + round % 3;
        double rows[5][3], matrix[9], right[3], x[3], value = 0;
        for (int r = 0; r < 5; r++)
            for (int i = 0; i < n; i++)
                rows[r][i] = uniform();
        for (int i = 0; i < n; i++) {
            right[i] = normal();
            for (int j = 0; j < n; j++) {
                matrix[i * n + j] = 0;
                for (int r = 0; r < 5; r++)
                    matrix[i * n + j] += rows[r][i] * rows[r][j];
            }
        }
        double least = dph_solve_nonnegative(n, matrix, right, x);
        for (int i = 0; i < n; i++) {
            double slope = -right[i];
            for (int j = 0; j < n; j++) {
                slope += matrix[i * n + j] * x[j];
                value += x[i] * matrix[i * n + j] * x[j];
            }
            value -= 2 * right[i] * x[i];
            assert_true(x[i] >= 0);
            assert_true(slope > -1e-7);
            assert_true(x[i] == 0 || slope < 1e-7);
            bound += x[i] == 0;
        }
        near(least, value, 1e-8);
    }
    assert_true(bound > 500 && bound < 3500);
    /* pictures that are black, or the same twice */
    const double twice[9] = {1, 1, 0, 1, 1, 0, 0, 0, 0}, two[3] = {2, 2, 0};
    double x[3];
    near(dph_solve_nonnegative(3, twice, two, x), -4, 1e-12);
    near(x[0] + x[1], 2, 1e-12);
    assert_true(x[2] == 0);
}

static double between(const double a[3], const double b[3])
{
    return acos(fmax(-1, fmin(1, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]))) * 180 / PI;
}

static void test_lights(void **state)
{
    (void)state;
    const struct dph_camera camera = {77, 10, 3, 35};
    struct dph_light training[DPH_TRAINING_LIGHTS];
    struct dph_judge_light light;
    double sum[3] = {0};
    dph_training_lights(&camera, 5, training);
    for (int i = 0; i < DPH_TRAINING_LIGHTS; i++) {
        near(training[i].irradiance[1], PI, 1e-12);
        near(training[i].angle, 5, 0);
        for (int k = 0; k < 3; k++)
            sum[k] += training[i].to_light[k];
        for (int j = 0; j < i; j++)
            assert_true(between(training[i].to_light, training[j].to_light) > 45);
        for (size_t s = 0; dph_judge_light_name(s); s++) {
            assert_true(dph_judge_light_find(dph_judge_light_name(s), &camera, &light));
            struct dph_light scored = dph_judge_light_make(&light, 0);
            assert_true(between(training[i].to_light, scored.to_light) > 29.8);
        }
    }
    for (int k = 0; k < 3; k++)
        near(sum[k], 0, 1); /* from all sides */
    assert_true(dph_judge_light_find("back", &camera, &light));
    near(light.azimuth, 257, 1e-12);
    near(light.elevation, 20, 0);
    assert_string_equal(light.name, "back");
    assert_false(dph_judge_light_find("below", &camera, &light));

    struct dph_judge_params params = dph_judge_defaults();
    near(dph_judge_angle(&params), 0, 0);
    params.boundary = DPH_BOUNDARY_DIELECTRIC;
    near(dph_judge_angle(&params), 5, 0);
    params.light_angle = 2;
    near(dph_judge_angle(&params), 2, 0);
}

/* Two truths, each with noise of its own: their distance is that of what is below the noise. */
static void test_truths_have_a_distance(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        double sigma = k ? .1 : 0;
        struct pictures a = make(sigma, 1), b = make(sigma, 1);
        for (size_t i = 0; i < 4 * PIXELS; i++)
            b.reference.pixel[i] *= 1.2F;
        double v = sigma * sigma / 2; /* of the mean of two halves */
        near(dph_relative_error(&a.reference, v, &b.reference, 1.44 * v, a.mask), .2, .006);
        /* what is not taken out stays in */
        assert_true(k == 0 ||
                    dph_relative_error(&a.reference, 0, &b.reference, 0, a.mask) > .25);
        finish(&a);
        finish(&b);
    }
}

/* Lights for one figure of all directions: even over the sphere, and none that is fitted on. */
static void test_held_lights(void **state)
{
    (void)state;
    struct dph_camera camera = {77, 15, 3.5, 35};
    struct dph_light held[DPH_JUDGE_HELD_LIGHTS], training[DPH_TRAINING_LIGHTS];
    double mean[3] = {0}, closest = 2, scored = 2;
    dph_held_lights(&camera, 3, held);
    dph_training_lights(&camera, 3, training);
    for (int i = 0; i < DPH_JUDGE_HELD_LIGHTS; i++) {
        const double *a = held[i].to_light;
        near(a[0] * a[0] + a[1] * a[1] + a[2] * a[2], 1, 1e-12);
        assert_true(held[i].angle == 3 && held[i].irradiance[0] == PI);
        for (int k = 0; k < 3; k++)
            mean[k] += a[k] / DPH_JUDGE_HELD_LIGHTS;
        for (int j = 0; j < DPH_TRAINING_LIGHTS; j++) {
            const double *b = training[j].to_light;
            closest = fmin(closest, acos(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]));
        }
        struct dph_judge_light light;
        for (size_t j = 0; j < 3; j++) {
            assert_true(dph_judge_light_find(dph_judge_light_name(j), &camera, &light));
            struct dph_light s = dph_judge_light_make(&light, 3);
            const double *b = s.to_light;
            scored = fmin(scored, acos(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]));
        }
    }
    near(closest * 180 / PI, 13.86, .01);
    near(scored * 180 / PI, 18.88, .1);
    for (int k = 0; k < 3; k++)
        near(mean[k], 0, .02);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_noise_is_taken_out), cmocka_unit_test(test_noise_floor),
        cmocka_unit_test(test_equal_pictures),     cmocka_unit_test(test_solver),
        cmocka_unit_test(test_lights),
        cmocka_unit_test(test_truths_have_a_distance),
        cmocka_unit_test(test_held_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
