/* A scene on the GPU, and frames of it: camera, target, method, read back.
 *
 * The camera looks at the centre of the scene's bounding box from `distance` radii of its bounding
 * sphere; the sphere also gives the near and the far plane. Large pictures are drawn in tiles, as
 * large as a target gets (target.c). The background is composited after the samples are averaged:
 * color + (1 - coverage) * background. */
#include <diaphan/render.h>

#include "core/fail.h"
#include "core/memory.h"
#include "render/draw.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)

struct dph_frame dph_frame_defaults(void)
{
    struct dph_frame frame = {
        .method = &dph_method_shsss,
        .material = *dph_material_preset(0),
        .camera = {.azimuth = 0, .elevation = 15, .distance = 3.5, .fov = 35},
        .nlight = 1,
        .width = 1280,
        .height = 800,
        .window = DPH_WINDOW_NONE,
        .samples = 4,
        .map_size = 1024,
        .blur_mm = -1,
    };
    dph_light_direction(150, 30, frame.light[0].to_light);
    for (int c = 0; c < 3; c++)
        frame.light[0].irradiance[c] = 3.14159265358979323846;
    return frame;
}

struct dph_renderer *dph_renderer_create(const struct dph_scene *scene, struct dph_error *err)
{
    return dph_renderer_create_with(scene, NULL, err);
}

struct dph_renderer *dph_renderer_create_with(const struct dph_scene *scene,
                                              const struct dph_renderer_params *params,
                                              struct dph_error *err)
{
    const bool unshared = params && params->unshared;
    if (epoxy_gl_version() < 33 || !epoxy_is_desktop_gl()) {
        dph_fail(err, DPH_ERROR_CAPABILITY, "drawing needs a context of GL 3.3");
        return NULL;
    }
    struct dph_renderer *renderer = calloc(1, sizeof *renderer);
    if (!renderer || !(renderer->body = dph_alloc_zero(scene->nbody, sizeof *renderer->body))) {
        dph_fail_memory(err);
        free(renderer);
        return NULL;
    }
    renderer->scene = scene;
    renderer->unshared = unshared;
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double side = scene->bounds[1][k] - scene->bounds[0][k];
        renderer->centre[k] = scene->bounds[0][k] + side / 2;
        sum += side * side;
    }
    renderer->radius = sqrt(sum) / 2;
    if (!(renderer->radius > 0) ||
        !isfinite(renderer->radius)) { /* a scene of nothing, or of a point */
        renderer->radius = 1;
        for (int k = 0; k < 3; k++)
            if (!isfinite(renderer->centre[k]))
                renderer->centre[k] = 0;
    }
    for (size_t i = 0; i < scene->nbody; i++)
        if (!dph_gpu_body_init(&renderer->body[i], &scene->body[i], unshared, err)) {
            dph_renderer_destroy(renderer);
            return NULL;
        }
    return renderer;
}

void dph_renderer_destroy(struct dph_renderer *renderer)
{
    if (!renderer)
        return;
    for (size_t i = 0; i < renderer->scene->nbody; i++)
        dph_gpu_body_finish(&renderer->body[i]);
    dph_target_finish(&renderer->target);
    dph_green_destroy(renderer->green);
    dph_rival_destroy(renderer->rival, renderer->scene->nbody);
    dph_stand_in_destroy(renderer->stand_in, renderer->scene->nbody);
    while (renderer->variants) {
        struct dph_variant *next = renderer->variants->next;
        dph_program_finish(&renderer->variants->program);
        free(renderer->variants);
        renderer->variants = next;
    }
    free(renderer->body);
    free(renderer);
}

