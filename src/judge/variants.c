/* What the entries of a comparison are drawn from: thickness baked in several ways, one of them in
 * the scene at a time, and what rivals need.
 *
 * The weighted fit knows the material, and a number of bands is a fit of its own (its first
 * coefficients are not those of fewer bands), so thickness is baked for every material, fit and
 * number of bands. A plain projection is the same for any number: its fewer bands are drawn with
 * the first coefficients. */
#include "judge/protocol.h"

#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/cpca.h>

#include <stdlib.h>

static void drop_warnings(struct dph_scene *scene, size_t keep)
{
    while (scene->nwarning > keep)
        free(scene->warning[--scene->nwarning]);
}

bool dph_scene_is_baked(const struct dph_scene *scene)
{
    for (size_t i = 0; i < scene->nbody; i++)
        if (scene->body[i].mesh.nvert && !scene->body[i].thickness)
            return false;
    return true;
}

void dph_variant_swap(struct dph_variant_bake *variant, struct dph_scene *scene)
{
    for (size_t i = 0; i < variant->nbody; i++) {
        struct dph_thickness *own = variant->thickness[i];
        variant->thickness[i] = scene->body[i].thickness;
        scene->body[i].thickness = own;
    }
}

bool dph_variant_bake(struct dph_variant_bake *variant, struct dph_scene *scene,
                      const struct dph_judge_params *params, const struct dph_material *material,
                      enum dph_fit fit, int bands, struct dph_judge_step *step,
                      struct dph_error *err)
{
    struct dph_scene_bake_params bake = params->bake;
    size_t warnings = scene->nwarning;
    double start = dph_seconds();
    *variant = (struct dph_variant_bake){.nbody = scene->nbody};
    variant->thickness = dph_alloc_zero(scene->nbody, sizeof(struct dph_thickness *));
    if (!variant->thickness) {
        variant->nbody = 0;
        return dph_fail_memory(err);
    }
    bake.bake.bands = bands;
    bake.bake.fit = fit;
    bake.bake.threads = params->threads;
    bake.bake.progress = dph_judge_step;
    bake.bake.progress_user = step;
    bake.size_mm = params->size_mm;
    bake.material = material;
    bake.missing_only = false;
    dph_variant_swap(variant, scene);
    bool ok = dph_scene_bake(scene, &bake, NULL, err);
    dph_variant_swap(variant, scene);
    /* what is wrong with the meshes is said once, not once a variant */
    if (warnings)
        drop_warnings(scene, warnings);
    variant->seconds = dph_seconds() - start;
    return ok;
}

void dph_variant_finish(struct dph_variant_bake *variant)
{
    for (size_t i = 0; i < variant->nbody; i++)
        dph_thickness_destroy(variant->thickness[i]);
    free(variant->thickness);
    *variant = (struct dph_variant_bake){0};
}

bool dph_variant_rivals(struct dph_scene *scene, const struct dph_judge_params *params,
                        const struct dph_material *material, double mm_per_unit,
                        struct dph_rivals_report *report, struct dph_judge_step *step,
                        struct dph_error *err)
{
    struct dph_rivals_params rivals = params->rivals;
    unsigned products = 0;
    bool found;
    *report = (struct dph_rivals_report){0};
    for (size_t i = 0; i < params->nmethod; i++)
        products |= params->method[i]->needs;
    products &= ~(unsigned)(DPH_PRODUCT_THICKNESS | DPH_PRODUCT_RESPONSE);
    if (products & DPH_PRODUCT_CLUSTERS) /* these are made of transfer vectors */
        products |= DPH_PRODUCT_TRANSFER;
    if (!products ||
        dph_scene_rivals_fit(scene, products, material, mm_per_unit, NULL, 0, &found))
        return true;
    rivals.material = material;
    rivals.size_mm = params->size_mm;
    rivals.threads = params->threads;
    rivals.progress = dph_judge_step;
    rivals.progress_user = step;
    return dph_scene_bake_rivals(scene, products, &rivals, report, err);
}

bool dph_variant_response(struct dph_scene *scene, const struct dph_judge_params *params,
                          const struct dph_material *material, double mm_per_unit,
                          struct dph_scene_response_report *report, struct dph_judge_step *step,
                          struct dph_error *err)
{
    struct dph_scene_response_params response = params->response;
    bool wanted = false, found;
    *report = (struct dph_scene_response_report){0};
    for (size_t i = 0; i < params->nmethod; i++)
        wanted = wanted || params->method[i]->needs & DPH_PRODUCT_RESPONSE;
    if (!wanted || dph_scene_rivals_fit(scene, DPH_PRODUCT_RESPONSE, material, mm_per_unit, NULL, 0,
                                        &found))
        return true;
    response.material = material;
    response.size_mm = params->size_mm;
    response.keep_rows = true;
    response.threads = params->threads;
    response.progress = dph_judge_step;
    response.progress_user = step;
    return dph_scene_bake_response(scene, &response, report, err);
}

/* Bytes a vertex of one body. */
static double body_payload(const struct dph_body *body, const struct dph_method *method)
{
    const struct dph_rivals *rivals = body->rivals;
    double bytes = 0;
    if (method->needs_thickness && body->thickness)
        bytes += (double)dph_thickness_payload(body->thickness);
    if (rivals && method->needs & DPH_PRODUCT_NORMALS)
        bytes += 12;
    if (rivals && method->needs & DPH_PRODUCT_CLUSTERS && rivals->clusters)
        bytes += rivals->clusters->vectors + (rivals->clusters->clusters <= 256 ? 1 : 2);
    else if (rivals && method->needs & DPH_PRODUCT_TRANSFER)
        bytes += 4 * (double)rivals->transfer.length;
    if (rivals && method->needs & DPH_PRODUCT_RESPONSE && rivals->response)
        bytes += (double)dph_response_payload(rivals->response);
    return bytes;
}

double dph_variant_payload(const struct dph_scene *scene, const struct dph_method *method)
{
    double bytes = 0, vertices = 0;
    for (size_t i = 0; i < scene->nbody; i++) {
        double nvert = (double)scene->body[i].mesh.nvert;
        bytes += nvert * body_payload(&scene->body[i], method);
        vertices += nvert;
    }
    return vertices > 0 ? bytes / vertices : 0;
}
