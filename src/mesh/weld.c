/* Welding by exact position: every distinct point of a mesh gets one number.
 *
 * A hash table with open addressing and linear probing (Knuth, The Art of Computer Programming 3,
 * 6.4, algorithm L). A slot holds the first vertex of a position beside its hash, 8 bytes, so that
 * coordinates are only looked at where they are almost certainly equal, and so that a larger table
 * is filled from the smaller one in one pass over both. It starts small and doubles when it is
 * three quarters full, because a mesh with unshared vertices has six times fewer positions than
 * vertices. Vertices are taken in blocks: the slots of a whole block are prefetched before the
 * first of them is looked at, which hides most of the time that a large table costs.
 *
 * Coordinates on a grid differ in a few high bits only, which is what a weak hash turns into long
 * runs; so all 96 bits go through two rounds of multiply and shift. */
#include <diaphan/mesh.h>

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BLOCK 64
#define FIRST_CAPACITY 1024
#define MOST_VERTICES UINT32_MAX
#define EMPTY UINT64_MAX

struct table {
    uint64_t *slot;  /* (capacity) hash << 32 | first vertex of a position, or EMPTY */
    size_t capacity; /* a power of two                                               */
};

static void load_point(const float *position, size_t stride, size_t i, float point[3])
{
    memcpy(point, (const char *)position + i * stride, 3 * sizeof *point);
}

static uint32_t hash_point(const float point[3])
{
    uint32_t bits[3];
    memcpy(bits, point, sizeof bits);
    for (int k = 0; k < 3; k++)
        if (bits[k] == 0x80000000u) /* -0 is 0 */
            bits[k] = 0;
    /* odd constants from the fraction of the golden ratio and of the square roots of 2 and 3 */
    uint64_t h = (bits[0] | (uint64_t)bits[1] << 32) * UINT64_C(0x9e3779b97f4a7c15);
    h ^= h >> 32;
    h = (h ^ bits[2]) * UINT64_C(0x6a09e667f3bcc909);
    h ^= h >> 29;
    h *= UINT64_C(0xbb67ae8584caa73b);
    return (uint32_t)(h ^ h >> 32);
}

/* The slot of a point: the one that holds an equal point, or the empty one where it belongs. */
static uint64_t *find_slot(const struct table *table, const float *position, size_t stride,
                           const float point[3], uint32_t hash)
{
    size_t mask = table->capacity - 1;
    for (size_t s = hash & mask;; s = (s + 1) & mask) {
        uint64_t slot = table->slot[s];
        if (slot == EMPTY)
            return &table->slot[s];
        if (slot >> 32 != hash)
            continue;
        float other[3];
        load_point(position, stride, (uint32_t)slot, other);
        if (other[0] == point[0] && other[1] == point[1] && other[2] == point[2])
            return &table->slot[s];
    }
}

/* Moves everything to a table of `capacity` slots. */
static bool grow(struct table *table, size_t capacity)
{
    uint64_t *slot = dph_alloc(capacity, sizeof *slot);
    if (!slot)
        return false;
    memset(slot, 0xff, capacity * sizeof *slot);
    for (size_t i = 0; i < table->capacity; i++) {
        if (table->slot[i] == EMPTY)
            continue;
        size_t s = table->slot[i] >> 32 & (capacity - 1);
        while (slot[s] != EMPTY)
            s = (s + 1) & (capacity - 1);
        slot[s] = table->slot[i];
    }
    free(table->slot);
    *table = (struct table){slot, capacity};
    return true;
}

size_t dph_mesh_weld(const float *position, size_t stride, size_t nvert, uint32_t *position_of,
                     struct dph_error *err)
{
    struct table table = {0};
    size_t count = 0;
    if (nvert >= MOST_VERTICES) {
        dph_fail(err, DPH_ERROR_LIMIT, "%zu vertices are more than the %u that are handled", nvert,
                 MOST_VERTICES - 1);
        return SIZE_MAX;
    }
    for (size_t begin = 0; begin < nvert; begin += BLOCK) {
        size_t n = nvert - begin < BLOCK ? nvert - begin : BLOCK;
        if (4 * (count + n) > 3 * table.capacity &&
            !grow(&table, table.capacity ? 2 * table.capacity : FIRST_CAPACITY)) {
            dph_fail_memory(err);
            goto error;
        }
        float point[BLOCK][3];
        uint32_t hash[BLOCK];
        for (size_t k = 0; k < n; k++) {
            load_point(position, stride, begin + k, point[k]);
            if (!isfinite(point[k][0]) || !isfinite(point[k][1]) || !isfinite(point[k][2])) {
                dph_fail(err, DPH_ERROR_INPUT, "vertex %zu: position (%g, %g, %g) is not finite",
                         begin + k, (double)point[k][0], (double)point[k][1], (double)point[k][2]);
                goto error;
            }
            hash[k] = hash_point(point[k]);
            __builtin_prefetch(&table.slot[hash[k] & (table.capacity - 1)]);
        }
        for (size_t k = 0; k < n; k++) {
            uint64_t *slot = find_slot(&table, position, stride, point[k], hash[k]);
            if (*slot == EMPTY) {
                *slot = (uint64_t)hash[k] << 32 | (begin + k);
                position_of[begin + k] = (uint32_t)count++;
            } else {
                position_of[begin + k] = position_of[(uint32_t)*slot];
            }
        }
    }
    free(table.slot);
    return count;

error:
    free(table.slot);
    return SIZE_MAX;
}
