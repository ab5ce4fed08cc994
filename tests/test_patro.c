/* Changed normals: the limits, planes, spheres, bumps, edges, thin sheets, brute force. */
#include "shapes.h"

#include "bake/dipole.h"

#include <diaphan/patro.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static float *blur(const struct dph_mesh *mesh, const float *normal, const struct dph_patro_params *params,
                   struct dph_patro_report *report)
{
    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct dph_error err = {0};
    float *out = malloc(mesh->nvert * 3 * sizeof *out);
    assert_non_null(out);
    if (!dph_patro_normals(&input, normal, params, out, report, &err))
        fail_msg("%s", err.message);
    return out;
}

static struct dph_patro_params kernel(enum dph_patro_kernel kind, double distance)
{
    struct dph_patro_params params = dph_patro_defaults();
    params.kernel = kind;
    params.distance = distance;
    params.most_distance = 0;
    params.scattering = 3 / distance; /* 1 / transport = distance: 3 a (a + s) = 1 / distance^2 */
    params.absorption = (sqrt(9 + 4 / 3.) - 3) / (2 * distance);
    return params;
}

static double length_of(const float *n)
{
    return sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
}

static void short_distances_change_nothing(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 32, 16);
    float *normal = malloc(mesh.nvert * 3 * sizeof *normal);
    assert_non_null(normal);
    for (size_t v = 0; v < mesh.nvert; v++) { /* some that are not the surface's */
        normal[3 * v] = .6f, normal[3 * v + 1] = v % 2 ? .8f : -.8f, normal[3 * v + 2] = 0;
    }
    for (int kind = 0; kind <= DPH_PATRO_GAUSS; kind++) {
        double before = 1;
        for (double distance = .01; distance > 1e-9; distance /= 30) {
            struct dph_patro_params params = kernel((enum dph_patro_kernel)kind, distance);
            float *out = blur(&mesh, normal, &params, NULL);
            double worst = 0;
            for (size_t i = 0; i < 3 * mesh.nvert; i++)
                worst = fmax(worst, fabs((double)out[i] - (double)normal[i]));
            assert_true(worst <= before + 1e-6);
            before = worst;
            free(out);
        }
        assert_true(before < 1e-6);
        struct dph_patro_params params = kernel((enum dph_patro_kernel)kind, 1);
        params.distance = 0;
        float *out = blur(&mesh, normal, &params, NULL);
        assert_memory_equal(out, normal, mesh.nvert * 3 * sizeof *out);
        free(out);
    }
    free(normal);
    dph_mesh_finish(&mesh);
}

static void planes_stay(void **state)
{
    (void)state;
    enum { N = 30 };
    struct dph_mesh mesh = make_room((N + 1) * (N + 1), 2 * N * N);
    for (uint32_t j = 0; j <= N; j++)
        for (uint32_t i = 0; i <= N; i++)
            add_vertex(&mesh, i, j * 1.5, 0);
    for (uint32_t j = 0; j < N; j++)
        for (uint32_t i = 0; i < N; i++) {
            uint32_t a = j * (N + 1) + i;
            add_triangle(&mesh, a, a + 1, a + N + 2);
            add_triangle(&mesh, a, a + N + 2, a + N + 1);
        }
    for (int kind = 0; kind <= DPH_PATRO_GAUSS; kind++) {
        struct dph_patro_params params = kernel((enum dph_patro_kernel)kind, 3);
        float *out = blur(&mesh, NULL, &params, NULL);
        for (size_t v = 0; v < mesh.nvert; v++) {
            assert_float_equal(out[3 * v], 0, 1e-6);
            assert_float_equal(out[3 * v + 2], 1, 1e-6);
        }
        free(out);
    }
    dph_mesh_finish(&mesh);
}

static double kernel_at(const struct dph_patro_params *p, double r)
{
    struct dph_dipole d;
    if (p->kernel == DPH_PATRO_EXP)
        return exp(-r / p->distance) / r;
    if (p->kernel == DPH_PATRO_GAUSS)
        return exp(-r * r / (2 * p->distance * p->distance));
    dph_dipole_init(&d, p->scattering, p->absorption, 1);
    return dph_dipole_at(&d, r);
}

/* On a sphere normals keep their direction; their length is the kernel's first zonal coefficient
 * over its zeroth, K at the chord, cut at three distances. */
