/* A body's buffers: a row a vertex, position and normal and what is stored of thickness behind them.
 *
 * Coefficients go to the GPU as the bake packed them, in words of four bytes, four words an attribute,
 * and are taken apart by the vertex stage: an attribute costs about as much for sixteen bytes as for
 * four, and none of them has to be turned into a number of its own before the stage begins. For the
 * same reason the first two words ride behind position and normal, which would be three words
 * otherwise: four coefficients of a byte cost no attribute at all.
 * The scale of each band is in the light's values already. A body without normals is flat, so its
 * corners become vertices of their own with the normal of their face; a renderer that is asked not
 * to share vertices does the same to all bodies; all others are put in order first (order.c). */
#include "render/draw.h"

#include "core/fail.h"
#include "core/memory.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

size_t dph_gpu_vertex(const struct dph_gpu_body *gpu, const struct dph_mesh *mesh, size_t r)
{
    return gpu->vertex ? gpu->vertex[r] : mesh->index[r];
}

static void face_normal(const struct dph_mesh *mesh, size_t triangle, float out[3])
{
    const uint32_t *t = mesh->index + 3 * triangle;
    double e[2][3], n[3], length = 0;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++)
            e[i][k] = (double)mesh->position[3 * (size_t)t[i + 1] + (size_t)k] -
                      (double)mesh->position[3 * (size_t)t[0] + (size_t)k];
    for (int k = 0; k < 3; k++) {
        n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        length += n[k] * n[k];
    }
    length = sqrt(length);
    for (int k = 0; k < 3; k++)
        out[k] = length > 0 ? (float)(n[k] / length) : 0;
}

unsigned char *dph_gpu_rows_fill(const struct dph_gpu_body *gpu, const struct dph_mesh *mesh,
                                 size_t extra, struct dph_error *err)
{
    unsigned char *data = dph_alloc_zero(gpu->nvert, DPH_ROW + extra);
    if (!data) {
        dph_fail_memory(err);
        return NULL;
    }
    for (size_t r = 0; r < gpu->nvert; r++) {
        size_t v = dph_gpu_vertex(gpu, mesh, r);
        float row[6];
        for (size_t k = 0; k < 3; k++)
            row[k] = (float)((double)mesh->position[3 * v + k] - gpu->origin[k]);
        if (mesh->normal)
            memcpy(row + 3, mesh->normal + 3 * v, 3 * sizeof *row);
        else
            face_normal(mesh, r / 3, row + 3);
        memcpy(data + r * (DPH_ROW + extra), row, sizeof row);
    }
    return data;
}

void dph_gpu_rows_upload(struct dph_gpu_rows *rows, const struct dph_gpu_body *gpu,
                         unsigned char *data, size_t extra)
{
    const size_t stride = DPH_ROW + extra;
    dph_gpu_rows_finish(rows);
    glGenVertexArrays(1, &rows->array);
    glBindVertexArray(rows->array);
    if (gpu->indexed)
        glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, gpu->indices);
    glGenBuffers(1, &rows->buffer);
    glBindBuffer(GL_ARRAY_BUFFER, rows->buffer);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(gpu->nvert * stride), data, GL_STATIC_DRAW);
    free(data);
    for (GLuint i = 0; i < 2; i++) {
        glEnableVertexAttribArray(i);
        glVertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, (GLsizei)stride,
                              (const void *)(uintptr_t)(i * 3 * sizeof(float)));
    }
}

void dph_gpu_rows_words(size_t words, size_t first, GLenum type, size_t extra)
{
    const GLsizei stride = (GLsizei)(DPH_ROW + extra);
    for (size_t i = first; i < words; i += 4) {
        GLuint location = (GLuint)(DPH_EXTRA + (i - first) / 4);
        GLint size = words - i < 4 ? (GLint)(words - i) : 4;
        const void *offset = (const void *)(uintptr_t)(DPH_ROW + 4 * i);
        glEnableVertexAttribArray(location);
        if (type == GL_FLOAT)
            glVertexAttribPointer(location, size, GL_FLOAT, GL_FALSE, stride, offset);
        else
            glVertexAttribIPointer(location, size, type, stride, offset);
    }
}

void dph_gpu_rows_finish(struct dph_gpu_rows *rows)
{
    glDeleteVertexArrays(1, &rows->array);
    glDeleteBuffers(1, &rows->buffer);
    *rows = (struct dph_gpu_rows){0};
}

