/* glTF: reading a baked response: coefficients in the attributes _RESPONSE_SH_i, or weights and
 * clusters in _RESPONSE_CPCA_i and _RESPONSE_CLUSTER, and extras.diaphan.response. Format:
 * docs/file-format.md. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/rivals.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool read_form(const struct dph_document *doc, const json_t *d, const char *place,
                      struct dph_response *response, struct dph_error *err)
{
    const char *text = json_string_value(json_object_get(d, "form")), *name;
    for (int i = 0; text && (name = dph_response_form_name((enum dph_response_form)i)); i++)
        if (!strcmp(name, text)) {
            response->form = (enum dph_response_form)i;
            return true;
        }
    return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "form \"%.20s\" is not known",
                         text ? text : "");
}

/* An optional number of at least 0. */
static bool read_number(const struct dph_document *doc, const json_t *d, const char *key,
                        const char *place, double *value, struct dph_error *err)
{
    const json_t *number = json_object_get(d, key);
    *value = number ? json_number_value(number) : 0;
    return (!number || (json_is_number(number) && *value >= 0 && isfinite(*value))) ||
           dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s is not a number of at least 0", key);
}

static bool read_ramp(const struct dph_document *doc, const json_t *d, const char *place,
                      struct dph_ramp *ramp, struct dph_error *err)
{
    enum { COUNT = 3 * DPH_RAMP_ENTRIES };
    json_t *object;
    char at[140];
    double color[COUNT], top;
    bool found;
    if (!dph_gltf_object(doc, d, "ramp", place, &object, err))
        return false;
    if (!object)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "ramp is missing");
    snprintf(at, sizeof at, "%s.ramp", place);
    top = json_number_value(json_object_get(object, "top"));
    if (!(top >= 1e-30 && top <= 1e30))
        return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err, "top is %g, not a number above 0", top);
    if (!dph_gltf_numbers(doc, object, "color", at, COUNT, color, &found, err))
        return false;
    if (!found)
        return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err, "color is missing");
    ramp->top = (float)top;
    for (int i = 0; i < COUNT; i++) {
        if (!(color[i] >= 0 && color[i] <= 1e30))
            return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err, "color[%d] is %g, not 0 to 1e30", i,
                                 color[i]);
        ramp->color[i / 3][i % 3] = (float)color[i];
    }
    return true;
}

/* The gain of views, which files of before it do not have. */
static bool read_view(const struct dph_document *doc, const json_t *d, const char *place,
                      struct dph_view_gain *view, struct dph_error *err)
{
    double term[DPH_VIEW_TERMS];
    bool found;
    *view = dph_view_even();
    if (!dph_gltf_numbers(doc, d, "view", place, DPH_VIEW_TERMS, term, &found, err))
        return false;
    for (int i = 0; found && i < DPH_VIEW_TERMS; i++) {
        if (!(fabs(term[i]) <= 1e6))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                                 "view[%d] is %g, not -1e6 to 1e6", i, term[i]);
        view->term[i] = (float)term[i];
    }
    return true;
}

/* ---- rows ---- */

/* Opens attribute number i of a part and tells its type. */
static bool open_rows(struct dph_document *doc, const struct dph_gltf_part *part, int i,
                      struct dph_gltf_accessor *a, char place[120], enum dph_store *store,
                      struct dph_error *err)
{
    char name[32];
    snprintf(name, sizeof name, "_RESPONSE_SH_%d", i);
    if (!dph_gltf_open_attribute(doc, part, name, 4, a, place, err))
        return false;
    if (a->type != DPH_GLTF_FLOAT &&
        (!a->normalized || (a->type != DPH_GLTF_BYTE && a->type != DPH_GLTF_SHORT)))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "%s%s, not FLOAT or normalized SHORT or BYTE",
                             a->normalized ? "normalized " : "", dph_gltf_component_name(a->type));
    *store = a->type == DPH_GLTF_FLOAT   ? DPH_STORE_FLOAT
             : a->type == DPH_GLTF_SHORT ? DPH_STORE_SNORM16
                                         : DPH_STORE_SNORM8;
    return true;
}

