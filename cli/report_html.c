/* The report: report.html, embedded at build time, has what is the same in every report (style,
 * script), and two places that are filled here, {{title}} and {{body}}.
 *
 * Every text from outside goes through text_escape. Pictures are cut to the object and stand in the
 * page once, as PNG in base64 (RFC 4648); the slider's script takes them from there. */
#define _POSIX_C_SOURCE 200809L
#include "report_html.h"
#include "report_truths.h"

#include "text.h"

#include <diaphan/file.h>
#include <diaphan/metrics.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

extern const char report_html_template[]; /* made from report.html */

struct report {
    const struct dph_comparison *comparison;
    const struct figure_run *run;
    struct figure_crop crop;
    FILE *out;
    struct dph_error *err;
};

static void put(const struct report *r, const char *text)
{
    text_escape(r->out, text);
}

/* "shsss, 6 bands, fitted": how people and the script call an entry. */
static void put_entry(const struct report *r, const struct dph_entry *entry)
{
    put(r, entry->method->name);
    if (entry->variant[0]) {
        fputs(", ", r->out);
        put(r, entry->variant);
    }
    if (entry->fitted)
        fputs(", fitted", r->out);
}

static void put_base64(FILE *out, const unsigned char *data, size_t size)
{
    static const char letter[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        unsigned long bits = (unsigned long)data[i] << 16;
        bits |= i + 1 < size ? (unsigned long)data[i + 1] << 8 : 0;
        bits |= i + 2 < size ? (unsigned long)data[i + 2] : 0;
        char four[4] = {letter[bits >> 18], letter[bits >> 12 & 63],
                        i + 1 < size ? letter[bits >> 6 & 63] : '=',
                        i + 2 < size ? letter[bits & 63] : '='};
        fwrite(four, 1, 4, out);
    }
}

/* The value of a src attribute. */
static bool put_source(const struct report *r, const struct dph_image *image, double exposure)
{
    unsigned char *data;
    size_t size;
    struct dph_tone tone = {.exposure = exposure};
    if (!dph_image_encode_png(image, &tone, &data, &size, r->err))
        return false;
    fputs("data:image/png;base64,", r->out);
    put_base64(r->out, data, size);
    free(data);
    return true;
}

/* One picture or, where `map` is not NULL, error map; `entry` NULL: the reference. */
static bool put_image(const struct report *r, const struct dph_judged *judged, size_t light,
                      const struct dph_entry *entry, const struct dph_image *image,
                      const float *map)
{
    struct dph_image part;
    int width = r->crop.width, height = r->crop.height;
    bool made = map ? figure_map(map, r->comparison, &r->crop, width, height, &part, r->err)
                    : figure_picture(image, &r->crop, width, height, &part, r->err);
    if (!made)
        return false;
    fprintf(r->out, "<img width=\"%d\" height=\"%d\" data-kind=\"%s\" data-material=\"", width,
            height, map ? "map" : "picture");
    put(r, judged->material.name);
    fputs("\" data-light=\"", r->out);
    put(r, r->comparison->light[light].name);
    fputs("\" data-entry=\"", r->out);
    if (entry)
        put_entry(r, entry);
    else
        fputs("reference", r->out);
    fputs(map ? "\" alt=\"FLIP error of " : "\" alt=\"", r->out);
    if (entry)
        put_entry(r, entry);
    else
        fputs("reference", r->out);
    fputs(", light ", r->out);
    put(r, r->comparison->light[light].name);
    fputs("\" src=\"", r->out);
    bool ok = put_source(r, &part, map ? 0 : figure_stops(&judged->truth[light]));
    fputs("\">", r->out);
    dph_image_finish(&part);
    return ok;
}

