/* Clustered principal components: exact where they must be, optimal where an independent
 * decomposition says so, the same bytes for any number of threads, and sound on signals without
 * content. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>

#include <cmocka.h>

#include <diaphan/cpca.h>

#include "bake/eigen.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t state;

static double uniform(void)
{
    state = state * 1664525u + 1013904223u;
    return (double)(state >> 8) / 16777216 * 2 - 1;
}

/* Signals on a curved sheet in n dimensions, with some noise: no subspace holds them all. */
static float *sheet(size_t count, int n)
{
    float *signal = malloc(count * (size_t)n * sizeof *signal);
    assert_non_null(signal);
    state = 7;
    for (size_t s = 0; s < count; s++) {
        double u = uniform(), v = uniform();
        for (int i = 0; i < n; i++)
            signal[s * (size_t)n + (size_t)i] =
                (float)(3 + sin(2.1 * u * (1 + i % 5) + i) + cos(3 * v * (1 + i % 3) - i) + .01 * uniform());
    }
    return signal;
}

static struct dph_cpca *compress(const float *signal, size_t count, int n, int clusters, int vectors)
{
    struct dph_cpca_params params = dph_cpca_defaults();
    struct dph_error err;
    params.clusters = clusters;
    params.vectors = vectors;
    struct dph_cpca *cpca = dph_cpca_create(signal, count, n, NULL, &params, &err);
    assert_non_null(cpca);
    return cpca;
}

/* Relative error by decoding every signal, the caller's own sum. */
static double error_of(const struct dph_cpca *cpca, const float *signal)
{
    double sum = 0, norm = 0;
    float row[1024];
    for (size_t s = 0; s < cpca->count; s++) {
        dph_cpca_row(cpca, s, row);
        for (int i = 0; i < cpca->n; i++) {
            double x = signal[s * (size_t)cpca->n + (size_t)i];
            sum += (row[i] - x) * (row[i] - x);
            norm += x * x;
        }
    }
    return norm > 0 ? sqrt(sum / norm) : sqrt(sum);
}

/* Cyclic Jacobi rotations: another way than that of eigen_kernel.c. Returns eigenvalues, unsorted. */
static void jacobi(int n, double *a, double *value)
{
    for (int sweep = 0; sweep < 40; sweep++)
        for (int p = 0; p < n; p++)
            for (int q = p + 1; q < n; q++) {
                double apq = a[p * n + q];
                if (fabs(apq) < 1e-300)
                    continue;
                double theta = (a[q * n + q] - a[p * n + p]) / (2 * apq);
                double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < n; k++) {
                    double x = a[k * n + p], y = a[k * n + q];
                    a[k * n + p] = c * x - s * y;
                    a[k * n + q] = s * x + c * y;
                }
                for (int k = 0; k < n; k++) {
                    double x = a[p * n + k], y = a[q * n + k];
                    a[p * n + k] = c * x - s * y;
                    a[q * n + k] = s * x + c * y;
                }
            }
    for (int i = 0; i < n; i++)
        value[i] = a[i * n + i];
}

static int falling(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? 1 : x > y ? -1 : 0;
}

/* n x n; `rank` of the eigenvalues are not 0. */
static void random_matrix(int n, int rank, double *a)
{
    memset(a, 0, (size_t)(n * n) * sizeof *a);
    for (int r = 0; r < rank; r++) {
        double v[128];
        for (int i = 0; i < n; i++)
            v[i] = uniform() * exp(-.1 * r);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                a[i * n + j] += v[i] * v[j];
    }
}

