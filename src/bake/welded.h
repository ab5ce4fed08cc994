/* bake/welded.h - a mesh with one row a position: what every bake works on.      Tier 2,
 * private. */
#ifndef DPH_BAKE_WELDED_H
#define DPH_BAKE_WELDED_H

#include <diaphan/bake.h>

/* Owns its arrays. */
struct dph_welded {
    size_t npos, ntri;
    float *position;       /* (npos x 3) distinct, in the order of the first vertices that have them */
    uint32_t *index;       /* (ntri x 3) < npos                                                      */
    uint32_t *position_of; /* (nvert) vertex -> position                                             */
    double side;           /* largest, of the bounding box                                           */
};

/* Welds by exact position and checks everything that a caller can get wrong about `input`.
 * False: DPH_ERROR_ARGUMENT, DPH_ERROR_INPUT or DPH_ERROR_MEMORY, and there is nothing to be
 * freed. */
bool dph_welded_init(struct dph_welded *welded, const struct dph_bake_input *input,
                     struct dph_error *err);
void dph_welded_finish(struct dph_welded *welded);

#endif
