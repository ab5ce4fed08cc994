/* glTF: EXT_meshopt_compression (and KHR_meshopt_compression in its form), by libmeshoptimizer.
 *
 * The decoders accept hostile data; what they do not do is to bound the memory that a few bytes ask
 * for, so that is done here from the codecs' densest encodings. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <meshoptimizer.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* First byte of a stream: kind in the upper half, version in the lower. */
static bool check_header(const struct dph_document *doc, const char *place, unsigned char byte,
                         unsigned char kind, int newest, struct dph_error *err)
{
    if ((byte & 0xf0) != kind)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "compressed data begins with 0x%02x, not with 0x%x", byte, kind >> 4);
    if ((byte & 15) > newest)
        return dph_gltf_fail(doc, place, DPH_ERROR_UNSUPPORTED, err,
                             "codec version %d, up to %d is read; decompress it with: npx "
                             "gltf-transform copy in.glb out.glb", byte & 15, newest);
    return true;
}

/* Undoes the filter in place. */
static bool unfilter(const struct dph_document *doc, const char *place, const char *filter,
                     unsigned char *data, size_t count, size_t stride, struct dph_error *err)
{
    if (!strcmp(filter, "NONE"))
        return true;
    bool octahedral = !strcmp(filter, "OCTAHEDRAL");
    bool quaternion = !strcmp(filter, "QUATERNION");
    bool exponential = !strcmp(filter, "EXPONENTIAL");
    if (!octahedral && !quaternion && !exponential)
        return dph_gltf_fail(doc, place, DPH_ERROR_UNSUPPORTED, err,
                             "filter \"%.30s\"; decompress it with: npx gltf-transform copy in.glb "
                             "out.glb", filter);
    if ((octahedral && stride != 4 && stride != 8) || (quaternion && stride != 8))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "filter %s with a byteStride of %zu", filter, stride);
    if (octahedral)
        meshopt_decodeFilterOct(data, count, stride);
    else if (quaternion)
        meshopt_decodeFilterQuat(data, count, stride);
    else
        meshopt_decodeFilterExp(data, count, stride);
    return true;
}

bool dph_gltf_meshopt(const struct dph_document *doc, const json_t *extension, size_t size,
                      const char *place, unsigned char **out, struct dph_error *err)
{
    char own[80];
    snprintf(own, sizeof own, "%s.extensions.EXT_meshopt_compression", place);
    size_t buffer, offset, length, stride, count;
    if (!dph_gltf_size(doc, extension, "buffer", own, DPH_GLTF_REQUIRED, SIZE_MAX, &buffer, err) ||
        !dph_gltf_size(doc, extension, "byteOffset", own, 0, SIZE_MAX / 2, &offset, err) ||
        !dph_gltf_size(doc, extension, "byteLength", own, DPH_GLTF_REQUIRED, SIZE_MAX / 2, &length,
                       err) ||
        !dph_gltf_size(doc, extension, "byteStride", own, DPH_GLTF_REQUIRED, 256, &stride, err) ||
        !dph_gltf_size(doc, extension, "count", own, DPH_GLTF_REQUIRED, (size_t)1 << 32, &count,
                       err))
        return false;
    if (buffer >= doc->nbuffer)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "refers to buffers[%zu], the file has %zu", buffer, doc->nbuffer);
    const struct dph_gltf_buffer *bytes = &doc->buffer[buffer];
    if (!bytes->data)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "needs buffers[%zu]: %s", buffer,
                             bytes->problem);
    if (offset > bytes->size || length > bytes->size - offset)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "ends at byte %zu, buffers[%zu] has %zu", offset + length, buffer,
                             bytes->size);
    if (count * stride != size)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "%zu times %zu bytes decompress to something other than the %zu of "
                             "the view", count, stride, size);
    const char *mode = json_string_value(json_object_get(extension, "mode"));
    const char *filter = json_string_value(json_object_get(extension, "filter"));
    mode = mode ? mode : "";
    filter = filter ? filter : "NONE";
    bool attributes = !strcmp(mode, "ATTRIBUTES");
    bool triangles = !strcmp(mode, "TRIANGLES");
    if (!attributes && !triangles && strcmp(mode, "INDICES"))
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "mode \"%.30s\"", mode);
    if (attributes ? stride == 0 || stride % 4 : (stride != 2 && stride != 4))
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "mode %s with a byteStride of %zu",
                             mode, stride);
    if (triangles && count % 3)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "mode TRIANGLES with %zu indices, not a multiple of 3", count);
    if (!attributes && strcmp(filter, "NONE"))
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "mode %s with a filter", mode);
    /* densest: attributes 2 bits for 16 values, triangles a byte each, indices a byte each */
    if (attributes ? size / 64 > length : (triangles ? count / 3 : count) > length)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "%zu bytes cannot hold %zu elements of %zu bytes", length, count,
                             stride);
    const unsigned char *source = bytes->data + offset;
    if (!length)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err, "compressed data is empty");
    if (!check_header(doc, own, *source, attributes ? 0xa0 : triangles ? 0xe0 : 0xd0,
                      attributes ? 0 : 1, err))
        return false;
    unsigned char *data = dph_alloc(size, 1);
    if (!data)
        return dph_fail_memory(err);
    int bad = attributes ? meshopt_decodeVertexBuffer(data, count, stride, source, length)
              : triangles ? meshopt_decodeIndexBuffer(data, count, stride, source, length)
                          : meshopt_decodeIndexSequence(data, count, stride, source, length);
    if (bad) {
        dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                      "compressed data is malformed (%s)", bad == -2 ? "cut off" : "bad code");
        goto error;
    }
    if (!unfilter(doc, own, filter, data, count, stride, err))
        goto error;
    *out = data;
    return true;

error:
    free(data);
    return false;
}
