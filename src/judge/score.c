/* How far a picture is from a reference that is itself noisy.
 *
 * Everything is taken over the object's pixels. PSNR, SSIM and LDR-FLIP are those of metrics.h. The
 * relative error takes linear luminance m of the picture and r of the reference. With r = t + e, t
 * the truth and e noise of mean 0 and variance v that knows nothing of m,
 *
 *     E (m - r)^2 = (m - t)^2 + v,        E r^2 = t^2 + v,
 *
 * so that
 *
 *     rmse = sqrt(mean((m - r)^2) - mean v) / sqrt(mean(r^2) - mean v)
 *
 * is what an endless reference would give, but for the chance in the means. v of luminance does not
 * follow from the variances of the channels, whose noise comes from the same walks. It comes from
 * the halves a and b of the samples: with their shares p and q of all samples, r = p a + q b,
 *
 *     E (a - b)^2 = v / (p q),        v = p q mean (a - b)^2.
 *
 * For equal shares the difference of the halves has four times the power of the noise of r, so its
 * PSNR is 20 log10 2 = 6.02 dB below that of the noise alone. SSIM and FLIP have no such law: they
 * are given between the halves, which are noisier than r, and bound what noise does. */
#include "judge/protocol.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/metrics.h>

#include <math.h>
#include <stdlib.h>

double dph_relative_error(const struct dph_image *reference, double variance,
                          const struct dph_image *image, double image_variance,
                          const uint8_t *mask)
{
    double error = 0, truth = 0;
    size_t count = 0, pixels = (size_t)reference->width * (size_t)reference->height;
    for (size_t i = 0; i < pixels; i++) {
        if (!mask[i])
            continue;
        double r = dph_luminance(reference->pixel + 4 * i);
        double d = dph_luminance(image->pixel + 4 * i) - r;
        error += d * d;
        truth += r * r;
        count++;
    }
    if (!count)
        return NAN;
    error = error / (double)count - variance - image_variance;
    truth = truth / (double)count - variance;
    if (error <= 0)
        return 0;
    return truth > 0 ? sqrt(error / truth) : NAN;
}

bool dph_scores_measure(const struct dph_image *reference, const struct dph_noise *noise,
                        const struct dph_image *image, const uint8_t *mask, int threads,
                        struct dph_scores *scores, float *map, struct dph_error *err)
{
    double rmse;
    struct dph_metric_params params = dph_metric_defaults();
    params.mask = mask;
    params.threads = threads;
    if (!dph_metric_rmse(reference, image, &params, &rmse, NULL, err) ||
        !dph_metric_ssim(reference, image, &params, &scores->ssim, NULL, err) ||
        !dph_metric_flip(reference, image, &params, &scores->flip, map, err))
        return false;
    scores->psnr = dph_metric_psnr(rmse);
    scores->rmse_raw = dph_relative_error(reference, 0, image, 0, mask);
    bool known = noise && isfinite(noise->variance);
    scores->rmse_view_averaged = NAN;
    scores->rmse =
        known ? dph_relative_error(reference, noise->variance, image, 0, mask) : scores->rmse_raw;
    return true;
}

bool dph_noise_measure(const struct dph_image *reference, const float *half, double share,
                       const uint8_t *mask, int threads, struct dph_noise *noise,
                       struct dph_error *err)
{
    *noise = (struct dph_noise){NAN, NAN, NAN, NAN, NAN};
    if (!(share > 0 && share < 1))
        return true;
    struct dph_image a = {0}, b = {0};
    struct dph_metric_params params = dph_metric_defaults();
    params.mask = mask;
    params.threads = threads;
    bool ok = dph_image_init(&a, reference->width, reference->height, err) &&
              dph_image_init(&b, reference->width, reference->height, err);
    if (!ok)
        goto error;
    double sum = 0, truth = 0, rmse;
    size_t count = 0, pixels = (size_t)reference->width * (size_t)reference->height;
    for (size_t i = 0; i < pixels; i++) {
        const float *r = reference->pixel + 4 * i;
        for (size_t c = 0; c < 3; c++) {
            a.pixel[4 * i + c] = half[3 * i + c];
            b.pixel[4 * i + c] =
                (float)(((double)r[c] - share * (double)half[3 * i + c]) / (1 - share));
        }
        a.pixel[4 * i + 3] = b.pixel[4 * i + 3] = r[3];
        if (!mask[i])
            continue;
        double d = dph_luminance(a.pixel + 4 * i) - dph_luminance(b.pixel + 4 * i);
        sum += d * d;
        truth += dph_luminance(r) * dph_luminance(r);
        count++;
    }
    ok = dph_metric_rmse(&a, &b, &params, &rmse, NULL, err) &&
         dph_metric_ssim(&a, &b, &params, &noise->ssim, NULL, err) &&
         dph_metric_flip(&a, &b, &params, &noise->flip, NULL, err);
    if (!ok)
        goto error;
    double quarter = share * (1 - share);
    noise->psnr = dph_metric_psnr(rmse * sqrt(quarter));
    noise->variance = quarter * sum / (double)count;
    truth = truth / (double)count - noise->variance;
    noise->rmse = noise->variance <= 0 ? 0 : truth > 0 ? sqrt(noise->variance / truth) : NAN;

error:
    dph_image_finish(&a);
    dph_image_finish(&b);
    return ok;
}
