/* green, green-gauss: thickness from depth maps.
 *
 * S. Green, "Real-time approximations to subsurface scattering", GPU Gems, chapter 16, 2004. A pass
 * from each light stores how far away the first surface is, d_i, in a float map; drawing takes
 * s = d_o - d_i - bias as the length of the way inside, d_o being the distance of the point that is
 * shaded. Distances are linear: planar along a distant light, radial from a point or a spot light.
 * The map's geometry is pushed out by `grow`, along one normal a position so that no edge comes
 * apart, and the stored distance is that of the unmoved surface. What counts as inside is
 * everything between the first surface and the point, gaps included, and all bodies of the scene.
 *
 * green-gauss blurs the maps by a separable Gaussian whose sigma is a length in mm, in texels at
 * the distance of the scene's centre. Texels hold (d, 1) or (0, 0), so filters of any kind, the box
 * filter of smaller levels and the bilinear one of the lookup too, give a weighted sum and its
 * weight. A wide Gaussian is taken on a smaller level, where it is two to four texels, less the
 * variance that the box filter has brought in, (4^level - 1)/12 texels.
 *
 * Lengths here are in units of the scene's radius around its centre. A distant light looks along an
 * orthographic box around the bounding sphere from two radii away. A point light looks at the
 * centre through a window that holds the sphere, of at most 160 degrees; a spot light through its
 * own cone, where that is narrower. What the window does not hold has thickness 0. */
#include "render/draw.h"

#include "core/fail.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GROW 0.005
#define BIAS 0.01
#define MARGIN 1.02      /* of the box around the sphere */
#define WIDEST_SIGMA 4.0 /* texels, on the level that is blurred */
#define MOST_BYTES ((size_t)2 << 30)
#define DEGREE (3.14159265358979323846 / 180)

struct green_light {
    float clip[16];
    float from[4];
    double span; /* what the map shows at the centre's distance */
};

struct dph_green {
    int size, layers;
    bool gauss; /* `blurred` is the one that is drawn with               */
    GLuint map; /* (size x size x layers) RG32F                          */
    GLuint depth, frame;
    GLuint half, blurred; /* blurred along x: 1 layer; along both: all layers      */
    int blurred_size, blurred_layers;
    GLuint nothing; /* a vertex array without attributes                     */
    struct green_light light[DPH_MAX_LIGHTS];
};

void dph_green_destroy(struct dph_green *green)
{
    if (!green)
        return;
    GLuint textures[3] = {green->map, green->half, green->blurred};
    glDeleteTextures(3, textures);
    glDeleteRenderbuffers(1, &green->depth);
    glDeleteFramebuffers(1, &green->frame);
    glDeleteVertexArrays(1, &green->nothing);
    free(green);
}

/* (Re)makes an array of maps without content. */
static void make_maps(GLuint *name, int size, int layers)
{
    glDeleteTextures(1, name);
    glGenTextures(1, name);
    glBindTexture(GL_TEXTURE_2D_ARRAY, *name);
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RG32F, size, size, layers, 0, GL_RG, GL_FLOAT, NULL);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
}

/* Makes the maps fit the frame; keeps them where they do. */
static bool fit_maps(struct dph_renderer *renderer, const struct dph_frame *frame,
                     struct dph_error *err)
{
    struct dph_green *green = renderer->green;
    if (!green) {
        if (!(green = renderer->green = calloc(1, sizeof *green)))
            return dph_fail_memory(err);
        glGenVertexArrays(1, &green->nothing);
        glGenFramebuffers(1, &green->frame);
    }
    if (green->size == frame->map_size && green->layers == frame->nlight)
        return true;
    GLint largest = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
    if (frame->map_size > largest)
        return dph_fail(err, DPH_ERROR_CAPABILITY, "depth maps of %d texels: GL has at most %d",
                        frame->map_size, (int)largest);
    size_t bytes = 8 * (size_t)frame->map_size * (size_t)frame->map_size * (size_t)frame->nlight;
    if (bytes > MOST_BYTES)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "%d depth maps of %d texels a side take %zu MiB, more than %zu",
                        frame->nlight, frame->map_size, bytes >> 20, MOST_BYTES >> 20);
    green->size = 0; /* until all of it is there */
    make_maps(&green->map, frame->map_size, frame->nlight);
    glDeleteRenderbuffers(1, &green->depth);
    glGenRenderbuffers(1, &green->depth);
    glBindRenderbuffer(GL_RENDERBUFFER, green->depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, frame->map_size, frame->map_size);
    glBindRenderbuffer(GL_RENDERBUFFER, 0);
    if (!dph_gl_check("depth maps", err))
        return false;
    green->size = frame->map_size;
    green->layers = frame->nlight;
    return true;
}

