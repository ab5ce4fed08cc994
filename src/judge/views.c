/* The truth averaged over views, beside that of a picture.
 *
 * A response holds what leaves a point averaged over the directions in which it leaves, with their
 * cosine; a picture shows one of these directions. Even an average without any error is therefore
 * not the picture. How far it would be, the distance of the two truths, is measured here: with a
 * and b their pictures, from independent walks, and va, vb the variances of their noise,
 *
 *     sqrt(mean((a - b)^2) - va - vb) / sqrt(mean(b^2) - vb).
 *
 * The mean over views has the least squared error of all that does not depend on the view, summed
 * over the views; from one camera a method may come nearer to the picture by chance. */
#include "judge/protocol.h"

#include "core/clock.h"

#include <math.h>
#include <string.h>

bool dph_judge_has_views(const struct dph_judge_params *params)
{
    for (size_t i = 0; i < params->nmethod && params->boundary == DPH_BOUNDARY_MATCHED; i++)
        if (params->method[i]->needs & DPH_PRODUCT_RESPONSE)
            return true;
    return false;
}

bool dph_judge_averages(const struct dph_entry *entry)
{
    return entry->method->needs & DPH_PRODUCT_RESPONSE;
}

static bool fill_views(const struct dph_reference *reference, size_t light, int threads,
                       struct dph_truth *truth, struct dph_error *err)
{
    size_t pixels = (size_t)reference->width * (size_t)reference->height;
    if (!dph_image_init(&truth->views, reference->width, reference->height, err))
        return false;
    memcpy(truth->views.pixel, reference->pixel + 4 * light * pixels,
           4 * pixels * sizeof *reference->pixel);
    if (!dph_noise_measure(&truth->views, reference->half + 3 * light * pixels,
                           dph_judge_share(reference), truth->mask, threads, &truth->views_noise,
                           err))
        return false;
    double variance = truth->noise.variance, other = truth->views_noise.variance;
    truth->views_rmse = dph_relative_error(&truth->image, isfinite(variance) ? variance : 0,
                                           &truth->views, isfinite(other) ? other : 0, truth->mask);
    return true;
}

bool dph_views_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                     double mm_per_unit, struct dph_judged *judged, struct dph_error *err)
{
    struct dph_light light[DPH_JUDGE_LIGHTS];
    struct dph_reference reference = {0};
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_VIEWS,
                                  judged->material.name};
    double start = dph_seconds();
    for (size_t i = 0; i < params->nlight; i++)
        light[i] = dph_judge_light_make(&params->light[i], dph_judge_angle(params));
    struct dph_tracing_job job = {DPH_TRACING_VIEWS, light, (int)params->nlight, params->width,
                                  params->height,
                                  params->views_samples ? params->views_samples : params->samples,
                                  true};
    bool ok = dph_judge_trace(scene, params, mm_per_unit, &judged->material, &job, &step,
                              &reference, err);
    for (size_t i = 0; i < params->nlight && ok; i++)
        ok = fill_views(&reference, i, params->threads, &judged->truth[i], err);
    judged->seconds_views = dph_seconds() - start;
    dph_reference_finish(&reference);
    return ok;
}
