/* The steps that several commands begin with: load a scene, load a material, bake what is missing.
 */
#include "cli.h"

#include <diaphan/environment.h>

#include <math.h>
#include <string.h>

struct dph_scene *load_scene(const struct settings *settings, const char *path, int *code)
{
    struct dph_error err;
    struct dph_scene *scene = dph_scene_load(path, &err);
    if (!scene) {
        *code = report_error(settings, &err);
        return NULL;
    }
    report_warnings(settings, scene, 0);
    return scene;
}

bool load_material(const struct settings *settings, const char *fallback,
                   struct dph_material *material, int *code)
{
    struct dph_error err;
    if (!dph_material_load(settings->material ? settings->material : fallback, material, &err)) {
        *code = report_error(settings, &err);
        return false;
    }
    if (!isnan(settings->specular))
        material->specular = settings->specular;
    if (!isnan(settings->rim))
        material->rim = settings->rim;
    if (!isnan(settings->ambient))
        material->ambient = settings->ambient;
    if (settings->formula >= 0)
        material->formula = (enum dph_formula)settings->formula;
    return true;
}

struct dph_scene_bake_params thickness_params(const struct settings *settings)
{
    struct dph_scene_bake_params params = dph_scene_bake_defaults();
    params.bake = settings->bake;
    params.bake.threads = settings->threads;
    params.store = settings->store;
    params.cpca.clusters = settings->cpca.clusters;
    params.cpca.vectors = settings->cpca.vectors;
    params.size_mm = settings->size_mm;
    return params;
}

/* Vertices have room for so many bands. */
static int drawn_bands(const struct settings *settings)
{
    return settings->bake.bands < DPH_DRAW_BANDS ? settings->bake.bands : DPH_DRAW_BANDS;
}

struct dph_rivals_params rivals_params(const struct settings *settings)
{
    struct dph_rivals_params params = dph_rivals_defaults();
    params.size_mm = settings->size_mm;
    params.bands = drawn_bands(settings);
    params.directions = settings->bake.directions;
    params.clusters = settings->cpca.clusters;
    params.vectors = settings->cpca.vectors;
    params.threads = settings->threads;
    return params;
}

bool bake_scene(const struct settings *settings, struct dph_scene *scene, bool missing_only,
                struct dph_scene_bake_report *report, int *code)
{
    struct dph_error err;
    struct dph_material material;
    struct dph_scene_bake_params params = thickness_params(settings);
    struct progress progress;
    params.missing_only = missing_only;
    if (settings->material) {
        if (!load_material(settings, NULL, &material, code))
            return false;
        params.material = &material;
    }
    progress_begin(&progress, settings, "baking");
    params.bake.progress = progress_step;
    params.bake.progress_user = &progress;
    size_t before = scene->nwarning;
    bool ok = dph_scene_bake(scene, &params, report, &err);
    progress_end(&progress);
    if (!ok && err.code == DPH_ERROR_INPUT) { /* what arrays hold is told without the file's name */
        struct dph_error named = err;
        snprintf(named.message, sizeof named.message, "%s: %.400s", settings->input[0],
                 err.message);
        err = named;
    }
    if (!ok)
        *code = report_error(settings, &err);
    report_warnings(settings, scene, before);
    return ok;
}

bool bake_rivals(const struct settings *settings, struct dph_scene *scene,
                 const struct dph_material *material, unsigned products,
                 struct dph_rivals_report *report, int *code)
{
    struct dph_error err;
    struct dph_rivals_params params = rivals_params(settings);
    struct progress progress;
    *report = (struct dph_rivals_report){0};
    products &= ~(unsigned)(DPH_PRODUCT_THICKNESS | DPH_PRODUCT_RESPONSE);
    if (!products)
        return true;
    params.material = material;
    progress_begin(&progress, settings, "baking");
    params.progress = progress_step;
    params.progress_user = &progress;
    bool ok = dph_scene_bake_rivals(scene, products, &params, report, &err);
    progress_end(&progress);
    if (!ok)
        *code = report_error(settings, &err);
    return ok;
}

struct dph_scene_response_params response_params(const struct settings *settings)
{
    struct dph_scene_response_params params = dph_scene_response_defaults();
    params.size_mm = settings->size_mm;
    params.noise = settings->noise;
    params.form = response_form(settings);
    params.threads = settings->threads;
    return params;
}

struct dph_response_params response_form(const struct settings *settings)
{
    struct dph_response_params form = dph_response_defaults();
    form.form = settings->response_form;
    if (settings->environment && !is_given(settings, "response-form"))
        form.form = DPH_RESPONSE_LINEAR; /* the root takes no surroundings */
    form.bands = drawn_bands(settings);
    form.store = settings->store;
    form.cpca.clusters = settings->cpca.clusters;
    form.cpca.vectors = settings->cpca.vectors;
    if (settings->response_bytes) { /* its bands and type, and the form unless one was named */
        enum dph_response_form wanted = form.form;
        dph_response_preset(settings->response_bytes, &form);
        form.form = wanted;
    }
    return form;
}

bool bake_response(const struct settings *settings, struct dph_scene *scene,
                   const struct dph_material *material, unsigned products,
                   struct dph_scene_response_report *report, int *code)
{
    struct dph_error err;
    struct dph_scene_response_params params = response_params(settings);
    struct progress progress;
    *report = (struct dph_scene_response_report){0};
    if (!(products & DPH_PRODUCT_RESPONSE))
        return true;
    params.material = material;
    progress_begin(&progress, settings, "random walks");
    params.progress = progress_step;
    params.progress_user = &progress;
    bool ok = dph_scene_bake_response(scene, &params, report, &err);
    progress_end(&progress);
    if (!ok)
        *code = report_error(settings, &err);
    else if (!report->reached)
        warn(settings, "%s: the response has a noise of %.1f %%, walks ended before it was %.1f %%",
             settings->input[0], 100.0 * report->noise, 100.0 * settings->noise);
    return ok;
}

bool load_environment(const struct settings *settings, struct dph_frame *frame, int *code)
{
    struct dph_error err;
    struct dph_image image = {0};
    if (!settings->environment)
        return true;
    bool ok = dph_image_load(&image, settings->environment, &err) &&
              dph_environment_project(image.pixel, image.width, image.height, 4, DPH_DRAW_BANDS,
                                      settings->threads, frame->environment[0], &err);
    dph_image_finish(&image);
    if (!ok) {
        *code = report_error(settings, &err);
        return false;
    }
    frame->has_environment = true;
    return true;
}
