/* sh/gaunt.h - products of spherical harmonics as sums of spherical harmonics.      Tier 1, private. */
#ifndef DPH_SH_GAUNT_H
#define DPH_SH_GAUNT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* y_i y_j = sum over t of factor[t] y_(index[t]), t from start[p] to start[p + 1] - 1, where p =
 * i(i+1)/2 + j, j <= i, counts the pairs of the first bands * bands functions, and the functions on
 * the right have degrees up to 2 (bands - 1). */
struct dph_gaunt {
    uint32_t *start;  /* (pairs + 1) */
    uint16_t *index;  /* (terms)     */
    float *factor;    /* (terms)     */
};

/* False: out of memory, and nothing is kept. `bands`: 1 to 8. */
bool dph_gaunt_init(struct dph_gaunt *gaunt, int bands);
void dph_gaunt_finish(struct dph_gaunt *gaunt);

#endif