static void spheres(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(2, 160, 80);
    for (int kind = 0; kind <= DPH_PATRO_GAUSS; kind++)
        for (double distance = .25; distance <= 1; distance *= 2) {
            struct dph_patro_params params = kernel((enum dph_patro_kernel)kind, distance);
            struct dph_patro_report report;
            float *out = blur(&mesh, NULL, &params, &report);
            double first = 0, zeroth = 0, shortest = 2, longest = 0;
            enum { STEPS = 40000 };
            for (int k = 0; k < STEPS; k++) {
                double t = PI * (k + .5) / STEPS, chord = 4 * sin(t / 2);
                if (chord > 3 * distance)
                    break;
                first += kernel_at(&params, chord) * sin(t) * cos(t);
                zeroth += kernel_at(&params, chord) * sin(t);
            }
            for (size_t v = 0; v < mesh.nvert; v++) {
                const float *n = out + 3 * v, *p = mesh.position + 3 * v;
                double length = length_of(n);
                shortest = fmin(shortest, length);
                longest = fmax(longest, length);
                for (int k = 0; k < 3; k++)
                    assert_float_equal((double)n[k] / length, (double)p[k] / 2, .01);
            }
            print_message("kernel %d, distance %.2f R: length %.4f to %.4f, in closed form %.4f\n", kind, distance / 2,
                          shortest, longest, first / zeroth);
            assert_float_equal(shortest, first / zeroth, .015);
            assert_float_equal(longest, first / zeroth, .015);
            assert_float_equal(report.shortest, shortest, 1e-6);
            free(out);
            params.keep_length = false;
            out = blur(&mesh, NULL, &params, NULL);
            for (size_t v = 0; v < mesh.nvert; v++)
                assert_float_equal(length_of(out + 3 * v), 1, 1e-6);
            free(out);
        }
    dph_mesh_finish(&mesh);
}

/* Every neighbour for itself, from the definition; samples are denser than the distance, so that
 * points do. */
static void brute_force(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 128, 64);
    size_t n = mesh.nvert;
    for (size_t v = 0; v < n; v++) /* flat, so that its two sides are near each other */
        mesh.position[3 * v + 2] *= .3f;
    float *normal = malloc(n * 3 * sizeof *normal);
    double *area = calloc(n, sizeof *area);
    assert_true(normal && area);
    dph_mesh_position_normals(mesh.position, n, mesh.index, mesh.ntri, normal);
    for (size_t t = 0; t < mesh.ntri; t++) {
        const float *p[3];
        double a[3], b[3];
        for (int k = 0; k < 3; k++)
            p[k] = mesh.position + 3 * (size_t)mesh.index[3 * t + (size_t)k];
        for (int k = 0; k < 3; k++)
            a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k];
        double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
        for (int k = 0; k < 3; k++)
            area[mesh.index[3 * t + (size_t)k]] += sqrt(x * x + y * y + z * z) / 6;
    }
    for (int same_side = 0; same_side < 2; same_side++) {
        struct dph_patro_params params = kernel(DPH_PATRO_GAUSS, .4);
        params.same_side = same_side;
        float *out = blur(&mesh, NULL, &params, NULL);
        for (size_t v = 5; v < n; v += 211) {
            double sum[3] = {0}, weight = 0;
            for (size_t q = 0; q < n; q++) {
                double r2 = 0, facing = 0;
                for (size_t k = 0; k < 3; k++) {
                    r2 += pow((double)mesh.position[3 * v + k] - (double)mesh.position[3 * q + k], 2);
                    facing += (double)normal[3 * v + k] * (double)normal[3 * q + k];
                }
                if (r2 > 1.44 || (same_side && !(facing > 0)))
                    continue;
                double w = area[q] * kernel_at(&params, sqrt(r2));
                weight += w;
                for (size_t k = 0; k < 3; k++)
                    sum[k] += w * (double)normal[3 * q + k];
            }
            for (size_t k = 0; k < 3; k++)
                assert_float_equal(out[3 * v + k], sum[k] / weight, .012);
        }
        free(out);
    }
    free(normal);
    free(area);
    dph_mesh_finish(&mesh);
}

/* The bumps of a rough sphere's normals fall as light scatters farther. */
static void bumps_fall(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 96, 48);
    uint64_t seed = 11;
    float *normal = malloc(mesh.nvert * 3 * sizeof *normal);
    assert_non_null(normal);
    for (size_t v = 0; v < mesh.nvert; v++) {
        for (size_t k = 0; k < 3; k++)
            normal[3 * v + k] = mesh.position[3 * v + k] + (float)(.6 * (next_random(&seed) - .5));
        double length = length_of(normal + 3 * v);
        for (size_t k = 0; k < 3; k++)
            normal[3 * v + k] = (float)((double)normal[3 * v + k] / length);
    }
    for (int kind = 0; kind <= DPH_PATRO_GAUSS; kind++) {
        double before = INFINITY;
        for (double distance = .01; distance < .5; distance *= 2) {
            struct dph_patro_params params = kernel((enum dph_patro_kernel)kind, distance);
            params.keep_length = false;
            float *out = blur(&mesh, normal, &params, NULL);
            double sum = 0;
            for (size_t i = 0; i < 3 * mesh.nvert; i++)
                sum += pow((double)out[i] - (double)mesh.position[i], 2);
            assert_true(sum < before);
            before = sum;
            free(out);
        }
        assert_true(sqrt(before / (double)mesh.nvert) < .08);
    }
    free(normal);
    dph_mesh_finish(&mesh);
}

