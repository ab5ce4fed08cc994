/* patro: changed normals, the plain shader.
 *
 * After Patro 2007 as Tomaszewska and Stefanowski describe it: the model's normals are replaced by
 * means of the normals around, as far as light scatters (diaphan/patro.h), and nothing else
 * changes. A mean of normals that disagree is short, and its length is kept: it lowers the
 * contrast. The highlight takes the changed normal, too. No light comes through a body. */
#include "render/rival.h"

#include <diaphan/rivals.h>

#include <string.h>

static bool has_normals(const struct dph_body *body)
{
    return body->rivals && body->rivals->normal;
}

static bool make(struct dph_rival_body *rival, const struct dph_gpu_body *gpu,
                 const struct dph_body *body, struct dph_error *err)
{
    unsigned char *data = dph_gpu_rows_fill(gpu, &body->mesh, 0, err);
    if (!data)
        return false;
    for (size_t r = 0; r < gpu->nvert; r++)
        memcpy(data + r * DPH_ROW + DPH_ROW / 2,
               body->rivals->normal + 3 * dph_gpu_vertex(gpu, &body->mesh, r), DPH_ROW / 2);
    dph_gpu_rows_upload(&rival->rows, gpu, data, 0);
    return true;
}

static bool draw_patro(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_rival_pass pass = {.name = "patro",
                                               .vert = "patro.vert",
                                               .frag = "patro.frag",
                                               .kind = DPH_RIVAL_PATRO,
                                               .product = "changed normals",
                                               .has = has_normals,
                                               .make = make};
    return dph_rival_draw(draw, &pass, err);
}

const struct dph_method dph_method_patro = {
    .name = "patro",
    .title = "Changed normals",
    .paper = "R. Patro, 2007, after A. Tomaszewska, K. Stefanowski, ICIAR 2012",
    .local_lights = true,
    .needs = DPH_PRODUCT_NORMALS,
    .draw = &(const struct dph_method_draw){.draw = draw_patro},
};