/* Two unit vectors that are orthogonal to a third. */
static void basis(const double axis[3], double right[3], double up[3])
{
    int least = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(axis[k]) < fabs(axis[least]))
            least = k;
    double length = sqrt(1 - axis[least] * axis[least]);
    for (int k = 0; k < 3; k++)
        right[k] = ((k == least) - axis[least] * axis[k]) / length;
    for (int k = 0; k < 3; k++)
        up[k] = axis[(k + 1) % 3] * right[(k + 2) % 3] - axis[(k + 2) % 3] * right[(k + 1) % 3];
}

static double normalise(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++)
        v[k] = length > 0 ? v[k] / length : k == 2;
    return length;
}

static void look_from_afar(struct green_light *map, const struct dph_light *light)
{
    double to_light[3], right[3], up[3], half = MARGIN + GROW, near = .9, far = 3.1;
    memcpy(to_light, light->to_light, sizeof to_light);
    normalise(to_light);
    basis(to_light, right, up);
    for (int k = 0; k < 3; k++) {
        map->clip[4 * k] = (float)(right[k] / half);
        map->clip[4 * k + 1] = (float)(up[k] / half);
        map->clip[4 * k + 2] = (float)(-2 * to_light[k] / (far - near)); /* of 2 - to_light . p */
        map->clip[4 * k + 3] = 0;
        map->from[k] = (float)to_light[k];
    }
    map->clip[12] = map->clip[13] = 0;
    map->clip[14] = (float)((4 - far - near) / (far - near));
    map->clip[15] = 1;
    map->from[3] = 0;
    map->span = 2 * half;
}

static void look_from_point(struct green_light *map, const struct dph_light *light,
                            const double centre[3], double radius)
{
    const double widest = 80 * DEGREE;
    double from[3], axis[3], right[3], up[3], spot[3];
    for (int k = 0; k < 3; k++) {
        from[k] = (light->position[k] - centre[k]) / radius;
        axis[k] = -from[k];
        spot[k] = -light->to_light[k];
    }
    double away = normalise(axis), half = away > MARGIN ? asin(MARGIN / away) * MARGIN : widest;
    half = fmin(half, widest);
    if (light->kind == DPH_LIGHT_SPOT && light->angle * DEGREE < half) {
        normalise(spot);
        memcpy(axis, spot, sizeof axis);
        half = light->angle * DEGREE;
    }
    basis(axis, right, up);
    double scale = 1 / tan(half), near = fmax(away - MARGIN, .01), far = away + MARGIN;
    for (int k = 0; k < 3; k++) {
        map->clip[4 * k] = (float)(scale * right[k]);
        map->clip[4 * k + 1] = (float)(scale * up[k]);
        map->clip[4 * k + 2] = (float)((far + near) / (far - near) * axis[k]);
        map->clip[4 * k + 3] = (float)axis[k];
        map->from[k] = (float)from[k];
    }
    const double *row[4] = {right, up, axis, axis};
    for (int r = 0; r < 4; r++) {
        double sum = r == 2 ? -2 * far * near / (far - near) : 0;
        double factor = r < 2 ? scale : r == 2 ? (far + near) / (far - near) : 1;
        for (int k = 0; k < 3; k++)
            sum -= factor * row[r][k] * from[k];
        map->clip[12 + r] = (float)sum;
    }
    map->from[3] = 1;
    map->span = 2 * fmax(away, .1) / scale;
}

/* The scene as light i sees it, into its layer. */
static bool draw_depth(struct dph_draw *draw, int i, struct dph_error *err)
{
    struct dph_renderer *renderer = draw->renderer;
    struct dph_green *green = renderer->green;
    const struct dph_scene *scene = renderer->scene;
    static const struct dph_stages stages = {.vert = "green_depth.vert",
                                             .frag = "green_depth.frag"};
    struct dph_program *program = dph_draw_program(draw, &stages, err);
    if (!program)
        return false;
    glBindFramebuffer(GL_FRAMEBUFFER, green->frame);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, green->map, 0, i);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, green->depth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return dph_fail(err, DPH_ERROR_CAPABILITY, "no float map of %d texels", green->size);
    glViewport(0, 0, green->size, green->size);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(program->id);
    dph_set_mat(program, "u_light", 4, green->light[i].clip);
    dph_set_vec(program, "u_from", 4, 1, green->light[i].from);
    dph_set_float(program, "u_grow", (float)GROW);
    for (size_t n = 0; n < scene->ninstance; n++) {
        const struct dph_instance *instance = &scene->instance[n];
        const struct dph_gpu_body *gpu = &renderer->body[instance->body];
        float place[16], clip[16], normal[9];
        if (!gpu->count)
            continue;
        dph_draw_matrices(renderer, instance, renderer->centre, green->light[i].clip, place, clip,
                          normal);
        dph_set_mat(program, "u_place", 4, place);
        dph_set_mat(program, "u_normal", 3, normal);
        dph_draw_rows(gpu, &gpu->plain);
    }
    glBindVertexArray(0);
    return dph_program_check(program, "depth map", err);
}

