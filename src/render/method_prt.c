/* prt: precomputed radiance transfer of a translucent body, uncompressed.
 *
 * P.-P. Sloan, J. Kautz, J. Snyder, "Precomputed radiance transfer for real-time rendering in
 * dynamic, low-frequency lighting environments", SIGGRAPH 2002; translucency as in P.-P. Sloan, J.
 * Hall, J. Hart, J. Snyder, "Clustered principal components for precomputed radiance transfer",
 * SIGGRAPH 2003, with the dipole of Jensen et al. The bake (diaphan/transfer.h) leaves 3 channels
 * of bands squared floats a position; more than attributes hold, so they lie in a buffer texture
 * and a vertex knows its row. */
#include "render/rival.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/rivals.h>

#include <stdlib.h>
#include <string.h>

static int texels_of(const struct dph_transfer *transfer)
{
    return (transfer->bands * transfer->bands + 3) / 4;
}

static bool make(struct dph_rival_body *prt, const struct dph_gpu_body *gpu,
                 const struct dph_body *body, struct dph_error *err)
{
    const struct dph_transfer *transfer = &body->rivals->transfer;
    size_t n = (size_t)(transfer->bands * transfer->bands),
           texels = 3 * (size_t)texels_of(transfer);
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most);
    if (transfer->npos > (size_t)most / texels)
        return dph_fail(err, DPH_ERROR_CAPABILITY,
                        "%zu transfer vectors: GL takes a buffer of %zu of them", transfer->npos,
                        (size_t)most / texels);
    unsigned char *row = dph_gpu_rows_fill(gpu, &body->mesh, sizeof(uint32_t), err);
    if (!row)
        return false;
    float *data = dph_alloc_zero(transfer->npos * texels, 4 * sizeof *data);
    if (!data) {
        free(row);
        return dph_fail_memory(err);
    }
    for (size_t r = 0; r < gpu->nvert; r++)
        memcpy(row + r * (DPH_ROW + sizeof(uint32_t)) + DPH_ROW,
               &transfer->position_of[dph_gpu_vertex(gpu, &body->mesh, r)], sizeof(uint32_t));
    for (size_t p = 0; p < transfer->npos; p++)
        for (size_t c = 0; c < 3; c++)
            memcpy(data + 4 * (p * texels + c * texels / 3), transfer->vector + (3 * p + c) * n,
                   n * sizeof *data);
    dph_gpu_rows_upload(&prt->rows, gpu, row, sizeof(uint32_t));
    dph_gpu_rows_words(1, 0, GL_UNSIGNED_INT, sizeof(uint32_t));
    glDeleteBuffers(1, &prt->buffer);
    glDeleteTextures(1, &prt->texture);
    glGenBuffers(1, &prt->buffer);
    glBindBuffer(GL_TEXTURE_BUFFER, prt->buffer);
    glBufferData(GL_TEXTURE_BUFFER, (GLsizeiptr)(transfer->npos * texels * 4 * sizeof *data), data,
                 GL_STATIC_DRAW);
    glGenTextures(1, &prt->texture);
    glBindTexture(GL_TEXTURE_BUFFER, prt->texture);
    glTexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, prt->buffer);
    free(data);
    return true;
}

static bool has_vectors(const struct dph_body *body)
{
    return body->rivals && body->rivals->transfer.vector;
}

static void light_up(const struct dph_draw *draw, const struct dph_instance *instance,
                     struct dph_rival_body *prt, struct dph_program *program)
{
    const struct dph_transfer *transfer =
        &draw->renderer->scene->body[instance->body].rivals->transfer;
    float incoming[3 * DPH_PRT_CHANNEL];
    dph_prt_light(draw, instance, transfer->bands, incoming);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_BUFFER, prt->texture);
    dph_set_int(program, "u_transfer", 0);
    dph_set_int(program, "u_texels", texels_of(transfer));
    dph_set_vec(program, "u_incoming", 4, 3 * texels_of(transfer), incoming);
}

static bool draw_prt(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_rival_pass pass = {.name = "prt",
                                               .vert = "prt.vert",
                                               .frag = "prt.frag",
                                               .kind = DPH_RIVAL_PRT,
                                               .product = "transfer vectors",
                                               .has = has_vectors,
                                               .make = make,
                                               .uniforms = light_up};
    return dph_rival_draw(draw, &pass, err);
}

/* A row of floats a position and its number a vertex. */
static void cost(const struct dph_draw *draw, struct dph_cost *cost)
{
    double bytes = 0, vertices = 0;
    for (size_t i = 0; i < draw->renderer->scene->nbody; i++) {
        const struct dph_body *body = &draw->renderer->scene->body[i];
        vertices += (double)body->mesh.nvert;
        if (body->rivals && body->rivals->transfer.vector)
            bytes += (double)body->mesh.nvert * (4 + 48.0 * texels_of(&body->rivals->transfer));
    }
    cost->bytes_per_vertex += vertices > 0 ? bytes / vertices : 0;
}

const struct dph_method dph_method_prt = {
    .name = "prt",
    .title = "Precomputed radiance transfer",
    .paper = "P.-P. Sloan, J. Kautz, J. Snyder, SIGGRAPH 2002",
    .needs = DPH_PRODUCT_TRANSFER,
    .environment = true,
    .draw = &(const struct dph_method_draw){.draw = draw_prt, .cost = cost},
};
