/* The inner loops of the sweep (see sweep.c for the whole story). Compiled once with AVX2 and
 * once without; equal to the bit.
 *
 * Crossings. Seen along the direction, a position p lies in a projected triangle or not, and the
 * answers of all triangles must fit together: on a closed mesh every p has to be covered by as
 * many triangles that face one way as the other, whatever is rounded. So coverage is put
 * together from the edges, each of which gives both of its triangles the same number: the
 * corners of a triangle are sorted by y into lo, mid, hi; p is in the triangle's range where
 * lo.y <= p.y < hi.y; there it is compared with the long edge lo-hi and with one short edge,
 * lo-mid or mid-hi; it is inside where it is strictly left of exactly one of the two. An edge is
 * always evaluated upwards from its lower end, as cross(hi - lo, p - lo) > 0, so the sign does
 * not depend on the triangle that asks, and the crossings of the edges around any closed surface
 * cancel, even where roundings of neighbouring edges contradict each other. (This is the winding
 * number by edge crossings, as for polygons, a half-open interval in y and a strict comparison
 * in x.)
 *
 * Bounds. Rounding is monotone, hence p right of both ends of an edge is never found left of it,
 * and p left of both ends is found left of it except where the two products are equal to the
 * last bit; a margin of 1e-6 on the left covers that. */
#include "bake/sweep_kernel.h"
#include "core/simd.h"

#include <math.h>

enum { BLOCK = 64, ITEMS = 512 };

/* Triangles with their corners sorted by projected y, and what is needed to test eight positions
 * against one of them. Lengths of the array: one entry a triangle of the block. */
struct dph_sweep_block {
    float x0[BLOCK], y0[BLOCK], z0[BLOCK]; /* lo                                                    */
    float x1[BLOCK], y1[BLOCK];            /* mid                                                   */
    float y2[BLOCK];                       /* hi                                                    */
    float dx02[BLOCK], dy02[BLOCK], dx01[BLOCK], dy01[BLOCK], dx12[BLOCK], dy12[BLOCK]; /* edges, upwards */
    float slope_x[BLOCK], slope_y[BLOCK];  /* of depth over x and y                                 */
    float z_min[BLOCK], z_max[BLOCK];
    int32_t slot0[BLOCK], slot1[BLOCK], slot2[BLOCK]; /* of lo, mid, hi                             */
    int32_t skipped[BLOCK];                /* slot1 where a position's own triangles do not matter, else -1 */
    int32_t odd[BLOCK];                    /* -1 where sorting by y turned the corners' order, else 0 */
    int32_t steep[BLOCK];                  /* -1 where depth needs double precision, else 0         */
    int32_t column0[BLOCK], column1[BLOCK], row0[BLOCK], row1[BLOCK]; /* cells that the box covers  */
    int32_t cell[BLOCK];                   /* the first of them                                     */
    uint64_t item[ITEMS];                  /* see pack_item                                         */
    /* Items with a crossing: bit i for slot + i. */
    struct hit {
        uint32_t slot;
        uint16_t triangle;
        uint8_t covered, leaves; /* crossed; the crossing leaves matter along +d                   */
    } hit[ITEMS];
    int32_t first; /* the block's first triangle                                                  */
};

static const dph_i8 lanes = {0, 1, 2, 3, 4, 5, 6, 7};
static const dph_i8 lane_bits = {1, 2, 4, 8, 16, 32, 64, 128};

static inline unsigned bits_of(dph_i8 mask)
{
#ifdef __AVX2__
    return (unsigned)__builtin_ia32_movmskps256((dph_f8)mask);
#else
    unsigned bits = 0;
    for (int i = 0; i < 8; i++)
        bits |= (unsigned)(mask[i] & 1) << i;
    return bits;
#endif
}

static inline dph_f8 min8(dph_f8 a, dph_f8 b)
{
    return dph_f8_select(a < b, a, b);
}

static inline dph_f8 max8(dph_f8 a, dph_f8 b)
{
    return dph_f8_select(a > b, a, b);
}

