/* What every presentation of a comparison needs. */
#define _POSIX_C_SOURCE 200809L
#include "figure.h"

#include "text.h"

#include <diaphan/metrics.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const figure_name[FIGURES] = {"RMSE", "PSNR", "SSIM", "FLIP"};

const struct dph_entry *figure_shown(const struct figure_column *column)
{
    return column->fitted ? column->fitted : column->plain;
}

size_t figure_columns(const struct dph_judged *judged, bool shown, struct figure_column **column)
{
    size_t count = 0;
    *column = judged->nentry ? calloc(judged->nentry, sizeof **column) : NULL;
    for (size_t i = 0; i < judged->nentry && *column; i++) {
        const struct dph_entry *entry = &judged->entry[i];
        if (entry->shown != shown)
            continue;
        struct figure_column *last = count ? &(*column)[count - 1] : NULL;
        const struct dph_entry *plain = last ? last->plain : NULL;
        if (entry->fitted && plain && !last->fitted && plain->method == entry->method &&
            strcmp(plain->variant, entry->variant) == 0)
            last->fitted = entry;
        else if (entry->fitted)
            (*column)[count++].fitted = entry;
        else
            (*column)[count++].plain = entry;
    }
    return count;
}

struct figure_crop figure_crop(const struct dph_comparison *c)
{
    int left = c->width, right = -1, top = c->height, bottom = -1;
    for (size_t m = 0; m < c->nmaterial; m++)
        for (size_t l = 0; l < c->nlight; l++) {
            const uint8_t *mask = c->material[m].truth[l].mask;
            for (int y = 0; y < c->height; y++)
                for (int x = 0; x < c->width; x++)
                    if (mask[(size_t)y * (size_t)c->width + (size_t)x]) {
                        left = x < left ? x : left;
                        right = x > right ? x : right;
                        top = y < top ? y : top;
                        bottom = y > bottom ? y : bottom;
                    }
        }
    if (right < 0) /* no object in any picture: all of it */
        return (struct figure_crop){0, 0, c->width, c->height};
    int side = right - left > bottom - top ? right - left : bottom - top, air = 2 + side / 25;
    left = left - air < 0 ? 0 : left - air;
    top = top - air < 0 ? 0 : top - air;
    right = right + air >= c->width ? c->width - 1 : right + air;
    bottom = bottom + air >= c->height ? c->height - 1 : bottom + air;
    return (struct figure_crop){left, top, right - left + 1, bottom - top + 1};
}

/* The luminance that one pixel of the object in fifty exceeds should be about a quarter, half of
 * what a screen's middle grey is to the eye. A histogram by stops finds it. */
int figure_stops(const struct dph_truth *truth)
{
    enum { STOPS = 9 };
    size_t above[STOPS + 1] = {0}; /* pixels brighter than 0.25 / 2^i */
    size_t count = (size_t)truth->image.width * (size_t)truth->image.height;
    for (size_t i = 0; i < count; i++) {
        const float *p = truth->image.pixel + 4 * i;
        double value = 0.2126 * (double)p[0] + 0.7152 * (double)p[1] + 0.0722 * (double)p[2];
        if (truth->mask[i])
            for (int s = 0; s <= STOPS; s++)
                above[s] += value > 0.25 / (1 << s);
    }
    for (int s = 0; s < STOPS; s++)
        if (above[s] * 50 >= truth->pixels)
            return s;
    return STOPS;
}

/* One row or column of the smaller or larger picture takes [from, to) of the other one. */
static void span(int i, int count, int size, double *from, double *to)
{
    *from = (double)i * size / count;
    *to = (double)(i + 1) * size / count;
    if (count >= size) { /* repeated, not blended */
        *from = floor(((double)i + 0.5) * size / count);
        *to = *from + 1;
    }
}

bool figure_picture(const struct dph_image *image, const struct figure_crop *crop, int width,
                    int height, struct dph_image *out, struct dph_error *err)
{
    if (!dph_image_init(out, width, height, err))
        return false;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double x0, x1, y0, y1, sum[4] = {0}, area = 0;
            span(x, width, crop->width, &x0, &x1);
            span(y, height, crop->height, &y0, &y1);
            for (int v = (int)y0; v < y1 && v < crop->height; v++)
                for (int u = (int)x0; u < x1 && u < crop->width; u++) {
                    double share = (fmin(u + 1, x1) - fmax(u, x0)) *
                                   (fmin(v + 1, y1) - fmax(v, y0));
                    const float *p = image->pixel + 4 * ((size_t)(crop->y + v) *
                                                             (size_t)image->width +
                                                         (size_t)(crop->x + u));
                    for (int c = 0; c < 4; c++) /* what is no number is black, as in a PNG */
                        sum[c] += isfinite(p[c]) ? share * (double)p[c] : 0;
                    area += share;
                }
            float *to = out->pixel + 4 * ((size_t)y * (size_t)width + (size_t)x);
            for (int c = 0; c < 4; c++)
                to[c] = area > 0 ? (float)(sum[c] / area) : 0;
        }
    return true;
}

