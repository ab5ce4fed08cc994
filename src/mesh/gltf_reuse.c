/* glTF: a second bake takes the place of the first. Accessors and views that only the old thickness
 * uses are found, so that the new one is put into their numbers, and the old bytes are cut off
 * where they stand at the end of the binary chunk, which is where they are written. Nothing else
 * changes its number. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* Who refers to an accessor or a view. */
enum { OLD = 1, OTHER = 2 };

struct use {
    const struct dph_document *doc;
    size_t naccessor, nview;
    unsigned char *accessor, *view; /* OLD | OTHER */
};

static bool begins(const char *name, const char *prefix)
{
    for (; *prefix; prefix++, name++)
        if (tolower((unsigned char)*name) != *prefix)
            return false;
    return true;
}

bool dph_gltf_is_rivals_name(const char *name)
{
    static const char *const numbered[] = {"_prt_sh_", "_prt_cpca_", "_response_sh_",
                                           "_response_cpca_"};
    for (size_t i = 0; i < sizeof numbered / sizeof *numbered; i++)
        if (begins(name, numbered[i]) && isdigit((unsigned char)name[strlen(numbered[i])]))
            return true;
    return (begins(name, "_response_cluster") && !name[strlen("_response_cluster")]) ||
           (begins(name, "_prt_cluster") && !name[strlen("_prt_cluster")]) ||
           (begins(name, "_patro_normal") && !name[strlen("_patro_normal")]);
}

bool dph_gltf_is_thickness_name(const char *name)
{
    static const char sh[] = "_thickness_sh_", cpca[] = "_thickness_cpca_";
    static const char cluster[] = "_thickness_cluster";
    return (begins(name, sh) && isdigit((unsigned char)name[sizeof sh - 1])) ||
           (begins(name, cpca) && isdigit((unsigned char)name[sizeof cpca - 1])) ||
           (begins(name, cluster) && !name[sizeof cluster - 1]);
}

static void mark(unsigned char *list, size_t count, const json_t *index, unsigned char how)
{
    double i = json_number_value(index);
    if (json_is_number(index) && i >= 0 && i < (double)count)
        list[(size_t)i] |= how;
}

/* Everything below `json` that is called "bufferView" or, in the parts of the file that name
 * accessors, may be one. */
static void mark_views(struct use *use, json_t *json)
{
    const char *key;
    json_t *value;
    size_t i;
    if (json_is_array(json))
        json_array_foreach(json, i, value) mark_views(use, value);
    if (json_is_object(json))
        json_object_foreach(json, key, value) {
            if (!strcmp(key, "bufferView"))
                mark(use->view, use->nview, value, OTHER);
            else if (strcmp(key, "thickness_cpca") && strcmp(key, "prt_cpca") &&
                     (strcmp(key, "response") || !json_object_get(value, "condon_shortley")))
                /* mark_meshes knows whose table that is */
                mark_views(use, value);
        }
}

/* Every number below `json` could be an accessor's: taking one for used that is not costs a few
 * bytes, the reverse would cost data. */
static void mark_accessors(struct use *use, json_t *json)
{
    const char *key;
    json_t *value;
    size_t i;
    if (json_is_number(json))
        mark(use->accessor, use->naccessor, json, OTHER);
    if (json_is_array(json))
        json_array_foreach(json, i, value) mark_accessors(use, value);
    if (json_is_object(json))
        json_object_foreach(json, key, value) mark_accessors(use, value);
}

static const struct dph_gltf_part *part_of(const struct dph_scene *scene, size_t mesh,
                                           size_t primitive)
{
    const struct dph_document *doc = scene->document;
    size_t low = 0, high = doc->npart; /* parts ascend by mesh, then by primitive */
    while (low < high) {
        size_t middle = (low + high) / 2;
        const struct dph_gltf_part *part = &doc->part[middle];
        if (part->mesh < mesh || (part->mesh == mesh && part->primitive < primitive))
            low = middle + 1;
        else
            high = middle;
    }
    const struct dph_gltf_part *part = &doc->part[low];
    return low < doc->npart && part->mesh == mesh && part->primitive == primitive ? part : NULL;
}

