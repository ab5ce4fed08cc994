/* bake/refine.h - triangles divided until their edges are short enough.      Tier 2, private. */
#ifndef DPH_BAKE_REFINE_H
#define DPH_BAKE_REFINE_H

#include <diaphan/error.h>
#include <stdint.h>

/* A mesh by distinct positions; owns its arrays (malloc). */
struct dph_refined {
    size_t npos, ntri;
    float *position;  /* (npos x 3)                                                                */
    uint32_t *index;  /* (ntri x 3)                                                                */
    double longest;   /* edge                                                                      */
};

/* Halves edges longer than `spacing`, the longest first, as long as there are at most `most` positions. The first `npos` positions
 * are the given ones; shared edges are divided alike, so that a closed mesh stays closed. False: DPH_ERROR_MEMORY, and it is empty. */
bool dph_refine(const float *position, size_t npos, const uint32_t *index, size_t ntri, double spacing,
                size_t most, struct dph_refined *refined, struct dph_error *err);
void dph_refined_finish(struct dph_refined *refined);

#endif
