/* The comparison: the order in which everything is made.
 *
 * For every material: bake, trace the truth, trace the training pictures, and then, for every way
 * in which thickness is baked, draw what is drawn from it, first with the numbers of the material,
 * then with fitted ones. plans.c says which entries there are. */
#include "judge/plans.h"
#include "judge/protocol.h"

#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What is in hand while one material is judged. */
struct work {
    struct dph_scene *scene;
    const struct dph_judge_params *params;
    struct dph_comparison *comparison;
    struct dph_judged *judged;
    const struct dph_plans *plans;
    struct dph_variant_bake bake[DPH_MOST_WAYS];
    struct dph_rivals_report rivals;
    struct dph_scene_response_report response;
    struct dph_training training;
    struct dph_held held;
    double mm_per_unit;
};

bool dph_judge_step(void *user, double fraction)
{
    const struct dph_judge_step *step = user;
    return !step || !step->progress ||
           step->progress(step->user, step->phase, step->material, fraction);
}

bool dph_judge_step_checked(struct dph_judge_step *step, double fraction, struct dph_error *err)
{
    return dph_judge_step(step, fraction) || dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
}

const char *dph_judge_phase_name(enum dph_judge_phase phase)
{
    switch (phase) {
    case DPH_JUDGE_BAKE: return "baking";
    case DPH_JUDGE_TRUTH: return "tracing";
    case DPH_JUDGE_TRAINING: return "tracing to fit";
    case DPH_JUDGE_VIEWS: return "tracing views";
    case DPH_JUDGE_HELD: return "tracing all lights";
    case DPH_JUDGE_FIT: return "fitting";
    case DPH_JUDGE_DRAW: return "drawing";
    }
    return "working";
}

struct dph_judge_params dph_judge_defaults(void)
{
    struct dph_frame frame = dph_frame_defaults();
    struct dph_judge_params params = {
        .camera = frame.camera,
        .width = frame.width,
        .height = frame.height,
        .samples = 256,
        .seed = 1,
        .fit = true,
        .training_width = 160,
        .training_height = 100,
        .training_samples = 64,
        .held_samples = 32,
        .bake = dph_scene_bake_defaults(),
        .rivals = dph_rivals_defaults(),
        .response = dph_scene_response_defaults(),
        .map_size = frame.map_size,
        .blur_mm = frame.blur_mm,
        .multisamples = 16,
    };
    const char *name;
    for (size_t i = 0; (name = dph_judge_light_name(i)); i++)
        dph_judge_light_find(name, &params.camera, &params.light[params.nlight++]);
    return params;
}

bool dph_judge_check(const struct dph_judge_params *params, struct dph_error *err)
{
    if (!params->nmethod || !params->nmaterial)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "nothing to compare: %zu methods, %zu materials",
                        params->nmethod, params->nmaterial);
    for (size_t i = 0; i < params->nmethod; i++)
        if (params->method[i]->quantity)
            return dph_fail(err, DPH_ERROR_ARGUMENT, "%s draws a quantity, not light",
                            params->method[i]->name);
    if (params->nlight < 1 || params->nlight > DPH_JUDGE_LIGHTS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%zu lights: 1 to %d are scored", params->nlight,
                        DPH_JUDGE_LIGHTS);
    if (params->width < 1 || params->height < 1 || params->width > 32768 ||
        params->height > 32768 || params->training_width < 1 || params->training_height < 1 ||
        params->training_width > 4096 || params->training_height > 4096)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d x %d pixels, %d x %d to train with",
                        params->width, params->height, params->training_width,
                        params->training_height);
    for (size_t i = 0; i < params->nmethod; i++)
        for (size_t k = 0; k < i; k++)
            if (params->method[i] == params->method[k])
                return dph_fail(err, DPH_ERROR_ARGUMENT, "%s twice", params->method[i]->name);
    if (params->samples < 1 || params->training_samples < 1 || params->views_samples < 0 ||
        params->held_samples < 0)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "%d samples a pixel, %d to train with, %d of views, %d of all lights",
                        params->samples, params->training_samples, params->views_samples,
                        params->held_samples);
    return true;
}

bool dph_takes_thickness(const struct dph_method *method)
{
    return method->needs_thickness || !strncmp(method->name, "green", 5);
}

static int transfer_bands(const struct dph_scene *scene)
{
    for (size_t i = 0; i < scene->nbody; i++)
        if (scene->body[i].rivals && scene->body[i].rivals->transfer.npos)
            return scene->body[i].rivals->transfer.bands;
    return 0;
}

static double rivals_seconds(const struct dph_method *method,
                             const struct dph_rivals_report *report)
{
    double seconds = 0;
    if (method->needs & DPH_PRODUCT_NORMALS)
        seconds += report->seconds_normals;
    if (method->needs & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS))
        seconds += report->seconds_transfer;
    if (method->needs & DPH_PRODUCT_CLUSTERS)
        seconds += report->seconds_clusters;
    return seconds;
}