/* A cell with a number that a script can sort by. */
static void put_cell(const struct report *r, const char *classes, double value, const char *text,
                     const char *title)
{
    fprintf(r->out, "<td%s%s%s data-value=\"", classes[0] ? " class=\"" : "", classes,
            classes[0] ? "\"" : "");
    if (isinf(value))
        fputs(value > 0 ? "Infinity" : "-Infinity", r->out);
    else if (!isnan(value))
        fprintf(r->out, "%.9g", value);
    putc('"', r->out);
    if (title && title[0]) {
        fputs(" title=\"", r->out);
        put(r, title);
        putc('"', r->out);
    }
    putc('>', r->out);
    put(r, text);
    fputs("</td>", r->out);
}

enum { TEXTS = 3, COSTS = 3, REST = 2 }; /* columns besides those of the figures */

static void put_table_head(const struct report *r)
{
    static const char *const left[TEXTS + COSTS] = {"Method",         "Variant", "Fitted",
                                                    "Bytes a vertex", "Bake",    "Frame"};
    static const char *const right[REST] = {"Tables", "Passes"};
    const struct dph_comparison *c = r->comparison;
    int column = 0;
    fputs("<thead><tr>", r->out);
    for (int i = 0; i < TEXTS + COSTS; i++)
        fprintf(r->out, "<th%s rowspan=\"2\" scope=\"col\" data-column=\"%d\">%s</th>",
                i < TEXTS    ? " class=\"text\""
                : i == TEXTS ? " class=\"first\""
                             : "",
                column++, left[i]);
    for (size_t l = 0; l < c->nlight; l++) {
        fprintf(r->out, "<th class=\"first text\" colspan=\"%d\" scope=\"colgroup\">light: ",
                FIGURES);
        put(r, c->light[l].name);
        fputs("</th>", r->out);
    }
    int after = column + FIGURES * (int)c->nlight;
    for (int i = 0; i < REST; i++)
        fprintf(r->out, "<th%s rowspan=\"2\" scope=\"col\" data-column=\"%d\">%s</th>",
                i ? "" : " class=\"first\"", after++, right[i]);
    fputs("</tr>\n<tr>", r->out);
    for (size_t l = 0; l < c->nlight; l++)
        for (int i = 0; i < FIGURES; i++)
            fprintf(r->out, "<th%s scope=\"col\" data-column=\"%d\">%s</th>",
                    i ? "" : " class=\"first\"", column++, figure_name[i]);
    fputs("</tr></thead>\n", r->out);
}

/* The beginning of an entry's row. */
static void put_names(const struct report *r, const struct dph_entry *entry)
{
    fputs("<tr><th class=\"text\" scope=\"row\" title=\"", r->out);
    put(r, entry->method->title ? entry->method->title : entry->method->name);
    fputs("\">", r->out);
    put(r, entry->method->name);
    fputs("</th><td class=\"text\">", r->out);
    put(r, entry->variant);
    fprintf(r->out, "</td><td class=\"text\">%s</td>", entry->fitted ? "yes" : "no");
}

static void print_size(char *text, size_t room, double bytes)
{
    double value = bytes < 1048576 ? bytes / 1024 : bytes / 1048576;
    snprintf(text, room, "%.*f %s", value < 10 ? 1 : 0, value, bytes < 1048576 ? "KiB" : "MiB");
}

