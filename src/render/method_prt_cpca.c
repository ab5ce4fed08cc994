/* prt-cpca: transfer vectors as clustered principal components.
 *
 * P.-P. Sloan, J. Hall, J. Hart, J. Snyder, "Clustered principal components for precomputed
 * radiance transfer", SIGGRAPH 2003. All three channels of a position share one set of weights, as
 * in the sample of the DirectX SDK, whose setting was 1 cluster and 24 vectors. Every frame the CPU
 * lights each cluster's mean and vectors, 3 (1 + vectors) dot products a cluster, and a vertex of
 * the cluster is a weighted sum of the results. Weights are normalized bytes. */
#include "render/rival.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/rivals.h>

#include <stdlib.h>
#include <string.h>

enum { MOST_VECTORS = 36 };

static bool make(struct dph_rival_body *prt, const struct dph_gpu_body *gpu,
                 const struct dph_body *body, struct dph_error *err)
{
    const struct dph_transfer *transfer = &body->rivals->transfer;
    const struct dph_cpca *cpca = body->rivals->clusters;
    if (cpca->vectors > MOST_VECTORS)
        return dph_fail(err, DPH_ERROR_CAPABILITY, "%d vectors a cluster, at most %d are drawn",
                        cpca->vectors, (int)MOST_VECTORS);
    size_t vectors = (size_t)cpca->vectors, padded = (vectors + 3) / 4 * 4, size = padded + 4;
    prt->clusters = cpca->clusters;
    prt->vectors = (int)(padded / 4);
    free(prt->table);
    prt->table = dph_alloc_zero((size_t)cpca->clusters * (1 + padded), 4 * sizeof *prt->table);
    unsigned char *row = dph_alloc_zero(gpu->nvert, size);
    if (!prt->table || !row) {
        free(row);
        return dph_fail_memory(err);
    }
    for (size_t r = 0; r < gpu->nvert; r++) {
        size_t p = transfer->position_of[gpu->expanded ? body->mesh.index[r] : r];
        for (size_t j = 0; j < vectors; j++)
            row[r * size + j] = (unsigned char)dph_cpca_snorm8(cpca->weight[p * vectors + j]);
        memcpy(row + r * size + padded, &cpca->cluster[p], sizeof cpca->cluster[p]);
    }
    dph_rival_array(prt, gpu);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(gpu->nvert * size), row, GL_STATIC_DRAW);
    free(row);
    glEnableVertexAttribArray(2);
    glVertexAttribIPointer(2, 1, GL_UNSIGNED_SHORT, (GLsizei)size, (const void *)(uintptr_t)padded);
    for (size_t i = 0; i < padded / 4; i++) {
        glEnableVertexAttribArray((GLuint)(3 + i));
        glVertexAttribPointer((GLuint)(3 + i), 4, GL_BYTE, GL_TRUE, (GLsizei)size,
                              (const void *)(uintptr_t)(4 * i));
    }
    glDeleteBuffers(1, &prt->buffer);
    glDeleteTextures(1, &prt->texture);
    glGenBuffers(1, &prt->buffer);
    glGenTextures(1, &prt->texture);
    return true;
}

/* What the means and vectors of all clusters leave of the light. */
static void light_clusters(struct dph_rival_body *prt, const struct dph_cpca *cpca, int bands,
                           const float *incoming)
{
    int n = bands * bands, padded = (n + 3) / 4 * 4;
    const float *signal = cpca->table;
    for (int k = 0; k < cpca->clusters; k++)
        for (int j = 0; j <= cpca->vectors; j++, signal += cpca->n) {
            float *texel =
                prt->table + 4 * ((size_t)k * (size_t)(1 + 4 * prt->vectors) + (size_t)j);
            for (int c = 0; c < 3; c++) {
                float sum = 0;
                for (int i = 0; i < n; i++)
                    sum += signal[c * n + i] * incoming[c * padded + i];
                texel[c] = sum;
            }
        }
}

static bool draw_prt_cpca(struct dph_draw *draw, struct dph_error *err)
{
    struct dph_renderer *renderer = draw->renderer;
    const struct dph_scene *scene = renderer->scene;
    struct dph_program *program =
        dph_draw_program(renderer, "prt_cpca.vert", "prt.frag", NULL, draw->frame, 0, err);
    if (!program)
        return false;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_instance *instance = &scene->instance[i];
        const struct dph_body *body = &scene->body[instance->body];
        const struct dph_gpu_body *gpu = &renderer->body[instance->body];
        float incoming[3 * DPH_PRT_CHANNEL];
        if (!gpu->count)
            continue;
        if (!body->rivals || !body->rivals->clusters)
            return dph_fail(err, DPH_ERROR_ARGUMENT,
                            "pass prt-cpca: body %zu ('%.60s') has no compressed transfer vectors",
                            instance->body, body->name);
        struct dph_rival_body *prt =
            dph_rival_body(renderer, DPH_RIVAL_CPCA, instance->body, make, err);
        if (!prt)
            return false;
        glUseProgram(program->id);
        dph_draw_material(draw, program);
        dph_draw_place(draw, program, instance, 0);
        dph_prt_light(draw, instance, body->rivals->transfer.bands, incoming);
        light_clusters(prt, body->rivals->clusters, body->rivals->transfer.bands, incoming);
        size_t texels = (size_t)prt->clusters * (size_t)(1 + 4 * prt->vectors);
        glBindBuffer(GL_TEXTURE_BUFFER, prt->buffer);
        glBufferData(GL_TEXTURE_BUFFER, (GLsizeiptr)(texels * 4 * sizeof *prt->table), prt->table,
                     GL_STREAM_DRAW);
        glActiveTexture(GL_TEXTURE0);
        glBindTexture(GL_TEXTURE_BUFFER, prt->texture);
        glTexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, prt->buffer);
        dph_set_int(program, "u_table", 0);
        dph_set_int(program, "u_vectors", prt->vectors);
        dph_draw_arrays(gpu, prt->array);
    }
    glBindVertexArray(0);
    glBindTexture(GL_TEXTURE_BUFFER, 0);
    glBindBuffer(GL_TEXTURE_BUFFER, 0);
    return dph_program_check(program, "prt-cpca", err);
}

/* Weights and the cluster's number a vertex; means and vectors, and what light makes of them. */
static void cost(const struct dph_draw *draw, struct dph_cost *cost)
{
    double bytes = 0, vertices = 0;
    for (size_t i = 0; i < draw->renderer->scene->nbody; i++) {
        const struct dph_body *body = &draw->renderer->scene->body[i];
        const struct dph_cpca *cpca = body->rivals ? body->rivals->clusters : NULL;
        vertices += (double)body->mesh.nvert;
        if (!cpca)
            continue;
        size_t padded = ((size_t)cpca->vectors + 3) / 4 * 4;
        bytes += (double)body->mesh.nvert * (double)(padded + 4);
        cost->table_bytes += (size_t)cpca->clusters *
                             ((1 + padded) * 16 +
                              (size_t)(1 + cpca->vectors) * (size_t)cpca->n * sizeof *cpca->table);
    }
    cost->bytes_per_vertex += vertices > 0 ? bytes / vertices : 0;
}

const struct dph_method dph_method_prt_cpca = {
    .name = "prt-cpca",
    .title = "Precomputed radiance transfer, clustered principal components",
    .paper = "P.-P. Sloan, J. Hall, J. Hart, J. Snyder, SIGGRAPH 2003",
    .needs = DPH_PRODUCT_CLUSTERS,
    .environment = true,
    .draw = &(const struct dph_method_draw){.draw = draw_prt_cpca, .cost = cost},
};
