/* Fitting a material for one method and one object: what `diaphan fit` writes.
 *
 * The same steps as for a row of a comparison: bake, trace the training lights, fit. */
#include "judge/protocol.h"

#include "core/fail.h"

#include <string.h>

/* With thickness in the scene. */
static bool fit(struct dph_scene *scene, const struct dph_judge_params *params,
                const struct dph_training *training, double mm_per_unit,
                struct dph_material *fitted, double *before, double *after, struct dph_error *err)
{
    static const double one[3] = {1, 1, 1};
    const struct dph_material *material = &params->material[0];
    struct dph_entry entry = {.method = params->method[0], .material = dph_judge_bare(material)};
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_FIT,
                                  material->name};
    struct dph_fitting fitting = {.renderer = dph_renderer_create(scene, err),
                                  .frame = dph_judge_frame(params, mm_per_unit, &entry),
                                  .training = training,
                                  .size_mm = mm_per_unit * dph_scene_size(scene),
                                  .step = &step};
    struct dph_material found;
    if (!fitting.renderer)
        return false;
    fitting.frame.width = training->width;
    fitting.frame.height = training->height;
    fitting.frame.material.curve = DPH_CURVE_EXP;
    bool ok = dph_fit_error(&fitting, &entry.material, one, before, err) &&
              dph_fit_thickness(&fitting, &found, err) &&
              dph_fit_error(&fitting, &found, one, after, err);
    dph_renderer_destroy(fitting.renderer);
    if (!ok)
        return false;
    *fitted = *material; /* with its highlight and the like */
    fitted->curve = found.curve;
    memcpy(fitted->sigma, found.sigma, sizeof fitted->sigma);
    memcpy(fitted->base, found.base, sizeof fitted->base);
    memcpy(fitted->front, found.front, sizeof fitted->front);
    memcpy(fitted->back, found.back, sizeof fitted->back);
    return true;
}

bool dph_judge_fit(struct dph_scene *scene, const struct dph_judge_params *params,
                   struct dph_material *fitted, double *before, double *after,
                   struct dph_error *err)
{
    struct dph_variant_bake bake = {0};
    struct dph_training training = {0};
    if (!dph_judge_check(params, err))
        return false;
    const struct dph_method *method = params->method[0];
    const struct dph_material *material = &params->material[0];
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_BAKE,
                                  material->name};
    double mm_per_unit = dph_scene_millimetres(scene, params->size_mm);
    bool bakes = method->needs_thickness && !dph_scene_is_baked(scene);
    if (!dph_takes_thickness(method))
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "%s takes no thickness: a material has nothing to fit for it",
                        method->name);
    bool ok = dph_judge_look(scene, params, false, true, err);
    if (ok && bakes)
        ok = dph_variant_bake(&bake, scene, params, material, params->bake.bake.fit,
                              params->bake.bake.bands, &step, err);
    ok = ok && dph_training_trace(scene, params, mm_per_unit, material, &training, err);
    if (ok) {
        if (bakes)
            dph_variant_swap(&bake, scene);
        ok = fit(scene, params, &training, mm_per_unit, fitted, before, after, err);
        if (bakes)
            dph_variant_swap(&bake, scene);
    }
    dph_training_finish(&training);
    dph_variant_finish(&bake);
    return ok;
}