static void put_row(const struct report *r, const struct dph_entry *entry, const double *best)
{
    const struct dph_comparison *c = r->comparison;
    char text[64];
    put_names(r, entry);
    snprintf(text, sizeof text, "%.4g", entry->bytes_per_vertex);
    put_cell(r, "first", entry->bytes_per_vertex, text, NULL);
    figure_print_time(entry->seconds, text);
    put_cell(r, "", entry->seconds, entry->seconds == 0 ? "none" : text, NULL);
    figure_print_time(entry->milliseconds * 1e-3, text);
    put_cell(r, "", entry->milliseconds, text, NULL);
    for (size_t l = 0; l < c->nlight; l++)
        for (int i = 0; i < FIGURES; i++) {
            const struct dph_shot *shot = &entry->shot[l];
            double value = figure_of(&shot->scores, i);
            char number[24], classes[32];
            snprintf(classes, sizeof classes, "%s%s%s", i ? "" : "first ",
                     figure_same(i, value, best[l * FIGURES + (size_t)i]) ? "best " : "",
                     shot->noisy && i == 0 ? "noisy" : "");
            put_cell(r, classes, value, figure_print(i, value, number), shot->warning);
        }
    print_size(text, sizeof text, (double)entry->table_bytes);
    put_cell(r, "first", (double)entry->table_bytes, entry->table_bytes ? text : "none", NULL);
    snprintf(text, sizeof text, "%d", entry->passes);
    put_cell(r, "", entry->passes, text, NULL);
    fputs("</tr>\n", r->out);
}

/* What the reference's own noise does to the figures, below those of the methods. */
static void put_noise(const struct report *r, const struct dph_judged *judged)
{
    char text[24];
    fprintf(r->out,
            "<tfoot><tr><th class=\"text\" scope=\"row\" colspan=\"%d\">noise of the "
            "reference</th><td class=\"first\" colspan=\"%d\"></td>",
            TEXTS, COSTS);
    for (size_t l = 0; l < r->comparison->nlight; l++)
        for (int i = 0; i < FIGURES; i++)
            fprintf(r->out, "<td%s>%s</td>", i ? "" : " class=\"first\"",
                    figure_print(i, figure_of_noise(&judged->truth[l].noise, i), text));
    fprintf(r->out, "<td class=\"first\" colspan=\"%d\"></td></tr></tfoot>\n", REST);
}

/* Entries with pictures, or those of a study. Returns whether there are any. */
static bool put_table(const struct report *r, const struct dph_judged *judged, bool shown,
                      const char *caption)
{
    size_t rows = 0;
    double best[DPH_JUDGE_LIGHTS * FIGURES];
    for (size_t i = 0; i < sizeof best / sizeof best[0]; i++)
        best[i] = NAN;
    for (size_t e = 0; e < judged->nentry; e++) {
        const struct dph_entry *entry = &judged->entry[e];
        if (entry->shown != shown)
            continue;
        rows++;
        for (size_t l = 0; l < r->comparison->nlight; l++)
            for (int i = 0; i < FIGURES; i++) {
                double value = figure_of(&entry->shot[l].scores, i), *b = &best[l * FIGURES +
                                                                               (size_t)i];
                if (isnan(*b) || (!isnan(value) && figure_better(i, value, *b)))
                    *b = value;
            }
    }
    if (!rows)
        return false;
    fprintf(r->out, "<div class=\"wide\"><table class=\"sortable\"><caption>%s</caption>\n",
            caption);
    put_table_head(r);
    fputs("<tbody>\n", r->out);
    for (size_t e = 0; e < judged->nentry; e++)
        if (judged->entry[e].shown == shown)
            put_row(r, &judged->entry[e], best);
    fputs("</tbody>\n", r->out);
    put_noise(r, judged);
    fputs("</table></div>\n", r->out);
    return true;
}

/* Whose figures are not to be trusted, and why. */
static void put_warnings(const struct report *r, const struct dph_judged *judged)
{
    size_t count = 0;
    for (size_t e = 0; e < judged->nentry; e++)
        for (size_t l = 0; l < r->comparison->nlight; l++) {
            const struct dph_shot *shot = &judged->entry[e].shot[l];
            if (!shot->warning[0])
                continue;
            if (!count++)
                fputs("<details class=\"warnings\"><summary>Figures with a warning</summary><ul>\n",
                      r->out);
            fputs("<li>", r->out);
            put_entry(r, &judged->entry[e]);
            fputs(", ", r->out);
            put(r, r->comparison->light[l].name);
            fputs(": ", r->out);
            put(r, shot->warning);
            fputs("</li>\n", r->out);
        }
    if (count)
        fputs("</ul></details>\n", r->out);
}

