/* PNG through libpng.
 *
 * libpng reports errors by a long jump. Everything that a jump could leak, and everything that is
 * read after one, lives in the struct that the caller's frame owns, so that no automatic variable
 * changes between setjmp and the jump. Written files carry 8-bit RGB and an sRGB chunk; there is no
 * time stamp in them, so equal pictures give equal bytes. */
#include "core/fail.h"
#include "core/memory.h"
#include "image/formats.h"

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

struct reader {
    png_structp png;
    png_infop info;
    const struct dph_file *file;
    size_t at;
    const char *path;
    struct dph_image *image;
    png_bytep row;   /* one row, or for interlaced files all of them */
    png_bytep *rows; /* (height), interlaced files only              */
    char message[128];
    bool told; /* `err` is filled already                      */
};

static void on_error(png_structp png, png_const_charp message)
{
    char *copy = png_get_error_ptr(png);
    if (copy) {
        strncpy(copy, message, 127);
        copy[127] = 0;
    }
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
    (void)png;
    (void)message;
}

static void read_bytes(png_structp png, png_bytep data, size_t size)
{
    struct reader *r = png_get_io_ptr(png);
    if (size > r->file->size - r->at)
        png_error(png, "the file ends early");
    memcpy(data, r->file->data + r->at, size);
    r->at += size;
}

/* One row of 16-bit RGBA (big-endian, as PNG has it) or 8-bit RGBA to linear floats. */
static void store_row(const struct reader *r, size_t y, const png_byte *row, int depth,
                      const float *decode)
{
    size_t count = (size_t)r->image->width * 4;
    float *out = r->image->pixel + y * count;
    for (size_t i = 0; i < count; i++) {
        bool alpha = i % 4 == 3;
        if (depth == 16) {
            double value = (row[2 * i] * 256 + row[2 * i + 1]) / 65535.0;
            out[i] = (float)(alpha ? value : dph_srgb_decode(value));
        } else {
            out[i] = alpha ? (float)row[i] / 255 : decode[row[i]];
        }
    }
}

/* Everything between setjmp and the end of reading; may jump. */
static void read_pixels(struct reader *r, struct dph_error *err)
{
    png_structp png = r->png;
    png_set_user_limits(png, 32768, 32768);
    png_set_read_fn(png, r, read_bytes);
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_WARN_DISCARD);
    png_read_info(png, r->info);
    png_uint_32 width = png_get_image_width(png, r->info),
                height = png_get_image_height(png, r->info);
    if (!dph_image_check_claim(r->path, "IHDR", width, height, png_get_rowbytes(png, r->info),
                               r->file->size, err)) {
        r->told = true;
        return;
    }
    png_set_expand(png); /* palettes, small grey depths and transparent colours */
    png_set_gray_to_rgb(png);
    int depth = png_get_bit_depth(png, r->info) == 16 ? 16 : 8;
    png_set_add_alpha(png, depth == 16 ? 65535 : 255, PNG_FILLER_AFTER);
    int passes = png_set_interlace_handling(png);
    png_read_update_info(png, r->info);
    size_t bytes = png_get_rowbytes(png, r->info);
    if (bytes != (size_t)width * 4 * (size_t)depth / 8)
        png_error(png, "a colour type that is not known");
    if (!dph_image_init(r->image, (int)width, (int)height, err) ||
        !(r->row = dph_alloc_zero(passes > 1 ? height : 1, bytes)) ||
        (passes > 1 && !(r->rows = dph_alloc(height, sizeof *r->rows)))) {
        dph_fail_memory(err);
        r->told = true;
        return;
    }
    float decode[256];
    for (int i = 0; i < 256; i++)
        decode[i] = (float)dph_srgb_decode(i / 255.0);
    if (passes > 1) {
        for (size_t y = 0; y < height; y++)
            r->rows[y] = r->row + y * bytes;
        png_read_image(png, r->rows);
        for (size_t y = 0; y < height; y++)
            store_row(r, y, r->rows[y], depth, decode);
    } else {
        for (size_t y = 0; y < height; y++) {
            png_read_row(png, r->row, NULL);
            store_row(r, y, r->row, depth, decode);
        }
    }
    png_read_end(png, NULL);
}

