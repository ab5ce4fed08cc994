/* diaphan/metrics.h - how far one picture is from another.      Tier 1. Part of the image library.
 *
 * Every measure but the relative one looks at the pictures as a screen shows them: channels times
 * 2^exposure, clipped to [0, 1], sRGB. What is not a number counts as 0, as it does in a written
 * PNG. Alpha is ignored. Results are the same for any number of threads. */
#ifndef DIAPHAN_METRICS_H
#define DIAPHAN_METRICS_H

#include <diaphan/image.h>

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct dph_metric_params {
    double exposure;          /* stops, of both pictures */
    const uint8_t *mask;      /* (height x width) 0: the pixel does not count. Nullable: all do */
    double pixels_per_degree; /* of visual angle, FLIP only, 1 to 1000 */
    int threads;              /* 0: all */
};

/* Exposure 0, no mask, 67 pixels per degree (FLIP's own default: a screen of 3840 pixels, as far
 * away as it is wide), all threads. */
struct dph_metric_params dph_metric_defaults(void);

/* Each compares two pictures of one size. `map` (height x width; Nullable) receives the measure at
 * every pixel; where the mask is 0 it says "no difference". False: DPH_ERROR_INPUT (two sizes),
 * DPH_ERROR_ARGUMENT (a mask without a pixel, a parameter out of its range), DPH_ERROR_MEMORY. */

/* Root mean square of the differences of R, G and B, 0 to 1. Map: the same over a pixel's three
 * channels. Symmetric. */
bool dph_metric_rmse(const struct dph_image *reference, const struct dph_image *test,
                     const struct dph_metric_params *params, double *rmse, float *map,
                     struct dph_error *err);

/* The peak signal-to-noise ratio, in dB, that belongs to such an error: INFINITY for 0. */
double dph_metric_psnr(double rmse);

/* RMS of the difference over RMS of the reference, in linear luminance, neither clipped nor
 * exposed: the one measure here that is not about a screen. INFINITY where the reference is black
 * and the test is not, 0 where both are. No map. */
bool dph_metric_relative_rmse(const struct dph_image *reference, const struct dph_image *test,
                              const struct dph_metric_params *params, double *rmse,
                              struct dph_error *err);

/* Mean structural similarity of the luma, -1 to 1, 1 for equal pictures, over the windows that lie
 * wholly within the picture and the mask; where no window does, over all pixels of the mask, with
 * windows cut to it. Map: the index at every pixel, with windows cut likewise. Symmetric. */
bool dph_metric_ssim(const struct dph_image *reference, const struct dph_image *test,
                     const struct dph_metric_params *params, double *ssim, float *map,
                     struct dph_error *err);

/* Mean LDR-FLIP, 0 to 1, 0 for equal pictures: what an eye notices that flips between the two. Its
 * filters see the whole picture, the mask only chooses the pixels of the mean. Symmetric. */
bool dph_metric_flip(const struct dph_image *reference, const struct dph_image *test,
                     const struct dph_metric_params *params, double *flip, float *map,
                     struct dph_error *err);

/* Allocates a picture of `map` (height x width), 0 to 1, in the colours "magma": black, purple,
 * orange, pale yellow. Written as PNG it has exactly these colours. False: as dph_image_init. */
bool dph_image_init_magma(struct dph_image *image, const float *map, int width, int height,
                          struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