static inline dph_f8 abs8(dph_f8 a)
{
    return (dph_f8)((dph_i8)a & 0x7fffffff);
}

static inline dph_i8 load_i8(const int32_t *p)
{
    dph_i8 v;
    memcpy(&v, p, sizeof v);
    return v;
}

static inline void store_i8(int32_t *p, dph_i8 v)
{
    memcpy(p, &v, sizeof v);
}

/* Numbers of cells. */
static inline dph_i8 cell_of(const struct dph_sweep_grid *grid, dph_i8 column, dph_i8 row)
{
    dph_i8 strip = column >> grid->shift;
    return ((strip * grid->rows + row) << grid->shift) + (column - (strip << grid->shift));
}

/* Positions into the direction's frame, counting-sorted into the grid. */
static void project(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                    const struct dph_sweep_frame *frame)
{
    const float *u = frame->u, *v = frame->v, *w = frame->w;
    float *rx = scratch->sx, *ry = scratch->sy, *rz = scratch->sz; /* until they are sorted */
    size_t npos = sweep->npos;
    dph_f8 x_min = dph_f8_set(2), x_max = dph_f8_set(-2), y_min = x_min, y_max = x_max;
    for (size_t i = 0; i < npos; i += 8) {
        dph_f8 x = dph_f8_load(sweep->x + i), y = dph_f8_load(sweep->y + i);
        dph_f8 z = dph_f8_load(sweep->z + i);
        dph_f8 px = x * u[0] + y * u[1] + z * u[2];
        dph_f8 py = x * v[0] + y * v[1] + z * v[2];
        dph_f8 pz = x * w[0] + y * w[1] + z * w[2];
        x_min = min8(x_min, px), x_max = max8(x_max, px);
        y_min = min8(y_min, py), y_max = max8(y_max, py);
        dph_f8_store(rx + i, px);
        dph_f8_store(ry + i, py);
        dph_f8_store(rz + i, pz);
    }
    float left = 2, right = -2, bottom = 2, top = -2;
    for (int i = 0; i < 8; i++) {
        left = fminf(left, x_min[i]), right = fmaxf(right, x_max[i]);
        bottom = fminf(bottom, y_min[i]), top = fmaxf(top, y_max[i]);
    }
    /* Flat boxes must not get more cells than dph_sweep_scratch_create made room for, nor large
     * meshes more than can be numbered. */
    float width = right - left + 1e-5f, height = top - bottom + 1e-5f;
    float side = sqrtf(width * height / fminf((float)npos * DPH_SWEEP_CELLS, 2.5e8f));
    float least = fmaxf(width, height) / (float)npos;
    side = side > least ? side : least;
    struct dph_sweep_grid grid = {.left = left, .bottom = bottom};
    grid.per_x = DPH_SWEEP_ASPECT / side;
    grid.per_y = 1 / (side * DPH_SWEEP_ASPECT);
    grid.columns = (int)(width * grid.per_x) + 1;
    grid.rows = (int)(height * grid.per_y) + 1;
    while (grid.shift < DPH_SWEEP_STRIP && 1 << grid.shift < grid.columns)
        grid.shift++;
    scratch->grid = grid;

    uint32_t *start = scratch->start, *cell = scratch->cell;
    size_t strips = (size_t)((grid.columns - 1) >> grid.shift) + 1;
    size_t cells = strips * (size_t)grid.rows << grid.shift;
    memset(start, 0, (cells + 2) * sizeof *start);
    for (size_t i = 0; i < npos; i += 8) {
        dph_i8 column = __builtin_convertvector((dph_f8_load(rx + i) - left) * grid.per_x, dph_i8);
        dph_i8 row = __builtin_convertvector((dph_f8_load(ry + i) - bottom) * grid.per_y, dph_i8);
        store_i8((int32_t *)cell + i, cell_of(&grid, column, row));
    }
    for (size_t i = 0; i < npos; i++)
        start[cell[i] + 2]++;
    uint32_t sum = 0;
    for (size_t c = 0; c < cells; c++) {
        sum += start[c + 2];
        start[c + 2] = sum;
    }
    /* Corners of triangles read a position's slot beside its coordinates. */
    for (size_t i = 0; i < npos; i++) {
        uint32_t slot = start[cell[i] + 1]++;
        float *row = scratch->rotated + 4 * i;
        row[0] = rx[i], row[1] = ry[i], row[2] = rz[i];
        memcpy(row + 3, &slot, 4);
        scratch->position_of[slot] = (uint32_t)i;
    }
    for (size_t s = 0; s < npos; s++) {
        const float *row = scratch->rotated + 4 * (size_t)scratch->position_of[s];
        rx[s] = row[0], ry[s] = row[1], rz[s] = row[2];
    }
}

