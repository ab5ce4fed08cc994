/* glTF: accessors, typed arrays inside buffer views: strided, normalized, sparse. Everything is
 * checked when an accessor is opened, so that reading it cannot fail but for numbers that are not
 * finite. */
#include "mesh/gltf.h"

#include "core/fail.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* An accessor without data is all zeros, so a few bytes could ask for any memory. Real ones get
 * nearly all of their elements from `sparse`. */
#define ZEROS_LIMIT ((size_t)1 << 20)

size_t dph_gltf_component_size(enum dph_gltf_component type)
{
    switch (type) {
    case DPH_GLTF_BYTE:
    case DPH_GLTF_UBYTE: return 1;
    case DPH_GLTF_SHORT:
    case DPH_GLTF_USHORT: return 2;
    case DPH_GLTF_UINT:
    case DPH_GLTF_FLOAT: return 4;
    }
    return 0;
}

const char *dph_gltf_component_name(enum dph_gltf_component type)
{
    switch (type) {
    case DPH_GLTF_BYTE: return "BYTE";
    case DPH_GLTF_UBYTE: return "UNSIGNED_BYTE";
    case DPH_GLTF_SHORT: return "SHORT";
    case DPH_GLTF_USHORT: return "UNSIGNED_SHORT";
    case DPH_GLTF_UINT: return "UNSIGNED_INT";
    case DPH_GLTF_FLOAT: return "FLOAT";
    }
    return "unknown";
}

static uint32_t read_uint(const unsigned char *p, enum dph_gltf_component type)
{
    switch (dph_gltf_component_size(type)) {
    case 1: return p[0];
    case 2: return p[0] | (uint32_t)p[1] << 8;
    default: return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
    }
}

static int components_of(const char *type)
{
    static const char *const name[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    for (int i = 0; type && i < 4; i++)
        if (!strcmp(type, name[i]))
            return i + 1;
    return 0;
}

/* Finds `count` elements of `size` bytes at `offset` of a view. */
static bool locate(struct dph_document *doc, const char *place, size_t accessor, const char *what,
                   size_t view_index, size_t offset, size_t count, size_t size, bool strided,
                   const unsigned char **data, size_t *stride, struct dph_error *err)
{
    struct dph_gltf_view view;
    if (!dph_gltf_view(doc, view_index, place, &view, err))
        return false;
    *stride = strided && view.stride ? view.stride : size;
    if (*stride < size)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "accessor %zu%s has elements of %zu bytes, bufferViews[%zu] a "
                             "byteStride of %zu", accessor, what, size, view_index, *stride);
    /* count is below 2^32 and stride below 256, so nothing overflows */
    size_t end = count ? offset + (count - 1) * *stride + size : offset;
    if (offset > view.size || end > view.size)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "accessor %zu%s ends at byte %zu, its bufferViews[%zu] has %zu",
                             accessor, what, end, view_index, view.size);
    *data = view.data + offset;
    return true;
}

static bool component_type(const struct dph_document *doc, const json_t *object, const char *own,
                           enum dph_gltf_component *type, struct dph_error *err)
{
    size_t value;
    if (!dph_gltf_size(doc, object, "componentType", own, DPH_GLTF_REQUIRED, SIZE_MAX, &value, err))
        return false;
    *type = (enum dph_gltf_component)(value <= 5126 ? value : 0);
    if (!dph_gltf_component_size(*type))
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "componentType %zu is not known",
                             value);
    return true;
}

