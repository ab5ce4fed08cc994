/* Diffuse transfer against closed forms: no shadow, convex bodies, a disc overhead, light inside
 * a sphere with a hole. */
#include "shapes.h"

#include <diaphan/environment.h>
#include <diaphan/transfer.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static struct dph_transfer bake(const struct dph_mesh *mesh, const struct dph_transfer_params *params)
{
    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct dph_transfer transfer;
    struct dph_error err = {0};
    struct dph_transfer_report report;
    if (!dph_transfer_bake(&input, params, &transfer, &report, &err))
        fail_msg("%s", err.message);
    return transfer;
}

static struct dph_transfer_params diffuse(enum dph_transfer_kind kind, int directions)
{
    struct dph_transfer_params params = dph_transfer_defaults();
    params.kind = kind;
    params.directions = directions;
    params.albedo[0] = .8, params.albedo[1] = .5, params.albedo[2] = .2;
    return params;
}

/* Against the integral of the clamped cosine over very many directions, and a sphere's normals. */
static void unshadowed_is_the_cosine(void **state)
{
    (void)state;
    enum { N = 65536 };
    float *direction = malloc(3 * N * sizeof *direction);
    assert_non_null(direction);
    dph_sh_directions(N, direction);
    struct dph_mesh mesh = make_sphere(2, 24, 12);
    struct dph_transfer_params params = diffuse(DPH_TRANSFER_UNSHADOWED, 1024);
    struct dph_transfer t = bake(&mesh, &params);
    assert_int_equal(t.npos, mesh.nvert);
    assert_int_equal(t.length, 108);
    double area = 0;
    for (size_t p = 0; p < t.npos; p++)
        area += t.area[p];
    assert_float_equal(area, 16 * PI, 16 * PI * .04);
    for (size_t v = 0; v < mesh.nvert; v += 37) {
        double sum[36] = {0}, n[3], y[36];
        for (int k = 0; k < 3; k++)
            n[k] = (double)mesh.position[3 * v + (size_t)k] / 2;
        for (size_t d = 0; d < N; d++) {
            const double s[3] = {direction[3 * d], direction[3 * d + 1], direction[3 * d + 2]};
            double mu = s[0] * n[0] + s[1] * n[1] + s[2] * n[2];
            if (!(mu > 0))
                continue;
            dph_sh_eval(6, s, y);
            for (int i = 0; i < 36; i++)
                sum[i] += 4 * PI / N * mu * y[i];
        }
        /* the normals of a sphere of facets lean toward its poles by a third of a degree */
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 36; i++)
                assert_float_equal(t.vector[t.position_of[v] * t.length + (size_t)(36 * c + i)],
                                   params.albedo[c] / PI * sum[i], .015);
    }
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
    free(direction);
}

static double largest_difference(const struct dph_transfer *a, const struct dph_transfer *b)
{
    double worst = 0;
    assert_int_equal(a->npos * a->length, b->npos * b->length);
    for (size_t i = 0; i < a->npos * a->length; i++)
        worst = fmax(worst, fabs((double)a->vector[i] - (double)b->vector[i]));
    return worst;
}

/* A convex body does not shadow itself: what is left is the quadrature's error and the facets'
 * horizon. */
static void convex_bodies_have_no_shadow(void **state)
{
    (void)state;
    for (uint32_t segments = 48, i = 0; i < 2; segments *= 2, i++) {
        struct dph_mesh mesh = make_sphere(1, segments, segments / 2);
        struct dph_transfer_params params = diffuse(DPH_TRANSFER_UNSHADOWED, 4096);
        struct dph_transfer without = bake(&mesh, &params);
        params.kind = DPH_TRANSFER_SHADOWED;
        struct dph_transfer with = bake(&mesh, &params);
        double worst = largest_difference(&without, &with);
        print_message("sphere of %u segments: shadowed and unshadowed differ by %.5f\n", (unsigned)segments, worst);
        assert_true(worst < (segments == 48 ? .006 : .003));
        /* nothing is seen of itself, either */
        params.kind = DPH_TRANSFER_INTERREFLECTED;
        struct dph_transfer bounced = bake(&mesh, &params);
        assert_true(largest_difference(&with, &bounced) < 1e-6);
        dph_transfer_finish(&without);
        dph_transfer_finish(&with);
        dph_transfer_finish(&bounced);
        dph_mesh_finish(&mesh);
    }
}