/* Positions relative to the eye, in radii, to clip space; column-major. */
static void make_camera(struct dph_draw *draw)
{
    const struct dph_camera *camera = &draw->frame->camera;
    double a = camera->azimuth * DEGREE, e = camera->elevation * DEGREE, back[3];
    dph_light_direction(camera->azimuth, camera->elevation, back);
    /* the derivatives of the direction by its angles: orthogonal to it at the poles, too */
    const double right[3] = {cos(a), 0, -sin(a)},
                 up[3] = {-sin(e) * sin(a), cos(e), -sin(e) * cos(a)};
    double radius = draw->renderer->radius;
    for (int k = 0; k < 3; k++)
        draw->eye[k] = draw->renderer->centre[k] + camera->distance * radius * back[k];
    double near = fmax(camera->distance - 1.01, 1e-3), far = camera->distance + 1.01;
    double scale = 1 / tan(camera->fov * DEGREE / 2);
    double aspect = (double)draw->frame->width / draw->frame->height;
    for (int k = 0; k < 3; k++) {
        draw->clip[4 * k] = (float)(scale / aspect * right[k]);
        draw->clip[4 * k + 1] = (float)(scale * up[k]);
        draw->clip[4 * k + 2] = (float)(-(far + near) / (far - near) * back[k]);
        draw->clip[4 * k + 3] = (float)-back[k];
    }
    draw->clip[14] = (float)(-2 * far * near / (far - near));
}

static bool takes_lights(const struct dph_method *method, const struct dph_frame *frame)
{
    for (int i = 0; i < frame->nlight; i++)
        if (frame->light[i].kind != DPH_LIGHT_DISTANT && !method->local_lights)
            return false;
    return method->environment || !frame->has_environment;
}

bool dph_frame_check_lights(const struct dph_frame *frame, struct dph_error *err)
{
    char names[256] = "";
    size_t length = 0;
    const struct dph_method *method;
    if (frame->nlight < 1 || frame->nlight > DPH_MAX_LIGHTS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d lights: 1 to %d are drawn", frame->nlight,
                        DPH_MAX_LIGHTS);
    if (takes_lights(frame->method, frame))
        return true;
    for (size_t i = 0; (method = dph_method_at(i)); i++)
        if (takes_lights(method, frame) && length < sizeof names)
            length += (size_t)snprintf(names + length, sizeof names - length, "%s%s",
                                       length ? ", " : "", method->name);
    bool local = !frame->has_environment || frame->method->environment;
    return dph_fail(err, DPH_ERROR_ARGUMENT, "method %s cannot be lit by %s; these can: %s",
                    frame->method->name, local ? "point and spot lights" : "surroundings",
                    length ? names : "none");
}

/* Finite numbers where they count, so that no matrix is built of others. */
static bool check_light(const struct dph_light *light, int i, struct dph_error *err)
{
    double sum = light->angle;
    for (int k = 0; k < 3; k++)
        sum += fabs(light->to_light[k]) + fabs(light->irradiance[k]) + fabs(light->position[k]);
    bool ok = isfinite(sum) && light->angle >= 0 && light->angle <= 90;
    if (ok && light->kind == DPH_LIGHT_SPOT)
        ok = light->angle > 0 && light->angle < 90 &&
             (light->to_light[0] != 0 || light->to_light[1] != 0 || light->to_light[2] != 0);
    return ok || dph_fail(err, DPH_ERROR_ARGUMENT, "light %d: a number is out of range", i);
}

bool dph_draw_begin(struct dph_draw *draw, struct dph_renderer *renderer,
                    const struct dph_frame *frame, struct dph_error *err)
{
    const struct dph_camera *camera = &frame->camera;
    if (!frame->method)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a frame needs a method");
    if (!dph_frame_check_lights(frame, err))
        return false;
    for (int i = 0; i < frame->nlight; i++)
        if (!check_light(&frame->light[i], i, err))
            return false;
    if (frame->map_size < 16 || frame->map_size > 8192 || frame->map_size & (frame->map_size - 1))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "maps of %d texels: a power of two, 16 to 8192",
                        frame->map_size);
    if (isnan(frame->blur_mm))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a blur of %g mm", frame->blur_mm);
    for (int i = 0; frame->has_environment && i < 3 * DPH_DRAW_BANDS * DPH_DRAW_BANDS; i++)
        if (!isfinite(frame->environment[i % 3][i / 3]))
            return dph_fail(err, DPH_ERROR_ARGUMENT, "surroundings whose light is not a number");
    if (!(camera->distance > 0 && camera->distance <= 1e6) || !isfinite(camera->azimuth) ||
        !isfinite(camera->elevation))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "camera at azimuth %g, elevation %g, distance %g",
                        camera->azimuth, camera->elevation, camera->distance);
    if (!(camera->fov >= 0.01 && camera->fov <= 175))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "field of view %g: 0.01 to 175 degrees",
                        camera->fov);
    if (frame->width < 1 || frame->height < 1 || frame->samples < 1 || frame->samples > 16)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d x %d pixels with %d samples", frame->width,
                        frame->height, frame->samples);
    *draw = (struct dph_draw){.renderer = renderer, .frame = frame};
    dph_material_constants(&frame->material, &draw->material);
    draw->mm_per_unit = frame->mm_per_unit > 0 ? frame->mm_per_unit : renderer->scene->mm_per_unit;
    if (!(draw->mm_per_unit > 0)) {
        double largest = dph_scene_size(renderer->scene);
        draw->mm_per_unit = largest > 0 ? 25 / largest : 1;
    }
    make_camera(draw);
    return true;
}