static bool read_plane(struct dph_document *doc, const struct dph_gltf_part *part, int number,
                       struct dph_thickness *t, int plane, struct dph_error *err)
{
    struct dph_gltf_accessor a;
    char place[120];
    enum dph_store store;
    size_t size = dph_store_size(t->store), row = (size_t)t->components * size;
    unsigned char *out = (unsigned char *)t->data + part->first * row + (size_t)plane * 4 * size;
    if (!open_rows(doc, part, number, &a, place, &store, err))
        return false;
    if (store != t->store)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "is of another type than _RESPONSE_SH_0 of the first primitive");
    if (store != DPH_STORE_FLOAT) {
        dph_gltf_raw(&a, out, row);
        return true;
    }
    float *four = dph_alloc(a.count, 4 * sizeof *four);
    if (!four)
        return dph_fail_memory(err);
    bool ok = dph_gltf_floats(doc, &a, place, four, err);
    for (size_t v = 0; v < a.count && ok; v++)
        memcpy(out + v * row, four + 4 * v, 4 * sizeof *four);
    free(four);
    return ok;
}

static bool read_rows(struct dph_document *doc, const json_t *d, const char *where, size_t first,
                      size_t last, struct dph_response *response, struct dph_error *err)
{
    int bands = response->bands, planes = (bands * bands + 3) / 4;
    int channels = response->form == DPH_RESPONSE_RGB ? 3 : 1;
    double scale[3 * DPH_DRAW_BANDS];
    struct dph_gltf_accessor a;
    char place[120];
    enum dph_store store;
    bool found;
    if (!dph_gltf_numbers(doc, d, "scale", where, (size_t)(channels * bands), scale, &found, err))
        return false;
    if (!found)
        return dph_gltf_fail(doc, where, DPH_ERROR_INPUT, err, "scale is missing");
    for (int i = 0; i < channels * bands; i++)
        if (!(scale[i] >= 0 && scale[i] <= 1e30))
            return dph_gltf_fail(doc, where, DPH_ERROR_INPUT, err, "scale[%d] is %g, not 0 to 1e30",
                                 i, scale[i]);
    if (!open_rows(doc, &doc->part[first], 0, &a, place, &store, err) ||
        !dph_gltf_check_rows(doc, response->nvert,
                             (size_t)(channels * planes) * 4 * dph_store_size(store), where, err))
        return false;
    for (int c = 0; c < channels; c++) {
        struct dph_thickness *t = response->channel[c] = dph_alloc_zero(1, sizeof *t);
        if (!t)
            return dph_fail_memory(err);
        t->nvert = response->nvert;
        t->bands = bands;
        t->components = 4 * planes;
        t->store = store;
        for (int l = 0; l < DPH_MAX_BANDS; l++)
            t->scale[l] = l < bands ? (float)scale[c * bands + l] : 1;
        if (!(t->data = dph_alloc(t->nvert, (size_t)t->components * dph_store_size(store))))
            return dph_fail_memory(err);
        for (size_t p = first; p < last; p++)
            for (int i = 0; i < planes; i++)
                if (!read_plane(doc, &doc->part[p], c * planes + i, t, i, err))
                    return false;
        dph_gltf_tidy_rows(t);
    }
    return true;
}

/* ---- clusters ---- */

/* Weights and clusters of all parts; `weight` has rows of vectors rounded up to 4. */
static bool read_weights(struct dph_document *doc, size_t first, size_t last, int clusters,
                         int vectors, int8_t *weight, uint16_t *cluster, struct dph_error *err)
{
    size_t row = ((size_t)vectors + 3) / 4 * 4;
    for (size_t p = first; p < last; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        if (!dph_gltf_read_weights(doc, part, "_RESPONSE_CPCA_", vectors,
                                   weight + part->first * row, err) ||
            !dph_gltf_read_clusters(doc, part, "_RESPONSE_CLUSTER", clusters, cluster + part->first,
                                    err))
            return false;
    }
    return true;
}

static bool read_one_channel(struct dph_document *doc, const char *where, size_t first, size_t last,
                             int clusters, int vectors, size_t view, struct dph_response *response,
                             struct dph_error *err)
{
    struct dph_thickness *t = response->channel[0] = dph_alloc_zero(1, sizeof *t);
    if (!t)
        return dph_fail_memory(err);
    t->nvert = response->nvert;
    t->bands = response->bands;
    t->components = (vectors + 3) / 4 * 4;
    t->store = DPH_STORE_CPCA;
    t->clusters = clusters;
    t->vectors = vectors;
    for (int l = 0; l < DPH_MAX_BANDS; l++)
        t->scale[l] = 1;
    if (!dph_gltf_read_table(doc, view, clusters, vectors, t->bands * t->bands, where, &t->table,
                             err))
        return false;
    t->data = dph_alloc(t->nvert, (size_t)t->components);
    t->cluster = dph_alloc(t->nvert, sizeof *t->cluster);
    if (!t->data || !t->cluster)
        return dph_fail_memory(err);
    return read_weights(doc, first, last, clusters, vectors, t->data, t->cluster, err);
}

