/* What the measures between pictures share: checks, and means that do not depend on threads. */
#include "image/metric.h"

#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct dph_metric_params dph_metric_defaults(void)
{
    return (struct dph_metric_params){.pixels_per_degree = 67};
}

bool dph_metric_begin(struct dph_metric_pair *pair, const struct dph_image *reference,
                      const struct dph_image *test, const struct dph_metric_params *params,
                      struct dph_error *err)
{
    int width = reference->width, height = reference->height;
    size_t pixels = (size_t)width * (size_t)height;
    *pair = (struct dph_metric_pair){0};
    if (width != test->width || height != test->height)
        return dph_fail(err, DPH_ERROR_INPUT,
                        "pictures of %d x %d and %d x %d pixels cannot be compared", width, height,
                        test->width, test->height);
    if (width < 1 || height < 1)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a picture of %d x %d pixels", width, height);
    if (!(fabs(params->exposure) <= 1000))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "an exposure of %g stops", params->exposure);
    if (!(params->pixels_per_degree >= 1 && params->pixels_per_degree <= 1000))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%g pixels per degree; 1 to 1000 are possible",
                        params->pixels_per_degree);
    bool any = !params->mask;
    for (size_t i = 0; i < pixels && !any; i++)
        any = params->mask[i] != 0;
    if (!any)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "the mask of a comparison holds no pixel");
    pair->pixel[0] = reference->pixel;
    pair->pixel[1] = test->pixel;
    pair->mask = params->mask;
    pair->width = width;
    pair->height = height;
    pair->gain = exp2(params->exposure);
    pair->workers = dph_thread_count(params->threads);
    if (pair->workers > height)
        pair->workers = height;
    pair->sum = dph_alloc_zero((size_t)height, sizeof *pair->sum);
    pair->count = dph_alloc_zero((size_t)height, sizeof *pair->count);
    if (pair->sum && pair->count)
        return true;
    dph_metric_end(pair);
    return dph_fail_memory(err);
}

void dph_metric_end(struct dph_metric_pair *pair)
{
    free(pair->sum);
    free(pair->count);
    *pair = (struct dph_metric_pair){0};
}

double dph_metric_mean(const struct dph_metric_pair *pair)
{
    double sum = 0;
    size_t count = 0;
    for (int y = 0; y < pair->height; y++) {
        sum += pair->sum[y];
        count += pair->count[y];
    }
    return count ? sum / (double)count : 0;
}
