/* The contact sheet.
 *
 * A section is a material: a heading, a heading for every column, and for every light a line that
 * names it, the pictures, their error maps, and their figures. Below the reference stand what has no
 * place elsewhere: the colours of the maps, and the figures that its noise alone would make.
 *
 * A pixel of a picture is a whole number of pixels of the sheet, or pictures are larger than their
 * place and are averaged down to it. */
#include "sheet.h"

#include "canvas.h"
#include "text.h"

#include <diaphan/metrics.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Points. */
#define MARGIN 30.0
#define COLUMN 112.0  /* place of a picture, width  */
#define TALLEST 150.0 /* and height                 */
#define GAP 10.0
#define SECTION 28.0  /* heading of a material      */
#define HEAD 50.0     /* headings of the columns    */
#define LIGHT 23.0    /* heading of a light         */
#define BETWEEN 3.0   /* picture and error map      */
#define LINE 11.0     /* of figures                 */

/* Eight columns fill a page in landscape at two thirds of their size; three pixels a point are then 300 an
 * inch. Larger sheets are unwieldy, and get fewer. */
#define PIXELS 3.0
#define MAX_SIDE 30000.0
#define MAX_AREA 24e6

enum { INK = 0x1a1a1a, GREY = 0x6b6b6b, RULE = 0xb8b8b8, BLACK = 0, MAX_NOTES = 16 };

static const struct type title_type = {18, INK, true, ALIGN_LEFT},
                         section_type = {14, INK, true, ALIGN_LEFT},
                         method_type = {11, INK, true, ALIGN_LEFT},
                         light_type = {10.5, INK, true, ALIGN_LEFT},
                         small_type = {8.5, GREY, false, ALIGN_LEFT},
                         line_type = {8.5, INK, false, ALIGN_LEFT},
                         number_type = {8.5, INK, false, ALIGN_RIGHT},
                         best_type = {8.5, INK, true, ALIGN_RIGHT},
                         head_type = {8.5, GREY, false, ALIGN_RIGHT},
                         tick_type = {7.5, GREY, false, ALIGN_CENTRE},
                         caption_type = {9, GREY, false, ALIGN_LEFT};

struct sheet {
    const struct dph_comparison *comparison;
    struct canvas *canvas;
    struct figure_crop crop;
    double scale;       /* pixels a point                              */
    double width;       /* of the page, points                         */
    int across, down;   /* pixels of a picture as shown                */
    double pw, ph;      /* the same in points                          */
    double row;         /* height of a light's row                     */
    size_t nmaterial;   /* shown                                       */
    size_t ncolumn;     /* most of any material, without the reference */
    struct dph_error *err;
};

static double column_left(size_t i) /* 0: the reference */
{
    return MARGIN + (double)i * (COLUMN + GAP);
}

/* A picture of at most COLUMN x TALLEST points, for the sheet's scale. */
static void fit_picture(struct sheet *sheet)
{
    double w = COLUMN * sheet->scale, h = TALLEST * sheet->scale;
    double factor = fmin(w / sheet->crop.width, h / sheet->crop.height);
    if (factor >= 1)
        factor = floor(factor);
    sheet->across = (int)fmax(1, floor(sheet->crop.width * factor));
    sheet->down = (int)fmax(1, floor(sheet->crop.height * factor));
    sheet->pw = sheet->across / sheet->scale;
    sheet->ph = sheet->down / sheet->scale;
    sheet->row = LIGHT + 2 * sheet->ph + BETWEEN + (FIGURES + 1) * LINE + 12;
}

/* Points, without the caption. */
static double page_height(const struct sheet *sheet, size_t nmaterial)
{
    double section = SECTION + HEAD + (double)sheet->comparison->nlight * sheet->row + 12;
    return MARGIN + 26 + (double)nmaterial * section;
}

/* How many materials and at which scale: as many as a readable sheet holds. */
static void fit_page(struct sheet *sheet, double foot)
{
    sheet->width = 2 * MARGIN + fmax(5, (double)sheet->ncolumn + 1) * (COLUMN + GAP) - GAP;
    for (sheet->nmaterial = sheet->comparison->nmaterial;; sheet->nmaterial--) {
        sheet->scale = PIXELS;
        for (int turn = 0; turn < 3; turn++) { /* whole pixels change the height a little */
            fit_picture(sheet);
            double height = page_height(sheet, sheet->nmaterial) + foot;
            double limit = fmin(MAX_SIDE / fmax(height, sheet->width),
                                sqrt(MAX_AREA / (height * sheet->width)));
            sheet->scale = fmin(sheet->scale, floor(4 * limit) / 4);
        }
        fit_picture(sheet);
        if (sheet->scale >= 1 || sheet->nmaterial <= 1)
            return;
    }
}

