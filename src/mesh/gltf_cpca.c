/* glTF: baked thickness stored as clustered principal components: weights in the attributes
 * _THICKNESS_CPCA_i, the number of the cluster in _THICKNESS_CLUSTER, means and vectors in the
 * buffer view that extras.diaphan.thickness_cpca names. Format: docs/file-format.md. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static json_t *primitive_of(const struct dph_document *doc, const struct dph_gltf_part *part)
{
    json_t *mesh = json_array_get(json_object_get(doc->root, "meshes"), part->mesh);
    return json_array_get(json_object_get(mesh, "primitives"), part->primitive);
}

static const json_t *description(const json_t *primitive)
{
    const json_t *diaphan = json_object_get(json_object_get(primitive, "extras"), "diaphan");
    return json_object_get(diaphan, "thickness_cpca");
}

/* Reads a description into `t` (all but nvert and the arrays) and the number of the table's view. */
static bool parse(const struct dph_document *doc, const json_t *d, const char *place,
                  struct dph_thickness *t, double *mm_per_unit, size_t *view, struct dph_error *err)
{
    size_t clusters, vectors;
    if (!dph_gltf_read_description(doc, d, place, false, t, mm_per_unit, err) ||
        !dph_gltf_size(doc, d, "clusters", place, DPH_GLTF_REQUIRED, SIZE_MAX, &clusters, err) ||
        !dph_gltf_size(doc, d, "vectors", place, DPH_GLTF_REQUIRED, SIZE_MAX, &vectors, err) ||
        !dph_gltf_size(doc, d, "bufferView", place, DPH_GLTF_REQUIRED, SIZE_MAX, view, err))
        return false;
    if (clusters < 1 || clusters > UINT16_MAX)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "clusters is %zu, not 1 to %d", clusters, UINT16_MAX);
    if (vectors < 1 || vectors > DPH_THICKNESS_MAX_VECTORS)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "vectors is %zu, not 1 to %d", vectors,
                             DPH_THICKNESS_MAX_VECTORS);
    t->store = DPH_STORE_CPCA;
    t->clusters = (int)clusters;
    t->vectors = (int)vectors;
    t->components = (int)((vectors + 3) / 4 * 4);
    return true;
}

static bool same(const struct dph_thickness *a, const struct dph_thickness *b)
{
    return a->bands == b->bands && a->definition == b->definition && a->fit == b->fit &&
           a->directions == b->directions && a->clusters == b->clusters && a->vectors == b->vectors;
}

static bool read_table(struct dph_document *doc, struct dph_thickness *t, size_t number,
                       const char *place, struct dph_error *err)
{
    struct dph_gltf_view view;
    size_t count = (size_t)t->clusters * (1 + (size_t)t->vectors) * (size_t)(t->bands * t->bands);
    if (!dph_gltf_view(doc, number, place, &view, err))
        return false;
    if (view.size < count * sizeof *t->table)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "bufferView %zu has %zu bytes, %d clusters of %d vectors need %zu", number,
                             view.size, t->clusters, t->vectors, count * sizeof *t->table);
    if (!(t->table = dph_alloc(count, sizeof *t->table)))
        return dph_fail_memory(err);
    if (view.data)
        memcpy(t->table, view.data, count * sizeof *t->table);
    else
        memset(t->table, 0, count * sizeof *t->table);
    for (size_t i = 0; i < count; i++)
        if (!isfinite(t->table[i]))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "number %zu of bufferView %zu is not finite",
                                 i, number);
    return true;
}

/* Opens an attribute of a primitive; the message's place is left in `place`. */
static bool open_attribute(struct dph_document *doc, const struct dph_gltf_part *part,
                           const char *name, int components, struct dph_gltf_accessor *a,
                           char place[120], struct dph_error *err)
{
    json_t *attributes = json_object_get(primitive_of(doc, part), "attributes");
    snprintf(place, 120, "meshes[%zu].primitives[%zu].attributes", part->mesh, part->primitive);
    const char *key = dph_gltf_attribute_name(attributes, name);
    if (!key)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s is missing; bake the model again", name);
    if (!dph_gltf_accessor_at(doc, attributes, key, place, NULL, a, err))
        return false;
    snprintf(place, 120, "meshes[%zu].primitives[%zu].attributes.%s", part->mesh, part->primitive, name);
    if (a->components != components)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "has %d components instead of %d",
                             a->components, components);
    if (a->count != part->count)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "has %zu elements, POSITION has %zu", a->count, part->count);
    return true;
}

