/* The response of a whole scene: walks in every body, then a form of what they found. Lengths are
 * judged in the scene: a body with several instances by its largest one.
 *
 * A material's anisotropy goes into its scattering coefficient by the similarity relation, s' = (1
 * - g) s, as everywhere but in the reference: after a few scatterings, and there are many, the two
 * are alike, and a medium that scatters evenly bakes much faster. */
#include <diaphan/response_scene.h>

#include "bake/prepare.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/prepare.h>
#include <diaphan/response_bake.h>

#include <math.h>
#include <string.h>

/* Progress of one body as that of all. */
struct step {
    const struct dph_scene_response_params *params;
    double done, share;
    double from, to; /* of the body's own, that the part at hand takes */
};

#define VIEW_SHARE .03 /* of the progress */

static bool pass_on(void *user, double fraction)
{
    const struct step *step = user;
    double own = step->from + (step->to - step->from) * fraction;
    return step->params->progress(step->params->progress_user, step->done + step->share * own);
}

static bool bake_body(const struct dph_body *body, const struct dph_scene_response_params *params,
                      double mm, struct step *step, struct dph_scene_response_report *total,
                      struct dph_error *err)
{
    struct dph_response_bake_params bake = dph_response_bake_defaults();
    struct dph_response_bake_report walked;
    struct dph_response_params form = params->form;
    struct dph_response_report formed;
    struct dph_bake_input input = {body->mesh.position, 0, body->mesh.nvert, body->mesh.index,
                                   body->mesh.ntri};
    struct dph_rivals *rivals = body->rivals;
    struct dph_medium medium;
    dph_material_medium(params->material, &medium);
    for (int c = 0; c < 3; c++) {
        bake.scattering[c] = medium.reduced_scattering[c] * mm;
        bake.absorption[c] = params->material->absorption[c] * mm;
    }
    bake.straight = false; /* no picture shows it */
    bake.noise = params->noise;
    bake.most_walks = params->most_walks;
    bake.seed = params->seed;
    bake.threads = form.threads = params->threads;
    bake.progress = params->progress ? pass_on : NULL;
    bake.progress_user = step;
    form.progress = NULL;
    dph_response_destroy(rivals->response);
    rivals->response = NULL;
    dph_transfer_finish(&rivals->response_rows);
    rivals->products &= ~(unsigned)DPH_PRODUCT_RESPONSE;

    double start = dph_seconds();
    step->from = 0;
    step->to = 1 - VIEW_SHARE;
    if (!dph_response_bake(&input, &bake, &rivals->response_rows, &walked, err))
        return false;
    total->seconds_bake += dph_seconds() - start;
    start = dph_seconds();
    rivals->response = dph_response_create(&rivals->response_rows, &form, &formed, err);
    total->seconds_form += dph_seconds() - start;
    if (!params->keep_rows)
        dph_transfer_finish(&rivals->response_rows);
    if (!rivals->response)
        return false;
    step->from = step->to;
    step->to = 1;
    start = dph_seconds();
    if (form.form == DPH_RESPONSE_ROOT && form.store != DPH_STORE_CPCA &&
        !dph_response_view_fit(&input, &bake, rivals->response, &rivals->response->view, err))
        return false;
    total->seconds_view += dph_seconds() - start;
    rivals->response->noise = walked.noise;
    rivals->response->walks = walked.positions ? walked.walks / (double)walked.positions : 0;
    total->positions += walked.positions;
    total->walks += walked.walks;
    total->noise = fmax(total->noise, walked.noise);
    total->reached = total->reached && walked.reached;
    total->lost += walked.lost;
    total->error += formed.error * (double)walked.positions;
    total->error_rgb += formed.error_rgb * (double)walked.positions;
    return true;
}

bool dph_scene_bake_response(struct dph_scene *scene,
                             const struct dph_scene_response_params *params,
                             struct dph_scene_response_report *report, struct dph_error *err)
{
    struct dph_scene_response_report total = {.reached = true};
    double mm_per_unit = dph_scene_millimetres(scene, params->size_mm), triangles = 0;
    struct step step = {.params = params};
    for (size_t i = 0; i < scene->nbody; i++)
        triangles += (double)scene->body[i].mesh.ntri;
    for (size_t i = 0; i < scene->nbody; i++) {
        struct dph_body *body = &scene->body[i];
        if (!body->mesh.nvert || !body->mesh.ntri)
            continue;
        if (!body->rivals && !(body->rivals = dph_alloc_zero(1, sizeof *body->rivals)))
            return dph_fail_memory(err);
        step.share = (double)body->mesh.ntri / triangles;
        if (!bake_body(body, params, mm_per_unit * dph_scene_body_scale(scene, i), &step, &total,
                       err))
            return false;
        step.done += step.share;
        dph_rivals_remember(&body->rivals->response_origin, params->material, mm_per_unit, 0);
        body->rivals->products |= DPH_PRODUCT_RESPONSE;
    }
    if (total.positions) {
        total.error /= (double)total.positions;
        total.error_rgb /= (double)total.positions;
    }
    scene->mm_per_unit = mm_per_unit;
    if (report)
        *report = total;
    return true;
}
