/* response: the baked multiple-scattering response in the place of thickness.
 *
 * The vertex data and the vertex stage are those of shsss; what the vertices hold is what comes out
 * of the body instead of how long the way is (diaphan/response.h), so the fragment stage has
 * nothing to guess. The method is ours. Its ancestors are P.-P. Sloan, J. Hall, J. Hart, J. Snyder,
 * "Clustered principal components for precomputed radiance transfer", SIGGRAPH 2003, for the
 * transfer of a translucent body in spherical harmonics, and the cited paper for drawing it with
 * nine dot products.
 *
 *   root     a sum a light; its square is the value, whose colour is read from the ramp, and which
 *            the direction of sight changes by a polynomial of the body
 *   linear   the same without the square. Lights that need no direction of their own in the
 *            fragment stage are summed first: into one sum where all have the same hue, else into
 *            one a channel; so are the surroundings
 *   rgb      transfer vectors: drawn by the methods prt and prt-cpca
 *
 * All of them draw with a renderer of their own, over a stand-in for the scene whose bodies have
 * the response where others have thickness or transfer vectors. */
#include "render/rival.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/rivals.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define Y00 .28209479177387814 /* the constant harmonic */

struct dph_stand_in {
    struct dph_scene scene;    /* of the bodies below; owns nothing else                        */
    struct dph_body *body;     /* (nbody) like the scene's, with other thickness and rivals     */
    struct dph_rivals *rivals; /* (nbody) RGB only                                              */
    struct dph_renderer *renderer;
    GLuint *ramp;                /* (nbody) textures, 0: none                                     */
    float *top;                  /* (nbody) of the ramps                                          */
    const struct dph_response **response; /* (nbody) of the scene                                 */
    enum dph_response_form form; /* of all bodies                                                 */
    size_t bodies;               /* that have any triangles                                       */

    /* of the frame that is being drawn */
    struct dph_frame frame;  /* its lights: `own` ones of the frame, then sums                */
    struct dph_frame source; /* all that is in the sums                                       */
    int own, sums;           /* sums: 1 of all channels, or 3                                 */
    float incoming[3 * DPH_PRT_CHANNEL]; /* of the instance at hand, as dph_prt_light has it      */
};

void dph_stand_in_destroy(struct dph_stand_in *stand_in, size_t nbody)
{
    if (!stand_in)
        return;
    dph_renderer_destroy(stand_in->renderer);
    for (size_t i = 0; i < nbody; i++) {
        if (stand_in->rivals) {
            free(stand_in->rivals[i].transfer.vector);
            free(stand_in->rivals[i].transfer.position_of);
        }
        if (stand_in->ramp)
            glDeleteTextures(1, &stand_in->ramp[i]);
    }
    free(stand_in->ramp);
    free(stand_in->top);
    free(stand_in->response);
    free(stand_in->rivals);
    free(stand_in->body);
    free(stand_in);
}

/* ---- the stand-in ---- */

static bool upload_ramp(GLuint *texture, const struct dph_ramp *ramp)
{
    glGenTextures(1, texture);
    glBindTexture(GL_TEXTURE_1D, *texture);
    glTexImage1D(GL_TEXTURE_1D, 0, GL_RGBA32F, DPH_RAMP_ENTRIES, 0, GL_RGB, GL_FLOAT,
                 ramp->color[0]);
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glBindTexture(GL_TEXTURE_1D, 0);
    return *texture != 0;
}

/* RGB as transfer vectors, a row a vertex or the signals that there are. */
static bool make_transfer(struct dph_rivals *rivals, const struct dph_response *response,
                          struct dph_error *err)
{
    struct dph_transfer *t = &rivals->transfer;
    size_t n = (size_t)(response->bands * response->bands);
    *t = (struct dph_transfer){
        .nvert = response->nvert, .bands = response->bands, .channels = 3, .length = 3 * n};
    if (!(t->position_of = dph_alloc(response->nvert, sizeof *t->position_of)))
        return dph_fail_memory(err);
    if (response->clusters) {
        rivals->clusters = response->clusters; /* lent */
        t->npos = response->clusters->count;
        memcpy(t->position_of, response->position_of, t->nvert * sizeof *t->position_of);
        return true;
    }
    t->npos = t->nvert;
    if (!(t->vector = dph_alloc(t->npos, t->length * sizeof *t->vector)))
        return dph_fail_memory(err);
    for (size_t v = 0; v < t->nvert; v++) {
        t->position_of[v] = (uint32_t)v;
        for (int c = 0; c < 3; c++)
            dph_thickness_row(response->channel[c], v, t->vector + v * t->length + (size_t)c * n);
    }
    return true;
}

