/* The samples of the bake: closed forms first, then a brute force in double precision, then
 * Embree. */
#include "shapes.h"

#include <diaphan/bake.h>
#include <diaphan/scene.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* All three definitions along one direction and its opposite. */
struct samples {
    float *length[3][2]; /* by definition and side (nvert) */
    uint8_t *bad[2];     /* (nvert)                        */
};

static struct samples make_samples(size_t nvert)
{
    struct samples samples;
    for (int side = 0; side < 2; side++) {
        for (int d = 0; d < 3; d++)
            samples.length[d][side] = malloc((nvert + 1) * sizeof(float));
        samples.bad[side] = malloc(nvert + 1);
    }
    return samples;
}

static void free_samples(struct samples *samples)
{
    for (int side = 0; side < 2; side++) {
        for (int d = 0; d < 3; d++)
            free(samples->length[d][side]);
        free(samples->bad[side]);
    }
}

static void sweep(const struct dph_mesh *mesh, const double direction[3], struct samples *samples)
{
    struct dph_bake_input input = {.position = mesh->position, .nvert = mesh->nvert,
                                   .index = mesh->index, .ntri = mesh->ntri};
    struct dph_bake_params params = dph_bake_defaults();
    for (int d = 0; d < 3; d++) {
        params.definition = (enum dph_definition)d;
        struct dph_error err = {0};
        if (!dph_bake_direction(&input, &params, direction, samples->length[d][0], samples->length[d][1],
                                samples->bad[0], samples->bad[1], &err))
            fail_msg("%s", err.message);
    }
}

/* How far p + t d stays in a convex body given by one call a half space: the largest t >= 0 with
 * n . (p + t d) <= h. */
static void clip(double *t, double slope, double room)
{
    if (slope > 0)
        *t = fmin(*t, fmax(room, 0) / slope);
}

static double box_exit(const double size[3], const float *p, const double d[3])
{
    double t = INFINITY;
    for (int k = 0; k < 3; k++) {
        clip(&t, d[k], size[k] - p[k]);
        clip(&t, -d[k], p[k]);
    }
    return t;
}

static void box_in_closed_form(void **state)
{
    (void)state;
    const double size[3] = {1, 2, 0.5};
    struct dph_mesh mesh = make_box(size[0], size[1], size[2], 7);
    struct samples samples = make_samples(mesh.nvert);
    uint64_t seed = 1;
    for (int n = 0; n < 1000; n++) {
        double d[3];
        random_direction(&seed, d);
        sweep(&mesh, d, &samples);
        const double opposite[3] = {-d[0], -d[1], -d[2]};
        for (size_t v = 0; v < mesh.nvert; v++)
            for (int side = 0; side < 2; side++) {
                double expected = box_exit(size, mesh.position + 3 * v, side ? opposite : d);
                assert_int_equal(samples.bad[side][v], 0);
                for (int k = 0; k < 3; k++)
                    assert_true(fabs(samples.length[k][side][v] - expected) < 5e-6);
            }
    }
    free_samples(&samples);
    dph_mesh_finish(&mesh);
}

static void cylinder_in_closed_form(void **state)
{
    (void)state;
    enum { SEGMENTS = 256 };
    const double height = 2.5;
    struct dph_mesh mesh = make_cylinder(1, height, SEGMENTS, 3);
    struct samples samples = make_samples(mesh.nvert);
    uint64_t seed = 2;
    for (int n = 0; n < 1000; n++) {
        double d[3];
        random_direction(&seed, d);
        sweep(&mesh, d, &samples);
        for (int m = 0; m < 40; m++) {
            size_t v = (size_t)(next_random(&seed) * (double)mesh.nvert);
            const float *p = mesh.position + 3 * v;
            for (int side = 0; side < 2; side++) {
                double sign = side ? -1 : 1;
                /* Of the prism that the mesh is: planes through the edges of its base. Its
                 * vertices are rounded, and a ray along a face magnifies that, so the planes are
                 * moved by a little either way. */
                double bound[2] = {INFINITY, INFINITY};
                for (int b = 0; b < 2; b++) {
                    double moved = b ? 3e-7 : -3e-7;
                    clip(&bound[b], sign * d[2], height - p[2] + moved);
                    clip(&bound[b], -sign * d[2], p[2] + moved);
                    for (int s = 0; s < SEGMENTS; s++) {
                        double middle = 2 * PI * (s + 0.5) / SEGMENTS, nx = cos(middle), ny = sin(middle);
                        clip(&bound[b], sign * (nx * d[0] + ny * d[1]),
                             cos(PI / SEGMENTS) - (nx * p[0] + ny * p[1]) + moved);
                    }
                }
                /* of the true cylinder: |p + t d| = 1 across, the farther root */
                double round = INFINITY, a = d[0] * d[0] + d[1] * d[1], b = sign * (p[0] * d[0] + p[1] * d[1]);
                double c = p[0] * p[0] + p[1] * p[1] - 1, root = b * b - a * c;
                clip(&round, sign * d[2], height - p[2]);
                clip(&round, -sign * d[2], p[2]);
                round = fmin(round, root > 0 ? fmax(0, (-b + sqrt(root)) / a) : 0);
                assert_int_equal(samples.bad[side][v], 0);
                for (int k = 0; k < 3; k++) {
                    double got = samples.length[k][side][v];
                    assert_true(got > bound[0] - 5e-6 && got < bound[1] + 5e-6);
                    /* A chord lies up to 7.5e-5 inside the circle. Rays that graze it see that
                     * magnified, up to its root, and steep ones once more. */
                    double graze = fmax(fabs(b) / sqrt(a), 0.01);
                    assert_true(fabs(got - round) < 6e-4 / (graze * sqrt(a)));
                }
            }
        }
    }
    free_samples(&samples);
    dph_mesh_finish(&mesh);
}

