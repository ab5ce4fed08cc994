/* The weighted fit: coefficients that care for the directions light comes through.
 *
 * Drawing turns thickness S into a transmittance that falls like exp(-s S), so an error dS does
 * harm in proportion to exp(-s S): beyond a few 1/s all lengths look alike, and a plain projection
 * wastes its coefficients on them. The fit minimizes, over the full sphere,
 *
 *     sum over directions of w(d) (sum_i c_i y_i(d) - t(d))^2 + r |c|^2,
 *     t = min(S, 4 / s),   w = (exp(-2 s S) + .02) (.3 where n.d > 0, else 1),   r = 1e-3 mean(w) N / 4 pi.
 *
 * The floor .02 keeps dark directions from running away. The light is in front where n.d > 0: less
 * is seen there, but soft shadows are, so these directions keep a third of their weight. (Weights
 * of this kind: P.-P. Sloan, J. Hall, J. Hart and J. Snyder, "Clustered Principal Components for
 * Precomputed Radiance Transfer", 2003, fit to the visible hemisphere.)
 *
 * The normal equations (A + r) c = b have A_ij = sum w y_i y_j: a matrix a position, of 666
 * different sums over the directions for 6 bands. But y_i y_j is itself a short sum of functions of
 * up to twice the degree (sh/gaunt.c), hence
 *
 *     A_ij = sum_LM G(i, j; LM) W_LM,     W_LM = sum over directions of w y_LM,
 *
 * exactly, for any directions: 121 sums, with pairs of directions sharing their products as in
 * plain projection, and the matrix is expanded once a position. It is factored as L D L^T. In exact
 * arithmetic no pivot is below r; keeping them there makes rounding harmless where the samples
 * hardly determine a coefficient. Eight positions share each operation. */
#include "core/simd.h"
#include "sh/accumulate.h"
#include "sh/projector.h"
#include "sh/system.h"

#define FLOOR .02f
#define FRONT .3f
#define RIDGE 1e-3f

enum { MAX_N = DPH_MAX_BANDS * DPH_MAX_BANDS };

/* The weights of 8 samples. Samples below 0 are rounding. */
static inline dph_f8 weigh(dph_f8 sample, dph_f8 rate, dph_i8 front)
{
    dph_f8 x = dph_f8_min(dph_f8_max(sample * rate, dph_f8_set(-80)), dph_f8_set(0));
    dph_f8 w = dph_f8_exp(x) + dph_f8_set(FLOOR);
    return w * dph_f8_select(front, dph_f8_set(FRONT), dph_f8_set(1));
}

/* What a tile of pairs adds, a row of 16 positions a pair: w(d) + w(-d), w(d) - w(-d), and the same
 * of w t. */
struct tile {
    float even[TILE_PAIRS * TILE_LANES], odd[TILE_PAIRS * TILE_LANES];
    float even_target[TILE_PAIRS * TILE_LANES], odd_target[TILE_PAIRS * TILE_LANES];
};

static inline void fill_tile(struct tile *tile, const struct dph_projector *projector, size_t pair,
                             int pairs, const float *plus, const float *minus, size_t stride,
                             const float *normal, size_t lane)
{
    const dph_f8 rate = dph_f8_set(projector->rate), limit = dph_f8_set(projector->limit);
    const dph_f8 zero = dph_f8_set(0);
    dph_f8 n[3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 8; j++)
            n[i][j] = normal[3 * j + i];
    for (int k = 0; k < pairs; k++) {
        const float *d = projector->direction + 3 * (pair + (size_t)k);
        dph_f8 cosine = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
        dph_f8 a = dph_f8_load(plus + (size_t)k * stride);
        dph_f8 b = dph_f8_load(minus + (size_t)k * stride);
        dph_f8 wa = weigh(a, rate, cosine > zero), wb = weigh(b, rate, cosine < zero);
        dph_f8 ta = wa * dph_f8_min(a, limit), tb = wb * dph_f8_min(b, limit);
        size_t at = (size_t)k * TILE_LANES + lane;
        dph_f8_store(tile->even + at, wa + wb);
        dph_f8_store(tile->odd + at, wa - wb);
        dph_f8_store(tile->even_target + at, ta + tb);
        dph_f8_store(tile->odd_target + at, ta - tb);
    }
}

