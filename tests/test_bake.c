/* The bake as a whole: closed forms of the sphere, symmetries, equal bytes, broken meshes and
 * broken calls. */
#include "shapes.h"

#include <diaphan/bake.h>
#include <diaphan/scene.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* Coefficients of a mesh, malloc'ed. */
static float *bake_mesh(const struct dph_mesh *mesh, const struct dph_bake_params *params,
                        struct dph_bake_report *report)
{
    struct dph_bake_input input = {.position = mesh->position, .nvert = mesh->nvert,
                                   .index = mesh->index, .ntri = mesh->ntri};
    float *coefficient = malloc(dph_bake_size(&input, params) * sizeof(float) + 1);
    struct dph_error err = {0};
    if (!dph_bake(&input, params, coefficient, report, &err))
        fail_msg("%s", err.message);
    return coefficient;
}

/* sqrt(sum (a - b)^2 / sum b^2) */
static double relative_error(const float *a, const float *b, double scale, size_t count)
{
    double error = 0, norm = 0;
    for (size_t i = 0; i < count; i++) {
        error += (a[i] - scale * b[i]) * (a[i] - scale * b[i]);
        norm += scale * b[i] * scale * b[i];
    }
    return sqrt(error / norm);
}

static struct dph_bake_params sphere_fit(int bands, int directions)
{
    struct dph_bake_params params = dph_bake_defaults();
    params.bands = bands;
    params.directions = directions;
    params.fit = DPH_FIT_SPHERE;
    return params;
}

/* Thickness of a sphere is 2 R max(0, -n.w), whose coefficients are 2 R A_l y_lm(-n)
 * (Funk-Hecke, A_l of the clamped cosine). The error falls with the size of the facets, until
 * the quadrature's is left. */
static void sphere_in_closed_form(void **state)
{
    (void)state;
    static const double cosine[6] = {1, 2.0 / 3, 0.25, 0, -1.0 / 24, 0}; /* A_l / pi */
    static const struct {
        uint32_t segments;
        int directions;
        double allowed;
    } cases[] = {{48, 1024, 0.03}, {96, 1024, 0.01}, {192, 1024, 0.006}, {192, 4096, 0.003}};
    const double radius = 1.5;
    for (size_t n = 0; n < sizeof cases / sizeof *cases; n++) {
        struct dph_mesh mesh = make_sphere(radius, cases[n].segments, cases[n].segments / 2);
        struct dph_bake_params params = sphere_fit(6, cases[n].directions);
        struct dph_bake_report report;
        float *coefficient = bake_mesh(&mesh, &params, &report);
        assert_true(report.untrusted == 0);
        assert_int_equal(report.directions, cases[n].directions);
        assert_int_equal(report.positions, mesh.nvert);
        double worst = 0;
        for (size_t v = 0; v < mesh.nvert; v++) {
            double inward[3], y[36];
            for (int k = 0; k < 3; k++)
                inward[k] = -mesh.position[3 * v + (size_t)k] / radius;
            dph_sh_eval(6, inward, y);
            for (int l = 0; l < 6; l++)
                for (int i = l * l; i < (l + 1) * (l + 1); i++)
                    worst = fmax(worst, fabs(coefficient[36 * v + (size_t)i] - 2 * radius * PI * cosine[l] * y[i]));
        }
        print_message("sphere of %u segments, %d directions: largest error %.4f of the radius\n",
                      (unsigned)cases[n].segments, cases[n].directions, worst / radius);
        assert_true(worst < cases[n].allowed * radius);
        free(coefficient);
        dph_mesh_finish(&mesh);
    }
}

/* Coordinates may have any size: the coefficients follow the scale, with either fit. */
static void scale_is_a_factor(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_cylinder(0.7, 2, 24, 6);
    for (int fit = 0; fit < 2; fit++) {
        struct dph_bake_params params = sphere_fit(5, 256);
        params.fit = (enum dph_fit)fit;
        params.extinction = fit ? 2 : 0;
        float *unit = bake_mesh(&mesh, &params, NULL);
        static const double scales[] = {1e-6, 1e-3, 0.3, 1e3, 1e6};
        for (size_t i = 0; i < sizeof scales / sizeof *scales; i++) {
            struct dph_mesh scaled = make_cylinder(0.7 * scales[i], 2 * scales[i], 24, 6);
            params.extinction = fit ? 2 / scales[i] : 0;
            float *coefficient = bake_mesh(&scaled, &params, NULL);
            assert_true(relative_error(coefficient, unit, scales[i], 25 * mesh.nvert) < 1e-5);
            free(coefficient);
            dph_mesh_finish(&scaled);
        }
        free(unit);
    }
    dph_mesh_finish(&mesh);
}