/* Turns rows from the bottom into rows from the top and puts the background behind. */
static void finish_image(struct dph_image *image, const double background[3])
{
    size_t row = (size_t)image->width * 4, rows = (size_t)image->height;
    for (size_t y = 0; y < rows / 2; y++)
        for (size_t i = 0; i < row; i++) {
            float *a = image->pixel + y * row + i, *b = image->pixel + (rows - 1 - y) * row + i,
                  swap = *a;
            *a = *b;
            *b = swap;
        }
    for (size_t i = 0; i < rows * row; i += 4)
        for (size_t c = 0; c < 3; c++)
            image->pixel[i + c] += (1 - image->pixel[i + 3]) * (float)background[c];
}

/* Draws the part of the frame whose lower left pixel is (x, y) into the target. */
static bool draw_tile(struct dph_draw *draw, const struct dph_target *target, const float clip[16],
                      int x, int y, int width, int height, struct dph_error *err)
{
    double w = draw->frame->width, h = draw->frame->height;
    for (int c = 0; c < 4; c++) { /* stretch clip space so that the tile fills it */
        const float *in = clip + 4 * c;
        float *out = draw->clip + 4 * c;
        out[0] = (float)((double)in[0] * w / width - (double)in[3] * (2 * x + width - w) / width);
        out[1] =
            (float)((double)in[1] * h / height - (double)in[3] * (2 * y + height - h) / height);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, target->frame);
    glViewport(0, 0, width * target->finer, height * target->finer);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE); /* open sheets have two sides */
    bool ok = draw->frame->method->draw->draw(draw, err);
    glFrontFace(GL_CCW);
    glUseProgram(0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return ok;
}

bool dph_draw_frame(struct dph_draw *draw, struct dph_target *target, struct dph_image *image,
                    struct dph_error *err)
{
    const struct dph_frame *frame = draw->frame;
    float clip[16];
    dph_gl_drain();
    if (frame->method->draw->prepare && !frame->method->draw->prepare(draw, err))
        return false;
    if (!dph_target_fit(target, frame->width, frame->height, frame->samples, err))
        return false;
    memcpy(clip, draw->clip, sizeof clip);
    for (int y = 0; y < frame->height; y += target->height)
        for (int x = 0; x < frame->width; x += target->width) {
            int left = frame->width - x, above = frame->height - y;
            int width = left < target->width ? left : target->width;
            int height = above < target->height ? above : target->height;
            size_t corner = 4 * ((size_t)y * (size_t)frame->width + (size_t)x);
            if (!draw_tile(draw, target, clip, x, y, width, height, err))
                return false;
            if (!image && target->samples > 1)
                dph_target_resolve(target, width, height);
            if (image && !dph_target_read(target, width, height, image->pixel + corner,
                                          frame->width, err))
                return false;
        }
    return true;
}

bool dph_renderer_draw(struct dph_renderer *renderer, const struct dph_frame *frame,
                       struct dph_image *image, struct dph_error *err)
{
    struct dph_draw draw;
    if (!dph_draw_begin(&draw, renderer, frame, err))
        return false;
    if (!image->pixel || image->width != frame->width || image->height != frame->height)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a frame of %d x %d for an image of %d x %d",
                        frame->width, frame->height, image->width, image->height);
    if (!dph_draw_frame(&draw, &renderer->target, image, err))
        return false;
    finish_image(image, frame->background);
    return true;
}

