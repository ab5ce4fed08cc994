/* glTF: writing a scene. A document comes back whole with thickness added to its triangle
 * primitives; a scene from elsewhere becomes a clean file with one mesh a body. The form of the
 * additions is that of docs/file-format.md. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ARRAY_BUFFER 34962
#define ELEMENT_ARRAY_BUFFER 34963

/* ---- thickness of one body ---- */

/* The object that stands in extras.diaphan.thickness_sh, or .thickness_cpca with the table in view
 * `table`. */
static json_t *describe(struct dph_gltf_output *out, const struct dph_thickness *t,
                        double mm_per_unit, size_t table)
{
    json_t *d = json_object(), *scale = json_array();
    for (int l = 0; l < t->bands; l++)
        dph_gltf_append(out, scale, json_real(dph_gltf_shortest(t->scale[l])));
    dph_gltf_set(out, d, "version", json_integer(1));
    dph_gltf_set(out, d, "bands", json_integer(t->bands));
    dph_gltf_set(out, d, "order", json_string("l*(l+1)+m"));
    dph_gltf_set(out, d, "condon_shortley", json_true());
    if (t->store == DPH_STORE_CPCA) {
        json_decref(scale);
        dph_gltf_set(out, d, "clusters", json_integer(t->clusters));
        dph_gltf_set(out, d, "vectors", json_integer(t->vectors));
        dph_gltf_set(out, d, "bufferView", dph_gltf_number(table));
    } else {
        dph_gltf_set(out, d, "scale", scale);
    }
    dph_gltf_set(out, d, "definition", json_string(dph_definition_name(t->definition)));
    dph_gltf_set(out, d, "fit", json_string(dph_fit_name(t->fit)));
    if (t->directions)
        dph_gltf_set(out, d, "directions", json_integer(t->directions));
    if (mm_per_unit > 0 && isfinite(mm_per_unit))
        dph_gltf_set(out, d, "mm_per_unit", json_real(mm_per_unit));
    return d;
}

static void set_attributes(struct dph_gltf_output *out, json_t *primitive, const size_t *list,
                           int count, bool cpca)
{
    json_t *attributes = dph_gltf_own_object(out, primitive, "attributes"), *value;
    const char *key;
    void *next;
    json_object_foreach_safe(attributes, next, key, value)
        if (dph_gltf_is_thickness_name(key))
            json_object_del(attributes, key);
    for (int i = 0; i < count; i++) {
        char name[32];
        if (cpca && i == count - 1)
            snprintf(name, sizeof name, "_THICKNESS_CLUSTER");
        else
            snprintf(name, sizeof name, "_THICKNESS_%s_%d", cpca ? "CPCA" : "SH", i);
        dph_gltf_set(out, attributes, name, dph_gltf_number(list[i]));
    }
    dph_gltf_drop_draco(out, primitive);
}

/* Two primitives with the same vertices share the same attributes. */
static const struct dph_gltf_strand *twin(const struct dph_thickness *t,
                                          const struct dph_gltf_strand *strand, size_t i)
{
    size_t row = (size_t)t->components * dph_store_size(t->store);
    const unsigned char *data = t->data;
    for (size_t k = i > DPH_GLTF_TWIN_REACH ? i - DPH_GLTF_TWIN_REACH : 0; k < i && strand[i].position; k++)
        if (strand[k].position && strand[k].count == strand[i].count &&
            json_equal(strand[k].position, strand[i].position) &&
            !memcmp(data + strand[k].first * row, data + strand[i].first * row,
                    strand[i].count * row) &&
            (!t->cluster || !memcmp(t->cluster + strand[k].first, t->cluster + strand[i].first,
                                    strand[i].count * sizeof *t->cluster)))
            return &strand[k];
    return NULL;
}

/* Adds a body's thickness to its primitives: one view, components / 4 accessors a primitive, each a
 * plane of its own, and one more for the clusters, which have the weights' stride of 4 bytes. */
