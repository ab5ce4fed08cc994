/* The sweep: thickness of all positions along one direction and its opposite, without rays.
 *
 * Every vertex of a bake asks for the same directions, so the loops are turned round: for one
 * direction d, project all positions and all triangles along d, and let each triangle find the
 * positions that it covers. A position covered at depth z below or above its own gets a crossing
 * at distance dz = z - own z; the crossing leaves matter where the triangle faces along d. From
 * the crossings of a position follow, for +d (dz > 0) and -d (dz < 0) in the same pass:
 *   inside length   sum of s dz, s = 1 where matter is left and -1 where it is entered; the order does not matter
 *   first exit      the nearest crossing, if it leaves matter
 *   farthest exit   the farthest crossing that leaves matter
 *   hit balance     sum of s: 1 where the ray starts inside, 0 outside; anything else cannot be trusted. On which side it starts is
 *                   told by the triangles that touch the position
 * Triangles that touch the position by index are left out, they cross at distance 0; nothing
 * needs an epsilon.
 *
 * Positions are counting-sorted into a grid over the projection, about one a cell; a triangle
 * visits the rows of cells that its box covers, and in each row a contiguous run of positions,
 * eight at a time. sweep_kernel.c has these loops and says why every position is covered exactly
 * once where triangles share an edge. Depth comes from single precision, except for triangles
 * seen nearly from the side, where a small error across becomes a large one along d: those are
 * cut in double precision, from the input's own coordinates. */
#include "bake/sweep.h"

#include "bake/sweep_kernel.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/simd.h"

#include <math.h>
#include <stdlib.h>

/* Spreads the low 16 bits of x to every third bit. */
static uint64_t spread(uint64_t x)
{
    x &= 0xffff;
    x = (x | x << 16) & 0x0000ff0000ffull;
    x = (x | x << 8) & 0x00f00f00f00full;
    x = (x | x << 4) & 0x0c30c30c30c3ull;
    x = (x | x << 2) & 0x249249249249ull;
    return x;
}

/* A key to be sorted with what it belongs to. */
struct keyed {
    uint64_t key;
    uint32_t id;
};

/* Stable radix sort by the low `bits` of the keys; `other` is scratch of the same size. Returns
 * whichever holds the result. */
static struct keyed *radix_sort(struct keyed *items, struct keyed *other, size_t count, int bits)
{
    for (int shift = 0; shift < bits; shift += 12) {
        size_t begin[4097] = {0};
        for (size_t i = 0; i < count; i++)
            begin[(items[i].key >> shift & 4095) + 1]++;
        for (int b = 0; b < 4096; b++)
            begin[b + 1] += begin[b];
        for (size_t i = 0; i < count; i++)
            other[begin[items[i].key >> shift & 4095]++] = items[i];
        struct keyed *swap = items;
        items = other;
        other = swap;
    }
    return items;
}

/* Whether every edge is run along as often one way as the other, so that the surface has no
 * border. The edges' hashes cancel where it is so, and have one chance in 2^64 to do so where it
 * is not; that would cost no more than some flags of bad pairs. */
static bool is_closed(const uint32_t *index, size_t ntri)
{
    uint64_t sum = 0;
    for (size_t t = 0; t < ntri; t++)
        for (size_t k = 0; k < 3; k++) {
            uint32_t a = index[3 * t + k], b = index[3 * t + (k + 1) % 3];
            uint64_t hash = (uint64_t)(a < b ? a : b) << 32 | (a < b ? b : a);
            /* the finalizer of MurmurHash3 */
            hash = (hash ^ hash >> 33) * 0xff51afd7ed558ccdull;
            hash = (hash ^ hash >> 33) * 0xc4ceb9fe1a85ec53ull;
            hash ^= hash >> 33;
            sum += a < b ? hash : a > b ? -hash : 0;
        }
    return sum == 0;
}

/* Positions along a Morton curve: neighbours in space become neighbours in memory. Fills order
 * and x, y, z. */