/* A cube's normals tilt near its edges only; its edges, split in the mesh, become smooth. */
static void cubes_tilt_at_edges(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_box(1, 1, 1, 40);
    struct dph_patro_params params = kernel(DPH_PATRO_GAUSS, .05);
    float *out = blur(&mesh, NULL, &params, NULL);
    size_t on_edges = 0;
    for (size_t v = 0; v < mesh.nvert; v++) {
        const float *p = mesh.position + 3 * v, *n = out + 3 * v;
        double distance = 1;
        if (p[2] != 1)
            continue;
        for (int k = 0; k < 2; k++)
            distance = fmin(distance, fmin((double)p[k], 1 - (double)p[k]));
        if (distance > .155)
            assert_float_equal(n[2], 1, 1e-5);
        else if (distance < .02) {
            assert_true((double)n[2] / length_of(n) < .85);
            on_edges++;
        } else
            assert_true(n[2] > .25f);
    }
    assert_true(on_edges > 100);
    free(out);
    dph_mesh_finish(&mesh);
}

/* Both sides of a sheet much thinner than the distance cancel, down to the floor; with same_side
 * they do not see each other. */
static void thin_sheets(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_box(1, 1, .0005, 30);
    struct dph_patro_params params = kernel(DPH_PATRO_GAUSS, .1);
    struct dph_patro_report report;
    float *out = blur(&mesh, NULL, &params, &report);
    assert_true(report.shortest < .02);
    for (size_t v = 0; v < mesh.nvert; v++)
        assert_true(length_of(out + 3 * v) > .0499);
    free(out);
    params.same_side = true;
    out = blur(&mesh, NULL, &params, NULL);
    for (size_t v = 0; v < mesh.nvert; v++) {
        const float *p = mesh.position + 3 * v;
        if (p[2] > 0 && p[0] > .1f && p[0] < .9f && p[1] > .1f && p[1] < .9f)
            assert_true(out[3 * v + 2] > .98f);
    }
    free(out);
    dph_mesh_finish(&mesh);
}

static bool cancel(void *user, double fraction)
{
    (void)user;
    return fraction < .5;
}

static void bytes_and_errors(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_cylinder(1, 3, 64, 32);
    for (int same_side = 0; same_side < 2; same_side++) {
        struct dph_patro_params params = dph_patro_defaults();
        struct dph_patro_report report;
        dph_patro_set_medium(&params, 1.5, .0035, 2);
        params.same_side = same_side;
        assert_float_equal(params.distance, 1 / sqrt(3 * .007 * 3.007), 1e-9);
        params.threads = 1;
        float *first = blur(&mesh, NULL, &params, &report);
        assert_float_equal(report.distance, .1 * sqrt(4 + 4 + 9), 1e-3);
        for (int n = 0; n < 3; n++) {
            params.threads = n == 2 ? 8 : 2;
            params.portable = n == 1;
            float *again = blur(&mesh, NULL, &params, NULL);
            assert_memory_equal(first, again, mesh.nvert * 3 * sizeof *first);
            free(again);
        }
        free(first);
    }
    struct dph_bake_input input = {mesh.position, 0, mesh.nvert, mesh.index, mesh.ntri};
    struct dph_error err;
    float *out = malloc(mesh.nvert * 3 * sizeof *out);
    struct dph_patro_params params = kernel(DPH_PATRO_EXP, .1);
    params.progress = cancel;
    assert_false(dph_patro_normals(&input, NULL, &params, out, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_CANCELLED);
    params.progress = NULL;
    params.distance = -1;
    assert_false(dph_patro_normals(&input, NULL, &params, out, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    params = dph_patro_defaults();
    dph_patro_set_medium(&params, 1, 0, 1); /* no absorption: the limit decides */
    assert_true(dph_patro_normals(&input, NULL, &params, out, NULL, &err));
    mesh.index[7] = 99999;
    assert_false(dph_patro_normals(&input, NULL, &params, out, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    free(out);
    dph_mesh_finish(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(short_distances_change_nothing), cmocka_unit_test(planes_stay), cmocka_unit_test(spheres),
        cmocka_unit_test(brute_force), cmocka_unit_test(bumps_fall), cmocka_unit_test(cubes_tilt_at_edges),
        cmocka_unit_test(thin_sheets), cmocka_unit_test(bytes_and_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
