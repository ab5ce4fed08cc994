/* What is drawn by bench draw: a model, baked once, and dressed for each variant.
 *
 * Coefficients are baked as floats and packed anew for every number of bands and every component
 * type: a row of fewer bands is what a file with that many bands holds, not a part of a longer row.
 * Transfer vectors are compressed for each setting. Whatever a file brings is left aside, so that
 * all models are measured alike. */
#include "bench_draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const int cpca_setting[CPCA_SETTINGS][2] = {{1, 24}, {64, 8}};

static bool fail_memory(struct dph_error *err)
{
    *err = (struct dph_error){DPH_ERROR_MEMORY, "out of memory"};
    return false;
}

/* Takes off what a file has baked and joins equal vertices. */
static bool strip(struct bench_model *model, struct dph_error *err)
{
    for (size_t b = 0; b < model->scene->nbody; b++) {
        struct dph_body *body = &model->scene->body[b];
        dph_thickness_destroy(body->thickness);
        body->thickness = NULL;
        dph_rivals_destroy(body->rivals);
        body->rivals = NULL;
        free(body->mesh.texcoord); /* seams of a texture are not seams of the surface */
        body->mesh.texcoord = NULL;
        model->triangles += body->mesh.ntri;
        model->vertices += body->mesh.nvert;
        if (!dph_mesh_share(&body->mesh, err))
            return false;
        model->shared += body->mesh.nvert;
    }
    return true;
}

/* Keeps the baked coefficients as plain rows and takes them off the bodies. */
static bool unpack(struct bench_model *model, struct dph_error *err)
{
    size_t n = (size_t)(model->bands * model->bands);
    for (size_t b = 0; b < model->scene->nbody; b++) {
        struct dph_body *body = &model->scene->body[b];
        if (!body->thickness)
            continue;
        float *row = model->coefficient[b] = malloc((body->mesh.nvert + 1) * n * sizeof *row);
        if (!row)
            return fail_memory(err);
        for (size_t v = 0; v < body->mesh.nvert; v++)
            dph_thickness_row(body->thickness, v, row + v * n);
        dph_thickness_destroy(body->thickness);
        body->thickness = NULL;
    }
    return true;
}

static bool compress(struct bench_model *model, int threads, struct dph_error *err)
{
    struct dph_cpca_params params = dph_cpca_defaults();
    params.threads = threads;
    for (int s = 0; s < CPCA_SETTINGS; s++)
        for (size_t b = 0; b < model->scene->nbody; b++) {
            const struct dph_rivals *rivals = model->scene->body[b].rivals;
            if (!rivals || !rivals->transfer.npos)
                continue;
            const struct dph_transfer *transfer = &rivals->transfer;
            params.clusters = cpca_setting[s][0];
            params.vectors = cpca_setting[s][1];
            model->cpca[s][b] =
                dph_cpca_create(transfer->vector, transfer->npos, (int)transfer->length,
                                transfer->area, &params, err);
            if (!model->cpca[s][b])
                return false;
        }
    return true;
}

static bool load(struct bench_model *model, const struct settings *settings, const char *path,
                 int *code)
{
    struct dph_error err;
    struct dph_mesh mesh = {0};
    if (path)
        return (model->scene = load_scene(settings, path, code));
    if (!dph_mesh_init_candle(&mesh, &err) ||
        !(model->scene = dph_scene_from_mesh(&mesh, "candle", &err))) {
        dph_mesh_finish(&mesh);
        *code = report_error(settings, &err);
    }
    return model->scene;
}

bool bench_model_init(struct bench_model *model, struct settings *settings, const char *path,
                      unsigned methods, int *code)
{
    struct dph_error err;
    struct dph_rivals_report report;
    const struct dph_method *method;
    bool thickness = false;
    unsigned products = 0;
    *model = (struct bench_model){.bands = DPH_DRAW_BANDS};
    for (size_t i = 0; (method = dph_method_at(i)); i++)
        if (methods >> i & 1) {
            thickness = thickness || method->needs_thickness;
            products |= method->needs;
        }
    if (!load_material(settings, "wax", &model->material, code) ||
        !load(model, settings, path, code))
        return false;
    size_t nbody = model->scene->nbody;
    settings->input[0] = path ? path : "candle"; /* as complaints name it */
    settings->store = DPH_STORE_FLOAT;
    settings->bake.bands = model->bands;
    model->coefficient = calloc(nbody + 1, sizeof *model->coefficient);
    for (int s = 0; s < CPCA_SETTINGS; s++)
        model->cpca[s] = calloc(nbody + 1, sizeof **model->cpca);
    if (!model->coefficient || !model->cpca[0] || !model->cpca[1]) {
        fail_memory(&err);
        goto error;
    }
    if (!strip(model, &err))
        goto error;
    if (!model->triangles) {
        complain(settings, "%s: no triangles to draw", settings->input[0]);
        *code = EXIT_INPUT;
        goto complained;
    }
    model->mm_per_unit = dph_scene_millimetres(model->scene, settings->size_mm);
    if (thickness && !bake_scene(settings, model->scene, false, NULL, code))
        goto complained;
    if (!unpack(model, &err))
        goto error;
    bool clusters = products & DPH_PRODUCT_CLUSTERS;
    products = (products & ~(unsigned)DPH_PRODUCT_CLUSTERS) |
               (clusters ? (unsigned)DPH_PRODUCT_TRANSFER : 0U);
    if (!bake_rivals(settings, model->scene, &model->material, products, &report, code))
        goto complained;
    if (clusters && !compress(model, settings->threads, &err))
        goto error;
    if (products & DPH_PRODUCT_RESPONSE) { /* a coarse one: speed does not depend on noise */
        struct dph_scene_response_params params = dph_scene_response_defaults();
        params.material = &model->material;
        params.size_mm = settings->size_mm;
        params.threads = settings->threads;
        params.keep_rows = true;
        params.noise = .5;
        if (!dph_scene_bake_response(model->scene, &params, NULL, &err))
            goto error;
    }
    return true;

error:
    *code = report_error(settings, &err);
complained:
    bench_model_finish(model);
    return false;
}

