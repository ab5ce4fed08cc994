/* bake/visibility_kernel.h - the inner loop of a bounce.      Private. */
#ifndef DPH_BAKE_VISIBILITY_KERNEL_H
#define DPH_BAKE_VISIBILITY_KERNEL_H

#include <stddef.h>
#include <stdint.h>

/* Positions, normals and triangles in the sweep's order and its scaled coordinates. */
struct dph_bounce {
    const float *x, *y, *z, *nx, *ny, *nz;
    const uint32_t *corner;
    float unit;        /* lengths of the input per length here                                     */
    float weight;      /* of a direction                                                           */
    size_t stride;     /* a multiple of 8                                                          */
    const float *from; /* (npos x stride)                                                          */
    float *out;        /* (npos x stride) added to                                                 */
};

struct dph_visibility_kernel {
    /* Adds what positions begin .. end - 1 see along d: `distance` and `near` as dph_sweep_nearest gives them. */
    void (*bounce)(const struct dph_bounce *bounce, const float d[3], const float *distance,
                   const int32_t *near, size_t begin, size_t end);
};

extern const struct dph_visibility_kernel dph_visibility_kernel_portable;
#ifdef DPH_HAVE_AVX2
extern const struct dph_visibility_kernel dph_visibility_kernel_avx2;
#endif

#endif