/* The coordinates of one corner of eight triangles: four floats each, turned into four vectors. */
static inline void gather(const float *rotated, const uint32_t *corner, dph_f8 out[4])
{
    typedef float f4 __attribute__((vector_size(16)));
    dph_f8 pair[4];
    for (int i = 0; i < 4; i++) {
        f4 low, high;
        memcpy(&low, rotated + 4 * (size_t)corner[i], sizeof low);
        memcpy(&high, rotated + 4 * (size_t)corner[i + 4], sizeof high);
        pair[i] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
    }
    dph_f8 xy01 = __builtin_shufflevector(pair[0], pair[1], 0, 8, 1, 9, 4, 12, 5, 13);
    dph_f8 zs01 = __builtin_shufflevector(pair[0], pair[1], 2, 10, 3, 11, 6, 14, 7, 15);
    dph_f8 xy23 = __builtin_shufflevector(pair[2], pair[3], 0, 8, 1, 9, 4, 12, 5, 13);
    dph_f8 zs23 = __builtin_shufflevector(pair[2], pair[3], 2, 10, 3, 11, 6, 14, 7, 15);
    out[0] = __builtin_shufflevector(xy01, xy23, 0, 1, 8, 9, 4, 5, 12, 13);
    out[1] = __builtin_shufflevector(xy01, xy23, 2, 3, 10, 11, 6, 7, 14, 15);
    out[2] = __builtin_shufflevector(zs01, zs23, 0, 1, 8, 9, 4, 5, 12, 13);
    out[3] = __builtin_shufflevector(zs01, zs23, 2, 3, 10, 11, 6, 7, 14, 15);
}

/* Exchanges two corners where the second is lower, and notes it in `odd`. */
static inline void order_by_y(dph_f8 a[4], dph_f8 b[4], dph_i8 *odd)
{
    dph_i8 swap = b[1] < a[1];
    for (int k = 0; k < 4; k++) {
        dph_f8 low = dph_f8_select(swap, b[k], a[k]);
        b[k] = dph_f8_select(swap, a[k], b[k]);
        a[k] = low;
    }
    *odd ^= swap;
}