/* Turning the body and the light together changes nothing but the quadrature's error (test_sweep
 * has the samples). */
static void rotation_leaves_thickness(void **state)
{
    (void)state;
    double r[3][3];
    some_rotation(r);
    struct dph_mesh mesh = make_sphere(1, 12, 6), turned = make_sphere(1, 12, 6);
    rotate_mesh(&turned, r);
    struct dph_bake_params params = sphere_fit(6, 65536);
    float *a = bake_mesh(&mesh, &params, NULL), *b = bake_mesh(&turned, &params, NULL);
    uint64_t seed = 1;
    for (int n = 0; n < 50; n++) {
        double d[3], e[3], y[36], z[36];
        random_direction(&seed, d);
        for (int k = 0; k < 3; k++)
            e[k] = r[k][0] * d[0] + r[k][1] * d[1] + r[k][2] * d[2];
        dph_sh_eval(6, d, y);
        dph_sh_eval(6, e, z);
        for (size_t v = 0; v < mesh.nvert; v++) {
            double before = 0, after = 0;
            for (size_t i = 0; i < 36; i++) {
                before += a[36 * v + i] * y[i];
                after += b[36 * v + i] * z[i];
            }
            assert_true(fabs(before - after) < 4e-3);
        }
    }
    free(a);
    free(b);
    dph_mesh_finish(&mesh);
    dph_mesh_finish(&turned);
}

/* The weighted fit is made for the transmittance exp(-s S): over all directions it must come
 * nearer to it than the projection. */
static void weighted_fit_is_better_where_it_matters(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_cylinder(0.5, 3, 32, 12);
    struct dph_bake_input input = {.position = mesh.position, .nvert = mesh.nvert,
                                   .index = mesh.index, .ntri = mesh.ntri};
    struct dph_bake_params params = sphere_fit(6, 1024);
    float *plain = bake_mesh(&mesh, &params, NULL);
    params.fit = DPH_FIT_WEIGHTED;
    params.extinction = 3;
    float *weighted = bake_mesh(&mesh, &params, NULL);
    float *length = malloc(mesh.nvert * sizeof *length);
    double error[2] = {0, 0}, s = 0.5 * hypot(3, 3 / 3.0);
    uint64_t seed = 6;
    for (int n = 0; n < 400; n++) {
        double d[3], y[36];
        random_direction(&seed, d);
        dph_sh_eval(6, d, y);
        assert_true(dph_bake_direction(&input, &params, d, length, NULL, NULL, NULL, NULL));
        for (size_t v = 0; v < mesh.nvert; v++) {
            double a = 0, b = 0, truth = exp(-s * length[v]);
            for (size_t i = 0; i < 36; i++) {
                a += plain[36 * v + i] * y[i];
                b += weighted[36 * v + i] * y[i];
            }
            error[0] += pow(exp(-s * fmax(a, 0)) - truth, 2);
            error[1] += pow(exp(-s * fmax(b, 0)) - truth, 2);
        }
    }
    print_message("transmittance error, weighted over plain: %.3f\n", sqrt(error[1] / error[0]));
    assert_true(error[1] < 0.65 * error[0]); /* of the squares */
    free(length);
    free(plain);
    free(weighted);
    dph_mesh_finish(&mesh);
}

/* The same bytes for any number of threads, with and without AVX2, indexed or not, packed or
 * strided. */
