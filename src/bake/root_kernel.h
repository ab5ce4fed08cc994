/* bake/root_kernel.h - coefficients whose square is a given function.      Tier 2, private. */
#ifndef DPH_BAKE_ROOT_KERNEL_H
#define DPH_BAKE_ROOT_KERNEL_H

#include "sh/gaunt.h"

enum { ROOT_DIRECTIONS = 128, ROOT_ITERATIONS = 24 };

/* What all rows share. */
struct dph_root_model {
    int bands;         /* of the root                                                             */
    int target_bands;  /* of the function                                                         */
    struct dph_gaunt gaunt; /* of `bands`                                                         */
    float *value;      /* (ROOT_DIRECTIONS x most * most) harmonics, most: the larger of both bands */
};

/* Fits eight rows, one a lane. `target` (8 x target_bands^2) rows, `root` (8 x bands^2) rows.
 * Returns the iterations of the row that took most. */
int dph_root_fit_avx2(const struct dph_root_model *model, const float *target, float *root);
int dph_root_fit_portable(const struct dph_root_model *model, const float *target, float *root);

#endif