/* The lowest integer means -1, as its neighbour does; the vertex stage knows only the neighbour. */
static void avoid_lowest(unsigned char *row, size_t components, size_t size)
{
    for (size_t i = 0; i < components; i++) {
        if (size == 1 && row[i] == 0x80)
            row[i] = 0x81;
        int16_t value;
        if (size == 2 && (memcpy(&value, row + 2 * i, 2), value == INT16_MIN)) {
            value = -INT16_MAX;
            memcpy(row + 2 * i, &value, 2);
        }
    }
}

/* Puts words into a row of position and normal: one behind each, the others behind both. */
static void weave(unsigned char *row, const unsigned char *words, size_t extra)
{
    memmove(row + 16, row + 12, 12);
    memcpy(row + 12, words, 4);
    memcpy(row + 28, words + 4, extra - 4);
}

/* What is stored of thickness, the number of the cluster behind weights. */
static bool upload_baked(struct dph_gpu_body *gpu, const struct dph_mesh *mesh,
                         const struct dph_thickness *thickness, struct dph_error *err)
{
    const bool clustered = thickness->store == DPH_STORE_CPCA;
    const size_t size = dph_store_size(thickness->store);
    const size_t stored = (size_t)thickness->components * size;
    gpu->vectors =
        thickness->components / 4 < DPH_MAX_VECTORS ? thickness->components / 4 : DPH_MAX_VECTORS;
    gpu->bytes = (int)size;
    if (clustered && !dph_clusters_init(gpu, thickness, err))
        return false;
    const size_t drawn = 4 * size * (size_t)gpu->vectors, extra = drawn + (clustered ? 4 : 0);
    unsigned char words[4 * 4 * DPH_MAX_VECTORS + 4];
    unsigned char *data = dph_gpu_rows_fill(gpu, mesh, extra, err);
    if (!data)
        return false;
    for (size_t r = 0; r < gpu->nvert; r++) {
        size_t v = dph_gpu_vertex(gpu, mesh, r);
        memcpy(words, (const char *)thickness->data + v * stored, drawn);
        avoid_lowest(words, drawn / size, size);
        if (clustered) {
            uint32_t cluster = thickness->cluster[v];
            memcpy(words + drawn, &cluster, sizeof cluster);
        }
        weave(data + r * (DPH_ROW + extra), words, extra);
    }
    dph_gpu_rows_upload(&gpu->baked, gpu, data, extra);
    const GLsizei stride = (GLsizei)(DPH_ROW + extra);
    glVertexAttribIPointer(0, 4, GL_UNSIGNED_INT, stride, NULL);
    glVertexAttribIPointer(1, extra > 4 ? 4 : 3, GL_UNSIGNED_INT, stride, (const void *)16);
    dph_gpu_rows_words(extra / 4, 2, GL_UNSIGNED_INT, extra);
    return true;
}

bool dph_gpu_body_init(struct dph_gpu_body *gpu, const struct dph_body *body, bool unshared,
                       struct dph_error *err)
{
    *gpu = (struct dph_gpu_body){0};
    const struct dph_mesh *mesh = &body->mesh;
    if (!mesh->ntri || !mesh->nvert)
        return true;
    if (mesh->ntri > INT_MAX / 3)
        return dph_fail(err, DPH_ERROR_LIMIT, "%zu triangles, more than one draw call takes",
                        mesh->ntri);
    if (body->thickness && body->thickness->nvert != mesh->nvert)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "thickness of %zu vertices for a mesh of %zu",
                        body->thickness->nvert, mesh->nvert);
    gpu->count = (GLsizei)(3 * mesh->ntri);
    gpu->nvert = 3 * mesh->ntri;
    gpu->indexed = !unshared && mesh->normal;

    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * mesh->nvert; i++) {
        low[i % 3] = fminf(low[i % 3], mesh->position[i]);
        high[i % 3] = fmaxf(high[i % 3], mesh->position[i]);
    }
    for (int k = 0; k < 3; k++)
        gpu->origin[k] = ((double)low[k] + (double)high[k]) / 2;

    uint32_t *index = NULL;
    bool ok = true;
    dph_gl_drain();
    if (gpu->indexed) {
        index = dph_alloc(mesh->ntri, 3 * sizeof *index);
        ok = index ? dph_gpu_body_order(gpu, body, index, err) : dph_fail_memory(err);
    }
    if (index && ok) {
        glGenBuffers(1, &gpu->indices);
        glBindVertexArray(0);
        glBindBuffer(GL_ARRAY_BUFFER, gpu->indices); /* that of elements belongs to an array */
        glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(3 * mesh->ntri * sizeof *index), index,
                     GL_STATIC_DRAW);
    }
    free(index);
    ok = ok && (!body->thickness || upload_baked(gpu, mesh, body->thickness, err));
    glBindVertexArray(0);
    ok = ok && dph_gl_check("upload", err);
    if (!ok)
        dph_gpu_body_finish(gpu);
    return ok;
}

