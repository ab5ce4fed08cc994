/* thickness: what shsss takes for the thickness towards the first light, clamped at 0, in grey;
 * white is the diameter of the scene's bounding sphere. For looking at a bake without any material. */
#include "render/draw.h"

static void set_gain(const struct dph_draw *draw, struct dph_program *program)
{
    double diameter = 2 * draw->renderer->radius * draw->mm_per_unit;
    dph_set_float(program, "u_gain", (float)(1 / diameter));
}

static bool draw_thickness(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_pass pass = {.name = "thickness",
                                         .vert = "body.vert",
                                         .frag = "thickness.frag",
                                         .thickness = true,
                                         .uniforms = set_gain};
    return dph_draw_pass(draw, &pass, err);
}

const struct dph_method dph_method_thickness = {
    .name = "thickness",
    .title = "Thickness towards the first light",
    .paper = "A. Tomaszewska, K. Stefanowski, ICIAR 2012",
    .needs_thickness = true,
    .quantity = true,
    .local_lights = true,
    .draw = &(const struct dph_method_draw){.draw = draw_thickness},
};
