/* patro: changed normals, the plain shader.
 *
 * After Patro 2007 as Tomaszewska and Stefanowski describe it: the model's normals are replaced by
 * means of the normals around, as far as light scatters (diaphan/patro.h), and nothing else
 * changes. A mean of normals that disagree is short, and its length is kept: it lowers the
 * contrast. The highlight takes the changed normal, too. No light comes through a body. */
#include "render/rival.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/rivals.h>

#include <stdlib.h>
#include <string.h>

static bool make(struct dph_rival_body *rival, const struct dph_gpu_body *gpu,
                 const struct dph_body *body, struct dph_error *err)
{
    float *row = dph_alloc(gpu->nvert, 3 * sizeof *row);
    if (!row)
        return dph_fail_memory(err);
    for (size_t r = 0; r < gpu->nvert; r++)
        memcpy(row + 3 * r, body->rivals->normal + 3 * (gpu->expanded ? body->mesh.index[r] : r),
               3 * sizeof *row);
    dph_rival_array(rival, gpu);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(gpu->nvert * 3 * sizeof *row), row, GL_STATIC_DRAW);
    free(row);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, 0, NULL);
    return true;
}

static bool draw_patro(struct dph_draw *draw, struct dph_error *err)
{
    struct dph_renderer *renderer = draw->renderer;
    const struct dph_scene *scene = renderer->scene;
    struct dph_program *program =
        dph_draw_program(renderer, "patro.vert", "patro.frag", NULL, draw->frame, 0, err);
    if (!program)
        return false;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_instance *instance = &scene->instance[i];
        const struct dph_body *body = &scene->body[instance->body];
        const struct dph_gpu_body *gpu = &renderer->body[instance->body];
        if (!gpu->count)
            continue;
        if (!body->rivals || !body->rivals->normal)
            return dph_fail(err, DPH_ERROR_ARGUMENT,
                            "pass patro: body %zu ('%.60s') has no changed normals", instance->body,
                            body->name);
        struct dph_rival_body *rival =
            dph_rival_body(renderer, DPH_RIVAL_PATRO, instance->body, make, err);
        if (!rival)
            return false;
        glUseProgram(program->id);
        dph_draw_material(draw, program);
        dph_draw_place(draw, program, instance, 0);
        dph_draw_arrays(gpu, rival->array);
    }
    glBindVertexArray(0);
    return dph_program_check(program, "patro", err);
}

const struct dph_method dph_method_patro = {
    .name = "patro",
    .title = "Changed normals",
    .paper = "R. Patro, 2007, after A. Tomaszewska, K. Stefanowski, ICIAR 2012",
    .local_lights = true,
    .needs = DPH_PRODUCT_NORMALS,
    .draw = &(const struct dph_method_draw){.draw = draw_patro},
};
