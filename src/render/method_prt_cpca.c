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
    size_t vectors = (size_t)cpca->vectors, padded = (vectors + 3) / 4 * 4, extra = padded + 4;
    prt->clusters = cpca->clusters;
    prt->vectors = (int)(padded / 4);
    free(prt->table);
    prt->table = dph_alloc_zero((size_t)cpca->clusters * (1 + padded), 4 * sizeof *prt->table);
    if (!prt->table)
        return dph_fail_memory(err);
    unsigned char *data = dph_gpu_rows_fill(gpu, &body->mesh, extra, err);
    if (!data)
        return false;
    for (size_t r = 0; r < gpu->nvert; r++) {
        size_t p = transfer->position_of[dph_gpu_vertex(gpu, &body->mesh, r)];
        unsigned char *row = data + r * (DPH_ROW + extra) + DPH_ROW;
        for (size_t j = 0; j < vectors; j++)
            row[j] = (unsigned char)dph_cpca_snorm8(cpca->weight[p * vectors + j]);
        memcpy(row + padded, &cpca->cluster[p], sizeof cpca->cluster[p]);
    }
    dph_gpu_rows_upload(&prt->rows, gpu, data, extra);
    dph_gpu_rows_words(extra / 4, 0, GL_UNSIGNED_INT, extra);
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

static bool has_clusters(const struct dph_body *body)
{
    return body->rivals && body->rivals->clusters;
}

static void light_up(const struct dph_draw *draw, const struct dph_instance *instance,
                     struct dph_rival_body *prt, struct dph_program *program)
{
    const struct dph_rivals *rivals = draw->renderer->scene->body[instance->body].rivals;
    float incoming[3 * DPH_PRT_CHANNEL];
    dph_prt_light(draw, instance, rivals->transfer.bands, incoming);
    light_clusters(prt, rivals->clusters, rivals->transfer.bands, incoming);
    size_t texels = (size_t)prt->clusters * (size_t)(1 + 4 * prt->vectors);
    glBindBuffer(GL_TEXTURE_BUFFER, prt->buffer);
    glBufferData(GL_TEXTURE_BUFFER, (GLsizeiptr)(texels * 4 * sizeof *prt->table), prt->table,
                 GL_STREAM_DRAW);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_BUFFER, prt->texture);
    glTexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, prt->buffer);
    dph_set_int(program, "u_table", 0);
}

static bool draw_prt_cpca(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_rival_pass pass = {.name = "prt-cpca",
                                               .vert = "prt_cpca.vert",
                                               .frag = "prt.frag",
                                               .kind = DPH_RIVAL_CPCA,
                                               .product = "compressed transfer vectors",
                                               .has = has_clusters,
                                               .make = make,
                                               .uniforms = light_up};
    return dph_rival_draw(draw, &pass, err);
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
