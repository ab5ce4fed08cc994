/* The hierarchy of H. W. Jensen, J. Buhler, "A rapid hierarchical rendering technique for
 * translucent materials", SIGGRAPH 2002, with vectors in the place of irradiance: here, its
 * building; octree_kernel.c gathers.
 *
 * Samples are sorted by a Morton key of 3 x 21 bits, so that every cell of an octree is a
 * contiguous run. A node with one occupied child is replaced by that child, one with at most
 * eight samples holds them itself; samples that share all 63 bits are split by number. A group
 * stands for its samples with the sum of their areas, the mean of their rows by area, and a
 * centre weighted by area and by one column of the row (the even part of the irradiance). */
#include "bake/octree.h"

#include "bake/octree_kernel.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/simd.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 21 };

/* Groups whose mean normal is shorter are not flat enough to be on one side of anything. */
static const double least_agreement = 0.9;

struct keyed {
    uint64_t key;
    uint32_t sample;
};

struct builder {
    const struct dph_octree_input *input;
    struct dph_octree *tree;
    struct keyed *keyed; /* sorted                                                                 */
    size_t block_capacity, mean_capacity;
};

/* What a parent needs to know of a group. */
struct group {
    double area, weight, weighted[3], plain[3]; /* sums: A, A w, A w p, A p                         */
    float low[3], high[3];
};

static int compare_keyed(const void *a, const void *b)
{
    const struct keyed *p = a, *q = b;
    if (p->key != q->key)
        return p->key < q->key ? -1 : 1;
    return p->sample < q->sample ? -1 : p->sample > q->sample;
}

/* Spreads the low 21 bits of x to every third bit. */
static uint64_t spread(uint64_t x)
{
    x &= 0x1fffff;
    x = (x | x << 32) & 0x001f00000000ffffull;
    x = (x | x << 16) & 0x001f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    x = (x | x << 2) & 0x1249249249249249ull;
    return x;
}

/* Keys of the samples that have an area, sorted. Returns their count, SIZE_MAX: out of memory. */
static size_t sort_samples(struct builder *b)
{
    const struct dph_octree_input *in = b->input;
    double low[3] = {INFINITY, INFINITY, INFINITY}, side = 0;
    b->keyed = dph_alloc(in->count, sizeof *b->keyed);
    if (!b->keyed)
        return SIZE_MAX;
    for (size_t k = 0; k < 3; k++) {
        double high = -INFINITY;
        for (size_t i = 0; i < in->count; i++) {
            low[k] = fmin(low[k], in->position[3 * i + k]);
            high = fmax(high, in->position[3 * i + k]);
        }
        side = fmax(side, high - low[k]);
    }
    double cells = side > 0 ? (double)((1 << LEVELS) - 1) / side : 0;
    size_t count = 0;
    for (size_t i = 0; i < in->count; i++) {
        if (!(in->area[i] > 0))
            continue;
        uint64_t key = 0;
        for (size_t k = 0; k < 3; k++)
            key |= spread((uint64_t)((in->position[3 * i + k] - low[k]) * cells)) << k;
        b->keyed[count++] = (struct keyed){key, (uint32_t)i};
    }
    qsort(b->keyed, count, sizeof *b->keyed, compare_keyed);
    return count;
}

/* A new block without children; its number, -1: out of memory. */
static int32_t add_block(struct builder *b)
{
    struct dph_octree *tree = b->tree;
    struct dph_octree_block *block = dph_grow(tree->block, tree->nblock, &b->block_capacity, sizeof *block);
    if (!block)
        return -1;
    tree->block = block;
    float *mean = dph_grow(tree->mean, tree->nblock, &b->mean_capacity, tree->stride * sizeof *mean);
    if (!mean || tree->nblock >= INT32_MAX)
        return -1;
    tree->mean = mean;
    memset(block + tree->nblock, 0, sizeof *block);
    memset(mean + tree->nblock * tree->stride, 0, tree->stride * sizeof *mean);
    for (int i = 0; i < 8; i++)
        block[tree->nblock].child[i] = -2;
    return (int32_t)tree->nblock++;
}

static void add_to_group(struct group *group, const struct group *part)
{
    group->area += part->area;
    group->weight += part->weight;
    for (int k = 0; k < 3; k++) {
        group->weighted[k] += part->weighted[k];
        group->plain[k] += part->plain[k];
        group->low[k] = fminf(group->low[k], part->low[k]);
        group->high[k] = fmaxf(group->high[k], part->high[k]);
    }
}

static const struct group no_group = {.low = {INFINITY, INFINITY, INFINITY},
                                      .high = {-INFINITY, -INFINITY, -INFINITY}};

static bool build(struct builder *b, int32_t at, size_t begin, size_t end, int level, struct group *group);

/* Puts the sorted samples begin .. end - 1 into child `slot` of block `at`. False: out of
 * memory. */
