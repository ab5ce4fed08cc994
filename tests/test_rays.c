/* Rays through Embree against closed forms: a box, a sphere, nested spheres; and the state of the
 * calling thread. */
#include <diaphan/trace.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#if defined(__SSE2__)
#include <pmmintrin.h>
#endif

static const double PI = 3.14159265358979323846;

static const float box_position[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0},
                                         {0, 0, 3}, {1, 0, 3}, {1, 2, 3}, {0, 2, 3}};
static const uint32_t box_index[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7},
                                          {0, 1, 5}, {0, 5, 4}, {3, 7, 6}, {3, 6, 2},
                                          {0, 4, 7}, {0, 7, 3}, {1, 2, 6}, {1, 6, 5}};

/* A direction per number, spread over the sphere; none lies in a plane of the axes, where the rays
 * would run along edges. */
static void spread(int i, int count, float direction[3])
{
    double z = 1.0 - (2.0 * i + 1.0) / count, r = sqrt(1.0 - z * z),
           a = 2.39996322972865332 * i + 0.1;
    direction[0] = (float)(r * cos(a));
    direction[1] = (float)(r * sin(a));
    direction[2] = (float)z;
}

/* From a corner into the box the exit is the nearest of the three far faces; elsewhere the ray
 * leaves at once. */
static void box_corners_in_closed_form(void **state)
{
    (void)state;
    const double side[3] = {1, 2, 3};
    for (int power = -6; power <= 6; power += 6) {
        double scale = pow(10.0, power);
        float position[8][3];
        for (int v = 0; v < 8; v++)
            for (int k = 0; k < 3; k++)
                position[v][k] = (float)(scale * (double)box_position[v][k]);
        struct dph_rays *rays = dph_rays_create(&position[0][0], 8, &box_index[0][0], 12, NULL);
        assert_non_null(rays);
        for (int i = 0; i < 1000; i++) {
            float direction[3], first[8], inside[8], farthest[8];
            int balance[8];
            const uint32_t origin[8] = {0, 1, 2, 3, 4, 5, 6, 7};
            spread(i, 1000, direction);
            dph_rays_thickness(rays, DPH_THICKNESS_FIRST, origin, 8, direction, first, NULL);
            dph_rays_thickness(rays, DPH_THICKNESS_FARTHEST, origin, 8, direction, farthest, NULL);
            dph_rays_thickness(rays, DPH_THICKNESS_INSIDE, origin, 8, direction, inside, balance);
            for (int v = 0; v < 8; v++) {
                bool inward = true;
                double exit = INFINITY;
                for (int k = 0; k < 3; k++) {
                    bool high = box_position[v][k] > 0;
                    inward = inward && (high ? direction[k] < 0 : direction[k] > 0);
                    exit = fmin(exit, side[k] / fabs((double)direction[k]));
                }
                double expected = inward ? exit * scale : 0.0;
                assert_float_equal(first[v], expected, 1e-5 * scale);
                assert_float_equal(inside[v], expected, 1e-5 * scale);
                assert_float_equal(farthest[v], expected, 1e-5 * scale);
                assert_int_equal(balance[v], inward ? 1 : 0);
            }
        }
        dph_rays_destroy(rays);
    }
}

enum {
    RINGS = 96,
    SECTORS = 192,
    SPHERE_POSITIONS = 2 + (RINGS - 1) * SECTORS,
    SPHERE_TRIANGLES = 2 * SECTORS * (RINGS - 1)
};

/* A closed sphere of radius r; inward: faces turned inside. Appends at positions `first`. */
static void add_sphere(double r, bool inward, uint32_t first, float *position, uint32_t *index)
{
    for (int i = 1; i < RINGS; i++)
        for (int j = 0; j < SECTORS; j++) {
            double theta = PI * i / RINGS, phi = 2 * PI * j / SECTORS;
            float *p = position + 3 * (first + 2 + (size_t)(i - 1) * SECTORS + j);
            p[0] = (float)(r * sin(theta) * cos(phi));
            p[1] = (float)(r * sin(theta) * sin(phi));
            p[2] = (float)(r * cos(theta));
        }
    const float poles[6] = {0, 0, (float)r, 0, 0, (float)-r};
    memcpy(position + 3 * (size_t)first, poles, sizeof poles);
    size_t t = 0;
    for (uint32_t j = 0; j < SECTORS; j++) {
        uint32_t next = (j + 1) % SECTORS, ring = first + 2, last = ring + (RINGS - 2) * SECTORS;
        uint32_t caps[2][3] = {{first, ring + j, ring + next}, {first + 1, last + next, last + j}};
        memcpy(index + 3 * t, caps, sizeof caps);
        t += 2;
        for (uint32_t i = 0; i + 2 < RINGS; i++) {
            uint32_t a = ring + i * SECTORS + j, b = ring + i * SECTORS + next;
            uint32_t quad[2][3] = {{a, a + SECTORS, b}, {b, a + SECTORS, b + SECTORS}};
            memcpy(index + 3 * t, quad, sizeof quad);
            t += 2;
        }
    }
    assert_int_equal(t, SPHERE_TRIANGLES);
    for (size_t i = 0; inward && i < t; i++) {
        uint32_t swap = index[3 * i + 1];
        index[3 * i + 1] = index[3 * i + 2];
        index[3 * i + 2] = swap;
    }
}

