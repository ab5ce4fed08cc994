/* The grid of clearances against distances by brute force: never above, and not much below. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "shapes.h"
#include "trace/clearance.h"

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Distance to the segment from `a` along `edge`. */
static double to_segment(const double point[3], const double a[3], const double edge[3])
{
    double from[3], square = dot(edge, edge);
    for (int k = 0; k < 3; k++)
        from[k] = point[k] - a[k];
    double t = square > 0 ? fmin(fmax(dot(from, edge) / square, 0), 1) : 0;
    for (int k = 0; k < 3; k++)
        from[k] -= t * edge[k];
    return sqrt(dot(from, from));
}

static double to_triangle(const double point[3], double corner[3][3])
{
    double edge[3][3], normal[3], least = INFINITY;
    bool above = true;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            edge[i][k] = corner[(i + 1) % 3][k] - corner[i][k];
    for (int k = 0; k < 3; k++)
        normal[k] = edge[0][(k + 1) % 3] * edge[1][(k + 2) % 3] -
                    edge[0][(k + 2) % 3] * edge[1][(k + 1) % 3];
    for (int i = 0; i < 3; i++) {
        double inward[3], from[3];
        for (int k = 0; k < 3; k++) {
            inward[k] = normal[(k + 1) % 3] * edge[i][(k + 2) % 3] -
                        normal[(k + 2) % 3] * edge[i][(k + 1) % 3];
            from[k] = point[k] - corner[i][k];
        }
        above = above && dot(inward, from) >= 0;
        least = fmin(least, to_segment(point, corner[i], edge[i]));
        if (i == 2 && above && dot(normal, normal) > 0)
            least = fmin(least, fabs(dot(normal, from)) / sqrt(dot(normal, normal)));
    }
    return least;
}

static double brute_force(const struct dph_mesh *mesh, const double point[3])
{
    double least = INFINITY;
    for (size_t t = 0; t < mesh->ntri; t++) {
        double corner[3][3];
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                corner[i][k] =
                    (double)mesh->position[3 * (size_t)mesh->index[3 * t + (size_t)i] + (size_t)k];
        least = fmin(least, to_triangle(point, corner));
    }
    return least;
}

static void check(const char *what, struct dph_mesh mesh, double cell, int tightness)
{
    struct dph_clearance grid, again;
    assert_true(dph_clearance_init(&grid, mesh.position, mesh.nvert, mesh.index, mesh.ntri, cell, 1,
                                   NULL));
    assert_true(dph_clearance_init(&again, mesh.position, mesh.nvert, mesh.index, mesh.ntri, cell,
                                   3, NULL));
    size_t count = (size_t)grid.size[0] * (size_t)grid.size[1] * (size_t)grid.size[2];
    assert_memory_equal(grid.bound, again.bound, count);
    double most = 0, sum = 0;
    uint64_t seed = 3;
    int points = UNDER_SANITIZER ? 500 : 5000;
    for (int i = 0; i < points; i++) {
        double point[3];
        for (int k = 0; k < 3; k++)
            point[k] = grid.low[k] + (1.1 * next_random(&seed) - .05) * grid.size[k] * grid.cell;
        ptrdiff_t at = dph_clearance_cell(&grid, point);
        if (at < 0)
            continue;
        double bound = grid.bound[at] * grid.unit, distance = brute_force(&mesh, point);
        assert_true(bound <= distance);
        if (grid.bound[at] < UINT8_MAX)
            most = fmax(most, (distance - bound) / grid.cell);
        sum += bound / distance;
    }
    printf("    %-28s %d x %d x %d cells, at most %.2f cells below, %.2f of the distance\n", what,
           grid.size[0], grid.size[1], grid.size[2], most, sum / points);
    if (tightness)
        assert_true(most < tightness);
    dph_clearance_finish(&grid);
    dph_clearance_finish(&again);
    dph_mesh_finish(&mesh);
}

static void bounds_hold(void **state)
{
    (void)state;
    check("sphere", make_sphere(1, 24, 12), .05, 4);
    check("sphere, finely", make_sphere(3, 48, 24), 0, 4);
    check("sphere, coarsely", make_sphere(1, 24, 12), .7, 4);
    check("sphere, cells without limit", make_sphere(1, 24, 12), INFINITY, 4);
    check("box of 12 triangles", make_box(1, 2, 40, 1), .3, 4);
    struct dph_mesh shell = make_room(3000, 6000);
    add_sphere(&shell, 1, 24, 12, false);
    add_sphere(&shell, .9, 24, 12, true);
    check("shell", shell, .03, 4);

    /* needles and sheets in all directions; some without area */
    uint64_t seed = 9;
    struct dph_mesh mess = make_room(300, 100);
    for (size_t t = 0; t < 100; t++)
        for (size_t i = 0; i < 3; i++) {
            double d[3], e[3];
            random_direction(&seed, d);
            random_direction(&seed, e);
            for (size_t k = 0; k < 3; k++)
                mess.position[9 * t + 3 * i + k] =
                    (float)(i == 1 && t % 3 ? (double)mess.position[9 * t + k] + .01 * d[k]
                                            : d[k] + e[k] * .3);
            mess.index[3 * t + i] = (uint32_t)(3 * t + (t % 7 || i < 2 ? i : 0));
        }
    mess.nvert = 300, mess.ntri = 100;
    check("triangles anyhow", mess, .04, 4);
}

static void nothing_has_no_clearance(void **state)
{
    (void)state;
    static const float same[9] = {1, 2, 3, 1, 2, 3, 1, 2, 3};
    static const uint32_t index[3] = {0, 1, 2};
    static const double point[3] = {1, 2, 3}, beyond[3] = {NAN, 0, INFINITY};
    struct dph_clearance grid;
    assert_true(dph_clearance_init(&grid, NULL, 0, NULL, 0, 1, 1, NULL));
    assert_true(dph_clearance_cell(&grid, point) < 0);
    dph_clearance_finish(&grid);
    assert_true(dph_clearance_init(&grid, same, 3, index, 1, 1, 1, NULL));
    assert_true(dph_clearance_cell(&grid, point) < 0);
    dph_clearance_finish(&grid);
    struct dph_mesh box = make_box(1, 1, 1, 1);
    assert_true(dph_clearance_init(&grid, box.position, box.nvert, box.index, box.ntri, .1, 1,
                                   NULL));
    assert_true(dph_clearance_cell(&grid, beyond) < 0);
    assert_true(dph_clearance_cell(&grid, point) < 0);
    dph_clearance_finish(&grid);
    dph_mesh_finish(&box);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bounds_hold),
        cmocka_unit_test(nothing_has_no_clearance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
