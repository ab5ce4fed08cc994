/* diaphan compare INPUT: all methods beside the path-traced truth. */
#define _POSIX_C_SOURCE 200809L
#include "cli.h"
#include "report_truths.h"
#include "watch.h"

#include <diaphan/file.h>
#include <diaphan/judge.h>

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* --lights, by the camera. */
static bool choose_lights(const struct settings *settings, struct dph_judge_params *params)
{
    const char *at = settings->lights ? settings->lights : "front,side,back";
    params->nlight = 0;
    for (;; at++) {
        char name[16], list[64] = "";
        size_t length = strcspn(at, ","), used = 0;
        snprintf(name, sizeof name, "%.*s", (int)(length < 15 ? length : 15), at);
        struct dph_judge_light light;
        if (!dph_judge_light_find(name, &settings->camera, &light)) {
            for (size_t i = 0; dph_judge_light_name(i) && used < sizeof list; i++)
                used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "",
                                         dph_judge_light_name(i));
            complain(settings, "--lights: '%s' is none of %s", name, list);
            return false;
        }
        for (size_t i = 0; i < params->nlight; i++)
            if (!strcmp(params->light[i].name, light.name)) {
                complain(settings, "--lights: %s stands there twice", name);
                return false;
            }
        params->light[params->nlight++] = light;
        at += length;
        if (!*at)
            return true;
    }
}

/* The methods that are compared: those that draw light. */
static size_t choose_methods(const struct settings *settings, const struct dph_method **method,
                             size_t room)
{
    const struct dph_method *each;
    size_t count = 0;
    for (size_t i = 0; (each = dph_method_at(i)); i++)
        if (count < room && (settings->methods ? settings->methods >> i & 1U : !each->quantity))
            method[count++] = each;
    return count;
}

static bool choose_materials(const struct settings *settings, struct dph_material *material,
                             size_t *count, int *code)
{
    struct settings one = *settings;
    *count = 0;
    for (int i = 0; i < settings->nmaterial || i == 0; i++) {
        one.material = settings->nmaterial ? settings->materials[i] : NULL;
        if (!load_material(&one, "wax", &material[*count], code))
            return false;
        ++*count;
    }
    return true;
}

void judge_params(const struct settings *settings, struct dph_judge_params *params)
{
    *params = dph_judge_defaults();
    params->light_angle = settings->light_angle;
    params->boundary = (enum dph_boundary)settings->boundary;
    params->camera = settings->camera;
    params->width = settings->width;
    params->height = settings->height;
    params->samples = settings->spp;
    params->seed = (uint64_t)settings->seed;
    params->size_mm = settings->size_mm;
    params->study = settings->study;
    params->bake = thickness_params(settings);
    params->rivals = rivals_params(settings);
    params->response = response_params(settings);
    params->map_size = settings->map_size;
    params->blur_mm = settings->blur_mm;
    if (is_given(settings, "samples"))
        params->multisamples = settings->samples;
    params->threads = settings->threads;
    params->most_bytes = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGE_SIZE);
}

static const char *entry_name(const struct dph_entry *entry, char text[80])
{
    snprintf(text, 80, "%s%s%s%s", entry->method->name, *entry->variant ? ", " : "",
             entry->variant, entry->fitted ? ", fitted" : "");
    return text;
}

/* One light of one material. */
static void print_light(const struct dph_judged *judged, const char *light, size_t number)
{
    const struct dph_noise *noise = &judged->truth[number].noise;
    char name[80];
    printf("\n%-46s %7s %7s %7s %8s\n", light, "rmse", "flip", "ssim", "psnr");
    for (size_t i = 0; i < judged->nentry; i++) {
        const struct dph_entry *entry = &judged->entry[i];
        const struct dph_shot *shot = &entry->shot[number];
        printf("  %-44s %7.4f %7.4f %7.4f %8.2f%s\n", entry_name(entry, name), shot->scores.rmse,
               shot->scores.flip, shot->scores.ssim, shot->scores.psnr, shot->noisy ? " ~" : "");
    }
    printf("  %-44s %7.4f %7.4f %7.4f %8.2f\n", "noise of the reference", noise->rmse,
           noise->flip, noise->ssim, noise->psnr);
}

static void print(const struct settings *settings, const struct dph_comparison *comparison)
{
    char name[80];
    bool noisy = false;
    for (size_t m = 0; m < comparison->nmaterial; m++) {
        const struct dph_judged *judged = &comparison->material[m];
        printf("%s%s in %s, %g mm: %d samples a pixel, %.1f s\n", m ? "\n" : "",
               settings->input[0], judged->material.name, comparison->size_mm, judged->samples,
               judged->seconds);
        for (size_t l = 0; l < comparison->nlight; l++)
            print_light(judged, comparison->light[l].name, l);
        report_truths_text(stdout, comparison, judged);
        printf("\n%-46s %7s %7s %7s %8s\n", "cost", "bytes", "passes", "bake s", "ms");
        for (size_t i = 0; i < judged->nentry; i++) {
            const struct dph_entry *entry = &judged->entry[i];
            for (size_t l = 0; l < comparison->nlight; l++)
                noisy = noisy || entry->shot[l].noisy;
            if (!entry->fitted && entry->shown)
                printf("  %-44s %7g %7d %7.2f %8.3f\n", entry_name(entry, name),
                       entry->bytes_per_vertex, entry->passes, entry->seconds,
                       entry->milliseconds);
        }
    }
    if (noisy)
        printf("\n~ the noise of the reference matters here: see \"warning\" in metrics.json\n");
}

