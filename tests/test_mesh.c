/* Meshes in memory: welding, measures, normals. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <diaphan/mesh.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A box of 12 triangles on 8 vertices, counter-clockwise from outside. */
static const uint32_t box_index[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

static void make_box(struct dph_mesh *mesh, const double at[3], const double size[3])
{
    assert_true(dph_mesh_init(mesh, 8, 12, false, false, NULL));
    for (int v = 0; v < 8; v++)
        for (int k = 0; k < 3; k++)
            mesh->position[3 * v + k] = (float)(at[k] + ((v >> k & 1) ? size[k] : 0));
    memcpy(mesh->index, box_index, sizeof box_index);
}

/* A torus of n x m quads, unwelded seams if `seam`, radii 1 and r. */
static void make_torus(struct dph_mesh *mesh, int n, int m, double r)
{
    assert_true(dph_mesh_init(mesh, (size_t)n * m, (size_t)2 * n * m, false, false, NULL));
    for (int i = 0; i < n; i++)
        for (int j = 0; j < m; j++) {
            double u = 2 * 3.14159265358979 * i / n, v = 2 * 3.14159265358979 * j / m;
            float *p = mesh->position + 3 * (i * m + j);
            p[0] = (float)((1 + r * cos(v)) * cos(u));
            p[1] = (float)((1 + r * cos(v)) * sin(u));
            p[2] = (float)(r * sin(v));
            uint32_t a = (uint32_t)(i * m + j), b = (uint32_t)((i + 1) % n * m + j);
            uint32_t c = (uint32_t)(i * m + (j + 1) % m),
                     d = (uint32_t)((i + 1) % n * m + (j + 1) % m);
            uint32_t quad[6] = {a, b, c, b, d, c};
            memcpy(mesh->index + 6 * (i * m + j), quad, sizeof quad);
        }
}

/* Gives every corner its own vertex. */
static void unshare(struct dph_mesh *mesh)
{
    struct dph_mesh apart;
    assert_true(dph_mesh_init(&apart, 3 * mesh->ntri, mesh->ntri, false, false, NULL));
    for (size_t i = 0; i < apart.nvert; i++) {
        memcpy(apart.position + 3 * i, mesh->position + 3 * mesh->index[i], 3 * sizeof(float));
        apart.index[i] = (uint32_t)i;
    }
    dph_mesh_finish(mesh);
    *mesh = apart;
}

static void test_weld_numbers_by_first_appearance(void **state)
{
    (void)state;
    const float p[6][4] = {{1, 2, 3, 9},     {0, 0, -0.0f, 9},      {1, 2, 3, 8},
                           {-0.0f, 0, 0, 9}, {1, 2, 3.0000002f, 9}, {0, 0, 0, 0}};
    uint32_t id[6];
    assert_int_equal(dph_mesh_weld(p[0], sizeof p[0], 6, id, NULL), 3);
    const uint32_t wanted[6] = {0, 1, 0, 1, 2, 1};
    assert_memory_equal(id, wanted, sizeof id);
    assert_int_equal(dph_mesh_weld(p[0], sizeof p[0], 0, id, NULL), 0);
}

/* Corners come together where everything is equal, and only there. */
static void test_share(void **state)
{
    (void)state;
    struct dph_mesh mesh, before;
    make_torus(&mesh, 12, 8, .4);
    unshare(&mesh);
    assert_int_equal(mesh.nvert, 576);
    assert_true(dph_mesh_share(&mesh, NULL));
    assert_int_equal(mesh.nvert, 96);
    assert_int_equal(mesh.ntri, 192);
    make_torus(&before, 12, 8, .4);
    for (size_t i = 0; i < 3 * mesh.ntri; i++)
        assert_memory_equal(mesh.position + 3 * mesh.index[i],
                            before.position + 3 * before.index[i], 3 * sizeof(float));
    dph_mesh_finish(&mesh);
    dph_mesh_finish(&before);
    /* a box with flat faces has three normals at a corner; -0 is 0 */
    const double at[3] = {0, 0, 0}, size[3] = {1, 1, 1};
    make_box(&mesh, at, size);
    assert_true(dph_mesh_make_normals(&mesh, 30, NULL, NULL));
    size_t smooth = mesh.nvert;
    assert_int_equal(smooth, 24);
    mesh.position[0] = -0.0F;
    assert_true(dph_mesh_share(&mesh, NULL));
    assert_int_equal(mesh.nvert, 24);
    for (size_t v = 0; v < mesh.nvert; v++)
        memset(mesh.normal + 3 * v, 0, 3 * sizeof(float));
    assert_true(dph_mesh_share(&mesh, NULL));
    assert_int_equal(mesh.nvert, 8);
    dph_mesh_finish(&mesh);
}

static void test_weld_refuses_what_is_not_finite(void **state)
{
    (void)state;
    float p[3][3] = {{0, 0, 0}, {1, INFINITY, 0}, {0, 0, 0}};
    uint32_t id[3];
    struct dph_error err = {0};
    assert_true(dph_mesh_weld(p[0], sizeof p[0], 3, id, &err) == SIZE_MAX);
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_non_null(strstr(err.message, "vertex 1"));
    assert_non_null(strstr(err.message, "inf"));
    p[1][1] = NAN;
    assert_true(dph_mesh_weld(p[0], sizeof p[0], 3, id, NULL) == SIZE_MAX);
}

/* A grid of 100^3 points, each given twice: every point is found again, in the right order. A grid
 * is what makes weak hashes slow; the time limit of the test is the judge of that. */
static void test_weld_grid(void **state)
{
    (void)state;
    const size_t side = 100, n = side * side * side;
    float *p = malloc(2 * n * 3 * sizeof *p);
    uint32_t *id = malloc(2 * n * sizeof *id);
    for (size_t i = 0; i < n; i++) {
        float q[3] = {(float)(i % side) * 0.5f, (float)(i / side % side) * 0.5f,
                      (float)(i / side / side) * 0.5f};
        memcpy(p + 3 * i, q, sizeof q);
        memcpy(p + 3 * (2 * n - 1 - i), q, sizeof q);
    }
    assert_int_equal(dph_mesh_weld(p, 3 * sizeof *p, 2 * n, id, NULL), n);
    size_t wrong = 0;
    for (size_t i = 0; i < n; i++)
        wrong += id[i] != i || id[2 * n - 1 - i] != i;
    assert_int_equal(wrong, 0);
    free(p);
    free(id);
}

static void test_measure_box(void **state)
{
    (void)state;
    const double at[3] = {-1000, 2000, 3}, size[3] = {2, 3, 5};
    struct dph_mesh mesh;
    struct dph_mesh_stats s;
    make_box(&mesh, at, size);
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_true(s.closed);
    assert_int_equal(s.positions, 8);
    assert_int_equal(s.components, 1);
    assert_int_equal(s.degenerate, 0);
    assert_true(fabs(s.area - 62) < 1e-9);
    assert_true(fabs(s.volume - 30) < 1e-9);
    assert_true(s.bounds[0][0] == -1000 && s.bounds[1][2] == 8);

    dph_mesh_flip(&mesh);
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_true(s.closed && fabs(s.volume + 30) < 1e-9);
    dph_mesh_flip(&mesh);

    unshare(&mesh);
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_true(s.closed && s.positions == 8 && s.components == 1);
    dph_mesh_finish(&mesh);
}

static void test_measure_faults(void **state)
{
    (void)state;
    const double at[3] = {0, 0, 0}, size[3] = {1, 1, 1};
    struct dph_mesh mesh;
    struct dph_mesh_stats s;
    make_box(&mesh, at, size);
    uint32_t kept = mesh.index[1];

    mesh.index[1] = mesh.index[0]; /* a hole where a triangle lost its area */
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_int_equal(s.degenerate, 1);
    assert_int_equal(s.boundary_edges, 3);
    assert_false(s.closed);
    mesh.index[1] = kept;

    uint32_t swap = mesh.index[0]; /* one triangle the wrong way round */
    mesh.index[0] = mesh.index[1];
    mesh.index[1] = swap;
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_int_equal(s.flipped_edges, 3);
    assert_int_equal(s.boundary_edges, 0);
    assert_false(s.closed);

    mesh.index[0] = 8;
    struct dph_error err = {0};
    assert_false(dph_mesh_measure(&mesh, &s, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_string_equal(err.message, "triangle 0 refers to vertex 8, the mesh has 8");
    dph_mesh_finish(&mesh);

    /* three triangles on one edge, and a second body apart */
    assert_true(dph_mesh_init(&mesh, 8, 4, false, false, NULL));
    for (int i = 0; i < 24; i++)
        mesh.position[i] = (float)(i * i % 17);
    const uint32_t index[12] = {0, 1, 2, 1, 0, 3, 0, 1, 4, 5, 6, 7};
    memcpy(mesh.index, index, sizeof index);
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_int_equal(s.nonmanifold_edges, 1);
    assert_int_equal(s.boundary_edges, 9);
    assert_int_equal(s.components, 2);
    assert_int_equal(s.positions, 8);
    dph_mesh_finish(&mesh);

    assert_true(dph_mesh_init(&mesh, 0, 0, false, false, NULL));
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_false(s.closed);
    dph_mesh_finish(&mesh);
}

/* The corner of a box has three faces of one angle, however each is cut: the normal is (1, 1, 1) /
 * sqrt(3), at every scale. */
static void test_position_normals(void **state)
{
    (void)state;
    for (int power = -6; power <= 6; power++) {
        double scale = pow(10, power);
        const double at[3] = {0, 0, 0}, size[3] = {scale, 3 * scale, 0.5 * scale};
        struct dph_mesh mesh;
        float normal[24];
        make_box(&mesh, at, size);
        dph_mesh_position_normals(mesh.position, 8, mesh.index, 12, normal);
        for (int v = 0; v < 8; v++)
            for (int k = 0; k < 3; k++)
                assert_true(fabs(normal[3 * v + k] - ((v >> k & 1) ? 1 : -1) / sqrt(3)) < 3e-7);
        dph_mesh_finish(&mesh);
    }
    /* without area: up; a needle of two equal points counts nothing */
    const float p[9] = {0, 0, 0, 1, 0, 0, 2, 0, 0};
    const uint32_t t[6] = {0, 1, 2, 0, 1, 1};
    float normal[9];
    dph_mesh_position_normals(p, 3, t, 2, normal);
    for (int v = 0; v < 3; v++)
        assert_true(normal[3 * v] == 0 && normal[3 * v + 1] == 0 && normal[3 * v + 2] == 1);
}

static void test_crease_splits_a_box(void **state)
{
    (void)state;
    const double at[3] = {1, 2, 3}, size[3] = {1, 2, 3};
    for (int apart = 0; apart < 2; apart++) {
        struct dph_mesh mesh;
        uint32_t *from = NULL;
        make_box(&mesh, at, size);
        if (apart)
            unshare(&mesh);
        struct dph_mesh before = mesh;
        float old[36 * 3];
        memcpy(old, before.position, before.nvert * 3 * sizeof(float));
        size_t nold = before.nvert;
        assert_true(dph_mesh_make_normals(&mesh, 60, &from, NULL));
        assert_int_equal(mesh.nvert, apart ? 36 : 24);
        for (size_t v = 0; v < mesh.nvert; v++) {
            assert_true(from[v] < nold);
            assert_memory_equal(mesh.position + 3 * v, old + 3 * from[v], 3 * sizeof(float));
        }
        for (size_t t = 0; t < mesh.ntri; t++) { /* every corner has its face's normal */
            const float *n[3];
            for (int k = 0; k < 3; k++)
                n[k] = mesh.normal + 3 * mesh.index[3 * t + k];
            assert_memory_equal(n[0], n[1], 3 * sizeof(float));
            assert_memory_equal(n[0], n[2], 3 * sizeof(float));
            assert_true(fabsf(n[0][0]) + fabsf(n[0][1]) + fabsf(n[0][2]) == 1);
        }
        struct dph_mesh_stats s;
        assert_true(dph_mesh_measure(&mesh, &s, NULL));
        assert_true(s.closed && fabs(s.volume - 6) < 1e-6);
        free(from);
        dph_mesh_finish(&mesh);

        make_box(&mesh, at, size);
        assert_true(
            dph_mesh_make_normals(&mesh, 120, NULL, NULL)); /* beyond 90 degrees: all smooth */
        assert_int_equal(mesh.nvert, 8);
        for (size_t i = 0; i < 24; i++)
            assert_true(fabs(fabs(mesh.normal[i]) - 1 / sqrt(3)) < 1e-6);
        assert_true(dph_mesh_make_normals(&mesh, 0, NULL, NULL));
        assert_int_equal(mesh.nvert, 36);
        dph_mesh_finish(&mesh);
    }
}

/* A smooth body keeps its vertices and their order, and its normals are those of the surface. */
static void test_crease_keeps_a_torus(void **state)
{
    (void)state;
    const int n = 96, m = 48;
    const double r = 0.4;
    struct dph_mesh mesh;
    make_torus(&mesh, n, m, r);
    float *position = malloc(mesh.nvert * 3 * sizeof(float));
    memcpy(position, mesh.position, mesh.nvert * 3 * sizeof(float));
    assert_true(dph_mesh_make_normals(&mesh, 60, NULL, NULL));
    assert_int_equal(mesh.nvert, n * m);
    assert_memory_equal(position, mesh.position, mesh.nvert * 3 * sizeof(float));
    for (int i = 0; i < n * m; i++) {
        double u = 2 * 3.14159265358979 * (i / m) / n, v = 2 * 3.14159265358979 * (i % m) / m;
        const float *k = mesh.normal + 3 * i;
        double cosine = k[0] * cos(v) * cos(u) + k[1] * cos(v) * sin(u) + k[2] * sin(v);
        assert_true(cosine > 0.9999);
    }
    struct dph_mesh_stats s;
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_true(s.closed);
    assert_true(fabs(s.volume - 2 * 9.8696044 * r * r) < 0.01 * s.volume);
    assert_true(fabs(s.area - 4 * 9.8696044 * r) < 0.01 * s.area);
    free(position);
    dph_mesh_finish(&mesh);
}

/* Thousands of flat faces around one vertex: every one gets its own copy of it, in linear time. */
static void test_crease_many_fans(void **state)
{
    (void)state;
    const uint32_t n = 60000;
    struct dph_mesh mesh;
    assert_true(dph_mesh_init(&mesh, 1 + 2 * (size_t)n, n, false, false, NULL));
    memset(mesh.position, 0, 3 * sizeof(float));
    for (uint32_t i = 0; i < n; i++) {
        double a = 6.283185307 * i / n;
        float p[6] = {(float)cos(a),        (float)sin(a),        -0.5f,
                      (float)cos(a + 1e-4), (float)sin(a + 1e-4), 0.5f};
        memcpy(mesh.position + 3 * (1 + 2 * i), p, sizeof p);
        memcpy(mesh.index + 3 * i, (uint32_t[3]){0, 1 + 2 * i, 2 + 2 * i}, 3 * sizeof(uint32_t));
    }
    assert_true(dph_mesh_make_normals(&mesh, 60, NULL, NULL));
    assert_int_equal(mesh.nvert, 3 * (size_t)n);
    dph_mesh_finish(&mesh);
}

static void test_limits(void **state)
{
    (void)state;
    struct dph_mesh mesh;
    struct dph_error err = {0};
    assert_false(dph_mesh_init(&mesh, (size_t)1 << 40, 1, true, true, &err));
    assert_int_equal(err.code, DPH_ERROR_LIMIT);
    assert_null(mesh.position);
    dph_mesh_finish(&mesh);
    dph_mesh_finish(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_weld_numbers_by_first_appearance),
        cmocka_unit_test(test_weld_refuses_what_is_not_finite),
        cmocka_unit_test(test_weld_grid),
        cmocka_unit_test(test_share),
        cmocka_unit_test(test_measure_box),
        cmocka_unit_test(test_measure_faults),
        cmocka_unit_test(test_position_normals),
        cmocka_unit_test(test_crease_splits_a_box),
        cmocka_unit_test(test_crease_keeps_a_torus),
        cmocka_unit_test(test_crease_many_fans),
        cmocka_unit_test(test_limits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
