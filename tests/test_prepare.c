/* Baking whole scenes: sizes and instances, what is left alone, progress over several bodies, and
 * the warnings for meshes that are not closed. */
#include <diaphan/prepare.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double PI = 3.14159265358979323846;
enum { RINGS = 12, SECTORS = 24, NVERT = (RINGS + 1) * SECTORS, NTRI = 2 * RINGS * SECTORS };

/* Appends a ball with the centre (x, 0, 0) to a mesh that has room for it; poles and seam are
 * repeated vertices, a little pulled so that nothing is quite symmetric. */
static void add_ball(struct dph_mesh *mesh, size_t number, double x, double radius)
{
    size_t first = number * NVERT;
    for (size_t i = 0; i <= RINGS; i++)
        for (size_t j = 0; j < SECTORS; j++) {
            double theta = PI * (double)i / RINGS, phi = 2 * PI * (double)j / SECTORS;
            double r = i % RINGS ? radius * sin(theta) : 0.0, stretch = 1.0 + 0.1 * sin(2 * phi);
            float *p = mesh->position + 3 * (first + i * SECTORS + j);
            p[0] = (float)(x + r * stretch * cos(phi));
            p[1] = (float)(r * sin(phi));
            p[2] = (float)(radius * cos(theta));
        }
    uint32_t *index = mesh->index + 3 * number * NTRI;
    for (uint32_t i = 0; i < RINGS; i++)
        for (uint32_t j = 0; j < SECTORS; j++) {
            uint32_t a = (uint32_t)first + i * SECTORS + j;
            uint32_t b = (uint32_t)first + i * SECTORS + (j + 1) % SECTORS;
            const uint32_t quad[6] = {a, a + SECTORS, b, b, a + SECTORS, b + SECTORS};
            memcpy(index, quad, sizeof quad);
            index += 6;
        }
}

/* A scene of one body that is `count` balls of radius 1, `apart` from centre to centre. */
static struct dph_scene *balls(size_t count, double apart)
{
    struct dph_mesh mesh;
    assert_true(dph_mesh_init(&mesh, count * NVERT, count * NTRI, false, false, NULL));
    for (size_t i = 0; i < count; i++)
        add_ball(&mesh, i, apart * (double)i, 1.0);
    struct dph_scene *scene = dph_scene_from_mesh(&mesh, "balls", NULL);
    assert_non_null(scene);
    return scene;
}

static struct dph_scene_bake_params quick(void)
{
    struct dph_scene_bake_params params = dph_scene_bake_defaults();
    params.bake.directions = 64;
    params.store = DPH_STORE_FLOAT;
    return params;
}

static void millimetres(void **state)
{
    (void)state;
    struct dph_scene *scene = balls(1, 0);
    double size = dph_scene_size(scene);
    assert_true(size > 2.0 && size < 2.3);
    assert_float_equal(dph_scene_millimetres(scene, 0) * size, 25.0, 1e-9);
    assert_float_equal(dph_scene_millimetres(scene, 80) * size, 80.0, 1e-9);
    scene->mm_per_unit = 3.0;
    assert_float_equal(dph_scene_millimetres(scene, 0), 3.0, 0.0);
    assert_float_equal(dph_scene_millimetres(scene, 80) * size, 80.0, 1e-9);
    memset(scene->bounds, 0, sizeof scene->bounds);
    assert_float_equal(dph_scene_millimetres(scene, 80), 1.0, 0.0);
    dph_scene_destroy(scene);
}

/* The weighted fit of a body that stands in the scene three times as large and mirrored: lengths
 * are judged in the body's space. */
static void a_scene_bakes_as_its_arrays_do(void **state)
{
    (void)state;
    struct dph_scene *scene = balls(1, 0);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    scene->ninstance = 2;
    scene->instance = realloc(scene->instance, 2 * sizeof *scene->instance);
    assert_non_null(scene->instance);
    scene->instance[1] = (struct dph_instance){0, {0}};
    scene->instance[1].matrix[0] = -3.0f;
    scene->instance[1].matrix[5] = 3.0f;
    scene->instance[1].matrix[10] = 3.0f;
    scene->instance[1].matrix[15] = 1.0f;

    struct dph_material marble;
    struct dph_medium medium;
    assert_true(dph_material_load("marble", &marble, NULL));
    dph_material_medium(&marble, &medium);
    struct dph_scene_bake_params params = quick();
    struct dph_scene_bake_report report;
    params.size_mm = 50;
    params.material = &marble;
    assert_true(dph_scene_bake(scene, &params, &report, NULL));
    double mm_per_unit = 50.0 / dph_scene_size(scene);
    assert_float_equal(scene->mm_per_unit, mm_per_unit, 1e-12);
    assert_int_equal(report.bodies, 1);
    assert_int_equal(report.triangles, NTRI);
    assert_int_equal(report.vertices, NVERT);
    assert_int_equal(report.positions, (RINGS - 1) * SECTORS + 2);
    assert_int_equal(report.directions, 64);
    assert_float_equal(report.untrusted, 0.0, 0.0);

    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct dph_bake_params direct = params.bake;
    direct.largest_side = dph_scene_size(scene) / 3.0;
    direct.extinction = medium.transport[1] * mm_per_unit * 3.0;
    float *expected = malloc(dph_bake_size(&input, &direct) * sizeof *expected);
    assert_non_null(expected);
    assert_true(dph_bake(&input, &direct, expected, NULL, NULL));
    for (size_t v = 0; v < mesh->nvert; v++) {
        float row[36];
        dph_thickness_row(scene->body[0].thickness, v, row);
        for (int i = 0; i < 36; i++)
            assert_float_equal(row[i], expected[36 * v + (size_t)i], 1e-5);
    }
    free(expected);
    assert_int_equal(scene->body[0].thickness->definition, DPH_THICKNESS_INSIDE);
    assert_int_equal(scene->body[0].thickness->fit, DPH_FIT_WEIGHTED);

    /* what is there is left alone, or done anew */
    struct dph_thickness *before = scene->body[0].thickness;
    params.missing_only = true;
    assert_true(dph_scene_bake(scene, &params, &report, NULL));
    assert_ptr_equal(scene->body[0].thickness, before);
    assert_int_equal(report.bodies, 0);
    params.missing_only = false;
    params.bake.bands = 3;
    assert_true(dph_scene_bake(scene, &params, NULL, NULL));
    assert_int_equal(scene->body[0].thickness->bands, 3);
    dph_scene_destroy(scene);
}