static bool order_positions(struct dph_sweep *sweep)
{
    size_t npos = sweep->npos;
    const float *position = sweep->original;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < npos; i++)
        for (int k = 0; k < 3; k++) {
            double c = position[3 * i + (size_t)k];
            low[k] = c < low[k] ? c : low[k];
            high[k] = c > high[k] ? c : high[k];
        }
    double centre[3] = {0}, square = 0, largest = 0;
    for (int k = 0; k < 3 && npos; k++) {
        centre[k] = (low[k] + high[k]) / 2;
        square += (high[k] - low[k]) * (high[k] - low[k]) / 4;
        largest = fmax(largest, high[k] - low[k]);
    }
    sweep->unit = square > 0 ? sqrt(square) : 1;

    struct keyed *keyed = dph_alloc(npos, sizeof *keyed), *other = dph_alloc(npos, sizeof *other);
    bool ok = keyed && other;
    if (ok) {
        double cells = largest > 0 ? 65535 / largest : 0;
        for (size_t i = 0; i < npos; i++) {
            uint64_t key = 0;
            for (int k = 0; k < 3; k++)
                key |= spread((uint64_t)((position[3 * i + (size_t)k] - low[k]) * cells)) << k;
            keyed[i] = (struct keyed){key, (uint32_t)i};
        }
        const struct keyed *sorted = radix_sort(keyed, other, npos, 48);
        for (size_t i = 0; i < npos; i++) {
            uint32_t id = sweep->order[i] = sorted[i].id;
            const float *p = position + 3 * (size_t)id;
            sweep->x[i] = (float)((p[0] - centre[0]) / sweep->unit);
            sweep->y[i] = (float)((p[1] - centre[1]) / sweep->unit);
            sweep->z[i] = (float)((p[2] - centre[2]) / sweep->unit);
        }
        for (size_t i = npos; i < sweep->padded; i++) /* stay inside the projected box */
            sweep->x[i] = sweep->x[0], sweep->y[i] = sweep->y[0], sweep->z[i] = sweep->z[0];
    }
    free(keyed);
    free(other);
    return ok;
}

/* Triangles by their lowest corner, so that they come in the order of the positions; those
 * without three different corners are left out. */
static bool order_triangles(struct dph_sweep *sweep, const uint32_t *index, size_t ntri)
{
    uint32_t *place = dph_alloc(sweep->npos, sizeof *place);
    struct keyed *keyed = dph_alloc(ntri, sizeof *keyed), *other = dph_alloc(ntri, sizeof *other);
    bool ok = place && keyed && other;
    if (ok) {
        for (size_t i = 0; i < sweep->npos; i++)
            place[sweep->order[i]] = (uint32_t)i;
        size_t kept = 0;
        for (size_t t = 0; t < ntri; t++) {
            uint32_t a = place[index[3 * t]], b = place[index[3 * t + 1]], c = place[index[3 * t + 2]];
            if (a == b || b == c || c == a)
                continue;
            uint32_t low = a < b ? a : b;
            keyed[kept++] = (struct keyed){low < c ? low : c, (uint32_t)t};
        }
        const struct keyed *sorted = radix_sort(keyed, other, kept, 36);
        for (size_t t = 0; t < kept; t++)
            for (size_t k = 0; k < 3; k++)
                sweep->corner[3 * t + k] = place[index[3 * (size_t)sorted[t].id + k]];
        sweep->ntri = kept;
        for (size_t i = 3 * kept; i < 3 * ((kept + 7) & ~(size_t)7); i++)
            sweep->corner[i] = 0;
    }
    free(place);
    free(keyed);
    free(other);
    return ok;
}

struct dph_sweep *dph_sweep_create(const float *position, size_t npos, const uint32_t *index,
                                   size_t ntri, bool portable, struct dph_error *err)
{
    struct dph_sweep *sweep = calloc(1, sizeof *sweep);
    if (!sweep)
        goto error;
    sweep->npos = npos;
    sweep->padded = (npos + 7) & ~(size_t)7;
    sweep->original = position;
    sweep->closed = is_closed(index, ntri);
    sweep->kernel = &dph_sweep_kernel_portable;
#ifdef DPH_HAVE_AVX2
    if (!portable && dph_cpu_has_avx2())
        sweep->kernel = &dph_sweep_kernel_avx2;
#else
    (void)portable;
#endif
    sweep->order = dph_alloc(npos, sizeof *sweep->order);
    sweep->x = dph_alloc_aligned(sweep->padded, sizeof(float));
    sweep->y = dph_alloc_aligned(sweep->padded, sizeof(float));
    sweep->z = dph_alloc_aligned(sweep->padded, sizeof(float));
    sweep->corner = dph_alloc_aligned((ntri + 7) & ~(size_t)7, 3 * sizeof *sweep->corner);
    if (!sweep->order || !sweep->x || !sweep->y || !sweep->z || !sweep->corner ||
        !order_positions(sweep) || !order_triangles(sweep, index, ntri))
        goto error;
    return sweep;
error:
    dph_fail_memory(err);
    dph_sweep_destroy(sweep);
    return NULL;
}