static bool save_metrics(const struct settings *settings, const struct dph_comparison *comparison,
                         int *code)
{
    struct dph_error err;
    char path[4096], *text = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    if (stream)
        emit_comparison(stream, settings, comparison);
    if (!stream || fclose(stream)) {
        complain(settings, "out of memory");
        *code = EXIT_INPUT;
        free(text);
        return false;
    }
    snprintf(path, sizeof path, "%s/metrics.json", settings->output);
    bool ok = dph_file_save(path, text, length, &err);
    if (!ok)
        *code = report_error(settings, &err);
    else if (settings->json)
        fwrite(text, 1, length, stdout);
    free(text);
    return ok;
}

/* Of the rows that are not fitted, as render draws them; complains about the worst. */
static int tolerate(const struct settings *settings, const struct dph_comparison *comparison)
{
    double flip = settings->max_flip, psnr = settings->min_psnr;
    char flip_name[160] = "", psnr_name[160] = "", name[80];
    for (size_t m = 0; m < comparison->nmaterial; m++)
        for (size_t i = 0; i < comparison->material[m].nentry; i++) {
            const struct dph_entry *entry = &comparison->material[m].entry[i];
            for (size_t l = 0; l < comparison->nlight && entry->shown && !entry->fitted; l++) {
                const struct dph_scores *scores = &entry->shot[l].scores;
                const char *material = comparison->material[m].material.name;
                if (scores->flip > flip) {
                    flip = scores->flip;
                    snprintf(flip_name, sizeof flip_name, "%s in %s, %s", entry_name(entry, name),
                             material, comparison->light[l].name);
                }
                if (scores->psnr < psnr) {
                    psnr = scores->psnr;
                    snprintf(psnr_name, sizeof psnr_name, "%s in %s, %s", entry_name(entry, name),
                             material, comparison->light[l].name);
                }
            }
        }
    if (*flip_name)
        complain(settings, "%s: FLIP %.6g is above %g", flip_name, flip, settings->max_flip);
    else if (*psnr_name)
        complain(settings, "%s: PSNR %.6g dB is below %g", psnr_name, psnr, settings->min_psnr);
    return *flip_name || *psnr_name ? EXIT_TOLERANCE : EXIT_DONE;
}

int compare_methods(const struct settings *settings)
{
    static const char *const files[] = {"metrics.json", "comparison.png", "report.html", NULL};
    int code = EXIT_DONE;
    struct dph_error err;
    struct dph_material material[MAX_MATERIALS];
    const struct dph_method *method[32];
    struct dph_judge_params params;
    struct watch watch;
    struct dph_scene *scene = NULL;
    struct dph_gl *gl = NULL;
    struct dph_comparison *comparison = NULL;

    judge_params(settings, &params);
    params.method = method;
    params.nmethod = choose_methods(settings, method, 32);
    params.material = material;
    for (size_t i = 0; i < params.nmethod; i++)
        if (method[i]->quantity) {
            complain(settings, "--methods: %s draws a quantity, not light", method[i]->name);
            return EXIT_USAGE;
        }
    if (!choose_lights(settings, &params))
        return EXIT_USAGE;
    if (!choose_materials(settings, material, &params.nmaterial, &code))
        return code;
    if (!folder_possible(settings, settings->output, files))
        return EXIT_OUTPUT;
    if (!(scene = load_scene(settings, settings->input[0], &code)))
        return code;
    if (!(gl = dph_gl_create_headless(&err)))
        goto error;
    size_t warnings = scene->nwarning;
    watch_begin(&watch, settings, &params);
    comparison = dph_comparison_create(scene, &params, dph_gl_name(gl), &err);
    watch_end(&watch);
    report_warnings(settings, scene, warnings);
    if (!comparison)
        goto error;
    for (size_t i = 0; i < comparison->nwarning; i++)
        warn(settings, "%s", comparison->warning[i]);
    if (!make_folder(settings, settings->output)) { /* not before: a refusal leaves none behind */
        code = EXIT_OUTPUT;
        goto done;
    }
    if (!save_metrics(settings, comparison, &code) ||
        (code = compare_figures(settings, comparison)) != EXIT_DONE)
        goto done;
    if (!settings->json && !settings->quiet)
        print(settings, comparison);
    code = tolerate(settings, comparison);
    goto done;

error:
    code = report_error(settings, &err);
done:
    dph_comparison_destroy(comparison);
    dph_gl_destroy(gl);
    dph_scene_destroy(scene);
    return code;
}