/* Which level is blurred, and by how many of its texels. */
static int blur_level(const struct dph_draw *draw, const struct green_light *map, double *sigma)
{
    double mm = draw->frame->blur_mm;
    if (mm < 0) {
        struct dph_medium medium;
        dph_material_medium(&draw->frame->material, &medium);
        double extinction = medium.reduced_scattering[1] + draw->frame->material.absorption[1];
        mm = extinction > 0 ? 1 / extinction : 0;
    }
    double texel = map->span * draw->renderer->radius * draw->mm_per_unit / draw->frame->map_size;
    double texels = fmin(mm / texel, draw->frame->map_size); /* wider makes no difference */
    int level = 0;
    while (texels / (1 << level) > WIDEST_SIGMA && draw->frame->map_size >> level > 16)
        level++;
    double box = ((1 << 2 * level) - 1) / 12.0;
    *sigma = sqrt(fmax(texels * texels - box, 0)) / (1 << level);
    return level;
}

static bool blur_pass(struct dph_draw *draw, GLuint source, GLuint target, int layer, int level,
                      int target_layer, double sigma, int axis, struct dph_error *err)
{
    static const struct dph_stages stages = {.vert = "green_blur.vert", .frag = "green_blur.frag"};
    struct dph_program *program = dph_draw_program(draw, &stages, err);
    if (!program)
        return false;
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, target, 0, target_layer);
    glUseProgram(program->id);
    glBindTexture(GL_TEXTURE_2D_ARRAY, source);
    dph_set_int(program, "u_source", 0);
    dph_set_int(program, "u_layer", layer);
    dph_set_int(program, "u_level", level);
    dph_set_int(program, "u_axis", axis);
    dph_set_float(program, "u_rate", sigma > 0 ? (float)(.5 / (sigma * sigma)) : 0);
    dph_set_int(program, "u_reach", (int)ceil(3 * sigma));
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return dph_program_check(program, "blur", err);
}

/* All maps are blurred on one level, the finest that one of them needs, so that they share an
 * array. */
static bool blur_maps(struct dph_draw *draw, struct dph_error *err)
{
    struct dph_green *green = draw->renderer->green;
    double sigma[DPH_MAX_LIGHTS];
    int level = 99;
    for (int i = 0; i < draw->frame->nlight; i++) {
        int wanted = blur_level(draw, &green->light[i], &sigma[i]);
        level = wanted < level ? wanted : level;
    }
    for (int i = 0; i < draw->frame->nlight; i++) { /* what a coarser level would have had, here */
        int own = blur_level(draw, &green->light[i], &sigma[i]);
        double square = sigma[i] * sigma[i] * (1 << 2 * own) + ((1 << 2 * own) - 1) / 12.0;
        sigma[i] = sqrt(fmax(square - ((1 << 2 * level) - 1) / 12.0, 0)) / (1 << level);
    }
    int size = green->size >> level;
    if (green->blurred_size != size || green->blurred_layers != green->layers) {
        green->blurred_size = 0;
        make_maps(&green->half, size, 1);
        make_maps(&green->blurred, size, green->layers);
        if (!dph_gl_check("blurred maps", err))
            return false;
        green->blurred_size = size;
        green->blurred_layers = green->layers;
    }
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D_ARRAY, green->map);
    if (level > 0) { /* a filter that asks for levels makes them readable */
        glGenerateMipmap(GL_TEXTURE_2D_ARRAY);
        glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_NEAREST);
    }
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, 0);
    glViewport(0, 0, size, size);
    glDisable(GL_DEPTH_TEST);
    glBindVertexArray(green->nothing);
    bool ok = true;
    for (int i = 0; i < draw->frame->nlight && ok; i++)
        ok = blur_pass(draw, green->map, green->half, i, level, 0, sigma[i], 0, err) &&
             blur_pass(draw, green->half, green->blurred, 0, 0, i, sigma[i], 1, err);
    glBindTexture(GL_TEXTURE_2D_ARRAY, green->map);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
    glBindVertexArray(0);
    glEnable(GL_DEPTH_TEST);
    return ok;
}

