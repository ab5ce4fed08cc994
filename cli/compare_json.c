/* The figures of a comparison as JSON: what compare prints with --json and writes as
 * metrics.json. */
#include "cli.h"

#include <diaphan/judge.h>

#include <math.h>

static void emit_noise(struct json *json, const struct dph_noise *noise)
{
    emit_object(json, "noise");
    emit_number(json, "psnr", noise->psnr);
    emit_number(json, "ssim", noise->ssim);
    emit_number(json, "flip", noise->flip);
    emit_number(json, "rmse", noise->rmse);
    emit_close(json, '}');
}

static void emit_material(struct json *json, const struct dph_comparison *comparison,
                          const struct dph_judged *judged)
{
    emit_object(json, NULL);
    emit_text(json, "name", judged->material.name);
    emit_triple(json, "scattering", judged->material.scattering);
    emit_triple(json, "absorption", judged->material.absorption);
    emit_number(json, "anisotropy", judged->material.anisotropy);
    emit_number(json, "ior", judged->material.ior);
    emit_count(json, "spp", (size_t)judged->samples);
    emit_count(json, "paths", (size_t)judged->paths);
    emit_count(json, "lost", (size_t)judged->lost);
    emit_count(json, "capped", (size_t)judged->capped);
    emit_object(json, "seconds");
    emit_number(json, "reference", judged->seconds_truth);
    emit_number(json, "training", judged->seconds_training);
    emit_number(json, "views", judged->seconds_views);
    emit_number(json, "all_lights", judged->seconds_held);
    emit_number(json, "total", judged->seconds);
    emit_close(json, '}');
    emit_object(json, "all_lights");
    emit_count(json, "lights", (size_t)judged->held.nlight);
    emit_count(json, "spp", (size_t)judged->held.samples);
    emit_count(json, "pixels", judged->held.pixels);
    emit_number(json, "noise", judged->held.noise_rmse);
    emit_number(json, "view_averaged_rmse", judged->held.views_rmse);
    emit_number(json, "view_averaged_noise", judged->held.views_noise_rmse);
    emit_close(json, '}');
    emit_array(json, "lights");
    for (size_t l = 0; l < comparison->nlight; l++) {
        emit_object(json, NULL);
        emit_text(json, "light", comparison->light[l].name);
        emit_count(json, "pixels", judged->truth[l].pixels);
        emit_number(json, "mean", judged->truth[l].mean);
        emit_noise(json, &judged->truth[l].noise);
        emit_number(json, "view_averaged_rmse", judged->truth[l].views_rmse);
        emit_number(json, "view_averaged_noise", judged->truth[l].views.pixel
                                                     ? judged->truth[l].views_noise.rmse
                                                     : NAN);
        emit_close(json, '}');
    }
    emit_close(json, ']');
    emit_close(json, '}');
}

/* What an entry was drawn with that is not the medium. */
static void emit_parameters(struct json *json, const struct dph_entry *entry)
{
    const struct dph_material *m = &entry->material;
    bool exponential = m->curve == DPH_CURVE_EXP;
    if (entry->takes_thickness) {
        emit_text(json, "formula", m->formula == DPH_FORMULA_PAPER ? "paper" : "g");
        emit_text(json, "curve", exponential ? "exp" : "slab");
    }
    if (!entry->fitted)
        return;
    emit_object(json, "parameters");
    if (entry->takes_thickness) {
        if (exponential)
            emit_triple(json, "sigma", m->sigma);
        emit_triple(json, "base", m->base);
        emit_triple(json, "front", m->front);
        if (m->formula != DPH_FORMULA_PAPER)
            emit_triple(json, "back", m->back);
    } else {
        emit_triple(json, "gain", entry->gain);
    }
    emit_close(json, '}');
    emit_object(json, "training");
    emit_number(json, "before", entry->training_before);
    emit_number(json, "after", entry->training_after);
    emit_close(json, '}');
}