static bool read_three_channels(struct dph_document *doc, const char *where, size_t first,
                                size_t last, int clusters, int vectors, size_t view,
                                struct dph_response *response, struct dph_error *err)
{
    size_t nvert = response->nvert, row = ((size_t)vectors + 3) / 4 * 4;
    struct dph_cpca *cpca = response->clusters = dph_alloc_zero(1, sizeof *cpca);
    if (!cpca)
        return dph_fail_memory(err);
    cpca->count = nvert;
    cpca->n = 3 * response->bands * response->bands;
    cpca->clusters = clusters;
    cpca->vectors = vectors;
    if (!dph_gltf_read_table(doc, view, clusters, vectors, cpca->n, where, &cpca->table, err))
        return false;
    cpca->cluster = dph_alloc(nvert, sizeof *cpca->cluster);
    cpca->weight = dph_alloc(nvert, (size_t)vectors * sizeof *cpca->weight);
    response->position_of = dph_alloc(nvert, sizeof *response->position_of);
    int8_t *weight = dph_alloc(nvert, row);
    if (!cpca->cluster || !cpca->weight || !response->position_of || !weight) {
        free(weight);
        return dph_fail_memory(err);
    }
    bool ok = read_weights(doc, first, last, clusters, vectors, weight, cpca->cluster, err);
    for (size_t v = 0; v < nvert && ok; v++) {
        response->position_of[v] = (uint32_t)v;
        for (size_t j = 0; j < (size_t)vectors; j++)
            cpca->weight[v * (size_t)vectors + j] = (float)weight[v * row + j] / 127;
    }
    free(weight);
    return ok;
}

bool dph_gltf_read_response(struct dph_document *doc, struct dph_body *body, const json_t *d,
                            const char *where, size_t first, size_t last, struct dph_error *err)
{
    struct dph_response *response = body->rivals->response = dph_alloc_zero(1, sizeof *response);
    if (!response)
        return dph_fail_memory(err);
    response->nvert = body->mesh.nvert;
    response->ramp.top = 1;
    if (!dph_gltf_read_version(doc, d, where, err) ||
        !dph_gltf_read_basis(doc, d, where, DPH_DRAW_BANDS, &response->bands, err) ||
        !dph_gltf_read_origin(doc, d, where, &body->rivals->response_origin, err) ||
        !read_form(doc, d, where, response, err) ||
        !read_number(doc, d, "noise", where, &response->noise, err) ||
        !read_number(doc, d, "walks", where, &response->walks, err) ||
        !read_view(doc, d, where, &response->view, err) ||
        (response->form != DPH_RESPONSE_RGB && !read_ramp(doc, d, where, &response->ramp, err)))
        return false;
    if (json_object_get(d, "clusters")) {
        int clusters, vectors;
        size_t view;
        if (!dph_gltf_read_counts(doc, d, where, &clusters, &vectors, &view, err) ||
            !dph_gltf_check_rows(doc, response->nvert,
                                 ((size_t)vectors + 3) / 4 * 4 * sizeof(float), where, err))
            return false;
        if (clusters > DPH_CPCA_MAX_CLUSTERS)
            return dph_gltf_fail(doc, where, DPH_ERROR_INPUT, err, "clusters is %d, not 1 to %d",
                                 clusters, DPH_CPCA_MAX_CLUSTERS);
        bool (*read)(struct dph_document *, const char *, size_t, size_t, int, int, size_t,
                     struct dph_response *, struct dph_error *) =
            response->form == DPH_RESPONSE_RGB ? read_three_channels : read_one_channel;
        if (!read(doc, where, first, last, clusters, vectors, view, response, err))
            return false;
    } else if (!read_rows(doc, d, where, first, last, response, err)) {
        return false;
    }
    body->rivals->products |= DPH_PRODUCT_RESPONSE;
    return true;
}
