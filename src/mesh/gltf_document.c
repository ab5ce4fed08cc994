/* glTF: the container (.glb or .gltf), its JSON, its buffers and buffer views. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A parsed JSON tree takes up to twenty times the memory of its text. */
#define JSON_LIMIT ((size_t)256 << 20)
#define FILE_LIMIT ((size_t)4 << 30)

static uint32_t read_u32(const unsigned char *p)
{
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

/* The chunks of a GLB. */
struct glb {
    const unsigned char *json, *bin; /* bin Nullable */
    size_t json_size, bin_size;
};

#define GLB_JSON 0x4E4F534Au
#define GLB_BIN 0x004E4942u

/* Walks the chunks: JSON first, BIN second or not at all, then whatever extensions put there. */
static bool split_glb(struct dph_document *doc, const struct dph_file *file, struct glb *glb,
                      struct dph_error *err)
{
    const unsigned char *data = file->data;
    if (file->size < 12)
        return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                             "GLB header is cut off after %zu of 12 bytes", file->size);
    uint32_t version = read_u32(data + 4);
    if (version != 2)
        return dph_gltf_fail(doc, "", DPH_ERROR_UNSUPPORTED, err,
                             "byte 4: GLB version %u, only 2 is read; export it again as glTF 2.0",
                             version);
    size_t length = read_u32(data + 8);
    if (length > file->size)
        return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                             "byte 8: GLB header says %zu bytes, the file has %zu", length,
                             file->size);
    if (length < file->size)
        return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                             "byte 8: GLB header says %zu bytes, the file goes on to %zu", length,
                             file->size);
    size_t at = 12;
    for (size_t chunk = 0; at < length; chunk++) {
        if (length - at < 8)
            return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                                 "byte %zu: chunk header is cut off", at);
        size_t size = read_u32(data + at);
        uint32_t type = read_u32(data + at + 4);
        if (size > length - at - 8)
            return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                                 "byte %zu: chunk of %zu bytes, only %zu are left", at, size,
                                 length - at - 8);
        if (size % 4)
            return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                                 "byte %zu: chunk of %zu bytes, not a multiple of 4", at, size);
        if (chunk == 0 && type != GLB_JSON)
            return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                                 "byte %zu: first chunk has type 0x%08x instead of JSON", at, type);
        if ((chunk != 0 && type == GLB_JSON) || (chunk > 1 && type == GLB_BIN))
            return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                                 "byte %zu: chunk %zu is a %s chunk, which must be the %s one", at,
                                 chunk, type == GLB_BIN ? "BIN" : "JSON",
                                 type == GLB_BIN ? "second" : "first");
        if (type == GLB_JSON) {
            glb->json = data + at + 8;
            glb->json_size = size;
        } else if (type == GLB_BIN) {
            glb->bin = data + at + 8;
            glb->bin_size = size;
        } else if (!doc->chunks_at) {
            doc->chunks_at = at;
            doc->chunks_size = length - at;
        }
        at += 8 + size;
    }
    if (!glb->json)
        return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err, "GLB without a JSON chunk");
    return true;
}

static bool parse_json(struct dph_document *doc, const unsigned char *text, size_t size,
                       struct dph_error *err)
{
    if (size > JSON_LIMIT)
        return dph_gltf_fail(doc, "", DPH_ERROR_LIMIT, err,
                             "JSON of %zu bytes, more than the %zu that are read; save it as .glb",
                             size, JSON_LIMIT);
    if (size >= 3 && !memcmp(text, "\xEF\xBB\xBF", 3)) { /* a byte order mark is harmless */
        text += 3;
        size -= 3;
    }
    while (size && (text[size - 1] == 0 || text[size - 1] == ' ')) /* padding of a chunk */
        size--;
    json_error_t problem;
    doc->root = json_loadb((const char *)text, size, JSON_REJECT_DUPLICATES | JSON_ALLOW_NUL,
                           &problem);
    if (!doc->root) {
        bool memory = json_error_code(&problem) == json_error_out_of_memory;
        return memory ? dph_fail_memory(err)
                      : dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err, "JSON line %d column %d: %s",
                                      problem.line, problem.column, problem.text);
    }
    if (!json_is_object(doc->root))
        return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err, "JSON is not an object");
    return true;
}