static void put_figures(const struct report *r, const struct dph_scores *scores, bool noisy)
{
    char number[24];
    fprintf(r->out, "<br>%s", noisy ? "\xe2\x89\x88 " : "");
    for (int i = 0; i < FIGURES; i++)
        fprintf(r->out, "%s%s %s", i ? " \xc2\xb7 " : "", figure_name[i],
                figure_print(i, figure_of(scores, i), number));
}

static bool put_pictures(const struct report *r, const struct dph_judged *judged, size_t light)
{
    const struct dph_comparison *c = r->comparison;
    const struct dph_truth *truth = &judged->truth[light];
    char place[96], number[24];
    int stops = figure_stops(truth);
    figure_print_light(&c->light[light], place);
    fputs("<h4>light: ", r->out);
    put(r, c->light[light].name);
    fprintf(r->out, "<small>%s", place);
    if (stops)
        fprintf(r->out, "; pictures shown %d stop%s brighter than they were judged", stops,
                stops == 1 ? "" : "s");
    fputs("</small></h4>\n<div class=\"grid\">\n<figure>", r->out);
    if (!put_image(r, judged, light, NULL, &truth->image, NULL))
        return false;
    fprintf(r->out, "<figcaption><b>reference</b><br>noise: ");
    for (int i = 0; i < FIGURES; i++)
        fprintf(r->out, "%s%s %s", i ? " \xc2\xb7 " : "", figure_name[i],
                figure_print(i, figure_of_noise(&truth->noise, i), number));
    fputs("</figcaption></figure>\n", r->out);
    for (size_t e = 0; e < judged->nentry; e++) {
        const struct dph_entry *entry = &judged->entry[e];
        const struct dph_shot *shot = &entry->shot[light];
        if (!entry->shown || !shot->image.pixel)
            continue;
        fputs("<figure>", r->out);
        if (!put_image(r, judged, light, entry, &shot->image, NULL) ||
            (shot->flip && !put_image(r, judged, light, entry, NULL, shot->flip)))
            return false;
        fputs("<figcaption><b>", r->out);
        put_entry(r, entry);
        fputs("</b>", r->out);
        put_figures(r, &shot->scores, shot->noisy);
        if (shot->warning[0]) {
            fputs("<br>", r->out);
            put(r, shot->warning);
        }
        fputs("</figcaption></figure>\n", r->out);
    }
    fputs("</div>\n", r->out);
    return true;
}

static void put_channels(const struct report *r, const char *name, const double value[3])
{
    if (isnan(value[0]) || isnan(value[1]) || isnan(value[2]))
        return;
    fprintf(r->out, "%s %.4g, %.4g, %.4g; ", name, value[0], value[1], value[2]);
}

/* The numbers that a fit has found, and what it did to the error on its training lights. */
static void put_fits(const struct report *r, const struct dph_judged *judged)
{
    size_t count = 0;
    for (size_t e = 0; e < judged->nentry; e++) {
        const struct dph_entry *entry = &judged->entry[e];
        if (!entry->fitted)
            continue;
        if (!count++)
            fputs("<details><summary>Fitted numbers</summary><dl>\n", r->out);
        fputs("<dt>", r->out);
        put_entry(r, entry);
        fputs("</dt><dd>", r->out);
        if (entry->takes_thickness) {
            fprintf(r->out, "formula %s, curve %s; ",
                    entry->material.formula == DPH_FORMULA_PAPER ? "paper" : "g",
                    entry->material.curve == DPH_CURVE_EXP ? "exp" : "slab");
            put_channels(r, "sigma", entry->material.sigma);
            put_channels(r, "base", entry->material.base);
            put_channels(r, "front", entry->material.front);
            put_channels(r, "back", entry->material.back);
        }
        put_channels(r, "gain", entry->gain);
        char before[24], after[24];
        fprintf(r->out, "relative error on the training lights %s before, %s after</dd>\n",
                figure_print(FIGURE_RMSE, entry->training_before, before),
                figure_print(FIGURE_RMSE, entry->training_after, after));
    }
    if (count)
        fputs("</dl></details>\n", r->out);
}