bool dph_renderer_thickness(struct dph_renderer *renderer, const struct dph_frame *frame,
                            size_t instance, float *thickness, struct dph_error *err)
{
    struct dph_draw draw;
    if (!dph_draw_begin(&draw, renderer, frame, err))
        return false;
    const struct dph_method_draw *how = frame->method->draw;
    struct dph_frame one = *frame;
    one.nlight = 1;
    draw.frame = &one;
    if (how->stand_in && !how->stand_in(&draw, err))
        return false;
    renderer = draw.renderer;
    const struct dph_scene *scene = renderer->scene;
    if (instance >= scene->ninstance)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "instance %zu of %zu", instance, scene->ninstance);
    const struct dph_instance *placed = &scene->instance[instance];
    const struct dph_gpu_body *gpu = &renderer->body[placed->body];
    const struct dph_mesh *mesh = &scene->body[placed->body].mesh;
    memset(thickness, 0, mesh->nvert * sizeof *thickness);
    if (!gpu->count)
        return true;
    if (!gpu->vectors && !how->probe)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "body %zu is not baked", placed->body);
    dph_gl_drain();
    /* nothing is drawn, but without a window GL wants a framebuffer all the same */
    if (!renderer->target.frame && !dph_target_fit(&renderer->target, 16, 16, 1, err))
        return false;
    if (how->probe && how->prepare && !how->prepare(&draw, err))
        return false;
    struct dph_stages stages = {.vert = how->probe ? how->probe : dph_draw_vert(gpu, "body.vert"),
                                .feedback = "v_thickness",
                                .vectors = how->probe ? 0 : gpu->vectors,
                                .bytes = how->probe ? 0 : gpu->bytes};
    struct dph_program *program = dph_draw_program(&draw, &stages, err);
    float *row = program ? dph_alloc(gpu->nvert, sizeof *row) : NULL;
    if (!row)
        return program && dph_fail_memory(err);
    GLsizeiptr bytes = (GLsizeiptr)(gpu->nvert * sizeof *row);
    GLuint buffer;
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
    glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, NULL, GL_STREAM_READ);
    glBindFramebuffer(GL_FRAMEBUFFER, renderer->target.frame);
    glUseProgram(program->id);
    dph_draw_place(&draw, program, placed, stages.vectors);
    if (how->probe_uniforms)
        how->probe_uniforms(&draw, program);
    glBindVertexArray(how->probe ? gpu->plain.array : gpu->baked.array);
    glEnable(GL_RASTERIZER_DISCARD);
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, (GLsizei)gpu->nvert);
    glEndTransformFeedback();
    glDisable(GL_RASTERIZER_DISCARD);
    glFrontFace(GL_CCW);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glBindVertexArray(0);
    glUseProgram(0);
    glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, bytes, row);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
    glDeleteBuffers(1, &buffer);
    for (size_t v = 0; gpu->indexed && v < mesh->nvert; v++)
        thickness[v] = gpu->row_of[v] == UINT32_MAX ? 0 : row[gpu->row_of[v]];
    for (size_t r = 0; !gpu->indexed && r < gpu->nvert; r++)
        thickness[mesh->index[r]] = row[r];
    free(row);
    return dph_program_check(program, "thickness read back", err);
}

bool dph_renderer_cost(struct dph_renderer *renderer, const struct dph_frame *frame,
                       struct dph_cost *cost, struct dph_error *err)
{
    struct dph_draw draw;
    double bytes = 0, vertices = 0;
    if (!dph_draw_begin(&draw, renderer, frame, err))
        return false;
    *cost = (struct dph_cost){.passes = 1};
    for (size_t i = 0; i < renderer->scene->nbody; i++) {
        const struct dph_thickness *t = renderer->scene->body[i].thickness;
        double nvert = (double)renderer->scene->body[i].mesh.nvert;
        vertices += nvert;
        if (frame->method->needs_thickness && t) {
            cost->table_bytes += dph_thickness_shared(t);
            bytes += nvert * (t->store == DPH_STORE_CPCA ? (double)dph_thickness_fetched(t)
                                                         : renderer->body[i].vectors * 4 *
                                                               (double)dph_store_size(t->store));
        }
    }
    cost->bytes_per_vertex = vertices > 0 ? bytes / vertices : 0;
    if (frame->method->draw->cost)
        frame->method->draw->cost(&draw, cost);
    return true;
}