static bool check_version(const struct dph_document *doc, struct dph_error *err)
{
    json_t *asset;
    if (!dph_gltf_object(doc, doc->root, "asset", "", &asset, err))
        return false;
    const json_t *version = json_object_get(asset, "version");
    const json_t *least = json_object_get(asset, "minVersion");
    if (!json_is_string(version))
        return dph_gltf_fail(doc, "asset.version", DPH_ERROR_INPUT, err, "is missing");
    if (strncmp(json_string_value(version), "2.", 2))
        return dph_gltf_fail(doc, "asset.version", DPH_ERROR_UNSUPPORTED, err,
                             "\"%.20s\", only 2.x is read; export it again as glTF 2.0",
                             json_string_value(version));
    if (json_is_string(least) && strcmp(json_string_value(least), "2.0"))
        return dph_gltf_fail(doc, "asset.minVersion", DPH_ERROR_UNSUPPORTED, err,
                             "needs glTF \"%.20s\", 2.0 is read", json_string_value(least));
    return true;
}

/* ---- URIs ---- */

static int hex_digit(int c)
{
    return c >= '0' && c <= '9' ? c - '0'
           : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
}

/* Undoes percent-encoding in place; returns the new length. Malformed escapes stay as they are. */
static size_t percent_decode(char *text)
{
    char *out = text;
    for (const char *c = text; *c; c++) {
        int high = *c == '%' ? hex_digit(c[1]) : -1;
        int low = high >= 0 ? hex_digit(c[2]) : -1;
        if (low >= 0) {
            *out++ = (char)(high * 16 + low);
            c += 2;
        } else {
            *out++ = *c;
        }
    }
    *out = 0;
    return (size_t)(out - text);
}

static int base64_digit(int c)
{
    if (c >= 'A' && c <= 'Z')
        return c - 'A';
    if (c >= 'a' && c <= 'z')
        return c - 'a' + 26;
    if (c >= '0' && c <= '9')
        return c - '0' + 52;
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

bool dph_gltf_data_uri(const char *uri, unsigned char **data, size_t *size)
{
    const char *comma = strchr(uri, ',');
    if (strncmp(uri, "data:", 5) || !comma)
        return false;
    const char *text = comma + 1;
    size_t length = strlen(text);
    if (comma - uri < 7 || strncmp(comma - 7, ";base64", 7)) {
        char *plain = dph_strdup(text);
        if (!plain)
            return false;
        *size = percent_decode(plain);
        *data = (unsigned char *)plain;
        return true;
    }
    unsigned char *out = dph_alloc(length / 4 * 3 + 3, 1);
    if (!out)
        return false;
    while (length && text[length - 1] == '=')
        length--;
    size_t n = 0;
    uint32_t bits = 0;
    for (size_t i = 0; i < length; i++) {
        int digit = base64_digit((unsigned char)text[i]);
        if (digit < 0) {
            free(out);
            return false;
        }
        bits = bits << 6 | (uint32_t)digit;
        if (i % 4)
            out[n++] = (unsigned char)(bits >> (6 - 2 * (i % 4)));
    }
    if (length % 4 == 1) {
        free(out);
        return false;
    }
    *data = out;
    *size = n;
    return true;
}

/* "http:", "file:", "C:" and the like. */
static bool has_scheme(const char *uri)
{
    if (!isalpha((unsigned char)*uri))
        return false;
    while (isalnum((unsigned char)*uri) || *uri == '+' || *uri == '.' || *uri == '-')
        uri++;
    return *uri == ':';
}

bool dph_gltf_external(const struct dph_document *doc, const char *uri, struct dph_file *file,
                       struct dph_error *err)
{
    if (has_scheme(uri))
        return dph_gltf_fail(doc, "", DPH_ERROR_UNSUPPORTED, err,
                             "\"%.100s\": only files beside it are read; fetch it and name it by a "
                             "relative path", uri);
    if (*uri == '/' || *uri == '\\' || !*uri)
        return dph_gltf_fail(doc, "", DPH_ERROR_UNSUPPORTED, err,
                             "\"%.100s\": only relative paths are read", uri);
    if (!*doc->path)
        return dph_gltf_fail(doc, "", DPH_ERROR_UNSUPPORTED, err,
                             "\"%.100s\": no folder to look for it in", uri);
    const char *slash = strrchr(doc->path, '/');
    size_t folder = slash ? (size_t)(slash - doc->path) + 1 : 0;
    size_t length = strlen(uri);
    char *path = dph_alloc(folder + length + 1, 1);
    if (!path)
        return dph_fail_memory(err);
    memcpy(path, doc->path, folder);
    memcpy(path + folder, uri, length + 1);
    size_t decoded = percent_decode(path + folder);
    bool ok = false;
    if (strlen(path + folder) != decoded) {
        dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err, "\"%.100s\": a file name with a zero byte",
                      uri);
    } else {
        ok = dph_file_load(file, path, FILE_LIMIT, err);
        if (!ok && decoded != length) { /* some exporters do not encode a '%' that is meant */
            memcpy(path + folder, uri, length + 1);
            ok = dph_file_load(file, path, FILE_LIMIT, NULL);
        }
    }
    free(path);
    return ok;
}