/* Prepares eight triangles, entries i .. i + 7 of the block. */
static inline void prepare(struct dph_sweep_block *block, int i, const float *rotated,
                           const uint32_t *corner, const struct dph_sweep_grid *grid, bool closed)
{
    uint32_t id[3][8];
    for (int k = 0; k < 8; k++)
        for (int c = 0; c < 3; c++)
            id[c][k] = corner[3 * k + c];
    dph_f8 a[4], b[4], c[4]; /* x, y, z, slot */
    gather(rotated, id[0], a);
    gather(rotated, id[1], b);
    gather(rotated, id[2], c);
    dph_i8 odd = dph_i8_set(0);
    order_by_y(a, b, &odd);
    order_by_y(b, c, &odd);
    order_by_y(a, b, &odd);

    dph_f8 dx01 = b[0] - a[0], dy01 = b[1] - a[1], dz01 = b[2] - a[2];
    dph_f8 dx02 = c[0] - a[0], dy02 = c[1] - a[1], dz02 = c[2] - a[2];
    dph_f8 area = dx01 * dy02 - dx02 * dy01; /* twice the projected one */
    dph_f8 inverse = 1 / area;
    dph_f8 x_min = min8(min8(a[0], b[0]), c[0]), x_max = max8(max8(a[0], b[0]), c[0]);
    dph_f8 z_min = min8(min8(a[2], b[2]), c[2]), z_max = max8(max8(a[2], b[2]), c[2]);
    /* The depth's rounding error is that of the coordinates, some 1e-7, times the z extent over
     * the height of the projected triangle. Not-a-number (no area at all) counts as steep. */
    dph_f8 extent = max8(x_max - x_min, dy02);
    dph_i8 steep = ~((z_max - z_min) * extent <= DPH_SWEEP_STEEP * abs8(area));

    dph_f8_store(block->x0 + i, a[0]);
    dph_f8_store(block->y0 + i, a[1]);
    dph_f8_store(block->z0 + i, a[2]);
    dph_f8_store(block->x1 + i, b[0]);
    dph_f8_store(block->y1 + i, b[1]);
    dph_f8_store(block->y2 + i, c[1]);
    dph_f8_store(block->dx01 + i, dx01);
    dph_f8_store(block->dy01 + i, dy01);
    dph_f8_store(block->dx02 + i, dx02);
    dph_f8_store(block->dy02 + i, dy02);
    dph_f8_store(block->dx12 + i, c[0] - b[0]);
    dph_f8_store(block->dy12 + i, c[1] - b[1]);
    dph_f8_store(block->slope_x + i, (dz01 * dy02 - dz02 * dy01) * inverse);
    dph_f8_store(block->slope_y + i, (dx01 * dz02 - dx02 * dz01) * inverse);
    dph_f8_store(block->z_min + i, z_min);
    dph_f8_store(block->z_max + i, z_max);
    store_i8(block->slot0 + i, (dph_i8)a[3]);
    store_i8(block->slot1 + i, (dph_i8)b[3]);
    store_i8(block->slot2 + i, (dph_i8)c[3]);
    store_i8(block->skipped + i, (dph_i8)b[3] | -(int32_t)!closed);
    store_i8(block->odd + i, odd);
    store_i8(block->steep + i, steep);

    dph_f8 from = max8((x_min - 1e-6f - grid->left) * grid->per_x, dph_f8_set(0));
    dph_f8 to = (x_max - grid->left) * grid->per_x;
    dph_i8 column0 = __builtin_convertvector(from, dph_i8);
    dph_i8 row0 = __builtin_convertvector((a[1] - grid->bottom) * grid->per_y, dph_i8);
    store_i8(block->column0 + i, column0);
    store_i8(block->column1 + i, __builtin_convertvector(to, dph_i8));
    store_i8(block->row0 + i, row0);
    store_i8(block->row1 + i, __builtin_convertvector((c[1] - grid->bottom) * grid->per_y, dph_i8));
    store_i8(block->cell + i, cell_of(grid, column0, row0));
}

/* Neighbouring slots to be tested against a triangle, the first eight of them. */
static inline uint64_t pack_item(uint32_t slot, int triangle, uint32_t count)
{
    return slot | (uint64_t)triangle << 32 | (uint64_t)count << 48;
}

/* Finds which items have a crossing. Returns their number. A triangle's own corners cross at no
 * distance and add no length. Of them only mid can be covered, or lo where both are equally
 * high: hi is out of range, and lo is on both of its edges, hence left of none. They only matter
 * on open meshes, to tell whether a ray starts inside (see finish). */
