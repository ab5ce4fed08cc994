/* glTF: writing what the methods beside SHSSS store: _PATRO_NORMAL, _PRT_SH_i, _PRT_CPCA_i with
 * _PRT_CLUSTER, each with its description in extras.diaphan. Format: docs/file-format.md. */
#include "mesh/gltf.h"

#include "core/memory.h"

#include <diaphan/rivals.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void fill_normals(const struct dph_gltf_product *product, size_t first, size_t count,
                         unsigned char *out)
{
    memcpy(out, product->rivals->normal + 3 * first, 12 * count);
}

static void fill_transfer(const struct dph_gltf_product *product, size_t first, size_t count,
                          unsigned char *out)
{
    const struct dph_transfer *t = &product->rivals->transfer;
    for (size_t plane = 0; plane < product->planes; plane++) {
        size_t used = t->length - 4 * plane < 4 ? t->length - 4 * plane : 4;
        for (size_t v = first; v < first + count; v++, out += 16)
            memcpy(out, t->vector + t->position_of[v] * t->length + 4 * plane, 4 * used);
    }
}

static void fill_clusters(const struct dph_gltf_product *product, size_t first, size_t count,
                          unsigned char *out)
{
    const struct dph_cpca *cpca = product->rivals->clusters;
    const uint32_t *row = product->rivals->transfer.position_of;
    size_t vectors = (size_t)cpca->vectors;
    for (size_t plane = 0; plane + 1 < product->planes; plane++)
        for (size_t v = first; v < first + count; v++, out += 4)
            for (size_t j = 4 * plane; j < 4 * plane + 4 && j < vectors; j++)
                out[j - 4 * plane] =
                    (unsigned char)dph_cpca_snorm8(cpca->weight[row[v] * vectors + j]);
    for (size_t v = first; v < first + count; v++, out += 4) {
        out[0] = (unsigned char)(cpca->cluster[row[v]] & 255); /* little-endian */
        out[1] = (unsigned char)(cpca->cluster[row[v]] >> 8);
    }
}

static json_t *three(struct dph_gltf_output *out, const double value[3])
{
    json_t *list = json_array();
    for (int c = 0; c < 3; c++)
        dph_gltf_append(out, list, json_real(value[c]));
    return list;
}

void dph_gltf_describe_origin(struct dph_gltf_output *out, json_t *d,
                              const struct dph_rivals_origin *origin)
{
    json_t *material = json_object();
    /* a name that is no UTF-8 is left out, it says nothing that counts */
    json_t *name = json_string(origin->material);
    dph_gltf_set(out, material, "name", name ? name : json_string(""));
    dph_gltf_set(out, material, "scattering", three(out, origin->scattering));
    dph_gltf_set(out, material, "absorption", three(out, origin->absorption));
    dph_gltf_set(out, material, "anisotropy", json_real(origin->anisotropy));
    dph_gltf_set(out, d, "material", material);
    if (origin->directions)
        dph_gltf_set(out, d, "directions", json_integer(origin->directions));
    dph_gltf_set(out, d, "mm_per_unit", json_real(origin->mm_per_unit));
}

static json_t *describe_normals(struct dph_gltf_output *out, const struct dph_gltf_product *product,
                                size_t table)
{
    json_t *d = json_object();
    (void)table;
    dph_gltf_set(out, d, "version", json_integer(1));
    dph_gltf_describe_origin(out, d, &product->rivals->normal_origin);
    return d;
}

static json_t *describe_transfer(struct dph_gltf_output *out, const struct dph_gltf_product *product,
                                 size_t table)
{
    json_t *d = json_object();
    dph_gltf_set(out, d, "version", json_integer(1));
    dph_gltf_set(out, d, "bands", json_integer(product->rivals->transfer.bands));
    dph_gltf_set(out, d, "order", json_string("l*(l+1)+m"));
    dph_gltf_set(out, d, "condon_shortley", json_true());
    if (product->table) {
        dph_gltf_set(out, d, "clusters", json_integer(product->rivals->clusters->clusters));
        dph_gltf_set(out, d, "vectors", json_integer(product->rivals->clusters->vectors));
        dph_gltf_set(out, d, "bufferView", dph_gltf_number(table));
    }
    dph_gltf_describe_origin(out, d, &product->rivals->transfer_origin);
    return d;
}

/* What one primitive's planes are, kept to compare with. */
struct written {
    const unsigned char *bytes;
    size_t accessor; /* the first of them in the list */
};

/* Two primitives with the same vertices share the same attributes. */
static const struct written *twin(const struct dph_gltf_strand *strand, const struct written *done,
                                  size_t i, const unsigned char *bytes, size_t row)
{
    for (size_t k = i > DPH_GLTF_TWIN_REACH ? i - DPH_GLTF_TWIN_REACH : 0;
         k < i && strand[i].position; k++)
        if (strand[k].position && strand[k].count == strand[i].count &&
            json_equal(strand[k].position, strand[i].position) &&
            !memcmp(done[k].bytes, bytes, strand[i].count * row))
            return &done[k];
    return NULL;
}

