/* The lights, and the truth under them.
 *
 * Scored lights stand by the camera: front, side and back at its azimuth + 30, + 90 and + 180
 * degrees, 20 degrees up. The training lights are twelve points of a spherical Fibonacci set, which
 * covers the sphere evenly: point k at height 1 - (2k + 1) / 12, each one golden angle further
 * around. The set turns with the camera and begins at 302 degrees, where all of it is as far as can
 * be from the three scored lights: 29.8 degrees at least. Nothing about it depends on the object.
 *
 * All lights of a set are traced with the same walks, a picture each. */
#include "judge/protocol.h"

#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define DEGREE (PI / 180)
#define GOLDEN_ANGLE 137.50776405003785
#define TRAINING_START 302.0

static const struct {
    const char *name;
    double turn;
} places[] = {{"front", 30}, {"side", 90}, {"back", 180}};
#define ELEVATION 20.0

const char *dph_judge_light_name(size_t i)
{
    return i < sizeof places / sizeof *places ? places[i].name : NULL;
}

bool dph_judge_light_find(const char *name, const struct dph_camera *camera,
                          struct dph_judge_light *light)
{
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        if (!strcmp(places[i].name, name)) {
            snprintf(light->name, sizeof light->name, "%s", name);
            light->azimuth = camera->azimuth + places[i].turn;
            light->elevation = ELEVATION;
            return true;
        }
    return false;
}

static struct dph_light distant(double azimuth, double elevation, double angle)
{
    struct dph_light light = {.irradiance = {PI, PI, PI}, .angle = angle};
    dph_light_direction(azimuth, elevation, light.to_light);
    return light;
}

struct dph_light dph_judge_light_make(const struct dph_judge_light *light, double angle)
{
    return distant(light->azimuth, light->elevation, angle);
}

void dph_fibonacci_lights(double start, double angle, int count, struct dph_light *light)
{
    for (int k = 0; k < count; k++) {
        double height = 1 - (2 * k + 1) / (double)count;
        light[k] = distant(start + k * GOLDEN_ANGLE, asin(height) / DEGREE, angle);
    }
}

void dph_training_lights(const struct dph_camera *camera, double angle,
                         struct dph_light light[DPH_TRAINING_LIGHTS])
{
    dph_fibonacci_lights(camera->azimuth + TRAINING_START, angle, DPH_TRAINING_LIGHTS, light);
}

double dph_judge_angle(const struct dph_judge_params *params)
{
    bool point = params->light_angle == 0;
    return params->boundary == DPH_BOUNDARY_DIELECTRIC && point ? 5 : params->light_angle;
}

struct dph_material dph_judge_bare(const struct dph_material *material)
{
    struct dph_material bare = *material;
    bare.specular = bare.rim = bare.ambient = 0;
    return bare;
}

bool dph_judge_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                     double mm_per_unit, const struct dph_material *material,
                     const struct dph_tracing_job *job, struct dph_judge_step *step,
                     struct dph_reference *reference, struct dph_error *err)
{
    struct dph_reference_options o = dph_reference_defaults();
    o.material = *material;
    o.boundary = params->boundary;
    o.view_averaged = job->view_averaged;
    o.straight = false; /* pictures show none of it */
    o.camera = params->camera;
    o.width = job->width;
    o.height = job->height;
    o.mm_per_unit = mm_per_unit;
    o.nlight = job->nlight;
    o.light = job->light;
    o.separate = true;
    o.samples = job->samples;
    o.seed = params->seed + ((uint64_t)job->set << 48);
    o.threads = params->threads;
    o.progress = dph_judge_step;
    o.progress_user = step;
    return dph_reference_render(scene, &o, reference, err);
}

size_t dph_judge_mark(const float *pixel, size_t pixels, uint8_t *mask)
{
    size_t count = 0;
    for (size_t i = 0; i < pixels; i++)
        count += mask[i] = pixel[4 * i + 3] >= .5F;
    return count;
}

double dph_judge_share(const struct dph_reference *reference)
{
    return (double)((reference->samples + 1) / 2) / (double)reference->samples;
}

void dph_truth_finish(struct dph_truth *truth)
{
    dph_image_finish(&truth->image);
    dph_image_finish(&truth->views);
    free(truth->mask);
    *truth = (struct dph_truth){0};
}