/* A chord of a sphere of radius R from normal n along w is -2 R n.w. */
static void sphere_chords(void **state)
{
    (void)state;
    static float position[3 * SPHERE_POSITIONS];
    static uint32_t index[3 * SPHERE_TRIANGLES], origin[SPHERE_POSITIONS];
    static float thickness[SPHERE_POSITIONS];
    static int balance[SPHERE_POSITIONS];
    add_sphere(2.0, false, 0, position, index);
    struct dph_rays *rays =
        dph_rays_create(position, SPHERE_POSITIONS, index, SPHERE_TRIANGLES, NULL);
    assert_non_null(rays);
    for (uint32_t v = 0; v < SPHERE_POSITIONS; v++)
        origin[v] = v;
    for (int i = 0; i < 20; i++) {
        float w[3];
        spread(i, 20, w);
        dph_rays_thickness(rays, DPH_THICKNESS_INSIDE, origin, SPHERE_POSITIONS, w, thickness,
                           balance);
        for (size_t v = 0; v < SPHERE_POSITIONS; v++) {
            const float *n = position + 3 * v;
            double chord = -2 * (double)(n[0] * w[0] + n[1] * w[1] + n[2] * w[2]);
            if (fabs(chord) < 0.2) /* the facets around the origin decide on grazing rays */
                continue;
            assert_int_equal(balance[v], chord > 0 ? 1 : 0);
            assert_float_equal(thickness[v], chord > 0 ? chord : 0.0, 0.02);
        }
    }

    /* all at once, on two threads: the same numbers */
    enum { COUNT = 3 };
    float w[COUNT][3], *all = malloc(COUNT * sizeof thickness);
    assert_non_null(all);
    for (int i = 0; i < COUNT; i++)
        spread(i, COUNT, w[i]);
    dph_rays_thickness_all(rays, DPH_THICKNESS_FIRST, &w[0][0], COUNT, 2, all);
    for (int i = 0; i < COUNT; i++) {
        dph_rays_thickness(rays, DPH_THICKNESS_FIRST, origin, SPHERE_POSITIONS, w[i], thickness,
                           NULL);
        assert_memory_equal(all + i * (size_t)SPHERE_POSITIONS, thickness, sizeof thickness);
    }
    free(all);
    dph_rays_destroy(rays);
}

/* A ball of radius 3 with a hollow of radius 2 around a ball of radius 1; from the outer pole
 * straight through the centre: matter 3-2, gap, 2, gap, 1. First exit 1, inside 1 + 2 + 1,
 * farthest 6. */
static void nested_spheres_tell_the_definitions_apart(void **state)
{
    (void)state;
    static float position[3 * 3 * SPHERE_POSITIONS];
    static uint32_t index[3 * 3 * SPHERE_TRIANGLES];
    const double radius[3] = {3, 2, 1};
    for (uint32_t s = 0; s < 3; s++)
        add_sphere(radius[s], s == 1, s * SPHERE_POSITIONS, position,
                   index + 3 * (size_t)s * SPHERE_TRIANGLES);
    struct dph_rays *rays =
        dph_rays_create(position, 3 * SPHERE_POSITIONS, index, 3 * SPHERE_TRIANGLES, NULL);
    assert_non_null(rays);
    /* a little off the axis, where the poles' fans meet */
    double length = sqrt(0.013 * 0.013 + 0.007 * 0.007 + 1);
    const float down[3] = {(float)(0.013 / length), (float)(0.007 / length), (float)(-1 / length)};
    const uint32_t pole = 0;
    float thickness;
    int balance;
    dph_rays_thickness(rays, DPH_THICKNESS_FIRST, &pole, 1, down, &thickness, &balance);
    assert_float_equal(thickness, 1.0, 0.01);
    assert_int_equal(balance, 1);
    dph_rays_thickness(rays, DPH_THICKNESS_INSIDE, &pole, 1, down, &thickness, &balance);
    assert_float_equal(thickness, 4.0, 0.01);
    assert_int_equal(balance, 1);
    dph_rays_thickness(rays, DPH_THICKNESS_FARTHEST, &pole, 1, down, &thickness, &balance);
    assert_float_equal(thickness, 6.0, 0.01);
    assert_int_equal(balance, 1);

    /* from the hollow's wall across the gap: the nearest crossing is an entry into the inner ball */
    const uint32_t wall = SPHERE_POSITIONS;
    dph_rays_thickness(rays, DPH_THICKNESS_FIRST, &wall, 1, down, &thickness, &balance);
    assert_float_equal(thickness, 0.0, 0.0);
    assert_int_equal(balance, -1);
    dph_rays_thickness(rays, DPH_THICKNESS_INSIDE, &wall, 1, down, &thickness, &balance);
    assert_float_equal(thickness, 3.0, 0.01);
    assert_int_equal(balance, 0);
    dph_rays_destroy(rays);
}

static void an_empty_mesh_and_the_state_of_the_thread(void **state)
{
    (void)state;
    const float position[3] = {1, 2, 3}, up[3] = {0, 0, 1};
    const uint32_t origin = 0;
    float thickness = 7;
    int balance = 7;
    struct dph_rays *rays = dph_rays_create(position, 1, NULL, 0, NULL);
    assert_non_null(rays);
#if defined(__SSE2__)
    unsigned int before = _mm_getcsr();
#endif
    dph_rays_thickness(rays, DPH_THICKNESS_INSIDE, &origin, 1, up, &thickness, &balance);
#if defined(__SSE2__)
    assert_int_equal(_mm_getcsr(), before);
#endif
    assert_float_equal(thickness, 0.0, 0.0);
    assert_int_equal(balance, 0);
    dph_rays_destroy(rays);
    dph_rays_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box_corners_in_closed_form),
        cmocka_unit_test(sphere_chords),
        cmocka_unit_test(nested_spheres_tell_the_definitions_apart),
        cmocka_unit_test(an_empty_mesh_and_the_state_of_the_thread),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
