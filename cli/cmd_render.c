/* diaphan render: one picture, without a window. */
#include "cli.h"

#include <string.h>

static const char *const takes[] = {
    "output", "method", "material", "size-mm", "light", "light-angle", "env", "point-light",
    "spot-light", "camera", "fov", "exposure", "background", "resolution", "use-bands", "window",
    "formula", "specular", "rim", "ambient", "map-size", "blur-mm", "samples",
    "boundary", "view-averaged", "spp", "seed",
    /* of the bake in memory, where the file is not baked */
    "bands", "directions", "thickness", "fit", "store", "clusters", "vectors",
    "response-form", "bytes", "noise", NULL};

/* Lights that need the scene: a point light without intensity gives the scene's centre the
 * irradiance pi. */
static void resolve_lights(const struct settings *settings, const struct dph_scene *scene,
                           struct dph_frame *frame)
{
    for (int i = 0; i < frame->nlight; i++) {
        struct dph_light *light = &frame->light[i];
        if (light->kind == DPH_LIGHT_DISTANT)
            light->angle = settings->light_angle;
        if (light->irradiance[0] >= 0.0)
            continue;
        double square = 0.0;
        for (int k = 0; k < 3; k++) {
            double middle = (scene->bounds[0][k] + scene->bounds[1][k]) / 2.0;
            square += (light->position[k] - middle) * (light->position[k] - middle);
        }
        for (int c = 0; c < 3; c++)
            light->irradiance[c] = 3.14159265358979323846 * square;
    }
}

static struct dph_frame frame_of(const struct settings *settings,
                                 const struct dph_material *material, const struct dph_scene *scene)
{
    struct dph_frame frame = dph_frame_defaults();
    frame.method = settings->method;
    frame.material = *material;
    frame.camera = settings->camera;
    if (settings->nlight) {
        frame.nlight = settings->nlight;
        memcpy(frame.light, settings->light, sizeof frame.light);
    }
    frame.width = settings->width;
    frame.height = settings->height;
    memcpy(frame.background, settings->background, sizeof frame.background);
    frame.mm_per_unit = dph_scene_millimetres(scene, settings->size_mm);
    frame.bands = settings->use_bands;
    frame.window = settings->window;
    frame.samples = settings->samples;
    frame.map_size = settings->map_size;
    frame.blur_mm = settings->blur_mm;
    frame.view_averaged = settings->view_averaged;
    resolve_lights(settings, scene, &frame);
    return frame;
}

/* Drawing has room for nine attributes; more bands stay in the file. */
static void note_bands(const struct settings *settings, const struct dph_scene *scene)
{
    for (size_t b = 0; b < scene->nbody; b++)
        if (scene->body[b].thickness && scene->body[b].thickness->bands > DPH_DRAW_BANDS) {
            if (!settings->quiet)
                complain(settings, "%d bands are stored, the first %d are drawn",
                         scene->body[b].thickness->bands, DPH_DRAW_BANDS);
            return;
        }
}

/* A square cannot be cut. */
static void note_root(const struct settings *settings, const struct dph_scene *scene)
{
    for (size_t b = 0; b < scene->nbody && settings->method->needs & DPH_PRODUCT_RESPONSE; b++) {
        const struct dph_rivals *rivals = scene->body[b].rivals;
        if (rivals && rivals->response && rivals->response->form == DPH_RESPONSE_ROOT &&
            settings->use_bands > 0 && settings->use_bands < rivals->response->bands) {
            warn(settings, "a response in its root form is drawn with all of its %d bands",
                 rivals->response->bands);
            return;
        }
    }
}

static bool needs_bake(const struct settings *settings, const struct dph_scene *scene)
{
    bool missing = false;
    for (size_t b = 0; b < scene->nbody; b++)
        missing = missing || (scene->body[b].mesh.nvert && !scene->body[b].thickness);
    return missing && settings->method->needs_thickness;
}