static bool put_material(const struct report *r, const struct dph_judged *judged)
{
    const struct dph_material *m = &judged->material;
    char truth[32], training[32];
    fputs("<h2>", r->out);
    put(r, m->name);
    fprintf(r->out,
            "<small>scattering %.4g, %.4g, %.4g and absorption %.4g, %.4g, %.4g per mm, anisotropy "
            "%.3g, index %.3g</small></h2>\n",
            m->scattering[0], m->scattering[1], m->scattering[2], m->absorption[0],
            m->absorption[1], m->absorption[2], m->anisotropy, m->ior);
    figure_print_time(judged->seconds_truth, truth);
    figure_print_time(judged->seconds_training, training);
    fprintf(r->out,
            "<p class=\"note\">The reference has %d samples a pixel and took %s; its training lights "
            "took %s.",
            judged->samples, truth, training);
    if (judged->lost || judged->capped)
        fprintf(r->out, " Of %llu paths %llu were lost at the surface and %llu ended by the limit of "
                "their length.", (unsigned long long)judged->paths,
                (unsigned long long)judged->lost, (unsigned long long)judged->capped);
    fputs("</p>\n", r->out);
    fputs("<p class=\"note\">RMSE: RMS error over RMS truth of linear luminance; PSNR in dB, SSIM, "
          "FLIP at 67 pixels a degree: of the sRGB pictures. All are over the object's pixels. The "
          "best of a column is coloured; \xe2\x89\x88 marks what the noise makes uncertain.</p>\n",
          r->out);
    put_table(r, judged, true, "Distance to the reference, and cost");
    report_truths_html(r->out, r->comparison, judged);
    put_warnings(r, judged);
    put_fits(r, judged);
    for (size_t l = 0; l < r->comparison->nlight; l++)
        if (!put_pictures(r, judged, l))
            return false;
    bool study = false;
    for (size_t e = 0; e < judged->nentry; e++)
        study |= !judged->entry[e].shown;
    if (study) {
        fputs("<details><summary>Study: further variants, without pictures</summary>\n", r->out);
        put_table(r, judged, false, "Distance to the reference, and cost");
        fputs("</details>\n", r->out);
    }
    return true;
}

/* The same entry in another material; NULL: not there. */
static const struct dph_entry *find_entry(const struct dph_judged *judged,
                                          const struct dph_entry *like)
{
    for (size_t e = 0; e < judged->nentry; e++) {
        const struct dph_entry *entry = &judged->entry[e];
        if (entry->method == like->method && entry->fitted == like->fitted &&
            entry->shown == like->shown && strcmp(entry->variant, like->variant) == 0)
            return entry;
    }
    return NULL;
}

/* A figure's mean over the materials; NaN where one lacks it. */
static double mean_figure(const struct dph_comparison *c, const struct dph_entry *like,
                          size_t light, int which)
{
    double sum = 0;
    for (size_t m = 0; m < c->nmaterial; m++) {
        const struct dph_entry *entry = find_entry(&c->material[m], like);
        sum += entry ? figure_of(&entry->shot[light].scores, which) : NAN;
    }
    return sum / (double)c->nmaterial;
}