/* From the outside of a shell through its centre: every vertex meets the antipodal vertices of
 * both spheres exactly. */
static void shell_has_three_thicknesses(void **state)
{
    (void)state;
    const double outer = 1, inner = 0.6;
    enum { SEGMENTS = 24, RINGS = 12 };
    struct dph_mesh mesh = make_room(2 * ((RINGS - 1) * SEGMENTS + 2), 4 * SEGMENTS * (RINGS - 1));
    add_sphere(&mesh, outer, SEGMENTS, RINGS, false);
    size_t cavity = mesh.nvert;
    add_sphere(&mesh, inner, SEGMENTS, RINGS, true);
    struct samples samples = make_samples(mesh.nvert);
    for (size_t v = 0; v < cavity; v++) {
        const float *p = mesh.position + 3 * v;
        const double d[3] = {-p[0], -p[1], -p[2]};
        sweep(&mesh, d, &samples);
        assert_true(fabs(samples.length[DPH_THICKNESS_FIRST][0][v] - (outer - inner)) < 1e-5);
        assert_true(fabs(samples.length[DPH_THICKNESS_FARTHEST][0][v] - 2 * outer) < 1e-5);
        assert_true(fabs(samples.length[DPH_THICKNESS_INSIDE][0][v] - 2 * (outer - inner)) < 1e-5);
        for (int k = 0; k < 3; k++) /* and nothing the other way */
            assert_true(fabs(samples.length[k][1][v]) < 1e-5);
        for (size_t u = 0; u < mesh.nvert; u++)
            assert_true(!samples.bad[0][u] && !samples.bad[1][u]);
    }
    free_samples(&samples);
    dph_mesh_finish(&mesh);
}

/* Where rays run along faces and through vertices and edges, every crossing still counts once:
 * the balance is right everywhere. */