/* Adds a disc at height h around the z axis, seen from below, and a square of the ground around
 * the origin. */
static struct dph_mesh make_roof(double radius, double h, uint32_t segments)
{
    struct dph_mesh mesh = make_room(segments + 6, segments + 4);
    uint32_t top = add_vertex(&mesh, 0, 0, h), centre, base;
    for (uint32_t s = 0; s < segments; s++)
        add_vertex(&mesh, radius * cos(2 * PI * s / segments), radius * sin(2 * PI * s / segments), h);
    for (uint32_t s = 0; s < segments; s++)
        add_triangle(&mesh, top, top + 1 + (s + 1) % segments, top + 1 + s);
    centre = add_vertex(&mesh, 0, 0, 0);
    base = add_vertex(&mesh, -.1, -.1, 0);
    add_vertex(&mesh, .1, -.1, 0);
    add_vertex(&mesh, .1, .1, 0);
    add_vertex(&mesh, -.1, .1, 0);
    for (uint32_t s = 0; s < 4; s++)
        add_triangle(&mesh, centre, base + s, base + (s + 1) % 4);
    return mesh;
}

/* A disc overhead takes the cap cos > c from the hemisphere: E_l0 = 2 pi integral from 0 to c of
 * t y_l0(t) dt. */
static void a_disc_overhead(void **state)
{
    (void)state;
    for (double h = .5; h <= 2; h *= 2) {
        struct dph_mesh mesh = make_roof(1, h, 256);
        struct dph_transfer_params params = diffuse(DPH_TRANSFER_IRRADIANCE, 16384);
        struct dph_transfer t = bake(&mesh, &params);
        assert_int_equal(t.channels, 1);
        const float *e = t.vector + 257 * t.length; /* the ground's centre */
        double c = h / sqrt(1 + h * h);
        enum { STEPS = 20000 };
        for (int i = 0; i < 36; i++) {
            int l = (int)sqrt(i + .5);
            double want = 0;
            if (i == l * (l + 1))
                for (int k = 0; k < STEPS; k++) {
                    const double z = c * (k + .5) / STEPS, s[3] = {sqrt(1 - z * z), 0, z};
                    double y[36];
                    dph_sh_eval(6, s, y);
                    want += 2 * PI * c / STEPS * z * y[i];
                }
            assert_float_equal(e[i], want, .006);
        }
        dph_transfer_finish(&t);
        dph_mesh_finish(&mesh);
    }
}

/* A sphere seen from inside, without its top rings: light enters by the hole. From any point in
 * a sphere every part of it takes cos/pi of the view in proportion to its area, so a bounce is
 * the mean of what is on the wall: T_1 = sum A T_0 / (4 pi R^2), the same everywhere. */
