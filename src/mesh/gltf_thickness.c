/* glTF: baked thickness, from the attributes _THICKNESS_SH_i and extras.diaphan.thickness_sh of a
 * mesh's primitives. Format: docs/file-format.md. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool same_text(const char *a, const char *b)
{
    while (*a && tolower((unsigned char)*a) == tolower((unsigned char)*b)) {
        a++;
        b++;
    }
    return *a == *b;
}

const char *dph_gltf_attribute_name(json_t *attributes, const char *name)
{
    const char *key;
    json_t *value;
    json_object_foreach(attributes, key, value)
        if (same_text(key, name))
            return key;
    return NULL;
}

const char *dph_gltf_thickness_name(json_t *attributes, int i)
{
    char name[32];
    snprintf(name, sizeof name, "_THICKNESS_SH_%d", i);
    return dph_gltf_attribute_name(attributes, name);
}

/* The object extras.diaphan.thickness_sh, NULL where there is none. */
static const json_t *description(const json_t *primitive)
{
    const json_t *diaphan = json_object_get(json_object_get(primitive, "extras"), "diaphan");
    return json_object_get(diaphan, "thickness_sh");
}

static bool find_definition(const char *text, enum dph_definition *definition)
{
    const char *name;
    for (int i = 0; (name = dph_definition_name((enum dph_definition)i)); i++)
        if (!strcmp(name, text)) {
            *definition = (enum dph_definition)i;
            return true;
        }
    return false;
}

static bool find_fit(const char *text, enum dph_fit *fit)
{
    const char *name;
    for (int i = 0; (name = dph_fit_name((enum dph_fit)i)); i++)
        if (!strcmp(name, text)) {
            *fit = (enum dph_fit)i;
            return true;
        }
    return false;
}

bool dph_gltf_read_version(const struct dph_document *doc, const json_t *d, const char *place,
                           struct dph_error *err)
{
    size_t version;
    if (!json_is_object(d))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "is not an object");
    if (!dph_gltf_size(doc, d, "version", place, DPH_GLTF_REQUIRED, SIZE_MAX, &version, err))
        return false;
    return version == 1 ||
           dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                         "version is %zu, only 1 is read; bake the model again", version);
}

bool dph_gltf_read_basis(const struct dph_document *doc, const json_t *d, const char *place,
                         int most, int *number, struct dph_error *err)
{
    size_t bands;
    if (!dph_gltf_size(doc, d, "bands", place, DPH_GLTF_REQUIRED, SIZE_MAX, &bands, err))
        return false;
    if (bands < 1 || bands > (size_t)most)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "bands is %zu, not 1 to %d", bands,
                             most);
    *number = (int)bands;
    const json_t *order = json_object_get(d, "order");
    if (order && (!json_is_string(order) || strcmp(json_string_value(order), "l*(l+1)+m")))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "order is not \"l*(l+1)+m\", the only one that is read");
    const json_t *sign = json_object_get(d, "condon_shortley");
    if (sign && !json_is_true(sign))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "condon_shortley is not true, the only sign that is read");
    return true;
}

bool dph_gltf_read_description(const struct dph_document *doc, const json_t *d, const char *place,
                               bool scaled, struct dph_thickness *t, double *mm_per_unit,
                               struct dph_error *err)
{
    size_t bands, directions;
    double scale[DPH_MAX_BANDS];
    bool found;
    if (!dph_gltf_read_version(doc, d, place, err) ||
        !dph_gltf_read_basis(doc, d, place, DPH_MAX_BANDS, &t->bands, err))
        return false;
    bands = (size_t)t->bands;
    t->components = (int)((bands * bands + 3) / 4 * 4);
    if (!dph_gltf_numbers(doc, d, "scale", place, bands, scale, &found, err))
        return false;
    if (scaled && !found)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "scale is missing");
    for (size_t l = 0; l < bands; l++) {
        t->scale[l] = scaled ? (float)scale[l] : 1;
        if (!(t->scale[l] >= 0) || !isfinite(t->scale[l]))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                                 "scale[%zu] is %g, not a finite number of at least 0", l,
                                 scale[l]);
    }
    const char *definition = json_string_value(json_object_get(d, "definition"));
    const char *fit = json_string_value(json_object_get(d, "fit"));
    if (!find_definition(definition ? definition : "", &t->definition))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "definition \"%.20s\" is not known",
                             definition ? definition : "");
    if (!find_fit(fit ? fit : "", &t->fit))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "fit \"%.20s\" is not known",
                             fit ? fit : "");
    if (!dph_gltf_size(doc, d, "directions", place, 0, 1 << 30, &directions, err))
        return false;
    t->directions = (int)directions;
    const json_t *unit = json_object_get(d, "mm_per_unit");
    *mm_per_unit = unit ? json_number_value(unit) : 0;
    if (unit && !(*mm_per_unit > 0))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "mm_per_unit is %g, not a number above 0", *mm_per_unit);
    return true;
}

