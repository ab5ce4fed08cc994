/* Passes: every method draws all instances with a program of its own, and this is the loop that
 * they share.
 *
 * Everything is placed relative to the eye and in units of the scene's radius, computed in double,
 * so that scenes of any size and anywhere keep the precision of floats. */
#include "render/draw.h"

#include "core/fail.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)

static bool same_variant(const struct dph_variant *a, const struct dph_variant *b)
{
    return a->stages.vert == b->stages.vert && a->stages.frag == b->stages.frag &&
           a->stages.feedback == b->stages.feedback && a->stages.vectors == b->stages.vectors &&
           a->stages.bytes == b->stages.bytes && a->stages.weights == b->stages.weights &&
           a->stages.view == b->stages.view &&
           a->lights == b->lights && a->local == b->local && a->compiled == b->compiled &&
           !memcmp(&a->material, &b->material, sizeof a->material);
}

/* What the program has to know of a material: everything, or only what decides on its code. */
static struct dph_material_constants key_of(const struct dph_material_constants *m, bool compiled)
{
    return compiled ? *m
                    : (struct dph_material_constants){.formula = m->formula,
                                                      .curve = m->curve,
                                                      .specular = m->specular > 0,
                                                      .rim = m->rim > 0,
                                                      .ambient = m->ambient > 0};
}

/* Appends "name(bits of x, ...)": exactly these floats, whatever the locale. */
static void put_floats(char *text, size_t size, const char *name, const float *x, int n)
{
    size_t at = strlen(text);
    at += (size_t)snprintf(text + at, size - at, "%s(", name);
    for (int i = 0; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, x + i, sizeof bits);
        at += (size_t)snprintf(text + at, size - at, "%suintBitsToFloat(%" PRIu32 "u)",
                               i ? "," : "", bits);
    }
    snprintf(text + at, size - at, ")");
}

/* The defines that make a material a constant, see material.glsl, and its curve a polynomial;
 * members in their order. */
static void define_material(char *text, size_t size, const struct dph_material_constants *m)
{
    const float *triple[] = {m->rate, m->offset, m->numerator, m->base, m->front, m->back, m->albedo};
    const float single[] = {m->specular, m->shininess, m->f0, m->rim, m->rim_power, m->ambient};
    snprintf(text, size, "#define DPH_MATERIAL %d,%d", m->formula, m->curve);
    for (size_t i = 0; i < sizeof triple / sizeof *triple; i++)
        put_floats(text, size, ",vec3", triple[i], 3);
    for (size_t i = 0; i < sizeof single / sizeof *single; i++)
        put_floats(text, size, ",float", single + i, 1);
    struct dph_material_fit fit;
    if (dph_material_fit(m, &fit)) {
        size_t at = strlen(text);
        snprintf(text + at, size - at, "\n#define DPH_SLAB_FIT ");
        for (int i = 0; i < DPH_FIT_TERMS; i++)
            put_floats(text, size, i ? ",vec3" : "vec3", fit.term[i], 3);
    }
    strcat(text, "\n"); /* there is room: see the caller */
}

/* Programs beyond a number are forgotten, those first that were not used for longest. */
static void forget_variants(struct dph_renderer *renderer)
{
    enum { KEPT = 32 };
    struct dph_variant **at = &renderer->variants;
    for (int i = 0; *at && i < KEPT; i++)
        at = &(*at)->next;
    while (*at) {
        struct dph_variant *old = *at;
        *at = old->next;
        dph_program_finish(&old->program);
        free(old);
    }
}

