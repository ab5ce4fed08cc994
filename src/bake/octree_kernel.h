/* bake/octree_kernel.h - what the two halves of the octree share: octree.c builds, octree_kernel.c gathers.      Private. */
#ifndef DPH_BAKE_OCTREE_KERNEL_H
#define DPH_BAKE_OCTREE_KERNEL_H

#include "bake/octree.h"

/* Up to eight children, side by side so that they are tested at once. */
struct dph_octree_block {
    float x[8], y[8], z[8]; /* a sample, or the centre of a group                                  */
    float area[8];
    float size[8];          /* extent^2: the area or the longest side of the box squared, whichever is more */
    int32_t child[8];       /* the group's block, -1: a sample, -2: nothing                        */
    uint32_t row[8];        /* of a sample                                                         */
};

struct dph_octree {
    size_t stride, nblock;
    struct dph_octree_block *block; /* (nblock) the first is the root                              */
    float *mean;                    /* (nblock x stride) mean row of each block by area             */
    const float *row;               /* (count x stride) the caller's                               */
};

struct dph_octree_kernel {
    void (*gather)(const struct dph_octree *tree, const struct dph_gather *gather, const float point[3],
                   const float *normal, float *out);
};

extern const struct dph_octree_kernel dph_octree_kernel_portable;
#ifdef DPH_HAVE_AVX2
extern const struct dph_octree_kernel dph_octree_kernel_avx2;
#endif

#endif
