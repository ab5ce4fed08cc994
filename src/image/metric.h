/* image/metric.h - what the measures between pictures share.      Tier 1, private. */
#ifndef DPH_IMAGE_METRIC_H
#define DPH_IMAGE_METRIC_H

#include <diaphan/metrics.h>

/* Two pictures on their way through a measure. Rows are handed to threads; each leaves its sum and
 * its count, which are added in the order of the rows, so that threads change nothing. */
struct dph_metric_pair {
    const float *pixel[2]; /* RGBA, reference and test */
    const uint8_t *mask;   /* Nullable */
    int width, height;
    double gain;   /* 2^exposure */
    int workers;   /* threads to use, at most one a row */
    double *sum;   /* (height) owned */
    size_t *count; /* (height) owned */
};

/* False: as the measures say. */
bool dph_metric_begin(struct dph_metric_pair *pair, const struct dph_image *reference,
                      const struct dph_image *test, const struct dph_metric_params *params,
                      struct dph_error *err);
void dph_metric_end(struct dph_metric_pair *pair);

/* Sum over the rows over their count; 0 where nothing was counted. */
double dph_metric_mean(const struct dph_metric_pair *pair);

/* Channel times gain, clipped to [0, 1], linear. */
static inline double dph_metric_clip(const struct dph_metric_pair *pair, float channel)
{
    double value = pair->gain * (double)channel;
    return value >= 1 ? 1 : value > 0 ? value : 0; /* NaN: 0 */
}

#endif
