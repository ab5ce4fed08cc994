/* Bare meshes as OBJ, PLY (binary, little-endian) and STL (binary).
 *
 * Every number comes back from the readers as it was, but for STL, which has no normals of
 * vertices. The second texture coordinate counts upward in these formats and downward in the
 * library. Files are put together in a buffer of fixed size. */
#include "mesh/readers.h"

#include "core/fail.h"
#include "mesh/scan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

struct buffer {
    struct dph_output *out;
    size_t size;
    char data[1 << 14];
};

/* Room for `size` more bytes, at most 1024; what is written is counted by the caller in
 * buffer->size. */
static char *reserve(struct buffer *b, size_t size)
{
    if (b->size + size > sizeof b->data) {
        dph_output_write(b->out, b->data, b->size);
        b->size = 0;
    }
    return b->data + b->size;
}

static void put(struct buffer *b, const void *data, size_t size)
{
    memcpy(reserve(b, size), data, size);
    b->size += size;
}

static void put_text(struct buffer *b, const char *text)
{
    put(b, text, strlen(text));
}

static void put_u32(struct buffer *b, uint32_t value)
{
    unsigned char bytes[4] = {(unsigned char)value, (unsigned char)(value >> 8),
                              (unsigned char)(value >> 16), (unsigned char)(value >> 24)};
    put(b, bytes, sizeof bytes);
}

static void put_float(struct buffer *b, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_u32(b, bits);
}

/* One line of text: a keyword and numbers. */
static void put_numbers(struct buffer *b, const char *key, const float *value, int n)
{
    put_text(b, key);
    for (int k = 0; k < n; k++) {
        char text[25] = " ";
        dph_print_float(text + 1, value[k]);
        put_text(b, text);
    }
    put_text(b, "\n");
}

static void put_corner(struct buffer *b, unsigned long v, bool texcoord, bool normal)
{
    char text[80];
    if (texcoord && normal)
        snprintf(text, sizeof text, " %lu/%lu/%lu", v, v, v);
    else if (normal)
        snprintf(text, sizeof text, " %lu//%lu", v, v);
    else if (texcoord)
        snprintf(text, sizeof text, " %lu/%lu", v, v);
    else
        snprintf(text, sizeof text, " %lu", v);
    put_text(b, text);
}

static bool finish(struct buffer *b, struct dph_error *err)
{
    dph_output_write(b->out, b->data, b->size);
    return dph_output_close(b->out, err);
}

bool dph_write_obj(const struct dph_mesh *mesh, const char *path, struct dph_error *err)
{
    struct buffer b = {.out = dph_output_open(path, err)};
    if (!b.out)
        return false;
    for (size_t v = 0; v < mesh->nvert; v++)
        put_numbers(&b, "v", mesh->position + 3 * v, 3);
    for (size_t v = 0; mesh->texcoord && v < mesh->nvert; v++) {
        const float *t = mesh->texcoord + 2 * v;
        put_numbers(&b, "vt", (float[2]){t[0], 1 - t[1]}, 2);
    }
    for (size_t v = 0; mesh->normal && v < mesh->nvert; v++)
        put_numbers(&b, "vn", mesh->normal + 3 * v, 3);
    for (size_t t = 0; t < mesh->ntri; t++) {
        put_text(&b, "f");
        for (int k = 0; k < 3; k++)
            put_corner(&b, mesh->index[3 * t + k] + 1ul, mesh->texcoord, mesh->normal);
        put_text(&b, "\n");
    }
    return finish(&b, err);
}

bool dph_write_ply(const struct dph_mesh *mesh, const char *path, struct dph_error *err)
{
    struct buffer b = {.out = dph_output_open(path, err)};
    if (!b.out)
        return false;
    char text[160];
    snprintf(text, sizeof text, "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n",
             mesh->nvert);
    put_text(&b, text);
    put_text(&b, "property float x\nproperty float y\nproperty float z\n");
    if (mesh->normal)
        put_text(&b, "property float nx\nproperty float ny\nproperty float nz\n");
    if (mesh->texcoord)
        put_text(&b, "property float s\nproperty float t\n");
    snprintf(text, sizeof text,
             "element face %zu\nproperty list uchar int vertex_indices\nend_header\n", mesh->ntri);
    put_text(&b, text);
    for (size_t v = 0; v < mesh->nvert; v++) {
        for (int k = 0; k < 3; k++)
            put_float(&b, mesh->position[3 * v + k]);
        for (int k = 0; mesh->normal && k < 3; k++)
            put_float(&b, mesh->normal[3 * v + k]);
        if (mesh->texcoord) {
            put_float(&b, mesh->texcoord[2 * v]);
            put_float(&b, 1 - mesh->texcoord[2 * v + 1]);
        }
    }
    for (size_t t = 0; t < mesh->ntri; t++) {
        put(&b, "\3", 1);
        for (int k = 0; k < 3; k++)
            put_u32(&b, mesh->index[3 * t + k]);
    }
    return finish(&b, err);
}

bool dph_write_stl(const struct dph_mesh *mesh, const char *path, struct dph_error *err)
{
    struct buffer b = {.out = dph_output_open(path, err)};
    if (!b.out)
        return false;
    char header[80] = "binary STL";
    put(&b, header, sizeof header);
    put_u32(&b, (uint32_t)mesh->ntri); /* a mesh has at most 2^31 triangles */
    for (size_t t = 0; t < mesh->ntri; t++) {
        const float *p[3];
        double u[3], v[3];
        for (int k = 0; k < 3; k++)
            p[k] = mesh->position + 3 * (size_t)mesh->index[3 * t + k];
        for (int a = 0; a < 3; a++) {
            u[a] = (double)p[1][a] - p[0][a];
            v[a] = (double)p[2][a] - p[0][a];
        }
        double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                       u[0] * v[1] - u[1] * v[0]};
        double size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int a = 0; a < 3; a++)
            put_float(&b, size > 0 ? (float)(n[a] / size) : 0);
        for (int k = 0; k < 9; k++)
            put_float(&b, p[k / 3][k % 3]);
        put(&b, "\0", 2);
    }
    return finish(&b, err);
}
