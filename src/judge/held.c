/* One figure for all directions of light.
 *
 * Three lights by the camera say little about the rest, so every entry is also scored under 24 more
 * that cover the sphere evenly: a spherical Fibonacci set like that of the training (truth.c),
 * turned to 265.9 degrees, where it stays 13.8 degrees away from the training lights, the most that
 * two such sets can, and 18.7 degrees from the scored ones. None of them is fitted on, and their
 * walks are their own. With m the pictures and r the truth of all object pixels of all lights, v
 * the variances of r,
 *
 *     rmse = sqrt(sum((m - r)^2) - sum v) / sqrt(sum(r^2) - sum v):
 *
 * bright lights weigh as much as they are bright. The pictures are those of the training's size,
 * since noise falls with the number of lights and pixels together. */
#include "judge/protocol.h"

#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>

#define HELD_START 265.9

void dph_held_lights(const struct dph_camera *camera, double angle,
                     struct dph_light light[DPH_JUDGE_HELD_LIGHTS])
{
    dph_fibonacci_lights(camera->azimuth + HELD_START, angle, DPH_JUDGE_HELD_LIGHTS, light);
}

void dph_held_finish(struct dph_held *held)
{
    free(held->mask);
    free(held->truth[0]);
    free(held->truth[1]);
    *held = (struct dph_held){0};
}

/* Luminance over the object, of all lights; its sums. */
static bool keep(const struct dph_reference *reference, int which, struct dph_held *held,
                 struct dph_error *err)
{
    size_t pixels = (size_t)held->width * (size_t)held->height;
    double share = dph_judge_share(reference);
    float *to = held->truth[which] = dph_alloc((size_t)held->nlight * held->pixels, sizeof *to);
    if (!to)
        return dph_fail_memory(err);
    for (int l = 0; l < held->nlight; l++) {
        const float *pixel = reference->pixel + 4 * (size_t)l * pixels;
        const float *half = reference->half + 3 * (size_t)l * pixels;
        for (size_t i = 0; i < pixels; i++) {
            if (!held->mask[i])
                continue;
            double r = dph_luminance(pixel + 4 * i), d = dph_luminance(half + 3 * i) - r;
            /* a - b = (a - r) / (1 - p): see score.c */
            double v = share < 1 ? d * d * share / (1 - share) : 0;
            held->noise[which] += v;
            held->square[which] += r * r - v;
            *to++ = (float)r;
        }
    }
    return true;
}

static double root_ratio(double a, double b)
{
    return b > 0 ? sqrt(fmax(0, a) / b) : NAN;
}

/* What is told of the lights. */
static void describe(const struct dph_held *held, int samples, struct dph_held_truth *truth)
{
    *truth = (struct dph_held_truth){.nlight = held->nlight, .samples = samples,
                                     .pixels = held->pixels,
                                     .noise_rmse = root_ratio(held->noise[0], held->square[0]),
                                     .views_rmse = NAN, .views_noise_rmse = NAN};
    if (samples < 2)
        truth->noise_rmse = NAN;
    if (!held->truth[1])
        return;
    double sum = 0;
    for (size_t i = 0; i < (size_t)held->nlight * held->pixels; i++) {
        double d = (double)held->truth[1][i] - (double)held->truth[0][i];
        sum += d * d;
    }
    truth->views_rmse = root_ratio(sum - held->noise[0] - held->noise[1], held->square[0]);
    if (samples > 1)
        truth->views_noise_rmse = root_ratio(held->noise[1], held->square[1]);
}

