/* The rivals' precomputation over a scene: each body once, in its own space and unit. Lengths and
 * coefficients are judged in the scene: a body with several instances by its largest one. */
#include <diaphan/rivals.h>

#include "bake/prepare.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/patro.h>
#include <diaphan/prepare.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct dph_rivals_params dph_rivals_defaults(void)
{
    return (struct dph_rivals_params){
        .bands = 6, .directions = 1024, .clusters = 128, .vectors = 8};
}

void dph_rivals_destroy(struct dph_rivals *rivals)
{
    if (!rivals)
        return;
    free(rivals->normal);
    dph_transfer_finish(&rivals->transfer);
    dph_cpca_destroy(rivals->clusters);
    dph_response_destroy(rivals->response);
    dph_transfer_finish(&rivals->response_rows);
    free(rivals);
}

void dph_rivals_remember(struct dph_rivals_origin *origin, const struct dph_material *material,
                         double mm_per_unit, int directions)
{
    memset(origin, 0, sizeof *origin);
    memcpy(origin->material, material->name, sizeof origin->material);
    memcpy(origin->scattering, material->scattering, sizeof origin->scattering);
    memcpy(origin->absorption, material->absorption, sizeof origin->absorption);
    origin->anisotropy = material->anisotropy;
    origin->mm_per_unit = mm_per_unit;
    origin->directions = directions;
}

/* Whether it was baked for that; the reason, if not. Names of materials do not count. */
static bool fits(const struct dph_rivals_origin *origin, const struct dph_material *material,
                 double mm_per_unit, char *why, size_t size)
{
    for (int c = 0; c < 3; c++) {
        double had = (1 - origin->anisotropy) * origin->scattering[c];
        double wanted = (1 - material->anisotropy) * material->scattering[c];
        if (fabs(had - wanted) <= 1e-9 * fabs(wanted) &&
            fabs(origin->absorption[c] - material->absorption[c]) <=
                1e-9 * fabs(material->absorption[c]))
            continue;
        snprintf(why, size, "was baked for another material, '%.63s' instead of '%.63s'",
                 origin->material, material->name);
        return false;
    }
    if (fabs(origin->mm_per_unit - mm_per_unit) <= 1e-6 * mm_per_unit)
        return true;
    snprintf(why, size, "was baked for another size, %g mm a unit instead of %g",
             origin->mm_per_unit, mm_per_unit);
    return false;
}

bool dph_scene_rivals_fit(const struct dph_scene *scene, unsigned products,
                          const struct dph_material *material, double mm_per_unit, char *why,
                          size_t size, bool *found)
{
    char unused[1];
    bool all = true;
    *found = false;
    if (!why) {
        why = unused;
        size = 0;
    }
    for (size_t i = 0; i < scene->nbody; i++) {
        const struct dph_body *body = &scene->body[i];
        const struct dph_rivals *rivals = body->rivals;
        if (!body->mesh.nvert || !body->mesh.ntri)
            continue;
        unsigned has = 0;
        if (rivals)
            has = (rivals->normal ? DPH_PRODUCT_NORMALS : 0U) |
                  (rivals->transfer.vector ? DPH_PRODUCT_TRANSFER : 0U) |
                  (rivals->clusters ? DPH_PRODUCT_CLUSTERS : 0U) |
                  (rivals->response ? DPH_PRODUCT_RESPONSE : 0U);
        unsigned wanted = products & ~(unsigned)DPH_PRODUCT_THICKNESS;
        *found = *found || (has & wanted);
        if (!all)
            continue;
        if ((has & wanted) != wanted) {
            snprintf(why, size, "is not baked");
            all = false;
        } else if (wanted & DPH_PRODUCT_NORMALS) {
            all = fits(&rivals->normal_origin, material, mm_per_unit, why, size);
        }
        if (all && wanted & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS))
            all = fits(&rivals->transfer_origin, material, mm_per_unit, why, size);
        if (all && wanted & DPH_PRODUCT_RESPONSE)
            all = fits(&rivals->response_origin, material, mm_per_unit, why, size);
    }
    return all;
}

static bool bake_normals(const struct dph_body *body, const struct dph_bake_input *input,
                         const struct dph_rivals_params *params, double mm,
                         struct dph_rivals_report *report, struct dph_error *err)
{
    struct dph_patro_params patro = dph_patro_defaults();
    struct dph_patro_report done;
    struct dph_medium medium;
    dph_material_medium(params->material, &medium);
    dph_patro_set_medium(&patro, medium.reduced_scattering[1], params->material->absorption[1], mm);
    patro.threads = params->threads;
    patro.progress = params->progress;
    patro.progress_user = params->progress_user;
    free(body->rivals->normal);
    float *normal = body->rivals->normal = dph_alloc(body->mesh.nvert, 3 * sizeof *normal);
    if (!normal)
        return dph_fail_memory(err);
    if (!dph_patro_normals(input, body->mesh.normal, &patro, normal, &done, err)) {
        free(normal);
        body->rivals->normal = NULL;
        return false;
    }
    report->seconds_normals += done.seconds;
    return true;
}