static bool same(const struct dph_thickness *a, const struct dph_thickness *b)
{
    return a->bands == b->bands && a->definition == b->definition && a->fit == b->fit &&
           a->directions == b->directions && !memcmp(a->scale, b->scale, sizeof a->scale);
}

/* Opens attribute i of a primitive. */
static bool open_attribute(struct dph_document *doc, const struct dph_gltf_part *part,
                           const json_t *primitive, int i, struct dph_gltf_accessor *a,
                           char place[120], enum dph_store *store, struct dph_error *err)
{
    json_t *attributes = json_object_get(primitive, "attributes");
    snprintf(place, 120, "meshes[%zu].primitives[%zu].attributes", part->mesh, part->primitive);
    const char *name = dph_gltf_thickness_name(attributes, i);
    if (!name)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "_THICKNESS_SH_%d is missing; bake the model again", i);
    if (!dph_gltf_accessor_at(doc, attributes, name, place, NULL, a, err))
        return false;
    snprintf(place, 120, "meshes[%zu].primitives[%zu].attributes._THICKNESS_SH_%d", part->mesh,
             part->primitive, i);
    if (a->components != 4)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "has %d components instead of 4",
                             a->components);
    if (a->count != part->count)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "has %zu elements, POSITION has %zu", a->count, part->count);
    bool known = a->type == DPH_GLTF_FLOAT ||
                 (a->normalized && (a->type == DPH_GLTF_BYTE || a->type == DPH_GLTF_SHORT));
    if (!known)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "%s%s, not FLOAT or normalized SHORT or BYTE",
                             a->normalized ? "normalized " : "", dph_gltf_component_name(a->type));
    *store = a->type == DPH_GLTF_FLOAT   ? DPH_STORE_FLOAT
             : a->type == DPH_GLTF_SHORT ? DPH_STORE_SNORM16 : DPH_STORE_SNORM8;
    return true;
}

/* glTF reads -128 as -1, so rows must not hold it either. */
static void clamp(struct dph_thickness *t)
{
    size_t n = t->nvert * (size_t)t->components;
    if (t->store == DPH_STORE_SNORM8)
        for (size_t i = 0; i < n; i++)
            if (((int8_t *)t->data)[i] < -127)
                ((int8_t *)t->data)[i] = -127;
    if (t->store == DPH_STORE_SNORM16)
        for (size_t i = 0; i < n; i++)
            if (((int16_t *)t->data)[i] < -32767)
                ((int16_t *)t->data)[i] = -32767;
}

void dph_gltf_tidy_rows(struct dph_thickness *t)
{
    size_t size = dph_store_size(t->store), used = (size_t)(t->bands * t->bands);
    for (size_t v = 0; v < t->nvert && used < (size_t)t->components; v++)
        memset((unsigned char *)t->data + (v * (size_t)t->components + used) * size, 0,
               ((size_t)t->components - used) * size);
    if (t->store != DPH_STORE_FLOAT) {
        clamp(t);
        return;
    }
    for (int l = 0; l < t->bands; l++) {
        for (size_t v = 0; t->scale[l] != 1 && v < t->nvert; v++)
            for (int i = l * l; i < (l + 1) * (l + 1); i++)
                ((float *)t->data)[v * (size_t)t->components + (size_t)i] *= t->scale[l];
        t->scale[l] = 1;
    }
}