/* On whole pixels. */
static bool put(const struct sheet *sheet, size_t column, double y, const struct dph_image *image,
                double stops)
{
    double x = round(column_left(column) * sheet->scale) / sheet->scale;
    y = round(y * sheet->scale) / sheet->scale;
    canvas_picture(sheet->canvas, x, y, sheet->pw, sheet->ph, image, stops);
    return true;
}

static bool put_picture(const struct sheet *sheet, size_t column, double y,
                        const struct dph_image *image, double stops)
{
    struct dph_image part;
    if (!image->pixel)
        return true;
    bool ok = figure_picture(image, &sheet->crop, sheet->across, sheet->down, &part, sheet->err) &&
              put(sheet, column, y, &part, stops);
    dph_image_finish(&part);
    return ok;
}

static bool put_map(const struct sheet *sheet, size_t column, double y, const float *map)
{
    struct dph_image part;
    if (!map)
        return true;
    bool ok = figure_map(map, sheet->comparison, &sheet->crop, sheet->across, sheet->down, &part,
                         sheet->err) &&
              put(sheet, column, y, &part, 0);
    dph_image_finish(&part);
    return ok;
}

/* The colours of the error maps, below the first reference of a section. */
static bool put_legend(const struct sheet *sheet, double y)
{
    enum { STEPS = 256 };
    double x = column_left(0), width = COLUMN - 10, height = 10;
    float ramp[STEPS];
    struct dph_image colours;
    for (int i = 0; i < STEPS; i++)
        ramp[i] = (float)i / (STEPS - 1);
    y += fmax(0, (sheet->ph - 54) / 2);
    canvas_text(sheet->canvas, x, y + 8, &line_type, "FLIP error (the maps)");
    if (!dph_image_init_magma(&colours, ramp, STEPS, 1, sheet->err))
        return false;
    canvas_picture(sheet->canvas, x, y + 14, width, height, &colours, 0);
    dph_image_finish(&colours);
    for (int i = 0; i <= 4; i++) {
        char text[16];
        struct type type = tick_type;
        double at = x + width * i / 4;
        type.align = i == 0 ? ALIGN_LEFT : ALIGN_CENTRE;
        snprintf(text, sizeof text, "%.2g", i / 4.0);
        canvas_line(sheet->canvas, at, y + 14 + height, at, y + 16 + height, 0.5, GREY);
        canvas_text(sheet->canvas, at, y + 33, &type, text);
    }
    canvas_text(sheet->canvas, x, y + 45, &small_type, "0: looks the same");
    return true;
}

/* The best value of a row's fitted or other entries; NaN: none. */
static double best_of(const struct figure_column *column, size_t count, size_t light, int which,
                      bool fitted)
{
    double best = NAN;
    for (size_t i = 0; i < count; i++) {
        const struct dph_entry *entry = fitted ? column[i].fitted : column[i].plain;
        double value = entry ? figure_of(&entry->shot[light].scores, which) : NAN;
        if (isnan(best) || (!isnan(value) && figure_better(which, value, best)))
            best = value;
    }
    return best;
}

/* Figures stand in two columns, of the fitted entry and of the other; a lone one in the second. */
static double number_right(size_t column, bool second)
{
    return column_left(column) + COLUMN - (second ? 3 : 45);
}

static void put_names(const struct sheet *sheet, size_t column, double y)
{
    for (int i = 0; i < FIGURES; i++)
        canvas_text(sheet->canvas, column_left(column), y + (i + 1) * LINE, &line_type,
                    figure_name[i]);
}

static void put_scores(const struct sheet *sheet, size_t column, double y,
                       const struct dph_entry *entry, size_t light, const double best[FIGURES])
{
    char text[24];
    const struct dph_shot *shot = &entry->shot[light];
    double right = number_right(column, !entry->fitted);
    snprintf(text, sizeof text, "%s%s", shot->noisy ? "*" : "", entry->fitted ? "fitted" : "as is");
    canvas_text(sheet->canvas, right, y, &head_type, text);
    for (int i = 0; i < FIGURES; i++) {
        double value = figure_of(&shot->scores, i);
        canvas_text(sheet->canvas, right, y + (i + 1) * LINE,
                    figure_same(i, value, best[i]) ? &best_type : &number_type, figure_print(i, value, text));
    }
}

