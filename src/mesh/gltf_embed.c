/* glTF: one file out of many. The binary chunk of a GLB is buffer 0 without a uri. What was buffer
 * 0 becomes its beginning, so that its views stay as they are; other buffers in files of their own
 * are put behind it, and their views follow them. Buffers keep their numbers: one whose content has
 * moved stays as a placeholder of one byte. Only where buffer 0 cannot be had (a missing file, or
 * the empty fallback of compressed views) a new one is put before all, and every reference goes up
 * by one. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <stdlib.h>
#include <string.h>

#define PLACEHOLDER "data:application/octet-stream;base64,AA=="

/* Sends a reference {buffer, byteOffset} to where the content is now. */
static void redirect(struct dph_gltf_output *out, json_t *object, const size_t *base,
                     size_t nbuffer, size_t shift)
{
    size_t buffer = dph_gltf_unchecked(object, "buffer");
    size_t offset = dph_gltf_unchecked(object, "byteOffset");
    if (!json_object_get(object, "buffer") || buffer >= nbuffer || offset == SIZE_MAX)
        return;
    if (base[buffer] != SIZE_MAX) {
        dph_gltf_set(out, object, "buffer", json_integer(0));
        if (base[buffer])
            dph_gltf_set(out, object, "byteOffset",
                         json_integer((json_int_t)(offset + base[buffer])));
    } else if (shift) {
        dph_gltf_set(out, object, "buffer", json_integer((json_int_t)(buffer + shift)));
    }
}

static void redirect_views(struct dph_gltf_output *out, const size_t *base, size_t nbuffer,
                           size_t shift)
{
    static const char *const compression[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};
    json_t *views = dph_gltf_own_array(out, out->root, "bufferViews");
    for (size_t i = 0; i < json_array_size(views); i++) {
        json_t *view = json_array_get(views, i);
        if (!json_is_object(view) || !(view = dph_gltf_own_element(out, views, i)))
            continue;
        redirect(out, view, base, nbuffer, shift);
        for (int k = 0; k < 2; k++) {
            if (!dph_gltf_extension(view, compression[k], NULL))
                continue;
            json_t *extensions = dph_gltf_own_object(out, view, "extensions");
            redirect(out, dph_gltf_own_object(out, extensions, compression[k]), base, nbuffer,
                     shift);
        }
    }
}

/* The media type of an image by its first bytes, NULL: not one that glTF knows. */
static const char *media_type(const struct dph_file *file)
{
    static const struct {
        const char *type;
        size_t at, size;
        const char *bytes;
    } known[] = {{"image/png", 0, 8, "\x89PNG\r\n\x1a\n"},
                 {"image/jpeg", 0, 3, "\xff\xd8\xff"},
                 {"image/ktx2", 0, 12, "\xabKTX 20\xbb\r\n\x1a\n"},
                 {"image/webp", 8, 4, "WEBP"},
                 {"image/avif", 4, 8, "ftypavif"},
                 {"image/vnd-ms.dds", 0, 4, "DDS "}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (file->size >= known[i].at + known[i].size &&
            !memcmp(file->data + known[i].at, known[i].bytes, known[i].size))
            return known[i].type;
    return NULL;
}

/* Takes in the images that lie beside the document. One that cannot be read, or is no image, keeps
 * its uri. */
static void embed_images(struct dph_gltf_output *out, const struct dph_document *doc)
{
    if (!json_array_size(json_object_get(out->root, "images")))
        return;
    json_t *images = dph_gltf_own_array(out, out->root, "images");
    json_t *done = json_object(); /* uri -> number of the view */
    for (size_t i = 0; i < json_array_size(images) && done; i++) {
        const char *uri = json_string_value(json_object_get(json_array_get(images, i), "uri"));
        struct dph_file file;
        if (!uri || !strncmp(uri, "data:", 5))
            continue;
        json_t *entry = json_object_get(done, uri); /* [view, media type] */
        if (!entry) {
            if (!dph_gltf_external(doc, uri, &file, NULL))
                continue;
            const char *type = media_type(&file);
            if (!type) {
                dph_file_finish(&file);
                continue;
            }
            size_t offset = dph_gltf_put_bytes(out, file.data, file.size, 4, file.data);
            json_t *view = json_object(), *views = json_object_get(out->root, "bufferViews");
            dph_gltf_set(out, view, "buffer", json_integer(0));
            dph_gltf_set(out, view, "byteOffset", json_integer((json_int_t)offset));
            dph_gltf_set(out, view, "byteLength", json_integer((json_int_t)file.size));
            entry = json_pack("[is]", (int)json_array_size(views), type);
            dph_gltf_append(out, views, view);
            dph_gltf_set(out, done, uri, entry);
            if (!(entry = json_object_get(done, uri)))
                break;
        }
        json_t *image = dph_gltf_own_element(out, images, i);
        dph_gltf_set(out, image, "bufferView", json_incref(json_array_get(entry, 0)));
        dph_gltf_set(out, image, "mimeType", json_incref(json_array_get(entry, 1)));
        json_object_del(image, "uri");
    }
    out->memory = out->memory || !done;
    json_decref(done);
}

bool dph_gltf_embed(struct dph_gltf_output *out, const struct dph_document *doc, size_t keep,
                    struct dph_error *err)
{
    size_t n = doc->nbuffer, shift = n && doc->buffer[0].data ? 0 : 1;
    size_t *base =
        dph_alloc(n, sizeof *base); /* where a buffer's content begins, SIZE_MAX: stays */
    json_t *buffers = dph_gltf_own_array(out, out->root, "buffers");
    if (!base || !buffers) {
        free(base);
        return dph_fail_memory(err);
    }
    for (size_t i = 0; i < n; i++) {
        const struct dph_gltf_buffer *buffer = &doc->buffer[i];
        base[i] = SIZE_MAX;
        if (i == 0 && !shift)
            base[i] = dph_gltf_put_bytes(out, buffer->data, keep, 8, NULL);
        else if (buffer->source == DPH_GLTF_EXTERNAL)
            base[i] = dph_gltf_put_bytes(out, buffer->data, buffer->size, 8, NULL);
        if (base[i] == SIZE_MAX)
            continue;
        json_t *entry = dph_gltf_own_element(out, buffers, i);
        if (i == 0 && !shift) {
            json_object_del(entry, "uri");
        } else {
            dph_gltf_set(out, entry, "uri", json_string(PLACEHOLDER));
            dph_gltf_set(out, entry, "byteLength", json_integer(1));
        }
    }
    if (shift && json_array_insert_new(buffers, 0, json_object()))
        out->memory = true;
    redirect_views(out, base, n, shift);
    free(base);
    embed_images(out, doc);
    return !out->memory || dph_fail_memory(err);
}

void dph_gltf_close_buffer(struct dph_gltf_output *out)
{
    if (!json_array_size(json_object_get(out->root, "bufferViews")))
        json_object_del(out->root, "bufferViews"); /* glTF wants no empty arrays */
    if (!out->size) /* a buffer has at least one byte */
        dph_gltf_put_bytes(out, "\0\0\0", 4, 4, NULL);
    dph_gltf_set(out, json_array_get(json_object_get(out->root, "buffers"), 0), "byteLength",
                 json_integer((json_int_t)out->size));
}