static void light_inside_a_sphere(void **state)
{
    (void)state;
    enum { S = 96, RINGS = 48, OPEN = 12 };
    const double radius = 3;
    struct dph_mesh mesh = make_room((RINGS - 1) * S + 2, 2 * S * (RINGS - 1));
    add_sphere(&mesh, radius, S, RINGS, true);
    size_t kept = 0;
    double cut = radius * cos(PI * OPEN / RINGS) + 1e-4;
    for (size_t i = 0; i < mesh.ntri; i++) {
        const uint32_t *c = mesh.index + 3 * i;
        if ((double)mesh.position[3 * c[0] + 2] < cut && (double)mesh.position[3 * c[1] + 2] < cut &&
            (double)mesh.position[3 * c[2] + 2] < cut)
            memmove(mesh.index + 3 * kept++, c, 3 * sizeof *c);
    }
    mesh.ntri = kept;
    struct dph_transfer_params params = diffuse(DPH_TRANSFER_SHADOWED, 4096);
    params.albedo[0] = params.albedo[1] = params.albedo[2] = 1;
    struct dph_transfer direct = bake(&mesh, &params);
    params.kind = DPH_TRANSFER_INTERREFLECTED;
    params.bounces = 1;
    struct dph_transfer one = bake(&mesh, &params);
    params.bounces = 3;
    params.albedo[1] = .5;
    struct dph_transfer three = bake(&mesh, &params);
    double mean[36] = {0}, scale = 0, worst = 0, holds = 0;
    for (size_t p = 0; p < direct.npos; p++) {
        holds += direct.area[p] / (4 * PI * radius * radius);
        for (int i = 0; i < 36; i++)
            mean[i] += direct.area[p] * direct.vector[p * 108 + (size_t)i] / (4 * PI * radius * radius);
    }
    for (int i = 0; i < 36; i++)
        scale = fmax(scale, fabs(mean[i]));
    for (size_t p = 0; p < direct.npos; p++) {
        if (!(direct.area[p] > 0) || (double)mesh.position[3 * p + 2] > cut - .5) /* not the rim and the lost vertices */
            continue;
        for (size_t i = 0; i < 36; i++) {
            worst = fmax(worst, fabs((double)one.vector[p * 108 + i] - (double)direct.vector[p * 108 + i] - mean[i]));
            /* bounces k + 1 follow k by the share of the sphere that is there; green has its
             * albedo's powers */
            double term = mean[i];
            double red = (double)direct.vector[p * 108 + i] + term * (1 + holds + holds * holds);
            double green = (double)direct.vector[p * 108 + i] / 2 + term * (.25 + .125 * holds + .0625 * holds * holds);
            assert_float_equal(three.vector[p * 108 + i], red, .03 * scale);
            assert_float_equal(three.vector[p * 108 + 36 + i], green, .03 * scale);
        }
    }
    print_message("light inside a sphere: a bounce is off by %.4f of its largest coefficient\n", worst / scale);
    assert_true(worst < .015 * scale);
    dph_transfer_finish(&direct);
    dph_transfer_finish(&one);
    dph_transfer_finish(&three);
    dph_mesh_finish(&mesh);
}

/* No light at all inside a closed box. Along its edges, where the mean normal looks past a wall,
 * only matter around the box would keep light out, and a box turned inside out has none that
 * ends. */
