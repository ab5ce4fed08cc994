/* glTF: writing a baked response: _RESPONSE_SH_i, or _RESPONSE_CPCA_i with _RESPONSE_CLUSTER, and
 * its description in extras.diaphan.response. Format: docs/file-format.md. */
#include "mesh/gltf.h"

#include <diaphan/rivals.h>

#include <string.h>

/* One channel's planes, then the next one's. */
static void fill_rows(const struct dph_gltf_product *product, size_t first, size_t count,
                      unsigned char *out)
{
    for (int c = 0; c < 3 && product->rivals->response->channel[c]; c++) {
        const struct dph_thickness *t = product->rivals->response->channel[c];
        size_t four = 4 * dph_store_size(t->store), row = (size_t)t->components / 4 * four;
        for (size_t plane = 0; plane < (size_t)t->components / 4; plane++)
            for (size_t v = first; v < first + count; v++, out += four)
                memcpy(out, (const unsigned char *)t->data + v * row + plane * four, four);
    }
}

static void put_cluster(unsigned char *out, unsigned number)
{
    out[0] = (unsigned char)(number & 255); /* little-endian */
    out[1] = (unsigned char)(number >> 8);
}

/* Weights, then the cluster's number. */
static void fill_channel(const struct dph_gltf_product *product, size_t first, size_t count,
                         unsigned char *out)
{
    const struct dph_thickness *t = product->rivals->response->channel[0];
    size_t row = (size_t)t->components;
    for (size_t plane = 0; plane < row / 4; plane++)
        for (size_t v = first; v < first + count; v++, out += 4)
            memcpy(out, (const unsigned char *)t->data + v * row + 4 * plane, 4);
    for (size_t v = first; v < first + count; v++, out += 4)
        put_cluster(out, t->cluster[v]);
}

static void fill_signal(const struct dph_gltf_product *product, size_t first, size_t count,
                        unsigned char *out)
{
    const struct dph_response *response = product->rivals->response;
    const struct dph_cpca *cpca = response->clusters;
    size_t vectors = (size_t)cpca->vectors;
    for (size_t plane = 0; 4 * plane < vectors; plane++)
        for (size_t v = first; v < first + count; v++, out += 4)
            for (size_t j = 4 * plane; j < 4 * plane + 4 && j < vectors; j++)
                out[j - 4 * plane] = (unsigned char)dph_cpca_snorm8(
                    cpca->weight[response->position_of[v] * vectors + j]);
    for (size_t v = first; v < first + count; v++, out += 4)
        put_cluster(out, cpca->cluster[response->position_of[v]]);
}

static json_t *describe(struct dph_gltf_output *out, const struct dph_gltf_product *product,
                        size_t table)
{
    const struct dph_response *response = product->rivals->response;
    json_t *d = json_object();
    dph_gltf_set(out, d, "version", json_integer(1));
    dph_gltf_set(out, d, "form", json_string(dph_response_form_name(response->form)));
    dph_gltf_set(out, d, "bands", json_integer(response->bands));
    dph_gltf_set(out, d, "order", json_string("l*(l+1)+m"));
    dph_gltf_set(out, d, "condon_shortley", json_true());
    if (product->table) {
        const struct dph_thickness *t = response->channel[0];
        dph_gltf_set(out, d, "clusters",
                     json_integer(t ? t->clusters : response->clusters->clusters));
        dph_gltf_set(out, d, "vectors", json_integer(t ? t->vectors : response->clusters->vectors));
        dph_gltf_set(out, d, "bufferView", dph_gltf_number(table));
    } else {
        json_t *scale = json_array();
        for (int c = 0; c < 3 && response->channel[c]; c++)
            for (int l = 0; l < response->bands; l++)
                dph_gltf_append(out, scale,
                                json_real(dph_gltf_shortest(response->channel[c]->scale[l])));
        dph_gltf_set(out, d, "scale", scale);
    }
    if (response->form != DPH_RESPONSE_RGB) {
        json_t *ramp = json_object(), *color = json_array();
        for (int i = 0; i < 3 * DPH_RAMP_ENTRIES; i++)
            dph_gltf_append(out, color,
                            json_real(dph_gltf_shortest(response->ramp.color[i / 3][i % 3])));
        dph_gltf_set(out, ramp, "top", json_real(dph_gltf_shortest(response->ramp.top)));
        dph_gltf_set(out, ramp, "color", color);
        dph_gltf_set(out, d, "ramp", ramp);
    }
    if (response->form == DPH_RESPONSE_ROOT && !product->table) {
        json_t *view = json_array();
        for (int i = 0; i < DPH_VIEW_TERMS; i++)
            dph_gltf_append(out, view, json_real(dph_gltf_shortest(response->view.term[i])));
        dph_gltf_set(out, d, "view", view);
    }
    dph_gltf_describe_origin(out, d, &product->rivals->response_origin);
    dph_gltf_set(out, d, "noise", json_real(response->noise));
    dph_gltf_set(out, d, "walks", json_real(response->walks));
    return d;
}

bool dph_gltf_add_response(struct dph_gltf_output *out, struct dph_gltf_slots *slots,
                           const struct dph_rivals *rivals, struct dph_gltf_strand *strand,
                           size_t nstrand)
{
    static const int type[] = {DPH_GLTF_FLOAT, DPH_GLTF_SHORT, DPH_GLTF_BYTE};
    const struct dph_response *response = rivals->response;
    const struct dph_thickness *t = response->channel[0];
    struct dph_gltf_product product = {.rivals = rivals,
                                       .key = "response",
                                       .prefix = "_RESPONSE_SH_",
                                       .shape = "VEC4",
                                       .describe = describe};
    if (t && t->store != DPH_STORE_CPCA) {
        product.type = type[t->store];
        product.stride = 4 * dph_store_size(t->store);
        product.planes = (size_t)t->components / 4 * (response->form == DPH_RESPONSE_RGB ? 3 : 1);
        product.fill = fill_rows;
        return dph_gltf_add_product(out, slots, &product, strand, nstrand);
    }
    const struct dph_cpca *cpca = response->clusters;
    size_t clusters = (size_t)(t ? t->clusters : cpca->clusters),
           vectors = (size_t)(t ? t->vectors : cpca->vectors),
           n = (size_t)(t ? t->bands * t->bands : cpca->n);
    product.prefix = "_RESPONSE_CPCA_";
    product.last = "_RESPONSE_CLUSTER";
    product.type = DPH_GLTF_BYTE;
    product.last_type = clusters <= 256 ? DPH_GLTF_UBYTE : DPH_GLTF_USHORT;
    product.planes = (vectors + 3) / 4 + 1;
    product.stride = 4;
    product.table = t ? t->table : cpca->table;
    product.table_size = clusters * (1 + vectors) * n * sizeof *product.table;
    product.fill = t ? fill_channel : fill_signal;
    return dph_gltf_add_product(out, slots, &product, strand, nstrand);
}