struct watch {
    double last;
    int calls, stop_after;
};

static bool watch(void *user, double fraction)
{
    struct watch *w = user;
    assert_true(fraction >= w->last && fraction <= 1.0);
    w->last = fraction;
    return ++w->calls != w->stop_after;
}

/* Two bodies and one without a vertex between them. */
static void progress_and_cancel(void **state)
{
    (void)state;
    struct dph_scene *scene = balls(1, 0), *other = balls(1, 0);
    scene->body = realloc(scene->body, 3 * sizeof *scene->body);
    assert_non_null(scene->body);
    memset(scene->body + 1, 0, sizeof *scene->body);
    scene->body[1].name = calloc(1, 1);
    scene->body[2] = other->body[0];
    memset(other->body, 0, sizeof *other->body);
    scene->nbody = 3;

    struct watch w = {0};
    struct dph_scene_bake_params params = quick();
    struct dph_scene_bake_report report;
    struct dph_error err;
    params.bake.threads = 1; /* with more, a busy machine may leave the caller's thread no task */
    params.bake.progress = watch;
    params.bake.progress_user = &w;
    assert_true(dph_scene_bake(scene, &params, &report, NULL));
    assert_int_equal(report.bodies, 2);
    assert_null(scene->body[1].thickness);
    assert_non_null(scene->body[2].thickness);
    assert_true(w.calls > 2 && w.last > 0.9);

    w = (struct watch){.stop_after = 2};
    assert_false(dph_scene_bake(scene, &params, &report, &err));
    assert_int_equal(err.code, DPH_ERROR_CANCELLED);
    dph_scene_destroy(scene);
    dph_scene_destroy(other);
}

/* `least`: of the share of samples that cannot be trusted. */
static void expect_warning(struct dph_scene *scene, const char *cause, double least)
{
    struct dph_scene_bake_params params = quick();
    struct dph_scene_bake_report report;
    size_t before = scene->nwarning;
    assert_true(dph_scene_bake(scene, &params, &report, NULL));
    if (!cause) {
        assert_int_equal(scene->nwarning, before);
    } else {
        assert_true(report.untrusted >= least && report.untrusted < 1.0);
        assert_int_equal(scene->nwarning, before + 1);
        assert_non_null(strstr(scene->warning[before], cause));
    }
    dph_scene_destroy(scene);
}

static void causes_of_untrusted_samples(void **state)
{
    (void)state;
    expect_warning(balls(1, 0), NULL, 0);
    expect_warning(balls(2, 3.0), NULL, 0);         /* two shells apart are one body of two parts */
    expect_warning(balls(2, 1.1), "passes through itself (2 shells)", 0.01); /* into each other */

    struct dph_scene *open = balls(1, 0);
    open->body[0].mesh.ntri -= NTRI / 4;
    expect_warning(open, "its surface is open", 0.01);
    open = balls(1, 0);
    memset(open->body[0].mesh.index + 3 * (NTRI / 2), 0, 3 * sizeof(uint32_t)); /* a small hole */
    expect_warning(open, "too small", 0);
    open = balls(2, 1.1);
    for (size_t t = 0; t < NTRI; t += 5)
        memset(open->body[0].mesh.index + 3 * t, 0, 3 * sizeof(uint32_t));
    expect_warning(open, "close the holes", 0.01);

    struct dph_scene *flipped = balls(1, 0);
    for (size_t t = 0; t < NTRI; t += 5) {
        uint32_t *corner = flipped->body[0].mesh.index + 3 * t, swap = corner[0];
        corner[0] = corner[1];
        corner[1] = swap;
    }
    expect_warning(flipped, "turned against", 0.01);

    struct dph_scene *inward = balls(1, 0);
    dph_mesh_flip(&inward->body[0].mesh);
    expect_warning(inward, "look inward", 0.01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(millimetres),
        cmocka_unit_test(a_scene_bakes_as_its_arrays_do),
        cmocka_unit_test(progress_and_cancel),
        cmocka_unit_test(causes_of_untrusted_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