static bool put_light(const struct sheet *sheet, const struct dph_judged *judged,
                      const struct figure_column *column, size_t count, size_t light, double y)
{
    const struct dph_comparison *c = sheet->comparison;
    const struct dph_truth *truth = &judged->truth[light];
    char text[160], place[96];
    int stops = figure_stops(truth);
    double picture = y + LIGHT, map = picture + sheet->ph + BETWEEN,
           figures = map + sheet->ph + LINE;
    canvas_line(sheet->canvas, MARGIN, y + 4, sheet->width - MARGIN, y + 4, 0.5, RULE);
    snprintf(text, sizeof text, "light: %s", c->light[light].name);
    canvas_text(sheet->canvas, MARGIN, y + 17, &light_type, text);
    double x = MARGIN + canvas_text_width(sheet->canvas, &light_type, text) + 8;
    figure_print_light(&c->light[light], place);
    snprintf(text, sizeof text, stops ? "%s; pictures shown %d stop%s brighter" : "%s", place,
             stops, stops == 1 ? "" : "s");
    canvas_text(sheet->canvas, x, y + 17, &small_type, text);

    if (!put_picture(sheet, 0, picture, &truth->image, stops))
        return false;
    if (light == 0 && !put_legend(sheet, map))
        return false;
    put_names(sheet, 0, figures);
    canvas_text(sheet->canvas, number_right(0, true), figures, &head_type, "its noise");
    for (int i = 0; i < FIGURES; i++)
        canvas_text(sheet->canvas, number_right(0, true), figures + (i + 1) * LINE, &number_type,
                    figure_print(i, figure_of_noise(&truth->noise, i), text));

    double best[2][FIGURES];
    for (int i = 0; i < FIGURES; i++) {
        best[0][i] = best_of(column, count, light, i, false);
        best[1][i] = best_of(column, count, light, i, true);
    }
    for (size_t k = 0; k < count; k++) {
        const struct dph_shot *shot = &figure_shown(&column[k])->shot[light];
        if (!put_picture(sheet, k + 1, picture, &shot->image, stops) ||
            !put_map(sheet, k + 1, map, shot->flip))
            return false;
        put_names(sheet, k + 1, figures);
        if (column[k].fitted)
            put_scores(sheet, k + 1, figures, column[k].fitted, light, best[1]);
        if (column[k].plain)
            put_scores(sheet, k + 1, figures, column[k].plain, light, best[0]);
    }
    return true;
}

static void put_column_head(const struct sheet *sheet, size_t place,
                            const struct figure_column *column, double y)
{
    const struct dph_entry *entry = figure_shown(column);
    char bytes[64], bake[32], frame[32], text[160];
    double x = column_left(place);
    canvas_text_within(sheet->canvas, x, y + 11, COLUMN, &method_type, entry->method->name);
    snprintf(text, sizeof text, "%s%s%s", entry->variant,
             entry->variant[0] && entry->fitted ? ", " : "", entry->fitted ? "fitted" : "");
    canvas_text_within(sheet->canvas, x, y + 22, COLUMN, &small_type, text);
    figure_print_bytes(entry, bytes);
    figure_print_time(entry->milliseconds * 1e-3, frame);
    snprintf(text, sizeof text, "%s a vertex, %s", bytes, frame);
    canvas_text_within(sheet->canvas, x, y + 33, COLUMN, &small_type, text);
    if (entry->seconds > 0) {
        figure_print_time(entry->seconds, bake);
        snprintf(text, sizeof text, "baked in %s", bake);
        canvas_text_within(sheet->canvas, x, y + 44, COLUMN, &small_type, text);
    }
}

