/* Bodies stored as clustered principal components.
 *
 * A vertex has weights and the number of its cluster; its thickness towards a light is m.l + sum
 * over j of w_j e_j.l with mean m and vectors e of the cluster and the 36 values l of the light.
 * The dot products are the same for all vertices of a cluster: they are made here, for every light
 * and instance, and go to a texture with a row a cluster, from which the vertex stage
 * (clustered.vert) takes its own. So a vertex costs as many products as it has weights. Triangles
 * may mix clusters: thickness is interpolated, not weights. */
#include "render/draw.h"

#include "core/fail.h"
#include "core/memory.h"

#include <stdlib.h>
#include <string.h>

/* Behind the vec4 of weights; the unit is behind those that fragment stages may use. */
enum { CLUSTER_LOCATION = 2 + DPH_MAX_VECTORS, TABLE_UNIT = 8 };

bool dph_clusters_upload(struct dph_gpu_body *gpu, const struct dph_mesh *mesh,
                         const struct dph_thickness *thickness, struct dph_error *err)
{
    size_t weights = (size_t)thickness->components, row = dph_thickness_fetched(thickness);
    GLint largest = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
    if (thickness->clusters > largest)
        return dph_fail(err, DPH_ERROR_CAPABILITY, "%d clusters, GL takes %d", thickness->clusters,
                        largest);
    gpu->vectors = thickness->components / 4;
    gpu->lit = dph_alloc_zero((size_t)thickness->clusters * (size_t)(1 + gpu->vectors),
                              DPH_MAX_LIGHTS * 4 * sizeof *gpu->lit);
    unsigned char *data = dph_alloc_zero(gpu->nvert, row);
    if (!gpu->lit || !data) {
        free(data);
        return dph_fail_memory(err);
    }
    for (size_t r = 0; r < gpu->nvert; r++) {
        size_t v = gpu->expanded ? mesh->index[r] : r;
        memcpy(data + r * row, (const int8_t *)thickness->data + v * weights, weights);
        memcpy(data + r * row + weights, &thickness->cluster[v], sizeof thickness->cluster[v]);
    }
    glGenBuffers(1, &gpu->coefficients);
    glBindBuffer(GL_ARRAY_BUFFER, gpu->coefficients);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(gpu->nvert * row), data, GL_STATIC_DRAW);
    free(data);
    for (int i = 0; i < gpu->vectors; i++) {
        glEnableVertexAttribArray((GLuint)(2 + i));
        glVertexAttribPointer((GLuint)(2 + i), 4, GL_BYTE, GL_TRUE, (GLsizei)row,
                              (const void *)(uintptr_t)(4 * i));
    }
    glEnableVertexAttribArray(CLUSTER_LOCATION);
    glVertexAttribIPointer(CLUSTER_LOCATION, 1, GL_UNSIGNED_SHORT, (GLsizei)row,
                           (const void *)(uintptr_t)weights);
    glGenTextures(1, &gpu->table);
    glBindTexture(GL_TEXTURE_2D, gpu->table);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glBindTexture(GL_TEXTURE_2D, 0);
    return true;
}

void dph_clusters_light(struct dph_gpu_body *gpu, const struct dph_thickness *thickness, int i,
                        int lights, const struct dph_light_constants *light)
{
    int n = thickness->bands * thickness->bands;
    int used = n < DPH_DRAW_BANDS * DPH_DRAW_BANDS ? n : DPH_DRAW_BANDS * DPH_DRAW_BANDS;
    const float *row = thickness->table;
    for (int c = 0; c < thickness->clusters; c++) {
        float *texel = gpu->lit + 4 * (size_t)((c * lights + i) * (1 + gpu->vectors));
        for (int j = 0; j <= thickness->vectors; j++, row += n) {
            float sum = 0;
            for (int k = 0; k < used; k++)
                sum += row[k] * light->sh[k / 4][k % 4];
            texel[j ? 3 + j : 0] = sum; /* the mean has a texel of its own */
        }
    }
}

void dph_clusters_bind(const struct dph_gpu_body *gpu, const struct dph_thickness *thickness,
                       int lights, struct dph_program *program)
{
    glActiveTexture(GL_TEXTURE0 + TABLE_UNIT);
    glBindTexture(GL_TEXTURE_2D, gpu->table);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, lights * (1 + gpu->vectors), thickness->clusters, 0,
                 GL_RGBA, GL_FLOAT, gpu->lit);
    glActiveTexture(GL_TEXTURE0);
    dph_set_int(program, "u_table", TABLE_UNIT);
}