static void equal_bytes(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_cylinder(1, 1.5, 40, 20);
    for (int definition = 0; definition < 3; definition++)
        for (int fit = 0; fit < 2; fit++) {
            struct dph_bake_params params = dph_bake_defaults();
            params.directions = 200;
            params.definition = (enum dph_definition)definition;
            params.fit = (enum dph_fit)fit;
            params.threads = 1;
            size_t bytes = mesh.nvert * 36 * sizeof(float);
            float *one = bake_mesh(&mesh, &params, NULL);
            for (int threads = 2; threads <= 8; threads += 6) {
                params.threads = threads;
                float *more = bake_mesh(&mesh, &params, NULL);
                assert_memory_equal(one, more, bytes);
                free(more);
            }
            params.portable = true;
            float *portable = bake_mesh(&mesh, &params, NULL);
            assert_memory_equal(one, portable, bytes);
            free(portable);

            /* unshared vertices in a wider struct */
            size_t corners = 3 * mesh.ntri;
            struct {
                float normal[3], position[3];
            } *wide = malloc(corners * sizeof *wide);
            for (size_t i = 0; i < corners; i++)
                memcpy(wide[i].position, mesh.position + 3 * (size_t)mesh.index[i], 12);
            struct dph_bake_input input = {.position = wide->position, .stride = sizeof *wide,
                                           .nvert = corners, .ntri = mesh.ntri};
            float *unshared = malloc(dph_bake_size(&input, &params) * sizeof *unshared);
            assert_true(dph_bake(&input, &params, unshared, NULL, NULL));
            /* positions are numbered in another order, so sums over triangles may round
             * differently: not the bytes, the values */
            for (size_t i = 0; i < corners; i++)
                for (size_t k = 0; k < 36; k++)
                    assert_true(fabsf(unshared[36 * i + k] - one[36 * (size_t)mesh.index[i] + k]) < 2e-4f);
            free(unshared);
            free(wide);
            free(one);
        }
    dph_mesh_finish(&mesh);
}

/* A sphere with a cavity, whose triangles come last. */
static struct dph_mesh make_shell(void)
{
    struct dph_mesh mesh = make_room(2 * (15 * 32 + 2), 4 * 32 * 15);
    add_sphere(&mesh, 1, 32, 16, false);
    add_sphere(&mesh, 0.6, 32, 16, true);
    return mesh;
}

/* Holes, flipped and doubled triangles, single triangles, flat meshes: numbers come out, and
 * `untrusted` tells. */
static void open_meshes_bake(void **state)
{
    (void)state;
    struct dph_bake_params params = sphere_fit(6, 256);
    struct dph_bake_report whole, report;
    struct dph_mesh shell = make_shell();
    free(bake_mesh(&shell, &params, &whole));
    assert_true(whole.untrusted == 0);
    for (int kind = 0; kind < 5; kind++) {
        struct dph_mesh mesh = make_room(shell.nvert, 2 * shell.ntri);
        memcpy(mesh.position, shell.position, 12 * shell.nvert);
        memcpy(mesh.index, shell.index, 12 * shell.ntri);
        mesh.nvert = shell.nvert;
        mesh.ntri = shell.ntri;
        if (kind == 0) { /* a hole */
            mesh.ntri -= 60;
        } else if (kind == 1) { /* flipped triangles */
            for (size_t t = 0; t < 40; t++) {
                uint32_t *i = mesh.index + 3 * (7 * t % mesh.ntri), swap = i[0];
                i[0] = i[1], i[1] = swap;
            }
        } else if (kind == 2) { /* everything twice */
            memcpy(mesh.index + 3 * mesh.ntri, mesh.index, 12 * mesh.ntri);
            mesh.ntri *= 2;
        } else if (kind == 3) { /* one triangle */
            mesh.ntri = 1;
        } else { /* squashed to a plane: no inside at all */
            for (size_t v = 0; v < mesh.nvert; v++)
                mesh.position[3 * v + 1] = 0;
        }
        for (int fit = 0; fit < 2; fit++) {
            params.fit = (enum dph_fit)fit;
            float *coefficient = bake_mesh(&mesh, &params, &report);
            for (size_t i = 0; i < 36 * mesh.nvert; i++)
                assert_true(fabsf(coefficient[i]) < 20);
            free(coefficient);
        }
        if (kind < 4) /* of one triangle, most vertices are none of its */
            assert_true(report.untrusted > (kind < 3 ? 0.001 : 0) && report.untrusted <= 1);
        dph_mesh_finish(&mesh);
    }
    dph_mesh_finish(&shell);
}

/* A convex body with a hole never has a balance out of range; that a ray from inside leaves
 * without a crossing must be noticed all the same. */