void dph_sweep_destroy(struct dph_sweep *sweep)
{
    if (!sweep)
        return;
    free(sweep->order);
    free(sweep->x);
    free(sweep->y);
    free(sweep->z);
    free(sweep->corner);
    free(sweep);
}

const uint32_t *dph_sweep_order(const struct dph_sweep *sweep)
{
    return sweep->order;
}

const uint32_t *dph_sweep_corners(const struct dph_sweep *sweep)
{
    return sweep->corner;
}

struct dph_sweep_scratch *dph_sweep_scratch_create(const struct dph_sweep *sweep,
                                                   struct dph_error *err)
{
    struct dph_sweep_scratch *scratch = calloc(1, sizeof *scratch);
    if (!scratch)
        goto error;
    size_t slots = sweep->padded + 8; /* runs of eight may begin at the last slot */
    /* columns * rows <= npos * CELLS + columns + rows + 1, columns <= npos * ASPECT + 1, rows <=
     * npos / ASPECT + 1; the last strip may be half empty; and `to` of the fast loop looks
     * beyond the last row by a few rows and the width of the box */
    size_t cells = (size_t)(2.0 * (double)sweep->npos * (DPH_SWEEP_CELLS + DPH_SWEEP_ASPECT + 1)) +
                   ((DPH_SWEEP_ROWS + 2) << DPH_SWEEP_STRIP) + 64;
    cells += (size_t)(DPH_SWEEP_ASPECT * (float)sweep->npos);
    scratch->rotated = dph_alloc_aligned(sweep->padded, 4 * sizeof(float));
    scratch->cell = dph_alloc_aligned(sweep->padded, sizeof *scratch->cell);
    scratch->start = dph_alloc_aligned(cells, sizeof *scratch->start);
    scratch->sx = dph_alloc_aligned(slots, sizeof(float));
    scratch->sy = dph_alloc_aligned(slots, sizeof(float));
    scratch->sz = dph_alloc_aligned(slots, sizeof(float));
    scratch->position_of = dph_alloc_aligned(slots, sizeof *scratch->position_of);
    scratch->plus = dph_alloc_aligned(slots, sizeof(float));
    scratch->minus = dph_alloc_aligned(slots, sizeof(float));
    scratch->nearest_plus = dph_alloc_aligned(slots, sizeof(float));
    scratch->nearest_minus = dph_alloc_aligned(slots, sizeof(float));
    scratch->balance = dph_alloc_aligned(slots, sizeof *scratch->balance);
    scratch->own = dph_alloc_aligned(slots, sizeof *scratch->own);
    scratch->block = dph_alloc_aligned(1, sweep->kernel->block_size);
    if (!scratch->rotated || !scratch->cell || !scratch->start || !scratch->sx || !scratch->sy ||
        !scratch->sz || !scratch->position_of || !scratch->plus || !scratch->minus ||
        !scratch->nearest_plus || !scratch->nearest_minus || !scratch->balance ||
        !scratch->own || !scratch->block)
        goto error;
    memset(scratch->sx, 0, slots * sizeof(float));
    memset(scratch->sy, 0, slots * sizeof(float));
    memset(scratch->sz, 0, slots * sizeof(float));
    return scratch;
error:
    dph_fail_memory(err);
    dph_sweep_scratch_destroy(scratch);
    return NULL;
}

void dph_sweep_scratch_destroy(struct dph_sweep_scratch *scratch)
{
    if (!scratch)
        return;
    free(scratch->rotated);
    free(scratch->cell);
    free(scratch->start);
    free(scratch->sx);
    free(scratch->sy);
    free(scratch->sz);
    free(scratch->position_of);
    free(scratch->plus);
    free(scratch->minus);
    free(scratch->nearest_plus);
    free(scratch->nearest_minus);
    free(scratch->balance);
    free(scratch->own);
    free(scratch->near_plus);
    free(scratch->near_minus);
    free(scratch->block);
    free(scratch);
}

/* Two unit vectors that complete w to a right-handed frame (Duff et al. 2017). */
static struct dph_sweep_frame make_frame(const double w[3])
{
    double sign = copysign(1, w[2]), a = -1 / (sign + w[2]), b = w[0] * w[1] * a;
    return (struct dph_sweep_frame){
        .u = {(float)(1 + sign * w[0] * w[0] * a), (float)(sign * b), (float)(-sign * w[0])},
        .v = {(float)b, (float)(sign + w[1] * w[1] * a), (float)-w[1]},
        .w = {(float)w[0], (float)w[1], (float)w[2]},
        .direction = {w[0], w[1], w[2]},
    };
}

