/* Root mean square errors and the peak signal-to-noise ratio.
 *
 * With e_c the difference of the sRGB values of a channel, in [0, 1], over n pixels,
 *
 *     RMSE = sqrt(1 / (3 n) sum e_c^2),        PSNR = 10 log10(1 / RMSE^2).
 *
 * The relative error has linear luminance Y = 0.2126 R + 0.7152 G + 0.0722 B (ITU-R BT.709):
 *
 *     sqrt(sum (Y - Y_ref)^2 / sum Y_ref^2). */
#include "core/threads.h"
#include "image/metric.h"

#include <math.h>

struct work {
    struct dph_metric_pair pair;
    float *map; /* Nullable */
};

static void error_row(void *context, size_t y, int worker)
{
    struct work *work = context;
    struct dph_metric_pair *pair = &work->pair;
    size_t width = (size_t)pair->width;
    (void)worker;
    for (size_t i = y * width; i < (y + 1) * width; i++) {
        double square = 0;
        if (!pair->mask || pair->mask[i]) {
            for (size_t c = 4 * i; c < 4 * i + 3; c++) {
                double a = dph_srgb_encode(dph_metric_clip(pair, pair->pixel[0][c]));
                double b = dph_srgb_encode(dph_metric_clip(pair, pair->pixel[1][c]));
                square += (a - b) * (a - b);
            }
            pair->sum[y] += square / 3;
            pair->count[y]++;
        }
        if (work->map)
            work->map[i] = (float)sqrt(square / 3);
    }
}

bool dph_metric_rmse(const struct dph_image *reference, const struct dph_image *test,
                     const struct dph_metric_params *params, double *rmse, float *map,
                     struct dph_error *err)
{
    struct work work = {.map = map};
    if (!dph_metric_begin(&work.pair, reference, test, params, err))
        return false;
    dph_parallel(work.pair.workers, (size_t)work.pair.height, error_row, &work);
    *rmse = sqrt(dph_metric_mean(&work.pair));
    dph_metric_end(&work.pair);
    return true;
}

double dph_metric_psnr(double rmse)
{
    return rmse > 0 ? -20 * log10(rmse) : INFINITY;
}

static double luminance(const float *rgb)
{
    double y = 0.2126 * (double)rgb[0] + 0.7152 * (double)rgb[1] + 0.0722 * (double)rgb[2];
    return isfinite(y) ? y : 0;
}

/* A plain loop: nothing here takes longer than reading the pictures. */
bool dph_metric_relative_rmse(const struct dph_image *reference, const struct dph_image *test,
                              const struct dph_metric_params *params, double *rmse,
                              struct dph_error *err)
{
    struct dph_metric_pair pair;
    if (!dph_metric_begin(&pair, reference, test, params, err))
        return false;
    double error = 0, truth = 0;
    size_t pixels = (size_t)pair.width * (size_t)pair.height;
    for (size_t i = 0; i < pixels; i++) {
        if (pair.mask && !pair.mask[i])
            continue;
        double a = luminance(pair.pixel[0] + 4 * i), b = luminance(pair.pixel[1] + 4 * i);
        error += (a - b) * (a - b);
        truth += a * a;
    }
    *rmse = error > 0 ? sqrt(error / truth) : 0;
    dph_metric_end(&pair);
    return true;
}
