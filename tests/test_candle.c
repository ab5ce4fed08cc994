/* The candle: counts, a closed body that does not cut itself, sound triangles and normals, and the
 * same bytes everywhere. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <diaphan/mesh.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct dph_mesh candle;

static int make_candle(void **state)
{
    (void)state;
    return dph_mesh_init_candle(&candle, NULL) ? 0 : -1;
}

static int drop_candle(void **state)
{
    (void)state;
    dph_mesh_finish(&candle);
    return 0;
}

static void test_counts(void **state)
{
    (void)state;
    struct dph_mesh_stats s;
    assert_int_equal(candle.ntri, 59704);
    assert_int_equal(candle.nvert, 179112);
    for (uint32_t i = 0; i < candle.nvert; i++)
        assert_int_equal(candle.index[i], i);
    assert_true(dph_mesh_measure(&candle, &s, NULL));
    assert_true(s.closed);
    assert_int_equal(s.components, 1);
    assert_int_equal(s.degenerate, 0);
    assert_int_equal(s.positions, 59704 / 2 + 2); /* Euler: a sphere with dents */
    assert_true(s.bounds[0][1] == 0 && s.bounds[1][1] == 2);
    for (int k = 0; k < 3; k += 2)
        assert_true(s.bounds[0][k] > -0.6 && s.bounds[1][k] < 0.6);
    assert_true(s.volume > 0.8 && s.volume < 1.2);
}

static void test_triangles_are_sound(void **state)
{
    (void)state;
    double least_height = 1, least_cosine = 1;
    for (size_t t = 0; t < candle.ntri; t++) {
        const float *p = candle.position + 9 * t, *n = candle.normal + 9 * t;
        double u[3], v[3], w[3], longest = 0;
        for (int k = 0; k < 3; k++) {
            u[k] = (double)p[3 + k] - p[k];
            v[k] = (double)p[6 + k] - p[k];
            w[k] = v[k] - u[k];
        }
        double normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                            u[0] * v[1] - u[1] * v[0]};
        double area = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        const double *side[3] = {u, v, w};
        for (int k = 0; k < 3; k++)
            longest = fmax(longest, sqrt(side[k][0] * side[k][0] + side[k][1] * side[k][1] +
                                         side[k][2] * side[k][2]));
        least_height = fmin(least_height, area / longest);
        for (int k = 0; k < 3; k++) {
            const float *m = n + 3 * k;
            double size = sqrt((double)m[0] * m[0] + (double)m[1] * m[1] + (double)m[2] * m[2]);
            assert_true(fabs(size - 1) < 1e-6);
            least_cosine =
                fmin(least_cosine, (m[0] * normal[0] + m[1] * normal[1] + m[2] * normal[2]) / area);
        }
    }
    print_message("least height of a triangle %.2g, least cosine of a face and its vertices' "
                  "normals %.3f\n",
                  least_height, least_cosine);
    assert_true(least_height > 4e-4);
    assert_true(least_cosine >
                0.5); /* nothing folded over, no edge sharper than smooth normals can bear */
}

static void test_vertices_at_one_position_share_their_normal(void **state)
{
    (void)state;
    uint32_t *id = malloc(candle.nvert * sizeof *id);
    size_t npos = dph_mesh_weld(candle.position, 12, candle.nvert, id, NULL);
    uint32_t *first = malloc(npos * sizeof *first);
    size_t seen = 0;
    for (uint32_t v = 0; v < candle.nvert; v++) {
        if (id[v] == seen)
            first[seen++] = v;
        assert_memory_equal(candle.normal + 3 * v, candle.normal + 3 * first[id[v]], 12);
    }
    free(first);
    free(id);
}

static double uniform(uint64_t *seed)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*seed >> 11) / 9007199254740992.0;
}

struct crossing {
    double t;
    int sign;
};

static int compare_crossings(const void *a, const void *b)
{
    const struct crossing *p = a, *q = b;
    return p->t < q->t ? -1 : p->t > q->t;
}

/* Along any line the surface is entered and left in turns; where a shell cuts itself, two entries
 * follow each other. */
static void test_lines_enter_and_leave_in_turns(void **state)
{
    (void)state;
    uint64_t seed = 7;
    size_t hits = 0;
    for (int line = 0; line < 400; line++) {
        double from[3], to[3];
        for (int k = 0; k < 3;
             k++) { /* between two points near the side, so that it passes through drips and rim */
            from[k] = (k == 1 ? 2 : 1) * uniform(&seed) - (k == 1 ? 0 : 0.5);
            to[k] = (k == 1 ? 2 : 1) * uniform(&seed) - (k == 1 ? 0 : 0.5);
        }
        double d[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
        struct crossing crossing[64];
        int n = 0;
        for (size_t t = 0; t < candle.ntri; t++) {
            const float *p = candle.position + 9 * t;
            double a[3], u[3], v[3];
            for (int k = 0; k < 3; k++) {
                a[k] = from[k] - p[k];
                u[k] = (double)p[3 + k] - p[k];
                v[k] = (double)p[6 + k] - p[k];
            }
            double normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                u[0] * v[1] - u[1] * v[0]};
            double q[3] = {a[1] * d[2] - a[2] * d[1], a[2] * d[0] - a[0] * d[2],
                           a[0] * d[1] - a[1] * d[0]};
            double slope = -(normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]);
            double b = (v[0] * q[0] + v[1] * q[1] + v[2] * q[2]) / slope;
            double c = -(u[0] * q[0] + u[1] * q[1] + u[2] * q[2]) / slope;
            if (slope == 0 || b < 0 || c < 0 || b + c > 1)
                continue;
            assert_true(n < 64);
            crossing[n++] =
                (struct crossing){(normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2]) / slope,
                                  slope > 0 ? 1 : -1};
        }
        qsort(crossing, (size_t)n, sizeof *crossing, compare_crossings);
        assert_int_equal(n % 2, 0);
        for (int i = 0; i < n; i++)
            assert_int_equal(crossing[i].sign, i % 2 ? -1 : 1);
        hits += (size_t)n;
    }
    assert_true(hits > 800);
}

/* FNV-1a over the bits, so that a machine that makes another candle is noticed. */
static void test_same_bytes_everywhere(void **state)
{
    (void)state;
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < 3 * candle.nvert; i++) {
        uint32_t bits[2];
        memcpy(&bits[0], &candle.position[i], 4);
        memcpy(&bits[1], &candle.normal[i], 4);
        for (int k = 0; k < 2; k++)
            hash = (hash ^ bits[k]) * UINT64_C(0x100000001b3);
    }
    print_message("hash 0x%016llx\n",
                  (unsigned long long)hash); /* a new shape is a new number here */
    assert_true(hash == UINT64_C(0xe63ec5c94da362e0));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_counts),
        cmocka_unit_test(test_triangles_are_sound),
        cmocka_unit_test(test_vertices_at_one_position_share_their_normal),
        cmocka_unit_test(test_lines_enter_and_leave_in_turns),
        cmocka_unit_test(test_same_bytes_everywhere),
    };
    return cmocka_run_group_tests(tests, make_candle, drop_candle);
}