bool dph_gltf_add_product(struct dph_gltf_output *out, struct dph_gltf_slots *slots,
                          const struct dph_gltf_product *product, struct dph_gltf_strand *strand,
                          size_t nstrand)
{
    size_t begin = SIZE_MAX, view = SIZE_MAX, table = SIZE_MAX, planes = product->planes;
    size_t *list = dph_alloc(nstrand * planes, sizeof *list);
    struct written *done = dph_alloc(nstrand, sizeof *done);
    bool ok = list && done;
    if (ok && product->table) {
        size_t at = dph_gltf_put_bytes(out, product->table, product->table_size, 4, NULL);
        table = dph_gltf_place(out, "bufferViews", slots->view, &slots->nview,
                               dph_gltf_make_view(out, at, product->table_size, 0, 0));
    }
    for (size_t i = 0; i < nstrand && ok; i++) {
        size_t plane = strand[i].count * product->stride;
        unsigned char *bytes = dph_alloc_zero(planes, plane);
        if (!(ok = bytes != NULL))
            break;
        product->fill(product, strand[i].first, strand[i].count, bytes);
        const struct written *same = twin(strand, done, i, bytes, planes * product->stride);
        if (same) {
            done[i] = *same;
            free(bytes);
        } else {
            done[i] = (struct written){bytes, i * planes};
            size_t at = dph_gltf_put_bytes(out, bytes, planes * plane, 4, bytes);
            if (out->memory) { /* the bytes are gone */
                ok = false;
                break;
            }
            if (begin == SIZE_MAX) { /* its length is known at the end */
                begin = at;
                view = dph_gltf_place(out, "bufferViews", slots->view, &slots->nview,
                                      dph_gltf_make_view(out, at, 0, product->stride, 34962));
            }
            for (size_t k = 0; k < planes; k++) {
                bool last = product->last && k + 1 == planes;
                list[i * planes + k] = dph_gltf_place(
                    out, "accessors", slots->accessor, &slots->naccessor,
                    dph_gltf_make_accessor(out, view, at - begin + k * plane,
                                           last ? product->last_type : product->type,
                                           strand[i].count, last ? "SCALAR" : product->shape));
            }
        }
        json_t *attributes = dph_gltf_own_object(out, strand[i].primitive, "attributes");
        for (size_t k = 0; k < planes; k++) {
            char name[32];
            if (product->last && k + 1 == planes)
                snprintf(name, sizeof name, "%s", product->last);
            else if (product->single)
                snprintf(name, sizeof name, "%s", product->prefix);
            else
                snprintf(name, sizeof name, "%s%d", product->prefix, (int)k);
            dph_gltf_set(out, attributes, name, dph_gltf_number(list[done[i].accessor + k]));
        }
        dph_gltf_set_description(out, strand[i].primitive, product->key,
                                 product->describe(out, product, table));
    }
    if (ok)
        dph_gltf_set(out, json_array_get(json_object_get(out->root, "bufferViews"), view),
                     "byteLength", dph_gltf_number(out->size - begin));
    free(list);
    free(done);
    return ok;
}

static void clear(struct dph_gltf_output *out, json_t *primitive)
{
    static const char *const keys[] = {"patro", "prt", "prt_cpca", "response"};
    json_t *attributes = dph_gltf_own_object(out, primitive, "attributes"), *value;
    const char *name;
    void *next;
    json_object_foreach_safe(attributes, next, name, value)
        if (dph_gltf_is_rivals_name(name))
            json_object_del(attributes, name);
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        dph_gltf_set_description(out, primitive, keys[i], NULL);
}

bool dph_gltf_add_rivals(struct dph_gltf_output *out, struct dph_gltf_slots *slots,
                         const struct dph_rivals *rivals, struct dph_gltf_strand *strand,
                         size_t nstrand)
{
    for (size_t i = 0; i < nstrand; i++) {
        clear(out, strand[i].primitive);
        if (rivals->products)
            dph_gltf_drop_draco(out, strand[i].primitive);
    }
    struct dph_gltf_product normals = {.rivals = rivals,
                                       .key = "patro",
                                       .prefix = "_PATRO_NORMAL",
                                       .single = true,
                                       .shape = "VEC3",
                                       .type = DPH_GLTF_FLOAT,
                                       .planes = 1,
                                       .stride = 12,
                                       .fill = fill_normals,
                                       .describe = describe_normals};
    if (rivals->products & DPH_PRODUCT_NORMALS && rivals->normal &&
        !dph_gltf_add_product(out, slots, &normals, strand, nstrand))
        return false;
    struct dph_gltf_product transfer = {.rivals = rivals,
                                        .key = "prt",
                                        .prefix = "_PRT_SH_",
                                        .shape = "VEC4",
                                        .type = DPH_GLTF_FLOAT,
                                        .stride = 16,
                                        .planes = (rivals->transfer.length + 3) / 4,
                                        .fill = fill_transfer,
                                        .describe = describe_transfer};
    if (rivals->products & DPH_PRODUCT_TRANSFER && rivals->transfer.vector &&
        !dph_gltf_add_product(out, slots, &transfer, strand, nstrand))
        return false;
    const struct dph_cpca *cpca = rivals->clusters;
    if (rivals->products & DPH_PRODUCT_CLUSTERS && cpca) {
        struct dph_gltf_product clusters = {
            .rivals = rivals,
            .key = "prt_cpca",
            .prefix = "_PRT_CPCA_",
            .last = "_PRT_CLUSTER",
            .shape = "VEC4",
            .type = DPH_GLTF_BYTE,
            .last_type = cpca->clusters <= 256 ? DPH_GLTF_UBYTE : DPH_GLTF_USHORT,
            .planes = ((size_t)cpca->vectors + 3) / 4 + 1,
            .stride = 4,
            .table = cpca->table,
            .table_size = (size_t)cpca->clusters * (1 + (size_t)cpca->vectors) * (size_t)cpca->n *
                          sizeof *cpca->table,
            .fill = fill_clusters,
            .describe = describe_transfer};
        if (!dph_gltf_add_product(out, slots, &clusters, strand, nstrand))
            return false;
    }
    return !(rivals->products & DPH_PRODUCT_RESPONSE) || !rivals->response ||
           dph_gltf_add_response(out, slots, rivals, strand, nstrand);
}