bool dph_read_png(struct dph_image *image, const struct dph_file *file, const char *path,
                  struct dph_error *err)
{
    struct reader *r = calloc(1, sizeof *r); /* on the heap: a long jump leaves it as it was */
    if (!r)
        return dph_fail_memory(err);
    r->file = file;
    r->path = path;
    r->image = image;
    *image = (struct dph_image){0};
    r->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, r->message, on_error, on_warning);
    r->info = r->png ? png_create_info_struct(r->png) : NULL;
    if (!r->info) {
        dph_fail_memory(err);
        r->told = true;
    } else if (setjmp(png_jmpbuf(r->png))) {
        dph_fail(err, DPH_ERROR_INPUT, "%s: byte %zu: %s", path, r->at, r->message);
        r->told = true;
    } else {
        read_pixels(r, err);
    }
    bool ok = !r->told;
    png_destroy_read_struct(&r->png, &r->info, NULL);
    if (!ok)
        dph_image_finish(image);
    free(r->rows);
    free(r->row);
    free(r);
    return ok;
}

struct writer {
    png_structp png;
    png_infop info;
    png_bytep row;
    png_bytep data; /* (capacity) the file so far, of `size` bytes */
    size_t size, capacity;
    char message[128];
};

static void write_bytes(png_structp png, png_bytep data, size_t size)
{
    struct writer *w = png_get_io_ptr(png);
    if (size > w->capacity - w->size) {
        size_t wanted = w->capacity + w->capacity / 2 + size + 4096;
        png_bytep grown = wanted > size ? realloc(w->data, wanted) : NULL;
        if (!grown)
            png_error(png, "out of memory");
        w->data = grown;
        w->capacity = wanted;
    }
    memcpy(w->data + w->size, data, size);
    w->size += size;
}

static void flush_bytes(png_structp png)
{
    (void)png;
}

/* The 8-bit code of a value is the number of these bounds that it reaches: the same result as
 * rounding 255 times the encoded value, at the cost of eight comparisons. */
static void code_bounds(bool linear, double *bound /* (255) */)
{
    for (int i = 0; i < 255; i++)
        bound[i] = linear ? (i + 0.5) / 255 : dph_srgb_decode((i + 0.5) / 255);
}

static png_byte code_of(const double *bound, double value)
{
    int code = 0;
    for (int step = 128; step; step /= 2)
        if (code + step <= 255 && value >= bound[code + step - 1])
            code += step;
    return (png_byte)code;
}

/* May jump. */
static void write_pixels(struct writer *w, const struct dph_image *image,
                         const struct dph_tone *tone)
{
    png_structp png = w->png;
    png_uint_32 width = (png_uint_32)image->width, height = (png_uint_32)image->height;
    bool linear = tone && tone->linear;
    double gain = tone ? exp2(tone->exposure) : 1, bound[255];
    code_bounds(linear, bound);
    png_set_user_limits(png, 32768, 32768);
    png_set_write_fn(png, w, write_bytes, flush_bytes);
    png_set_IHDR(png, w->info, width, height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (!linear) /* numbers without a curve are no sRGB picture, and must not say that they are */
        png_set_sRGB(png, w->info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_compression_level(png, 6);
    png_write_info(png, w->info);
    for (size_t y = 0; y < height; y++) {
        const float *pixel = image->pixel + y * width * 4;
        for (size_t x = 0; x < width; x++)
            for (int c = 0; c < 3; c++)
                w->row[3 * x + (size_t)c] = code_of(bound, pixel[4 * x + (size_t)c] * gain);
        png_write_row(png, w->row);
    }
    png_write_end(png, NULL);
}

bool dph_image_encode_png(const struct dph_image *image, const struct dph_tone *tone,
                          unsigned char **data, size_t *size, struct dph_error *err)
{
    struct writer *w = calloc(1, sizeof *w);
    if (!w)
        return dph_fail_memory(err);
    w->png = png_create_write_struct(PNG_LIBPNG_VER_STRING, w->message, on_error, on_warning);
    w->info = w->png ? png_create_info_struct(w->png) : NULL;
    w->row = dph_alloc((size_t)image->width, 3);
    bool ok = false;
    if (w->info && w->row && !setjmp(png_jmpbuf(w->png))) {
        write_pixels(w, image, tone);
        ok = true;
    }
    png_destroy_write_struct(&w->png, &w->info);
    if (ok) {
        *data = w->data;
        *size = w->size;
    } else { /* a picture of a legal size is refused for want of memory alone */
        free(w->data);
        dph_fail_memory(err);
    }
    free(w->row);
    free(w);
    return ok;
}

bool dph_write_png(const struct dph_image *image, const char *path, const struct dph_tone *tone,
                   struct dph_error *err)
{
    unsigned char *data;
    size_t size;
    struct dph_output *out = dph_output_open(path, err); /* before the work: it may be refused */
    if (!out)
        return false;
    if (!dph_image_encode_png(image, tone, &data, &size, err)) {
        dph_output_abandon(out);
        return false;
    }
    dph_output_write(out, data, size);
    free(data);
    return dph_output_close(out, err);
}
