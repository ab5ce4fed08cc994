/* The path tracer's pictures against closed forms and published numbers: boxes seen by reciprocity,
 * the white furnace, light that only passes. Seeds, means and their errors as in test_walks.c. */
#include <diaphan/reference.h>
#include <diaphan/trace.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "mean.h"
#include "shapes.h"

/* A scene of a mesh, placed twice, the second time mirrored. */
static struct dph_scene *stage(struct dph_mesh mesh, bool twice)
{
    struct dph_scene *scene = dph_scene_from_mesh(&mesh, "body", NULL);
    assert_non_null(scene);
    if (twice) {
        struct dph_instance *instance = realloc(scene->instance, 2 * sizeof *instance);
        assert_non_null(instance);
        scene->instance = instance;
        scene->ninstance = 2;
        instance[1] = (struct dph_instance){
            .body = 0, .matrix = {-.5f, 0, 0, 0, 0, 1, .3f, 0, 0, 0, .7f, 0, 1.9f, .4f, .2f, 1}};
        const struct dph_mesh *body = &scene->body[0].mesh;
        for (size_t i = 0; i < 3 * body->nvert; i++) {
            const float *m = instance[1].matrix, *p = body->position + i / 3 * 3;
            size_t k = i % 3;
            double x = (double)(m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2] + m[12 + k]);
            scene->bounds[0][k] = fmin(scene->bounds[0][k], x);
            scene->bounds[1][k] = fmax(scene->bounds[1][k], x);
        }
    }
    return scene;
}

static struct dph_reference_options small_picture(int width, int height, int samples)
{
    struct dph_reference_options o = dph_reference_defaults();
    static const struct dph_light none[1];
    o.width = width, o.height = height, o.samples = samples;
    o.mm_per_unit = 1;
    o.light = none, o.nlight = 0;
    o.material.ior = 1.5;
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
    assert_int_equal(picture.samples, o->samples);
    assert_int_equal(picture.paths, (uint64_t)o->samples * (uint64_t)(o->width * o->height));
    assert_true((double)picture.lost <= 1e-5 * (double)picture.paths);
    assert_int_equal(picture.capped, 0);
    return picture;
}

/* One channel's mean over a picture; its error follows from the pixels' variances. */
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

/* In surroundings of radiance 1 a body that takes nothing away cannot be seen. */
static void white_furnace(void **state)
{
    (void)state;
    struct dph_mesh shell = make_room(2000, 4000); /* with a cavity */
    add_sphere(&shell, 1, 24, 12, false);
    add_sphere(&shell, .5, 24, 12, true);
    struct dph_mesh mesh[2] = {make_box(1, 2, 1.5, 2), shell};
    for (int m = 0; m < 2; m++) {
        struct dph_scene *scene = stage(mesh[m], true);
        for (int boundary = 0; boundary < 2; boundary++) {
            struct dph_reference_options o = small_picture(24, 16, UNDER_SANITIZER ? 4 : 64);
            o.boundary = boundary ? DPH_BOUNDARY_DIELECTRIC : DPH_BOUNDARY_MATCHED;
            o.environment = everywhere_one;
            o.background[0] = o.background[1] = o.background[2] = 1;
            medium(&o, 3, 0, .4);
            o.material.scattering[1] = 5; /* the blue channel equals the red one */
            struct dph_reference picture = draw(scene, &o);
            for (int c = 0; c < 3; c++) {
                struct mean mean = whole(&picture, c);
                check(boundary ? "furnace, dielectric" : "furnace, matched", &mean, 1, 1e-6, 5e-3);
            }
            dph_reference_finish(&picture);
            o.material.scattering[1] = 3;
            o.samples = UNDER_SANITIZER ? 2 : 8;
            picture = draw(scene, &o);
            for (int i = 0; i < 24 * 16 && boundary; i++) /* no weight ever changes */
                assert_true(fabs((double)picture.pixel[4 * i] - 1) < 1e-6);
            dph_reference_finish(&picture);
        }
        dph_scene_destroy(scene);
    }
}

/* Without scattering the background shines through as Beer and Lambert say. */
static void light_only_passes(void **state)
{
    (void)state;
    struct dph_scene *scene = stage(make_box(2, 2, .5, 1), false);
    struct dph_reference_options o = small_picture(4, 4, 2);
    o.camera = (struct dph_camera){0, 0, 4, 5};
    o.background[0] = .2, o.background[1] = .5, o.background[2] = 2;
    medium(&o, 0, 0, 0);
    o.mm_per_unit = 10;
    o.material.absorption[0] = .1, o.material.absorption[2] = .7;
    struct dph_reference picture = draw(scene, &o);
    for (int i = 0; i < 16; i++) {
        const float *p = picture.pixel + 4 * i;
        /* rays are up to 3.5 degrees from the normal */
        assert_true(fabs((double)p[0] / (.2 * exp(-.5)) - 1) < 1e-3);
        assert_true(fabs((double)p[1] / .5 - 1) < 1e-6);
        assert_true(fabs((double)p[2] / (2 * exp(-3.5)) - 1) < 7e-3);
        assert_true(p[3] == 1);
    }
    dph_reference_finish(&picture);
    dph_scene_destroy(scene);
}

