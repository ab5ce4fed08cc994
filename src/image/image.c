/* Pictures in memory, the one output transform, and the choice of a file format.
 *
 * The transfer function is the one of IEC 61966-2-1:1999 (sRGB): linear below 0.0031308, else 1.055
 * x^(1/2.4) - 0.055. */
#include <diaphan/image.h>

#include "core/fail.h"
#include "core/memory.h"
#include "image/formats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define MAX_SIDE 32768

bool dph_image_init(struct dph_image *image, int width, int height, struct dph_error *err)
{
    *image = (struct dph_image){0};
    if (width < 1 || height < 1 || width > MAX_SIDE || height > MAX_SIDE)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a picture of %d x %d pixels: sides are 1 to %d",
                        width, height, MAX_SIDE);
    image->pixel = dph_alloc_zero((size_t)width * (size_t)height, 4 * sizeof *image->pixel);
    if (!image->pixel)
        return dph_fail_memory(err);
    image->width = width;
    image->height = height;
    return true;
}

void dph_image_finish(struct dph_image *image)
{
    free(image->pixel);
    *image = (struct dph_image){0};
}

double dph_srgb_encode(double linear)
{
    if (!(linear > 0)) /* NaN included */
        return 0;
    if (linear >= 1)
        return 1;
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

double dph_srgb_decode(double encoded)
{
    if (!(encoded > 0))
        return 0;
    if (encoded >= 1)
        return 1;
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

bool dph_image_check_claim(const char *path, const char *place, int64_t width, int64_t height,
                           size_t row_bytes, size_t file_size, struct dph_error *err)
{
    if (width < 1 || height < 1)
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s: a picture of %lld x %lld pixels", path,
                        place, (long long)width, (long long)height);
    if (width > MAX_SIDE || height > MAX_SIDE ||
        (size_t)width * (size_t)height > DPH_IMAGE_MAX_PIXELS)
        return dph_fail(
            err, DPH_ERROR_LIMIT,
            "%s: %s: a picture of %lld x %lld pixels; sides of %d and %zu pixels are read", path,
            place, (long long)width, (long long)height, MAX_SIDE, DPH_IMAGE_MAX_PIXELS);
    if (row_bytes / 1032 * (size_t)height > file_size)
        return dph_fail(err, DPH_ERROR_INPUT,
                        "%s: %s: %lld x %lld pixels cannot be in a file of %zu bytes", path, place,
                        (long long)width, (long long)height, file_size);
    return true;
}

static const char *ending_of(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && !strchr(dot, '/') ? dot : "";
}

bool dph_image_save(const struct dph_image *image, const char *path, const struct dph_tone *tone,
                    struct dph_error *err)
{
    const char *ending = ending_of(path);
    if (!strcasecmp(ending, ".png"))
        return dph_write_png(image, path, tone, err);
    if (!strcasecmp(ending, ".exr"))
        return dph_write_exr(image, NULL, 0, path, err);
    return dph_fail(err, DPH_ERROR_ARGUMENT, "%s: pictures are written as .png or .exr", path);
}

bool dph_image_save_channels(const struct dph_image *image, const struct dph_channel *channel,
                             int nchannel, const char *path, struct dph_error *err)
{
    if (strcasecmp(ending_of(path), ".exr"))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%s: further channels are written to .exr", path);
    return dph_write_exr(image, channel, nchannel, path, err);
}

bool dph_image_load(struct dph_image *image, const char *path, struct dph_error *err)
{
    *image = (struct dph_image){0};
    struct dph_file file;
    if (!dph_file_load(&file, path, DPH_IMAGE_MAX_FILE, err))
        return false;
    bool ok = false;
    if (file.size >= 8 && !memcmp(file.data, "\x89PNG\r\n\x1a\n", 8))
        ok = dph_read_png(image, &file, path, err);
    else if (file.size >= 4 && !memcmp(file.data, "\x76\x2f\x31\x01", 4))
        ok = dph_read_exr(image, &file, path, err);
    else if (file.size >= 3 && (!memcmp(file.data, "#?R", 3) || !memcmp(file.data, "#?r", 3)))
        ok = dph_read_hdr(image, &file, path, err);
    else
        dph_fail(err, DPH_ERROR_INPUT, "%s: byte 0: neither a PNG nor an EXR nor a Radiance file", path);
    dph_file_finish(&file);
    return ok;
}
