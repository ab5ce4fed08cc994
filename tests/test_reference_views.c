/* The path tracer's pictures averaged over views: closed forms, and the response bake, which walks
 * by another program. */
#include <diaphan/reference.h>
#include <diaphan/response_bake.h>
#include <diaphan/sh.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "mean.h"
#include "shapes.h"

/* A camera so far away that its rays are parallel; a ball of radius 1 fills its height. */
static const struct dph_camera far_camera = {0, 0, 1000, .068};

static struct dph_scene *stage(struct dph_mesh mesh)
{
    struct dph_scene *scene = dph_scene_from_mesh(&mesh, "body", NULL);
    assert_non_null(scene);
    return scene;
}

static struct dph_reference_options averaged(int side, int samples)
{
    struct dph_reference_options o = dph_reference_defaults();
    o.view_averaged = true;
    o.separate = true;
    o.width = o.height = side;
    o.samples = samples;
    o.mm_per_unit = 1;
    o.camera = far_camera;
    return o;
}

static void medium(struct dph_reference_options *o, double scattering, double absorption, double g)
{
    for (int c = 0; c < 3; c++) {
        o->material.scattering[c] = scattering;
        o->material.absorption[c] = absorption;
    }
    o->material.anisotropy = g;
}

static struct dph_reference draw(const struct dph_scene *scene,
                                 const struct dph_reference_options *o)
{
    struct dph_reference picture;
    struct dph_error err = {0};
    if (!dph_reference_render(scene, o, &picture, &err))
        fail_msg("%s", err.message);
    assert_true((double)picture.lost <= 1e-5 * (double)picture.paths);
    return picture;
}

/* One channel's mean over the first picture; its error follows from the pixels' variances. */
static struct mean whole(const struct dph_reference *picture, int channel)
{
    size_t count = (size_t)picture->width * (size_t)picture->height;
    double sum = 0, variance = 0, n = (double)count;
    for (size_t i = 0; i < count; i++) {
        sum += (double)picture->pixel[4 * i + (size_t)channel];
        variance += (double)picture->variance[3 * i + (size_t)channel];
    }
    double m = sum / n, v = variance / (n * n);
    return (struct mean){m * n, (v * n + m * m) * n, n};
}

static void everywhere_one(void *user, const double to[3], double radiance[3])
{
    (void)user, (void)to;
    radiance[0] = radiance[1] = radiance[2] = 1;
}

/* No scattering: what leaves a point of a sphere under a light L, averaged over views, is
 * max(0, -mu) / pi exp(-sa 2 R |mu|), mu = n.L. A camera that looks along the light sees the side
 * that the light does not meet: the mean over the disc is the integral of that with 2 |mu| d|mu|. */
static void views_are_averaged_without_scattering(void **state)
{
    (void)state;
    struct dph_scene *scene = stage(make_sphere(1, 192, 96));
    for (int disc = 0; disc < 2; disc++) {
        struct dph_light light[2] = {{.irradiance = {1, 2, 3}, .angle = disc * .5},
                                     {.irradiance = {5, 5, 5}}};
        struct dph_reference_options o = averaged(60, UNDER_SANITIZER ? 4 : 100);
        dph_light_direction(0, 0, light[1].to_light);
        dph_light_direction(180, 0, light[0].to_light);
        o.light = light, o.nlight = 2; /* the second is in front: nothing of it comes through */
        medium(&o, 0, .3, 0);
        o.material.absorption[1] = 0, o.material.absorption[2] = 2;
        struct dph_reference picture = draw(scene, &o);
        double seen = 0;
        for (size_t i = 0; i < 3600; i++)
            seen += (double)picture.pixel[4 * i + 3] / 3600;
        for (int c = 0; c < 3; c++) {
            double exact = 0;
            for (int i = 0; i < 1000; i++) {
                double mu = (i + .5) / 1000;
                exact += mu / PI * exp(-o.material.absorption[c] * 2 * mu) * 2 * mu / 1000;
            }
            struct mean mean = whole(&picture, c);
            check("views averaged, no scattering", &mean, exact * seen * (c + 1),
                  2e-3 * exact, 2e-2 * exact * (c + 1));
            assert_true(picture.pixel[4 * 3600 + c] == 0);
        }
        for (size_t i = 0; i < 4 * 3600; i++)
            assert_true(i % 4 == 3 || picture.pixel[4 * 3600 + i] == 0);
        dph_reference_finish(&picture);
        o.straight = false;
        picture = draw(scene, &o);
        for (size_t i = 0; i < 8 * 3600; i++)
            assert_true(i % 4 == 3 || picture.pixel[i] == 0);
        dph_reference_finish(&picture);
    }
    dph_scene_destroy(scene);
}