static void emit_row(struct json *json, const struct dph_judged *judged,
                     const struct dph_entry *entry, const char *light, size_t number)
{
    const struct dph_shot *shot = &entry->shot[number];
    emit_object(json, NULL);
    emit_text(json, "method", entry->method->name);
    emit_text(json, "variant", *entry->variant ? entry->variant : NULL);
    emit_text(json, "light", light);
    emit_text(json, "material", judged->material.name);
    emit_bool(json, "fitted", entry->fitted);
    emit_bool(json, "shown", entry->shown);
    emit_number(json, "bands", entry->bands ? entry->bands : NAN);
    emit_text(json, "store", entry->stores ? dph_store_name(entry->store) : NULL);
    emit_text(json, "fit", entry->stores ? dph_fit_name(entry->fit) : NULL);
    emit_number(json, "psnr", shot->scores.psnr);
    emit_number(json, "ssim", shot->scores.ssim);
    emit_number(json, "flip", shot->scores.flip);
    emit_number(json, "rmse", shot->scores.rmse);
    emit_number(json, "rmse_raw", shot->scores.rmse_raw);
    emit_number(json, "rmse_view_averaged", shot->scores.rmse_view_averaged);
    emit_number(json, "rmse_all_lights", entry->rmse_all_lights);
    emit_number(json, "rmse_all_lights_view_averaged", entry->rmse_all_lights_view_averaged);
    emit_noise(json, &judged->truth[number].noise);
    emit_text(json, "warning", shot->noisy ? shot->warning : NULL);
    emit_number(json, "bytes_per_vertex", entry->bytes_per_vertex);
    emit_number(json, "payload_bytes", entry->payload_bytes);
    emit_count(json, "table_bytes", entry->table_bytes);
    emit_count(json, "passes", (size_t)entry->passes);
    emit_number(json, "seconds", entry->seconds);
    emit_number(json, "milliseconds", entry->milliseconds > 0 ? entry->milliseconds : NAN);
    emit_parameters(json, entry);
    emit_close(json, '}');
}

/* The least of the materials and lights; NaN where one is not known. */
static double noise_psnr(const struct dph_comparison *comparison)
{
    double least = INFINITY;
    for (size_t m = 0; m < comparison->nmaterial; m++)
        for (size_t l = 0; l < comparison->nlight; l++) {
            double psnr = comparison->material[m].truth[l].noise.psnr;
            if (isnan(psnr))
                return psnr;
            least = fmin(least, psnr);
        }
    return least;
}

void emit_comparison(FILE *stream, const struct settings *settings,
                     const struct dph_comparison *comparison)
{
    struct json json;
    int samples = comparison->samples;
    for (size_t m = 0; m < comparison->nmaterial; m++)
        if (comparison->material[m].samples < samples)
            samples = comparison->material[m].samples;
    emit_begin(&json, stream);
    emit_text(&json, "input", settings->input[0]);
    emit_object(&json, "reference");
    emit_count(&json, "spp", (size_t)samples);
    emit_number(&json, "noise_psnr", noise_psnr(comparison));
    emit_count(&json, "seed", (size_t)comparison->seed);
    emit_text(&json, "boundary", comparison->boundary ? "dielectric" : "matched");
    emit_close(&json, '}');
    emit_count(&json, "triangles", comparison->triangles);
    emit_count(&json, "vertices", comparison->vertices);
    emit_number(&json, "size_mm", comparison->size_mm);
    emit_number(&json, "mm_per_unit", comparison->mm_per_unit);
    emit_count(&json, "width", (size_t)comparison->width);
    emit_count(&json, "height", (size_t)comparison->height);
    emit_count(&json, "samples", (size_t)comparison->multisamples);
    emit_object(&json, "camera");
    emit_number(&json, "azimuth", comparison->camera.azimuth);
    emit_number(&json, "elevation", comparison->camera.elevation);
    emit_number(&json, "distance", comparison->camera.distance);
    emit_number(&json, "fov", comparison->camera.fov);
    emit_close(&json, '}');
    emit_array(&json, "lights");
    for (size_t l = 0; l < comparison->nlight; l++) {
        emit_object(&json, NULL);
        emit_text(&json, "name", comparison->light[l].name);
        emit_number(&json, "azimuth", comparison->light[l].azimuth);
        emit_number(&json, "elevation", comparison->light[l].elevation);
        emit_close(&json, '}');
    }
    emit_close(&json, ']');
    emit_number(&json, "light_angle", comparison->light_angle);
    emit_text(&json, "renderer", comparison->renderer);
    emit_number(&json, "seconds", comparison->seconds);
    emit_array(&json, "materials");
    for (size_t m = 0; m < comparison->nmaterial; m++)
        emit_material(&json, comparison, &comparison->material[m]);
    emit_close(&json, ']');
    emit_array(&json, "results");
    for (size_t m = 0; m < comparison->nmaterial; m++)
        for (size_t i = 0; i < comparison->material[m].nentry; i++)
            for (size_t l = 0; l < comparison->nlight; l++)
                emit_row(&json, &comparison->material[m], &comparison->material[m].entry[i],
                         comparison->light[l].name, l);
    emit_close(&json, ']');
    emit_array(&json, "warnings");
    for (size_t i = 0; i < comparison->nwarning; i++)
        emit_text(&json, NULL, comparison->warning[i]);
    emit_close(&json, ']');
    emit_end(&json);
}