static bool bake_transfer(const struct dph_bake_input *input, struct dph_rivals *rivals,
                          const struct dph_rivals_params *params, double mm,
                          struct dph_rivals_report *report, struct dph_error *err)
{
    struct dph_transfer_params transfer = dph_transfer_defaults();
    struct dph_medium medium;
    double start = dph_seconds();
    dph_material_medium(params->material, &medium);
    for (int c = 0; c < 3; c++) {
        transfer.scattering[c] = medium.reduced_scattering[c] * mm;
        transfer.absorption[c] = params->material->absorption[c] * mm;
    }
    transfer.bands = params->bands;
    transfer.directions = params->directions;
    transfer.threads = params->threads;
    transfer.progress = params->progress;
    transfer.progress_user = params->progress_user;
    dph_cpca_destroy(rivals->clusters); /* belongs to what is replaced */
    rivals->clusters = NULL;
    rivals->products &= ~(unsigned)DPH_PRODUCT_CLUSTERS;
    dph_transfer_finish(&rivals->transfer);
    bool ok = dph_transfer_bake(input, &transfer, &rivals->transfer, NULL, err);
    report->seconds_transfer += dph_seconds() - start;
    return ok;
}

static bool bake_clusters(struct dph_rivals *rivals, const struct dph_rivals_params *params,
                          struct dph_rivals_report *report, struct dph_error *err)
{
    struct dph_cpca_params cpca = dph_cpca_defaults();
    const struct dph_transfer *transfer = &rivals->transfer;
    double start = dph_seconds();
    cpca.clusters = params->clusters;
    cpca.vectors = params->vectors;
    cpca.threads = params->threads;
    dph_cpca_destroy(rivals->clusters);
    rivals->clusters = dph_cpca_create(transfer->vector, transfer->npos, (int)transfer->length,
                                       transfer->area, &cpca, err);
    report->seconds_clusters += dph_seconds() - start;
    if (!rivals->clusters)
        return false;
    report->error += rivals->clusters->error_snorm8 * (double)transfer->npos;
    return true;
}

bool dph_scene_bake_rivals(struct dph_scene *scene, unsigned products,
                           const struct dph_rivals_params *params, struct dph_rivals_report *report,
                           struct dph_error *err)
{
    struct dph_rivals_report total = {0};
    double mm_per_unit = dph_scene_millimetres(scene, params->size_mm), positions = 0;
    products &= ~(unsigned)(DPH_PRODUCT_THICKNESS | DPH_PRODUCT_RESPONSE);
    if (params->bands < 1 || params->bands > DPH_DRAW_BANDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d bands of transfer vectors: 1 to %d are drawn",
                        params->bands, DPH_DRAW_BANDS);
    for (size_t i = 0; i < scene->nbody; i++) {
        struct dph_body *body = &scene->body[i];
        if (!body->mesh.nvert || !body->mesh.ntri)
            continue;
        if (!body->rivals && !(body->rivals = dph_alloc_zero(1, sizeof *body->rivals)))
            return dph_fail_memory(err);
        struct dph_bake_input input = {body->mesh.position, 0, body->mesh.nvert, body->mesh.index,
                                       body->mesh.ntri};
        double mm = mm_per_unit * dph_scene_body_scale(scene, i);
        if (products & DPH_PRODUCT_NORMALS) {
            if (!bake_normals(body, &input, params, mm, &total, err))
                return false;
            dph_rivals_remember(&body->rivals->normal_origin, params->material, mm_per_unit, 0);
        }
        if (products & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS)) {
            if (!bake_transfer(&input, body->rivals, params, mm, &total, err))
                return false;
            dph_rivals_remember(&body->rivals->transfer_origin, params->material, mm_per_unit,
                                (params->directions + 1) / 2 * 2);
        }
        if (products & DPH_PRODUCT_CLUSTERS && !bake_clusters(body->rivals, params, &total, err))
            return false;
        positions += (double)body->rivals->transfer.npos;
        body->rivals->products |= products;
    }
    if (positions > 0)
        total.error /= positions;
    scene->mm_per_unit = mm_per_unit;
    if (report)
        *report = total;
    return true;
}