struct dph_program *dph_draw_program(const struct dph_draw *draw, const struct dph_stages *stages,
                                     struct dph_error *err)
{
    struct dph_renderer *renderer = draw->renderer;
    struct dph_variant wanted = {.stages = *stages,
                                 .lights = draw->frame->nlight,
                                 .compiled = !draw->frame->live_material,
                                 .material = key_of(&draw->material,
                                                    !draw->frame->live_material)};
    for (int i = 0; i < wanted.lights; i++)
        wanted.local = wanted.local || draw->frame->light[i].kind != DPH_LIGHT_DISTANT;
    for (struct dph_variant **at = &renderer->variants; *at; at = &(*at)->next)
        if (same_variant(*at, &wanted)) {
            struct dph_variant *found = *at;
            *at = found->next;
            found->next = renderer->variants;
            renderer->variants = found;
            return &found->program;
        }
    struct dph_variant *v = calloc(1, sizeof *v);
    if (!v) {
        dph_fail_memory(err);
        return NULL;
    }
    *v = wanted;
    char defines[2560], material[2048] = ""; /* 48 floats of at most 28 letters, 14 names */
    if (v->compiled)
        define_material(material, sizeof material, &v->material);
    snprintf(defines, sizeof defines,
             "#define DPH_LIGHTS %d\n#define DPH_VECTORS %d\n#define DPH_BYTES %d\n"
             "#define DPH_WEIGHTS %d\n#define DPH_FORMULA %d\n#define DPH_CURVE %d\n%s%s%s%s%s%s%s",
             v->lights, stages->vectors, stages->bytes, stages->weights, v->material.formula,
             v->material.curve, v->material.specular > 0 ? "" : "#define DPH_SPECULAR 0.0\n",
             v->material.rim > 0 ? "" : "#define DPH_RIM 0.0\n",
             v->material.ambient > 0 ? "" : "#define DPH_AMBIENT 0.0\n",
             v->local ? "#define DPH_LOCAL\n" : "", stages->view ? "#define DPH_VIEW\n" : "",
             stages->feedback ? "#define DPH_PROBE\n" : "", material);
    if (!dph_program_init(&v->program, stages->vert, stages->frag, defines, stages->feedback,
                          err)) {
        free(v);
        return NULL;
    }
    v->next = renderer->variants;
    renderer->variants = v;
    forget_variants(renderer);
    return &v->program;
}

void dph_draw_material(const struct dph_draw *draw, struct dph_program *program)
{
    const struct dph_material_constants *m = &draw->material;
    if (!draw->frame->live_material) /* a constant of the program */
        return;
    dph_set_int(program, "u_material.formula", m->formula);
    dph_set_int(program, "u_material.curve", m->curve);
    dph_set_vec(program, "u_material.rate", 3, 1, m->rate);
    dph_set_vec(program, "u_material.offset", 3, 1, m->offset);
    dph_set_vec(program, "u_material.numerator", 3, 1, m->numerator);
    dph_set_vec(program, "u_material.base", 3, 1, m->base);
    dph_set_vec(program, "u_material.front", 3, 1, m->front);
    dph_set_vec(program, "u_material.back", 3, 1, m->back);
    dph_set_vec(program, "u_material.albedo", 3, 1, m->albedo);
    dph_set_float(program, "u_material.specular", m->specular);
    dph_set_float(program, "u_material.shininess", m->shininess);
    dph_set_float(program, "u_material.f0", m->f0);
    dph_set_float(program, "u_material.rim", m->rim);
    dph_set_float(program, "u_material.rim_power", m->rim_power);
    dph_set_float(program, "u_material.ambient", m->ambient);
}

double dph_draw_matrices(const struct dph_renderer *renderer, const struct dph_instance *instance,
                         const double from[3], const float view[16], float place[16],
                         float clip[16], float normal[9])
{
    const float *m = instance->matrix;
    const double *origin = renderer->body[instance->body].origin;
    double radius = renderer->radius, column[4][3], cofactor[3][3], largest = 0, determinant = 0;
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            column[c][r] = (double)m[4 * c + r] / radius;
    for (int r = 0; r < 3; r++) {
        column[3][r] = (double)m[12 + r] - from[r];
        for (int c = 0; c < 3; c++)
            column[3][r] += (double)m[4 * c + r] * origin[c];
        column[3][r] /= radius;
    }
    for (int c = 0; c < 3; c++) {
        const double *a = column[(c + 1) % 3], *b = column[(c + 2) % 3];
        for (int r = 0; r < 3; r++) {
            cofactor[c][r] = a[(r + 1) % 3] * b[(r + 2) % 3] - a[(r + 2) % 3] * b[(r + 1) % 3];
            largest = fmax(largest, fabs(cofactor[c][r]));
            determinant += c == 0 ? column[0][r] * cofactor[0][r] : 0;
        }
    }
    double sign = determinant < 0 ? -1 : 1;
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            normal[3 * c + r] = largest > 0 ? (float)(sign * cofactor[c][r] / largest) : 0;
    for (int c = 0; c < 4; c++)
        for (int r = 0; r < 4; r++) {
            place[4 * c + r] = r < 3 ? (float)column[c][r] : c == 3;
            double sum = c == 3 ? (double)view[12 + r] : 0;
            for (int k = 0; k < 3; k++)
                sum += (double)view[4 * k + r] * column[c][k];
            clip[4 * c + r] = (float)sum;
        }
    return sign;
}