static bool fill_body(struct dph_stand_in *own, size_t i, const struct dph_body *body,
                      struct dph_error *err)
{
    const struct dph_response *response = body->rivals ? body->rivals->response : NULL;
    own->body[i] = *body;
    own->body[i].thickness = NULL;
    own->body[i].rivals = NULL;
    if (!body->mesh.ntri || !body->mesh.nvert)
        return true;
    if (!response)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "pass response: body %zu ('%.60s') has no response", i, body->name);
    if (response->nvert != body->mesh.nvert)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a response of %zu vertices for a mesh of %zu",
                        response->nvert, body->mesh.nvert);
    if (own->bodies++ && response->form != own->form)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "responses of two forms in one scene, %s and %s: bake them together",
                        dph_response_form_name(own->form), dph_response_form_name(response->form));
    own->form = response->form;
    if (response->form != DPH_RESPONSE_RGB) {
        own->body[i].thickness = response->channel[0];
        own->top[i] = response->ramp.top;
        own->response[i] = response;
        return upload_ramp(&own->ramp[i], &response->ramp) || dph_fail_memory(err);
    }
    own->body[i].rivals = &own->rivals[i];
    return make_transfer(&own->rivals[i], response, err);
}

static struct dph_stand_in *make_stand_in(const struct dph_renderer *renderer,
                                          struct dph_error *err)
{
    const struct dph_scene *scene = renderer->scene;
    struct dph_stand_in *own = dph_alloc_zero(1, sizeof *own);
    if (!own) {
        dph_fail_memory(err);
        return NULL;
    }
    own->scene = *scene;
    own->scene.body = own->body = dph_alloc_zero(scene->nbody, sizeof *own->body);
    own->rivals = dph_alloc_zero(scene->nbody, sizeof *own->rivals);
    own->ramp = dph_alloc_zero(scene->nbody, sizeof *own->ramp);
    own->top = dph_alloc_zero(scene->nbody, sizeof *own->top);
    own->response = dph_alloc_zero(scene->nbody, sizeof *own->response);
    if (!own->body || !own->rivals || !own->ramp || !own->top || !own->response) {
        dph_fail_memory(err);
        goto error;
    }
    for (size_t i = 0; i < scene->nbody; i++)
        if (!fill_body(own, i, &scene->body[i], err))
            goto error;
    const struct dph_renderer_params params = {.unshared = renderer->unshared};
    if (!(own->renderer = dph_renderer_create_with(&own->scene, &params, err)))
        goto error;
    return own;

error:
    dph_stand_in_destroy(own, scene->nbody);
    return NULL;
}

/* ---- light ---- */

static bool same_hue(const struct dph_frame *frame)
{
    const double *first = frame->light[0].irradiance;
    for (int i = 1; i < frame->nlight; i++)
        for (int c = 0; c < 3; c++) {
            const double *e = frame->light[i].irradiance;
            int d = (c + 1) % 3;
            double a = e[c] * first[d], b = e[d] * first[c];
            if (fabs(a - b) > 1e-6 * (fabs(a) + fabs(b)))
                return false;
        }
    return true;
}

/* Which lights keep a sum of their own. */
static bool plan_lights(struct dph_stand_in *own, const struct dph_frame *frame,
                        struct dph_error *err)
{
    bool local = false, around = frame->has_environment;
    for (int i = 0; i < frame->nlight; i++)
        local = local || frame->light[i].kind != DPH_LIGHT_DISTANT;
    own->source = own->frame = *frame;
    own->own = frame->nlight;
    own->sums = 0;
    if (frame->bands == DPH_BANDS_AUTO) /* a matter of thickness */
        own->frame.bands = own->source.bands = 0;
    if (own->form == DPH_RESPONSE_ROOT) {
        own->frame.bands = 0; /* a square cannot be cut */
        own->frame.window = DPH_WINDOW_NONE;
        return !around || dph_fail(err, DPH_ERROR_ARGUMENT,
                                   "a response in its root form takes no light from surroundings, "
                                   "its linear and rgb forms do");
    }
    if (own->form == DPH_RESPONSE_RGB)
        return !local || dph_fail(err, DPH_ERROR_ARGUMENT,
                                  "a response in rgb takes distant lights and surroundings only");
    if (frame->nlight == 1 && !around)
        return true;
    if (local || (frame->material.specular > 0 && frame->nlight + 3 <= DPH_MAX_LIGHTS)) {
        own->source.nlight = 0;
        own->sums = around ? 3 : 0;
    } else {
        own->own = 0;
        own->sums = !around && same_hue(frame) ? 1 : 3;
    }
    own->frame.nlight = own->own + own->sums;
    if (own->frame.nlight > DPH_MAX_LIGHTS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d lights beside surroundings: %d are drawn",
                        own->own, DPH_MAX_LIGHTS - 3);
    for (int i = own->own; i < own->frame.nlight; i++)
        own->frame.light[i] = (struct dph_light){.to_light = {0, 1, 0}};
    return true;
}

