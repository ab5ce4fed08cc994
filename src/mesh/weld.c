/* Welding by exact position: every distinct point of a mesh gets one number.
 *
 * A hash table with open addressing and linear probing (Knuth, The Art of Computer Programming 3,
 * 6.4, algorithm L). It holds the first vertex of every position and nothing else, 4 bytes a slot,
 * and is at most half full; it starts small and doubles, because a mesh with unshared vertices has
 * six times fewer positions than vertices. Vertices are taken in blocks: the slots of a whole
 * block are prefetched before the first of them is looked at, which hides most of the time that a
 * large table costs.
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
#define EMPTY UINT32_MAX

struct table {
    uint32_t *slot;  /* (capacity) the first vertex of a position, or EMPTY */
    size_t capacity; /* a power of two                                      */
};

static void load_point(const float *position, size_t stride, size_t i, float point[3])
{
    memcpy(point, (const char *)position + i * stride, 3 * sizeof *point);
}

static uint64_t hash_point(const float point[3])
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
    return h ^ h >> 32;
}

/* The slot of a point: the one that holds an equal point, or the empty one where it belongs. */
static size_t find_slot(const struct table *table, const float *position, size_t stride,
                        const float point[3], uint64_t hash)
{
    size_t mask = table->capacity - 1;
    for (size_t s = hash & mask;; s = (s + 1) & mask) {
        if (table->slot[s] == EMPTY)
            return s;
        float other[3];
        load_point(position, stride, table->slot[s], other);
        if (other[0] == point[0] && other[1] == point[1] && other[2] == point[2])
            return s;
    }
}

/* Makes a table of `capacity` slots that holds the positions of the first `nvert` vertices. */
static bool rebuild(struct table *table, size_t capacity, const float *position, size_t stride,
                    const uint32_t *position_of, size_t nvert)
{
    uint32_t *slot = dph_alloc(capacity, sizeof *slot);
    if (!slot)
        return false;
    free(table->slot);
    *table = (struct table){slot, capacity};
    memset(slot, 0xff, capacity * sizeof *slot);
    size_t next = 0;
    for (size_t i = 0; i < nvert; i++) {
        if (position_of[i] != next)
            continue; /* not the first of its position */
        next++;
        float point[3];
        load_point(position, stride, i, point);
        size_t s = hash_point(point) & (capacity - 1);
        while (slot[s] != EMPTY)
            s = (s + 1) & (capacity - 1);
        slot[s] = (uint32_t)i;
    }
    return true;
}

size_t dph_mesh_weld(const float *position, size_t stride, size_t nvert, uint32_t *position_of,
                     struct dph_error *err)
{
    struct table table = {0};
    size_t count = 0;
    if (nvert >= EMPTY) {
        dph_fail(err, DPH_ERROR_LIMIT, "%zu vertices are more than the %u that are handled", nvert,
                 EMPTY - 1);
        return SIZE_MAX;
    }
    for (size_t begin = 0; begin < nvert; begin += BLOCK) {
        size_t n = nvert - begin < BLOCK ? nvert - begin : BLOCK;
        if (2 * (count + n) > table.capacity &&
            !rebuild(&table, table.capacity ? 2 * table.capacity : FIRST_CAPACITY, position, stride,
                     position_of, begin)) {
            dph_fail_memory(err);
            goto error;
        }
        float point[BLOCK][3];
        uint64_t hash[BLOCK];
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
            size_t s = find_slot(&table, position, stride, point[k], hash[k]);
            if (table.slot[s] == EMPTY) {
                table.slot[s] = (uint32_t)(begin + k);
                position_of[begin + k] = (uint32_t)count++;
            } else {
                position_of[begin + k] = position_of[table.slot[s]];
            }
        }
    }
    free(table.slot);
    return count;

error:
    free(table.slot);
    return SIZE_MAX;
}
