/* Drawing the entries of a comparison, scoring them, and saying which figures noise drowns.
 *
 * All methods get the same camera, lights and size, and neither highlight, rim nor ambient light.
 * Two things make a figure doubtful, and each is told where it stands. PSNR within 10 dB of what
 * the noise of the reference alone leaves: then a tenth of the error or more is noise. And two
 * methods that the reference cannot tell apart: with pictures m and n, truth r, and variance v of a
 * pixel of r, the difference of their squared errors is
 *
 *     D = mean((m - r)^2 - (n - r)^2),   of variance   4 sum((m - n)^2 v) / N^2,
 *
 * since m - r and n - r hold the same noise. Methods are ranked by their error, and each is held
 * against the next: where |D| is within two standard deviations both get a warning. v of a pixel is
 * taken as the mean over the object. */
#include "judge/protocol.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MARGIN 10.0 /* dB */

struct dph_frame dph_judge_frame(const struct dph_judge_params *params, double mm_per_unit,
                                 const struct dph_entry *entry)
{
    struct dph_frame frame = dph_frame_defaults();
    frame.method = entry->method;
    frame.material = entry->material;
    frame.camera = params->camera;
    frame.nlight = 1;
    frame.light[0] = dph_judge_light_make(&params->light[0], dph_judge_angle(params));
    frame.width = params->width;
    frame.height = params->height;
    frame.mm_per_unit = mm_per_unit;
    frame.samples = params->multisamples;
    frame.map_size = params->map_size;
    frame.blur_mm = params->blur_mm;
    return frame;
}

void dph_shot_finish(struct dph_shot *shot)
{
    dph_image_finish(&shot->image);
    free(shot->flip);
    *shot = (struct dph_shot){0};
}

static void multiply(struct dph_image *image, const double gain[3])
{
    for (size_t i = 0; i < (size_t)image->width * (size_t)image->height; i++)
        for (size_t c = 0; c < 3; c++)
            image->pixel[4 * i + c] *= (float)gain[c];
}

/* The error from the truth averaged over views: of the picture, or of the average that the method
 * draws. */
static bool measure_average(struct dph_renderer *renderer, struct dph_frame frame,
                            const struct dph_truth *truth, const struct dph_entry *entry,
                            const struct dph_image *picture, struct dph_scores *scores,
                            struct dph_error *err)
{
    struct dph_image average = {0};
    double variance = truth->views_noise.variance;
    bool ok = true;
    frame.view_averaged = true;
    if (dph_judge_averages(entry)) {
        ok = dph_image_init(&average, frame.width, frame.height, err) &&
             dph_renderer_draw(renderer, &frame, &average, err);
        if (ok)
            multiply(&average, entry->gain);
    }
    if (ok)
        scores->rmse_view_averaged =
            dph_relative_error(&truth->views, isfinite(variance) ? variance : 0,
                               average.pixel ? &average : picture, 0, truth->mask);
    dph_image_finish(&average);
    return ok;
}

bool dph_shots_draw(struct dph_renderer *renderer, const struct dph_judge_params *params,
                    double mm_per_unit, const struct dph_judged *judged, struct dph_entry *entry,
                    int bands, struct dph_error *err)
{
    struct dph_frame frame = dph_judge_frame(params, mm_per_unit, entry);
    size_t pixels = (size_t)params->width * (size_t)params->height;
    frame.bands = bands;
    for (size_t l = 0; l < params->nlight; l++) {
        struct dph_shot *shot = &entry->shot[l];
        const struct dph_truth *truth = &judged->truth[l];
        frame.light[0] = dph_judge_light_make(&params->light[l], dph_judge_angle(params));
        if (!dph_image_init(&shot->image, params->width, params->height, err) ||
            !dph_renderer_draw(renderer, &frame, &shot->image, err))
            return false;
        multiply(&shot->image, entry->gain);
        if (entry->shown && !(shot->flip = dph_alloc(pixels, sizeof *shot->flip)))
            return dph_fail_memory(err);
        if (!dph_scores_measure(&truth->image, &truth->noise, &shot->image, truth->mask,
                                params->threads, &shot->scores, shot->flip, err))
            return false;
        if (truth->views.pixel &&
            !measure_average(renderer, frame, truth, entry, &shot->image, &shot->scores, err))
            return false;
        if (!entry->shown)
            dph_image_finish(&shot->image);
    }
    return true;
}