bool dph_gpu_body_plain(struct dph_gpu_body *gpu, const struct dph_body *body,
                        struct dph_error *err)
{
    if (gpu->plain.array || !gpu->count)
        return true;
    unsigned char *data = dph_gpu_rows_fill(gpu, &body->mesh, 0, err);
    if (!data)
        return false;
    dph_gl_drain();
    dph_gpu_rows_upload(&gpu->plain, gpu, data, 0);
    glBindVertexArray(0);
    if (dph_gl_check("upload", err))
        return true;
    dph_gpu_rows_finish(&gpu->plain);
    return false;
}

bool dph_gpu_body_outward(struct dph_gpu_body *gpu, const struct dph_body *body,
                          struct dph_error *err)
{
    const struct dph_mesh *mesh = &body->mesh;
    if (gpu->outward || !gpu->count)
        return true;
    if (!dph_gpu_body_plain(gpu, body, err))
        return false;
    uint32_t *position_of = dph_alloc(mesh->nvert, sizeof *position_of), *index = NULL;
    float *position = NULL, *normal = NULL;
    signed char(*row)[4] = NULL;
    bool ok = false;
    if (!position_of) {
        dph_fail_memory(err);
        goto error;
    }
    size_t npos = dph_mesh_weld(mesh->position, 3 * sizeof(float), mesh->nvert, position_of, err);
    if (npos == SIZE_MAX)
        goto error;
    position = dph_alloc(npos, 3 * sizeof *position);
    normal = dph_alloc(npos, 3 * sizeof *normal);
    index = dph_alloc(mesh->ntri, 3 * sizeof *index);
    row = dph_alloc(gpu->nvert, sizeof *row);
    if (!position || !normal || !index || !row) {
        dph_fail_memory(err);
        goto error;
    }
    for (size_t v = 0; v < mesh->nvert; v++)
        memcpy(position + 3 * (size_t)position_of[v], mesh->position + 3 * v, 3 * sizeof *position);
    for (size_t i = 0; i < 3 * mesh->ntri; i++)
        index[i] = position_of[mesh->index[i]];
    dph_mesh_position_normals(position, npos, index, mesh->ntri, normal);
    for (size_t r = 0; r < gpu->nvert; r++) {
        const float *n = normal + 3 * (size_t)position_of[dph_gpu_vertex(gpu, mesh, r)];
        for (int k = 0; k < 3; k++)
            row[r][k] = (signed char)lrintf(127 * n[k]);
        row[r][3] = 0;
    }
    dph_gl_drain();
    glBindVertexArray(gpu->plain.array);
    glGenBuffers(1, &gpu->outward);
    glBindBuffer(GL_ARRAY_BUFFER, gpu->outward);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(gpu->nvert * sizeof *row), row, GL_STATIC_DRAW);
    glEnableVertexAttribArray(DPH_OUTWARD);
    glVertexAttribPointer(DPH_OUTWARD, 4, GL_BYTE, GL_TRUE, sizeof *row, NULL);
    glBindVertexArray(0);
    ok = dph_gl_check("upload", err);

error:
    free(position_of);
    free(position);
    free(normal);
    free(index);
    free(row);
    return ok;
}

void dph_gpu_body_finish(struct dph_gpu_body *gpu)
{
    GLuint buffers[2] = {gpu->indices, gpu->outward};
    dph_gpu_rows_finish(&gpu->plain);
    dph_gpu_rows_finish(&gpu->baked);
    glDeleteBuffers(2, buffers);
    glDeleteTextures(1, &gpu->table);
    free(gpu->lit);
    free(gpu->vertex);
    free(gpu->row_of);
    *gpu = (struct dph_gpu_body){0};
}