/* Over several materials: the mean of the two figures that say most. */
static void put_overview(const struct report *r)
{
    static const int which[] = {FIGURE_RMSE, FIGURE_FLIP};
    const struct dph_comparison *c = r->comparison;
    char number[24];
    int column = TEXTS;
    if (c->nmaterial < 2 || !c->material[0].nentry)
        return;
    fputs("<h2>All materials</h2>\n<div class=\"wide\"><table class=\"sortable\"><caption>Means over "
          "the materials</caption>\n<thead><tr><th class=\"text\" rowspan=\"2\" scope=\"col\" "
          "data-column=\"0\">Method</th><th class=\"text\" rowspan=\"2\" scope=\"col\" "
          "data-column=\"1\">Variant</th><th class=\"text\" rowspan=\"2\" scope=\"col\" "
          "data-column=\"2\">Fitted</th>",
          r->out);
    for (size_t l = 0; l < c->nlight; l++) {
        fputs("<th class=\"first text\" colspan=\"2\" scope=\"colgroup\">light: ", r->out);
        put(r, c->light[l].name);
        fputs("</th>", r->out);
    }
    fputs("</tr>\n<tr>", r->out);
    for (size_t l = 0; l < c->nlight; l++)
        for (int i = 0; i < 2; i++)
            fprintf(r->out, "<th%s scope=\"col\" data-column=\"%d\">%s</th>",
                    i ? "" : " class=\"first\"", column++, figure_name[which[i]]);
    fputs("</tr></thead>\n<tbody>\n", r->out);
    for (size_t e = 0; e < c->material[0].nentry; e++) {
        const struct dph_entry *entry = &c->material[0].entry[e];
        if (!entry->shown)
            continue;
        put_names(r, entry);
        for (size_t l = 0; l < c->nlight; l++)
            for (int i = 0; i < 2; i++) {
                double mean = mean_figure(c, entry, l, which[i]);
                put_cell(r, i ? "" : "first", mean, figure_print(which[i], mean, number), NULL);
            }
        fputs("</tr>\n", r->out);
    }
    fputs("</tbody></table></div>\n", r->out);
}

/* The slider's place; hidden until the script has found its pictures. */
static void put_slider(const struct report *r)
{
    static const char *const choice[] = {"material", "light", "left", "right"};
    fputs("<section class=\"script\" hidden><h2>Side by side</h2>\n<div class=\"choices\">\n",
          r->out);
    for (int i = 0; i < 4; i++)
        fprintf(r->out, "<label>%s<select id=\"choose-%s\"></select></label>\n", choice[i],
                choice[i]);
    fputs("<label class=\"check\"><input type=\"checkbox\" id=\"maps\">error maps</label></div>\n"
          "<div class=\"slider\" id=\"slider\"><img class=\"left\" alt=\"\"><img class=\"right\" "
          "alt=\"\"><i></i><span class=\"name-left\"></span><span class=\"name-right\"></span>"
          "</div>\n<input type=\"range\" id=\"position\" min=\"0\" max=\"100\" step=\"0.5\" "
          "value=\"50\" aria-label=\"share of the left picture\">\n</section>\n"
          "<noscript><p class=\"note\">With script there is a slider here, between any two of the "
          "pictures below.</p></noscript>\n",
          r->out);
}

static void put_term(const struct report *r, const char *term, const char *text)
{
    if (!text || !text[0])
        return;
    fprintf(r->out, "<dt>%s</dt><dd>", term);
    put(r, text);
    fputs("</dd>\n", r->out);
}