static int find_hits(struct dph_sweep_block *block, const struct dph_sweep_scratch *scratch, int items)
{
    int hits = 0;
    for (int n = 0; n < items; n++) {
        uint64_t item = block->item[n];
        uint32_t slot = (uint32_t)item;
        int t = (int)(item >> 32 & 0xffff), count = (int)(item >> 48);
        dph_f8 px = dph_f8_load(scratch->sx + slot), py = dph_f8_load(scratch->sy + slot);
        dph_f8 x0 = px - block->x0[t], y0 = py - block->y0[t];
        dph_f8 x1 = px - block->x1[t], y1 = py - block->y1[t];
        dph_i8 left_long = block->dx02[t] * y0 - block->dy02[t] * x0 > 0;
        dph_f8 lower = block->dx01[t] * y0 - block->dy01[t] * x0;
        dph_f8 upper = block->dx12[t] * y1 - block->dy12[t] * x1;
        dph_i8 left_short = dph_f8_select(py < block->y1[t], lower, upper) > 0;
        dph_i8 in_range = (py >= block->y0[t]) & (py < block->y2[t]) & (lanes < count) &
                          (lanes != block->skipped[t] - (int)slot);
        unsigned covered = bits_of((left_long ^ left_short) & in_range);
        unsigned leaves = bits_of(left_short ^ dph_i8_set(block->odd[t]));
        block->hit[hits] = (struct hit){slot, (uint16_t)t, (uint8_t)covered, (uint8_t)leaves};
        hits += covered != 0;
    }
    return hits;
}

/* Depth of a steep triangle's plane over a position, by the input's own coordinates in double
 * precision. */
static float steep_depth(const struct dph_sweep *sweep, const struct dph_sweep_scratch *scratch,
                         const struct dph_sweep_frame *frame, const struct dph_sweep_block *block,
                         int t, uint32_t slot)
{
    const uint32_t corners[4] = {(uint32_t)block->slot0[t], (uint32_t)block->slot1[t],
                                 (uint32_t)block->slot2[t], slot};
    double p[4][3];
    for (int i = 0; i < 4; i++) {
        const float *original = sweep->original +
                                3 * (size_t)sweep->order[scratch->position_of[corners[i]]];
        for (int k = 0; k < 3; k++)
            p[i][k] = original[k];
    }
    double e1[3], e2[3], to[3];
    for (int k = 0; k < 3; k++) {
        e1[k] = p[1][k] - p[0][k];
        e2[k] = p[2][k] - p[0][k];
        to[k] = p[0][k] - p[3][k];
    }
    const double normal[3] = {e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2],
                              e1[0] * e2[1] - e1[1] * e2[0]};
    const double *d = frame->direction;
    double along = normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2];
    double depth = (normal[0] * to[0] + normal[1] * to[1] + normal[2] * to[2]) / along / sweep->unit;
    /* Seen exactly from the side, or covered by a rounding only: the plane may be far from the
     * triangle there. */
    float pz = scratch->sz[slot], low = block->z_min[t] - pz, high = block->z_max[t] - pz;
    float dz = (float)depth;
    if (!(dz >= low))
        dz = low;
    return dz <= high ? dz : high;
}

/* Notes triangle `id` where its crossing is the nearest. */
static inline void keep_triangle(int32_t *near, dph_i8 nearer, int32_t id)
{
    store_i8(near, (load_i8(near) & ~nearer) | (dph_i8_set(id) & nearer));
}

/* Keeps the nearest crossing on either side, its last bit telling an exit from an entry, and its
 * triangle where that is wanted. */
static inline void keep_nearest(struct dph_sweep_scratch *scratch, size_t s, int32_t id, dph_f8 dz,
                                dph_i8 ahead, dph_i8 behind, dph_i8 leaves)
{
    float *plus = scratch->nearest_plus + s, *minus = scratch->nearest_minus + s;
    dph_i8 key = (dph_i8)dz & 0x7ffffffe;
    dph_f8 key_ahead = (dph_f8)(key | (leaves & 1)), key_behind = (dph_f8)(key | (~leaves & 1));
    if (scratch->near_plus) {
        keep_triangle(scratch->near_plus + s, ahead & (key_ahead < dph_f8_load(plus)), id);
        keep_triangle(scratch->near_minus + s, behind & (key_behind < dph_f8_load(minus)), id);
    }
    dph_f8 nearest = dph_f8_load(plus);
    dph_f8_store(plus, dph_f8_select(ahead & (key_ahead < nearest), key_ahead, nearest));
    nearest = dph_f8_load(minus);
    dph_f8_store(minus, dph_f8_select(behind & (key_behind < nearest), key_behind, nearest));
}

