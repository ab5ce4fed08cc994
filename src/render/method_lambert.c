/* lambert: plain shading with the material's diffuse reflectance as albedo. The base line of cost
 * and of looks: J. H. Lambert's cosine law, with Blinn-Phong's highlight where the material asks
 * for one. */
#include "render/draw.h"

static bool draw_lambert(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_pass pass = {.name = "lambert",
                                         .vert = "body.vert",
                                         .frag = "lambert.frag",
                                         .uniforms = dph_draw_material};
    return dph_draw_pass(draw, &pass, err);
}

const struct dph_method dph_method_lambert = {
    .name = "lambert",
    .title = "Lambert",
    .paper = "J. H. Lambert, Photometria, 1760",
    .local_lights = true,
    .draw = &(const struct dph_method_draw){.draw = draw_lambert},
};
