/* diaphan compare: how far one picture is from another, here, and every method from the truth, in
 * compare_methods.c. */
#include "cli.h"

#include <diaphan/metrics.h>

#include <math.h>
#include <stdlib.h>

static const char *const takes[] = {
    "output", "max-flip", "min-psnr",
    /* of methods */
    "methods", "material", "size-mm", "lights", "light-angle", "camera", "fov", "resolution",
    "spp", "seed", "boundary", "study", "bands", "directions", "thickness", "fit", "store",
    "clusters", "vectors", "map-size", "blur-mm", "samples", "response-form", "noise", NULL};

struct figures {
    double psnr, ssim, flip, rmse;
    int width, height;
};

static bool is_picture(const char *path)
{
    return has_ending(path, ".png") || has_ending(path, ".exr") || has_ending(path, ".hdr");
}

/* False: *err says why. `map` (height x width; Nullable) receives FLIP's. */
static bool measure(const struct settings *settings, const struct dph_image *a,
                    const struct dph_image *b, struct figures *figures, float *map,
                    struct dph_error *err)
{
    struct dph_metric_params params = dph_metric_defaults();
    params.threads = settings->threads;
    figures->width = a->width;
    figures->height = a->height;
    if (!dph_metric_rmse(a, b, &params, &figures->rmse, NULL, err) ||
        !dph_metric_ssim(a, b, &params, &figures->ssim, NULL, err) ||
        !dph_metric_flip(a, b, &params, &figures->flip, map, err))
        return false;
    figures->psnr = dph_metric_psnr(figures->rmse);
    return true;
}

static bool save_map(const struct settings *settings, const float *map,
                     const struct figures *figures, struct dph_error *err)
{
    struct dph_image image;
    struct dph_tone tone = {0};
    if (!dph_image_init_magma(&image, map, figures->width, figures->height, err))
        return false;
    bool ok = dph_image_save(&image, settings->output, &tone, err);
    dph_image_finish(&image);
    return ok;
}

static void print(const struct settings *settings, const struct figures *figures)
{
    if (settings->json) {
        struct json json;
        emit_begin(&json, stdout);
        emit_number(&json, "psnr", figures->psnr); /* infinite for equal pictures: null */
        emit_number(&json, "ssim", figures->ssim);
        emit_number(&json, "flip", figures->flip);
        emit_number(&json, "rmse", figures->rmse);
        emit_count(&json, "width", (size_t)figures->width);
        emit_count(&json, "height", (size_t)figures->height);
        emit_end(&json);
    } else if (!settings->quiet) {
        if (isfinite(figures->psnr))
            printf("psnr  %.4f dB\n", figures->psnr);
        else
            printf("psnr  infinite, the pictures look the same\n");
        printf("ssim  %.6f\nflip  %.6f\nrmse  %.6f\nsize  %d x %d\n", figures->ssim,
               figures->flip, figures->rmse, figures->width, figures->height);
    }
}

/* An exit code; complains where a figure is beyond its tolerance. */
static int judge(const struct settings *settings, const struct figures *figures)
{
    bool flip = figures->flip > settings->max_flip, psnr = figures->psnr < settings->min_psnr;
    if (flip && psnr)
        complain(settings, "FLIP %.6g is above %g and PSNR %.6g dB is below %g", figures->flip,
                 settings->max_flip, figures->psnr, settings->min_psnr);
    else if (flip)
        complain(settings, "FLIP %.6g is above %g", figures->flip, settings->max_flip);
    else if (psnr)
        complain(settings, "PSNR %.6g dB is below %g", figures->psnr, settings->min_psnr);
    return flip || psnr ? EXIT_TOLERANCE : EXIT_DONE;
}