/* Radiance 1 from one side of the plane z = 0: user's sign. */
static void one_side(void *user, const double to[3], double radiance[3])
{
    const double *side = user;
    radiance[0] = radiance[1] = radiance[2] = to[2] * *side > 0;
}

/* Boxes seen face on through a needle's eye. By reciprocity the radiance under even light from the
 * camera's side is the reflectance of a beam along the view, that from beyond the transmittance. */
static void boxes_have_published_values(void **state)
{
    (void)state;
    double front = 1, behind = -1;
    int samples = UNDER_SANITIZER ? 200 : 16000;
    struct dph_reference_options o = small_picture(4, 4, samples);
    o.camera = (struct dph_camera){0, 0, 4, .01};
    o.environment = one_side;
    o.environment_user = &front;
    medium(&o, 9, 1, .75);
    struct dph_scene *scene = stage(make_box(40, 40, .2, 4), false);
    struct dph_reference picture = draw(scene, &o);
    struct mean mean = whole(&picture, 0);
    check("box: van de Hulst, reflected", &mean, .09739, 0, 3e-3);
    dph_reference_finish(&picture);
    o.environment_user = &behind;
    o.background[0] = 1;
    picture = draw(scene, &o);
    mean = whole(&picture, 0);
    check("box: van de Hulst, transmitted", &mean, .66096, 0, 3e-3);
    dph_reference_finish(&picture);
    o.background[0] = 0;
    o.boundary = DPH_BOUNDARY_DIELECTRIC;
    medium(&o, 9, 1, 0);
    o.environment_user = &front;
    picture = draw(scene, &o);
    mean = whole(&picture, 0);
    check("box: index 1.5, reflected", &mean, .25312, 1e-4, 5e-3);
    dph_reference_finish(&picture);
    dph_scene_destroy(scene);

    scene = stage(make_box(20, 20, 10, 1), false);
    picture = draw(scene, &o);
    mean = whole(&picture, 0);
    check("box: Giovanelli", &mean, .26008, 2e-4, 5e-3);
    dph_reference_finish(&picture);

    /* light from one direction: Chandrasekhar's law a / (4 pi) mu0 / (mu0 + mu) H(mu0) H(mu) */
    struct dph_light light[2] = {{.to_light = {sqrt(.75) * 3, 0, 1.5}, .irradiance = {1, 2, 4}},
                                 {.to_light = {0, 0, -1}, .irradiance = {9, 9, 9}}};
    double root = sqrt(1 - .9), expected = .9 / (4 * PI) * (.5 / 1.5) * ((1 - .41495) / root) *
                                           ((1 - .50794) / root);
    o.boundary = DPH_BOUNDARY_MATCHED;
    o.environment = NULL;
    o.light = light, o.nlight = 2; /* the second is behind */
    for (int disc = 0; disc < 2; disc++) {
        light[0].angle = disc;
        picture = draw(scene, &o);
        for (int c = 0; c < 3; c++) {
            mean = whole(&picture, c);
            check(disc ? "disc light" : "point of the sky", &mean, expected * (1 << c), 1e-6,
                  1.5e-3 * (1 << c));
        }
        dph_reference_finish(&picture);
    }
    dph_scene_destroy(scene);
}

static void cap_of_sky(void *user, const double to[3], double radiance[3])
{
    (void)user;
    radiance[0] = radiance[1] = radiance[2] = to[1] >= cos(40 * PI / 180) ? 1 : 0;
}

/* A disc as a light and the same disc as surroundings: two estimators, one picture. Two bodies, so
 * that light passes a gap. */