static void test_eigen(void **unused)
{
    (void)unused;
    static const int cases[][2] = {{1, 1}, {2, 2}, {3, 1}, {7, 7}, {36, 36}, {36, 5}, {108, 108}, {20, 0}};
    state = 3;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        int n = cases[k][0];
        size_t nn = (size_t)(n * n);
        double *a = malloc(nn * sizeof *a), *b = malloc(nn * sizeof *b), *v = malloc(nn * sizeof *v);
        double value[128], other[128], scratch[3 * 128];
        assert_true(a && b && v);
        random_matrix(n, cases[k][1], a);
        memcpy(b, a, nn * sizeof *a);
        dph_eigen_portable(n, b, value, v, scratch);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) { /* orthonormal, and A = sum of value v v^T */
                double dot = 0, sum = 0;
                for (int m = 0; m < n; m++) {
                    dot += v[i * n + m] * v[j * n + m];
                    sum += value[m] * v[m * n + i] * v[m * n + j];
                }
                assert_true(fabs(dot - (i == j)) < 1e-12);
                assert_true(fabs(sum - a[i * n + j]) < 1e-12 * n);
            }
        memcpy(b, a, nn * sizeof *a);
        jacobi(n, b, other);
        qsort(other, (size_t)n, sizeof *other, falling);
        for (int i = 0; i < n; i++)
            assert_true(fabs(other[i] - value[i]) < 1e-11 * n);
        free(a);
        free(b);
        free(v);
    }
}

static void test_all_vectors_are_exact(void **unused)
{
    (void)unused;
    static const int sizes[] = {1, 4, 36, 108};
    for (int k = 0; k < 4; k++) {
        int n = sizes[k];
        float *signal = sheet(500, n);
        for (int clusters = 1; clusters <= 4; clusters += 3) {
            struct dph_cpca *cpca = compress(signal, 500, n, clusters, n);
            assert_true(cpca->error < 1e-6);
            float row[128];
            for (size_t s = 0; s < 500; s++) {
                dph_cpca_row(cpca, s, row);
                for (int i = 0; i < n; i++)
                    assert_true(fabsf(row[i] - signal[s * (size_t)n + (size_t)i]) < 1e-5f);
            }
            dph_cpca_destroy(cpca);
        }
        free(signal);
    }
}

/* The error of plain PCA is the root of the sum of the eigenvalues that are left out. */
static void test_one_cluster_is_pca(void **unused)
{
    (void)unused;
    enum { N = 12, COUNT = 700 };
    float *signal = sheet(COUNT, N);
    double mean[N] = {0}, covariance[N * N] = {0}, value[N], norm = 0;
    for (size_t s = 0; s < COUNT; s++)
        for (int i = 0; i < N; i++)
            mean[i] += (double)signal[s * N + (size_t)i] / COUNT;
    for (size_t s = 0; s < COUNT; s++)
        for (int i = 0; i < N; i++) {
            norm += (double)signal[s * N + (size_t)i] * (double)signal[s * N + (size_t)i];
            for (int j = 0; j < N; j++)
                covariance[i * N + j] += ((double)signal[s * N + (size_t)i] - mean[i]) *
                                         ((double)signal[s * N + (size_t)j] - mean[j]);
        }
    jacobi(N, covariance, value);
    qsort(value, N, sizeof *value, falling);
    for (int vectors = 1; vectors < N; vectors++) {
        struct dph_cpca *cpca = compress(signal, COUNT, N, 1, vectors);
        double rest = 0;
        for (int i = vectors; i < N; i++)
            rest += value[i];
        double expected = sqrt(rest / norm);
        assert_true(fabs(cpca->error - expected) < 1e-5 * expected + 1e-7);
        assert_true(fabs(error_of(cpca, signal) - cpca->error) < 1e-9);
        for (int i = 0; i < N; i++)
            assert_true(fabs((double)cpca->table[i] - mean[i]) < 1e-5);
        dph_cpca_destroy(cpca);
    }
    free(signal);
}