static bool open_sparse(struct dph_document *doc, const json_t *sparse, size_t index,
                        const char *place, const char *own, struct dph_gltf_accessor *a,
                        struct dph_error *err)
{
    json_t *indices, *values;
    char at[64];
    size_t view, offset, stride;
    snprintf(at, sizeof at, "%s.sparse", own);
    if (!dph_gltf_size(doc, sparse, "count", at, DPH_GLTF_REQUIRED, a->count, &a->sparse, err) ||
        !dph_gltf_object(doc, sparse, "indices", at, &indices, err) ||
        !dph_gltf_object(doc, sparse, "values", at, &values, err))
        return false;
    if (!indices || !values)
        return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err, "%s is missing",
                             indices ? "values" : "indices");
    snprintf(at, sizeof at, "%s.sparse.indices", own);
    if (!component_type(doc, indices, at, &a->sparse_type, err))
        return false;
    if (a->sparse_type != DPH_GLTF_UBYTE && a->sparse_type != DPH_GLTF_USHORT &&
        a->sparse_type != DPH_GLTF_UINT)
        return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err, "componentType %s is not unsigned",
                             dph_gltf_component_name(a->sparse_type));
    size_t size = dph_gltf_component_size(a->sparse_type);
    if (!dph_gltf_size(doc, indices, "bufferView", at, DPH_GLTF_REQUIRED, SIZE_MAX, &view, err) ||
        !dph_gltf_size(doc, indices, "byteOffset", at, 0, (size_t)1 << 32, &offset, err) ||
        !locate(doc, place, index, ".sparse.indices", view, offset, a->sparse, size, false,
                &a->sparse_index, &stride, err))
        return false;
    snprintf(at, sizeof at, "%s.sparse.values", own);
    if (!dph_gltf_size(doc, values, "bufferView", at, DPH_GLTF_REQUIRED, SIZE_MAX, &view, err) ||
        !dph_gltf_size(doc, values, "byteOffset", at, 0, (size_t)1 << 32, &offset, err) ||
        !locate(doc, place, index, ".sparse.values", view, offset, a->sparse,
                dph_gltf_component_size(a->type) * (size_t)a->components, false, &a->sparse_value,
                &stride, err))
        return false;
    uint32_t last = 0;
    for (size_t i = 0; i < a->sparse; i++) {
        uint32_t element = read_uint(a->sparse_index + i * size, a->sparse_type);
        if (element >= a->count)
            return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                                 "sparse.indices: element %zu is %u, the accessor has %zu", i,
                                 element, a->count);
        if (i && element <= last)
            return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                                 "sparse.indices: element %zu is %u, not above the %u before it", i,
                                 element, last);
        last = element;
    }
    return true;
}

bool dph_gltf_accessor(struct dph_document *doc, size_t i, const char *place,
                       struct dph_gltf_accessor *a, struct dph_error *err)
{
    *a = (struct dph_gltf_accessor){0};
    json_t *object, *sparse;
    char own[40];
    snprintf(own, sizeof own, "accessors[%zu]", i);
    if (!dph_gltf_element(doc, "accessors", i, place, &object, err) ||
        !component_type(doc, object, own, &a->type, err) ||
        !dph_gltf_size(doc, object, "count", own, DPH_GLTF_REQUIRED, (size_t)1 << 31, &a->count,
                       err) ||
        !dph_gltf_object(doc, object, "sparse", own, &sparse, err))
        return false;
    if (!a->count)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "count is 0");
    const char *type = json_string_value(json_object_get(object, "type"));
    a->components = components_of(type);
    if (!a->components)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "type \"%.20s\" is not SCALAR, VEC2, VEC3 or VEC4", type ? type : "");
    const json_t *normalized = json_object_get(object, "normalized");
    if (normalized && !json_is_boolean(normalized))
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "normalized is not a boolean");
    a->normalized = json_is_true(normalized);
    if (a->normalized && (a->type == DPH_GLTF_FLOAT || a->type == DPH_GLTF_UINT))
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "normalized with componentType %s",
                             dph_gltf_component_name(a->type));
    size_t view, offset, size = dph_gltf_component_size(a->type) * (size_t)a->components;
    if (!dph_gltf_size(doc, object, "bufferView", own, SIZE_MAX - 1, SIZE_MAX - 2, &view, err) ||
        !dph_gltf_size(doc, object, "byteOffset", own, 0, (size_t)1 << 32, &offset, err))
        return false;
    if (view != SIZE_MAX - 1 &&
        !locate(doc, place, i, "", view, offset, a->count, size, true, &a->data, &a->stride, err))
        return false;
    if (sparse && !open_sparse(doc, sparse, i, place, own, a, err))
        return false;
    if (!a->data && a->count > ZEROS_LIMIT && a->count / 64 > a->sparse)
        return dph_gltf_fail(doc, own, DPH_ERROR_LIMIT, err,
                             "%zu elements without data, %zu of them in sparse", a->count,
                             a->sparse);
    return true;
}

