/* Structural similarity.
 *
 * Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli: Image Quality Assessment: From Error
 * Visibility to Structural Similarity. IEEE Transactions on Image Processing 13(4), 2004.
 *
 * Around every pixel, with the weights of an 11 x 11 Gaussian of sigma 1.5 that sum to 1, the two
 * pictures x and y have means m, variances v and a covariance c, and
 *
 *     SSIM = (2 mx my + C1) (2 cxy + C2) / ((mx^2 + my^2 + C1) (vx + vy + C2)),
 *     C1 = (0.01 L)^2,  C2 = (0.03 L)^2,  L = 1.
 *
 * x and y are the luma of the sRGB values, with the luminance weights of ITU-R BT.709. The authors'
 * program shrinks large pictures first; here they are taken as they are.
 *
 * The border of the picture and that of the mask are one thing: weights outside are 0 and the
 * others are scaled to sum to 1. The mean is over the windows that need no such scaling, as the
 * authors have it. The Gaussian is a product, so each row sums its columns first (with the mask in
 * the sums, it stays a product), then along itself, and no plane of intermediate values is kept. */
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"
#include "image/metric.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RADIUS = 5, TAPS = 2 * RADIUS + 1 };
enum { WEIGHT, X, Y, XX, YY, XY, SUMS };

static const double sigma = 1.5, c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;

struct work {
    struct dph_metric_pair pair;
    float *map;        /* Nullable */
    float *luma[2];    /* (height x width) */
    double *scratch;   /* (workers x SUMS x (width + 2 RADIUS)) */
    double *whole_sum; /* (height) over whole windows; pair.sum is over all */
    size_t *whole_count;
    double tap[TAPS];
};

static void luma_row(void *context, size_t y, int worker)
{
    static const double share[3] = {0.2126, 0.7152, 0.0722};
    struct work *work = context;
    size_t width = (size_t)work->pair.width;
    (void)worker;
    for (int k = 0; k < 2; k++)
        for (size_t i = y * width; i < (y + 1) * width; i++) {
            double sum = 0;
            for (size_t c = 0; c < 3; c++)
                sum += share[c] * dph_srgb_encode(dph_metric_clip(
                                      &work->pair, work->pair.pixel[k][4 * i + c]));
            work->luma[k][i] = (float)sum;
        }
}

static void sum_columns(const struct work *work, int y, double *sums, size_t stride)
{
    const struct dph_metric_pair *pair = &work->pair;
    memset(sums, 0, SUMS * stride * sizeof *sums);
    for (int k = 0; k < TAPS; k++) {
        int from = y + k - RADIUS;
        if (from < 0 || from >= pair->height)
            continue;
        size_t row = (size_t)from * (size_t)pair->width;
        double w = work->tap[k], *out = sums + RADIUS;
        for (size_t i = row; i < row + (size_t)pair->width; i++, out++) {
            if (pair->mask && !pair->mask[i])
                continue;
            double a = (double)work->luma[0][i], b = (double)work->luma[1][i];
            out[WEIGHT * stride] += w;
            out[X * stride] += w * a;
            out[Y * stride] += w * b;
            out[XX * stride] += w * (a * a);
            out[YY * stride] += w * (b * b);
            out[XY * stride] += w * (a * b);
        }
    }
}

static double index_of(const double sum[SUMS])
{
    double w = 1 / sum[WEIGHT], mx = w * sum[X], my = w * sum[Y];
    double vx = w * sum[XX] - mx * mx, vy = w * sum[YY] - my * my, cov = w * sum[XY] - mx * my;
    return (2 * (mx * my) + c1) * (2 * cov + c2) / ((mx * mx + my * my + c1) * (vx + vy + c2));
}

static void window_row(void *context, size_t y, int worker)
{
    struct work *work = context;
    struct dph_metric_pair *pair = &work->pair;
    size_t width = (size_t)pair->width, stride = width + 2 * RADIUS;
    double *sums = work->scratch + (size_t)worker * SUMS * stride;
    sum_columns(work, (int)y, sums, stride);
    for (size_t x = 0; x < width; x++) {
        size_t i = y * width + x;
        double sum[SUMS] = {0}, similarity = 1;
        if (!pair->mask || pair->mask[i]) {
            for (size_t q = 0; q < SUMS; q++)
                for (size_t k = 0; k < TAPS; k++)
                    sum[q] += work->tap[k] * sums[q * stride + x + k];
            similarity = index_of(sum);
            pair->sum[y] += similarity;
            pair->count[y]++;
            if (sum[WEIGHT] > 1 - 1e-9) { /* the least of the weights is 1e-6 */
                work->whole_sum[y] += similarity;
                work->whole_count[y]++;
            }
        }
        if (work->map)
            work->map[i] = (float)similarity;
    }
}

static double result(const struct work *work)
{
    double sum = 0;
    size_t count = 0;
    for (int y = 0; y < work->pair.height; y++) {
        sum += work->whole_sum[y];
        count += work->whole_count[y];
    }
    return count ? sum / (double)count : dph_metric_mean(&work->pair);
}

bool dph_metric_ssim(const struct dph_image *reference, const struct dph_image *test,
                     const struct dph_metric_params *params, double *ssim, float *map,
                     struct dph_error *err)
{
    struct work work = {.map = map};
    if (!dph_metric_begin(&work.pair, reference, test, params, err))
        return false;
    bool ok = false;
    size_t width = (size_t)work.pair.width, height = (size_t)work.pair.height;
    double sum = 0;
    for (int k = 0; k < TAPS; k++) {
        double d = k - RADIUS;
        sum += work.tap[k] = exp(-d * d / (2 * sigma * sigma));
    }
    for (int k = 0; k < TAPS; k++)
        work.tap[k] /= sum;
    work.luma[0] = dph_alloc(width * height, sizeof *work.luma[0]);
    work.luma[1] = dph_alloc(width * height, sizeof *work.luma[1]);
    work.whole_sum = dph_alloc_zero(height, sizeof *work.whole_sum);
    work.whole_count = dph_alloc_zero(height, sizeof *work.whole_count);
    work.scratch = dph_alloc((size_t)work.pair.workers * SUMS * (width + 2 * RADIUS),
                             sizeof *work.scratch);
    if (!work.luma[0] || !work.luma[1] || !work.whole_sum || !work.whole_count || !work.scratch) {
        dph_fail_memory(err);
        goto error;
    }
    dph_parallel(work.pair.workers, height, luma_row, &work);
    dph_parallel(work.pair.workers, height, window_row, &work);
    *ssim = result(&work);
    ok = true;

error:
    free(work.luma[0]);
    free(work.luma[1]);
    free(work.whole_sum);
    free(work.whole_count);
    free(work.scratch);
    dph_metric_end(&work.pair);
    return ok;
}