static void test_error_falls(void **unused)
{
    (void)unused;
    enum { N = 24, COUNT = 3000 };
    float *signal = sheet(COUNT, N);
    double before = INFINITY, mean_before = INFINITY;
    for (int vectors = 1; vectors <= 8; vectors++) {
        struct dph_cpca *cpca = compress(signal, COUNT, N, 8, vectors);
        assert_true(cpca->error < before);
        before = cpca->error;
        for (int i = 2; i < cpca->iterations; i++) /* no step raises it, but where a cluster moves */
            assert_true(cpca->history[i] < 1.01 * cpca->history[i - 1]);
        dph_cpca_destroy(cpca);
    }
    for (int clusters = 1; clusters <= 64; clusters *= 2) {
        double sum = 0;
        for (uint64_t seed = 1; seed <= 3; seed++) {
            struct dph_cpca_params params = dph_cpca_defaults();
            params.clusters = clusters;
            params.vectors = 3;
            params.seed = seed;
            struct dph_cpca *cpca = dph_cpca_create(signal, COUNT, N, NULL, &params, NULL);
            assert_non_null(cpca);
            sum += cpca->error;
            dph_cpca_destroy(cpca);
        }
        assert_true(sum < mean_before);
        mean_before = sum;
    }
    free(signal);
}

/* Two affine planes in 20 dimensions. */
static void test_two_families(void **unused)
{
    (void)unused;
    enum { N = 20, COUNT = 600 };
    float *signal = malloc(COUNT * N * sizeof *signal);
    double base[2][3][N];
    assert_non_null(signal);
    state = 11;
    for (int f = 0; f < 2; f++)
        for (int j = 0; j < 3; j++)
            for (int i = 0; i < N; i++)
                base[f][j][i] = uniform();
    for (size_t s = 0; s < COUNT; s++) {
        double u = uniform() * 2, v = uniform() * 2;
        int f = s % 3 == 0;
        for (int i = 0; i < N; i++)
            signal[s * N + (size_t)i] = (float)(base[f][0][i] + u * base[f][1][i] + v * base[f][2][i]);
    }
    struct dph_cpca *cpca = compress(signal, COUNT, N, 2, 2);
    assert_int_equal(cpca->clusters, 2);
    assert_true(cpca->error < 1e-6);
    for (size_t s = 0; s < COUNT; s++)
        assert_int_equal(cpca->cluster[s] == cpca->cluster[0], s % 3 == 0);
    dph_cpca_destroy(cpca);
    cpca = compress(signal, COUNT, N, 1, 2); /* which one plane cannot */
    assert_true(cpca->error > .05);
    dph_cpca_destroy(cpca);
    free(signal);
}

static void assert_same(const struct dph_cpca *a, const struct dph_cpca *b)
{
    size_t table = (size_t)(a->clusters * (1 + a->vectors) * a->n);
    assert_int_equal(a->clusters, b->clusters);
    assert_int_equal(a->iterations, b->iterations);
    assert_memory_equal(a->cluster, b->cluster, a->count * sizeof *a->cluster);
    assert_memory_equal(a->weight, b->weight, a->count * (size_t)a->vectors * sizeof *a->weight);
    assert_memory_equal(a->table, b->table, table * sizeof *a->table);
    assert_true(a->error == b->error && a->error_snorm8 == b->error_snorm8);
}

static void test_same_bytes(void **unused)
{
    (void)unused;
    enum { N = 36, COUNT = 4001 };
    float *signal = sheet(COUNT, N), *importance = malloc(COUNT * sizeof *importance);
    assert_non_null(importance);
    for (size_t s = 0; s < COUNT; s++)
        importance[s] = (float)(1.5 + uniform());
    struct dph_cpca_params params = dph_cpca_defaults();
    params.clusters = 20;
    params.vectors = 5;
    params.threads = 1;
    struct dph_cpca *one = dph_cpca_create(signal, COUNT, N, importance, &params, NULL);
    assert_non_null(one);
    static const int threads[] = {1, 2, 8};
    for (int k = 0; k < 4; k++) {
        params.threads = threads[k % 3];
        params.portable = k == 3;
        struct dph_cpca *other = dph_cpca_create(signal, COUNT, N, importance, &params, NULL);
        assert_non_null(other);
        assert_same(one, other);
        dph_cpca_destroy(other);
    }
    params.seed = 2; /* the seed does matter */
    struct dph_cpca *other = dph_cpca_create(signal, COUNT, N, importance, &params, NULL);
    assert_non_null(other);
    assert_true(other->error != one->error);
    dph_cpca_destroy(other);
    dph_cpca_destroy(one);
    free(signal);
    free(importance);
}