bool dph_gltf_accessor_at(struct dph_document *doc, const json_t *object, const char *key,
                          const char *place, bool *found, struct dph_gltf_accessor *accessor,
                          struct dph_error *err)
{
    size_t i;
    char at[200];
    if (found && !(*found = json_object_get(object, key) != NULL))
        return true;
    if (!dph_gltf_size(doc, object, key, place, DPH_GLTF_REQUIRED, SIZE_MAX, &i, err))
        return false;
    snprintf(at, sizeof at, "%s.%.40s", place, key);
    return dph_gltf_accessor(doc, i, at, accessor, err);
}

/* Bytes of element e, without `sparse`; NULL: zeros. */
static const unsigned char *element(const struct dph_gltf_accessor *a, size_t e)
{
    return a->data ? a->data + e * a->stride : NULL;
}

/* One element as floats; the formulas of glTF 2.0, section 3.6.2.2 for normalized integers. */
static void convert(const struct dph_gltf_accessor *a, const unsigned char *p, float *out)
{
    for (int c = 0; c < a->components; c++) {
        switch (a->type) {
        case DPH_GLTF_BYTE: {
            float value = (signed char)p[c];
            out[c] = !a->normalized ? value : value < -127 ? -1 : value / 127;
            break;
        }
        case DPH_GLTF_UBYTE: out[c] = a->normalized ? (float)p[c] / 255 : p[c]; break;
        case DPH_GLTF_SHORT: {
            float value = (int16_t)read_uint(p + 2 * c, DPH_GLTF_SHORT);
            out[c] = !a->normalized ? value : value < -32767 ? -1 : value / 32767;
            break;
        }
        case DPH_GLTF_USHORT: {
            float value = (float)read_uint(p + 2 * c, DPH_GLTF_USHORT);
            out[c] = a->normalized ? value / 65535 : value;
            break;
        }
        case DPH_GLTF_UINT: out[c] = (float)read_uint(p + 4 * c, DPH_GLTF_UINT); break;
        case DPH_GLTF_FLOAT: {
            uint32_t bits = read_uint(p + 4 * c, DPH_GLTF_UINT);
            memcpy(&out[c], &bits, 4);
            break;
        }
        }
    }
}

bool dph_gltf_floats(const struct dph_document *doc, const struct dph_gltf_accessor *a,
                     const char *place, float *out, struct dph_error *err)
{
    size_t n = (size_t)a->components;
    if (!a->data)
        memset(out, 0, a->count * n * sizeof *out);
    for (size_t e = 0; a->data && e < a->count; e++)
        convert(a, element(a, e), out + e * n);
    size_t size = dph_gltf_component_size(a->type) * n;
    for (size_t i = 0; i < a->sparse; i++) {
        size_t e = read_uint(a->sparse_index + i * dph_gltf_component_size(a->sparse_type),
                             a->sparse_type);
        convert(a, a->sparse_value + i * size, out + e * n);
    }
    if (a->type == DPH_GLTF_FLOAT)
        for (size_t i = 0; i < a->count * n; i++)
            if (!isfinite(out[i]))
                return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                                     "element %zu has component %zu = %g, which is not finite",
                                     i / n, i % n, (double)out[i]);
    return true;
}

void dph_gltf_uints(const struct dph_gltf_accessor *a, uint32_t *out)
{
    if (!a->data)
        memset(out, 0, a->count * sizeof *out);
    for (size_t e = 0; a->data && e < a->count; e++)
        out[e] = read_uint(element(a, e), a->type);
    size_t size = dph_gltf_component_size(a->type);
    for (size_t i = 0; i < a->sparse; i++)
        out[read_uint(a->sparse_index + i * dph_gltf_component_size(a->sparse_type),
                      a->sparse_type)] = read_uint(a->sparse_value + i * size, a->type);
}

/* A host that stores numbers the other way round would need its bytes turned here; everything else
 * is independent of it. */
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "glTF is little-endian");

void dph_gltf_raw(const struct dph_gltf_accessor *a, unsigned char *out, size_t stride)
{
    size_t size = dph_gltf_component_size(a->type) * (size_t)a->components;
    for (size_t e = 0; e < a->count; e++) {
        if (a->data)
            memcpy(out + e * stride, element(a, e), size);
        else
            memset(out + e * stride, 0, size);
    }
    for (size_t i = 0; i < a->sparse; i++)
        memcpy(out + stride * read_uint(a->sparse_index +
                                            i * dph_gltf_component_size(a->sparse_type),
                                        a->sparse_type),
               a->sparse_value + i * size, size);
}