/* Adds the crossings of `hits` to the slots' sums. */
static void add_hits(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                     const struct dph_sweep_frame *frame, enum dph_definition definition, int hits)
{
    const struct dph_sweep_block *block = scratch->block;
    for (int n = 0; n < hits; n++) {
        struct hit hit = block->hit[n];
        int t = hit.triangle;
        size_t s = hit.slot;
        dph_i8 covered = (lane_bits & (int32_t)hit.covered) != 0;
        dph_i8 leaves = (lane_bits & (int32_t)hit.leaves) != 0;
        dph_i8 sign = -(leaves | 1); /* 1 or -1 */
        dph_i8 own = (lanes == block->slot0[t] - (int)hit.slot) | (lanes == block->slot1[t] - (int)hit.slot);
        if (!sweep->closed)
            store_i8(scratch->own + s, load_i8(scratch->own + s) + (sign & covered & own));
        covered &= ~own;
        dph_f8 dz = (block->z0[t] - dph_f8_load(scratch->sz + s)) +
                    block->slope_x[t] * (dph_f8_load(scratch->sx + s) - block->x0[t]) +
                    block->slope_y[t] * (dph_f8_load(scratch->sy + s) - block->y0[t]);
        if (block->steep[t])
            for (int i = 0; i < 8; i++)
                if (covered[i])
                    dz[i] = steep_depth(sweep, scratch, frame, block, t, hit.slot + (uint32_t)i);
        dph_i8 ahead = covered & (dz > 0), behind = covered & (dz < 0);
        dph_i8 balance = load_i8(scratch->balance + s);
        balance += (sign & ahead) - ((sign & behind) << 16);
        store_i8(scratch->balance + s, balance);
        if (definition == DPH_THICKNESS_FIRST || scratch->careful)
            keep_nearest(scratch, s, block->first + t, dz, ahead, behind, leaves);
        if (definition == DPH_THICKNESS_FIRST)
            continue;
        dph_f8 plus = dph_f8_load(scratch->plus + s), minus = dph_f8_load(scratch->minus + s);
        if (definition == DPH_THICKNESS_INSIDE) {
            dph_f8 length = (dph_f8)((dph_i8)dz ^ (~leaves & INT32_MIN));
            plus += dph_f8_and(length, ahead);
            minus += dph_f8_and(length, behind);
        } else {
            dph_f8 distance = abs8(dz);
            plus = dph_f8_select(ahead & leaves & (distance > plus), distance, plus);
            minus = dph_f8_select(behind & ~leaves & (distance > minus), distance, minus);
        }
        dph_f8_store(scratch->plus + s, plus);
        dph_f8_store(scratch->minus + s, minus);
    }
}

/* The columns that triangle t covers within eight rows of cells from `row` on, for triangles
 * much larger than a cell. The rows are widened by more than the rounding of their bounds, and
 * so is the result; column0 > column1 where a row has none. */
static inline void clip_to_rows(const struct dph_sweep_block *block, const struct dph_sweep_grid *grid,
                                int t, int row, int32_t *column0, int32_t *column1)
{
    const float margin = 2e-6f;
    dph_f8 rows = __builtin_convertvector(lanes + row, dph_f8);
    dph_f8 low = grid->bottom + rows / grid->per_y - margin;
    dph_f8 high = grid->bottom + (rows + 1) / grid->per_y + margin;
    dph_f8 left = dph_f8_set(4), right = dph_f8_set(-4);
    for (int e = 0; e < 3; e++) {
        float x = e < 2 ? block->x0[t] : block->x1[t], y = e < 2 ? block->y0[t] : block->y1[t];
        float dx = e == 0 ? block->dx02[t] : e == 1 ? block->dx01[t] : block->dx12[t];
        float dy = e == 0 ? block->dy02[t] : e == 1 ? block->dy01[t] : block->dy12[t];
        if (!(dy > 0)) /* a level edge ends where the other two do */
            continue;
        float scale = 1 / dy;
        dph_f8 a = x + dx * max8((low - y) * scale, dph_f8_set(0));
        dph_f8 b = x + dx * min8((high - y) * scale, dph_f8_set(1));
        dph_i8 reaches = (high >= y) & (low <= y + dy);
        left = dph_f8_select(reaches, min8(left, min8(a, b)), left);
        right = dph_f8_select(reaches, max8(right, max8(a, b)), right);
    }
    dph_f8 first = dph_f8_set((float)block->column0[t]), last = dph_f8_set((float)block->column1[t]);
    dph_f8 from = max8((left - margin - grid->left) * grid->per_x, first);
    dph_f8 to = min8((right + margin - grid->left) * grid->per_x, last);
    store_i8(column0, __builtin_convertvector(min8(from, last + 1), dph_i8));
    store_i8(column1, __builtin_convertvector(max8(to, dph_f8_set(-1)), dph_i8));
}