static bool read_weights(struct dph_document *doc, const struct dph_gltf_part *part,
                         struct dph_thickness *t, struct dph_error *err)
{
    struct dph_gltf_accessor a;
    char place[120], name[32];
    size_t row = (size_t)t->components, vectors = (size_t)t->vectors;
    int8_t *out = (int8_t *)t->data + part->first * row;
    for (size_t i = 0; i < row / 4; i++) {
        snprintf(name, sizeof name, "_THICKNESS_CPCA_%d", (int)i);
        if (!open_attribute(doc, part, name, 4, &a, place, err))
            return false;
        if (a.type != DPH_GLTF_BYTE || !a.normalized)
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s%s, not normalized BYTE",
                                 a.normalized ? "normalized " : "", dph_gltf_component_name(a.type));
        dph_gltf_raw(&a, (unsigned char *)out + 4 * i, row);
    }
    for (size_t v = 0; v < part->count; v++)
        for (size_t j = 0; j < row; j++) { /* glTF reads -128 as -1 */
            int8_t *w = &out[v * row + j];
            *w = j >= vectors ? 0 : *w < -127 ? -127 : *w;
        }
    return true;
}

static bool read_clusters(struct dph_document *doc, const struct dph_gltf_part *part,
                          struct dph_thickness *t, struct dph_error *err)
{
    struct dph_gltf_accessor a;
    char place[120];
    if (!open_attribute(doc, part, "_THICKNESS_CLUSTER", 1, &a, place, err))
        return false;
    if ((a.type != DPH_GLTF_UBYTE && a.type != DPH_GLTF_USHORT) || a.normalized)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s%s, not UNSIGNED_BYTE or UNSIGNED_SHORT",
                             a.normalized ? "normalized " : "", dph_gltf_component_name(a.type));
    uint32_t *number = dph_alloc(a.count, sizeof *number);
    if (!number)
        return dph_fail_memory(err);
    dph_gltf_uints(&a, number);
    bool ok = true;
    for (size_t v = 0; v < a.count && ok; v++) {
        if (number[v] >= (uint32_t)t->clusters)
            ok = dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "element %zu is %u, there are %d clusters", v,
                               number[v], t->clusters);
        t->cluster[part->first + v] = (uint16_t)number[v];
    }
    free(number);
    return ok;
}

bool dph_gltf_read_cpca(struct dph_document *doc, struct dph_body *body, size_t first, size_t last,
                        double *mm_per_unit, struct dph_error *err)
{
    struct dph_thickness *t = NULL;
    char place[120];
    size_t baked = 0, view = 0;
    for (size_t p = first; p < last; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        const json_t *d = description(primitive_of(doc, part));
        struct dph_thickness own = {.nvert = body->mesh.nvert};
        double unit = 0;
        size_t own_view;
        snprintf(place, sizeof place, "meshes[%zu].primitives[%zu].extras.diaphan.thickness_cpca",
                 part->mesh, part->primitive);
        if (!d)
            continue;
        if (!parse(doc, d, place, &own, &unit, &own_view, err))
            goto error;
        if (!baked++) {
            if (!(t = malloc(sizeof *t))) {
                dph_fail_memory(err);
                goto error;
            }
            *t = own;
            *mm_per_unit = unit;
            view = own_view;
        } else if (!same(t, &own) || unit != *mm_per_unit || view != own_view) {
            dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                          "differs from that of meshes[%zu].primitives[%zu]; bake the model again",
                          doc->part[first].mesh, doc->part[first].primitive);
            goto error;
        }
    }
    if (!baked)
        return true;
    if (baked != last - first) {
        dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                      "meshes[%zu]: only %zu of its %zu triangle primitives are baked; bake the "
                      "model without the old thickness", doc->part[first].mesh, baked, last - first);
        goto error;
    }
    snprintf(place, sizeof place, "meshes[%zu].primitives[%zu].extras.diaphan.thickness_cpca",
             doc->part[first].mesh, doc->part[first].primitive);
    if (!read_table(doc, t, view, place, err))
        goto error;
    t->data = dph_alloc(t->nvert, (size_t)t->components);
    t->cluster = dph_alloc(t->nvert, sizeof *t->cluster);
    if (!t->data || !t->cluster) {
        dph_fail_memory(err);
        goto error;
    }
    for (size_t p = first; p < last; p++)
        if (!read_weights(doc, &doc->part[p], t, err) || !read_clusters(doc, &doc->part[p], t, err))
            goto error;
    body->thickness = t;
    return true;

error:
    dph_thickness_destroy(t);
    return false;
}

size_t dph_gltf_put_clusters(struct dph_gltf_output *out, const struct dph_thickness *thickness,
                             size_t first, size_t count)
{
    unsigned char *four = dph_alloc_zero(count, 4);
    if (!four) {
        out->memory = true;
        return 0;
    }
    for (size_t v = 0; v < count; v++) { /* little-endian, so that a byte and a short begin alike */
        unsigned number = thickness->cluster[first + v];
        four[4 * v] = (unsigned char)(number & 255);
        four[4 * v + 1] = (unsigned char)(number >> 8);
    }
    return dph_gltf_put_bytes(out, four, 4 * count, 4, four);
}