static void missing_face_is_noticed(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_box(1, 1, 1, 6);
    mesh.ntri -= 72;
    struct dph_bake_input input = {.position = mesh.position, .nvert = mesh.nvert,
                                   .index = mesh.index, .ntri = mesh.ntri};
    struct dph_bake_params params = dph_bake_defaults();
    float *plus = malloc(mesh.nvert * sizeof *plus), *minus = malloc(mesh.nvert * sizeof *minus);
    uint8_t *bad_plus = malloc(mesh.nvert), *bad_minus = malloc(mesh.nvert);
    uint64_t seed = 12;
    for (int n = 0; n < 200; n++) {
        double d[3];
        random_direction(&seed, d);
        assert_true(dph_bake_direction(&input, &params, d, plus, minus, bad_plus, bad_minus, NULL));
        for (size_t v = 0; v < mesh.nvert; v++) {
            const float *p = mesh.position + 3 * v;
            bool bottom = p[2] == 0 && p[0] > 0 && p[0] < 1 && p[1] > 0 && p[1] < 1;
            if (!bottom) /* seen from the middle of the bottom, the missing face is the top */
                continue;
            double sign = d[2] > 0 ? 1 : -1, x = p[0] + d[0] / d[2], y = p[1] + d[1] / d[2];
            bool through = x > 0 && x < 1 && y > 0 && y < 1;
            assert_int_equal(sign > 0 ? bad_plus[v] : bad_minus[v], through);
            assert_int_equal(sign > 0 ? bad_minus[v] : bad_plus[v], 0);
        }
    }
    free(plus);
    free(minus);
    free(bad_plus);
    free(bad_minus);
    dph_mesh_finish(&mesh);
}

/* A pair that cannot be trusted has the first exit, or nothing. */
static void fallback_is_the_first_exit(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_shell();
    mesh.ntri -= 60;
    struct dph_bake_input input = {.position = mesh.position, .nvert = mesh.nvert,
                                   .index = mesh.index, .ntri = mesh.ntri};
    struct dph_bake_params params = dph_bake_defaults();
    float *length = malloc(mesh.nvert * sizeof *length), *first = malloc(mesh.nvert * sizeof *first);
    uint8_t *bad = malloc(mesh.nvert);
    size_t seen = 0;
    uint64_t seed = 9;
    for (int n = 0; n < 50; n++) {
        double d[3];
        random_direction(&seed, d);
        params.definition = DPH_THICKNESS_FIRST;
        assert_true(dph_bake_direction(&input, &params, d, first, NULL, NULL, NULL, NULL));
        for (int definition = 0; definition < 3; definition += 2) {
            params.definition = (enum dph_definition)definition;
            assert_true(dph_bake_direction(&input, &params, d, length, NULL, bad, NULL, NULL));
            for (size_t v = 0; v < mesh.nvert; v++)
                if (bad[v]) {
                    assert_true(length[v] == first[v]);
                    seen++;
                }
        }
    }
    assert_true(seen > 100);
    free(bad);
    free(length);
    free(first);
    dph_mesh_finish(&mesh);
}

/* Two bodies that overlap: rays that start in both have balance 2. */
static void overlapping_shells_are_reported(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_room(2 * (15 * 32 + 2), 4 * 32 * 15);
    add_sphere(&mesh, 1, 32, 16, false);
    size_t first = mesh.nvert;
    add_sphere(&mesh, 1, 32, 16, false);
    for (size_t v = first; v < mesh.nvert; v++)
        mesh.position[3 * v] += 0.7f;
    struct dph_bake_params params = sphere_fit(4, 128);
    struct dph_bake_report report;
    free(bake_mesh(&mesh, &params, &report));
    assert_true(report.untrusted > 0.01);
    dph_mesh_finish(&mesh);
}

static bool stop_halfway(void *user, double fraction)
{
    double *last = user;
    assert_true(fraction >= *last && fraction <= 1);
    *last = fraction;
    return fraction < 0.5;
}