bool dph_gltf_read_thickness(struct dph_document *doc, struct dph_body *body, size_t first,
                             size_t last, double *mm_per_unit, struct dph_error *err)
{
    struct dph_thickness *t = NULL;
    char place[120];
    float *rows = NULL;
    size_t baked = 0;
    for (size_t p = first; p < last; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        const json_t *mesh = json_array_get(json_object_get(doc->root, "meshes"), part->mesh);
        const json_t *primitive =
            json_array_get(json_object_get(mesh, "primitives"), part->primitive);
        const json_t *d = description(primitive);
        struct dph_thickness own = {.nvert = body->mesh.nvert};
        double unit = 0.0;
        snprintf(place, sizeof place, "meshes[%zu].primitives[%zu].extras.diaphan.thickness_sh",
                 part->mesh, part->primitive);
        if (!d)
            continue;
        if (!dph_gltf_read_description(doc, d, place, true, &own, &unit, err))
            goto error;
        if (!baked++) {
            if (!(t = malloc(sizeof *t))) {
                dph_fail_memory(err);
                goto error;
            }
            *t = own;
            *mm_per_unit = unit;
        } else if (!same(t, &own) || unit != *mm_per_unit) {
            dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                          "differs from that of meshes[%zu].primitives[%zu]; bake the model again",
                          doc->part[first].mesh, doc->part[first].primitive);
            goto error;
        }
    }
    if (!baked)
        return dph_gltf_read_cpca(doc, body, first, last, mm_per_unit, err);
    if (baked != last - first) {
        dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                      "meshes[%zu]: only %zu of its %zu triangle primitives are baked; bake the "
                      "model without the old thickness",
                      doc->part[first].mesh, baked, last - first);
        goto error;
    }

    /* Of one type it is kept as it is stored, of several it becomes float. */
    bool mixed = false;
    int count = t->components / 4;
    struct dph_gltf_accessor a;
    enum dph_store store;
    for (size_t p = first; p < last; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        const json_t *primitive = json_array_get(
            json_object_get(json_array_get(json_object_get(doc->root, "meshes"), part->mesh),
                            "primitives"), part->primitive);
        for (int i = 0; i < count; i++) {
            if (!open_attribute(doc, part, primitive, i, &a, place, &store, err))
                goto error;
            if (p == first && i == 0)
                t->store = store;
            mixed = mixed || store != t->store;
        }
    }
    if (mixed)
        t->store = DPH_STORE_FLOAT;
    size_t size = dph_store_size(t->store), row = size * (size_t)t->components;
    if (!(t->data = dph_alloc(t->nvert, row))) {
        dph_fail_memory(err);
        goto error;
    }
    for (size_t p = first; p < last; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        const json_t *primitive = json_array_get(
            json_object_get(json_array_get(json_object_get(doc->root, "meshes"), part->mesh),
                            "primitives"), part->primitive);
        for (int i = 0; i < count; i++) {
            unsigned char *out =
                (unsigned char *)t->data + part->first * row + (size_t)i * 4 * size;
            if (!open_attribute(doc, part, primitive, i, &a, place, &store, err))
                goto error;
            if (t->store != DPH_STORE_FLOAT) {
                dph_gltf_raw(&a, out, row);
                continue;
            }
            if (!(rows = dph_alloc(a.count, 4 * sizeof *rows))) {
                dph_fail_memory(err);
                goto error;
            }
            if (!dph_gltf_floats(doc, &a, place, rows, err))
                goto error;
            for (size_t v = 0; v < a.count; v++)
                memcpy(out + v * row, rows + 4 * v, 4 * sizeof *rows);
            free(rows);
            rows = NULL;
        }
    }
    dph_gltf_tidy_rows(t);
    body->thickness = t;
    return true;

error:
    free(rows);
    if (t)
        free(t->data);
    free(t);
    return false;
}
