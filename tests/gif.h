/* Reads the first picture of a GIF file, grey or coloured, interlaced or not: what a test needs of
 * the format, no more. Bytes are trusted to be a whole file. */
#ifndef DPH_TEST_GIF_H
#define DPH_TEST_GIF_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct gif {
    int width, height;
    uint8_t *pixel; /* (height x width) the red of the colour table */
};

/* Variable-length LZW codes, at most 12 bits (CompuServe GIF89a, appendix F). */
static inline size_t gif_unpack(const uint8_t *data, size_t size, int bits, uint8_t *out,
                                size_t room)
{
    static uint16_t prefix[4096];
    static uint8_t suffix[4096], stack[4096];
    int clear = 1 << bits, next = clear + 2, width = bits + 1, old = -1, first = 0;
    size_t done = 0;
    uint32_t buffer = 0;
    int held = 0;
    for (size_t at = 0; at < size || held >= width;) {
        while (held < width && at < size) {
            buffer |= (uint32_t)data[at++] << held;
            held += 8;
        }
        if (held < width)
            break;
        int code = (int)(buffer & ((1U << width) - 1)), depth = 0, walk;
        buffer >>= width;
        held -= width;
        if (code == clear) {
            next = clear + 2;
            width = bits + 1;
            old = -1;
            continue;
        }
        if (code == clear + 1 || code > next || (old < 0 && code >= clear))
            break;
        walk = code;
        if (code == next) { /* the string before and its own first letter */
            stack[depth++] = (uint8_t)first;
            walk = old;
        }
        for (; walk >= clear; walk = prefix[walk])
            stack[depth++] = suffix[walk];
        stack[depth++] = (uint8_t)(first = walk);
        if (old >= 0 && next < 4096) {
            prefix[next] = (uint16_t)old;
            suffix[next++] = (uint8_t)first;
            if (next == 1 << width && width < 12)
                width++;
        }
        old = code;
        while (depth && done < room)
            out[done++] = stack[--depth];
    }
    return done;
}

/* False where the file is absent or no GIF. */
static inline int gif_load(struct gif *gif, const char *path)
{
    static const int start[] = {0, 4, 2, 1}, step[] = {8, 8, 4, 2};
    FILE *file = fopen(path, "rb");
    if (!file)
        return 0;
    size_t room = 1 << 24;
    uint8_t *data = malloc(room + 1024), *packed = malloc(room + 1024), table[256] = {0};
    size_t size = fread(data, 1, room, file), at = 13, npacked = 0;
    fclose(file);
    memset(data + size, 0, 1024);
    int ok = 0;
    if (size < 32 || memcmp(data, "GIF8", 4))
        goto error;
    int colours = data[10] & 0x80 ? 2 << (data[10] & 7) : 0;
    for (int i = 0; i < colours; i++)
        table[i] = data[at + 3 * (size_t)i];
    at += 3 * (size_t)colours;
    while (at < size && data[at] == 0x21) /* extensions */
        for (at += 2; at < size;) {
            size_t block = data[at++];
            at += block;
            if (!block)
                break;
        }
    if (at + 11 > size || data[at] != 0x2c)
        goto error;
    gif->width = data[at + 5] | data[at + 6] << 8;
    gif->height = data[at + 7] | data[at + 8] << 8;
    int flags = data[at + 9];
    at += 10;
    if (flags & 0x80) {
        for (int i = 0; i < 2 << (flags & 7); i++)
            table[i] = data[at + 3 * (size_t)i];
        at += 3 * ((size_t)2 << (flags & 7));
    }
    int bits = data[at++];
    while (at < size && data[at]) {
        size_t block = data[at++];
        memcpy(packed + npacked, data + at, block);
        npacked += block;
        at += block;
    }
    size_t width = (size_t)gif->width, count = width * (size_t)gif->height;
    uint8_t *rows = malloc(count);
    gif->pixel = malloc(count);
    ok = gif_unpack(packed, npacked, bits, rows, count) == count;
    size_t row = 0;
    for (int pass = 0; pass < 4; pass++) {
        int by = flags & 0x40 ? step[pass] : 1;
        for (int y = flags & 0x40 ? start[pass] : 0; y < gif->height && row < count; y += by) {
            for (size_t x = 0; x < width; x++)
                gif->pixel[(size_t)y * width + x] = table[rows[row + x]];
            row += width;
        }
    }
    free(rows);

error:
    free(data);
    free(packed);
    return ok;
}

#endif