static bool put(struct builder *b, int32_t at, int slot, size_t begin, size_t end, int level,
                struct group *group)
{
    const struct dph_octree_input *in = b->input;
    struct dph_octree *tree = b->tree;
    struct group part = no_group;
    size_t stride = tree->stride;
    if (end - begin == 1) {
        uint32_t q = b->keyed[begin].sample;
        const float *p = in->position + 3 * (size_t)q;
        part.area = in->area[q];
        part.weight = part.area * in->row[q * stride + in->weight];
        struct dph_octree_block *block = &tree->block[at];
        for (int k = 0; k < 3; k++) {
            part.weighted[k] = part.weight * p[k];
            part.plain[k] = part.area * p[k];
            part.low[k] = part.high[k] = p[k];
        }
        block->x[slot] = p[0], block->y[slot] = p[1], block->z[slot] = p[2];
        block->area[slot] = block->size[slot] = in->area[q];
        block->child[slot] = -1;
        block->row[slot] = q;
    } else {
        int32_t child = add_block(b);
        if (child < 0 || !build(b, child, begin, end, level, &part))
            return false;
        struct dph_octree_block *block = &tree->block[at];
        double centre[3], side = 0;
        for (int k = 0; k < 3; k++) {
            centre[k] = part.weight > 1e-30 * part.area ? part.weighted[k] / part.weight
                                                        : part.plain[k] / part.area;
            side = fmax(side, (double)part.high[k] - (double)part.low[k]);
        }
        block->x[slot] = (float)centre[0], block->y[slot] = (float)centre[1];
        block->z[slot] = (float)centre[2];
        block->area[slot] = (float)part.area;
        block->size[slot] = (float)fmax(part.area, side * side);
        block->child[slot] = child;
        const float *n = tree->mean + (size_t)child * stride;
        if (in->normals && sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) < least_agreement)
            block->size[slot] = INFINITY;
    }
    add_to_group(group, &part);
    return true;
}

/* Fills block `at` with samples begin .. end - 1 (at least two), whose keys agree above `level`.
 * False: out of memory. */
static bool build(struct builder *b, int32_t at, size_t begin, size_t end, int level, struct group *group)
{
    const struct keyed *keyed = b->keyed;
    size_t count = end - begin;
    bool ok = true;
    if (count <= 8) {
        for (size_t i = 0; i < count && ok; i++)
            ok = put(b, at, (int)i, begin + i, begin + i + 1, level, group);
    } else {
        while (level < LEVELS && !((keyed[begin].key ^ keyed[end - 1].key) >> 3 * (LEVELS - 1 - level) & 7))
            level++;
        if (level == LEVELS) {
            for (size_t i = 0; i < 8 && ok; i++)
                ok = put(b, at, (int)i, begin + count * i / 8, begin + count * (i + 1) / 8, level, group);
        } else {
            size_t from = begin;
            for (int octant = 0; octant < 8 && ok; octant++) {
                size_t to = from;
                while (to < end && (int)(keyed[to].key >> 3 * (LEVELS - 1 - level) & 7) == octant)
                    to++;
                if (to > from)
                    ok = put(b, at, octant, from, to, level + 1, group);
                from = to;
            }
        }
    }
    if (!ok)
        return false;
    struct dph_octree *tree = b->tree;
    const struct dph_octree_block *block = &tree->block[at];
    float *mean = tree->mean + (size_t)at * tree->stride;
    for (size_t k = 0; k < tree->stride; k++) {
        double sum = 0;
        for (int i = 0; i < 8; i++)
            if (block->child[i] != -2)
                sum += (double)block->area[i] *
                       (double)(block->child[i] < 0 ? tree->row + block->row[i] * tree->stride
                                                    : tree->mean + (size_t)block->child[i] * tree->stride)[k];
        mean[k] = (float)(sum / group->area);
    }
    return true;
}

struct dph_octree *dph_octree_create(const struct dph_octree_input *input, struct dph_error *err)
{
    struct dph_octree *tree = calloc(1, sizeof *tree);
    struct builder b = {.input = input, .tree = tree};
    if (!tree)
        goto error;
    tree->stride = input->stride;
    tree->row = input->row;
    size_t count = sort_samples(&b);
    int32_t root = count == SIZE_MAX ? -1 : add_block(&b);
    struct group all = no_group;
    if (root < 0 || (count == 1 && !put(&b, root, 0, 0, 1, 0, &all)) ||
        (count > 1 && !build(&b, root, 0, count, 0, &all)))
        goto error;
    free(b.keyed);
    return tree;
error:
    free(b.keyed);
    dph_octree_destroy(tree);
    dph_fail_memory(err);
    return NULL;
}

void dph_octree_destroy(struct dph_octree *tree)
{
    if (!tree)
        return;
    free(tree->block);
    free(tree->mean);
    free(tree);
}

void dph_octree_gather(const struct dph_octree *tree, const struct dph_gather *gather, const float point[3],
                       const float *normal, float *out)
{
#ifdef DPH_HAVE_AVX2
    if (!gather->portable && dph_cpu_has_avx2()) {
        dph_octree_kernel_avx2.gather(tree, gather, point, normal, out);
        return;
    }
#endif
    dph_octree_kernel_portable.gather(tree, gather, point, normal, out);
}