static void put_run(const struct report *r)
{
    const struct dph_comparison *c = r->comparison;
    char text[256];
    fputs("<h2>The run</h2>\n<dl>\n", r->out);
    put_term(r, "model", r->run->model);
    snprintf(text, sizeof text, "%zu triangles, %zu vertices, largest side %.4g mm, %.4g mm a unit",
             c->triangles, c->vertices, c->size_mm, c->mm_per_unit);
    put_term(r, "scene", text);
    snprintf(text, sizeof text,
             "azimuth %.4g\xc2\xb0, elevation %.4g\xc2\xb0, distance %.4g bounding-sphere radii, "
             "%.4g\xc2\xb0 high",
             c->camera.azimuth, c->camera.elevation, c->camera.distance, c->camera.fov);
    put_term(r, "camera", text);
    snprintf(text, sizeof text, "%d \xc3\x97 %d pixels, of which the box of %d \xc3\x97 %d around "
             "the object is shown", c->width, c->height, r->crop.width, r->crop.height);
    put_term(r, "pictures", text);
    snprintf(text, sizeof text, "half-angle of the lights %.4g\xc2\xb0", c->light_angle);
    put_term(r, "lights", text);
    snprintf(text, sizeof text, "%s boundary, %d samples a pixel, seed %llu",
             c->boundary == DPH_BOUNDARY_DIELECTRIC ? "dielectric" : "index-matched", c->samples,
             (unsigned long long)c->seed);
    put_term(r, "reference", text);
    snprintf(text, sizeof text, "%s, %d samples a pixel", c->renderer, c->multisamples);
    put_term(r, "drawn by", text);
    figure_print_time(c->seconds, text);
    put_term(r, "time in all", text);
    put_term(r, "diaphan", dph_version());
    put_term(r, "command", r->run->command);
    fputs("</dl>\n", r->out);
}

static bool put_body(const struct report *r)
{
    const struct dph_comparison *c = r->comparison;
    enum { STEPS = 256 };
    float ramp[STEPS];
    struct dph_image colours;
    fputs("<h1>", r->out);
    put(r, r->run->model ? r->run->model : "Comparison");
    fputs("</h1>\n<p class=\"lead\">Every method beside the path-traced truth: how far its pictures "
          "are from it, and what it costs. Fitted rows had their method's free numbers set on "
          "training lights that are not judged here.</p>\n",
          r->out);
    if (c->nwarning) {
        fputs("<div class=\"warnings\"><b>Warnings</b><ul>\n", r->out);
        for (size_t i = 0; i < c->nwarning; i++) {
            fputs("<li>", r->out);
            put(r, c->warning[i]);
            fputs("</li>\n", r->out);
        }
        fputs("</ul></div>\n", r->out);
    }
    put_slider(r);
    fputs("<div class=\"scale\">FLIP error, as the maps below the pictures show it<img alt=\"black "
          "to pale yellow\" src=\"",
          r->out);
    for (int i = 0; i < STEPS; i++)
        ramp[i] = (float)i / (STEPS - 1);
    if (!dph_image_init_magma(&colours, ramp, STEPS, 1, r->err))
        return false;
    bool ok = put_source(r, &colours, 0);
    dph_image_finish(&colours);
    fputs("\"><span><i>0: looks the same</i><i>1</i></span></div>\n", r->out);
    put_overview(r);
    for (size_t m = 0; m < c->nmaterial && ok; m++)
        ok = put_material(r, &c->material[m]);
    put_run(r);
    return ok;
}

bool report_html_save(const struct dph_comparison *comparison, const struct figure_run *run,
                      const char *path, struct dph_error *err)
{
    char *text = NULL;
    size_t size = 0;
    bool ok = true;
    struct report r = {comparison, run, figure_crop(comparison), open_memstream(&text, &size), err};
    if (!r.out)
        return text_fail(err, DPH_ERROR_MEMORY, "%s: out of memory", path);
    for (const char *from = report_html_template; *from && ok;) {
        const char *place = strstr(from, "{{");
        fwrite(from, 1, place ? (size_t)(place - from) : strlen(from), r.out);
        if (!place)
            break;
        if (strncmp(place, "{{title}}", 9) == 0) {
            put(&r, run->model ? run->model : "Comparison");
            fputs(" \xe2\x80\x93 diaphan compare", r.out);
        } else {
            ok = put_body(&r);
        }
        from = strstr(place, "}}") + 2;
    }
    bool whole = !ferror(r.out);
    whole = !fclose(r.out) && whole; /* both, whatever the first says */
    if (ok && !whole)
        ok = text_fail(err, DPH_ERROR_MEMORY, "%s: out of memory", path);
    ok = ok && dph_file_save(path, text, size, err);
    free(text);
    return ok;
}