/* What is known of an entry before it is drawn, while its bake is in the scene. */
static bool begin_entry(struct work *work, const struct dph_plan *plan,
                        struct dph_renderer *renderer, struct dph_entry *entry,
                        struct dph_error *err)
{
    struct dph_cost cost;
    entry->method = plan->method;
    memcpy(entry->variant, plan->variant, sizeof entry->variant);
    entry->shown = plan->shown;
    entry->takes_thickness = dph_takes_thickness(plan->method);
    entry->material = work->judged->material;
    entry->material.formula = plan->formula;
    entry->material.curve = plan->curve;
    for (int c = 0; c < 3; c++)
        entry->gain[c] = 1;
    entry->training_before = entry->training_after = NAN;
    struct dph_frame frame = dph_judge_frame(work->params, work->mm_per_unit, entry);
    frame.bands = plan->bands;
    if (!dph_renderer_cost(renderer, &frame, &cost, err))
        return false;
    entry->passes = cost.passes;
    entry->bytes_per_vertex = cost.bytes_per_vertex;
    entry->table_bytes = cost.table_bytes;
    entry->payload_bytes = dph_variant_payload(work->scene, plan->method);
    entry->seconds = rivals_seconds(plan->method, &work->rivals);
    if (plan->method->needs & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS))
        entry->bands = transfer_bands(work->scene);
    if (plan->method->needs & DPH_PRODUCT_RESPONSE) {
        entry->seconds += work->response.seconds_bake + work->response.seconds_form;
        for (size_t b = 0; b < work->scene->nbody && !entry->bands; b++)
            if (work->scene->body[b].rivals && work->scene->body[b].rivals->response)
                entry->bands = work->scene->body[b].rivals->response->bands;
    }
    for (size_t b = 0; b < work->scene->nbody && plan->method->needs_thickness; b++) {
        const struct dph_thickness *t = work->scene->body[b].thickness;
        if (!t)
            continue;
        entry->stores = true;
        entry->store = t->store;
        entry->fit = t->fit;
        entry->bands = t->bands < DPH_DRAW_BANDS ? t->bands : DPH_DRAW_BANDS;
        if (plan->bands && plan->bands < entry->bands && t->store != DPH_STORE_CPCA) {
            entry->bands = plan->bands; /* no more than these need be stored */
            size_t n = (size_t)(plan->bands * plan->bands), size = dph_store_size(t->store);
            entry->payload_bytes = (double)(n * size);
            entry->bytes_per_vertex = (double)((n + 3) / 4 * 4 * size);
        }
        break;
    }
    if (plan->bake >= 0)
        entry->seconds += work->bake[plan->bake].seconds;
    return true;
}

/* Makes the fitted twin of an entry. */
static bool fit_entry(struct work *work, const struct dph_plan *plan, struct dph_renderer *renderer,
                      struct dph_entry *entry, struct dph_judge_step *step, struct dph_error *err)
{
    static const double one[3] = {1, 1, 1};
    struct dph_fitting fitting = {.renderer = renderer,
                                  .frame = dph_judge_frame(work->params, work->mm_per_unit, entry),
                                  .training = &work->training,
                                  .size_mm = work->comparison->size_mm,
                                  .step = step};
    fitting.frame.width = work->training.width;
    fitting.frame.height = work->training.height;
    fitting.frame.bands = plan->bands;
    entry->fitted = true;
    if (!dph_fit_error(&fitting, &entry->material, one, &entry->training_before, err))
        return false;
    if (entry->takes_thickness) {
        fitting.frame.material.curve = plan->fitted_curve;
        if (!dph_fit_thickness(&fitting, &entry->material, err))
            return false;
    } else if (!dph_fit_gain(&fitting, entry->gain, err)) {
        return false;
    }
    return dph_fit_error(&fitting, &entry->material, entry->gain, &entry->training_after, err);
}

/* The entries of one plan. */
static bool judge_plan(struct work *work, size_t number, struct dph_renderer *renderer,
                       struct dph_error *err)
{
    const struct dph_judge_params *params = work->params;
    const struct dph_plan *plan = &work->plans->plan[number];
    size_t twins = params->fit ? 2 : 1;
    struct dph_entry *entry = &work->judged->entry[twins * number];
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_FIT,
                                  work->judged->material.name};
    if (!begin_entry(work, plan, renderer, entry, err) ||
        (plan->shown &&
         !dph_shots_time(renderer, params, work->mm_per_unit, entry, plan->bands, err)))
        return false;
    if (params->fit) {
        struct dph_shot *shot = entry[1].shot;
        entry[1] = entry[0];
        entry[1].shot = shot;
        if (!fit_entry(work, plan, renderer, &entry[1], &step, err))
            return false;
    }
    step.phase = DPH_JUDGE_DRAW;
    for (size_t i = 0; i < twins; i++)
        if (!dph_judge_step_checked(
                &step, (double)(twins * number + i) / (double)work->judged->nentry, err) ||
            !dph_shots_draw(renderer, params, work->mm_per_unit, work->judged, &entry[i],
                            plan->bands, err))
            return false;
    return dph_held_score(&work->held, renderer, params, work->mm_per_unit, entry, twins,
                          plan->bands, err);
}

