/* bake/ramp.h - fitting the ramp of a response of one channel.      Tier 2, private. */
#ifndef DPH_BAKE_RAMP_H
#define DPH_BAKE_RAMP_H

#include <diaphan/response.h>

/* A value and the colour that it stands for, with what it counts for (>= 0). */
struct dph_ramp_sample {
    float value, color[3], weight;
};

/* Fits `ramp` to `count` samples; without any light it is grey. */
void dph_ramp_fit(const struct dph_ramp_sample *sample, size_t count, struct dph_ramp *ramp);

#endif