static bool add_thickness(struct dph_gltf_output *out, struct dph_gltf_slots *slots,
                          const struct dph_thickness *t, double mm_per_unit, struct dph_gltf_strand *strand,
                          size_t nstrand)
{
    static const int type[] = {DPH_GLTF_FLOAT, DPH_GLTF_SHORT, DPH_GLTF_BYTE, DPH_GLTF_BYTE};
    bool cpca = t->store == DPH_STORE_CPCA;
    size_t rows = (size_t)t->components / 4, planes = rows + cpca;
    size_t four = 4 * dph_store_size(t->store);
    size_t *list = dph_alloc(nstrand * planes, sizeof *list);
    size_t begin = SIZE_MAX, view_number = SIZE_MAX, table = SIZE_MAX;
    if (!list)
        return false;
    if (cpca) {
        size_t size = dph_thickness_shared(t);
        size_t at = dph_gltf_put_bytes(out, t->table, size, 4, NULL);
        table = dph_gltf_place(out, "bufferViews", slots->view, &slots->nview,
                               dph_gltf_make_view(out, at, size, 0, 0));
    }
    for (size_t i = 0; i < nstrand; i++) {
        const struct dph_gltf_strand *same = twin(t, strand, i);
        strand[i].accessor = same ? same->accessor : i * planes;
        if (!same) {
            size_t at = dph_gltf_put_rows(out, t, strand[i].first, strand[i].count);
            if (begin == SIZE_MAX) { /* its length is known at the end */
                begin = at;
                view_number = dph_gltf_place(out, "bufferViews", slots->view, &slots->nview,
                                             dph_gltf_make_view(out, at, 0, four, ARRAY_BUFFER));
            }
            for (size_t k = 0; k < rows; k++)
                list[i * planes + k] =
                    dph_gltf_place(out, "accessors", slots->accessor, &slots->naccessor,
                                   dph_gltf_make_accessor(out, view_number,
                                            at - begin + k * strand[i].count * four,
                                            type[t->store], strand[i].count, "VEC4"));
            if (cpca) {
                at = dph_gltf_put_clusters(out, t->cluster + strand[i].first, strand[i].count);
                list[i * planes + rows] = dph_gltf_place(
                    out, "accessors", slots->accessor, &slots->naccessor,
                    dph_gltf_make_accessor(out, view_number, at - begin,
                             t->clusters <= 256 ? DPH_GLTF_UBYTE : DPH_GLTF_USHORT,
                             strand[i].count, "SCALAR"));
            }
        }
        set_attributes(out, strand[i].primitive, list + strand[i].accessor, (int)planes, cpca);
        dph_gltf_set_description(out, strand[i].primitive, cpca ? "thickness_sh" : "thickness_cpca",
                                 NULL);
        dph_gltf_set_description(out, strand[i].primitive, cpca ? "thickness_cpca" : "thickness_sh",
                                 describe(out, t, mm_per_unit, table));
    }
    dph_gltf_set(out, json_array_get(json_object_get(out->root, "bufferViews"), view_number),
                 "byteLength", dph_gltf_number(out->size - begin));
    free(list);
    return true;
}

/* ---- a document ---- */

/* The strands of a body: parts first .. last - 1, their primitives ready to be changed. */
static bool own_primitives(struct dph_gltf_output *out, const struct dph_document *doc,
                           size_t first, size_t last, struct dph_gltf_strand *strand)
{
    json_t *meshes = json_object_get(out->root, "meshes");
    json_t *mesh = dph_gltf_own_element(out, meshes, doc->part[first].mesh);
    json_t *primitives = dph_gltf_own_array(out, mesh, "primitives");
    for (size_t i = first; i < last; i++) {
        json_t *primitive = dph_gltf_own_element(out, primitives, doc->part[i].primitive);
        strand[i - first] = (struct dph_gltf_strand){
            .primitive = primitive,
            .position = json_object_get(json_object_get(primitive, "attributes"), "POSITION"),
            .first = doc->part[i].first,
            .count = doc->part[i].count};
    }
    return !out->memory;
}

static bool write_document(const struct dph_scene *scene, const char *path, struct dph_error *err)
{
    const struct dph_document *doc = scene->document;
    struct dph_gltf_output out = {.root = json_copy(doc->root)};
    struct dph_gltf_slots slots = {0};
    struct dph_gltf_strand *strand = dph_alloc(doc->npart, sizeof *strand);
    bool ok = false;
    if (!out.root || !strand) {
        dph_fail_memory(err);
        goto done;
    }
    if (!dph_gltf_find_slots(scene, &slots, err) || !dph_gltf_embed(&out, doc, slots.keep, err))
        goto done;
    dph_gltf_own_array(&out, out.root, "meshes");
    dph_gltf_own_array(&out, out.root, "accessors");
    for (size_t first = 0, last; first < doc->npart; first = last) {
        size_t body = doc->part[first].body, rows = 0;
        for (last = first; last < doc->npart && doc->part[last].body == body; last++)
            rows += doc->part[last].count;
        const struct dph_thickness *t = scene->body[body].thickness;
        const struct dph_rivals *rivals = scene->body[body].rivals;
        if (!t && !rivals)
            continue;
        if (t && t->nvert != rows) {
            dph_fail(err, DPH_ERROR_ARGUMENT,
                     "%s: body %zu has thickness for %zu vertices, its document has %zu", path,
                     body, t->nvert, rows);
            goto done;
        }
        if (!own_primitives(&out, doc, first, last, strand) ||
            (t && !add_thickness(&out, &slots, t, scene->mm_per_unit, strand, last - first)) ||
            (rivals && !dph_gltf_add_rivals(&out, &slots, rivals, strand, last - first))) {
            dph_fail_memory(err);
            goto done;
        }
    }
    dph_gltf_fill_slots(&out, "accessors", slots.accessor, slots.naccessor);
    dph_gltf_fill_slots(&out, "bufferViews", slots.view, slots.nview);
    dph_gltf_close_buffer(&out);
    ok = dph_gltf_emit(&out, path, doc->file.data ? doc->file.data + doc->chunks_at : NULL,
                       doc->chunks_size, err);
done:
    free(strand);
    dph_gltf_slots_finish(&slots);
    dph_gltf_output_finish(&out);
    return ok;
}

