/* What the rivals share: buffers and a pass over all instances, and light for transfer vectors.
 *
 * Radiance depends linearly on distant light, so every light and the surroundings become one vector
 * of coefficients in the world, a point of the sky or a disc by its own exact coefficients (no
 * factor for looks), and that vector is turned into each body's space. The turn is the rotation in
 * the instance's matrix: what a matrix does besides turning and scaling evenly is not in the
 * transfer vectors either. A mirrored instance has light mirrored through its centre, which changes
 * the sign of odd degrees, and then turned. */
#include "render/rival.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/environment.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The buffers of body `i`. NULL: errors of `make`. */
static struct dph_rival_body *rival_body(struct dph_renderer *renderer,
                                         const struct dph_rival_pass *pass, size_t i,
                                         struct dph_error *err)
{
    if (!renderer->rival && !(renderer->rival = calloc(1, sizeof *renderer->rival))) {
        dph_fail_memory(err);
        return NULL;
    }
    struct dph_rival_body **all = &renderer->rival->body[pass->kind];
    if (!*all && !(*all = dph_alloc_zero(renderer->scene->nbody, sizeof **all))) {
        dph_fail_memory(err);
        return NULL;
    }
    struct dph_rival_body *rival = &(*all)[i];
    if (!rival->rows.array) {
        dph_gl_drain();
        bool ok = pass->make(rival, &renderer->body[i], &renderer->scene->body[i], err);
        glBindVertexArray(0);
        if (!(ok = ok && dph_gl_check("upload", err))) {
            dph_gpu_rows_finish(&rival->rows); /* so that it is not taken for whole */
            return NULL;
        }
    }
    return rival;
}

bool dph_rival_draw(struct dph_draw *draw, const struct dph_rival_pass *pass, struct dph_error *err)
{
    struct dph_renderer *renderer = draw->renderer;
    const struct dph_scene *scene = renderer->scene;
    struct dph_program *program = NULL;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_instance *instance = &scene->instance[i];
        const struct dph_body *body = &scene->body[instance->body];
        const struct dph_gpu_body *gpu = &renderer->body[instance->body];
        if (!gpu->count)
            continue;
        if (!pass->has(body))
            return dph_fail(err, DPH_ERROR_ARGUMENT, "pass %s: body %zu ('%.60s') has no %s",
                            pass->name, instance->body, body->name, pass->product);
        struct dph_rival_body *rival = rival_body(renderer, pass, instance->body, err);
        if (!rival)
            return false;
        struct dph_stages stages = {
            .vert = pass->vert, .frag = pass->frag, .weights = rival->vectors};
        if (!(program = dph_draw_program(draw, &stages, err)))
            return false;
        glUseProgram(program->id);
        dph_draw_material(draw, program);
        dph_draw_place(draw, program, instance, 0);
        if (pass->uniforms)
            pass->uniforms(draw, instance, rival, program);
        dph_draw_rows(gpu, &rival->rows);
        if (!dph_program_check(program, pass->name, err))
            return false;
    }
    glBindVertexArray(0);
    glBindTexture(GL_TEXTURE_BUFFER, 0);
    glBindBuffer(GL_TEXTURE_BUFFER, 0);
    return dph_gl_check(pass->name, err);
}

void dph_rival_destroy(struct dph_rival *rival, size_t nbody)
{
    if (!rival)
        return;
    for (int kind = 0; kind < DPH_RIVAL_KINDS; kind++) {
        for (size_t i = 0; rival->body[kind] && i < nbody; i++) {
            struct dph_rival_body *body = &rival->body[kind][i];
            dph_gpu_rows_finish(&body->rows);
            glDeleteBuffers(1, &body->buffer);
            glDeleteTextures(1, &body->texture);
            free(body->table);
        }
        free(rival->body[kind]);
    }
    free(rival);
}

/* The rotation in a matrix, row by row, and whether it mirrors; rows of the identity for a flat
 * one. */
static bool rotation_of(const float matrix[16], double rotation[9])
{
    double column[3][3];
    bool whole = true;
    for (int c = 0; c < 3 && whole; c++) {
        double length = 0;
        for (int r = 0; r < 3; r++)
            column[c][r] = (double)matrix[4 * c + r];
        for (int before = 0; before < c; before++) { /* Gram and Schmidt */
            double along = 0;
            for (int r = 0; r < 3; r++)
                along += column[c][r] * column[before][r];
            for (int r = 0; r < 3; r++)
                column[c][r] -= along * column[before][r];
        }
        for (int r = 0; r < 3; r++)
            length += column[c][r] * column[c][r];
        whole = length > 1e-30 && isfinite(length);
        for (int r = 0; r < 3 && whole; r++)
            column[c][r] /= sqrt(length);
    }
    double determinant = 0;
    for (int r = 0; r < 3 && whole; r++)
        determinant += column[0][r] * (column[1][(r + 1) % 3] * column[2][(r + 2) % 3] -
                                       column[1][(r + 2) % 3] * column[2][(r + 1) % 3]);
    double sign = determinant < 0 ? -1 : 1;
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            rotation[3 * r + c] = whole ? sign * column[c][r] : r == c;
    return determinant < 0;
}

void dph_prt_light(const struct dph_draw *draw, const struct dph_instance *instance, int bands,
                   float *incoming)
{
    const struct dph_frame *frame = draw->frame;
    double world[3][DPH_PRT_CHANNEL] = {{0}}, value[DPH_PRT_CHANNEL], turn[9], back[9];
    int n = bands * bands, padded = (n + 3) / 4 * 4;
    int used = frame->bands > 0 && frame->bands < bands ? frame->bands : bands;
    for (int i = 0; i < frame->nlight; i++) {
        const struct dph_light *light = &frame->light[i];
        double direction[3], length = 0;
        for (int k = 0; k < 3; k++)
            length += light->to_light[k] * light->to_light[k];
        if (!(length > 0))
            continue;
        for (int k = 0; k < 3; k++)
            direction[k] = light->to_light[k] / sqrt(length);
        dph_environment_disc(used, direction, light->angle, value);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < used * used; k++)
                world[c][k] += light->irradiance[c] * value[k];
    }
    for (int c = 0; frame->has_environment && c < 3; c++)
        for (int k = 0; k < used * used; k++)
            world[c][k] += frame->environment[c][k];
    bool mirrored = rotation_of(instance->matrix, turn);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            back[3 * r + c] = turn[3 * c + r];
    memset(incoming, 0, 3 * DPH_PRT_CHANNEL * sizeof *incoming);
    for (int c = 0; c < 3; c++) {
        dph_sh_rotate(used, back, world[c], value);
        for (int l = 0; l < used; l++)
            for (int k = l * l; k < (l + 1) * (l + 1); k++)
                incoming[c * padded + k] = (float)((mirrored && l % 2 ? -1 : 1) * value[k] *
                                                   dph_sh_window(frame->window, l, used));
    }
}