static void symmetric_meshes_have_no_bad_hits(void **state)
{
    (void)state;
    struct dph_mesh meshes[4] = {make_box(1, 1, 1, 6), make_cylinder(1, 2, 32, 9), make_sphere(1, 32, 16)};
    assert_true(dph_mesh_init_candle(&meshes[3], NULL));
    for (int m = 0; m < 4; m++) {
        struct samples samples = make_samples(meshes[m].nvert);
        for (int i = 0; i < 27; i++) {
            const double d[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
            if (i == 13)
                continue;
            sweep(&meshes[m], d, &samples);
            for (size_t v = 0; v < meshes[m].nvert; v++)
                assert_true(!samples.bad[0][v] && !samples.bad[1][v]);
        }
        free_samples(&samples);
        dph_mesh_finish(&meshes[m]);
    }
}

/* Turning the body and the direction together changes no sample. */
static void rotation_leaves_samples(void **state)
{
    (void)state;
    double r[3][3];
    some_rotation(r);
    struct dph_mesh mesh = make_cylinder(1, 2, 20, 5), turned = make_cylinder(1, 2, 20, 5);
    rotate_mesh(&turned, r);
    struct samples a = make_samples(mesh.nvert), b = make_samples(mesh.nvert);
    uint64_t seed = 8;
    for (int n = 0; n < 200; n++) {
        double d[3], e[3];
        random_direction(&seed, d);
        for (int k = 0; k < 3; k++)
            e[k] = r[k][0] * d[0] + r[k][1] * d[1] + r[k][2] * d[2];
        sweep(&mesh, d, &a);
        sweep(&turned, e, &b);
        for (size_t v = 0; v < mesh.nvert; v++)
            for (int k = 0; k < 3; k++)
                for (int side = 0; side < 2; side++) /* steep facets magnify the rounding of the turned positions */
                    assert_true(fabsf(a.length[k][side][v] - b.length[k][side][v]) < 1e-4f);
    }
    free_samples(&a);
    free_samples(&b);
    dph_mesh_finish(&mesh);
    dph_mesh_finish(&turned);
}

/* ---- the brute force ---- */

/* A mesh without repeated positions, seen along a direction in double precision. */
struct view {
    size_t npos, ntri;
    const float *position;
    const uint32_t *index;
    double *x, *y, *z; /* (npos) z along the direction */
    double diagonal;
};

static void turn_view(struct view *view, const double d[3])
{
    /* any frame will do, and this is not the sweep's */
    int k = fabs(d[0]) < fabs(d[1]) ? (fabs(d[0]) < fabs(d[2]) ? 0 : 2) : (fabs(d[1]) < fabs(d[2]) ? 1 : 2);
    double u[3] = {0}, w[3];
    u[(k + 1) % 3] = d[(k + 2) % 3], u[(k + 2) % 3] = -d[(k + 1) % 3];
    double length = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    for (int i = 0; i < 3; i++)
        u[i] /= length;
    for (int i = 0; i < 3; i++)
        w[i] = d[(i + 1) % 3] * u[(i + 2) % 3] - d[(i + 2) % 3] * u[(i + 1) % 3];
    for (size_t i = 0; i < view->npos; i++) {
        const float *p = view->position + 3 * i;
        view->x[i] = p[0] * u[0] + p[1] * u[1] + p[2] * u[2];
        view->y[i] = p[0] * w[0] + p[1] * w[1] + p[2] * w[2];
        view->z[i] = p[0] * d[0] + p[1] * d[1] + p[2] * d[2];
    }
}

struct crossings {
    double inside[2], first[2], farthest[2];
    int balance[2], own; /* exits minus entries; own: of the triangles around the position */
    bool bad[2];
    double margin; /* distance across to the nearest edge that decided something */
};

static void brute_force(const struct view *view, uint32_t p, struct crossings *out)
{
    const double *x = view->x, *y = view->y, *z = view->z;
    double nearest[2] = {INFINITY, INFINITY};
    bool leaves[2] = {false, false};
    *out = (struct crossings){.margin = INFINITY};
    for (size_t t = 0; t < view->ntri; t++) {
        const uint32_t *i = view->index + 3 * t;
        bool below[3] = {y[i[0]] <= y[p], y[i[1]] <= y[p], y[i[2]] <= y[p]};
        bool own = i[0] == p || i[1] == p || i[2] == p;
        if (below[0] == below[1] && below[1] == below[2])
            continue;
        int winding = 0;
        for (int e = 0; e < 3; e++) {
            uint32_t from = i[e], to = i[(e + 1) % 3];
            if (below[e] == below[(e + 1) % 3])
                continue;
            uint32_t low = below[e] ? from : to, high = below[e] ? to : from;
            double ex = x[high] - x[low], ey = y[high] - y[low];
            double cross = ex * (y[p] - y[low]) - ey * (x[p] - x[low]);
            if (!own)
                out->margin = fmin(out->margin, fabs(cross) / sqrt(ex * ex + ey * ey));
            winding += cross > 0 ? (below[e] ? 1 : -1) : 0;
        }
        if (own)
            out->own += winding;
        if (own || !winding)
            continue;
        double a[3] = {x[i[1]] - x[i[0]], y[i[1]] - y[i[0]], z[i[1]] - z[i[0]]};
        double b[3] = {x[i[2]] - x[i[0]], y[i[2]] - y[i[0]], z[i[2]] - z[i[0]]};
        double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        double depth = z[i[0]] - z[p] + (n[0] * (x[i[0]] - x[p]) + n[1] * (y[i[0]] - y[p])) / n[2];
        if (depth == 0)
            continue;
        int side = depth < 0, s = side ? -winding : winding;
        double distance = fabs(depth);
        out->balance[side] += s;
        out->inside[side] += s * distance;
        if (distance < nearest[side]) {
            nearest[side] = distance;
            leaves[side] = s > 0;
        }
        if (s > 0)
            out->farthest[side] = fmax(out->farthest[side], distance);
    }
    for (int side = 0; side < 2; side++) {
        out->first[side] = leaves[side] ? nearest[side] : 0;
        out->inside[side] = fmax(out->inside[side], 0);
        out->bad[side] = out->balance[side] != 0 && out->balance[side] != 1;
        if (out->balance[0] - out->balance[1] + out->own != 0 &&
            (abs(out->own) != 1 || out->balance[side] != (out->own == (side ? 1 : -1))))
            out->bad[side] = true;
        if (out->bad[side])
            out->inside[side] = out->farthest[side] = out->first[side];
    }
}

/* Without repeated positions and degenerate triangles, in place. */
static void weld_mesh(struct dph_mesh *mesh)
{
    uint32_t *position_of = malloc((mesh->nvert + 1) * sizeof *position_of);
    size_t npos = dph_mesh_weld(mesh->position, 12, mesh->nvert, position_of, NULL), kept = 0;
    for (size_t v = 0; v < mesh->nvert; v++)
        memmove(mesh->position + 3 * (size_t)position_of[v], mesh->position + 3 * v, 12);
    for (size_t t = 0; t < mesh->ntri; t++) {
        uint32_t a = position_of[mesh->index[3 * t]], b = position_of[mesh->index[3 * t + 1]];
        uint32_t c = position_of[mesh->index[3 * t + 2]];
        if (a != b && b != c && c != a)
            memcpy(mesh->index + 3 * kept++, (uint32_t[]){a, b, c}, 12);
    }
    mesh->nvert = npos;
    mesh->ntri = kept;
    free(position_of);
}

static int compare_edges(const void *a, const void *b)
{
    return memcmp(a, b, 2 * sizeof(uint32_t));
}

/* 1 for positions on an edge that is not run along once either way: what lies around such a
 * position depends on how the view is turned. */
static uint8_t *find_border(const struct dph_mesh *mesh)
{
    uint32_t(*edge)[3] = malloc(3 * mesh->ntri * sizeof *edge);
    uint8_t *border = calloc(mesh->nvert, 1);
    for (size_t i = 0; i < 3 * mesh->ntri; i++) {
        uint32_t a = mesh->index[i], b = mesh->index[i % 3 == 2 ? i - 2 : i + 1];
        edge[i][0] = a < b ? a : b, edge[i][1] = a < b ? b : a, edge[i][2] = a < b;
    }
    qsort(edge, 3 * mesh->ntri, sizeof *edge, compare_edges);
    for (size_t i = 0, n; i < 3 * mesh->ntri; i += n) {
        size_t up = 0;
        for (n = 0; i + n < 3 * mesh->ntri && compare_edges(edge[i], edge[i + n]) == 0; n++)
            up += edge[i + n][2];
        if (n != 2 || up != 1)
            border[edge[i][0]] = border[edge[i][1]] = 1;
    }
    free(edge);
    return border;
}

/* Compares `pairs` random positions and directions, both ways. A disagreement about what is hit
 * is only forgiven, and counted, where single precision cannot tell on which side of an edge a
 * position is. */
static void against_brute_force(struct dph_mesh *mesh, const char *name, size_t pairs, double forgiven)
{
    weld_mesh(mesh);
    struct dph_mesh_stats stats;
    assert_true(dph_mesh_measure(mesh, &stats, NULL));
    struct view view = {mesh->nvert, mesh->ntri, mesh->position, mesh->index,
                        malloc(8 * mesh->nvert), malloc(8 * mesh->nvert), malloc(8 * mesh->nvert), 0};
    for (int k = 0; k < 3; k++)
        view.diagonal = hypot(view.diagonal, stats.bounds[1][k] - stats.bounds[0][k]);
    uint8_t *border = find_border(mesh);
    struct samples samples = make_samples(mesh->nvert);
    enum { DIRECTIONS = 20 };
    uint64_t seed = 3;
    size_t disagreements = 0;
    double worst = 0;
    for (int n = 0; n < DIRECTIONS; n++) {
        double d[3];
        random_direction(&seed, d);
        turn_view(&view, d);
        sweep(mesh, d, &samples);
        size_t positions = pairs / DIRECTIONS / 2 / (UNDER_SANITIZER ? 8 : 1);
        for (size_t m = 0; m < positions; m++) {
            uint32_t p = (uint32_t)(next_random(&seed) * (double)mesh->nvert);
            if (border[p])
                continue;
            struct crossings expected;
            brute_force(&view, p, &expected);
            for (int side = 0; side < 2; side++) {
                double error = fmax(fabs(samples.length[DPH_THICKNESS_INSIDE][side][p] - expected.inside[side]),
                    fmax(fabs(samples.length[DPH_THICKNESS_FIRST][side][p] - expected.first[side]),
                         fabs(samples.length[DPH_THICKNESS_FARTHEST][side][p] - expected.farthest[side])));
                error /= view.diagonal;
                if (error <= 1e-5 && samples.bad[side][p] == expected.bad[side])
                    worst = fmax(worst, error);
                else if (expected.margin < 2e-7 * view.diagonal)
                    disagreements++;
                else
                    fail_msg("%s: position %u, side %d: error %g of the diagonal, balance %d", name,
                             (unsigned)p, side, error, expected.balance[side]);
            }
        }
    }
    print_message("%s: %zu pairs, largest error %.2g of the diagonal, %zu hit disagreements\n", name, pairs,
                  worst, disagreements);
    assert_true((double)disagreements <= forgiven * (double)pairs);
    free_samples(&samples);
    free(view.x);
    free(view.y);
    free(view.z);
    free(border);
    dph_mesh_finish(mesh);
}

static void shapes_against_brute_force(void **state)
{
    (void)state;
    struct dph_mesh candle, box = make_box(1, 2, 3, 20), sphere = make_sphere(1, 64, 32);
    assert_true(dph_mesh_init_candle(&candle, NULL));
    against_brute_force(&candle, "candle", 8000, 0);
    against_brute_force(&box, "box", 40000, 0);
    against_brute_force(&sphere, "sphere", 40000, 0);
}

static void models_against_brute_force(void **state)
{
    (void)state;
    static const char *const names[] = {"bunny_closed_lr.obj", "bunny_scan_open.obj", "spot.obj", "head_lps.obj",
                                        "lucy_100k.ply", "nefertiti_100k.obj", "skull.obj"};
    size_t tested = 0;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[512];
        snprintf(path, sizeof path, DPH_DATA "/models/%s", names[i]);
        struct dph_scene *scene = dph_scene_load(path, NULL);
        if (!scene)
            continue;
        /* 10 in a million: in so few pairs one is already a rare event, two are a defect */
        against_brute_force(&scene->body[0].mesh, names[i], 8000, 1.0 / 8000);
        dph_scene_destroy(scene);
        tested++;
    }
    if (!tested) {
        print_message("skipped: no models in " DPH_DATA "\n");
        skip();
    }
}

