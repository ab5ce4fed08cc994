/* Smoothing of noisy rows over a surface: what it must not touch, what it gains, and whether it knows
 * how much. Rows are made here from functions of place and normal, so the truth is known. */
#include "bake/smooth.h"
#include "shapes.h"

#include <diaphan/sh.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { BANDS = 4, NCOEF = BANDS * BANDS, LENGTH = 3 * NCOEF };

/* A surface with its normals, areas of 1, and rows. */
struct surface {
    struct dph_mesh mesh;
    float *normal, *area, *truth, *half[2], *out;
};

static float *numbers(size_t count)
{
    float *array = calloc(count, sizeof *array);
    assert_non_null(array);
    return array;
}

/* Rows: zonal functions about the normal, whose strength changes slowly over the place, by `detail`. */
static void fill_truth(struct surface *s, double detail)
{
    for (size_t p = 0; p < s->mesh.nvert; p++) {
        const float *x = s->mesh.position + 3 * p, *n = s->normal + 3 * p;
        const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
        double y[NCOEF], change = detail * sin(2 * (double)x[0]) * cos((double)x[1] + (double)x[2]);
        dph_sh_eval(BANDS, normal, y);
        for (size_t c = 0; c < 3; c++)
            for (int l = 0; l < BANDS; l++)
                for (size_t k = (size_t)(l * l); k < (size_t)((l + 1) * (l + 1)); k++)
                    s->truth[p * LENGTH + c * NCOEF + k] =
                        (float)(y[k] * exp(-.6 * l) * (1 + .2 * (double)c + change));
    }
}

static void add_noise(struct surface *s, double strength, uint64_t seed)
{
    for (int h = 0; h < 2; h++)
        for (size_t i = 0; i < s->mesh.nvert * LENGTH; i++) {
            double sum = 0; /* nearly normal, variance 1 */
            for (int k = 0; k < 12; k++)
                sum += next_random(&seed);
            s->half[h][i] = s->truth[i] + (float)(strength * (sum - 6));
        }
}