bool dph_held_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                    double mm_per_unit, struct dph_judged *judged, struct dph_held *held,
                    struct dph_error *err)
{
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_HELD,
                                  judged->material.name};
    double start = dph_seconds();
    int samples = 0;
    *held = (struct dph_held){.width = params->training_width, .height = params->training_height};
    judged->held = (struct dph_held_truth){.noise_rmse = NAN, .views_rmse = NAN,
                                           .views_noise_rmse = NAN};
    if (!params->held_samples)
        return true;
    held->nlight = DPH_JUDGE_HELD_LIGHTS;
    dph_held_lights(&params->camera, dph_judge_angle(params), held->light);
    size_t pixels = (size_t)held->width * (size_t)held->height;
    if (!(held->mask = dph_alloc(pixels, 1)))
        return dph_fail_memory(err);
    /* where the first is stopped the second would take the time that was to be saved */
    for (int views = 0; views == 0 || (views == 1 && dph_judge_has_views(params) &&
                                       samples == params->held_samples); views++) {
        struct dph_reference reference = {0};
        struct dph_tracing_job job = {views ? DPH_TRACING_HELD_VIEWS : DPH_TRACING_HELD,
                                      held->light, held->nlight, held->width, held->height,
                                      params->held_samples, views};
        if (!dph_judge_trace(scene, params, mm_per_unit, &judged->material, &job, &step,
                             &reference, err))
            return false;
        bool ok = true;
        if (!views) {
            held->pixels = dph_judge_mark(reference.pixel, pixels, held->mask);
            samples = reference.samples;
            ok = held->pixels ||
                 dph_fail(err, DPH_ERROR_ARGUMENT, "the camera does not see the object");
        }
        ok = ok && keep(&reference, views, held, err);
        samples = reference.samples < samples ? reference.samples : samples;
        dph_reference_finish(&reference);
        if (!ok)
            return false;
    }
    describe(held, samples, &judged->held);
    judged->seconds_held = dph_seconds() - start;
    return true;
}

/* Adds the squared differences of a picture times a gain from a truth under a light. */
static void add_errors(const struct dph_held *held, int which, int light,
                       const struct dph_image *image, const double gain[3], double *error)
{
    size_t pixels = (size_t)held->width * (size_t)held->height;
    size_t at = (size_t)light * held->pixels;
    for (size_t i = 0; i < pixels; i++) {
        if (!held->mask[i])
            continue;
        float m[3];
        for (size_t c = 0; c < 3; c++)
            m[c] = image->pixel[4 * i + c] * (float)gain[c];
        double d = dph_luminance(m) - (double)held->truth[which][at++];
        *error += d * d;
    }
}

bool dph_held_score(const struct dph_held *held, struct dph_renderer *renderer,
                    const struct dph_judge_params *params, double mm_per_unit,
                    struct dph_entry *entry, size_t twins, int bands, struct dph_error *err)
{
    struct dph_image image = {0};
    double error[2][2] = {{0}};
    bool ok = !held->nlight || dph_image_init(&image, held->width, held->height, err);
    for (int l = 0; l < held->nlight && ok; l++)
        for (size_t i = 0; i < twins * 2 && ok; i++) { /* all from one truth, then from the other */
            size_t k = i / twins, own = i % twins;
            bool another = dph_judge_averages(&entry[own]);
            struct dph_frame frame = dph_judge_frame(params, mm_per_unit, &entry[own]);
            frame.bands = bands;
            frame.width = held->width;
            frame.height = held->height;
            frame.light[0] = held->light[l];
            frame.view_averaged = k > 0;
            if (!held->truth[k])
                break;
            /* a fitted one without thickness differs by its gain alone */
            if (entry->takes_thickness || (!own && (!k || another)))
                ok = dph_renderer_draw(renderer, &frame, &image, err);
            if (ok)
                add_errors(held, (int)k, l, &image, entry[own].gain, &error[own][k]);
        }
    for (size_t i = 0; i < twins; i++) {
        double figure[2] = {NAN, NAN};
        for (int k = 0; k < 2 && held->truth[k]; k++)
            figure[k] = root_ratio(error[i][k] - held->noise[k], held->square[k]);
        entry[i].rmse_all_lights = figure[0];
        entry[i].rmse_all_lights_view_averaged = figure[1];
    }
    dph_image_finish(&image);
    return ok;
}
