/* sh_oracle.h - what the tests of spherical harmonics compare with: exact quadrature, Legendre
 * polynomials, random directions. Written apart from the library on purpose. */
#ifndef DPH_TESTS_SH_ORACLE_H
#define DPH_TESTS_SH_ORACLE_H

#include <math.h>
#include <stdint.h>

#define ORACLE_PI 3.14159265358979323846

/* Uniform in [0, 1), splitmix64. */
static inline double oracle_random(uint64_t *seed)
{
    uint64_t x = *seed += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (double)((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

/* Uniform on the unit sphere. */
static inline void oracle_direction(uint64_t *seed, double w[3])
{
    double z = 2 * oracle_random(seed) - 1, phi = 2 * ORACLE_PI * oracle_random(seed);
    double r = sqrt(1 - z * z);
    w[0] = r * cos(phi);
    w[1] = r * sin(phi);
    w[2] = z;
}

/* A random rotation: two orthogonal directions and their cross product as rows. */
static inline void oracle_rotation(uint64_t *seed, double m[3][3])
{
    oracle_direction(seed, m[0]);
    oracle_direction(seed, m[1]);
    double along = m[0][0] * m[1][0] + m[0][1] * m[1][1] + m[0][2] * m[1][2], length = 0;
    for (int i = 0; i < 3; i++) {
        m[1][i] -= along * m[0][i];
        length += m[1][i] * m[1][i];
    }
    for (int i = 0; i < 3; i++)
        m[1][i] /= sqrt(length);
    for (int i = 0; i < 3; i++)
        m[2][i] = m[0][(i + 1) % 3] * m[1][(i + 2) % 3] - m[0][(i + 2) % 3] * m[1][(i + 1) % 3];
}

static inline double oracle_legendre(int l, double x)
{
    double before = 1, p = x;
    if (l == 0)
        return 1;
    for (int k = 2; k <= l; k++) {
        double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
        before = p;
        p = next;
    }
    return p;
}

/* Nodes and weights of Gauss and Legendre on [-1, 1] by Newton's method. */
static inline void oracle_gauss_legendre(int n, double *x, double *weight)
{
    for (int i = 0; i < n; i++) {
        double z = cos(ORACLE_PI * (i + .75) / (n + .5)), slope = 1;
        for (int step = 0; step < 20; step++) {
            slope = n * (z * oracle_legendre(n, z) - oracle_legendre(n - 1, z)) / (z * z - 1);
            z -= oracle_legendre(n, z) / slope;
        }
        x[i] = z;
        weight[i] = 2 / ((1 - z * z) * slope * slope);
    }
}

#endif