/* A signal that counts for nothing does not bend the others' subspace. */
static void test_importance(void **unused)
{
    (void)unused;
    enum { N = 6, COUNT = 200 };
    float signal[COUNT * N], importance[COUNT];
    state = 5;
    for (size_t s = 0; s < COUNT; s++) {
        double u = uniform();
        importance[s] = s % 4 != 0;
        for (int i = 0; i < N; i++)
            signal[s * N + (size_t)i] = (float)(s % 4 ? 1 + u * (i + 1) : 10 * uniform());
    }
    struct dph_cpca_params params = dph_cpca_defaults();
    params.clusters = 1;
    params.vectors = 1;
    struct dph_cpca *cpca = dph_cpca_create(signal, COUNT, N, importance, &params, NULL);
    assert_non_null(cpca);
    assert_true(cpca->error < 1e-6);
    dph_cpca_destroy(cpca);
}

static void test_weights_fill_bytes(void **unused)
{
    (void)unused;
    enum { N = 36, COUNT = 3000 };
    float *signal = sheet(COUNT, N);
    struct dph_cpca *cpca = compress(signal, COUNT, N, 10, 6);
    for (int c = 0; c < cpca->clusters; c++)
        for (size_t j = 0; j < 6; j++) {
            float most = 0;
            for (size_t s = 0; s < COUNT; s++)
                if (cpca->cluster[s] == c)
                    most = fmaxf(most, fabsf(cpca->weight[s * 6 + j]));
            assert_true(most == 1);
        }
    assert_true(cpca->error_snorm8 > cpca->error);
    assert_true(cpca->error_snorm8 < cpca->error + .005);
    /* orthogonal, and shares fall */
    for (int c = 0; c < cpca->clusters; c++)
        for (int j = 1; j <= 6; j++)
            for (int k = 1; k < j; k++) {
                const float *a = cpca->table + (size_t)(c * 7 + j) * N, *b = cpca->table + (size_t)(c * 7 + k) * N;
                double dot = 0, aa = 0, bb = 0;
                for (int i = 0; i < N; i++) {
                    dot += (double)a[i] * (double)b[i];
                    aa += (double)a[i] * (double)a[i];
                    bb += (double)b[i] * (double)b[i];
                }
                assert_true(dot * dot < 1e-10 * aa * bb);
            }
    assert_int_equal(dph_cpca_snorm8(1), 127);
    assert_int_equal(dph_cpca_snorm8(-1), -127);
    assert_int_equal(dph_cpca_snorm8(-2), -127);
    assert_int_equal(dph_cpca_snorm8(.5f / 127), 1);
    assert_int_equal(dph_cpca_snorm8(.49f / 127), 0);

    /* thickness of it: a row a vertex, unpacked as compressed */
    uint32_t row_of[4] = {5, 17, 5, 2999};
    struct dph_thickness *t = dph_cpca_thickness(cpca, 6, row_of, 4, NULL);
    assert_non_null(t);
    assert_int_equal(dph_thickness_payload(t), 7);
    assert_int_equal(dph_thickness_fetched(t), 12);
    assert_int_equal(dph_thickness_shared(t), (size_t)cpca->clusters * 7 * N * 4);
    for (size_t v = 0; v < 4; v++) {
        float row[N], exact[N];
        dph_thickness_row(t, v, row);
        dph_cpca_row(cpca, row_of[v], exact);
        for (int i = 0; i < N; i++)
            assert_true(fabsf(row[i] - exact[i]) < .05f);
        for (size_t j = 6; j < 8; j++)
            assert_int_equal(((int8_t *)t->data)[v * 8 + j], 0);
    }
    dph_thickness_destroy(t);
    dph_cpca_destroy(cpca);
    free(signal);
}

