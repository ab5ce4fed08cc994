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

json_t *dph_gltf_primitive(const struct dph_document *doc, const struct dph_gltf_part *part)
{
    json_t *mesh = json_array_get(json_object_get(doc->root, "meshes"), part->mesh);
    return json_array_get(json_object_get(mesh, "primitives"), part->primitive);
}

static const json_t *description(const json_t *primitive)
{
    const json_t *diaphan = json_object_get(json_object_get(primitive, "extras"), "diaphan");
    return json_object_get(diaphan, "thickness_cpca");
}

bool dph_gltf_read_counts(const struct dph_document *doc, const json_t *d, const char *place,
                          int *clusters, int *vectors, size_t *view, struct dph_error *err)
{
    size_t k, j;
    if (!dph_gltf_size(doc, d, "clusters", place, DPH_GLTF_REQUIRED, SIZE_MAX, &k, err) ||
        !dph_gltf_size(doc, d, "vectors", place, DPH_GLTF_REQUIRED, SIZE_MAX, &j, err) ||
        !dph_gltf_size(doc, d, "bufferView", place, DPH_GLTF_REQUIRED, SIZE_MAX, view, err))
        return false;
    if (k < 1 || k > UINT16_MAX)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "clusters is %zu, not 1 to %d", k,
                             UINT16_MAX);
    if (j < 1 || j > DPH_THICKNESS_MAX_VECTORS)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "vectors is %zu, not 1 to %d", j,
                             DPH_THICKNESS_MAX_VECTORS);
    *clusters = (int)k;
    *vectors = (int)j;
    return true;
}

/* Reads a description into `t` (all but nvert and the arrays) and the number of the table's view. */
static bool parse(const struct dph_document *doc, const json_t *d, const char *place,
                  struct dph_thickness *t, double *mm_per_unit, size_t *view, struct dph_error *err)
{
    if (!dph_gltf_read_description(doc, d, place, false, t, mm_per_unit, err) ||
        !dph_gltf_read_counts(doc, d, place, &t->clusters, &t->vectors, view, err))
        return false;
    t->store = DPH_STORE_CPCA;
    t->components = (t->vectors + 3) / 4 * 4;
    return true;
}

static bool same(const struct dph_thickness *a, const struct dph_thickness *b)
{
    return a->bands == b->bands && a->definition == b->definition && a->fit == b->fit &&
           a->directions == b->directions && a->clusters == b->clusters && a->vectors == b->vectors;
}

bool dph_gltf_read_table(struct dph_document *doc, size_t number, int clusters, int vectors, int n,
                         const char *place, float **table, struct dph_error *err)
{
    struct dph_gltf_view view;
    size_t count = (size_t)clusters * (1 + (size_t)vectors) * (size_t)n;
    if (!dph_gltf_view(doc, number, place, &view, err))
        return false;
    if (view.size < count * sizeof **table)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "bufferView %zu has %zu bytes, %d clusters of %d vectors need %zu", number,
                             view.size, clusters, vectors, count * sizeof **table);
    float *out = *table = dph_alloc(count, sizeof *out);
    if (!out)
        return dph_fail_memory(err);
    if (view.data)
        memcpy(out, view.data, count * sizeof *out);
    else
        memset(out, 0, count * sizeof *out);
    for (size_t i = 0; i < count; i++)
        if (!isfinite(out[i]))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "number %zu of bufferView %zu is not finite",
                                 i, number);
    return true;
}

bool dph_gltf_open_attribute(struct dph_document *doc, const struct dph_gltf_part *part,
                             const char *name, int components, struct dph_gltf_accessor *a,
                             char place[120], struct dph_error *err)
{
    json_t *attributes = json_object_get(dph_gltf_primitive(doc, part), "attributes");
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

bool dph_gltf_read_weights(struct dph_document *doc, const struct dph_gltf_part *part,
                           const char *prefix, int vectors, int8_t *out, struct dph_error *err)
{
    struct dph_gltf_accessor a;
    char place[120], name[48];
    size_t row = ((size_t)vectors + 3) / 4 * 4;
    for (size_t i = 0; i < row / 4; i++) {
        snprintf(name, sizeof name, "%s%d", prefix, (int)i);
        if (!dph_gltf_open_attribute(doc, part, name, 4, &a, place, err))
            return false;
        if (a.type != DPH_GLTF_BYTE || !a.normalized)
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s%s, not normalized BYTE",
                                 a.normalized ? "normalized " : "", dph_gltf_component_name(a.type));
        dph_gltf_raw(&a, (unsigned char *)out + 4 * i, row);
    }
    for (size_t v = 0; v < part->count; v++)
        for (size_t j = 0; j < row; j++) { /* glTF reads -128 as -1 */
            int8_t *w = &out[v * row + j];
            *w = j >= (size_t)vectors ? 0 : *w < -127 ? -127 : *w;
        }
    return true;
}

bool dph_gltf_read_clusters(struct dph_document *doc, const struct dph_gltf_part *part,
                            const char *name, int clusters, uint16_t *out, struct dph_error *err)
{
    struct dph_gltf_accessor a;
    char place[120];
    if (!dph_gltf_open_attribute(doc, part, name, 1, &a, place, err))
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
        if (number[v] >= (uint32_t)clusters)
            ok = dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "element %zu is %u, there are %d clusters", v,
                               number[v], clusters);
        out[v] = (uint16_t)number[v];
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
        const json_t *d = description(dph_gltf_primitive(doc, part));
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
    if (!dph_gltf_read_table(doc, view, t->clusters, t->vectors, t->bands * t->bands, place,
                             &t->table, err))
        goto error;
    t->data = dph_alloc(t->nvert, (size_t)t->components);
    t->cluster = dph_alloc(t->nvert, sizeof *t->cluster);
    if (!t->data || !t->cluster) {
        dph_fail_memory(err);
        goto error;
    }
    for (size_t p = first; p < last; p++)
        if (!dph_gltf_read_weights(doc, &doc->part[p], "_THICKNESS_CPCA_", t->vectors,
                                   (int8_t *)t->data + doc->part[p].first * (size_t)t->components,
                                   err) ||
            !dph_gltf_read_clusters(doc, &doc->part[p], "_THICKNESS_CLUSTER", t->clusters,
                                    t->cluster + doc->part[p].first, err))
            goto error;
    body->thickness = t;
    return true;

error:
    dph_thickness_destroy(t);
    return false;
}

size_t dph_gltf_put_clusters(struct dph_gltf_output *out, const uint16_t *cluster, size_t count)
{
    unsigned char *four = dph_alloc_zero(count, 4);
    if (!four) {
        out->memory = true;
        return 0;
    }
    for (size_t v = 0; v < count; v++) { /* little-endian, so that a byte and a short begin alike */
        unsigned number = cluster[v];
        four[4 * v] = (unsigned char)(number & 255);
        four[4 * v + 1] = (unsigned char)(number >> 8);
    }
    return dph_gltf_put_bytes(out, four, 4 * count, 4, four);
}
