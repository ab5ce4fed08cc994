/* Sharing: vertices that are equal in every array become one.
 *
 * What a graphics card draws from an index buffer is shaded once a vertex instead of once a
 * corner. Unlike welding (weld.c), which asks for the point alone, normals and texture
 * coordinates have to be equal, too, so that the picture is the same. The table is one of open
 * addressing with linear probing, never more than half full (Knuth, The Art of Computer
 * Programming 3, 6.4, algorithm L). */
#include <diaphan/mesh.h>

#include "core/fail.h"
#include "core/memory.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_NUMBERS = 8 };

/* All numbers of a vertex as bits, -0 as 0; how many they are. */
static int load_row(const struct dph_mesh *mesh, size_t v, uint32_t row[MOST_NUMBERS])
{
    const float *array[3] = {mesh->position, mesh->normal, mesh->texcoord};
    static const size_t width[3] = {3, 3, 2};
    int count = 0;
    for (int a = 0; a < 3; a++)
        for (size_t k = 0; array[a] && k < width[a]; k++) {
            float number = array[a][v * width[a] + k] + 0.0F;
            memcpy(&row[count++], &number, sizeof number);
        }
    return count;
}

/* Two odd constants from the fraction of the golden ratio and of the square root of 2. */
static uint64_t hash_row(const uint32_t *row, int count)
{
    uint64_t h = 0;
    for (int i = 0; i < count; i++) {
        h = (h ^ row[i]) * UINT64_C(0x9e3779b97f4a7c15);
        h ^= h >> 32;
    }
    h *= UINT64_C(0x6a09e667f3bcc909);
    return h ^ h >> 29;
}

/* Moves vertex `from` to place `to`, which is not behind it. */
static void move_row(struct dph_mesh *mesh, size_t to, size_t from)
{
    memmove(mesh->position + 3 * to, mesh->position + 3 * from, 3 * sizeof(float));
    if (mesh->normal)
        memmove(mesh->normal + 3 * to, mesh->normal + 3 * from, 3 * sizeof(float));
    if (mesh->texcoord)
        memmove(mesh->texcoord + 2 * to, mesh->texcoord + 2 * from, 2 * sizeof(float));
}

bool dph_mesh_share(struct dph_mesh *mesh, struct dph_error *err)
{
    size_t capacity = 64, shared = 0;
    while (capacity < 2 * mesh->nvert)
        capacity *= 2;
    uint32_t *slot = dph_alloc_zero(capacity, sizeof *slot); /* number + 1 of a shared vertex */
    uint32_t *number = dph_alloc(mesh->nvert, sizeof *number);
    if (!slot || !number) {
        free(slot);
        free(number);
        return dph_fail_memory(err);
    }
    for (size_t v = 0; v < mesh->nvert; v++) {
        uint32_t row[MOST_NUMBERS], other[MOST_NUMBERS];
        int count = load_row(mesh, v, row);
        size_t at = (size_t)hash_row(row, count) & (capacity - 1);
        for (; slot[at]; at = (at + 1) & (capacity - 1)) {
            load_row(mesh, slot[at] - 1, other);
            if (!memcmp(row, other, (size_t)count * sizeof *row))
                break;
        }
        if (!slot[at]) {
            move_row(mesh, shared, v);
            slot[at] = (uint32_t)++shared;
        }
        number[v] = slot[at] - 1;
    }
    for (size_t i = 0; i < 3 * mesh->ntri; i++)
        mesh->index[i] = number[mesh->index[i]];
    mesh->nvert = shared;
    free(slot);
    free(number);
    return true;
}