static void mark_meshes(struct use *use, const struct dph_scene *scene)
{
    json_t *meshes = json_object_get(use->doc->root, "meshes"), *mesh, *primitive, *value;
    size_t m, p;
    const char *key, *name;
    json_array_foreach(meshes, m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            const struct dph_gltf_part *part = part_of(scene, m, p);
            bool replaced = part && scene->body[part->body].thickness;
            bool rivals = part && scene->body[part->body].rivals;
            json_t *diaphan = json_object_get(json_object_get(primitive, "extras"), "diaphan");
            mark(use->view, use->nview,
                 json_object_get(json_object_get(diaphan, "thickness_cpca"), "bufferView"),
                 replaced ? OLD : OTHER);
            mark(use->view, use->nview,
                 json_object_get(json_object_get(diaphan, "prt_cpca"), "bufferView"),
                 rivals ? OLD : OTHER);
            mark(use->view, use->nview,
                 json_object_get(json_object_get(diaphan, "response"), "bufferView"),
                 rivals ? OLD : OTHER);
            json_object_foreach(primitive, key, value) {
                if (!strcmp(key, "attributes")) {
                    json_t *index;
                    json_object_foreach(value, name, index)
                        mark(use->accessor, use->naccessor, index,
                             (replaced && dph_gltf_is_thickness_name(name)) ||
                                     (rivals && dph_gltf_is_rivals_name(name))
                                 ? OLD
                                 : OTHER);
                } else if (strcmp(key, "extras") && strcmp(key, "mode") &&
                           strcmp(key, "material")) {
                    mark_accessors(use, value);
                }
            }
        }
        mark_accessors(use, json_object_get(mesh, "extensions"));
    }
}

/* Accessors and views may be named in unknown extensions; what is in doubt counts as used. */
static void mark_rest(struct use *use)
{
    json_t *root = use->doc->root, *value, *index;
    const char *key;
    size_t i;
    json_object_foreach(root, key, value) {
        if (!strcmp(key, "meshes") || !strcmp(key, "accessors") || !strcmp(key, "bufferViews"))
            continue;
        mark_views(use, value);
        if (!strcmp(key, "skins"))
            json_array_foreach(value, i, index)
                mark(use->accessor, use->naccessor, json_object_get(index, "inverseBindMatrices"),
                     OTHER);
        if (!strcmp(key, "animations"))
            json_array_foreach(value, i, index)
                mark_accessors(use, json_object_get(index, "samplers"));
        if (!strcmp(key, "nodes"))
            json_array_foreach(value, i, index)
                mark_accessors(use, json_object_get(index, "extensions"));
    }
    json_array_foreach(json_object_get(root, "accessors"), i, value) {
        bool old = use->accessor[i] == OLD;
        mark(use->view, use->nview, json_object_get(value, "bufferView"), old ? OLD : OTHER);
        mark_views(use, json_object_get(value, "sparse"));
    }
    mark_views(use, json_object_get(root, "meshes"));
    json_array_foreach(json_object_get(root, "bufferViews"), i, value)
        if (json_object_get(value, "extensions"))
            use->view[i] |= OTHER;
}

/* Lists what only the old thickness uses. */
static size_t *collect(const unsigned char *list, size_t count, size_t *found)
{
    size_t *out = dph_alloc(count, sizeof *out);
    *found = 0;
    for (size_t i = 0; i < count && out; i++)
        if (list[i] == OLD)
            out[(*found)++] = i;
    return out;
}

/* The end of the first buffer without the views that are replaced: cut only where they reach to its
 * very end. */
