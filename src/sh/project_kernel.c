/* Plain projection: c_i = (4 pi / N) sum over directions of T(d) y_i(d), many positions at once
 * (see sh/project.h).
 *
 * A function of even degree has equal values at d and -d, one of odd degree opposite values, so a
 * pair of directions enters as T(d) + T(-d) in the sums of even degree and as T(d) - T(-d) in those
 * of odd degree: half the products. Sums and differences of a tile of 32 pairs and 16 positions are
 * formed once, in the first cache, where the columns of the panel (which are far apart, and would
 * evict each other) are touched once. */
#include "core/simd.h"
#include "sh/accumulate.h"
#include "sh/projector.h"

void DPH_KERNEL(dph_project_add)(const struct dph_projector *projector, int first, int count,
                                 const float *plus, const float *minus, size_t stride,
                                 const float *normal, size_t begin, size_t end, float *sums)
{
    (void)normal;
    float even[TILE_PAIRS * TILE_LANES], odd[TILE_PAIRS * TILE_LANES];
    const size_t columns = (size_t)(projector->even + projector->odd);

    for (int done = 0; done < count; done += TILE_PAIRS) {
        int pairs = count - done < TILE_PAIRS ? count - done : TILE_PAIRS;
        size_t pair = (size_t)(first + done);
        const float *even_table = projector->even_table + pair * (size_t)projector->table_even;
        const float *odd_table = projector->odd_table + pair * (size_t)projector->table_odd;
        for (size_t p = begin; p < end; p += TILE_LANES) {
            size_t lanes = end - p < TILE_LANES ? 8 : TILE_LANES;
            for (int k = 0; k < pairs; k++) {
                size_t column = (size_t)(done + k) * stride + p;
                if (p + TILE_LANES < end) { /* too many columns for the processor to foresee */
                    __builtin_prefetch(plus + column + TILE_LANES);
                    __builtin_prefetch(minus + column + TILE_LANES);
                }
                for (size_t lane = 0; lane < lanes; lane += 8) {
                    dph_f8 a = dph_f8_load(plus + column + lane);
                    dph_f8 b = dph_f8_load(minus + column + lane);
                    dph_f8_store(even + k * TILE_LANES + lane, a + b);
                    dph_f8_store(odd + k * TILE_LANES + lane, a - b);
                }
            }
            float *s0 = sums + p * columns, *s1 = lanes > 8 ? s0 + 8 * columns : NULL;
            size_t skip = 8 * (size_t)projector->even;
            accumulate(projector->even, pairs, even, even_table, projector->table_even, s0, s1);
            accumulate(projector->odd, pairs, odd, odd_table, projector->table_odd, s0 + skip,
                       s1 ? s1 + skip : NULL);
        }
    }
}

void DPH_KERNEL(dph_project_solve)(const struct dph_projector *projector, const float *sums,
                                   size_t begin, size_t end, float *coefficient)
{
    const size_t n = (size_t)(projector->even + projector->odd);
    for (size_t p = begin; p < end; p += 8)
        for (size_t i = 0; i < n; i++)
            for (size_t lane = 0; lane < 8; lane++)
                coefficient[(p + lane) * n + i] =
                    projector->scale * sums[p * n + 8 * (size_t)projector->column[i] + lane];
}