/* Steps too small to be seen: a map is half as large as a PNG with them. */
#define STEPS_OF_MAP 128.0F

bool figure_map(const float *map, const struct dph_comparison *comparison,
                const struct figure_crop *crop, int width, int height, struct dph_image *out,
                struct dph_error *err)
{
    struct dph_image whole;
    size_t count = (size_t)comparison->width * (size_t)comparison->height;
    float *steps = malloc(count * sizeof *steps);
    if (!steps)
        return text_fail(err, DPH_ERROR_MEMORY, "out of memory");
    for (size_t i = 0; i < count; i++)
        steps[i] = roundf(map[i] * STEPS_OF_MAP) / STEPS_OF_MAP;
    bool ok = dph_image_init_magma(&whole, steps, comparison->width, comparison->height, err);
    free(steps);
    if (!ok)
        return false;
    ok = figure_picture(&whole, crop, width, height, out, err);
    dph_image_finish(&whole);
    return ok;
}

double figure_of(const struct dph_scores *scores, int which)
{
    return which == FIGURE_RMSE   ? scores->rmse
           : which == FIGURE_PSNR ? scores->psnr
           : which == FIGURE_SSIM ? scores->ssim
                                  : scores->flip;
}

double figure_of_noise(const struct dph_noise *noise, int which)
{
    return which == FIGURE_RMSE   ? noise->rmse
           : which == FIGURE_PSNR ? noise->psnr
           : which == FIGURE_SSIM ? noise->ssim
                                  : noise->flip;
}

bool figure_better(int which, double a, double b)
{
    return which == FIGURE_PSNR || which == FIGURE_SSIM ? a > b : a < b;
}

const char *figure_print(int which, double value, char out[24])
{
    if (isnan(value))
        return "\xe2\x80\x93";
    if (isinf(value))
        return value > 0 ? "\xe2\x88\x9e" : "\xe2\x88\x92\xe2\x88\x9e";
    snprintf(out, 24, "%.*f", which == FIGURE_PSNR ? 1 : 3, value);
    return out;
}

bool figure_same(int which, double a, double b)
{
    char first[24], second[24];
    return !isnan(a) && strcmp(figure_print(which, a, first), figure_print(which, b, second)) == 0;
}

void figure_print_light(const struct dph_judge_light *light, char out[96])
{
    double azimuth = fmod(light->azimuth, 360);
    snprintf(out, 96, "azimuth %.4g\xc2\xb0, elevation %.4g\xc2\xb0", azimuth, light->elevation);
}

void figure_print_bytes(const struct dph_entry *entry, char out[64])
{
    if (entry->bytes_per_vertex > 0)
        snprintf(out, 64, "%.4g B", entry->bytes_per_vertex);
    else
        snprintf(out, 64, "0 B");
}

void figure_print_time(double seconds, char out[32])
{
    const char *unit = "s";
    double value = seconds;
    if (!isfinite(seconds) || seconds < 0) {
        snprintf(out, 32, "\xe2\x80\x93");
        return;
    }
    if (seconds < 0.9995) {
        unit = "ms";
        value = seconds * 1e3;
    }
    snprintf(out, 32, "%.*f %s", value < 9.995 ? 2 : value < 99.95 ? 1 : 0, value, unit);
}

char *figure_caption(const struct dph_comparison *c, const struct figure_run *run)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    fprintf(out,
            "%s, %zu triangles, largest side %.4g mm; camera at azimuth %.4g\xc2\xb0, elevation "
            "%.4g\xc2\xb0, %.4g radii away, %.4g\xc2\xb0 high; %d \xc3\x97 %d pixels, the object "
            "cut out. ",
            run->model ? run->model : "model", c->triangles, c->size_mm, c->camera.azimuth,
            c->camera.elevation, c->camera.distance, c->camera.fov, c->width, c->height);
    fprintf(out, "Reference: path traced, %s boundary, %d samples a pixel, seed %llu; ",
            c->boundary == DPH_BOUNDARY_DIELECTRIC ? "dielectric" : "index-matched", c->samples,
            (unsigned long long)c->seed);
    if (c->light_angle > 0)
        fprintf(out, "lights are discs of %.4g\xc2\xb0 half-angle. ", c->light_angle);
    else
        fprintf(out, "lights are points of the sky. ");
    fprintf(out,
            "RMSE: RMS error over RMS truth, linear luminance; PSNR in dB, SSIM and FLIP (67 pixels "
            "a degree) of the sRGB pictures; all over the object's pixels. Fitted: the method's "
            "free numbers set on training lights that are not shown. Noise: what the reference's "
            "own noise does to the figures. The best figures of a light are bold. Drawn by %s; times are of "
            "a frame under one light.",
            c->renderer[0] ? c->renderer : "an unnamed renderer");
    if (fclose(out)) {
        free(text);
        return NULL;
    }
    return text;
}
