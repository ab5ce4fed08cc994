/* Means of random numbers with their standard errors, held to what they should be.      Tests only. */
#ifndef DPH_TESTS_MEAN_H
#define DPH_TESTS_MEAN_H

#include "shapes.h"

#include <math.h>
#include <stdio.h>


/* Sums for a mean and its standard error. */
struct mean {
    double sum, square, n;
};

static inline void add(struct mean *mean, double x)
{
    mean->sum += x;
    mean->square += x * x;
    mean->n++;
}

static inline double value(const struct mean *mean)
{
    return mean->sum / mean->n;
}

static inline double deviation(const struct mean *mean)
{
    double m = value(mean);
    return sqrt(fmax(0, mean->square / mean->n - m * m) / mean->n);
}

/* Within three standard errors of `expected`, which has an error of its own. */
static inline void check(const char *what, const struct mean *mean, double expected, double error,
                  double bound)
{
    double e = deviation(mean), difference = value(mean) - expected;
    if (UNDER_SANITIZER)
        bound *= 5;
    printf("    %-44s %.5f, expected %.5f, %+.1f standard errors of %.5f\n", what, value(mean),
           expected, difference / sqrt(e * e + error * error), e);
    assert_true(e < bound);
    assert_true(fabs(difference) <= 3 * sqrt(e * e + error * error));
}

#endif