static bool prepare(struct dph_draw *draw, bool gauss, struct dph_error *err)
{
    struct dph_renderer *renderer = draw->renderer;
    if (!fit_maps(renderer, draw->frame, err))
        return false;
    struct dph_green *green = renderer->green;
    green->gauss = gauss;
    for (size_t i = 0; i < renderer->scene->nbody; i++)
        if (!dph_gpu_body_outward(&renderer->body[i], &renderer->scene->body[i], err))
            return false;
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE); /* open sheets have two sides */
    bool ok = true;
    for (int i = 0; i < draw->frame->nlight && ok; i++) {
        const struct dph_light *light = &draw->frame->light[i];
        if (light->kind == DPH_LIGHT_DISTANT)
            look_from_afar(&green->light[i], light);
        else
            look_from_point(&green->light[i], light, renderer->centre, renderer->radius);
        ok = draw_depth(draw, i, err);
    }
    ok = ok && (!gauss || blur_maps(draw, err));
    glUseProgram(0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return ok;
}

static bool prepare_plain(struct dph_draw *draw, struct dph_error *err)
{
    return prepare(draw, false, err);
}

static bool prepare_gauss(struct dph_draw *draw, struct dph_error *err)
{
    return prepare(draw, true, err);
}

static void map_uniforms(const struct dph_draw *draw, struct dph_program *program)
{
    const struct dph_renderer *renderer = draw->renderer;
    const struct dph_green *green = renderer->green;
    float eye[3];
    for (int k = 0; k < 3; k++)
        eye[k] = (float)((draw->eye[k] - renderer->centre[k]) / renderer->radius);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D_ARRAY, green->gauss ? green->blurred : green->map);
    dph_set_int(program, "u_map", 0);
    dph_set_vec(program, "u_eye", 3, 1, eye);
    dph_set_float(program, "u_bias", (float)BIAS);
    dph_set_float(program, "u_millimetres", (float)(renderer->radius * draw->mm_per_unit));
    for (int i = 0; i < draw->frame->nlight; i++) {
        char name[2][40];
        snprintf(name[0], sizeof name[0], "u_green[%d].clip", i);
        snprintf(name[1], sizeof name[1], "u_green[%d].from", i);
        dph_set_mat(program, name[0], 4, green->light[i].clip);
        dph_set_vec(program, name[1], 4, 1, green->light[i].from);
    }
}

static void uniforms(const struct dph_draw *draw, struct dph_program *program)
{
    dph_draw_material(draw, program);
    map_uniforms(draw, program);
}

static bool draw_green(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_pass pass = {
        .name = "green", .vert = "body.vert", .frag = "green.frag", .uniforms = uniforms};
    bool ok = dph_draw_pass(draw, &pass, err);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
    return ok;
}

/* A map of two floats and the depth buffer, which the lights share. */
static void cost_plain(const struct dph_draw *draw, struct dph_cost *cost)
{
    size_t texels = (size_t)draw->frame->map_size * (size_t)draw->frame->map_size;
    cost->passes += draw->frame->nlight;
    cost->bytes_per_vertex += 4; /* the direction of growth */
    cost->table_bytes += texels * (8 * (size_t)draw->frame->nlight + 4);
}

/* Two passes more a light, and at most as many blurred maps; what is there is known once it was
 * drawn. */
static void cost_gauss(const struct dph_draw *draw, struct dph_cost *cost)
{
    const struct dph_green *green = draw->renderer->green;
    cost_plain(draw, cost);
    cost->passes += 2 * draw->frame->nlight;
    size_t side =
        (size_t)(green && green->blurred_size ? green->blurred_size : draw->frame->map_size);
    size_t lights = (size_t)draw->frame->nlight, whole = (size_t)draw->frame->map_size;
    cost->table_bytes += 8 * side * side * (lights + 1);
    if (side < whole) /* the smaller levels */
        cost->table_bytes += 8 * lights * whole * whole / 3;
}

const struct dph_method dph_method_green = {
    .name = "green",
    .title = "Depth map",
    .paper = "S. Green, GPU Gems, chapter 16, 2004",
    .local_lights = true,
    .draw = &(const struct dph_method_draw){.prepare = prepare_plain,
                                            .draw = draw_green,
                                            .probe = "green_probe.vert",
                                            .probe_uniforms = map_uniforms,
                                            .cost = cost_plain},
};

const struct dph_method dph_method_green_gauss = {
    .name = "green-gauss",
    .title = "Depth map, blurred",
    .paper = "S. Green, GPU Gems, chapter 16, 2004",
    .local_lights = true,
    .draw = &(const struct dph_method_draw){.prepare = prepare_gauss,
                                            .draw = draw_green,
                                            .probe = "green_probe.vert",
                                            .probe_uniforms = map_uniforms,
                                            .cost = cost_gauss},
};