/* ---- a scene without a document ---- */

static size_t add_view(struct dph_gltf_output *out, size_t offset, size_t stride, int target)
{
    json_t *views = json_object_get(out->root, "bufferViews");
    dph_gltf_append(out, views, dph_gltf_make_view(out, offset, out->size - offset, stride, target));
    return json_array_size(views) - 1;
}

static size_t add_accessor(struct dph_gltf_output *out, json_t *object)
{
    json_t *accessors = json_object_get(out->root, "accessors");
    dph_gltf_append(out, accessors, object);
    return json_array_size(accessors) - 1;
}

static size_t add_floats(struct dph_gltf_output *out, const float *data, size_t count, int width)
{
    size_t at = dph_gltf_put_bytes(out, data, count * (size_t)width * 4, 4, NULL);
    return add_accessor(out, dph_gltf_make_accessor(out, add_view(out, at, 0, ARRAY_BUFFER), 0, DPH_GLTF_FLOAT,
                                      count, width == 3 ? "VEC3" : "VEC2"));
}

static size_t add_indices(struct dph_gltf_output *out, const struct dph_mesh *mesh)
{
    bool narrow = mesh->nvert <= UINT16_MAX; /* 65535 itself restarts a primitive */
    size_t count = 3 * mesh->ntri;
    size_t at = narrow ? dph_gltf_put_shorts(out, mesh->index, count)
                       : dph_gltf_put_bytes(out, mesh->index, count * 4, 4, NULL);
    return add_accessor(out, dph_gltf_make_accessor(out, add_view(out, at, 0, ELEMENT_ARRAY_BUFFER), 0,
                                      narrow ? DPH_GLTF_USHORT : DPH_GLTF_UINT, count, "SCALAR"));
}

/* Least and greatest position, which glTF wants beside every POSITION. */
static void add_range(struct dph_gltf_output *out, size_t number_of, const struct dph_mesh *mesh)
{
    json_t *low = json_array(), *high = json_array();
    for (int c = 0; c < 3; c++) {
        float least = INFINITY, most = -INFINITY;
        for (size_t v = 0; v < mesh->nvert; v++) {
            least = fminf(least, mesh->position[3 * v + (size_t)c]);
            most = fmaxf(most, mesh->position[3 * v + (size_t)c]);
        }
        dph_gltf_append(out, low, json_real((double)least));
        dph_gltf_append(out, high, json_real((double)most));
    }
    json_t *object = json_array_get(json_object_get(out->root, "accessors"), number_of);
    dph_gltf_set(out, object, "min", low);
    dph_gltf_set(out, object, "max", high);
}

static bool unshared(const struct dph_mesh *mesh)
{
    bool same = mesh->nvert == 3 * mesh->ntri;
    for (size_t i = 0; same && i < mesh->nvert; i++)
        same = mesh->index[i] == i;
    return same;
}

