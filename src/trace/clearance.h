/* trace/clearance.h - how far from every surface a point is at least.      Tier 2, private. */
#ifndef DPH_TRACE_CLEARANCE_H
#define DPH_TRACE_CLEARANCE_H

#include <diaphan/error.h>

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A grid of lower bounds of the distance to the nearest triangle, whichever side of it. Lengths are
 * in the unit of the positions. Zeroed, it says 0 everywhere. */
struct dph_clearance {
    double low[3];  /* the grid's corner                                                           */
    double cell;    /* side of a cell                                                              */
    double cells;   /* a unit of length                                                            */
    int size[3];    /* cells                                                                       */
    double unit;    /* length that 1 of `bound` is                                                 */
    uint8_t *bound; /* (size[2] x size[1] x size[0])                                               */
};

/* Fills a grid; `cell`: the side that is wished for, larger where there would be more than 64
 * cells to a side. False: DPH_ERROR_MEMORY. */
bool dph_clearance_init(struct dph_clearance *clearance, const float *position, size_t npos,
                        const uint32_t *index, size_t ntri, double cell, int threads,
                        struct dph_error *err);
void dph_clearance_finish(struct dph_clearance *clearance);

/* The cell that holds a point, -1 where that is beyond the grid. */
static inline ptrdiff_t dph_clearance_cell(const struct dph_clearance *clearance,
                                           const double point[3])
{
    double x = (point[0] - clearance->low[0]) * clearance->cells;
    double y = (point[1] - clearance->low[1]) * clearance->cells;
    double z = (point[2] - clearance->low[2]) * clearance->cells;
    const int *n = clearance->size;
    if (!(x >= 0 && y >= 0 && z >= 0 && x < n[0] && y < n[1] && z < n[2]))
        return -1;
    return ((ptrdiff_t)z * n[1] + (ptrdiff_t)y) * n[0] + (ptrdiff_t)x;
}

#endif