static void closed_boxes_are_dark(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_box(1, 2, 3, 4);
    dph_mesh_flip(&mesh);
    struct dph_transfer_params params = diffuse(DPH_TRANSFER_SHADOWED, 1024);
    struct dph_transfer t = bake(&mesh, &params);
    size_t looked_at = 0;
    for (size_t v = 0; v < mesh.nvert; v++) {
        int walls = 0;
        for (size_t k = 0; k < 3; k++)
            walls += mesh.position[3 * v + k] == 0 || mesh.position[3 * v + k] == (float)(k + 1);
        looked_at += walls == 1;
        for (size_t i = 0; i < t.length && walls == 1; i++)
            assert_true(t.vector[t.position_of[v] * t.length + i] == 0);
    }
    assert_int_equal(looked_at, 6 * 9);
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

/* Fresnel's factor at the entry takes what it takes of even light: 1 - Fdr seen from outside,
 * .939 for 1.3 and .908 for 1.5. */
static void fresnel_at_the_entry(void **state)
{
    (void)state;
    static const double index[2] = {1.3, 1.5}, passes[2] = {.939, .908};
    struct dph_mesh mesh = make_sphere(1, 64, 32);
    struct dph_transfer_params params = diffuse(DPH_TRANSFER_IRRADIANCE, 1024);
    for (int k = 0; k < 2; k++) {
        params.ior = index[k];
        struct dph_transfer t = bake(&mesh, &params);
        for (size_t p = 0; p < t.npos; p++)
            assert_float_equal((double)t.vector[p * 36] * sqrt(4 * PI) / PI, passes[k], .004);
        dph_transfer_finish(&t);
    }
    dph_mesh_finish(&mesh);
}

/* A folded shell: shadows, bounces, inside and outside. */
static struct dph_mesh make_shell(void)
{
    struct dph_mesh mesh = make_room(2 * (23 * 32 + 2), 4 * 32 * 23);
    add_sphere(&mesh, 1, 32, 24, false);
    add_sphere(&mesh, .8f, 32, 24, true);
    for (size_t v = 0; v < mesh.nvert; v++)
        mesh.position[3 * v] += .4f * mesh.position[3 * v + 2] * mesh.position[3 * v + 2];
    return mesh;
}

static void equal_bytes(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_shell();
    for (int kind = 0; kind <= DPH_TRANSFER_IRRADIANCE; kind++) {
        struct dph_transfer_params params = diffuse((enum dph_transfer_kind)kind, 256);
        params.scattering[1] = 5;
        params.absorption[1] = .2;
        params.threads = 1;
        struct dph_transfer first = bake(&mesh, &params);
        for (int threads = 2; threads <= 8; threads *= 2)
            for (int portable = 0; portable < 2; portable++) {
                params.threads = threads;
                params.portable = portable;
                struct dph_transfer again = bake(&mesh, &params);
                assert_memory_equal(first.vector, again.vector, first.npos * first.length * sizeof(float));
                dph_transfer_finish(&again);
            }
        dph_transfer_finish(&first);
    }
    dph_mesh_finish(&mesh);
}

static bool stop_at_half(void *user, double fraction)
{
    double *last = user;
    assert_true(fraction >= *last && fraction <= 1);
    *last = fraction;
    return fraction < .5;
}

static void errors(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_box(1, 1, 1, 2);
    struct dph_bake_input input = {mesh.position, 0, mesh.nvert, mesh.index, mesh.ntri};
    struct dph_transfer t;
    struct dph_error err;
    static const struct {
        size_t offset;
        int value;
    } wrong[] = {{offsetof(struct dph_transfer_params, bands), 9}, {offsetof(struct dph_transfer_params, bands), 0},
                 {offsetof(struct dph_transfer_params, directions), 8}, {offsetof(struct dph_transfer_params, bounces), 0},
                 {offsetof(struct dph_transfer_params, kind), 17}};
    for (size_t n = 0; n < sizeof wrong / sizeof *wrong; n++) {
        struct dph_transfer_params params = dph_transfer_defaults();
        memcpy((char *)&params + wrong[n].offset, &wrong[n].value, sizeof(int));
        assert_false(dph_transfer_bake(&input, &params, &t, NULL, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        assert_null(t.vector);
    }
    for (int n = 0; n < 4; n++) {
        struct dph_transfer_params params = dph_transfer_defaults();
        double *field[4] = {&params.ior, &params.albedo[1], &params.scattering[2], &params.absorption[0]};
        *field[n] = n == 1 ? 1.5 : -1;
        assert_false(dph_transfer_bake(&input, &params, &t, NULL, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    }
    for (int kind = 0; kind <= DPH_TRANSFER_IRRADIANCE; kind++) {
        double last = 0;
        struct dph_transfer_params params = diffuse((enum dph_transfer_kind)kind, 64);
        params.progress = stop_at_half;
        params.progress_user = &last;
        assert_false(dph_transfer_bake(&input, &params, &t, NULL, &err));
        assert_int_equal(err.code, DPH_ERROR_CANCELLED);
        assert_null(t.vector);
        /* nothing to bake */
        const struct dph_bake_input empty = {mesh.position, 0, 0, mesh.index, 0};
        params.progress = NULL;
        assert_true(dph_transfer_bake(&empty, &params, &t, NULL, &err));
        assert_int_equal(t.npos, 0);
        dph_transfer_finish(&t);
    }
    mesh.index[5] = 1000000;
    struct dph_transfer_params params = dph_transfer_defaults();
    assert_false(dph_transfer_bake(&input, &params, &t, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    dph_mesh_finish(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unshadowed_is_the_cosine), cmocka_unit_test(convex_bodies_have_no_shadow),
        cmocka_unit_test(a_disc_overhead), cmocka_unit_test(light_inside_a_sphere),
        cmocka_unit_test(closed_boxes_are_dark), cmocka_unit_test(fresnel_at_the_entry),
        cmocka_unit_test(equal_bytes), cmocka_unit_test(errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
