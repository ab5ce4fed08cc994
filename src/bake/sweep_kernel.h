/* bake/sweep_kernel.h - what the two halves of the sweep share: sweep.c prepares, sweep_kernel.c
 * does the inner loops.      Private. */
#ifndef DPH_BAKE_SWEEP_KERNEL_H
#define DPH_BAKE_SWEEP_KERNEL_H

#include <diaphan/thickness.h>
#include <stdbool.h>

/* Positions and triangles in the sweep's order. Lengths are in units of the bounding sphere's
 * radius. */
struct dph_sweep {
    size_t npos, padded;    /* padded: npos rounded up to a multiple of 8                             */
    size_t ntri;
    const float *original;  /* (npos x 3) the caller's                                                */
    uint32_t *order;        /* (npos) sweep order -> the caller's                                     */
    float *x, *y, *z;       /* (padded) centred and scaled                                            */
    uint32_t *corner;       /* (ntri padded to 8, x 3); padding triangles are 0, 0, 0                 */
    double unit;            /* lengths of the input per length here                                   */
    bool closed;            /* every edge is run along as often one way as the other                  */
    const struct dph_sweep_kernel *kernel;
};

/* The grid: cells a position over the projected positions' box (half of which is empty), and how
 * much taller than wide the cells are, as a square root. Tall cells make fewer runs, narrow ones
 * shorter runs. */
#define DPH_SWEEP_CELLS 3.0f
#define DPH_SWEEP_ASPECT 2.0f

/* Rows of cells that nearly all triangles keep to; the grid's offsets are readable that many
 * rows beyond its end. */
#define DPH_SWEEP_ROWS 3

/* A triangle whose z extent times projected size exceeds its projected area by this factor is
 * "steep": single precision is not enough for its depth. */
#define DPH_SWEEP_STEEP 40.0f

/* Cells over the projected positions of one direction. They are numbered strip by strip, a strip
 * being a power of two of columns, and row by row in a strip: what is near in the projection is
 * near in memory, and neighbouring cells of one row of a strip follow each other. */
struct dph_sweep_grid {
    float left, bottom, per_x, per_y;
    int rows, columns;
    int shift; /* columns of a strip: 1 << shift                                                    */
};

#define DPH_SWEEP_STRIP 7 /* the largest shift */

/* One direction's projection of the positions, sorted into the grid's cells row by row: a "slot"
 * is a place in that order. */
struct dph_sweep_scratch {
    struct dph_sweep_grid grid;
    float *rotated;         /* (padded x 4) x, y, z in the direction's frame, and the slot as bits     */
    uint32_t *cell;         /* (padded) each position's cell                                          */
    uint32_t *start;        /* (cells + 2, padded) first slot of each cell                            */
    float *sx, *sy, *sz;    /* (padded + 8) by slot                                                     */
    uint32_t *position_of;  /* (npos) slot -> sweep order                                             */
    /* what the hits of a slot add up to, on the +d and on the -d side */
    float *plus, *minus;    /* (padded + 8) lengths                                                   */
    float *nearest_plus, *nearest_minus; /* (padded + 8) keys of the nearest crossings              */
    bool careful;           /* there have been bad pairs: keep the nearest crossings along with the lengths */
    int32_t *balance;       /* (padded + 8) exits minus entries: +d in the low 16 bits, -d above         */
    int32_t *own;           /* (padded + 8) exits minus entries of the triangles around the slot's own position, of open meshes */
    /* the triangle of the nearest crossing, where dph_sweep_nearest was asked for it; NULL until
     * then */
    int32_t *near_plus, *near_minus; /* (npos + 8)                                                   */
    struct dph_sweep_block *block;
};

/* The frame of one direction: unit vectors, w along it. */
struct dph_sweep_frame {
    float u[3], v[3], w[3];
    double direction[3];
};

/* The inner loops, once for every kind of processor. */
struct dph_sweep_kernel {
    size_t block_size; /* bytes of struct dph_sweep_block                                          */
    /* Projects and sorts the positions: fills everything of the scratch but the sums. */
    void (*project)(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                    const struct dph_sweep_frame *frame);
    /* Adds the crossings of all triangles to plus, minus and balance, and to the nearest ones
     * where they are wanted. */
    void (*cross)(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                  const struct dph_sweep_frame *frame, enum dph_definition definition);
    /* Turns the sums into lengths in the unit of the input, in plus and minus, and balance into
     * flags: 1 bad along +d, 2 bad along -d. Returns the number of bad values. */
    size_t (*finish)(const struct dph_sweep *sweep, struct dph_sweep_scratch *scratch,
                     enum dph_definition definition);
};

extern const struct dph_sweep_kernel dph_sweep_kernel_portable;
#ifdef DPH_HAVE_AVX2
extern const struct dph_sweep_kernel dph_sweep_kernel_avx2;
#endif

#endif