static void broken_calls(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_box(1, 1, 1, 2);
    struct dph_bake_input input = {.position = mesh.position, .nvert = mesh.nvert,
                                   .index = mesh.index, .ntri = mesh.ntri};
    float *coefficient = malloc(mesh.nvert * 64 * sizeof *coefficient);
    static const struct {
        int bands, directions;
        double extinction;
    } wrong[] = {{0, 64, 0}, {9, 64, 0}, {6, 15, 0}, {6, 65537, 0}, {6, 64, -1}, {6, 64, NAN}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct dph_bake_params params = sphere_fit(wrong[i].bands, wrong[i].directions);
        params.extinction = wrong[i].extinction;
        struct dph_error err = {0};
        assert_false(dph_bake(&input, &params, coefficient, NULL, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        assert_true(strlen(err.message) > 10);
    }
    struct dph_bake_params params = sphere_fit(8, 65);
    struct dph_bake_report report;
    assert_true(dph_bake(&input, &params, coefficient, &report, NULL));
    assert_int_equal(report.directions, 66);

    struct dph_error err = {0};
    uint32_t kept = mesh.index[5];
    mesh.index[5] = 9001;
    assert_false(dph_bake(&input, &params, coefficient, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_non_null(strstr(err.message, "9001"));
    mesh.index[5] = kept;
    mesh.position[7] = NAN;
    assert_false(dph_bake(&input, &params, coefficient, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    mesh.position[7] = 0;

    mesh.position[7] = 3e38f; /* finite, but its lengths would not be */
    assert_false(dph_bake(&input, &params, coefficient, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    mesh.position[7] = 0;

    double last = 0;
    params.directions = 4096;
    params.progress = stop_halfway;
    params.progress_user = &last;
    assert_false(dph_bake(&input, &params, coefficient, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_CANCELLED);
    assert_true(last >= 0.5 && last < 0.7);

    /* nothing to bake is no error */
    struct dph_bake_input empty = {.position = mesh.position};
    params = sphere_fit(6, 64);
    assert_int_equal(dph_bake_size(&empty, &params), 0);
    assert_true(dph_bake(&empty, &params, coefficient, &report, NULL));
    assert_int_equal(report.positions, 0);
    input.ntri = 0;
    assert_true(dph_bake(&input, &params, coefficient, &report, NULL));
    for (size_t i = 0; i < 36 * mesh.nvert; i++)
        assert_true(coefficient[i] == 0);
    free(coefficient);
    dph_mesh_finish(&mesh);
}

/* 8 bits a coefficient: at most 0.6 % of error on real meshes. */
static void snorm8_is_close_to_float(void **state)
{
    (void)state;
    static const char *const names[] = {"bunny_closed_hr.obj", "spot.obj", "nefertiti_100k.obj"};
    size_t tested = 0;
    for (size_t n = 0; n < sizeof names / sizeof *names; n++) {
        char path[512];
        snprintf(path, sizeof path, DPH_DATA "/models/%s", names[n]);
        struct dph_scene *scene = dph_scene_load(path, NULL);
        if (!scene)
            continue;
        const struct dph_mesh *mesh = &scene->body[0].mesh;
        for (int fit = 0; fit < 2; fit++) {
            struct dph_bake_params params = sphere_fit(6, 128);
            params.fit = (enum dph_fit)fit;
            float *coefficient = bake_mesh(mesh, &params, NULL);
            struct dph_thickness *thickness = dph_thickness_create(coefficient, mesh->nvert, 6, NULL,
                                                                   mesh->nvert, DPH_STORE_SNORM8, NULL);
            float *stored = malloc(36 * mesh->nvert * sizeof *stored);
            for (size_t v = 0; v < mesh->nvert; v++)
                dph_thickness_row(thickness, v, stored + 36 * v);
            double error = relative_error(stored, coefficient, 1, 36 * mesh->nvert);
            print_message("%s, %s: snorm8 differs by %.4f\n", names[n], dph_fit_name(params.fit), error);
            assert_true(error < 0.006);
            free(stored);
            dph_thickness_destroy(thickness);
            free(coefficient);
        }
        dph_scene_destroy(scene);
        tested++;
    }
    if (!tested) {
        print_message("skipped: no models in " DPH_DATA "\n");
        skip();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_in_closed_form),
        cmocka_unit_test(scale_is_a_factor),
        cmocka_unit_test(rotation_leaves_thickness),
        cmocka_unit_test(weighted_fit_is_better_where_it_matters),
        cmocka_unit_test(equal_bytes),
        cmocka_unit_test(open_meshes_bake),
        cmocka_unit_test(missing_face_is_noticed),
        cmocka_unit_test(fallback_is_the_first_exit),
        cmocka_unit_test(overlapping_shells_are_reported),
        cmocka_unit_test(broken_calls),
        cmocka_unit_test(snorm8_is_close_to_float),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
