/* What would end a comparison after minutes of work, found out before them: a camera that does not
 * see the object, and pictures that do not fit into memory. */
#include "judge/plans.h"
#include "judge/protocol.h"

#include "core/fail.h"
#include "core/memory.h"

#include <stdlib.h>
#include <string.h>

/* Whether plain shading leaves a trace in a picture of this size. */
static bool look(struct dph_renderer *renderer, const struct dph_judge_params *params,
                 double mm_per_unit, int width, int height, struct dph_error *err)
{
    const struct dph_entry entry = {.method = dph_method_find("lambert"),
                                    .material = params->material[0]};
    struct dph_frame frame = dph_judge_frame(params, mm_per_unit, &entry);
    struct dph_image image = {0};
    frame.width = width;
    frame.height = height;
    if (!dph_image_init(&image, width, height, err))
        return false;
    bool ok = dph_renderer_draw(renderer, &frame, &image, err), seen = false;
    for (size_t i = 0; i < (size_t)width * (size_t)height && ok && !seen; i++)
        seen = image.pixel[4 * i + 3] > 0;
    dph_image_finish(&image);
    if (ok && !seen)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "the camera does not see the object in a picture of %d x %d pixels", width,
                        height);
    return ok;
}

bool dph_judge_look(struct dph_scene *scene, const struct dph_judge_params *params, bool scored,
                    bool training, struct dph_error *err)
{
    double mm_per_unit = dph_scene_millimetres(scene, params->size_mm);
    struct dph_renderer *renderer = dph_renderer_create(scene, err);
    bool ok = renderer &&
              (!scored ||
               look(renderer, params, mm_per_unit, params->width, params->height, err)) &&
              (!training || look(renderer, params, mm_per_unit, params->training_width,
                                 params->training_height, err));
    dph_renderer_destroy(renderer);
    return ok;
}

/* A pixel of a light has while it is traced: radiance, its square and that of half the samples
 * in double precision, 3 channels each, and the picture, its variance and its half in single. */
enum { TRACED = 9 * sizeof(double) + 10 * sizeof(float) };
/* What stays of it: both truths and mask; of an entry that is shown, its picture and map. */
enum { TRUTH = 8 * sizeof(float) + 1, SHOWN = 5 * sizeof(float) };

bool dph_judge_room(const struct dph_scene *scene, const struct dph_judge_params *params,
                    struct dph_error *err)
{
    double pixels = (double)params->width * (double)params->height * (double)params->nlight;
    double bytes = pixels * TRACED;
    struct dph_plans *plans = dph_alloc(1, sizeof *plans);
    if (!plans)
        return dph_fail_memory(err);
    for (size_t m = 0; m < params->nmaterial; m++) {
        dph_plans_make(plans, scene, dph_scene_is_baked(scene), params, &params->material[m]);
        int shown = 0;
        for (int i = 0; i < plans->nplan; i++)
            shown += plans->plan[i].shown ? params->fit ? 2 : 1 : 0;
        bytes += pixels * (TRUTH + shown * SHOWN);
    }
    free(plans);
    if (params->most_bytes > 0 && bytes > params->most_bytes)
        return dph_fail(err, DPH_ERROR_LIMIT,
                        "%zu lights of %d x %d pixels in %zu materials: the pictures take %.3g GB, "
                        "there are %.3g",
                        params->nlight, params->width, params->height, params->nmaterial,
                        bytes * 1e-9, params->most_bytes * 1e-9);
    return true;
}