/* In surroundings of radiance 1 a body that takes nothing away has radiance 1 to all sides. */
static void averaged_views_make_a_white_furnace(void **state)
{
    (void)state;
    struct dph_mesh shell = make_room(2000, 4000);
    add_sphere(&shell, 1, 24, 12, false);
    add_sphere(&shell, .5, 24, 12, true);
    struct dph_scene *scene = stage(shell);
    struct dph_reference_options o = averaged(24, UNDER_SANITIZER ? 4 : 64);
    static const struct dph_light none[1];
    o.light = none, o.nlight = 0;
    o.environment = everywhere_one;
    o.background[0] = o.background[1] = o.background[2] = 1;
    medium(&o, 3, 0, .4);
    o.material.scattering[1] = 5;
    struct dph_reference picture = draw(scene, &o);
    for (int c = 0; c < 3; c++) {
        struct mean mean = whole(&picture, c);
        check("furnace, views averaged", &mean, 1, 1e-6, 5e-3);
    }
    dph_reference_finish(&picture);
    dph_scene_destroy(scene);
}

/* A sphere's answer depends on n.L only: light from the right and light from above make the same
 * picture, turned. */
static void averaged_views_of_a_sphere_depend_on_one_angle(void **state)
{
    (void)state;
    enum { SIDE = 48, BINS = 8 };
    struct dph_scene *scene = stage(make_sphere(1, 96, 48));
    double sum[2][BINS] = {{0}}, variance[2][BINS] = {{0}}, count[2][BINS] = {{0}};
    for (int k = 0; k < 2; k++) {
        struct dph_light light = {.irradiance = {1, 1, 1}};
        struct dph_reference_options o = averaged(SIDE, UNDER_SANITIZER ? 4 : 200);
        o.light = &light, o.nlight = 1;
        o.seed = (uint64_t)k + 1;
        dph_light_direction(k ? 0 : 90, k ? 90 : 0, light.to_light);
        medium(&o, 3, .1, .3);
        struct dph_reference picture = draw(scene, &o);
        for (size_t i = 0; i < SIDE * SIDE; i++) {
            if (picture.pixel[4 * i + 3] < 1)
                continue;
            size_t along = k ? SIDE - 1 - i / SIDE : i % SIDE, bin = along * BINS / SIDE;
            sum[k][bin] += (double)picture.pixel[4 * i];
            variance[k][bin] += (double)picture.variance[3 * i];
            count[k][bin]++;
        }
        dph_reference_finish(&picture);
    }
    for (size_t b = 1; b + 1 < BINS; b++) {
        double difference = sum[0][b] / count[0][b] - sum[1][b] / count[1][b];
        double spread = sqrt(variance[0][b] + variance[1][b]) / count[0][b];
        printf("    n.L bin %zu: %.5f, differs by %.2f standard errors\n", b,
               sum[0][b] / count[0][b], difference / spread);
        assert_true(count[0][b] > 20 && fabs(difference) < 4 * spread);
    }
    dph_scene_destroy(scene);
}