static const struct dph_thickness *thickness_of(const struct dph_draw *draw,
                                                const struct dph_instance *instance)
{
    return draw->renderer->scene->body[instance->body].thickness;
}

/* What a fragment needs to find direction and irradiance itself. */
static void place_local(const struct dph_draw *draw, struct dph_program *program,
                        const struct dph_light *source, int i, struct dph_light_constants *light)
{
    char name[2][40];
    float position[4] = {0}, cone[4] = {-2, -3}; /* no cone: any cosine is above */
    double radius = draw->renderer->radius, length = 0;
    snprintf(name[0], sizeof name[0], "u_light[%d].position", i);
    snprintf(name[1], sizeof name[1], "u_light[%d].cone", i);
    if (source->kind != DPH_LIGHT_DISTANT) {
        position[3] = 1;
        for (int k = 0; k < 3; k++) {
            position[k] = (float)((source->position[k] - draw->eye[k]) / radius);
            light->irradiance[k] = (float)(source->irradiance[k] / (radius * radius));
            length += source->to_light[k] * source->to_light[k];
        }
    }
    if (source->kind == DPH_LIGHT_SPOT) {
        cone[0] = (float)cos(.9 * source->angle * DEGREE);
        cone[1] = (float)cos(source->angle * DEGREE);
        for (int k = 0; k < 3; k++)
            light->to_light[k] = (float)(source->to_light[k] / sqrt(length));
    }
    dph_set_vec(program, name[0], 4, 1, position);
    dph_set_vec(program, name[1], 2, 1, cone);
}

const char *dph_draw_vert(const struct dph_gpu_body *gpu, const char *vert)
{
    static const char clustered[] = "clustered.vert"; /* variants are told apart by address */
    return gpu->table && !strcmp(vert, "body.vert") ? clustered : vert;
}

void dph_draw_centre(const struct dph_draw *draw, const struct dph_instance *instance,
                     double centre[3])
{
    const double *origin = draw->renderer->body[instance->body].origin;
    for (int r = 0; r < 3; r++) {
        centre[r] = (double)instance->matrix[12 + r];
        for (int c = 0; c < 3; c++)
            centre[r] += (double)instance->matrix[4 * c + r] * origin[c];
    }
}

/* How many bands a light needs on a body, where that is for us to choose. */
static double detail_of(const struct dph_draw *draw, const struct dph_light *seen,
                        const double centre[3])
{
    double to_eye[3];
    for (int k = 0; k < 3; k++)
        to_eye[k] = draw->eye[k] - centre[k];
    return dph_light_detail(seen->to_light, to_eye);
}

void dph_draw_place(const struct dph_draw *draw, struct dph_program *program,
                    const struct dph_instance *instance, int vectors)
{
    const struct dph_renderer *renderer = draw->renderer;
    float placed[16], clip[16], normal[9];
    double sign =
        dph_draw_matrices(renderer, instance, draw->eye, draw->clip, placed, clip, normal);
    double centre[3];
    dph_draw_centre(draw, instance, centre);
    dph_set_mat(program, "u_place", 4, placed);
    dph_set_mat(program, "u_clip", 4, clip);
    dph_set_mat(program, "u_normal", 3, normal);
    glFrontFace(sign < 0 ? GL_CW : GL_CCW);
    bool local = false;
    for (int i = 0; i < draw->frame->nlight; i++)
        local = local || draw->frame->light[i].kind != DPH_LIGHT_DISTANT;
    const int bands = draw->frame->bands > 0 ? draw->frame->bands : 0;
    static const struct dph_thickness none;
    struct dph_gpu_body *gpu = &draw->renderer->body[instance->body];
    bool clustered = vectors && gpu->table;
    /* what the vertex stage takes integers for is that many times too large */
    const float steps = gpu->bytes == 1 ? 127 : gpu->bytes == 2 ? 32767 : 1;
    for (int i = 0; i < draw->frame->nlight; i++) {
        const struct dph_light *source = &draw->frame->light[i];
        struct dph_light seen; /* as the body's centre sees it */
        struct dph_light_constants light;
        char name[3][40];
        snprintf(name[0], sizeof name[0], "u_light[%d].to_light", i);
        snprintf(name[1], sizeof name[1], "u_light[%d].irradiance", i);
        snprintf(name[2], sizeof name[2], "u_light[%d].sh", i);
        dph_light_at(source, centre, &seen);
        dph_light_constants(&seen, vectors ? thickness_of(draw, instance) : &none, instance->matrix,
                            draw->mm_per_unit, bands, draw->frame->window, &light);
        if (vectors && draw->frame->bands == DPH_BANDS_AUTO)
            dph_light_fade(&light, detail_of(draw, &seen, centre));
        if (draw->light)
            draw->light(draw, instance, i, &light);
        if (clustered) {
            dph_clusters_light(gpu, thickness_of(draw, instance), i, draw->frame->nlight, &light);
        } else if (vectors) {
            for (int k = 0; k < 4 * vectors; k++)
                light.sh[k / 4][k % 4] /= steps;
            dph_set_vec(program, name[2], 4, vectors, light.sh[0]);
        }
        if (local)
            place_local(draw, program, source, i, &light);
        dph_set_vec(program, name[0], 3, 1, light.to_light);
        dph_set_vec(program, name[1], 3, 1, light.irradiance);
    }
    if (clustered)
        dph_clusters_bind(gpu, thickness_of(draw, instance), draw->frame->nlight, program);
}