void bench_model_finish(struct bench_model *model)
{
    for (size_t b = 0; model->scene && b < model->scene->nbody; b++) {
        if (model->coefficient)
            free(model->coefficient[b]);
        for (int s = 0; s < CPCA_SETTINGS; s++)
            if (model->cpca[s])
                dph_cpca_destroy(model->cpca[s][b]);
    }
    free(model->coefficient);
    for (int s = 0; s < CPCA_SETTINGS; s++)
        free(model->cpca[s]);
    dph_scene_destroy(model->scene);
    *model = (struct bench_model){0};
}

/* Coefficients of a body as a file with `bands` bands has them. */
static struct dph_thickness *pack(const struct bench_model *model, size_t b, int bands,
                                  enum dph_store store, struct dph_error *err)
{
    size_t nvert = model->scene->body[b].mesh.nvert, wanted = (size_t)(bands * bands),
           n = (size_t)(model->bands * model->bands);
    float *row = malloc((nvert + 1) * wanted * sizeof *row);
    if (!row) {
        fail_memory(err);
        return NULL;
    }
    for (size_t v = 0; v < nvert; v++)
        memcpy(row + v * wanted, model->coefficient[b] + v * n, wanted * sizeof *row);
    struct dph_thickness *thickness =
        dph_thickness_create(row, nvert, bands, NULL, nvert, store, err);
    free(row);
    return thickness;
}

/* Copies of every instance on a grid across the view, a tenth of the model apart. */
static bool repeat(struct dph_scene *scene, const struct dph_scene *once, int copies,
                   struct dph_error *err)
{
    size_t n = (size_t)copies, columns = (size_t)ceil(sqrt((double)copies));
    struct dph_instance *instance = malloc((once->ninstance * n + 1) * sizeof *instance);
    if (!instance)
        return fail_memory(err);
    scene->instance = instance;
    scene->ninstance = once->ninstance * n;
    for (size_t c = 0; c < n; c++) {
        const size_t at[2] = {c % columns, c / columns};
        for (size_t i = 0; i < once->ninstance; i++) {
            struct dph_instance *copy = &instance[c * once->ninstance + i];
            *copy = once->instance[i];
            for (int k = 0; k < 2; k++) {
                double step = 1.1 * (once->bounds[1][k] - once->bounds[0][k]);
                copy->matrix[12 + k] += (float)((double)at[k] * step);
                scene->bounds[1][k] =
                    fmax(scene->bounds[1][k], once->bounds[1][k] + (double)at[k] * step);
            }
        }
    }
    return true;
}

bool bench_view_init(struct bench_view *view, const struct bench_model *model,
                     const struct variant *variant, int copies, struct dph_error *err)
{
    const struct dph_scene *once = model->scene;
    *view = (struct bench_view){.scene = *once};
    view->scene.instance = NULL;
    view->scene.body = calloc(once->nbody + 1, sizeof *view->scene.body);
    view->rivals = calloc(once->nbody + 1, sizeof *view->rivals);
    if (!view->scene.body || !view->rivals) {
        fail_memory(err);
        goto error;
    }
    if (!repeat(&view->scene, once, copies, err))
        goto error;
    for (size_t b = 0; b < once->nbody; b++) {
        struct dph_body *body = &view->scene.body[b];
        *body = once->body[b];
        body->thickness = NULL;
        body->rivals = NULL;
        if (variant->method->needs_thickness && model->coefficient[b] &&
            !(body->thickness =
                  pack(model, b, variant->bands, (enum dph_store)variant->store, err)))
            goto error;
        if (variant->method->needs && once->body[b].rivals) {
            view->rivals[b] = *once->body[b].rivals;
            view->rivals[b].clusters = model->cpca[variant->setting][b];
            body->rivals = &view->rivals[b];
            view->rivals[b].response = NULL;
            if (variant->method->needs & DPH_PRODUCT_RESPONSE) {
                struct dph_response_params form = dph_response_defaults();
                form.form = (enum dph_response_form)variant->form;
                form.bands = variant->bands;
                form.store = (enum dph_store)variant->store;
                if (!(view->rivals[b].response = dph_response_create(
                          &once->body[b].rivals->response_rows, &form, NULL, err)))
                    goto error;
                if (once->body[b].rivals->response && form.form == DPH_RESPONSE_ROOT)
                    view->rivals[b].response->view = once->body[b].rivals->response->view;
            }
        }
    }
    return true;

error:
    bench_view_finish(view);
    return false;
}

void bench_view_finish(struct bench_view *view)
{
    for (size_t b = 0; view->scene.body && b < view->scene.nbody; b++)
    {
        dph_thickness_destroy(view->scene.body[b].thickness);
        if (view->rivals)
            dph_response_destroy(view->rivals[b].response);
    }
    free(view->scene.body);
    free(view->scene.instance);
    free(view->rivals);
    *view = (struct bench_view){0};
}