/* ---- buffers ---- */

/* A buffer that cannot be had is an error only once something needs it, so the reason is kept. */
static bool load_buffer(struct dph_document *doc, size_t i, const struct glb *glb,
                        struct dph_error *err)
{
    struct dph_gltf_buffer *buffer = &doc->buffer[i];
    char place[40];
    snprintf(place, sizeof place, "buffers[%zu]", i);
    json_t *object;
    if (!dph_gltf_element(doc, "buffers", i, place, &object, err) ||
        !dph_gltf_size(doc, object, "byteLength", place, DPH_GLTF_REQUIRED, FILE_LIMIT,
                       &buffer->size, err))
        return false;
    const json_t *uri = json_object_get(object, "uri");
    size_t have = 0;
    struct dph_error why = {0};
    if (uri && !json_is_string(uri))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "uri is not a string");
    if (!uri) {
        if (i == 0 && glb->bin) {
            buffer->source = DPH_GLTF_BIN;
            buffer->data = glb->bin;
            have = glb->bin_size;
        } else {
            buffer->problem = dph_strdup("has no uri and no data");
        }
    } else if (!strncmp(json_string_value(uri), "data:", 5)) {
        if (!dph_gltf_data_uri(json_string_value(uri), &buffer->owned, &have))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                                 "its data URI is not valid base64");
        buffer->source = DPH_GLTF_DATA_URI;
        buffer->data = buffer->owned;
    } else {
        struct dph_file file;
        if (dph_gltf_external(doc, json_string_value(uri), &file, &why)) {
            buffer->source = DPH_GLTF_EXTERNAL;
            buffer->data = buffer->owned = file.data;
            have = file.size;
        } else if (why.code == DPH_ERROR_MEMORY || why.code == DPH_ERROR_LIMIT) {
            return dph_fail(err, why.code, "%s", why.message);
        } else {
            buffer->problem = dph_strdup(why.message);
        }
    }
    if (!buffer->data)
        return buffer->problem || dph_fail_memory(err);
    if (have < buffer->size)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "byteLength is %zu, its data ends after %zu bytes", buffer->size,
                             have);
    doc->total += buffer->size;
    if (doc->total > FILE_LIMIT)
        return dph_gltf_fail(doc, place, DPH_ERROR_LIMIT, err,
                             "buffers of more than %zu bytes together", FILE_LIMIT);
    return true;
}