/* How many vec4 are worth fetching: those of the bands in use. */
static int vectors_in_use(const struct dph_draw *draw, const struct dph_instance *instance)
{
    const struct dph_gpu_body *gpu = &draw->renderer->body[instance->body];
    int bands = draw->frame->bands;
    if (bands == DPH_BANDS_AUTO) {
        double centre[3], most = 0;
        dph_draw_centre(draw, instance, centre);
        for (int i = 0; i < draw->frame->nlight; i++) {
            struct dph_light seen;
            dph_light_at(&draw->frame->light[i], centre, &seen);
            most = fmax(most, detail_of(draw, &seen, centre));
        }
        bands = (int)ceil(most);
    }
    int wanted = bands > 0 && bands < DPH_DRAW_BANDS ? (bands * bands + 3) / 4 : DPH_MAX_VECTORS;
    /* with fewer bands the weights stay, their vectors get shorter */
    return wanted < gpu->vectors && !gpu->table ? wanted : gpu->vectors;
}

void dph_draw_rows(const struct dph_gpu_body *gpu, const struct dph_gpu_rows *rows)
{
    glBindVertexArray(rows->array);
    if (gpu->indexed)
        glDrawElements(GL_TRIANGLES, gpu->count, GL_UNSIGNED_INT, NULL);
    else
        glDrawArrays(GL_TRIANGLES, 0, gpu->count);
}

bool dph_draw_pass(struct dph_draw *draw, const struct dph_pass *pass, struct dph_error *err)
{
    const struct dph_scene *scene = draw->renderer->scene;
    struct dph_program *program = NULL, *used = NULL;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_instance *instance = &scene->instance[i];
        struct dph_gpu_body *gpu = &draw->renderer->body[instance->body];
        if (!gpu->count)
            continue;
        if (pass->thickness && !gpu->vectors)
            return dph_fail(err, DPH_ERROR_ARGUMENT, "pass %s: body %zu ('%.60s') is not baked",
                            pass->name, instance->body, scene->body[instance->body].name);
        if (!pass->thickness && !dph_gpu_body_plain(gpu, &scene->body[instance->body], err))
            return false;
        struct dph_stages stages = {.vert = pass->vert, .frag = pass->frag};
        if (pass->thickness)
            stages = (struct dph_stages){.vert = dph_draw_vert(gpu, pass->vert),
                                         .frag = pass->frag,
                                         .vectors = vectors_in_use(draw, instance),
                                         .bytes = gpu->bytes,
                                         .view = pass->view && !gpu->table};
        if (!(program = dph_draw_program(draw, &stages, err)))
            return false;
        if (program != used) {
            if (used && !dph_program_check(used, pass->name, err))
                return false;
            glUseProgram(program->id);
            if (pass->uniforms)
                pass->uniforms(draw, program);
            used = program;
        }
        dph_draw_place(draw, program, instance, stages.vectors);
        if (pass->instance)
            pass->instance(draw, program, instance);
        dph_draw_rows(gpu, pass->thickness ? &gpu->baked : &gpu->plain);
    }
    glBindVertexArray(0);
    return used ? dph_program_check(used, pass->name, err) : dph_gl_check(pass->name, err);
}