/* Sum number k: a channel of all light in `source`, or all channels, which are alike. Of light that
 * comes from many directions nothing but its amount is known to the ramp: the integral of radiance,
 * which for a light far away is its irradiance. */
static void light_sum(const struct dph_stand_in *own, int k, const struct dph_thickness *t,
                      double top, struct dph_light_constants *light)
{
    int n = t->bands * t->bands, padded = (n + 3) / 4 * 4, channel = k;
    double amount[3];
    for (int c = 0; c < 3; c++)
        amount[c] = (double)own->incoming[c * padded] / Y00;
    if (own->sums == 1)
        for (int c = channel = 0; c < 3; c++)
            channel = amount[c] > amount[channel] ? c : channel;
    memset(light, 0, sizeof *light); /* without a direction: it makes no highlight */
    if (!(amount[channel] > 0))
        return;
    for (int l = 0; l < t->bands; l++)
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            light->sh[i / 4][i % 4] = (float)((double)own->incoming[channel * padded + i] *
                                              (double)t->scale[l] / (amount[channel] * top));
    for (int c = 0; c < 3; c++)
        light->irradiance[c] = own->sums == 1 || c == channel ? (float)amount[c] : 0;
}

/* Takes the unit of length out of the values of a light, which its first one shows, and measures
 * them by the end of the ramp. */
static void set_light(const struct dph_draw *draw, const struct dph_instance *instance, int i,
                      struct dph_light_constants *light)
{
    struct dph_stand_in *own = draw->light_user;
    const struct dph_thickness *t = own->body[instance->body].thickness;
    double top = (double)own->top[instance->body];
    if (i >= own->own) {
        struct dph_draw source = *draw;
        source.frame = &own->source;
        if (i == own->own)
            dph_prt_light(&source, instance, t->bands, own->incoming);
        light_sum(own, i - own->own, t, top, light);
        return;
    }
    double unit = (double)light->sh[0][0] / (Y00 * (double)t->scale[0]);
    double factor = 1 / (own->form == DPH_RESPONSE_ROOT ? sqrt(top) : top);
    for (int k = 0; k < t->bands * t->bands; k++)
        light->sh[k / 4][k % 4] =
            unit > 0 ? (float)((double)light->sh[k / 4][k % 4] / unit * factor) : 0;
}

static bool stand_in(struct dph_draw *draw, struct dph_error *err)
{
    struct dph_renderer *renderer = draw->renderer;
    if (!renderer->stand_in && !(renderer->stand_in = make_stand_in(renderer, err)))
        return false;
    struct dph_stand_in *own = renderer->stand_in;
    if (!plan_lights(own, draw->frame, err))
        return false;
    draw->renderer = own->renderer;
    draw->frame = &own->frame;
    if (own->form != DPH_RESPONSE_RGB) {
        draw->light = set_light;
        draw->light_user = own;
    }
    return true;
}

/* ---- drawing ---- */

static void uniforms(const struct dph_draw *draw, struct dph_program *program)
{
    dph_draw_material(draw, program);
    dph_set_int(program, "u_ramp", 0);
}

static void set_ramp(const struct dph_draw *draw, struct dph_program *program,
                     const struct dph_instance *instance)
{
    const struct dph_stand_in *own = draw->light_user;
    (void)program;
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_1D, own->ramp[instance->body]);
}

