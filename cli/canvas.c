/* The page, drawn with cairo.
 *
 * Fonts are neither hinted nor fitted to pixels, so that a chart has the same line breaks as SVG
 * and as pixels. An SVG carries the outlines of its glyphs and needs no font where it is shown.
 * Pixels go through the project's PNG writer: sRGB bytes to linear and back are the same bytes. */
#include "canvas.h"

#include "text.h"

#include <diaphan/file.h>

#include <cairo-svg.h>
#include <cairo.h>
#include <fontconfig/fontconfig.h>

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SIDE = 32000, MAX_TEXT = 4096 };

struct canvas {
    enum canvas_kind kind;
    cairo_surface_t *surface;
    cairo_t *cairo;
    bool failed; /* out of memory somewhere on the way */
    unsigned char *data; /* (capacity) the SVG so far, of `size` bytes */
    size_t size, capacity;
};

static cairo_status_t append(void *user, const unsigned char *data, unsigned length)
{
    struct canvas *canvas = user;
    if (length > canvas->capacity - canvas->size) {
        size_t wanted = canvas->capacity * 2 + length + 4096;
        unsigned char *grown = realloc(canvas->data, wanted);
        if (!grown)
            return CAIRO_STATUS_NO_MEMORY;
        canvas->data = grown;
        canvas->capacity = wanted;
    }
    memcpy(canvas->data + canvas->size, data, length);
    canvas->size += length;
    return CAIRO_STATUS_SUCCESS;
}

struct canvas *canvas_create(enum canvas_kind kind, double width, double height, double scale,
                             struct dph_error *err)
{
    struct canvas *canvas = NULL;
    if (!(width > 0 && height > 0 && scale > 0) || width * scale > MAX_SIDE ||
        height * scale > MAX_SIDE) {
        text_fail(err, DPH_ERROR_ARGUMENT, "a page of %.0f x %.0f pixels: sides are 1 to %d",
                  width * scale, height * scale, MAX_SIDE);
        return NULL;
    }
    if (!(canvas = calloc(1, sizeof *canvas)))
        goto error;
    canvas->kind = kind;
    if (kind == CANVAS_SVG)
        canvas->surface = cairo_svg_surface_create_for_stream(append, canvas, width, height);
    else
        canvas->surface = cairo_image_surface_create(
            CAIRO_FORMAT_RGB24, (int)ceil(width * scale), (int)ceil(height * scale));
    canvas->cairo = cairo_create(canvas->surface);
    if (cairo_status(canvas->cairo))
        goto error;
    if (kind == CANVAS_RASTER)
        cairo_scale(canvas->cairo, scale, scale);
    cairo_font_options_t *options = cairo_font_options_create();
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_set_font_options(canvas->cairo, options);
    cairo_font_options_destroy(options);
    canvas_rectangle(canvas, 0, 0, width, height, 0xffffff);
    return canvas;

error:
    text_fail(err, DPH_ERROR_MEMORY, "out of memory for a page of %.0f x %.0f", width, height);
    canvas_destroy(canvas);
    return NULL;
}

void canvas_destroy(struct canvas *canvas)
{
    if (!canvas)
        return;
    if (canvas->cairo)
        cairo_destroy(canvas->cairo);
    if (canvas->surface)
        cairo_surface_destroy(canvas->surface); /* an SVG's end is written here, to `data` */
    free(canvas->data);
    free(canvas);
}

void canvas_forget_fonts(void)
{
    cairo_debug_reset_static_data();
    FcFini();
}

static void set_colour(struct canvas *canvas, unsigned colour)
{
    cairo_set_source_rgb(canvas->cairo, (colour >> 16 & 255) / 255.0, (colour >> 8 & 255) / 255.0,
                         (colour & 255) / 255.0);
}

void canvas_rectangle(struct canvas *canvas, double x, double y, double width, double height,
                      unsigned colour)
{
    set_colour(canvas, colour);
    cairo_rectangle(canvas->cairo, x, y, width, height);
    cairo_fill(canvas->cairo);
}

void canvas_frame(struct canvas *canvas, double x, double y, double width, double height,
                  double line, unsigned colour)
{
    set_colour(canvas, colour);
    cairo_set_line_width(canvas->cairo, line);
    cairo_rectangle(canvas->cairo, x + line / 2, y + line / 2, width - line, height - line);
    cairo_stroke(canvas->cairo);
}