/* Tests the items and adds what they hit. */
static void test_items(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                       const struct dph_sweep_frame *frame, enum dph_definition definition, int items)
{
    add_hits(sweep, scratch, frame, definition, find_hits(scratch->block, scratch, items));
}

/* Lists the runs of slots that a large triangle covers, or one in several strips, and tests the
 * list whenever it is full. Returns its new length. */
static __attribute__((noinline)) int list_large(const struct dph_sweep *sweep,
                                                struct dph_sweep_scratch *scratch,
                                                const struct dph_sweep_frame *frame,
                                                enum dph_definition definition, int t, int items)
{
    struct dph_sweep_block *block = scratch->block;
    const struct dph_sweep_grid *grid = &scratch->grid;
    int row0 = block->row0[t], rows = block->row1[t] - row0 + 1, shift = grid->shift;
    bool small = rows <= DPH_SWEEP_ROWS && block->column1[t] - block->column0[t] < 16;
    for (int row = 0; row < rows; row++) {
        int32_t column0[8], column1[8];
        if (small)
            column0[row] = block->column0[t], column1[row] = block->column1[t];
        else if (row % 8 == 0)
            clip_to_rows(block, grid, t, row0 + row, column0, column1);
        int from = column0[row % 8], to = column1[row % 8];
        while (from <= to) { /* a run a strip */
            int strip = from >> shift, last = ((strip + 1) << shift) - 1;
            last = last < to ? last : to;
            const uint32_t *start = scratch->start +
                                    (((size_t)strip * (size_t)grid->rows + (size_t)(row0 + row)) << shift);
            uint32_t end = start[last - (strip << shift) + 1];
            for (uint32_t slot = start[from - (strip << shift)]; slot < end; slot += 8) {
                block->item[items++] = pack_item(slot, t, end - slot < 8 ? end - slot : 8);
                if (items == ITEMS) {
                    test_items(sweep, scratch, frame, definition, items);
                    items = 0;
                }
            }
            from = last + 1;
        }
    }
    return items;
}

/* All triangles against all positions: fills plus, minus and balance, which the caller has set
 * to their starting values. */
static void cross(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                  const struct dph_sweep_frame *frame, enum dph_definition definition)
{
    struct dph_sweep_block *block = scratch->block;
    int shift = scratch->grid.shift;
    size_t next_row = (size_t)1 << shift;
    for (size_t first = 0; first < sweep->ntri; first += BLOCK) {
        int count = sweep->ntri - first < BLOCK ? (int)(sweep->ntri - first) : BLOCK;
        block->first = (int32_t)first;
        for (int i = 0; i < count; i += 8)
            prepare(block, i, scratch->rotated, sweep->corner + 3 * (first + (size_t)i),
                    &scratch->grid, sweep->closed);
        int items = 0;
        for (int t = 0; t < count; t++) {
            /* A run a row of cells. Nearly always there are few rows and short runs: write what
             * could be wanted, count what is, and there is no branch to be guessed wrong. */
            const uint32_t *from = scratch->start + block->cell[t];
            const uint32_t *to = from + (block->column1[t] - block->column0[t]) + 1;
            uint32_t rows = (uint32_t)(block->row1[t] - block->row0[t]) + 1, longest = 0;
            uint64_t *item = block->item + items, *end = item;
            bool one_strip = block->column0[t] >> shift == block->column1[t] >> shift;
            for (uint32_t r = 0; r < DPH_SWEEP_ROWS; r++, from += next_row, to += next_row) {
                uint32_t slot = *from, slots = (*to - slot) & -(uint32_t)(r < rows);
                *end = pack_item(slot, t, slots & 0xffff);
                end += slots != 0;
                *end = pack_item(slot + 8, t, (slots - 8) & 0xffff);
                end += slots > 8;
                longest = slots > longest ? slots : longest;
            }
            if (rows <= DPH_SWEEP_ROWS && longest <= 16 && one_strip)
                items += (int)(end - item);
            else
                items = list_large(sweep, scratch, frame, definition, t, items);
            if (items > ITEMS - 2 * DPH_SWEEP_ROWS) {
                test_items(sweep, scratch, frame, definition, items);
                items = 0;
            }
        }
        test_items(sweep, scratch, frame, definition, items);
    }
}