/* The ramp, and what the eye sees of every light, as from the body's centre. */
static void set_view(const struct dph_draw *draw, struct dph_program *program,
                     const struct dph_instance *instance)
{
    const struct dph_stand_in *own = draw->light_user;
    const struct dph_response *response = own->response[instance->body];
    const struct dph_gpu_body *gpu = &draw->renderer->body[instance->body];
    /* what the vertex stage takes integers for is that many times too large */
    const float steps = gpu->bytes == 1 ? 127 : gpu->bytes == 2 ? 32767 : 1;
    double centre[3], to_eye[3];
    set_ramp(draw, program, instance);
    if (gpu->table)
        return;
    dph_draw_centre(draw, instance, centre);
    for (int k = 0; k < 3; k++)
        to_eye[k] = draw->eye[k] - centre[k];
    for (int i = 0; i < draw->frame->nlight; i++) {
        struct dph_light seen;
        struct dph_view_constants view = {.even = 1};
        double light[3], eye[3];
        dph_light_at(&draw->frame->light[i], centre, &seen);
        if (!draw->frame->view_averaged && dph_light_in_object(instance->matrix, seen.to_light, light) &&
            dph_light_in_object(instance->matrix, to_eye, eye))
            dph_view_constants(response, light, eye, &view);
        view.mean /= steps;
        for (int k = 0; k < 3; k++) {
            view.eye[k] /= steps;
            view.light[k] /= steps;
        }
        const struct {
            const char *name;
            int components;
            const float *value;
        } member[] = {
            {"mean", 1, &view.mean},   {"eye", 3, view.eye},       {"light", 3, view.light},
            {"even", 1, &view.even},   {"linear", 4, view.linear}, {"square", 4, view.square},
            {"mixed", 3, view.mixed}, {"cross", 3, view.cross},
        };
        for (size_t k = 0; k < sizeof member / sizeof *member; k++) {
            char name[40];
            snprintf(name, sizeof name, "u_light[%d].view.%s", i, member[k].name);
            if (member[k].components == 1)
                dph_set_float(program, name, *member[k].value);
            else
                dph_set_vec(program, name, member[k].components, 1, member[k].value);
        }
    }
}

static bool draw_response(struct dph_draw *draw, struct dph_error *err)
{
    static const struct dph_pass root = {.name = "response",
                                         .vert = "body.vert",
                                         .frag = "response_root.frag",
                                         .thickness = true,
                                         .view = true,
                                         .uniforms = uniforms,
                                         .instance = set_view};
    static const struct dph_pass linear = {.name = "response",
                                           .vert = "body.vert",
                                           .frag = "response.frag",
                                           .thickness = true,
                                           .uniforms = uniforms,
                                           .instance = set_ramp};
    struct dph_draw own = *draw;
    if (!stand_in(&own, err))
        return false;
    const struct dph_stand_in *in = draw->renderer->stand_in;
    bool compressed = false;
    for (size_t i = 0; i < in->scene.nbody; i++)
        compressed = compressed || in->rivals[i].clusters;
    if (in->form == DPH_RESPONSE_RGB)
        return (compressed ? &dph_method_prt_cpca : &dph_method_prt)->draw->draw(&own, err);
    bool ok = dph_draw_pass(&own, in->form == DPH_RESPONSE_ROOT ? &root : &linear, err);
    glBindTexture(GL_TEXTURE_1D, 0);
    return ok;
}

/* What the vertices have of it; RGB lies in a buffer of floats as transfer vectors do. */
static void cost(const struct dph_draw *draw, struct dph_cost *cost)
{
    double bytes = 0, vertices = 0;
    int used = draw->frame->bands;
    for (size_t i = 0; i < draw->renderer->scene->nbody; i++) {
        const struct dph_body *body = &draw->renderer->scene->body[i];
        const struct dph_response *response = body->rivals ? body->rivals->response : NULL;
        vertices += (double)body->mesh.nvert;
        if (!response)
            continue;
        double row = (double)dph_response_fetched(response);
        int all = response->bands * response->bands;
        if (response->form == DPH_RESPONSE_LINEAR && used > 0 && used < response->bands &&
            response->channel[0]->store != DPH_STORE_CPCA)
            row *= (double)((used * used + 3) / 4) / ((all + 3) / 4);
        if (response->form == DPH_RESPONSE_RGB && !response->clusters)
            row = 4 + 48.0 * ((all + 3) / 4);
        bytes += (double)body->mesh.nvert * row;
        cost->table_bytes += dph_response_shared(response);
    }
    cost->bytes_per_vertex += vertices > 0 ? bytes / vertices : 0;
}

const struct dph_method dph_method_response = {
    .name = "response",
    .title = "Baked response",
    .paper = "this project; drawn as A. Tomaszewska, K. Stefanowski, ICIAR 2012",
    .needs = DPH_PRODUCT_RESPONSE,
    .local_lights = true,
    .environment = true,
    .draw =
        &(const struct dph_method_draw){.stand_in = stand_in, .draw = draw_response, .cost = cost},
};