static bool add_mesh(struct dph_gltf_output *out, const struct dph_body *body, double mm_per_unit)
{
    const struct dph_mesh *mesh = &body->mesh;
    json_t *object = json_object(), *primitives = json_array(), *primitive = json_object();
    json_t *attributes = json_object();
    size_t position = add_floats(out, mesh->position, mesh->nvert, 3);
    add_range(out, position, mesh);
    dph_gltf_set(out, attributes, "POSITION", dph_gltf_number(position));
    if (mesh->normal)
        dph_gltf_set(out, attributes, "NORMAL",
                     dph_gltf_number(add_floats(out, mesh->normal, mesh->nvert, 3)));
    if (mesh->texcoord)
        dph_gltf_set(out, attributes, "TEXCOORD_0",
                     dph_gltf_number(add_floats(out, mesh->texcoord, mesh->nvert, 2)));
    dph_gltf_set(out, primitive, "attributes", attributes);
    if (!unshared(mesh))
        dph_gltf_set(out, primitive, "indices", dph_gltf_number(add_indices(out, mesh)));
    dph_gltf_set(out, primitive, "material", json_integer(0));
    dph_gltf_append(out, primitives, primitive);
    if (*body->name)
        dph_gltf_set(out, object, "name", json_string(body->name));
    dph_gltf_set(out, object, "primitives", primitives);
    dph_gltf_append(out, json_object_get(out->root, "meshes"), object);
    if (out->memory)
        return false;
    struct dph_gltf_slots none = {0};
    struct dph_gltf_strand strand = {.primitive = primitive, .count = mesh->nvert};
    return (!body->thickness ||
            add_thickness(out, &none, body->thickness, mm_per_unit, &strand, 1)) &&
           (!body->rivals || dph_gltf_add_rivals(out, &none, body->rivals, &strand, 1));
}

static void add_node(struct dph_gltf_output *out, const struct dph_scene *scene, size_t i)
{
    static const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const struct dph_instance *instance = &scene->instance[i];
    const char *name = scene->body[instance->body].name;
    json_t *node = json_object();
    if (*name)
        dph_gltf_set(out, node, "name", json_string(name));
    dph_gltf_set(out, node, "mesh", dph_gltf_number(instance->body));
    if (memcmp(instance->matrix, identity, sizeof identity)) {
        json_t *matrix = json_array();
        for (int k = 0; k < 16; k++)
            dph_gltf_append(out, matrix, json_real(dph_gltf_shortest(instance->matrix[k])));
        dph_gltf_set(out, node, "matrix", matrix);
    }
    dph_gltf_append(out, json_object_get(out->root, "nodes"), node);
}

/* A document of no more than what every glTF needs. */
static json_t *skeleton(void)
{
    return json_pack("{s:{s:s,s:s},s:i,s:[{s:[]}],s:[],s:[],s:[{s:s,s:{s:[f,f,f,f],s:f,s:f},s:b}],"
                     "s:[],s:[],s:[{}]}",
                     "asset", "version", "2.0", "generator", "diaphan " DPH_VERSION, "scene", 0,
                     "scenes", "nodes", "nodes", "meshes", "materials", "name", "diaphan",
                     "pbrMetallicRoughness", "baseColorFactor", .8, .8, .8, 1., "metallicFactor",
                     0., "roughnessFactor", .6, "doubleSided", 0, "accessors", "bufferViews",
                     "buffers");
}

static bool write_plain(const struct dph_scene *scene, const char *path, struct dph_error *err)
{
    struct dph_gltf_output out = {.root = skeleton()};
    bool ok = false;
    if (!out.root) {
        dph_fail_memory(err);
        goto done;
    }
    for (size_t i = 0; i < scene->nbody; i++) {
        const struct dph_body *body = &scene->body[i];
        if (!body->mesh.ntri || (body->thickness && body->thickness->nvert != body->mesh.nvert)) {
            dph_fail(err, DPH_ERROR_ARGUMENT,
                     "%s: body %zu has %zu triangles, %zu vertices and thickness for %zu", path, i,
                     body->mesh.ntri, body->mesh.nvert,
                     body->thickness ? body->thickness->nvert : 0);
            goto done;
        }
        if (!add_mesh(&out, body, scene->mm_per_unit)) {
            dph_fail_memory(err);
            goto done;
        }
    }
    json_t *roots =
        json_object_get(json_array_get(json_object_get(out.root, "scenes"), 0), "nodes");
    for (size_t i = 0; i < scene->ninstance; i++) {
        add_node(&out, scene, i);
        dph_gltf_append(&out, roots, dph_gltf_number(i));
    }
    if (!scene->ninstance) { /* glTF wants no empty arrays */
        json_object_del(out.root, "nodes");
        json_object_del(json_array_get(json_object_get(out.root, "scenes"), 0), "nodes");
    }
    dph_gltf_close_buffer(&out);
    ok = dph_gltf_emit(&out, path, NULL, 0, err);
done:
    dph_gltf_output_finish(&out);
    return ok;
}

bool dph_write_gltf(const struct dph_scene *scene, const char *path, struct dph_error *err)
{
    if (!scene->nbody)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%s: a scene without bodies", path);
    return scene->document ? write_document(scene, path, err) : write_plain(scene, path, err);
}