void canvas_line(struct canvas *canvas, double x0, double y0, double x1, double y1, double line,
                 unsigned colour)
{
    set_colour(canvas, colour);
    cairo_set_line_width(canvas->cairo, line);
    cairo_move_to(canvas->cairo, x0, y0);
    cairo_line_to(canvas->cairo, x1, y1);
    cairo_stroke(canvas->cairo);
}

static void set_type(struct canvas *canvas, const struct type *type)
{
    cairo_select_font_face(canvas->cairo, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                           type->bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(canvas->cairo, type->size);
}

/* Of a text that is clean. */
static double advance(struct canvas *canvas, const char *text)
{
    cairo_text_extents_t extents = {0};
    cairo_text_extents(canvas->cairo, text, &extents);
    return extents.x_advance;
}

/* A clean copy of at most MAX_TEXT bytes; NULL: out of memory, which is remembered. */
static char *clean_text(struct canvas *canvas, const char *text)
{
    char *clean = text_clean(text);
    if (!clean)
        canvas->failed = true;
    else if (strlen(clean) > MAX_TEXT) {
        size_t end = MAX_TEXT;
        while (end && ((unsigned char)clean[end] & 0xc0) == 0x80)
            end--;
        clean[end] = 0;
    }
    return clean;
}

static void show(struct canvas *canvas, double x, double y, const struct type *type,
                 const char *clean)
{
    if (type->align != ALIGN_LEFT)
        x -= advance(canvas, clean) * (type->align == ALIGN_CENTRE ? 0.5 : 1);
    set_colour(canvas, type->colour);
    cairo_move_to(canvas->cairo, x, y);
    cairo_show_text(canvas->cairo, clean);
}

void canvas_text(struct canvas *canvas, double x, double y, const struct type *type,
                 const char *text)
{
    canvas_text_within(canvas, x, y, INFINITY, type, text);
}

double canvas_text_width(struct canvas *canvas, const struct type *type, const char *text)
{
    char *clean = clean_text(canvas, text);
    if (!clean)
        return 0;
    set_type(canvas, type);
    double width = advance(canvas, clean);
    free(clean);
    return width;
}

/* Takes the characters [*left, right) apart: `text` becomes its first `left` and its last `right`
 * characters around an ellipsis, in `out` (MAX_TEXT + 8). */
static void join(const char *text, size_t left, size_t right, char *out)
{
    size_t length = strlen(text), head = 0, tail = length;
    for (; left && head < length; left--)
        for (head++; ((unsigned char)text[head] & 0xc0) == 0x80;)
            head++;
    for (; right && tail > head; right--)
        for (tail--; tail > head && ((unsigned char)text[tail] & 0xc0) == 0x80;)
            tail--;
    memcpy(out, text, head);
    memcpy(out + head, "\xe2\x80\xa6", 3);
    memcpy(out + head + 3, text + tail, length - tail + 1);
}

void canvas_text_within(struct canvas *canvas, double x, double y, double width,
                        const struct type *type, const char *text)
{
    char *clean = clean_text(canvas, text), shorter[MAX_TEXT + 8];
    if (!clean)
        return;
    set_type(canvas, type);
    if (advance(canvas, clean) <= width) {
        show(canvas, x, y, type, clean);
    } else { /* the most characters that fit, by halving */
        size_t low = 0, high = strlen(clean);
        while (high - low > 1) {
            size_t middle = (low + high) / 2;
            join(clean, (middle + 1) / 2, middle / 2, shorter);
            if (advance(canvas, shorter) <= width)
                low = middle;
            else
                high = middle;
        }
        join(clean, (low + 1) / 2, low / 2, shorter);
        show(canvas, x, y, type, shorter);
    }
    free(clean);
}

int canvas_paragraph(struct canvas *canvas, double x, double y, double width, double leading,
                     const struct type *type, const char *text, bool draw)
{
    char *clean = clean_text(canvas, text);
    int lines = 0;
    if (!clean)
        return 0;
    set_type(canvas, type);
    for (char *line = clean; *line; lines++) {
        char *end = line + strlen(line), *next = end;
        /* words are added while they fit; a word wider than the page stays whole, shortened below */
        for (char *c = line, *good = NULL;; c++) {
            if (*c && *c != ' ')
                continue;
            char kept = *c;
            *c = 0;
            bool fits = advance(canvas, line) <= width;
            *c = kept;
            if (!fits && good) {
                end = good;
                next = good + 1;
                break;
            }
            good = c;
            if (!fits || !*c) {
                end = c;
                next = *c ? c + 1 : c;
                break;
            }
        }
        char kept = *end;
        *end = 0;
        if (draw)
            canvas_text_within(canvas, x, y + lines * leading, width, type, line);
        *end = kept;
        line = next;
    }
    free(clean);
    return lines;
}

void canvas_picture(struct canvas *canvas, double x, double y, double width, double height,
                    const struct dph_image *image, double exposure)
{
    cairo_surface_t *surface =
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, image->width, image->height);
    unsigned char *data = cairo_image_surface_get_data(surface);
    if (!data) {
        canvas->failed = true;
        cairo_surface_destroy(surface);
        return;
    }
    int stride = cairo_image_surface_get_stride(surface);
    double gain = exp2(exposure);
    for (int row = 0; row < image->height; row++) {
        const float *from = image->pixel + (size_t)row * (size_t)image->width * 4;
        for (int column = 0; column < image->width; column++) {
            uint32_t colour = 0;
            for (int c = 0; c < 3; c++) {
                double value = dph_srgb_encode(from[4 * column + c] * gain);
                colour = colour << 8 | (uint32_t)lrint(255 * value);
            }
            memcpy(data + (size_t)row * (size_t)stride + 4 * (size_t)column, &colour, 4);
        }
    }
    cairo_surface_mark_dirty(surface);
    cairo_save(canvas->cairo);
    cairo_translate(canvas->cairo, x, y);
    cairo_scale(canvas->cairo, width / image->width, height / image->height);
    cairo_set_source_surface(canvas->cairo, surface, 0, 0);
    cairo_pattern_set_filter(cairo_get_source(canvas->cairo), CAIRO_FILTER_NEAREST);
    cairo_rectangle(canvas->cairo, 0, 0, image->width, image->height);
    cairo_fill(canvas->cairo);
    cairo_restore(canvas->cairo);
    cairo_surface_destroy(surface);
}

