/* Packed storage: round trip, error bounds, scales, shared rows, hostile values. */
#include "sh_oracle.h"

#include <diaphan/thickness.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { ROWS = 100 };

/* Rows whose bands shrink, as those of thickness do, in any unit. */
static float *make_rows(int bands, double unit)
{
    int n = bands * bands;
    float *c = malloc((size_t)(ROWS * n) * sizeof *c);
    uint64_t seed = 11;
    assert_non_null(c);
    for (int r = 0; r < ROWS; r++)
        for (int l = 0; l < bands; l++)
            for (int i = l * l; i < (l + 1) * (l + 1); i++)
                c[r * n + i] = (float)(unit * (2 * oracle_random(&seed) - 1) / (1 + l * l));
    return c;
}

static void test_round_trip(void **state)
{
    (void)state;
    static const double units[] = {1e-30, 1e-6, 1, 1e6};
    static const int steps[] = {0, 32767, 127};
    for (int bands = 1; bands <= DPH_MAX_BANDS; bands++) {
        for (int u = 0; u < 4; u++) {
            int n = bands * bands;
            float *c = make_rows(bands, units[u]), out[64];
            for (int store = DPH_STORE_FLOAT; store <= DPH_STORE_SNORM8; store++) {
                struct dph_thickness *t = dph_thickness_create(c, ROWS, bands, NULL, ROWS,
                                                               (enum dph_store)store, NULL);
                assert_non_null(t);
                assert_int_equal(t->components, (n + 3) / 4 * 4);
                for (int r = 0; r < ROWS; r++) {
                    dph_thickness_row(t, (size_t)r, out);
                    for (int l = 0; l < bands; l++)
                        for (int i = l * l; i < (l + 1) * (l + 1); i++) {
                            double wrong = fabs((double)out[i] - c[r * n + i]);
                            double bound = steps[store] ? t->scale[l] * .5 / steps[store] : 0;
                            assert_true(wrong <= bound * 1.0001 + 1e-7 * fabs((double)out[i])
                                                     * (steps[store] != 0));
                        }
                }
                dph_thickness_destroy(t);
            }
            free(c);
        }
    }
}

/* The scale is the largest magnitude of the band, which comes back exactly; components beyond n are
 * 0. */
static void test_scale_and_padding(void **state)
{
    (void)state;
    enum { BANDS = 5, N = 25 };
    float *c = make_rows(BANDS, 3), out[64];
    c[7 * N + 18] = -9.75f;
    struct dph_thickness *t = dph_thickness_create(c, ROWS, BANDS, NULL, ROWS, DPH_STORE_SNORM8,
                                                   NULL);
    assert_non_null(t);
    assert_true(t->scale[4] == 9.75f && t->scale[5] == 1 && t->scale[7] == 1);
    assert_int_equal(((int8_t *)t->data)[7 * 28 + 18], -127);
    dph_thickness_row(t, 7, out);
    assert_true(out[18] == -9.75f);
    for (int r = 0; r < ROWS; r++)
        for (int i = N; i < 28; i++)
            assert_int_equal(((int8_t *)t->data)[r * 28 + i], 0);
    for (int l = 0; l < BANDS; l++) {
        float most = 0;
        for (int r = 0; r < ROWS; r++)
            for (int i = l * l; i < (l + 1) * (l + 1); i++)
                most = fmaxf(most, fabsf(c[r * N + i]));
        assert_true(t->scale[l] == most);
    }
    dph_thickness_destroy(t);
    free(c);
}

/* Vertices at one position share its row; rows that no vertex uses have no say in the scale. */
static void test_shared_rows(void **state)
{
    (void)state;
    enum { BANDS = 2, N = 4 };
    float *c = make_rows(BANDS, 1);
    uint32_t row_of[300];
    for (uint32_t v = 0; v < 300; v++)
        row_of[v] = v * 7 % 50; /* rows 50 to 99 unused */
    c[60 * N + 2] = 1e9f;
    struct dph_thickness *t = dph_thickness_create(c, ROWS, BANDS, row_of, 300, DPH_STORE_SNORM16,
                                                   NULL);
    assert_non_null(t);
    assert_int_equal(t->nvert, 300);
    assert_true(t->scale[1] < 2);
    for (size_t v = 0; v < 300; v++) {
        float out[4];
        dph_thickness_row(t, v, out);
        for (int i = 0; i < N; i++)
            assert_true(fabsf(out[i] - c[row_of[v] * N + (uint32_t)i]) < 1e-4f);
    }
    dph_thickness_destroy(t);
    free(c);
}

/* Nothing to store, and values that no bake gives: no division by zero, no undefined conversion. */
static void test_degenerate(void **state)
{
    (void)state;
    float zero[2 * 36] = {0}, out[36], wild[4] = {NAN, INFINITY, -3, 1e-42f};
    struct dph_thickness *t = dph_thickness_create(zero, 2, 6, NULL, 2, DPH_STORE_SNORM8, NULL);
    assert_non_null(t);
    for (int l = 0; l < 6; l++)
        assert_true(t->scale[l] == 1);
    dph_thickness_row(t, 1, out);
    for (int i = 0; i < 36; i++)
        assert_true(out[i] == 0);
    dph_thickness_destroy(t);
    for (int store = DPH_STORE_FLOAT; store <= DPH_STORE_SNORM8; store++) {
        t = dph_thickness_create(wild, 1, 2, NULL, 1, (enum dph_store)store, NULL);
        assert_non_null(t);
        dph_thickness_destroy(t);
        t = dph_thickness_create(NULL, 0, 2, NULL, 0, (enum dph_store)store, NULL);
        assert_non_null(t);
        dph_thickness_destroy(t);
    }
    dph_thickness_destroy(NULL);
}

/* The value along a direction is the sum of coefficient times function. */
static void test_along(void **state)
{
    (void)state;
    float *c = make_rows(6, 1);
    double w[3], y[36];
    uint64_t seed = 12;
    struct dph_thickness *t = dph_thickness_create(c, ROWS, 6, NULL, ROWS, DPH_STORE_FLOAT, NULL);
    assert_non_null(t);
    for (size_t v = 0; v < ROWS; v++) {
        double sum = 0;
        oracle_direction(&seed, w);
        dph_sh_eval(6, w, y);
        for (int i = 0; i < 36; i++)
            sum += c[v * 36 + (size_t)i] * y[i];
        assert_true(fabs(dph_thickness_along(t, v, w) - sum) < 1e-12);
    }
    dph_thickness_destroy(t);
    free(c);
}

static void test_names(void **state)
{
    (void)state;
    assert_string_equal(dph_definition_name(DPH_THICKNESS_FARTHEST), "farthest");
    assert_null(dph_definition_name((enum dph_definition)3));
    assert_string_equal(dph_fit_name(DPH_FIT_WEIGHTED), "weighted");
    assert_null(dph_fit_name((enum dph_fit)2));
    assert_string_equal(dph_store_name(DPH_STORE_SNORM16), "snorm16");
    assert_null(dph_store_name((enum dph_store)4));
    assert_int_equal(dph_store_size(DPH_STORE_SNORM8), 1);
    assert_int_equal(dph_store_size(DPH_STORE_SNORM16), 2);
    assert_int_equal(dph_store_size(DPH_STORE_FLOAT), 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_scale_and_padding),
        cmocka_unit_test(test_shared_rows),
        cmocka_unit_test(test_degenerate),
        cmocka_unit_test(test_along),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