static void discs_are_surroundings(void **state)
{
    (void)state;
    struct dph_scene *scene = stage(make_sphere(1, 24, 12), true);
    double s = sin(40 * PI / 180), e = PI * s * s;
    struct dph_light light = {.to_light = {0, 2, 0}, .irradiance = {e, e, e}, .angle = 40};
    for (int boundary = 0; boundary < 2; boundary++) {
        struct dph_reference_options o = small_picture(16, 16, UNDER_SANITIZER ? 10 : 150);
        struct mean mean[2];
        o.boundary = boundary ? DPH_BOUNDARY_DIELECTRIC : DPH_BOUNDARY_MATCHED;
        medium(&o, 3, .1, .3);
        for (int k = 0; k < 2; k++) {
            o.environment = k ? cap_of_sky : NULL;
            o.light = &light;
            o.nlight = !k;
            o.seed = (uint64_t)k + 1;
            struct dph_reference picture = draw(scene, &o);
            mean[k] = whole(&picture, 0);
            dph_reference_finish(&picture);
        }
        check(boundary ? "disc, dielectric" : "disc, matched", &mean[0], value(&mean[1]),
              deviation(&mean[1]), 5e-3);
    }
    dph_scene_destroy(scene);
}

static bool stop_halfway(void *user, double fraction)
{
    double *last = user;
    assert_true(fraction >= *last);
    *last = fraction;
    return fraction < .5;
}

/* The same bytes for any number of threads; other seeds differ by noise; stopping keeps what there
 * is. */
static void pictures_repeat(void **state)
{
    (void)state;
    struct dph_scene *scene = stage(make_sphere(1, 24, 12), true);
    struct dph_reference_options o = small_picture(33, 21, 8);
    struct dph_light light = {.to_light = {1, 2, 1}, .irradiance = {3, 3, 3}};
    medium(&o, 4, .05, 0);
    o.light = &light, o.nlight = 1;
    o.threads = 1;
    struct dph_reference one = draw(scene, &o);
    o.threads = 4;
    struct dph_reference four = draw(scene, &o);
    size_t count = (size_t)o.width * (size_t)o.height;
    assert_memory_equal(one.pixel, four.pixel, 4 * count * sizeof *one.pixel);
    assert_memory_equal(one.variance, four.variance, 3 * count * sizeof *one.variance);
    o.seed = 2;
    struct dph_reference other = draw(scene, &o);
    assert_memory_not_equal(one.pixel, other.pixel, 4 * count * sizeof *one.pixel);
    struct mean a = whole(&one, 1), b = whole(&other, 1);
    check("another seed", &a, value(&b), deviation(&b), 1e-2);

    double last = 0;
    struct dph_reference half;
    o.seed = 1;
    o.progress = stop_halfway;
    o.progress_user = &last;
    assert_true(dph_reference_render(scene, &o, &half, NULL));
    assert_int_equal(half.samples, 4);
    o.progress = NULL;
    o.samples = 4;
    struct dph_reference short_one = draw(scene, &o);
    assert_memory_equal(half.pixel, short_one.pixel, 4 * count * sizeof *half.pixel);
    dph_reference_finish(&half);
    dph_reference_finish(&one);
    dph_reference_finish(&four);
    dph_reference_finish(&other);
    dph_reference_finish(&short_one);
    dph_scene_destroy(scene);
}

/* A picture of each light, from walks that are those of their sum; half the samples apart. */
static void lights_have_pictures(void **state)
{
    (void)state;
    enum { W = 40, H = 30, COUNT = W * H };
    struct dph_scene *scene = stage(make_sphere(1, 24, 12), true);
    struct dph_light light[4] = {{.to_light = {1, 2, 1}, .irradiance = {3, 2, 1}},
                                 {.to_light = {-1, 0, -2}, .irradiance = {9, 9, 9}, .angle = 20},
                                 {.to_light = {0, 0, 0}, .irradiance = {1, 1, 1}}, /* nowhere */
                                 {.to_light = {0, -1, 0}, .irradiance = {0, 5, 2}, .angle = 40}};
    for (int boundary = 0; boundary < 2; boundary++) {
        struct dph_reference_options o = small_picture(W, H, UNDER_SANITIZER ? 4 : 32);
        o.camera.distance = 2;
        o.boundary = boundary ? DPH_BOUNDARY_DIELECTRIC : DPH_BOUNDARY_MATCHED;
        o.light = light, o.nlight = 4;
        o.environment = cap_of_sky;
        medium(&o, 3, .05, .2);
        o.material.absorption[2] = .5;
        struct dph_reference sum = draw(scene, &o);
        o.separate = true;
        struct dph_reference each = draw(scene, &o);
        assert_int_equal(sum.npicture, 1);
        assert_int_equal(each.npicture, 5);
        double chi = 0, n = 0;
        for (size_t i = 0; i < COUNT; i++)
            for (size_t c = 0; c < 3; c++) {
                double total = 0;
                for (size_t p = 0; p < 5; p++)
                    total += (double)each.pixel[4 * (p * COUNT + i) + c];
                double joint = (double)sum.pixel[4 * i + c];
                assert_true(fabs(total - joint) <= 1e-5 * (1 + joint));
                assert_true(each.pixel[4 * (2 * COUNT + i) + c] == 0);
                double half = (double)sum.half[3 * i + c], v = (double)sum.variance[3 * i + c];
                if (v > 0) {
                    chi += (half - joint) * (half - joint) / v;
                    n++;
                }
            }
        printf("    halves: %.3f of the expected square over %g values\n", chi / n, n);
        if (!UNDER_SANITIZER)
            assert_true(fabs(chi / n - 1) < .15);
        for (size_t p = 0; p < 5; p++) /* coverage is the same in all */
            for (size_t i = 0; i < COUNT; i++)
                assert_true(each.pixel[4 * (p * COUNT + i) + 3] == sum.pixel[4 * i + 3]);

        /* a light alone has its own picture: the same walks, but for the discs' random numbers */
        o.light = light + 3, o.nlight = 1;
        o.environment = NULL;
        o.seed = 5;
        struct dph_reference alone = draw(scene, &o);
        struct dph_reference third = {.width = W, .height = H, .pixel = each.pixel + 4 * 3 * COUNT,
                                      .variance = each.variance + 3 * 3 * COUNT};
        for (int c = 1; c < 3; c++) {
            struct mean a = whole(&alone, c), b = whole(&third, c);
            check("a light alone", &a, value(&b), deviation(&b), 2e-2);
        }
        dph_reference_finish(&sum);
        dph_reference_finish(&each);
        dph_reference_finish(&alone);
    }
    dph_scene_destroy(scene);
}

