/* diaphan fit: a material whose free numbers suit one method on one object, by the path-traced
 * truth. */
#include "cli.h"
#include "watch.h"

#include <string.h>

static const char *const takes[] = {
    "output", "method", "material", "size-mm", "formula", "camera", "fov", "light-angle",
    "boundary", "spp", "seed", "map-size", "blur-mm",
    /* of the bake in memory, where the file is not baked */
    "bands", "directions", "thickness", "fit", "store", "clusters", "vectors", NULL};

static void report(const struct settings *settings, const struct dph_material *fitted,
                   double before, double after, double seconds)
{
    if (settings->json) {
        struct json json;
        emit_begin(&json, stdout);
        emit_text(&json, "input", settings->input[0]);
        emit_text(&json, "output", settings->output);
        emit_text(&json, "method", settings->method->name);
        emit_text(&json, "material", fitted->name);
        emit_triple(&json, "sigma", fitted->sigma);
        emit_triple(&json, "base", fitted->base);
        emit_triple(&json, "front", fitted->front);
        emit_triple(&json, "back", fitted->back);
        emit_number(&json, "before", before);
        emit_number(&json, "after", after);
        emit_object(&json, "seconds");
        emit_number(&json, "total", seconds);
        emit_close(&json, '}');
        emit_end(&json);
    } else if (!settings->quiet) {
        printf("wrote %s: relative error of %s on the training lights %.4f before, %.4f after the "
               "fit, %.1f s\n",
               settings->output, settings->method->name, before, after, seconds);
    }
}

static int run(struct settings *settings)
{
    int code = EXIT_DONE;
    struct dph_error err;
    struct dph_material material, fitted;
    struct dph_judge_params params;
    struct watch watch;
    struct dph_scene *scene = NULL;
    struct dph_gl *gl = NULL;
    double before, after, start = seconds_now();
    if (settings->reference) {
        complain(settings, "the reference has nothing to fit");
        return EXIT_USAGE;
    }
    if (!load_material(settings, "wax", &material, &code))
        return code;
    if (!output_possible(settings, settings->output))
        return EXIT_OUTPUT;
    judge_params(settings, &params);
    params.method = &settings->method;
    params.nmethod = 1;
    params.material = &material;
    params.nmaterial = 1;
    if (is_given(settings, "spp"))
        params.training_samples = settings->spp;
    if (!(scene = load_scene(settings, settings->input[0], &code)))
        return code;
    if (!(gl = dph_gl_create_headless(&err)))
        goto error;
    size_t warnings = scene->nwarning;
    watch_begin(&watch, settings, &params);
    bool ok = dph_judge_fit(scene, &params, &fitted, &before, &after, &err);
    watch_end(&watch);
    report_warnings(settings, scene, warnings);
    if (!ok || !dph_material_save(&fitted, settings->output, &err))
        goto error;
    report(settings, &fitted, before, after, seconds_now() - start);
    goto done;

error:
    code = report_error(settings, &err);
done:
    dph_gl_destroy(gl);
    dph_scene_destroy(scene);
    return code;
}

const struct command command_fit = {
    .name = "fit",
    .summary = "fit a material's drawing parameters to the truth",
    .usage = "INPUT -o MATERIAL.json [options]",
    .examples = "  diaphan fit bunny.obj --material wax --size-mm 20 -o wax-bunny.json\n"
                "  diaphan render bunny.obj --material wax-bunny.json --size-mm 20 -o bunny.png\n"
                "  diaphan fit head.obj --material skin1 --method green -o skin-green.json\n",
    .notes = "Traces the object under twelve lights around it and finds sigma of the exponential "
             "curve, base, front and back\n"
             "with which the method comes closest, light from the front, the side and behind "
             "weighing alike. For methods that\n"
             "take thickness: shsss, green, green-gauss. The file has the medium and these "
             "numbers; it suits this object at\n"
             "this size. --spp are the samples of the pictures of 160x100 that it learns from "
             "[64].\n",
    .options = takes,
    .min_inputs = 1,
    .max_inputs = 1,
    .wants_output = true,
    .run = run,
};