void DPH_KERNEL(dph_fit_add)(const struct dph_projector *projector, int first, int count,
                             const float *plus, const float *minus, size_t stride,
                             const float *normal, size_t begin, size_t end, float *sums)
{
    struct tile tile;
    const int even = projector->table_even, odd = projector->table_odd;
    const size_t columns = (size_t)(even + odd + projector->even + projector->odd);

    for (int done = 0; done < count; done += TILE_PAIRS) {
        int pairs = count - done < TILE_PAIRS ? count - done : TILE_PAIRS;
        size_t pair = (size_t)(first + done);
        const float *even_table = projector->even_table + pair * (size_t)even;
        const float *odd_table = projector->odd_table + pair * (size_t)odd;
        for (size_t p = begin; p < end; p += TILE_LANES) {
            size_t lanes = end - p < TILE_LANES ? 8 : TILE_LANES;
            for (size_t lane = 0; lane < lanes; lane += 8) {
                size_t column = (size_t)done * stride + p + lane;
                fill_tile(&tile, projector, pair, pairs, plus + column, minus + column, stride,
                          normal + 3 * (p + lane), lane);
            }
            float *s0 = sums + p * columns, *s1 = lanes > 8 ? s0 + 8 * columns : NULL;
            const struct {
                int columns;
                const float *value, *table;
                int width;
            } parts[4] = {
                {even, tile.even, even_table, even},
                {odd, tile.odd, odd_table, odd},
                {projector->even, tile.even_target, even_table, even},
                {projector->odd, tile.odd_target, odd_table, odd},
            };
            for (int i = 0; i < 4; i++) {
                accumulate(parts[i].columns, pairs, parts[i].value, parts[i].table, parts[i].width,
                           s0, s1);
                s0 += 8 * parts[i].columns;
                s1 = s1 ? s1 + 8 * parts[i].columns : NULL;
            }
        }
    }
}

/* The lower triangle of A + ridge, row after row, from the sums of w y. */
static void expand_matrix(const struct dph_gaunt *gaunt, int n, const float *weights, dph_f8 ridge,
                          dph_f8 *matrix)
{
    const uint16_t *index = gaunt->index;
    const float *factor = gaunt->factor;
    int pair = 0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++, pair++) {
            dph_f8 sum = i == j ? ridge : dph_f8_set(0);
            for (uint32_t t = gaunt->start[pair]; t < gaunt->start[pair + 1]; t++)
                sum += factor[t] * dph_f8_load(weights + 8 * index[t]);
            matrix[pair] = sum;
        }
    }
}

void DPH_KERNEL(dph_fit_solve)(const struct dph_projector *projector, const float *sums,
                               size_t begin, size_t end, float *coefficient)
{
    dph_f8 matrix[MAX_N * (MAX_N + 1) / 2], x[MAX_N];
    const int n = projector->even + projector->odd;
    const size_t weights = (size_t)(projector->table_even + projector->table_odd);
    const size_t columns = weights + (size_t)n;
    /* The first column of sums is that of y_00 = 1 / sqrt(4 pi), so mean(w) N / 4 pi is that sum
     * over sqrt(4 pi). The factor 4 pi / N that would make the mean of y_i y_j the unit matrix is
     * left out on both sides of the equation. */
    const dph_f8 ridge_of_sum = dph_f8_set(RIDGE * 0.28209479177f);
    /* a position that got no sample at all */
    const dph_f8 smallest = dph_f8_set(1e-30f);

    for (size_t p = begin; p < end; p += 8) {
        const float *block = sums + p * columns;
        dph_f8 ridge = dph_f8_max(dph_f8_load(block) * ridge_of_sum, smallest);
        expand_matrix(&projector->gaunt, n, block, ridge, matrix);
        for (int i = 0; i < n; i++)
            x[i] = dph_f8_load(block + 8 * (weights + (size_t)projector->column[i]));
        dph_system_solve(n, matrix, ridge, x);
        for (size_t lane = 0; lane < 8; lane++)
            for (int i = 0; i < n; i++)
                coefficient[(p + lane) * (size_t)n + (size_t)i] = x[i][lane];
    }
}