struct dph_document *dph_gltf_document_create(struct dph_file *file, const char *path,
                                              struct dph_error *err)
{
    struct dph_document *doc = dph_alloc_zero(1, sizeof *doc);
    json_t *buffers, *views;
    struct glb glb = {0};
    if (!doc || !(doc->path = dph_strdup(path)))
        goto memory;
    bool binary = file->size >= 4 && !memcmp(file->data, "glTF", 4);
    if (binary) {
        if (!split_glb(doc, file, &glb, err))
            goto error;
    } else {
        glb.json = file->data;
        glb.json_size = file->size;
    }
    if (!parse_json(doc, glb.json, glb.json_size, err) || !check_version(doc, err) ||
        !dph_gltf_array(doc, doc->root, "buffers", "", &buffers, err) ||
        !dph_gltf_array(doc, doc->root, "bufferViews", "", &views, err))
        goto error;
    if (binary) { /* its BIN chunk stays in use */
        doc->file = *file;
        *file = (struct dph_file){0};
    }
    doc->nview = json_array_size(views);
    doc->decoded = dph_alloc_zero(doc->nview, sizeof *doc->decoded);
    doc->nbuffer = json_array_size(buffers);
    doc->buffer = dph_alloc_zero(doc->nbuffer, sizeof *doc->buffer);
    if (!doc->decoded || !doc->buffer)
        goto memory;
    for (size_t i = 0; i < doc->nbuffer; i++)
        if (!load_buffer(doc, i, &glb, err))
            goto error;
    return doc;

memory:
    dph_fail_memory(err);
error:
    dph_document_destroy(doc);
    return NULL;
}

void dph_gltf_forget_views(struct dph_document *doc)
{
    for (size_t i = 0; doc->decoded && i < doc->nview; i++) {
        free(doc->decoded[i]);
        doc->decoded[i] = NULL;
    }
}

void dph_document_destroy(struct dph_document *doc)
{
    if (!doc)
        return;
    dph_gltf_forget_views(doc);
    for (size_t i = 0; doc->buffer && i < doc->nbuffer; i++) {
        free(doc->buffer[i].owned);
        free(doc->buffer[i].problem);
    }
    free(doc->decoded);
    free(doc->buffer);
    free(doc->part);
    free(doc->path);
    json_decref(doc->root);
    dph_file_finish(&doc->file);
    free(doc);
}

/* ---- buffer views ---- */

bool dph_gltf_view(struct dph_document *doc, size_t i, const char *place,
                   struct dph_gltf_view *view, struct dph_error *err)
{
    json_t *object;
    char own[40];
    snprintf(own, sizeof own, "bufferViews[%zu]", i);
    if (!dph_gltf_element(doc, "bufferViews", i, place, &object, err))
        return false;
    size_t buffer, offset;
    if (!dph_gltf_size(doc, object, "byteOffset", own, 0, FILE_LIMIT, &offset, err) ||
        !dph_gltf_size(doc, object, "byteLength", own, DPH_GLTF_REQUIRED, FILE_LIMIT, &view->size,
                       err) ||
        !dph_gltf_size(doc, object, "byteStride", own, 0, 252, &view->stride, err) ||
        !dph_gltf_size(doc, object, "buffer", own, DPH_GLTF_REQUIRED, SIZE_MAX, &buffer, err))
        return false;
    if (buffer >= doc->nbuffer)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "refers to buffers[%zu], the file has %zu", buffer, doc->nbuffer);
    const json_t *packed =
        dph_gltf_extension(object, "EXT_meshopt_compression", "KHR_meshopt_compression");
    const struct dph_gltf_buffer *bytes = &doc->buffer[buffer];
    if (packed) {
        struct dph_error why = {0};
        if (doc->decoded[i] ||
            dph_gltf_meshopt(doc, packed, view->size, own, &doc->decoded[i], &why)) {
            view->data = doc->decoded[i];
            return true;
        }
        /* the uncompressed copy may be there for readers like this one */
        if (why.code != DPH_ERROR_UNSUPPORTED || !bytes->data)
            return dph_fail(err, why.code, "%s", why.message);
    }
    if (offset > bytes->size || view->size > bytes->size - offset)
        return dph_gltf_fail(doc, own, DPH_ERROR_INPUT, err,
                             "ends at byte %zu, buffers[%zu] has %zu", offset + view->size, buffer,
                             bytes->size);
    if (!bytes->data)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "needs buffers[%zu]: %s", buffer,
                             bytes->problem);
    view->data = bytes->data + offset;
    return true;
}
