/* sh/accumulate.h - the inner loop of projection: sums += table^T values.      Tier 1, private to
 * the kernels of sh.
 *
 * A matrix product lives from reuse in registers. One call adds up to 32 pairs for 16 positions;
 * the values of these lie in the first cache as rows of 16, and up to 6 columns of 16 positions are
 * summed in 12 registers: 6 numbers of the table and 2 rows of values are loaded for 12 products,
 * which keeps the arithmetic units busy and not the load units. Every sum takes its terms in the
 * order of the pairs, one product and one addition each. */
#ifndef DPH_SH_ACCUMULATE_H
#define DPH_SH_ACCUMULATE_H

#include "core/simd.h"

#include <stddef.h>

enum { TILE_PAIRS = 32, TILE_LANES = 16, GROUP = 6 };

/* `columns` (a constant, 1 to GROUP) columns of one or two blocks of 8 positions. Sums of a column
 * are 8 floats apart. */
static inline __attribute__((always_inline)) void
accumulate_group(const int columns, const bool two, int count, const float *value,
                 const float *table, int width, float *sums0, float *sums1)
{
    const dph_f8 zero = dph_f8_set(0);
    dph_f8 a0 = zero, a1 = zero, a2 = zero, a3 = zero, a4 = zero, a5 = zero;
    dph_f8 b0 = zero, b1 = zero, b2 = zero, b3 = zero, b4 = zero, b5 = zero;
#define FOR_COLUMNS(F) F(0) F(1) F(2) F(3) F(4) F(5)
#define LOAD(i)                                                                                    \
    if (columns > i) {                                                                             \
        a##i = dph_f8_load(sums0 + 8 * i);                                                         \
        if (two)                                                                                   \
            b##i = dph_f8_load(sums1 + 8 * i);                                                     \
    }
#define STEP(i)                                                                                    \
    if (columns > i) {                                                                             \
        dph_f8 y = dph_f8_set(table[i]);                                                           \
        a##i += y * v0;                                                                            \
        if (two)                                                                                   \
            b##i += y * v1;                                                                        \
    }
#define STORE(i)                                                                                   \
    if (columns > i) {                                                                             \
        dph_f8_store(sums0 + 8 * i, a##i);                                                         \
        if (two)                                                                                   \
            dph_f8_store(sums1 + 8 * i, b##i);                                                     \
    }
    FOR_COLUMNS(LOAD)
    for (int k = 0; k < count; k++, value += TILE_LANES, table += width) {
        dph_f8 v0 = dph_f8_load(value), v1 = two ? dph_f8_load(value + 8) : zero;
        FOR_COLUMNS(STEP)
        (void)v1;
    }
    FOR_COLUMNS(STORE)
#undef FOR_COLUMNS
#undef LOAD
#undef STEP
#undef STORE
}

/* Adds `count` pairs to `columns` sums of 8 positions at sums0 and, unless NULL, of the next 8 at
 * sums1. `value` (count x 16), `table` (count x width). */
static inline void accumulate(int columns, int count, const float *value, const float *table,
                              int width, float *sums0, float *sums1)
{
    int groups = (columns + GROUP - 1) / GROUP;
    for (int g = 0, done = 0; g < groups; g++) {
        int n = (columns - done + groups - g - 1) / (groups - g);
        const float *t = table + done;
        float *s0 = sums0 + 8 * done, *s1 = sums1 ? sums1 + 8 * done : NULL;
#define CASE(N)                                                                                    \
    case N:                                                                                        \
        if (s1)                                                                                    \
            accumulate_group(N, true, count, value, t, width, s0, s1);                             \
        else                                                                                       \
            accumulate_group(N, false, count, value, t, width, s0, s0);                            \
        break;
        switch (n) {
            CASE(1)
            CASE(2)
            CASE(3)
            CASE(4)
            CASE(5)
            CASE(6)
        }
#undef CASE
        done += n;
    }
}

#endif