#ifdef DPH_TEST_TRACE
#include <diaphan/trace.h>

static void candle_against_embree(void **state)
{
    (void)state;
    struct dph_mesh mesh;
    assert_true(dph_mesh_init_candle(&mesh, NULL));
    weld_mesh(&mesh);
    struct dph_rays *rays = dph_rays_create(mesh.position, mesh.nvert, mesh.index, mesh.ntri, NULL);
    assert_non_null(rays);
    struct samples samples = make_samples(mesh.nvert);
    uint32_t *origin = malloc(mesh.nvert * sizeof *origin);
    float *length = malloc(mesh.nvert * sizeof *length);
    for (size_t i = 0; i < mesh.nvert; i++)
        origin[i] = (uint32_t)i;
    uint64_t seed = 4;
    size_t different = 0;
    for (int n = 0; n < 6; n++) {
        double d[3];
        random_direction(&seed, d);
        const float direction[3] = {(float)d[0], (float)d[1], (float)d[2]};
        for (int k = 0; k < 3; k++)
            d[k] = direction[k];
        sweep(&mesh, d, &samples);
        for (int k = 0; k < 3; k++) {
            dph_rays_thickness(rays, (enum dph_definition)k, origin, mesh.nvert, direction, length, NULL);
            for (size_t i = 0; i < mesh.nvert; i++)
                different += fabsf(length[i] - samples.length[k][0][i]) > 5e-5f;
        }
    }
    /* Embree counts a crossing at an edge twice or not at all now and then; that is why the
     * sweep is no ray tracer */
    print_message("candle: %zu of %zu values differ from Embree's\n", different, 18 * mesh.nvert);
    assert_true((double)different < 3e-4 * 18 * (double)mesh.nvert);
    free(origin);
    free(length);
    free_samples(&samples);
    dph_rays_destroy(rays);
    dph_mesh_finish(&mesh);
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box_in_closed_form),
        cmocka_unit_test(cylinder_in_closed_form),
        cmocka_unit_test(shell_has_three_thicknesses),
        cmocka_unit_test(symmetric_meshes_have_no_bad_hits),
        cmocka_unit_test(rotation_leaves_samples),
        cmocka_unit_test(shapes_against_brute_force),
        cmocka_unit_test(models_against_brute_force),
#ifdef DPH_TEST_TRACE
        cmocka_unit_test(candle_against_embree),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