static bool usable(const struct settings *settings)
{
    if (settings->ninput == 1 && is_picture(settings->input[0])) {
        complain(settings, "%s: beside which other picture? usage: diaphan compare %s",
                 settings->input[0], settings->command->usage);
        return false;
    }
    if (settings->ninput == 1 && !settings->output) {
        complain(settings, "-o FOLDER is missing; usage: diaphan compare %s",
                 settings->command->usage);
        return false;
    }
    if (settings->ninput == 2 && settings->output && !has_ending(settings->output, ".png")) {
        complain(settings, "%s: the error map is a .png", settings->output);
        return false;
    }
    return true;
}

static int run(struct settings *settings)
{
    int code = EXIT_DONE;
    struct dph_error err;
    struct dph_image a = {0}, b = {0};
    struct figures figures;
    float *map = NULL;
    if (!usable(settings))
        return EXIT_USAGE;
    if (settings->ninput == 1)
        return compare_methods(settings);
    if (settings->output && !output_possible(settings, settings->output))
        return EXIT_OUTPUT;
    if (!dph_image_load(&a, settings->input[0], &err) ||
        !dph_image_load(&b, settings->input[1], &err)) {
        code = report_error(settings, &err);
        goto error;
    }
    if (a.width != b.width || a.height != b.height) {
        complain(settings, "%s has %d x %d pixels, %s has %d x %d", settings->input[0], a.width,
                 a.height, settings->input[1], b.width, b.height);
        code = EXIT_INPUT;
        goto error;
    }
    if (settings->output &&
        !(map = malloc((size_t)a.width * (size_t)a.height * sizeof *map))) {
        complain(settings, "out of memory");
        code = EXIT_INPUT;
        goto error;
    }
    if (!measure(settings, &a, &b, &figures, map, &err) ||
        (map && !save_map(settings, map, &figures, &err))) {
        code = report_error(settings, &err);
        goto error;
    }
    print(settings, &figures);
    code = judge(settings, &figures);

error:
    free(map);
    dph_image_finish(&a);
    dph_image_finish(&b);
    return code;
}

const struct command command_compare = {
    .name = "compare",
    .summary = "all methods beside the truth, or the distance between two pictures",
    .usage = "INPUT -o FOLDER [options] | A.png B.png [-o MAP.png]",
    .examples = "  diaphan compare bunny.obj -o bunny --resolution 640x400 --spp 64\n"
                "  diaphan compare head.obj -o head --material skin1 --material wax --size-mm 50\n"
                "  diaphan compare lucy.ply -o lucy --methods shsss,green --lights back --study\n"
                "  diaphan compare before.png after.png -o map.png --json\n"
                "  diaphan compare expected.exr drawn.exr --max-flip 0.01\n",
    .notes = "A mesh: draws it by every method, each material and light, traces the same pictures, "
             "and scores the drawn ones\n"
             "over the object's pixels, as each method draws and once more with its free numbers "
             "fitted on twelve other lights.\n"
             "and over 24 lights of all directions; with response also beside the truth averaged over views, "
             "which it is made for.\n"
             "The truth is the mean over a pixel: pictures are drawn with 16 samples a pixel, so that "
             "outlines are no error.\n"
             "rmse is RMS error / RMS truth of linear luminance without the reference's noise; "
             "psnr, ssim and flip are of sRGB\n"
             "pictures. FOLDER is made where it is missing and gets comparison.png, report.html and "
             "metrics.json. Ctrl-C while\n"
             "the truth is traced keeps the samples so far. Tolerances are for the rows that are not "
             "fitted. The mesh must be closed.\n"
             "Two pictures: PSNR in dB, SSIM, FLIP (at 67 pixels per degree) and RMSE of the whole "
             "pictures, sRGB values in 0\n"
             "to 1; linear pictures (.exr, .hdr) are clipped and encoded first, alpha is ignored. "
             "-o writes the map of FLIP,\n"
             "black where nothing differs. The exit code is 5 where a figure is beyond --max-flip "
             "or --min-psnr.\n",
    .options = takes,
    .min_inputs = 1,
    .max_inputs = 2,
    .run = run,
};