/* The raster page as the image that its PNG is written from. */
static bool to_image(struct canvas *canvas, struct dph_image *image, struct dph_error *err)
{
    cairo_surface_flush(canvas->surface);
    int width = cairo_image_surface_get_width(canvas->surface),
        height = cairo_image_surface_get_height(canvas->surface),
        stride = cairo_image_surface_get_stride(canvas->surface);
    const unsigned char *data = cairo_image_surface_get_data(canvas->surface);
    float decode[256];
    if (!dph_image_init(image, width, height, err))
        return false;
    for (int i = 0; i < 256; i++)
        decode[i] = (float)dph_srgb_decode(i / 255.0);
    float *to = image->pixel;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++, to += 4) {
            uint32_t colour;
            memcpy(&colour, data + (size_t)y * (size_t)stride + 4 * (size_t)x, 4);
            for (int c = 0; c < 3; c++)
                to[c] = decode[colour >> (16 - 8 * c) & 255];
            to[3] = 1;
        }
    return true;
}

/* cairo names the page after a count of all surfaces that the process has had; nothing refers to
 * that name, and equal pages should have equal bytes. Returns the size without it. Nothing but
 * cairo's own text comes before it, and letters are outlines: it cannot be a user's. */
static size_t drop_number(unsigned char *data, size_t size)
{
    static const char name[] = " id=\"surface";
    size_t length = sizeof name - 1;
    for (size_t i = 0; i + length < size; i++) {
        if (memcmp(data + i, name, length) != 0)
            continue;
        size_t end = i + length;
        while (end < size && data[end] != '"')
            end++;
        end += end < size;
        memmove(data + i, data + end, size - end);
        return size - (end - i);
    }
    return size;
}

bool canvas_save(struct canvas *canvas, const char *path, struct dph_error *err)
{
    cairo_status_t status = cairo_status(canvas->cairo);
    if (canvas->failed || status)
        return text_fail(err, DPH_ERROR_MEMORY, "%s: could not be drawn: %s", path,
                         canvas->failed ? "out of memory" : cairo_status_to_string(status));
    if (canvas->kind == CANVAS_RASTER) {
        struct dph_image image;
        struct dph_tone tone = {0};
        if (!to_image(canvas, &image, err))
            return false;
        bool ok = dph_image_save(&image, path, &tone, err);
        dph_image_finish(&image);
        return ok;
    }
    cairo_surface_finish(canvas->surface);
    status = cairo_surface_status(canvas->surface);
    if (status)
        return text_fail(err, DPH_ERROR_MEMORY, "%s: could not be drawn: %s", path,
                         cairo_status_to_string(status));
    size_t size = drop_number(canvas->data, canvas->size);
    return dph_file_save(path, canvas->data, size, err);
}
