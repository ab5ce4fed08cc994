/* A body's buffers: positions and normals interleaved, coefficients exactly as they are stored.
 *
 * Coefficients go to the GPU as the bake packed them, float or normalized integers: the fetch of
 * the vertex stage unpacks them, and the scale of each band is in the light's values already. A
 * body without normals is flat, so its corners become vertices of their own with the normal of
 * their face; a renderer that is asked not to share vertices does the same to all bodies. A mesh
 * whose indices are just 0, 1, 2, ... is drawn without an index buffer. */
#include "render/draw.h"

#include "core/fail.h"
#include "core/memory.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The mesh's vertex behind row r of the buffers. */
static size_t vertex_of(const struct dph_gpu_body *gpu, const struct dph_mesh *mesh, size_t row)
{
    return gpu->expanded ? mesh->index[row] : row;
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

/* (nvert x 6) positions relative to the origin, and normals. */
static bool upload_vertices(struct dph_gpu_body *gpu, const struct dph_mesh *mesh,
                            struct dph_error *err)
{
    float *row = dph_alloc(gpu->nvert, 6 * sizeof *row);
    if (!row)
        return dph_fail_memory(err);
    for (size_t r = 0; r < gpu->nvert; r++) {
        size_t v = vertex_of(gpu, mesh, r);
        for (size_t k = 0; k < 3; k++)
            row[6 * r + k] = (float)((double)mesh->position[3 * v + k] - gpu->origin[k]);
        if (mesh->normal)
            memcpy(row + 6 * r + 3, mesh->normal + 3 * v, 3 * sizeof *row);
        else
            face_normal(mesh, r / 3, row + 6 * r + 3);
    }
    glGenBuffers(1, &gpu->vertices);
    glBindBuffer(GL_ARRAY_BUFFER, gpu->vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(gpu->nvert * 6 * sizeof *row), row, GL_STATIC_DRAW);
    free(row);
    for (GLuint i = 0; i < 2; i++) {
        glEnableVertexAttribArray(i);
        glVertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 6 * sizeof *row,
                              (const void *)(uintptr_t)(i * 3 * sizeof *row));
    }
    return true;
}

static bool upload_coefficients(struct dph_gpu_body *gpu, const struct dph_mesh *mesh,
                                const struct dph_thickness *thickness, struct dph_error *err)
{
    if (thickness->store == DPH_STORE_CPCA)
        return dph_clusters_upload(gpu, mesh, thickness, err);
    size_t bytes = (size_t)thickness->components * dph_store_size(thickness->store);
    const char *data = thickness->data;
    char *expanded = NULL;
    if (gpu->expanded) {
        if (!(expanded = dph_alloc(gpu->nvert, bytes)))
            return dph_fail_memory(err);
        for (size_t r = 0; r < gpu->nvert; r++)
            memcpy(expanded + r * bytes, data + vertex_of(gpu, mesh, r) * bytes, bytes);
        data = expanded;
    }
    glGenBuffers(1, &gpu->coefficients);
    glBindBuffer(GL_ARRAY_BUFFER, gpu->coefficients);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(gpu->nvert * bytes), data, GL_STATIC_DRAW);
    free(expanded);
    gpu->vectors =
        thickness->components / 4 < DPH_MAX_VECTORS ? thickness->components / 4 : DPH_MAX_VECTORS;
    GLenum type = thickness->store == DPH_STORE_FLOAT     ? GL_FLOAT
                  : thickness->store == DPH_STORE_SNORM16 ? GL_SHORT
                                                          : GL_BYTE;
    for (int i = 0; i < gpu->vectors; i++) {
        size_t offset = (size_t)i * 4 * dph_store_size(thickness->store);
        glEnableVertexAttribArray((GLuint)(2 + i));
        glVertexAttribPointer((GLuint)(2 + i), 4, type, GL_TRUE, (GLsizei)bytes,
                              (const void *)(uintptr_t)offset);
    }
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
    gpu->expanded = unshared || !mesh->normal;
    gpu->nvert = gpu->expanded ? 3 * mesh->ntri : mesh->nvert;
    bool sequence = gpu->expanded || mesh->nvert == 3 * mesh->ntri;
    for (size_t i = 0; sequence && !gpu->expanded && i < 3 * mesh->ntri; i++)
        sequence = mesh->index[i] == i;
    gpu->indexed = !sequence;

    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * mesh->nvert; i++) {
        low[i % 3] = fminf(low[i % 3], mesh->position[i]);
        high[i % 3] = fmaxf(high[i % 3], mesh->position[i]);
    }
    for (int k = 0; k < 3; k++)
        gpu->origin[k] = ((double)low[k] + (double)high[k]) / 2;

    dph_gl_drain();
    glGenVertexArrays(1, &gpu->array);
    glBindVertexArray(gpu->array);
    bool ok = upload_vertices(gpu, mesh, err) &&
              (!body->thickness || upload_coefficients(gpu, mesh, body->thickness, err));
    if (ok && gpu->indexed) {
        glGenBuffers(1, &gpu->indices);
        glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, gpu->indices);
        glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(3 * mesh->ntri * sizeof *mesh->index),
                     mesh->index, GL_STATIC_DRAW);
    }
    glBindVertexArray(0);
    ok = ok && dph_gl_check("upload", err);
    if (!ok)
        dph_gpu_body_finish(gpu);
    return ok;
}

bool dph_gpu_body_outward(struct dph_gpu_body *gpu, const struct dph_body *body,
                          struct dph_error *err)
{
    const struct dph_mesh *mesh = &body->mesh;
    if (gpu->outward || !gpu->count)
        return true;
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
        const float *n = normal + 3 * (size_t)position_of[vertex_of(gpu, mesh, r)];
        for (int k = 0; k < 3; k++)
            row[r][k] = (signed char)lrintf(127 * n[k]);
        row[r][3] = 0;
    }
    dph_gl_drain();
    glBindVertexArray(gpu->array);
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
    GLuint buffers[4] = {gpu->vertices, gpu->coefficients, gpu->indices, gpu->outward};
    glDeleteBuffers(4, buffers);
    glDeleteVertexArrays(1, &gpu->array);
    glDeleteTextures(1, &gpu->table);
    free(gpu->lit);
    *gpu = (struct dph_gpu_body){0};
}