/* All plans that are drawn from one bake (-1: from none). */
static bool judge_bake(struct work *work, int bake, struct dph_error *err)
{
    struct dph_renderer *renderer = NULL;
    bool ok = true, swap = bake >= 0 && !work->plans->way[bake].stored;
    if (swap)
        dph_variant_swap(&work->bake[bake], work->scene);
    for (int i = 0; i < work->plans->nplan && ok; i++) {
        const struct dph_plan *plan = &work->plans->plan[i];
        if (plan->bake != bake)
            continue;
        if (plan->response) { /* its data replace what the renderer has */
            struct dph_response_params form = work->params->response.form;
            form.bands = plan->response;
            form.threads = work->params->threads;
            form.progress = NULL;
            dph_renderer_destroy(renderer);
            renderer = NULL;
            if (!(ok = dph_scene_form_response(work->scene, &form, NULL, err)))
                break;
        }
        if (!renderer)
            ok = (renderer = dph_renderer_create(work->scene, err));
        ok = ok && judge_plan(work, (size_t)i, renderer, err);
    }
    dph_renderer_destroy(renderer);
    if (swap)
        dph_variant_swap(&work->bake[bake], work->scene);
    return ok;
}

static bool warn_comparison(struct dph_comparison *comparison, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static bool warn_comparison(struct dph_comparison *comparison, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    size_t size = (comparison->nwarning + 1) * sizeof *comparison->warning;
    char **grown = realloc(comparison->warning, size);
    if (!grown)
        return false;
    comparison->warning = grown;
    if (!(grown[comparison->nwarning] = dph_strdup(text)))
        return false;
    comparison->nwarning++;
    return true;
}

static bool bake_all(struct work *work, struct dph_error *err)
{
    const struct dph_judge_params *params = work->params;
    struct dph_judge_step step = {params->progress, params->progress_user, DPH_JUDGE_BAKE,
                                  work->judged->material.name};
    for (int i = 0; i < work->plans->nway; i++) {
        const struct dph_way *way = &work->plans->way[i];
        if (!way->stored &&
            !dph_variant_bake(&work->bake[i], work->scene, params, &work->judged->material,
                              way->fit, way->bands, &step, err))
            return false;
    }
    return dph_variant_rivals(work->scene, params, &work->judged->material, work->mm_per_unit,
                              &work->rivals, &step, err) &&
           dph_variant_response(work->scene, params, &work->judged->material, work->mm_per_unit,
                                &work->response, &step, err);
}

static bool make_entries(struct work *work, struct dph_error *err)
{
    struct dph_judged *judged = work->judged;
    size_t count = (size_t)work->plans->nplan * (work->params->fit ? 2 : 1);
    if (!(judged->entry = dph_alloc_zero(count, sizeof *judged->entry)))
        return dph_fail_memory(err);
    judged->nentry = count;
    for (size_t i = 0; i < count; i++)
        if (!(judged->entry[i].shot = dph_alloc_zero(work->params->nlight,
                                                     sizeof *judged->entry[i].shot)))
            return dph_fail_memory(err);
    return true;
}

/* What a user has to know of a material's reference. */
static bool tell(const struct work *work, struct dph_error *err)
{
    const struct dph_judged *judged = work->judged;
    bool ok = true;
    double share = judged->paths ? (double)(judged->lost + judged->capped) / (double)judged->paths
                                 : 0;
    if (judged->samples < work->params->samples)
        ok = warn_comparison(work->comparison,
                             "%s: the reference was stopped after %d of %d samples a pixel",
                             judged->material.name, judged->samples, work->params->samples);
    if (ok && share > 1e-5)
        ok = warn_comparison(work->comparison,
                             "%s: %.2g of the reference's paths were lost; is every body closed?",
                             judged->material.name, share);
    return ok || dph_fail_memory(err);
}

static bool judge_material(struct work *work, const struct dph_material *material,
                           struct dph_error *err)
{
    struct dph_plans *plans = dph_alloc(1, sizeof *plans);
    double start = dph_seconds();
    if (!plans)
        return dph_fail_memory(err);
    work->judged->material = dph_judge_bare(material);
    dph_plans_make(plans, work->scene, dph_scene_is_baked(work->scene), work->params, material);
    work->plans = plans;
    bool ok = make_entries(work, err) && bake_all(work, err) &&
              dph_truth_trace(work->scene, work->params, work->mm_per_unit, work->judged, err) &&
              tell(work, err) &&
              (!dph_judge_has_views(work->params) ||
               dph_views_trace(work->scene, work->params, work->mm_per_unit, work->judged, err)) &&
              dph_held_trace(work->scene, work->params, work->mm_per_unit, work->judged,
                             &work->held, err) &&
              (!work->params->fit ||
               dph_training_trace(work->scene, work->params, work->mm_per_unit,
                                  &work->judged->material, &work->training, err));
    work->judged->seconds_training = work->training.seconds;
    for (int bake = -1; bake < plans->nway && ok; bake++)
        ok = judge_bake(work, bake, err);
    if (ok)
        dph_shots_warn(work->judged, work->params->nlight);
    dph_training_finish(&work->training);
    dph_held_finish(&work->held);
    for (int i = 0; i < plans->nway; i++)
        dph_variant_finish(&work->bake[i]);
    work->plans = NULL;
    free(plans);
    work->judged->seconds = dph_seconds() - start;
    return ok;
}

/* What the comparison's head says. */
static bool begin(struct work *work, const char *renderer, struct dph_error *err)
{
    const struct dph_judge_params *params = work->params;
    const struct dph_scene *scene = work->scene;
    struct dph_comparison *comparison = work->comparison;
    comparison->nlight = params->nlight;
    memcpy(comparison->light, params->light, sizeof comparison->light);
    comparison->camera = params->camera;
    comparison->width = params->width;
    comparison->height = params->height;
    comparison->samples = params->samples;
    comparison->multisamples = params->multisamples;
    comparison->seed = params->seed;
    comparison->boundary = params->boundary;
    comparison->light_angle = dph_judge_angle(params);
    comparison->mm_per_unit = work->mm_per_unit = dph_scene_millimetres(scene, params->size_mm);
    comparison->size_mm = work->mm_per_unit * dph_scene_size(scene);
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_mesh *mesh = &scene->body[scene->instance[i].body].mesh;
        comparison->triangles += mesh->ntri;
        comparison->vertices += mesh->nvert;
    }
    snprintf(comparison->renderer, sizeof comparison->renderer, "%s", renderer ? renderer : "");
    comparison->material = dph_alloc_zero(params->nmaterial, sizeof *comparison->material);
    if (!comparison->material)
        return dph_fail_memory(err);
    for (size_t m = 0; m < params->nmaterial; m++) {
        struct dph_judged *judged = &comparison->material[m];
        if (!(judged->truth = dph_alloc_zero(params->nlight, sizeof *judged->truth)))
            return dph_fail_memory(err);
        comparison->nmaterial++;
    }
    return true;
}

