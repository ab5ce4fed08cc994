/* STL, binary and ascii.
 *
 * A binary file is 80 bytes of anything, the number of triangles, and 50 bytes for each; its 80
 * bytes may well begin with "solid", as an ascii file does, so the two are told apart by the size.
 * Facet normals are not used: many writers leave them 0. An STL has no vertices of its own, so
 * equal corners are merged. */
#include "mesh/readers.h"

#include "core/fail.h"
#include "core/memory.h"
#include "mesh/scan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HEADER 84
#define FACET 50

static uint32_t load_u32(const unsigned char *b)
{
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static bool read_binary(const struct dph_file *file, const char *path, float **point,
                        size_t *npoint, struct dph_error *err)
{
    size_t ntri = load_u32(file->data + 80);
    if (file->size != HEADER + FACET * ntri)
        return dph_fail(err, DPH_ERROR_INPUT,
                        "%s: byte 80: %zu triangles need %zu bytes, the file has %zu", path, ntri,
                        HEADER + FACET * ntri, file->size);
    *npoint = 3 * ntri;
    *point = dph_alloc(*npoint, 3 * sizeof **point);
    if (!*point)
        return dph_fail_memory(err);
    for (size_t t = 0; t < ntri; t++)
        for (size_t i = 0; i < 9; i++) {
            size_t at = HEADER + FACET * t + 12 + 4 * i;
            uint32_t bits = load_u32(file->data + at);
            float *value = *point + 9 * t + i;
            memcpy(value, &bits, sizeof bits);
            if (!isfinite(*value))
                return dph_fail(err, DPH_ERROR_INPUT,
                                "%s: byte %zu: triangle %zu has the coordinate %g, which is not "
                                "finite",
                                path, at, t, (double)*value);
        }
    return true;
}

struct text {
    const char *path, *cursor, *end;
    size_t line;
    struct dph_error *err;
};

/* Goes to the next word; false at the end of the file. */
static bool find_word(struct text *t)
{
    for (; t->cursor < t->end && (unsigned char)*t->cursor <= ' '; t->cursor++)
        t->line += *t->cursor == '\n' || (*t->cursor == '\r' && t->cursor[1] != '\n');
    return t->cursor < t->end;
}

static void skip_word(struct text *t)
{
    while (t->cursor < t->end && (unsigned char)*t->cursor > ' ')
        t->cursor++;
}

static void skip_line(struct text *t)
{
    while (t->cursor < t->end && *t->cursor != '\n' && *t->cursor != '\r')
        t->cursor++;
}

/* Takes the next word if it is `wanted` (in small letters; the file may have capitals). */
static bool take(struct text *t, const char *wanted)
{
    if (!find_word(t))
        return false;
    const char *c = t->cursor;
    for (; *wanted; wanted++, c++)
        if ((*c >= 'A' && *c <= 'Z' ? *c - 'A' + 'a' : *c) != *wanted)
            return false;
    if (c < t->end && (unsigned char)*c > ' ')
        return false;
    t->cursor = c;
    return true;
}

static bool expect(struct text *t, const char *wanted)
{
    return take(t, wanted) ||
           dph_fail(t->err, DPH_ERROR_INPUT, "%s:%zu: \"%s\" must stand here, not \"%s\"", t->path,
                    t->line, wanted, dph_scan_word(t->cursor, t->end).text);
}

static bool read_vertex(struct text *t, float point[3])
{
    if (!expect(t, "vertex"))
        return false;
    for (int k = 0; k < 3; k++) {
        find_word(t);
        const char *after = dph_scan_float(t->cursor, &point[k]);
        if (!after || (after < t->end && (unsigned char)*after > ' ') || !isfinite(point[k]))
            return dph_fail(t->err, DPH_ERROR_INPUT,
                            "%s:%zu: a coordinate must be a finite number, not \"%s\"", t->path,
                            t->line, dph_scan_word(t->cursor, t->end).text);
        t->cursor = after;
    }
    return true;
}

static bool read_facet(struct text *t, float point[9])
{
    if (!expect(t, "facet") || !expect(t, "normal"))
        return false;
    for (int k = 0; k < 3; k++) { /* whatever it is: not used */
        find_word(t);
        skip_word(t);
    }
    return expect(t, "outer") && expect(t, "loop") && read_vertex(t, point) &&
           read_vertex(t, point + 3) && read_vertex(t, point + 6) && expect(t, "endloop") &&
           expect(t, "endfacet");
}

static bool read_ascii(const struct dph_file *file, const char *path, float **point, size_t *npoint,
                       struct dph_error *err)
{
    struct text t = {.path = path, .cursor = (const char *)file->data, .line = 1, .err = err};
    t.end = t.cursor + file->size;
    size_t ntri = 0, capacity = 0;
    while (find_word(&t)) {
        if (!expect(&t, "solid"))
            return false;
        skip_line(&t); /* its name */
        while (!take(&t, "endsolid")) {
            float *room = dph_grow(*point, ntri, &capacity, 9 * sizeof **point);
            if (!room)
                return dph_fail_memory(err);
            *point = room;
            if (!read_facet(&t, *point + 9 * ntri))
                return false;
            ntri++;
        }
        skip_line(&t);
    }
    if (ntri == 0)
        return dph_fail(err, DPH_ERROR_INPUT, "%s:%zu: the file ends without a triangle", path,
                        t.line);
    *npoint = 3 * ntri;
    return true;
}

/* Whether a file whose size is not that of a binary one is meant as ascii: it begins like that and
 * has no 0 byte, as a cut binary file has. */
static bool looks_ascii(const struct dph_file *file)
{
    struct text t = {.cursor = (const char *)file->data};
    t.end = t.cursor + file->size;
    return take(&t, "solid") && !memchr(file->data, 0, file->size < 256 ? file->size : 256);
}

bool dph_read_stl(struct dph_mesh *mesh, const struct dph_file *file, const char *path,
                  struct dph_scene *warn, struct dph_error *err)
{
    (void)warn;
    memset(mesh, 0, sizeof *mesh);
    float *point = NULL;
    uint32_t *vertex_of = NULL;
    size_t npoint = 0;
    bool ok = false;
    size_t promised = file->size >= HEADER ? load_u32(file->data + 80) : 0;
    bool fits = file->size >= HEADER && file->size == HEADER + FACET * promised;
    bool ascii = !fits && looks_ascii(file);
    if (!ascii && file->size < HEADER) {
        dph_fail(err, DPH_ERROR_INPUT, "%s: byte %zu: the file ends inside its header of 84 bytes",
                 path, file->size);
        goto error;
    }
    if (!(ascii ? read_ascii : read_binary)(file, path, &point, &npoint, err))
        goto error;
    if (npoint == 0) {
        dph_fail(err, DPH_ERROR_INPUT, "%s: byte 80: the file has 0 triangles", path);
        goto error;
    }
    vertex_of = dph_alloc(npoint, sizeof *vertex_of);
    if (!vertex_of) {
        dph_fail_memory(err);
        goto error;
    }
    size_t nvert = dph_mesh_weld(point, 3 * sizeof *point, npoint, vertex_of, err);
    if (nvert == SIZE_MAX || !dph_mesh_init(mesh, nvert, npoint / 3, false, false, err))
        goto error;
    size_t next = 0;
    for (size_t i = 0; i < npoint; i++) {
        if (vertex_of[i] == next)
            memcpy(mesh->position + 3 * next++, point + 3 * i, 3 * sizeof *point);
        mesh->index[i] = vertex_of[i];
    }
    ok = true;
error:
    free(point);
    free(vertex_of);
    if (!ok)
        dph_mesh_finish(mesh);
    return ok;
}