static bool put_section(const struct sheet *sheet, const struct dph_judged *judged, double y)
{
    const struct dph_material *m = &judged->material;
    struct figure_column *column;
    size_t count = figure_columns(judged, true, &column);
    char text[320];
    canvas_line(sheet->canvas, MARGIN, y, sheet->width - MARGIN, y, 1, INK);
    canvas_text_within(sheet->canvas, MARGIN, y + 20, sheet->width / 2, &section_type, m->name);
    double x = MARGIN + fmin(canvas_text_width(sheet->canvas, &section_type, m->name),
                             sheet->width / 2) + 10;
    snprintf(text, sizeof text,
             "scattering %.4g, %.4g, %.4g and absorption %.4g, %.4g, %.4g per mm, anisotropy %.3g",
             m->scattering[0], m->scattering[1], m->scattering[2], m->absorption[0],
             m->absorption[1], m->absorption[2], m->anisotropy);
    canvas_text_within(sheet->canvas, x, y + 20, sheet->width - MARGIN - x, &small_type, text);
    y += SECTION;
    canvas_text(sheet->canvas, column_left(0), y + 11, &method_type, "reference");
    snprintf(text, sizeof text, "%d samples a pixel", judged->samples);
    canvas_text_within(sheet->canvas, column_left(0), y + 22, COLUMN, &small_type, text);
    figure_print_time(judged->seconds_truth, text);
    strcat(text, " for all lights");
    canvas_text_within(sheet->canvas, column_left(0), y + 33, COLUMN, &small_type, text);
    for (size_t k = 0; k < count; k++)
        put_column_head(sheet, k + 1, &column[k], y);
    y += HEAD;
    bool ok = true;
    for (size_t l = 0; l < sheet->comparison->nlight && ok; l++, y += sheet->row)
        ok = put_light(sheet, judged, column, count, l, y);
    free(column);
    return ok;
}

/* What stands below everything; free() it. NULL: out of memory. */
static char *foot_text(const struct sheet *sheet, const struct figure_run *run)
{
    const struct dph_comparison *c = sheet->comparison;
    char *text = figure_caption(c, run), *whole;
    size_t room = (text ? strlen(text) : 0) + 256;
    if (!text || !(whole = malloc(room))) {
        free(text);
        return NULL;
    }
    bool noisy = false;
    for (size_t m = 0; m < c->nmaterial; m++)
        for (size_t i = 0; i < c->material[m].nentry; i++)
            for (size_t l = 0; l < c->nlight; l++)
                noisy |= c->material[m].entry[i].shot[l].noisy;
    snprintf(whole, room, "%s%s", text,
             noisy ? " * Not to be relied on, most often since the reference's noise is of the "
                     "same size: the report says why."
                   : "");
    if (sheet->nmaterial < c->nmaterial) {
        char more[64];
        snprintf(more, sizeof more, " %zu further materials are in the report.",
                 c->nmaterial - sheet->nmaterial);
        strcat(whole, more);
    }
    free(text);
    return whole;
}

bool sheet_save(const struct dph_comparison *comparison, const struct figure_run *run,
                const char *path, struct dph_error *err)
{
    struct sheet sheet = {.comparison = comparison, .err = err};
    const double leading = 13;
    bool ok = false;
    char *foot = NULL;
    for (size_t m = 0; m < comparison->nmaterial; m++) {
        struct figure_column *column;
        size_t count = figure_columns(&comparison->material[m], true, &column);
        free(column);
        sheet.ncolumn = count > sheet.ncolumn ? count : sheet.ncolumn;
    }
    sheet.crop = figure_crop(comparison);
    if (!(sheet.canvas = canvas_create(CANVAS_RASTER, 1, 1, 1, err)))
        return false;
    sheet.nmaterial = comparison->nmaterial;
    fit_page(&sheet, 100);
    if (!(foot = foot_text(&sheet, run))) {
        text_fail(err, DPH_ERROR_MEMORY, "%s: out of memory", path);
        goto error;
    }
    int lines = canvas_paragraph(sheet.canvas, 0, 0, sheet.width - 2 * MARGIN, leading,
                                 &caption_type, foot, false);
    double body = page_height(&sheet, sheet.nmaterial),
           height = ceil(body + 14 + lines * leading + MARGIN - 8);
    canvas_destroy(sheet.canvas);
    sheet.canvas = canvas_create(CANVAS_RASTER, ceil(sheet.width), height, sheet.scale, err);
    if (!sheet.canvas)
        goto error;
    char title[512];
    snprintf(title, sizeof title, "%s: every method beside the path-traced truth",
             run->model ? run->model : "Comparison");
    canvas_text_within(sheet.canvas, MARGIN, MARGIN + 10, sheet.width - 2 * MARGIN, &title_type,
                       title);
    for (size_t m = 0; m < sheet.nmaterial; m++)
        if (!put_section(&sheet, &comparison->material[m], page_height(&sheet, m)))
            goto error;
    canvas_line(sheet.canvas, MARGIN, body, sheet.width - MARGIN, body, 1, INK);
    canvas_paragraph(sheet.canvas, MARGIN, body + 14, sheet.width - 2 * MARGIN, leading,
                     &caption_type, foot, true);
    ok = canvas_save(sheet.canvas, path, err);

error:
    canvas_destroy(sheet.canvas);
    canvas_forget_fonts();
    free(foot);
    return ok;
}