/* What comes from a far light to a far camera does not change where they change places: the sum
 * over the picture, for any bodies and any phase function. */
static void light_and_camera_change_places(void **state)
{
    (void)state;
    static const double place[2][2] = {{20, 10}, {130, -35}};
    struct dph_scene *scene = stage(make_box(1, 2, 1.5, 1), true);
    struct mean mean[2][3];
    for (int k = 0; k < 2; k++) {
        struct dph_reference_options o = small_picture(32, 32, UNDER_SANITIZER ? 4 : 200);
        struct dph_light light = {.irradiance = {5, 5, 5}};
        dph_light_direction(place[!k][0], place[!k][1], light.to_light);
        o.light = &light, o.nlight = 1;
        o.camera = (struct dph_camera){place[k][0], place[k][1], 1000, .126};
        o.seed = (uint64_t)k + 1;
        medium(&o, 3, .05, .6);
        o.material.scattering[1] = 8;
        o.material.absorption[2] = 1;
        struct dph_reference picture = draw(scene, &o);
        for (int c = 0; c < 3; c++)
            mean[k][c] = whole(&picture, c);
        dph_reference_finish(&picture);
    }
    for (int c = 0; c < 3; c++)
        check("places changed", &mean[0][c], value(&mean[1][c]), deviation(&mean[1][c]), 2e-3);
    dph_scene_destroy(scene);
}

static bool stop(void *user, double fraction)
{
    (void)user, (void)fraction;
    return false;
}

static void bad_requests_fail(void **state)
{
    (void)state;
    struct dph_scene *scene = stage(make_box(1, 1, 1, 1), false);
    struct dph_light near = {.kind = DPH_LIGHT_POINT, .irradiance = {1, 1, 1}};
    struct dph_reference picture;
    struct dph_error err;
    for (int i = 0; i < 9; i++) {
        struct dph_reference_options o = small_picture(2, 2, 1);
        enum dph_code code = DPH_ERROR_ARGUMENT;
        switch (i) {
        case 0: o.width = 0; break;
        case 1: o.samples = 0; break;
        case 2: o.light = &near, o.nlight = 1; break;
        case 3: o.material.scattering[1] = NAN; break;
        case 4: o.material.anisotropy = 1; break;
        case 5: o.camera.fov = 180; break;
        case 6: o.material.ior = .5; break;
        case 7: o.view_averaged = true, o.boundary = DPH_BOUNDARY_DIELECTRIC; break;
        default: o.progress = stop; code = DPH_ERROR_CANCELLED; break;
        }
        assert_false(dph_reference_render(scene, &o, &picture, &err));
        assert_int_equal(err.code, code);
        assert_null(picture.pixel);
    }
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_furnace),
        cmocka_unit_test(light_only_passes),
        cmocka_unit_test(boxes_have_published_values),
        cmocka_unit_test(discs_are_surroundings),
        cmocka_unit_test(pictures_repeat),
        cmocka_unit_test(lights_have_pictures),
        cmocka_unit_test(light_and_camera_change_places),
        cmocka_unit_test(bad_requests_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