/* The length that the key of a nearest crossing stands for: 0 where that is an entry, or where
 * there is none. */
static inline dph_f8 first_exit(const float *key)
{
    dph_f8 nearest = dph_f8_load(key);
    return dph_f8_and(nearest, -((dph_i8)nearest & 1));
}

/* Sums into lengths in the unit of the input, in plus and minus, and `balance` into flags: 1 bad
 * along +d, 2 bad along -d. Returns the number of bad values. A balance must be 1 where the ray
 * starts inside and 0 where it starts outside. Which it does is told by the triangles around the
 * position: where they leave matter along d, the ray along +d starts outside and the one along
 * -d inside; where they enter it, the other way round; where they do neither, both rays start on
 * the same side. On a closed mesh the three sums cancel, ahead - behind + own = 0; where they do
 * not, a border is in the way, and the side that contradicts the triangles around the position
 * is bad, or both if these do not tell. */
static size_t finish(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                     enum dph_definition definition)
{
    float unit = (float)sweep->unit;
    bool nearest = definition == DPH_THICKNESS_FIRST;
    dph_i8 bad = dph_i8_set(0);
    for (size_t s = 0; s < sweep->npos; s += 8) {
        /* b = behind * 65536 + ahead, ahead from -32768 to 32767 */
        dph_i8 both = load_i8(scratch->balance + s);
        dph_i8 ahead = both << 16 >> 16, behind = (both - ahead) >> 16;
        dph_i8 bad_ahead = (ahead & ~1) != 0, bad_behind = (behind & ~1) != 0;
        if (!sweep->closed) {
            dph_i8 own = load_i8(scratch->own + s), conflict = ahead - behind + own != 0;
            dph_i8 unsure = (own != 1) & (own != -1);
            bad_ahead |= conflict & (unsure | (ahead != ((own < 0) & 1)));
            bad_behind |= conflict & (unsure | (behind != ((own > 0) & 1)));
        }
        store_i8(scratch->balance + s, (bad_ahead & 1) | (bad_behind & 2));
        bad -= bad_ahead + bad_behind;
        /* a ray that leaves at once may round below 0 */
        dph_f8 plus = max8(dph_f8_load(scratch->plus + s), dph_f8_set(0));
        dph_f8 minus = max8(dph_f8_load(scratch->minus + s), dph_f8_set(0));
        if (nearest || scratch->careful) {
            plus = dph_f8_select(bad_ahead | -(int)nearest, first_exit(scratch->nearest_plus + s), plus);
            minus = dph_f8_select(bad_behind | -(int)nearest, first_exit(scratch->nearest_minus + s), minus);
        }
        dph_f8_store(scratch->plus + s, plus * unit);
        dph_f8_store(scratch->minus + s, minus * unit);
    }
    size_t count = 0;
    for (int i = 0; i < 8; i++)
        count += (size_t)bad[i];
    return count;
}

const struct dph_sweep_kernel DPH_KERNEL(dph_sweep_kernel) = {
    .block_size = sizeof(struct dph_sweep_block),
    .project = project,
    .cross = cross,
    .finish = finish,
};