static void test_degenerate(void **unused)
{
    (void)unused;
    enum { N = 9 };
    float same[100 * N], zero[50 * N] = {0}, few[3 * N], row[N];
    for (size_t s = 0; s < 100; s++)
        for (size_t i = 0; i < N; i++)
            same[s * N + i] = 1.1f * (float)i - 3.3f;
    for (size_t i = 0; i < 3 * N; i++)
        few[i] = (float)(i * i % 17);
    struct dph_cpca *cpca = compress(same, 100, N, 16, 4); /* all equal: one cluster, no weights */
    assert_int_equal(cpca->clusters, 1);
    for (size_t i = 0; i < 400; i++)
        assert_true(cpca->weight[i] == 0);
    dph_cpca_row(cpca, 50, row);
    for (size_t i = 0; i < N; i++)
        assert_true(fabsf(row[i] - same[i]) < 1e-6f);
    dph_cpca_destroy(cpca);

    cpca = compress(zero, 50, N, 16, 4);
    assert_true(cpca->error == 0 && cpca->error_snorm8 == 0);
    dph_cpca_row(cpca, 3, row);
    assert_memory_equal(row, zero, sizeof row);
    dph_cpca_destroy(cpca);

    cpca = compress(few, 3, N, 128, 8); /* fewer signals than clusters */
    assert_true(cpca->clusters >= 1 && cpca->clusters <= 3);
    assert_true(cpca->error < 1e-6);
    dph_cpca_destroy(cpca);
    cpca = compress(few, 1, N, 128, 8);
    assert_int_equal(cpca->clusters, 1);
    assert_true(cpca->error < 1e-6);
    dph_cpca_destroy(cpca);
    cpca = compress(few, 0, N, 128, 8);
    assert_int_equal(cpca->clusters, 0);
    dph_cpca_destroy(cpca);

    /* the size of the numbers changes nothing */
    float *signal = sheet(400, N), *large = malloc(400 * N * sizeof *large);
    assert_non_null(large);
    for (size_t i = 0; i < 400 * N; i++)
        large[i] = ldexpf(signal[i], 100);
    struct dph_cpca *a = compress(signal, 400, N, 4, 3), *b = compress(large, 400, N, 4, 3);
    assert_memory_equal(a->weight, b->weight, 400 * 3 * sizeof *a->weight);
    assert_true(fabs(a->error - b->error) < 1e-9);
    dph_cpca_destroy(a);
    dph_cpca_destroy(b);
    free(signal);
    free(large);
}

static bool refuse(void *user, double fraction)
{
    (void)fraction;
    return --*(int *)user > 0;
}

static void test_errors(void **unused)
{
    (void)unused;
    float signal[8] = {0, 1, 2, 3, NAN, 5, 6, 7}, importance[4] = {1, 1, -1, 1};
    struct dph_cpca_params params = dph_cpca_defaults();
    struct dph_error err = {0};
    assert_null(dph_cpca_create(signal, 4, 2, NULL, &params, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_non_null(strstr(err.message, "number 0 of signal 2"));
    signal[4] = 4;
    assert_null(dph_cpca_create(signal, 4, 2, importance, &params, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_null(dph_cpca_create(signal, 4, 0, NULL, &params, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    params.clusters = 0;
    assert_null(dph_cpca_create(signal, 4, 2, NULL, &params, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    params = dph_cpca_defaults();
    params.iterations = DPH_CPCA_MAX_ITERATIONS + 1;
    assert_null(dph_cpca_create(signal, 4, 2, NULL, &params, &err));
    params = dph_cpca_defaults();
    int left = 2;
    params.progress = refuse;
    params.progress_user = &left;
    assert_null(dph_cpca_create(signal, 4, 2, NULL, &params, &err));
    assert_int_equal(err.code, DPH_ERROR_CANCELLED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_eigen),
        cmocka_unit_test(test_all_vectors_are_exact),
        cmocka_unit_test(test_one_cluster_is_pca),
        cmocka_unit_test(test_error_falls),
        cmocka_unit_test(test_two_families),
        cmocka_unit_test(test_same_bytes),
        cmocka_unit_test(test_importance),
        cmocka_unit_test(test_weights_fill_bytes),
        cmocka_unit_test(test_degenerate),
        cmocka_unit_test(test_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
