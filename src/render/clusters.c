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

enum { TABLE_UNIT = 8 }; /* behind those that fragment stages may use */

bool dph_clusters_init(struct dph_gpu_body *gpu, const struct dph_thickness *thickness,
                       struct dph_error *err)
{
    GLint largest = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
    if (thickness->clusters > largest)
        return dph_fail(err, DPH_ERROR_CAPABILITY, "%d clusters, GL takes %d", thickness->clusters,
                        largest);
    gpu->lit = dph_alloc_zero((size_t)thickness->clusters * (size_t)(1 + gpu->vectors),
                              DPH_MAX_LIGHTS * 4 * sizeof *gpu->lit);
    if (!gpu->lit)
        return dph_fail_memory(err);
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
    dph_set_float(program, "u_weight", 1 / 127.0F);
}