/* What the method needs besides thickness and the file does not have for this material and size. */
static unsigned missing_products(const struct settings *settings, const struct dph_scene *scene,
                                 const struct dph_material *material)
{
    char why[240];
    bool found;
    double mm_per_unit = dph_scene_millimetres(scene, settings->size_mm);
    if (dph_scene_rivals_fit(scene, settings->method->needs, material, mm_per_unit, why,
                             sizeof why, &found))
        return 0;
    if (found)
        warn(settings, "%s: what %s needs %s; it is baked anew in memory", settings->input[0],
             settings->method->name, why);
    return settings->method->needs;
}

static void report(const struct settings *settings, const struct dph_frame *frame,
                   const struct dph_gl *gl, const struct dph_cost *cost,
                   const struct dph_rivals_report *rivals,
                   const struct dph_scene_response_report *response, double seconds_bake,
                   double seconds)
{
    if (settings->json) {
        struct json json;
        emit_begin(&json, stdout);
        emit_text(&json, "input", settings->input[0]);
        emit_text(&json, "output", settings->output);
        emit_text(&json, "method", frame->method->name);
        emit_text(&json, "material", frame->material.name);
        emit_text(&json, "renderer", dph_gl_name(gl));
        emit_count(&json, "width", (size_t)frame->width);
        emit_count(&json, "height", (size_t)frame->height);
        emit_count(&json, "lights", (size_t)frame->nlight);
        emit_number(&json, "mm_per_unit", frame->mm_per_unit);
        emit_count(&json, "passes", (size_t)cost->passes);
        emit_number(&json, "bytes_per_vertex", cost->bytes_per_vertex);
        emit_count(&json, "table_bytes", cost->table_bytes);
        emit_object(&json, "seconds");
        emit_number(&json, "bake", seconds_bake);
        if (frame->method->needs) {
            emit_number(&json, "normals", rivals->seconds_normals);
            emit_number(&json, "transfer", rivals->seconds_transfer);
            emit_number(&json, "clusters", rivals->seconds_clusters);
            emit_number(&json, "response", response->seconds_bake + response->seconds_form +
                                                response->seconds_view);
        }
        emit_number(&json, "total", seconds);
        emit_close(&json, '}');
        emit_end(&json);
    } else if (!settings->quiet) {
        printf("wrote %s: %s in %s, %dx%d\n", settings->output, frame->method->name,
               frame->material.name, frame->width, frame->height);
        talk(settings,
             "%s: %g bytes a vertex, %zu bytes beside them, %d pass%s a frame, %.2f s of "
             "precomputation",
             frame->method->name, cost->bytes_per_vertex, cost->table_bytes, cost->passes,
             cost->passes == 1 ? "" : "es", seconds_bake);
    }
}

