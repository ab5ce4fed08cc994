/* bake/neighbours.h - the nearest positions along a mesh.      Tier 2, private. */
#ifndef DPH_BAKE_NEIGHBOURS_H
#define DPH_BAKE_NEIGHBOURS_H

#include <diaphan/error.h>

#include <math.h>
#include <stddef.h>
#include <stdint.h>

enum { DPH_NEIGHBOURS = 126 }; /* at most */

struct dph_neighbours {
    uint32_t *list; /* (npos x DPH_NEIGHBOURS) nearest first */
    uint8_t *count; /* (npos) */
};

static inline double dph_square_between(const float *a, const float *b)
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += ((double)a[k] - (double)b[k]) * ((double)a[k] - (double)b[k]);
    return sum;
}

/* For all `position` (npos x 3), which triangles (ntri x 3, indices < npos) connect. False:
 * DPH_ERROR_MEMORY. Finished by the caller either way. */
bool dph_neighbours_init(struct dph_neighbours *neighbours, const float *position, size_t npos,
                         const uint32_t *index, size_t ntri, int threads, struct dph_error *err);
void dph_neighbours_finish(struct dph_neighbours *neighbours);

#endif