/* Clears the sums and adds all crossings of the projected direction. */
static void add_crossings(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                          const struct dph_sweep_frame *frame, enum dph_definition definition)
{
    size_t slots = sweep->padded + 8;
    memset(scratch->balance, 0, slots * sizeof *scratch->balance);
    memset(scratch->own, 0, slots * sizeof *scratch->own);
    memset(scratch->plus, 0, slots * sizeof *scratch->plus);
    memset(scratch->minus, 0, slots * sizeof *scratch->minus);
    if (definition == DPH_THICKNESS_FIRST || scratch->careful)
        for (size_t s = 0; s < slots; s++)
            scratch->nearest_plus[s] = scratch->nearest_minus[s] = INFINITY;
    sweep->kernel->cross(sweep, scratch, frame, definition);
}

/* The same, and makes lengths of them. Returns the number of bad ones. */
static size_t cross(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                    const struct dph_sweep_frame *frame, enum dph_definition definition)
{
    add_crossings(sweep, scratch, frame, definition);
    return sweep->kernel->finish(sweep, scratch, definition);
}

size_t dph_sweep_run(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                     enum dph_definition definition, const double direction[3], float *plus,
                     float *minus, uint8_t *bad_plus, uint8_t *bad_minus)
{
    size_t npos = sweep->npos;
    if (!npos)
        return 0;
    const struct dph_sweep_frame frame = make_frame(direction);
    sweep->kernel->project(sweep, scratch, &frame);

    size_t bad = cross(sweep, scratch, &frame, definition);
    if (bad && definition != DPH_THICKNESS_FIRST && !scratch->careful) {
        scratch->careful = true; /* from now on; a closed mesh never pays for it */
        bad = cross(sweep, scratch, &frame, definition);
    }
    for (size_t s = 0; s < npos; s++) {
        size_t p = scratch->position_of[s];
        plus[p] = scratch->plus[s];
        minus[p] = scratch->minus[s];
    }
    for (size_t p = npos; p < sweep->padded; p++)
        plus[p] = minus[p] = 0;
    for (size_t s = 0; bad_plus && s < npos; s++)
        bad_plus[scratch->position_of[s]] = scratch->balance[s] & 1;
    for (size_t s = 0; bad_minus && s < npos; s++)
        bad_minus[scratch->position_of[s]] = scratch->balance[s] >> 1 & 1;
    return bad;
}

/* The kernel's key of the nearest crossing, whose last bit is 1 for an exit, as a signed
 * distance. */
static float signed_distance(float key, float unit)
{
    uint32_t bits;
    memcpy(&bits, &key, sizeof bits);
    return key < INFINITY ? (bits & 1 ? -key : key) * unit : INFINITY;
}

bool dph_sweep_nearest(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                       const double direction[3], float *plus, float *minus, int32_t *near_plus,
                       int32_t *near_minus, struct dph_error *err)
{
    size_t npos = sweep->npos, slots = sweep->padded + 8;
    if (!npos)
        return true;
    if (near_plus && !scratch->near_plus) {
        int32_t *a = dph_alloc_aligned(slots, sizeof *a), *b = dph_alloc_aligned(slots, sizeof *b);
        if (!a || !b) {
            free(a);
            free(b);
            return dph_fail_memory(err);
        }
        scratch->near_plus = a;
        scratch->near_minus = b;
    }
    for (size_t s = 0; scratch->near_plus && s < slots; s++)
        scratch->near_plus[s] = scratch->near_minus[s] = -1;
    const struct dph_sweep_frame frame = make_frame(direction);
    sweep->kernel->project(sweep, scratch, &frame);
    add_crossings(sweep, scratch, &frame, DPH_THICKNESS_FIRST);
    float unit = (float)sweep->unit;
    for (size_t s = 0; s < npos; s++) {
        size_t p = scratch->position_of[s];
        plus[p] = signed_distance(scratch->nearest_plus[s], unit);
        minus[p] = signed_distance(scratch->nearest_minus[s], unit);
        if (near_plus) {
            near_plus[p] = scratch->near_plus[s];
            near_minus[p] = scratch->near_minus[s];
        }
    }
    for (size_t p = npos; p < sweep->padded; p++) {
        plus[p] = minus[p] = INFINITY;
        if (near_plus)
            near_plus[p] = near_minus[p] = -1;
    }
    return true;
}