/* The mean over a disc of a sphere that is lit along the view (toward 1) or against it (-1) is the
 * integral of p(mu) 2 mu d mu over one half, p of the bake's zonal coefficients, each the mean over
 * all vertices. What bands beyond the eighth would add is below 1e-3: both factors fall like
 * l^-2.5. */
static double disc_of_bake(const struct dph_transfer *t, const struct dph_mesh *mesh, int channel,
                           double toward)
{
    size_t ncoef = t->length / 3;
    double zonal[8] = {0}, area = 0, sum = 0;
    for (size_t v = 0; v < mesh->nvert; v++) {
        size_t row = t->position_of[v];
        const float *c = t->vector + row * t->length + (size_t)channel * ncoef;
        double n[3], y[64];
        for (size_t k = 0; k < 3; k++)
            n[k] = (double)mesh->position[3 * v + k];
        dph_sh_eval(8, n, y);
        for (int l = 0; l < 8; l++) /* a band of p where mu is 1, and so Legendre's polynomials */
            for (int i = l * l; i < (l + 1) * (l + 1); i++)
                zonal[l] += (double)t->area[row] * (double)c[i] * y[i];
        area += (double)t->area[row];
    }
    for (int i = 0; i < 2000; i++) {
        double mu = (i + .5) / 2000, x = toward * mu, a = 1, b = x;
        for (int l = 0; l < 8; l++) {
            double c = ((2 * l + 3) * x * b - (l + 1) * a) / (l + 2);
            sum += zonal[l] / area * a * 2 * mu / 2000;
            a = b, b = c;
        }
    }
    return sum;
}

static void the_response_bake_agrees(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 64, 32);
    struct dph_bake_input input = {.position = mesh.position, .nvert = mesh.nvert,
                                   .index = mesh.index, .ntri = mesh.ntri};
    struct dph_response_bake_params p = dph_response_bake_defaults();
    struct dph_response_bake_report report;
    struct dph_transfer t;
    struct dph_light light[2] = {{.irradiance = {1, 1, 1}}, {.irradiance = {1, 1, 1}}};
    struct dph_reference_options o = averaged(48, UNDER_SANITIZER ? 4 : 400);
    medium(&o, 3, .1, 0);
    o.material.scattering[1] = 1, o.material.absorption[2] = .5;
    memcpy(p.scattering, o.material.scattering, sizeof p.scattering);
    memcpy(p.absorption, o.material.absorption, sizeof p.absorption);
    p.bands = 8;
    p.noise = UNDER_SANITIZER ? .3 : .1;
    assert_true(dph_response_bake(&input, &p, &t, &report, NULL));
    for (int k = 0; k < 2; k++)
        dph_light_direction(k ? 180 : 0, 0, light[k].to_light);
    o.light = light, o.nlight = 2;
    struct dph_scene *scene = stage(mesh);
    struct dph_reference picture = draw(scene, &o), second = picture;
    size_t count = 48 * 48;
    double covered = 0;
    for (size_t i = 0; i < count; i++)
        covered += (double)picture.pixel[4 * i + 3] / (double)count;
    second.pixel += 4 * count, second.variance += 3 * count;
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++) {
            struct mean mean = whole(k ? &second : &picture, c);
            double baked = disc_of_bake(&t, &scene->body[0].mesh, c, k ? -1 : 1) * covered;
            /* up to 48 positions share their walks */
            double error = report.noise * baked / sqrt((double)t.npos / 48);
            check(k ? "response bake, from behind" : "response bake, in front", &mean, baked,
                  hypot(error, 1e-3 * baked), .1 * baked);
        }
    dph_reference_finish(&picture);
    dph_transfer_finish(&t);
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_are_averaged_without_scattering),
        cmocka_unit_test(averaged_views_make_a_white_furnace),
        cmocka_unit_test(averaged_views_of_a_sphere_depend_on_one_angle),
        cmocka_unit_test(the_response_bake_agrees),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