static struct surface make_surface(struct dph_mesh mesh, bool round)
{
    struct surface s = {.mesh = mesh, .normal = numbers(3 * mesh.nvert), .area = numbers(mesh.nvert)};
    s.truth = numbers(mesh.nvert * LENGTH);
    s.half[0] = numbers(mesh.nvert * LENGTH);
    s.half[1] = numbers(mesh.nvert * LENGTH);
    s.out = numbers(mesh.nvert * LENGTH);
    for (size_t p = 0; p < mesh.nvert; p++) {
        const float *x = mesh.position + 3 * p;
        double length = sqrt((double)(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
        for (size_t k = 0; k < 3; k++)
            s.normal[3 * p + k] = round ? (float)((double)x[k] / length) : k == 2;
        s.area[p] = 1;
    }
    return s;
}

static void finish_surface(struct surface *s)
{
    free(s->normal);
    free(s->area);
    free(s->truth);
    free(s->half[0]);
    free(s->half[1]);
    free(s->out);
    dph_mesh_finish(&s->mesh);
}

static double smooth(struct surface *s, int threads)
{
    struct dph_error err = {0};
    struct dph_smooth_rows rows = {.half = {s->half[0], s->half[1]}, .scale = .5f, .channels = 3,
                                   .bands = BANDS};
    double left = -1;
    struct dph_smoother *smoother =
        dph_smoother_create(s->mesh.position, s->normal, s->area, s->mesh.nvert, s->mesh.index,
                            s->mesh.ntri, threads, &err);
    assert_non_null(smoother);
    assert_true(dph_smoother_choose(smoother, &rows, BANDS, &left, &err));
    memset(s->out, 0, s->mesh.nvert * LENGTH * sizeof *s->out);
    dph_smoother_add(smoother, &rows, s->out);
    dph_smoother_destroy(smoother);
    return left;
}

/* Mean squared error of the smoothed answer and of the plain one. */
static void errors_of(const struct surface *s, double *smoothed, double *plain)
{
    *smoothed = *plain = 0;
    for (size_t i = 0; i < s->mesh.nvert * LENGTH; i++) {
        double truth = (double)s->truth[i];
        double a = (double)s->out[i] - truth;
        double b = .5 * ((double)s->half[0][i] + (double)s->half[1][i]) - truth;
        *smoothed += a * a / (double)s->mesh.nvert;
        *plain += b * b / (double)s->mesh.nvert;
    }
}

/* A flat piece of n x n vertices, with steps `step` apart, at height z. */
static void add_sheet(struct dph_mesh *mesh, uint32_t n, double step, double z)
{
    uint32_t base = (uint32_t)mesh->nvert;
    for (uint32_t j = 0; j < n; j++)
        for (uint32_t i = 0; i < n; i++)
            add_vertex(mesh, step * i, step * j, z);
    for (uint32_t j = 0; j + 1 < n; j++)
        for (uint32_t i = 0; i + 1 < n; i++) {
            uint32_t a = base + j * n + i;
            add_triangle(mesh, a, a + 1, a + n + 1);
            add_triangle(mesh, a, a + n + 1, a + n);
        }
}

static void exact_rows_stay(void **state)
{
    (void)state;
    struct surface s = make_surface(make_sphere(1, 40, 20), true);
    double smoothed, plain;
    fill_truth(&s, 1);
    add_noise(&s, 0, 1);
    double left = smooth(&s, 1);
    errors_of(&s, &smoothed, &plain);
    printf("without noise: left %.3g, error %.3g\n", left, smoothed);
    assert_true(smoothed < 1e-10);
    finish_surface(&s);
}

/* Zonal rows lose nothing whatever the noise; others gain much, and know how much. */
static void noise_goes_and_is_known(void **state)
{
    (void)state;
    const double detail[3] = {0, .2, 1}, noise[3] = {.3, .1, .02}, most[3] = {.06, .2, .8};
    for (int i = 0; i < 3; i++) {
        struct surface s = make_surface(make_sphere(1, 64, 32), true);
        double smoothed, plain;
        fill_truth(&s, detail[i]);
        add_noise(&s, noise[i], 7);
        double left = smooth(&s, 2);
        errors_of(&s, &smoothed, &plain);
        printf("detail %.1f, noise %.2f: %.4f of the squared error left, told %.4f\n", detail[i],
               noise[i], smoothed / plain, left);
        assert_true(smoothed / plain < most[i]);
        assert_true(left > .9 * smoothed / plain && left < 2 * smoothed / plain + .01);
        finish_surface(&s);
    }
}

/* Sheets a hundredth of a step apart have nothing to do with each other. */
static void bodies_do_not_mix(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_room(2 * 20 * 20, 2 * 2 * 19 * 19);
    add_sheet(&mesh, 20, .1, 0);
    add_sheet(&mesh, 20, .1, .001);
    struct surface s = make_surface(mesh, false);
    double mean[2] = {0, 0};
    for (size_t p = 0; p < s.mesh.nvert; p++)
        for (size_t i = 0; i < LENGTH; i++)
            s.truth[p * LENGTH + i] = p < 400 ? 1 : -1;
    add_noise(&s, .2, 3);
    smooth(&s, 1);
    for (size_t p = 0; p < s.mesh.nvert; p++)
        for (size_t i = 0; i < LENGTH; i++) {
            assert_true(fabs((double)s.out[p * LENGTH + i] - (p < 400 ? 1 : -1)) < .5);
            mean[p >= 400] += (double)s.out[p * LENGTH + i] / (400 * LENGTH);
        }
    assert_true(fabs(mean[0] - 1) < .01 && fabs(mean[1] + 1) < .01);
    finish_surface(&s);
}

/* A step between neighbours stays sharp although what surrounds it is smoothed. */
static void steps_stay(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_room(40 * 40, 2 * 39 * 39);
    add_sheet(&mesh, 40, .1, 0);
    struct surface s = make_surface(mesh, false);
    double smoothed, plain;
    for (size_t p = 0; p < s.mesh.nvert; p++)
        for (size_t i = 0; i < LENGTH; i++)
            s.truth[p * LENGTH + i] = p % 40 < 20 ? 1 : 0;
    add_noise(&s, .1, 3);
    double left = smooth(&s, 1);
    errors_of(&s, &smoothed, &plain);
    printf("a step: %.3f of the squared error left, told %.3f\n", smoothed / plain, left);
    assert_true(smoothed < .6 * plain && left > .9 * smoothed / plain);
    for (size_t j = 0; j < 40; j++) {
        const float *left_of = s.out + (j * 40 + 18) * LENGTH, *right_of = left_of + 3 * LENGTH;
        double apart = 0;
        for (size_t i = 0; i < LENGTH; i++)
            apart += ((double)left_of[i] - (double)right_of[i]) / LENGTH;
        assert_true(apart > .7);
    }
    finish_surface(&s);
}

/* Few positions, none, a fan of very many triangles, triangles without area: nothing to smooth, or
 * little, and no harm. The same bytes for any number of threads. */
static void odd_meshes(void **state)
{
    (void)state;
    struct dph_error err = {0};
    struct dph_smoother *none = dph_smoother_create(NULL, NULL, NULL, 0, NULL, 0, 1, &err);
    struct dph_smooth_rows rows = {.half = {NULL, NULL}, .scale = .5f, .channels = 3, .bands = BANDS};
    double left;
    assert_non_null(none);
    assert_true(dph_smoother_choose(none, &rows, BANDS, &left, &err));
    dph_smoother_add(none, &rows, NULL);
    dph_smoother_destroy(none);

    struct surface few = make_surface(make_sphere(1, 6, 3), true);
    fill_truth(&few, 1);
    add_noise(&few, .3, 1);
    assert_true(smooth(&few, 1) == 1);
    for (size_t i = 0; i < few.mesh.nvert * LENGTH; i++)
        assert_true(few.out[i] == .5f * (few.half[0][i] + few.half[1][i]));
    finish_surface(&few);

    struct dph_mesh mesh = make_room(3001, 6000);
    add_vertex(&mesh, 0, 0, 1);
    for (uint32_t i = 0; i < 3000; i++)
        add_vertex(&mesh, cos(i * .002), sin(i * .002), 1);
    for (uint32_t i = 1; i < 3000; i++) {
        add_triangle(&mesh, 0, i, i + 1);
        add_triangle(&mesh, i, i, i);
    }
    struct surface fan = make_surface(mesh, true);
    fill_truth(&fan, 0);
    add_noise(&fan, .3, 1);
    smooth(&fan, 1);
    float *one = numbers(fan.mesh.nvert * LENGTH);
    memcpy(one, fan.out, fan.mesh.nvert * LENGTH * sizeof *one);
    for (size_t i = 0; i < fan.mesh.nvert * LENGTH; i++)
        assert_true(isfinite(one[i]));
    smooth(&fan, 5);
    assert_memory_equal(one, fan.out, fan.mesh.nvert * LENGTH * sizeof *one);
    free(one);
    finish_surface(&fan);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_rows_stay),
        cmocka_unit_test(noise_goes_and_is_known),
        cmocka_unit_test(bodies_do_not_mix),
        cmocka_unit_test(steps_stay),
        cmocka_unit_test(odd_meshes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