struct dph_comparison *dph_comparison_create(struct dph_scene *scene,
                                             const struct dph_judge_params *params,
                                             const char *renderer, struct dph_error *err)
{
    double start = dph_seconds();
    struct work work = {.scene = scene, .params = params};
    if (!dph_judge_check(params, err) || !dph_judge_room(scene, params, err) ||
        !dph_judge_look(scene, params, true, params->fit, err))
        return NULL;
    if (!(work.comparison = dph_alloc_zero(1, sizeof *work.comparison))) {
        dph_fail_memory(err);
        return NULL;
    }
    bool ok = begin(&work, renderer, err);
    for (size_t m = 0; m < params->nmaterial && ok; m++) {
        work.judged = &work.comparison->material[m];
        ok = judge_material(&work, &params->material[m], err);
    }
    if (!ok) {
        dph_comparison_destroy(work.comparison);
        return NULL;
    }
    work.comparison->seconds = dph_seconds() - start;
    return work.comparison;
}

void dph_comparison_destroy(struct dph_comparison *comparison)
{
    if (!comparison)
        return;
    for (size_t m = 0; m < comparison->nmaterial; m++) {
        struct dph_judged *judged = &comparison->material[m];
        for (size_t l = 0; l < comparison->nlight && judged->truth; l++)
            dph_truth_finish(&judged->truth[l]);
        for (size_t i = 0; i < judged->nentry; i++) {
            for (size_t l = 0; l < comparison->nlight && judged->entry[i].shot; l++)
                dph_shot_finish(&judged->entry[i].shot[l]);
            free(judged->entry[i].shot);
        }
        free(judged->entry);
        free(judged->truth);
    }
    for (size_t i = 0; i < comparison->nwarning; i++)
        free(comparison->warning[i]);
    free(comparison->warning);
    free(comparison->material);
    free(comparison);
}