static size_t end_without(const struct dph_document *doc, const struct dph_gltf_slots *slots,
                          const unsigned char *use)
{
    const json_t *views = json_object_get(doc->root, "bufferViews");
    size_t end = doc->buffer[0].size, used = 0;
    for (size_t i = 0; i < doc->nview; i++) {
        const json_t *view = json_array_get(views, i);
        const json_t *packed =
            dph_gltf_extension(view, "EXT_meshopt_compression", "KHR_meshopt_compression");
        const json_t *const reference[2] = {view, packed};
        for (int k = 0; k < 2; k++) {
            if (!reference[k] || use[i] == OLD || dph_gltf_unchecked(reference[k], "buffer"))
                continue;
            size_t from = dph_gltf_unchecked(reference[k], "byteOffset");
            size_t size = dph_gltf_unchecked(reference[k], "byteLength");
            if (from == SIZE_MAX || size == SIZE_MAX) /* nobody read it: nothing is cut */
                return end;
            used = from + size > used ? from + size : used;
        }
    }
    for (bool again = true; again;) {
        again = false;
        for (size_t k = slots->nview; k-- > 0;) {
            const json_t *view = json_array_get(views, slots->view[k]);
            size_t from = dph_gltf_unchecked(view, "byteOffset");
            size_t size = dph_gltf_unchecked(view, "byteLength"), stop = from + size;
            /* what is behind it may only be padding */
            if (dph_gltf_unchecked(view, "buffer") == 0 && from >= used && from < end &&
                size <= end - from && end - stop < 8) {
                end = from;
                again = true;
            }
        }
    }
    return end;
}

bool dph_gltf_find_slots(const struct dph_scene *scene, struct dph_gltf_slots *slots,
                         struct dph_error *err)
{
    const struct dph_document *doc = scene->document;
    struct use use = {.doc = doc,
                      .naccessor = json_array_size(json_object_get(doc->root, "accessors")),
                      .nview = doc->nview};
    *slots = (struct dph_gltf_slots){.keep = doc->nbuffer ? doc->buffer[0].size : 0};
    use.accessor = dph_alloc_zero(use.naccessor, 1);
    use.view = dph_alloc_zero(use.nview, 1);
    if (!use.accessor || !use.view)
        goto memory;
    mark_meshes(&use, scene);
    mark_rest(&use);
    slots->accessor = collect(use.accessor, use.naccessor, &slots->naccessor);
    slots->view = collect(use.view, use.nview, &slots->nview);
    if (!slots->accessor || !slots->view)
        goto memory;
    if (slots->nview && doc->buffer[0].data)
        slots->keep = end_without(doc, slots, use.view);
    free(use.accessor);
    free(use.view);
    return true;

memory:
    free(use.accessor);
    free(use.view);
    dph_gltf_slots_finish(slots);
    return dph_fail_memory(err);
}

void dph_gltf_slots_finish(struct dph_gltf_slots *slots)
{
    free(slots->accessor);
    free(slots->view);
    *slots = (struct dph_gltf_slots){0};
}

size_t dph_gltf_place(struct dph_gltf_output *out, const char *array, size_t *slot, size_t *nslot,
                      json_t *value)
{
    json_t *list = json_object_get(out->root, array);
    if (!*nslot) {
        dph_gltf_append(out, list, value);
        return json_array_size(list) - 1;
    }
    size_t i = slot[0];
    memmove(slot, slot + 1, --*nslot * sizeof *slot);
    if (!value || json_array_set_new(list, i, value))
        out->memory = true;
    return i;
}

void dph_gltf_fill_slots(struct dph_gltf_output *out, const char *array, const size_t *slot,
                         size_t nslot)
{
    json_t *list = json_object_get(out->root, array);
    while (nslot--) {
        size_t last = json_array_size(list) - 1; /* no slot unless it is this one: they ascend */
        if (slot[nslot] == last)
            json_array_remove(list, last);
        else if (json_array_set(list, slot[nslot], json_array_get(list, last)))
            out->memory = true;
    }
}