static bool fill_truth(const struct dph_reference *reference, size_t light, int threads,
                       struct dph_truth *truth, struct dph_error *err)
{
    size_t pixels = (size_t)reference->width * (size_t)reference->height;
    const float *pixel = reference->pixel + 4 * light * pixels;
    truth->views_rmse = NAN;
    if (!dph_image_init(&truth->image, reference->width, reference->height, err))
        return false;
    if (!(truth->mask = dph_alloc(pixels, 1)))
        return dph_fail_memory(err);
    memcpy(truth->image.pixel, pixel, 4 * pixels * sizeof *pixel);
    truth->pixels = dph_judge_mark(pixel, pixels, truth->mask);
    if (!truth->pixels)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "the camera does not see the object: no pixel is covered by half");
    for (size_t i = 0; i < pixels; i++)
        if (truth->mask[i])
            truth->mean += dph_luminance(pixel + 4 * i) / (double)truth->pixels;
    return dph_noise_measure(&truth->image, reference->half + 3 * light * pixels,
                             dph_judge_share(reference), truth->mask, threads, &truth->noise, err);
}

bool dph_truth_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                     double mm_per_unit, struct dph_judged *judged, struct dph_error *err)
{
    struct dph_light light[DPH_JUDGE_LIGHTS];
    struct dph_reference reference = {0};
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_TRUTH,
                                  judged->material.name};
    double start = dph_seconds();
    for (size_t i = 0; i < params->nlight; i++)
        light[i] = dph_judge_light_make(&params->light[i], dph_judge_angle(params));
    struct dph_tracing_job job = {DPH_TRACING_TRUTH, light, (int)params->nlight, params->width,
                                  params->height, params->samples, false};
    bool ok = dph_judge_trace(scene, params, mm_per_unit, &judged->material, &job, &step,
                              &reference, err);
    for (size_t i = 0; i < params->nlight && ok; i++)
        ok = fill_truth(&reference, i, params->threads, &judged->truth[i], err);
    judged->samples = reference.samples;
    judged->paths = reference.paths;
    judged->lost = reference.lost;
    judged->capped = reference.capped;
    judged->seconds_truth = dph_seconds() - start;
    dph_reference_finish(&reference);
    return ok;
}

void dph_training_finish(struct dph_training *training)
{
    for (int i = 0; i < DPH_TRAINING_LIGHTS; i++)
        dph_image_finish(&training->image[i]);
    free(training->mask);
    *training = (struct dph_training){0};
}

/* One light's picture, weights and noise. */
static bool fill_training(const struct dph_reference *reference, int light,
                          struct dph_training *training, struct dph_error *err)
{
    size_t pixels = (size_t)reference->width * (size_t)reference->height;
    const float *pixel = reference->pixel + 4 * (size_t)light * pixels;
    const float *half = reference->half + 3 * (size_t)light * pixels;
    double square[3] = {0}, share = dph_judge_share(reference), noise = 0;
    if (!dph_image_init(&training->image[light], reference->width, reference->height, err))
        return false;
    memcpy(training->image[light].pixel, pixel, 4 * pixels * sizeof *pixel);
    for (size_t i = 0; i < pixels; i++) {
        if (!training->mask[i])
            continue;
        for (size_t c = 0; c < 3; c++)
            square[c] += (double)pixel[4 * i + c] * (double)pixel[4 * i + c];
        /* a - b = (a - r) / (1 - p): see score.c */
        double d = (dph_luminance(half + 3 * i) - dph_luminance(pixel + 4 * i));
        noise += share < 1 ? d * d * share / (1 - share) : 0;
    }
    for (int c = 0; c < 3; c++)
        training->weight[light][c] = square[c] > 0 ? 1 / square[c] : 0;
    training->noise[light] = noise / (double)training->pixels;
    return true;
}

bool dph_training_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                        double mm_per_unit, const struct dph_material *material,
                        struct dph_training *training, struct dph_error *err)
{
    struct dph_reference reference = {0};
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_TRAINING,
                                  material->name};
    double start = dph_seconds();
    *training = (struct dph_training){.nlight = DPH_TRAINING_LIGHTS,
                                      .width = params->training_width,
                                      .height = params->training_height};
    dph_training_lights(&params->camera, dph_judge_angle(params), training->light);
    struct dph_tracing_job job = {DPH_TRACING_TRAINING, training->light, training->nlight,
                                  training->width, training->height, params->training_samples,
                                  false};
    if (!dph_judge_trace(scene, params, mm_per_unit, material, &job, &step, &reference, err))
        return false;
    size_t pixels = (size_t)training->width * (size_t)training->height;
    bool ok = (training->mask = dph_alloc(pixels, 1)) || dph_fail_memory(err);
    if (ok)
        training->pixels = dph_judge_mark(reference.pixel, pixels, training->mask);
    if (ok && !training->pixels)
        ok = dph_fail(err, DPH_ERROR_ARGUMENT, "the camera does not see the object");
    for (int i = 0; i < training->nlight && ok; i++)
        ok = fill_training(&reference, i, training, err);
    training->seconds = dph_seconds() - start;
    dph_reference_finish(&reference);
    if (!ok)
        dph_training_finish(training);
    return ok;
}
