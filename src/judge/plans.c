/* Which entries a comparison has.
 *
 * Every method has one, shsss two: with the bands of the bake (or of the file) and with two bands,
 * the four coefficients that Tomaszewska and Stefanowski recommend for light in front. Two bands
 * are baked as such, since the weighted fit makes the best of them. Beside a response stand, without
 * pictures, shsss with 4 and with 3 bands, which take the bytes of its forms. The response has three, with
 * the bands that were asked for, with 4 and with 3, of one bake. The fitted curve of a method
 * that takes thickness is the exponential one, since the slab's has nothing to fit. A study adds,
 * without pictures, both formulas, both curves, both fits of the coefficients and 2, 3, 4 and 6
 * bands of shsss, all combined; there the curve stays when it is fitted. */
#include "judge/plans.h"

#include <diaphan/prepare.h>

#include <stdio.h>

/* The number of a way to bake, added where it is new. */
static int way_of(struct dph_plans *plans, bool stored, enum dph_fit fit, int bands)
{
    for (int i = 0; i < plans->nway; i++)
        if (plans->way[i].stored == stored && plans->way[i].fit == fit &&
            plans->way[i].bands == bands)
            return i;
    plans->way[plans->nway] = (struct dph_way){stored, fit, bands};
    return plans->nway++;
}

static struct dph_plan *add_plan(struct dph_plans *plans, const struct dph_method *method)
{
    struct dph_plan *plan = &plans->plan[plans->nplan++];
    *plan = (struct dph_plan){.method = method, .shown = true, .bake = -1};
    return plan;
}

static void plan_study(struct dph_plans *plans, const struct dph_method *method, int most)
{
    static const int bands[] = {2, 3, 4, 6};
    static const char *const formulas[] = {"g", "paper"}, *const curves[] = {"slab", "exp"};
    int all = most < 6 ? most : 6;
    for (int formula = 0; formula < 2; formula++)
        for (int curve = 0; curve < 2; curve++)
            for (int fit = 0; fit < 2; fit++)
                for (int b = 0; b < 4; b++) {
                    if (bands[b] > all)
                        continue;
                    struct dph_plan *plan = add_plan(plans, method);
                    plan->shown = false;
                    plan->formula = (enum dph_formula)formula;
                    plan->curve = plan->fitted_curve = (enum dph_curve)curve;
                    plan->bands = bands[b];
                    plan->bake = way_of(plans, false, (enum dph_fit)fit,
                                        fit == DPH_FIT_SPHERE ? all : bands[b]);
                    snprintf(plan->variant, sizeof plan->variant, "%s, %s, %s, %d bands",
                             formulas[formula], curves[curve], dph_fit_name((enum dph_fit)fit),
                             bands[b]);
                }
}

/* The forms of a response, where it is to be baked: one bake makes them all. */
static void plan_response(struct dph_plans *plans, const struct dph_scene *scene,
                          const struct dph_judge_params *params, struct dph_plan *plan,
                          const struct dph_material *material)
{
    static const int fewer[] = {4, 3};
    const struct dph_response_params *form = &params->response.form;
    const struct dph_plan first = *plan;
    bool found;
    if (dph_scene_rivals_fit(scene, DPH_PRODUCT_RESPONSE, material,
                             dph_scene_millimetres(scene, params->size_mm), NULL, 0, &found))
        return;
    for (int i = -1; i < 2; i++) {
        if (i >= 0 && fewer[i] >= form->bands)
            continue;
        if (i >= 0) {
            plan = add_plan(plans, first.method);
            *plan = first;
        }
        plan->response = i < 0 ? form->bands : fewer[i];
        snprintf(plan->variant, sizeof plan->variant, "%s, %d bands",
                 dph_response_form_name(form->form), plan->response);
    }
}

static bool beside_response(const struct dph_judge_params *params)
{
    for (size_t i = 0; i < params->nmethod; i++)
        if (params->method[i]->needs & DPH_PRODUCT_RESPONSE)
            return true;
    return false;
}

void dph_plans_make(struct dph_plans *plans, const struct dph_scene *scene, bool stored,
                    const struct dph_judge_params *params, const struct dph_material *material)
{
    int bands = params->bake.bake.bands;
    for (size_t b = 0; b < scene->nbody && stored; b++)
        if (scene->body[b].thickness)
            bands = scene->body[b].thickness->bands;
    bands = bands < DPH_DRAW_BANDS ? bands : DPH_DRAW_BANDS;
    *plans = (struct dph_plans){0};
    for (size_t m = 0; m < params->nmethod; m++) {
        const struct dph_method *method = params->method[m];
        struct dph_plan *plan = add_plan(plans, method);
        plan->formula = material->formula;
        plan->curve = material->curve;
        plan->fitted_curve = DPH_CURVE_EXP;
        if (method->needs & DPH_PRODUCT_RESPONSE)
            plan_response(plans, scene, params, plan, material);
        if (!method->needs_thickness)
            continue;
        plan->bake = way_of(plans, stored, params->bake.bake.fit, bands);
        snprintf(plan->variant, sizeof plan->variant, "%d bands", bands);
        for (int i = 0; i < 3; i++) {
            static const int fewer[] = {2, 4, 3};
            if (bands <= fewer[i] || (i && !beside_response(params)))
                continue;
            struct dph_plan *few = add_plan(plans, method);
            *few = *plan;
            few->shown = !i;
            few->bands = fewer[i];
            few->bake = way_of(plans, false, params->bake.bake.fit, fewer[i]);
            snprintf(few->variant, sizeof few->variant, "%d bands", fewer[i]);
        }
        if (params->study)
            plan_study(plans, method, params->bake.bake.bands);
    }
}

