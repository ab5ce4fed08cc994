/* Radiance RGBE pictures (G. Ward, "Real pixels", Graphics Gems II, 1991), reading only.
 *
 * A header of text lines ends with an empty one and a line of the size, "-Y height +X width".
 * Pixels are three mantissas and a common exponent, value = (m + 1/2) 2^(e - 136), 0 where e is
 * 0. A scan line begins with 2, 2 and its width where its four components are run-length coded
 * one by one; else it holds plain pixels, among them 1, 1, 1, n for n repetitions of the last
 * one. Values are divided by the EXPOSURE lines, which say what they have been multiplied by. */
#include "core/fail.h"
#include "core/memory.h"
#include "image/formats.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct reader {
    const unsigned char *data;
    size_t size, at;
    const char *path;
    struct dph_error *err;
};

static bool bad(const struct reader *r, const char *what)
{
    return dph_fail(r->err, DPH_ERROR_INPUT, "%s: byte %zu: %s", r->path, r->at, what);
}

/* The next line without its end, cut to the buffer. False at the end of the file. */
static bool read_line(struct reader *r, char *line, size_t room)
{
    size_t length = 0;
    if (r->at >= r->size)
        return false;
    while (r->at < r->size && r->data[r->at] != '\n') {
        if (length + 1 < room)
            line[length++] = (char)r->data[r->at];
        r->at++;
    }
    r->at++;
    if (length && line[length - 1] == '\r')
        length--;
    line[length] = 0;
    return true;
}

static bool read_header(struct reader *r, int *width, int *height, bool *upward, bool *leftward,
                        double *exposure)
{
    char line[256], y[3], x[3];
    long h, w;
    int used = 0;
    *exposure = 1;
    while (read_line(r, line, sizeof line) && line[0]) {
        if (!strncmp(line, "FORMAT=", 7) && strcmp(line + 7, "32-bit_rle_rgbe"))
            return dph_fail(r->err, DPH_ERROR_UNSUPPORTED, "%s: byte %zu: the format is %.60s, 32-bit_rle_rgbe is read",
                            r->path, r->at, line + 7);
        if (!strncmp(line, "EXPOSURE=", 9)) {
            char *end;
            double value = strtod(line + 9, &end);
            if (end == line + 9 || !(value > 1e-30 && value < 1e30))
                return bad(r, "an exposure that is no positive number");
            *exposure *= value;
        }
    }
    if (!read_line(r, line, sizeof line) ||
        sscanf(line, "%2s %9ld %2s %9ld%n", y, &h, x, &w, &used) != 4 || line[used])
        return bad(r, "no size such as '-Y 512 +X 1024'");
    if (y[1] == 'X' && x[1] == 'Y')
        return dph_fail(r->err, DPH_ERROR_UNSUPPORTED, "%s: byte %zu: pictures stored by columns are not read", r->path,
                        r->at);
    if ((strcmp(y, "-Y") && strcmp(y, "+Y")) || (strcmp(x, "-X") && strcmp(x, "+X")))
        return bad(r, "no size such as '-Y 512 +X 1024'");
    *upward = y[0] == '+';
    *leftward = x[0] == '-';
    if (!(*exposure > 1e-30 && *exposure < 1e30))
        return bad(r, "exposures out of all proportion");
    if (!dph_image_check_claim(r->path, "header", w, h, (size_t)(w > 0 ? w : 0) * 4, r->size, r->err))
        return false;
    *width = (int)w;
    *height = (int)h;
    return true;
}

/* One component of a run-length coded line. */
static bool read_component(struct reader *r, int width, unsigned char *line, int component)
{
    for (int x = 0; x < width;) {
        if (r->at >= r->size)
            return bad(r, "the file ends within a scan line");
        int count = r->data[r->at++];
        bool run = count > 128;
        count = run ? count - 128 : count;
        if (count == 0 || count > width - x)
            return bad(r, "a run that does not fit its scan line");
        if (r->size - r->at < (run ? 1 : (size_t)count))
            return bad(r, "the file ends within a scan line");
        for (int i = 0; i < count; i++, x++)
            line[4 * x + component] = r->data[run ? r->at : r->at + (size_t)i];
        r->at += run ? 1 : (size_t)count;
    }
    return true;
}

/* A line of plain pixels and repetitions. */
static bool read_plain(struct reader *r, int width, unsigned char *line)
{
    int shift = 0;
    for (int x = 0; x < width;) {
        if (r->size - r->at < 4)
            return bad(r, "the file ends within a scan line");
        const unsigned char *p = r->data + r->at;
        if (p[0] != 1 || p[1] != 1 || p[2] != 1) {
            memcpy(line + 4 * x++, p, 4);
            shift = 0;
        } else {
            /* runs in a row are digits of one length, the low one first */
            int count = shift < 24 ? (int)p[3] << shift : 0;
            if (x == 0 || count > width - x || shift >= 24)
                return bad(r, "a run that does not fit its scan line");
            for (int i = 0; i < count; i++, x++)
                memcpy(line + 4 * x, line + 4 * (x - 1), 4);
            shift += 8;
        }
        r->at += 4;
    }
    return true;
}

static bool read_scan_line(struct reader *r, int width, unsigned char *line)
{
    if (r->at > r->size || r->size - r->at < 4)
        return bad(r, "the file ends before its last scan line");
    const unsigned char *p = r->data + r->at;
    if (width < 8 || width > 32767 || p[0] != 2 || p[1] != 2 || p[2] & 0x80)
        return read_plain(r, width, line);
    if ((p[2] << 8 | p[3]) != width)
        return bad(r, "a scan line of another width");
    r->at += 4;
    for (int c = 0; c < 4; c++)
        if (!read_component(r, width, line, c))
            return false;
    return true;
}

bool dph_read_hdr(struct dph_image *image, const struct dph_file *file, const char *path,
                  struct dph_error *err)
{
    struct reader r = {.data = (const unsigned char *)file->data, .size = file->size, .path = path, .err = err};
    int width = 0, height = 0;
    bool upward = false, leftward = false, ok = false;
    double exposure;
    *image = (struct dph_image){0};
    if (!read_header(&r, &width, &height, &upward, &leftward, &exposure))
        return false;
    unsigned char *line = dph_alloc((size_t)width, 4);
    if (!line)
        return dph_fail_memory(err);
    if (!dph_image_init(image, width, height, err))
        goto end;
    for (int y = 0; y < height; y++) {
        if (!read_scan_line(&r, width, line))
            goto end;
        float *row = image->pixel + 4 * (size_t)width * (size_t)(upward ? height - 1 - y : y);
        for (int x = 0; x < width; x++) {
            const unsigned char *p = line + 4 * x;
            float *to = row + 4 * (size_t)(leftward ? width - 1 - x : x);
            double scale = p[3] ? ldexp(1, p[3] - 136) / exposure : 0;
            for (int c = 0; c < 3; c++)
                to[c] = (float)fmin((p[c] + .5) * scale, 3e38);
            to[3] = 1;
        }
    }
    ok = true;
end:
    free(line);
    if (!ok)
        dph_image_finish(image);
    return ok;
}
