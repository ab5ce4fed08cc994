/* bake/octree.h - weighted sums over all points of a surface, near ones singly, far ones in
 * groups.      Tier 2, private. */
#ifndef DPH_BAKE_OCTREE_H
#define DPH_BAKE_OCTREE_H

#include "bake/dipole.h"

#include <diaphan/error.h>
#include <stdint.h>

/* Samples on a surface, in the caller's memory as long as the tree lives. Those without area are
 * left out. */
struct dph_octree_input {
    size_t count, stride;   /* stride: floats of a row, a multiple of 8                            */
    const float *position;  /* (count x 3) of the order of 1                                       */
    const float *area;      /* (count)                                                             */
    const float *row;       /* (count x stride) what is summed                                     */
    size_t weight;          /* the column that weights a group's centre, not negative              */
    bool normals;           /* columns 0 to 2 are unit normals: groups that do not nearly agree in them are never taken as one */
};

/* Read-only, safe to share between threads. NULL: DPH_ERROR_MEMORY. */
struct dph_octree;
struct dph_octree *dph_octree_create(const struct dph_octree_input *input, struct dph_error *err);
void dph_octree_destroy(struct dph_octree *tree);

enum dph_kernel_kind {
    DPH_KERNEL_DIPOLE = 0, /* Rd of `dipole`                                                       */
    DPH_KERNEL_EXP,        /* exp(-r / length) / r                                                 */
    DPH_KERNEL_GAUSS,      /* exp(-r^2 / (2 length^2))                                             */
};

/* What is gathered: sum over samples q of  (integral of K(|x - p|) over q's disc) row(q). */
struct dph_gather {
    enum dph_kernel_kind kind;
    int channels;                 /* 1 to 3, each with a kernel of its own                         */
    struct dph_dipole dipole[3];
    double length[3];
    double solid_angle;           /* a group is one sample where its extent^2 is below this times its distance^2; 0: never */
    double reach;                 /* samples and groups beyond are left out; INFINITY: none        */
    bool same_side;               /* only samples whose normal makes an acute angle with the point's */
    bool portable;
};

/* At one point: `normal` is read where same_side asks for it. `out` (channels x stride). */
void dph_octree_gather(const struct dph_octree *tree, const struct dph_gather *gather, const float point[3],
                       const float *normal, float *out);

#endif
