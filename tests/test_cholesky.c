/* Symmetric positive definite systems: exact answers, and equations that say nothing. */
#include "core/cholesky.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { MOST = 24 };

/* A Lehmer matrix, min(i, j) / max(i, j), has a tridiagonal inverse, so that its condition grows no
 * faster than 4 n^2 (D. H. Lehmer, problem E710, 1946). */
static double lehmer(int i, int j)
{
    return i < j ? (i + 1.) / (j + 1) : (j + 1.) / (i + 1);
}

static void test_exact(void **state)
{
    (void)state;
    for (int n = 1; n <= MOST; n++) {
        double matrix[MOST * (MOST + 1) / 2], x[MOST] = {0};
        for (int i = 0, k = 0; i < n; i++) {
            for (int j = 0; j <= i; j++)
                matrix[k++] = lehmer(i, j);
            for (int j = 0; j < n; j++)
                x[i] += lehmer(i, j) * (j % 3 - 1.5);
        }
        assert_true(dph_cholesky_solve(n, matrix, x));
        for (int i = 0; i < n; i++)
            assert_true(fabs(x[i] - (i % 3 - 1.5)) < 1e-12);
    }
}

/* One unknown counted twice, and one that nothing speaks of: those are 0, the others solve what is
 * left. */
static void test_semidefinite(void **state)
{
    (void)state;
    const double system[] = {4, /**/ 4, 4, /**/ 0, 0, 0, /**/ 2, 2, 0, 5};
    double matrix[10], x[4] = {10, 10, 0, 13};
    memcpy(matrix, system, sizeof matrix);
    assert_false(dph_cholesky_solve(4, matrix, x));
    assert_true(fabs(x[0] - 1.5) < 1e-12);
    assert_true(x[1] == 0 && x[2] == 0);
    assert_true(fabs(x[3] - 2) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_exact),
                                       cmocka_unit_test(test_semidefinite)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
