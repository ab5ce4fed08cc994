/* core/simd.h - eight lanes at once, in one source for every processor.      Tier 0, private.
 *
 * Kernels are written with the vector extension of gcc and clang and compiled twice (cmake:
 * dph_add_kernel): with AVX2, where eight lanes are one register, and plainly. Both do the same
 * IEEE operations in the same order, without fused multiply-add, so their results are equal to the
 * bit. A kernel's functions are named DPH_KERNEL(name), which adds _avx2 or _portable; the
 * dispatching file declares both and asks dph_cpu_has_avx2() once. */
#ifndef DPH_CORE_SIMD_H
#define DPH_CORE_SIMD_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

typedef float dph_f8 __attribute__((vector_size(32)));
typedef int32_t dph_i8 __attribute__((vector_size(32)));

#define DPH_JOIN2(a, b) a##b
#define DPH_JOIN(a, b) DPH_JOIN2(a, b)
#ifdef DPH_KERNEL_SUFFIX
#define DPH_KERNEL(name) DPH_JOIN(name, DPH_KERNEL_SUFFIX)
#endif

static inline dph_f8 dph_f8_load(const float *p)
{
    dph_f8 v;
    memcpy(&v, p, sizeof v);
    return v;
}

static inline void dph_f8_store(float *p, dph_f8 v)
{
    memcpy(p, &v, sizeof v);
}

static inline dph_f8 dph_f8_set(float x)
{
    return (dph_f8){x, x, x, x, x, x, x, x};
}

static inline dph_i8 dph_i8_set(int32_t x)
{
    return (dph_i8){x, x, x, x, x, x, x, x};
}

/* a where the mask's lane is all ones, 0 elsewhere */
static inline dph_f8 dph_f8_and(dph_f8 a, dph_i8 mask)
{
    return (dph_f8)((dph_i8)a & mask);
}

/* mask ? a : b */
static inline dph_f8 dph_f8_select(dph_i8 mask, dph_f8 a, dph_f8 b)
{
    return (dph_f8)(((dph_i8)a & mask) | ((dph_i8)b & ~mask));
}

static inline dph_f8 dph_f8_min(dph_f8 a, dph_f8 b)
{
    return dph_f8_select(a < b, a, b);
}

static inline dph_f8 dph_f8_max(dph_f8 a, dph_f8 b)
{
    return dph_f8_select(a > b, a, b);
}

/* exp(x) for -80 <= x <= 80, to 2e-7 of the value. With k the integer nearest to x / ln 2, exp(x) =
 * 2^k exp(r), |r| <= ln(2) / 2; exp(r) is its Taylor polynomial of degree 6 (the rest is r^7 / 5040
 * < 1.2e-7) and ln 2 is taken off in two parts, the first with so few bits that its product with k
 * is exact. Adding 1.5 * 2^23 rounds to an integer and leaves it in the low bits. */
static inline dph_f8 dph_f8_exp(dph_f8 x)
{
    const dph_f8 shift = dph_f8_set(12582912.0f);
    dph_f8 shifted = x * dph_f8_set(1.44269504f) + shift;
    dph_f8 k = shifted - shift;
    dph_f8 r = x - k * dph_f8_set(0.693359375f) - k * dph_f8_set(-2.12194440e-4f);
    dph_f8 p = dph_f8_set(1.0f / 720);
    p = p * r + dph_f8_set(1.0f / 120);
    p = p * r + dph_f8_set(1.0f / 24);
    p = p * r + dph_f8_set(1.0f / 6);
    p = p * r + dph_f8_set(0.5f);
    p = p * r + dph_f8_set(1.0f);
    p = p * r + dph_f8_set(1.0f);
    dph_i8 exponent = (dph_i8)shifted - (dph_i8)shift + dph_i8_set(127);
    return p * (dph_f8)(exponent << 23);
}

/* True where the processor (and the system) run AVX2 code and this build has it. */
bool dph_cpu_has_avx2(void);

#endif
