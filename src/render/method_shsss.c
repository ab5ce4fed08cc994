/* shsss: thickness towards each light from spherical harmonics, in one pass for all lights.
 *
 * A. Tomaszewska, K. Stefanowski, "Real-time spherical harmonics based subsurface scattering",
 * ICIAR 2012. Their split: the CPU evaluates the basis in the light's direction (shade/light.c),
 * the vertex stage sums coefficient times value (body.vert), the fragment stage clamps the
 * interpolated thickness and turns it into radiance (dph_radiance in diaphan.glsl, formula G or the
 * paper's own sum). */
#include "render/draw.h"

static bool draw_shsss(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_pass pass = {.name = "shsss",
                                         .vert = "body.vert",
                                         .frag = "shsss.frag",
                                         .thickness = true,
                                         .uniforms = dph_draw_material};
    return dph_draw_pass(draw, &pass, err);
}

const struct dph_method dph_method_shsss = {
    .name = "shsss",
    .title = "Spherical harmonics based subsurface scattering",
    .paper = "A. Tomaszewska, K. Stefanowski, ICIAR 2012",
    .needs_thickness = true,
    .local_lights = true,
    .draw = &(const struct dph_method_draw){.draw = draw_shsss},
};