bool dph_shots_time(struct dph_renderer *renderer, const struct dph_judge_params *params,
                    double mm_per_unit, struct dph_entry *entry, int bands, struct dph_error *err)
{
    struct dph_timing timing;
    struct dph_timing_params how = dph_timing_defaults();
    struct dph_timing_job job = {renderer, dph_judge_frame(params, mm_per_unit, entry)};
    job.frame.bands = bands;
    job.frame.samples = dph_frame_defaults().samples; /* what a frame costs elsewhere */
    how.seconds = .1;
    how.rounds = 6;
    if (!dph_renderer_measure(&job, 1, &how, &timing, err))
        return false;
    entry->milliseconds = timing.ms_median;
    return true;
}

static void say(struct dph_shot *shot, const char *format, const char *name, const char *variant,
                bool fitted)
{
    size_t length = strlen(shot->warning);
    shot->noisy = true;
    if (length && length + 2 < sizeof shot->warning)
        length += (size_t)snprintf(shot->warning + length, sizeof shot->warning - length, "; ");
    if (length < sizeof shot->warning)
        snprintf(shot->warning + length, sizeof shot->warning - length, format, name,
                 *variant ? " " : "", variant, fitted ? ", fitted" : "");
}

/* Whether the reference tells two pictures apart. */
static bool told_apart(const struct dph_truth *truth, const struct dph_image *m,
                       const struct dph_image *n)
{
    double difference = 0, spread = 0;
    size_t pixels = (size_t)truth->image.width * (size_t)truth->image.height;
    for (size_t i = 0; i < pixels; i++) {
        if (!truth->mask[i])
            continue;
        double r = dph_luminance(truth->image.pixel + 4 * i);
        double a = dph_luminance(m->pixel + 4 * i), b = dph_luminance(n->pixel + 4 * i);
        difference += (a - b) * (a + b - 2 * r);
        spread += (a - b) * (a - b);
    }
    return fabs(difference) > 2 * sqrt(4 * spread * truth->noise.variance);
}

/* The entry with pictures whose error is the least above that of `entry`; ties by order. NULL:
 * none. */
static struct dph_entry *next_worse(struct dph_judged *judged, const struct dph_entry *entry,
                                    size_t light)
{
    struct dph_entry *found = NULL;
    for (size_t i = 0; i < judged->nentry; i++) {
        struct dph_entry *other = &judged->entry[i];
        double own = entry->shot[light].scores.rmse_raw, its = other->shot[light].scores.rmse_raw;
        if (!other->shown || !(its > own || (its == own && other > entry)))
            continue;
        if (!found || its < found->shot[light].scores.rmse_raw)
            found = other;
    }
    return found;
}

void dph_shots_warn(struct dph_judged *judged, size_t nlight)
{
    for (size_t l = 0; l < nlight; l++) {
        const struct dph_truth *truth = &judged->truth[l];
        for (size_t i = 0; i < judged->nentry; i++) {
            struct dph_shot *shot = &judged->entry[i].shot[l];
            if (!isfinite(truth->noise.psnr)) {
                if (isnan(truth->noise.psnr))
                    say(shot, "the noise of the reference is not known%s%s%s%s", "", "", false);
                continue;
            }
            if (!(shot->scores.psnr < truth->noise.psnr - MARGIN)) {
                char text[48];
                snprintf(text, sizeof text, "%.1f", truth->noise.psnr);
                say(shot, "PSNR is within 10 dB of the noise of the reference, %s dB%s%s%s", text,
                    "", false);
            }
        }
        for (size_t i = 0; i < judged->nentry; i++) {
            struct dph_entry *entry = &judged->entry[i], *worse;
            if (!entry->shown || !(worse = next_worse(judged, entry, l)) ||
                !isfinite(truth->noise.variance) ||
                told_apart(truth, &entry->shot[l].image, &worse->shot[l].image))
                continue;
            say(&entry->shot[l], "within noise as far off as %s%s%s%s", worse->method->name,
                worse->variant, worse->fitted);
            say(&worse->shot[l], "within noise as far off as %s%s%s%s", entry->method->name,
                entry->variant, entry->fitted);
        }
    }
}
