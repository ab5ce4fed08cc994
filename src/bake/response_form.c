/* The forms of a whole scene's response, from rows that its bake has kept. */
#include <diaphan/response_scene.h>

#include "bake/view_gain.h"
#include "core/clock.h"

struct dph_scene_response_params dph_scene_response_defaults(void)
{
    return (struct dph_scene_response_params){
        .noise = .05, .most_walks = 65536, .seed = 1, .form = dph_response_defaults()};
}

bool dph_scene_form_response(struct dph_scene *scene, const struct dph_response_params *form,
                             struct dph_scene_response_report *report, struct dph_error *err)
{
    struct dph_scene_response_report total = {.reached = true};
    double start = dph_seconds();
    for (size_t i = 0; i < scene->nbody; i++) {
        struct dph_rivals *rivals = scene->body[i].rivals;
        struct dph_response_report own;
        if (!rivals || !rivals->response_rows.npos)
            continue;
        struct dph_response *response =
            dph_response_create(&rivals->response_rows, form, &own, err);
        if (!response)
            return false;
        if (rivals->response) { /* what is known of the rows */
            response->noise = rivals->response->noise;
            response->walks = rivals->response->walks;
            if (dph_view_applies(response))
                response->view = rivals->response->view;
        }
        dph_response_destroy(rivals->response);
        rivals->response = response;
        total.positions += own.positions;
        total.error += own.error * (double)own.positions;
        total.error_rgb += own.error_rgb * (double)own.positions;
    }
    if (total.positions) {
        total.error /= (double)total.positions;
        total.error_rgb /= (double)total.positions;
    }
    total.seconds_form = dph_seconds() - start;
    if (report)
        *report = total;
    return true;
}
