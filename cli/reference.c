/* diaphan render --method reference: the path-traced picture. Ctrl-C keeps the samples so far. */
#include "cli.h"

#include <diaphan/reference.h>

#include <math.h>
#include <string.h>

static bool step(void *user, double fraction)
{
    progress_step(user, fraction);
    return !interrupt_noted();
}

/* Surroundings, by the pixel that a direction meets. */
static void look_up(void *user, const double to[3], double radiance[3])
{
    static const double PI = 3.14159265358979323846;
    const struct dph_image *image = user;
    double x = (.5 - atan2(to[0], to[2]) / (2 * PI)) * image->width;
    double y = (.5 - asin(fmin(fmax(to[1], -1), 1)) / PI) * image->height;
    int column = (int)fmin(fmax(x, 0), image->width - 1);
    int row = (int)fmin(fmax(y, 0), image->height - 1);
    const float *pixel = image->pixel + 4 * ((size_t)row * (size_t)image->width + (size_t)column);
    for (int c = 0; c < 3; c++)
        radiance[c] = pixel[c] > 0 ? fmin((double)pixel[c], 1e30) : 0; /* NaN counts as 0 */
}

static void report(const struct settings *settings, const struct dph_reference_options *o,
                   const struct dph_reference *reference, double seconds)
{
    double share = (double)(reference->lost + reference->capped) / (double)reference->paths;
    if (share > 1e-5)
        warn(settings, "%.2g of the paths were lost; is every body closed?", share);
    if (reference->samples < o->samples)
        warn(settings, "stopped after %d of %d samples a pixel", reference->samples, o->samples);
    if (settings->json) {
        struct json json;
        emit_begin(&json, stdout);
        emit_text(&json, "input", settings->input[0]);
        emit_text(&json, "output", settings->output);
        emit_text(&json, "method", "reference");
        emit_text(&json, "material", o->material.name);
        emit_text(&json, "boundary", o->boundary ? "dielectric" : "matched");
        emit_bool(&json, "view_averaged", o->view_averaged);
        emit_count(&json, "width", (size_t)o->width);
        emit_count(&json, "height", (size_t)o->height);
        emit_count(&json, "lights", (size_t)o->nlight);
        emit_number(&json, "mm_per_unit", o->mm_per_unit);
        emit_count(&json, "spp", (size_t)reference->samples);
        emit_count(&json, "seed", (size_t)o->seed);
        emit_count(&json, "paths", (size_t)reference->paths);
        emit_count(&json, "lost", (size_t)reference->lost);
        emit_count(&json, "capped", (size_t)reference->capped);
        emit_object(&json, "seconds");
        emit_number(&json, "total", seconds);
        emit_close(&json, '}');
        emit_end(&json);
    } else if (!settings->quiet) {
        printf("wrote %s: reference in %s, %dx%d, %d samples a pixel in %.1f s\n",
               settings->output, o->material.name, o->width, o->height, reference->samples,
               seconds);
    }
}

/* EXR takes the variance of every pixel's mean along. */
static bool save(const struct settings *settings, const struct dph_image *image,
                 const struct dph_reference *reference, struct dph_error *err)
{
    const struct dph_tone tone = {.exposure = settings->exposure};
    const struct dph_channel variance[3] = {{"variance.R", reference->variance, 3},
                                            {"variance.G", reference->variance + 1, 3},
                                            {"variance.B", reference->variance + 2, 3}};
    if (has_ending(settings->output, ".exr"))
        return dph_image_save_channels(image, variance, 3, settings->output, err);
    return dph_image_save(image, settings->output, &tone, err);
}

static struct dph_reference_options options_of(const struct settings *settings,
                                               const struct dph_material *material,
                                               struct dph_light light[DPH_MAX_LIGHTS])
{
    struct dph_reference_options o = dph_reference_defaults();
    struct dph_frame frame = dph_frame_defaults();
    o.material = *material;
    o.boundary = (enum dph_boundary)settings->boundary;
    o.view_averaged = settings->view_averaged;
    o.straight = false; /* as in what is baked to be drawn */
    o.camera = settings->camera;
    o.width = settings->width;
    o.height = settings->height;
    memcpy(o.background, settings->background, sizeof o.background);
    o.samples = settings->spp;
    o.seed = (uint64_t)settings->seed;
    o.threads = settings->threads;
    o.nlight = settings->nlight ? settings->nlight : settings->environment ? 0 : frame.nlight;
    memcpy(light, settings->nlight ? settings->light : frame.light, sizeof frame.light);
    for (int i = 0; i < o.nlight; i++)
        light[i].angle = light[i].kind == DPH_LIGHT_DISTANT ? settings->light_angle : light[i].angle;
    o.light = light;
    return o;
}

int render_reference(const struct settings *settings, const struct dph_material *material)
{
    int code = EXIT_DONE;
    struct dph_error err;
    struct dph_light light[DPH_MAX_LIGHTS];
    struct dph_image image = {0}, surroundings = {0};
    struct dph_reference reference = {0};
    struct dph_scene *scene = NULL;
    struct progress progress;
    struct dph_reference_options o = options_of(settings, material, light);
    for (int i = 0; i < o.nlight; i++)
        if (light[i].kind != DPH_LIGHT_DISTANT) {
            complain(settings, "the reference takes distant lights and surroundings only");
            return EXIT_USAGE;
        }
    if (!output_possible(settings, settings->output))
        return EXIT_OUTPUT;
    double start = seconds_now();
    if (settings->environment) {
        if (!dph_image_load(&surroundings, settings->environment, &err))
            goto error;
        o.environment = look_up;
        o.environment_user = &surroundings;
    }
    if (!(scene = load_scene(settings, settings->input[0], &code)))
        goto done;
    o.mm_per_unit = dph_scene_millimetres(scene, settings->size_mm);
    o.progress = step;
    o.progress_user = &progress;
    interrupt_begin();
    progress_begin(&progress, settings, "tracing");
    bool drawn = dph_reference_render(scene, &o, &reference, &err);
    progress_end(&progress);
    interrupt_end();
    if (!drawn || !dph_image_init(&image, o.width, o.height, &err))
        goto error;
    memcpy(image.pixel, reference.pixel,
           4 * (size_t)o.width * (size_t)o.height * sizeof *image.pixel);
    if (!save(settings, &image, &reference, &err))
        goto error;
    report(settings, &o, &reference, seconds_now() - start);
    goto done;

error:
    code = report_error(settings, &err);
done:
    dph_reference_finish(&reference);
    dph_image_finish(&image);
    dph_image_finish(&surroundings);
    dph_scene_destroy(scene);
    return code;
}
