/* glTF: writing a GLB, a header, a JSON chunk and a binary chunk made of pieces. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <stdlib.h>
#include <string.h>

/* ---- the binary chunk ---- */

static struct dph_gltf_piece *put(struct dph_gltf_output *out, size_t size, size_t align)
{
    struct dph_gltf_piece *grown =
        dph_grow(out->piece, out->npiece, &out->capacity, sizeof *grown);
    if (!grown) {
        out->memory = true;
        return NULL;
    }
    out->piece = grown;
    struct dph_gltf_piece *piece = &grown[out->npiece++];
    *piece =
        (struct dph_gltf_piece){.offset = (out->size + align - 1) / align * align, .size = size};
    out->size = piece->offset + size;
    return piece;
}

size_t dph_gltf_put_bytes(struct dph_gltf_output *out, const void *data, size_t size, size_t align,
                          void *owned)
{
    struct dph_gltf_piece *piece = put(out, size, align);
    if (!piece) {
        free(owned);
        return 0;
    }
    piece->data = data;
    piece->owned = owned;
    return piece->offset;
}

size_t dph_gltf_put_shorts(struct dph_gltf_output *out, const uint32_t *data, size_t count)
{
    struct dph_gltf_piece *piece = put(out, 2 * count, 4);
    if (!piece)
        return 0;
    piece->kind = DPH_GLTF_SHORTS;
    piece->data = data;
    piece->count = count;
    return piece->offset;
}

size_t dph_gltf_put_rows(struct dph_gltf_output *out, const struct dph_thickness *thickness,
                         size_t first, size_t count)
{
    size_t row = (size_t)thickness->components * dph_store_size(thickness->store);
    struct dph_gltf_piece *piece = put(out, count * row, 4);
    if (!piece)
        return 0;
    piece->kind = DPH_GLTF_ROWS;
    piece->thickness = thickness;
    piece->first = first;
    piece->count = count;
    return piece->offset;
}

static void write_shorts(struct dph_output *file, const uint32_t *data, size_t count)
{
    uint16_t block[4096];
    for (size_t done = 0; done < count;) {
        size_t n = count - done < 4096 ? count - done : 4096;
        for (size_t i = 0; i < n; i++)
            block[i] = (uint16_t)data[done + i];
        dph_output_write(file, block, n * sizeof *block);
        done += n;
    }
}

static void write_rows(struct dph_output *file, const struct dph_gltf_piece *piece)
{
    const struct dph_thickness *t = piece->thickness;
    size_t size = dph_store_size(t->store), row = (size_t)t->components * size, four = 4 * size;
    unsigned char block[16 * 1024]; /* holds at least 1,024 groups of four floats */
    for (size_t plane = 0; plane < (size_t)t->components / 4; plane++) {
        const unsigned char *from =
            (const unsigned char *)t->data + piece->first * row + plane * four;
        for (size_t done = 0; done < piece->count;) {
            size_t n = piece->count - done < 1024 ? piece->count - done : 1024;
            for (size_t v = 0; v < n; v++)
                memcpy(block + v * four, from + (done + v) * row, four);
            dph_output_write(file, block, n * four);
            done += n;
        }
    }
}

/* ---- JSON ---- */

void dph_gltf_set(struct dph_gltf_output *out, json_t *object, const char *key, json_t *value)
{
    if (!object || !value) {
        json_decref(value);
        out->memory = true;
    } else if (json_object_set_new(object, key, value)) {
        out->memory = true;
    }
}

void dph_gltf_append(struct dph_gltf_output *out, json_t *array, json_t *value)
{
    if (!array || !value) {
        json_decref(value);
        out->memory = true;
    } else if (json_array_append_new(array, value)) {
        out->memory = true;
    }
}

static json_t *own(struct dph_gltf_output *out, json_t *object, const char *key, json_t *fresh)
{
    json_t *old = json_object_get(object, key);
    json_t *copy = fresh;
    if (old && fresh && json_typeof(old) == json_typeof(fresh)) {
        copy = json_copy(old);
        json_decref(fresh);
    }
    dph_gltf_set(out, object, key, copy);
    return json_object_get(object, key);
}

json_t *dph_gltf_own_array(struct dph_gltf_output *out, json_t *object, const char *key)
{
    return own(out, object, key, json_array());
}

json_t *dph_gltf_own_object(struct dph_gltf_output *out, json_t *object, const char *key)
{
    return own(out, object, key, json_object());
}

json_t *dph_gltf_own_element(struct dph_gltf_output *out, json_t *array, size_t i)
{
    json_t *copy = json_copy(json_array_get(array, i));
    if (!copy || json_array_set_new(array, i, copy)) {
        out->memory = true;
        return NULL;
    }
    return copy;
}

/* ---- the file ---- */

struct text {
    struct dph_output *file; /* NULL: only counted */
    uint64_t size;
};

static bool write_text(void *user, const char *text, size_t size)
{
    struct text *t = user;
    t->size += size;
    return !t->file || dph_output_write(t->file, text, size);
}

static void write_u32(struct dph_output *file, uint64_t value)
{
    uint32_t word = (uint32_t)value; /* little-endian host, gltf_accessor.c */
    dph_output_write(file, &word, 4);
}

static void pad(struct dph_output *file, uint64_t from, uint64_t to, char with)
{
    for (uint64_t at = from; at < to; at++)
        dph_output_write(file, &with, 1);
}

bool dph_gltf_emit(const struct dph_gltf_output *out, const char *path, const void *chunks,
                   size_t chunks_size, struct dph_error *err)
{
    if (out->memory)
        return dph_fail_memory(err);
    struct text count = {NULL, 0};
    dph_gltf_dump(out->root, write_text, &count);
    uint64_t json = (count.size + 3) & ~(uint64_t)3, bin = ((uint64_t)out->size + 3) & ~(uint64_t)3;
    uint64_t total = 12 + 8 + json + (bin ? 8 + bin : 0) + chunks_size;
    if (total > UINT32_MAX)
        return dph_fail(
            err, DPH_ERROR_OUTPUT,
            "%s: would have %llu bytes, a GLB holds 4 GiB; store fewer bands or smaller "
            "numbers",
            path, (unsigned long long)total);
    struct dph_output *file = dph_output_open(path, err);
    if (!file)
        return false;
    dph_output_write(file, "glTF", 4);
    write_u32(file, 2);
    write_u32(file, total);
    write_u32(file, json);
    dph_output_write(file, "JSON", 4);
    struct text text = {file, 0};
    dph_gltf_dump(out->root, write_text, &text);
    pad(file, text.size, json, ' ');
    if (bin) {
        write_u32(file, bin);
        dph_output_write(file, "BIN", 4);
    }
    size_t at = 0;
    for (size_t i = 0; i < out->npiece; i++) {
        const struct dph_gltf_piece *piece = &out->piece[i];
        pad(file, at, piece->offset, 0);
        if (piece->kind == DPH_GLTF_BYTES)
            dph_output_write(file, piece->data, piece->size);
        else if (piece->kind == DPH_GLTF_SHORTS)
            write_shorts(file, piece->data, piece->count);
        else
            write_rows(file, piece);
        at = piece->offset + piece->size;
    }
    pad(file, at, bin, 0);
    dph_output_write(file, chunks, chunks_size);
    return dph_output_close(file, err);
}

void dph_gltf_output_finish(struct dph_gltf_output *out)
{
    for (size_t i = 0; i < out->npiece; i++)
        free(out->piece[i].owned);
    free(out->piece);
    json_decref(out->root);
    *out = (struct dph_gltf_output){0};
}