static int run(struct settings *settings)
{
    int code = EXIT_DONE;
    struct dph_error err;
    struct dph_material material;
    struct dph_scene *scene = NULL;
    struct dph_gl *gl = NULL;
    struct dph_renderer *renderer = NULL;
    struct dph_image image = {0};
    struct dph_cost cost;
    struct dph_rivals_report rivals;
    struct dph_scene_response_report response;

    if (!has_ending(settings->output, ".png") && !has_ending(settings->output, ".exr")) {
        complain(settings, "%s: the ending says the format, .png or .exr", settings->output);
        return EXIT_USAGE;
    }
    if (!load_material(settings, "wax", &material, &code))
        return code;
    if (settings->reference)
        return render_reference(settings, &material);
    struct dph_frame asked = dph_frame_defaults(); /* told before the scene is loaded and baked */
    asked.method = settings->method;
    if (settings->nlight) {
        asked.nlight = settings->nlight;
        memcpy(asked.light, settings->light, sizeof asked.light);
    }
    asked.has_environment = settings->environment;
    if (!dph_frame_check_lights(&asked, &err))
        return report_error(settings, &err);
    if (!load_environment(settings, &asked, &code))
        return code;
    if (!output_possible(settings, settings->output))
        return EXIT_OUTPUT;
    double start = seconds_now(), seconds_bake = 0.0;
    if (!(scene = load_scene(settings, settings->input[0], &code)))
        return code;
    if (!(gl = dph_gl_create_headless(&err))) /* before the bake: no use in waiting for it */
        goto error;
    talk(settings, "drawing with %s", dph_gl_name(gl));
    if (needs_bake(settings, scene)) {
        double begun = seconds_now();
        if (!bake_scene(settings, scene, true, NULL, &code))
            goto done;
        seconds_bake = seconds_now() - begun;
        talk(settings, "baked in memory in %.2f s", seconds_bake);
    }
    double before = seconds_now();
    unsigned products = missing_products(settings, scene, &material);
    if (!bake_rivals(settings, scene, &material, products, &rivals, &code) ||
        !bake_response(settings, scene, &material, products, &response, &code))
        goto done;
    if (products) {
        seconds_bake += seconds_now() - before;
        talk(settings,
             "baked in memory: normals %.2f s, transfer %.2f s, clusters %.2f s, response %.2f s",
             rivals.seconds_normals, rivals.seconds_transfer, rivals.seconds_clusters,
             response.seconds_bake + response.seconds_form + response.seconds_view);
    }
    note_bands(settings, scene);
    note_root(settings, scene);
    struct dph_frame frame = frame_of(settings, &material, scene);
    frame.has_environment = asked.has_environment;
    memcpy(frame.environment, asked.environment, sizeof frame.environment);
    if (frame.has_environment && !settings->nlight) /* the only light */
        memset(frame.light[0].irradiance, 0, sizeof frame.light[0].irradiance);
    struct dph_tone tone = {.exposure = settings->exposure};
    if (frame.method->quantity)
        tone = (struct dph_tone){.linear = true};
    if (!(renderer = dph_renderer_create(scene, &err)) ||
        !dph_image_init(&image, frame.width, frame.height, &err) ||
        !dph_renderer_draw(renderer, &frame, &image, &err) ||
        !dph_renderer_cost(renderer, &frame, &cost, &err) ||
        !dph_image_save(&image, settings->output, &tone, &err))
        goto error;
    report(settings, &frame, gl, &cost, &rivals, &response, seconds_bake, seconds_now() - start);
    goto done;

error:
    code = report_error(settings, &err);
done:
    dph_image_finish(&image);
    dph_renderer_destroy(renderer);
    dph_gl_destroy(gl);
    dph_scene_destroy(scene);
    return code;
}

const struct command command_render = {
    .name = "render",
    .summary = "draw one picture, without a window",
    .usage = "INPUT -o IMAGE [options]",
    .examples =
        "  diaphan render bunny.glb -o bunny.png\n"
        "  diaphan render bunny.obj -o bunny.png --material marble --size-mm 40 --light 160,20\n"
        "  diaphan render head.glb -o head.exr --camera 20,5,3 --light 200,10 --light "
        "30,40,1,1,1\n",
    .notes = "A file that is not baked is baked in memory. IMAGE is .png (8 bit, sRGB) or .exr "
             "(32-bit float, linear, with\n"
             "coverage). A light stands at (cos EL sin AZ, sin EL, cos EL cos AZ), y up, and so "
             "does the camera, which looks\n"
             "at the centre of the bounding box. With irradiance pi white paper that faces the "
             "light has radiance 1.\n"
             "Point and spot lights stand in scene units; without R,G,B they give the centre of "
             "the bounding box irradiance\n"
             "pi. A spot fades over the outer tenth of its cone. Thickness towards them is that "
             "from a body's centre (shsss)\n"
             "or from every point (green). Of a disc, shsss takes the mean thickness; lambert and "
             "green take its middle.\n"
             "prt and prt-cpca take distant lights, discs and surroundings; they, patro and response "
             "are baked in\n"
             "memory unless the file has them for this material and size (bake --for). response walks at random for seconds\n"
             "to minutes; --env makes its form linear. --clusters 1 --vectors 24 is the setting of the "
             "DirectX sample.\n"
             "reference is path-traced on the CPU and needs neither a bake nor a driver; Ctrl-C "
             "keeps the samples so far.\n",
    .options = takes,
    .min_inputs = 1,
    .max_inputs = 1,
    .wants_output = true,
    .run = run,
};
