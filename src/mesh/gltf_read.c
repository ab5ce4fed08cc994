/* glTF: meshes become bodies.
 *
 * A body's rows are the POSITION accessors of its triangle primitives one after the other, row for
 * row, so that what is computed a row can go back as a vertex attribute. Strips and fans are
 * unrolled (glTF 2.0, section 3.7.2.1). Points and lines are left out.
 *
 * Meshes come in their rest pose: a skin's bind pose, and morph targets not applied, whatever the
 * default weights say. Targets belong to an animation, and a bake of the undeformed body is the one
 * that all of its poses share. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Several meshes may use the same accessors, so that a small file could ask for any memory: what is
 * beyond this many rows and indices must be in proportion to the bytes there are. */
#define FREE_ROWS ((size_t)1 << 24)
#define ROWS_PER_BYTE 16

/* One triangle primitive while its mesh is read. */
struct primitive {
    const json_t *object, *attributes;
    size_t number;   /* in the mesh */
    size_t mode;
    struct dph_gltf_accessor position, index;
    bool indexed, normal, texcoord;
    size_t corners;  /* of its triangles */
};

struct reader {
    struct dph_scene *scene;
    struct dph_document *doc;
    size_t rows;          /* so far, for the limit */
    size_t body_capacity, part_capacity;
    struct primitive *primitive;
    size_t nprimitive, primitive_capacity;
};

/* ---- extensions ---- */

/* Whether a required extension leaves geometry as this reader understands it. */
static bool harmless(const char *name)
{
    static const char *const known[] = {
        "KHR_mesh_quantization", "EXT_meshopt_compression", "KHR_meshopt_compression",
        "EXT_mesh_gpu_instancing", "KHR_draco_mesh_compression" /* looked at a primitive at a time */,
        "KHR_node_visibility", "KHR_node_hoverability", "KHR_node_selectability",
        "KHR_interactivity", "KHR_animation_pointer", "KHR_xmp_json_ld", "KHR_xmp",
        "KHR_techniques_webgl", "MSFT_lod", "MSFT_packing_normalRoughnessMetallic",
        "MSFT_packing_occlusionRoughnessMetallic", "EXT_mesh_features", "EXT_instance_features",
        "CESIUM_primitive_outline", "AGI_articulations", NULL};
    /* materials, textures, lights, sounds and physics, of whatever vendor */
    static const char *const family[] = {"_materials_", "_material_", "_texture",    "_lights_",
                                         "_audio_",     "_physics_",  "_collision_", "_metadata",
                                         "VRM",         NULL};
    for (int i = 0; known[i]; i++)
        if (!strcmp(name, known[i]))
            return true;
    for (int i = 0; family[i]; i++)
        if (strstr(name, family[i]))
            return true;
    return false;
}

static bool check_extensions(const struct dph_document *doc, struct dph_error *err)
{
    json_t *required;
    if (!dph_gltf_array(doc, doc->root, "extensionsRequired", "", &required, err))
        return false;
    for (size_t i = 0; i < json_array_size(required); i++) {
        const char *name = json_string_value(json_array_get(required, i));
        char place[48];
        snprintf(place, sizeof place, "extensionsRequired[%zu]", i);
        if (!name)
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "is not a string");
        if (!harmless(name))
            return dph_gltf_fail(doc, place, DPH_ERROR_UNSUPPORTED, err,
                                 "%.80s is not supported and may change the geometry; export the "
                                 "model without it", name);
    }
    return true;
}

static bool refuse_draco(const struct dph_document *doc, const char *place, struct dph_error *err)
{
    return dph_gltf_fail(doc, place, DPH_ERROR_UNSUPPORTED, err,
                         "KHR_draco_mesh_compression is not supported; decompress it with: npx "
                         "@gltf-transform/cli copy in.glb out.glb");
}

/* ---- one primitive, checked ---- */

/* Every attribute must have as many elements as POSITION, also those that are not read. */
static bool check_counts(const struct dph_document *doc, json_t *attributes, size_t count,
                         const char *place, struct dph_error *err)
{
    const char *key;
    json_t *value;
    json_object_foreach(attributes, key, value) {
        char at[200];
        size_t i, n;
        json_t *accessor;
        snprintf(at, sizeof at, "%s.%.40s", place, key);
        if (!dph_gltf_size(doc, attributes, key, place, DPH_GLTF_REQUIRED, SIZE_MAX, &i, err) ||
            !dph_gltf_element(doc, "accessors", i, at, &accessor, err) ||
            !dph_gltf_size(doc, accessor, "count", at, DPH_GLTF_REQUIRED, SIZE_MAX, &n, err))
            return false;
        if (n != count)
            return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err,
                                 "accessor %zu has %zu elements, POSITION has %zu", i, n, count);
    }
    return true;
}

/* What a vertex attribute may be made of, with KHR_mesh_quantization. */
static bool check_vector(const struct dph_document *doc, const struct dph_gltf_accessor *a,
                         int components, const char *place, struct dph_error *err)
{
    if (a->components != components)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "has %d components instead of %d",
                             a->components, components);
    if (a->type == DPH_GLTF_UINT)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "componentType UNSIGNED_INT is not for vertices");
    return true;
}

static bool check_draco(const struct dph_document *doc, const json_t *object, const char *place,
                        struct dph_error *err)
{
    if (!dph_gltf_extension(object, "KHR_draco_mesh_compression", NULL))
        return true;
    const json_t *required = json_object_get(doc->root, "extensionsRequired");
    for (size_t i = 0; i < json_array_size(required); i++) {
        const char *name = json_string_value(json_array_get(required, i));
        if (name && !strcmp(name, "KHR_draco_mesh_compression"))
            return refuse_draco(doc, place, err);
    }
    /* An uncompressed copy is beside it where the extension is not required. */
    const json_t *attributes = json_object_get(object, "attributes");
    const json_t *accessors = json_object_get(doc->root, "accessors");
    const json_t *position = json_object_get(attributes, "POSITION");
    double i = json_number_value(position);
    if (json_is_number(position) && i >= 0 && i < (double)json_array_size(accessors) &&
        json_object_get(json_array_get(accessors, (size_t)i), "bufferView"))
        return true;
    return refuse_draco(doc, place, err);
}

/* Opens primitive `i` of a mesh; *skip where it holds no triangles. */
static bool open_primitive(struct reader *r, const json_t *object, size_t mesh, size_t i,
                           struct primitive *p, bool *skip, struct dph_error *err)
{
    struct dph_document *doc = r->doc;
    char place[80], at[120];
    json_t *attributes;
    bool found;
    snprintf(place, sizeof place, "meshes[%zu].primitives[%zu]", mesh, i);
    *p = (struct primitive){.object = object, .number = i};
    if (!json_is_object(object))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "is not an object");
    if (!dph_gltf_size(doc, object, "mode", place, 4, 6, &p->mode, err) ||
        !dph_gltf_object(doc, object, "attributes", place, &attributes, err))
        return false;
    *skip = p->mode < 4;
    if (*skip)
        return true;
    if (!attributes)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "attributes is missing");
    if (!check_draco(doc, object, place, err))
        return false;
    p->attributes = attributes;
    snprintf(at, sizeof at, "%s.attributes", place);
    if (!dph_gltf_accessor_at(doc, attributes, "POSITION", at, &found, &p->position, err))
        return false;
    if (!found) {
        *skip = true;
        return dph_scene_warn(r->scene, "%s: %s has no POSITION and is left out", doc->path,
                              place) || dph_fail_memory(err);
    }
    if (!check_counts(doc, attributes, p->position.count, at, err))
        return false;
    snprintf(at, sizeof at, "%s.attributes.POSITION", place);
    if (!check_vector(doc, &p->position, 3, at, err) ||
        !dph_gltf_accessor_at(doc, object, "indices", place, &p->indexed, &p->index, err))
        return false;
    snprintf(at, sizeof at, "%s.indices", place);
    if (p->indexed &&
        (p->index.components != 1 || p->index.normalized ||
         (p->index.type != DPH_GLTF_UBYTE && p->index.type != DPH_GLTF_USHORT &&
          p->index.type != DPH_GLTF_UINT)))
        return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err,
                             "%sVEC%d of %s, not SCALAR of an unsigned type",
                             p->index.normalized ? "normalized " : "", p->index.components,
                             dph_gltf_component_name(p->index.type));
    size_t n = p->indexed ? p->index.count : p->position.count;
    if (n < 3 || (p->mode == 4 && n % 3))
        return dph_gltf_fail(doc, p->indexed ? at : place, DPH_ERROR_INPUT, err,
                             "%zu corners do not make %s", n,
                             p->mode == 4   ? "whole triangles"
                             : p->mode == 5 ? "a triangle strip" : "a triangle fan");
    p->corners = p->mode == 4 ? n : 3 * (n - 2);
    p->normal = json_object_get(attributes, "NORMAL") != NULL;
    p->texcoord = json_object_get(attributes, "TEXCOORD_0") != NULL;
    r->rows += p->position.count + p->corners;
    if (r->rows > FREE_ROWS && r->rows / ROWS_PER_BYTE > doc->total)
        return dph_gltf_fail(doc, place, DPH_ERROR_LIMIT, err,
                             "%zu vertices and corners so far out of %zu bytes", r->rows,
                             doc->total);
    return true;
}

/* ---- filling a body ---- */

static bool read_indices(const struct reader *r, const struct primitive *p, const char *place,
                         uint32_t base, uint32_t *out, struct dph_error *err)
{
    size_t n = p->indexed ? p->index.count : p->position.count;
    size_t count = p->position.count;
    uint32_t *list = out; /* a list of triangles can be read in place */
    if (p->mode != 4 && !(list = dph_alloc(n, sizeof *list)))
        return dph_fail_memory(err);
    bool ok = true;
    if (p->indexed)
        dph_gltf_uints(&p->index, list);
    else
        for (size_t i = 0; i < n; i++)
            list[i] = (uint32_t)i;
    for (size_t i = 0; i < n && ok; i++)
        if (list[i] >= count)
            ok = dph_gltf_fail(r->doc, place, DPH_ERROR_INPUT, err,
                               "element %zu is %u, POSITION has %zu elements", i, list[i], count);
    if (!ok)
        goto done;
    if (p->mode == 4)
        for (size_t i = 0; i < n; i++)
            out[i] += base;
    for (size_t t = 0; p->mode != 4 && t + 2 < n; t++, out += 3) {
        /* every other triangle of a strip runs the other way round; a fan turns about its first
         * corner */
        bool odd = p->mode == 5 && t % 2;
        out[0] = base + (p->mode == 5 ? list[t] : list[t + 1]);
        out[1] = base + (p->mode == 5 ? list[t + 1 + odd] : list[t + 2]);
        out[2] = base + (p->mode == 5 ? list[t + 2 - odd] : list[0]);
    }
done:
    if (list != out && p->mode != 4)
        free(list);
    return ok;
}

/* Unit length; a normal without length (no exporter means it) is replaced by the sum of the faces
 * around it. */
static bool finish_normals(struct dph_mesh *mesh, struct dph_error *err)
{
    bool missing = false;
    for (size_t v = 0; v < mesh->nvert; v++) {
        float *n = mesh->normal + 3 * v;
        double length = sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
        for (int c = 0; c < 3; c++)
            n[c] = length > 1e-20 ? (float)(n[c] / length) : 0;
        missing = missing || !(length > 1e-20);
    }
    if (!missing)
        return true;
    double (*sum)[3] = dph_alloc_zero(mesh->nvert, sizeof *sum);
    if (!sum)
        return dph_fail_memory(err);
    for (size_t t = 0; t < mesh->ntri; t++) {
        const uint32_t *i = mesh->index + 3 * t;
        const float *a = mesh->position + 3 * (size_t)i[0], *b = mesh->position + 3 * (size_t)i[1],
                    *c = mesh->position + 3 * (size_t)i[2];
        double u[3], w[3];
        for (int k = 0; k < 3; k++) {
            u[k] = (double)b[k] - a[k];
            w[k] = (double)c[k] - a[k];
        }
        for (int k = 0; k < 3; k++)
            for (int corner = 0; corner < 3; corner++)
                sum[i[corner]][k] +=
                    u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3];
    }
    for (size_t v = 0; v < mesh->nvert; v++) {
        float *n = mesh->normal + 3 * v;
        double length = hypot(hypot(sum[v][0], sum[v][1]), sum[v][2]);
        for (int c = 0; c < 3 && n[0] == 0 && n[1] == 0 && n[2] == 0; c++)
            n[c] = length > 0 ? (float)(sum[v][c] / length) : c == 2;
    }
    free(sum);
    return true;
}

/* Opens an optional attribute and reads it into `out`, rows of `components`. */
static bool read_attribute(struct reader *r, const struct primitive *p, const char *name,
                           int components, const char *place, float *out, struct dph_error *err)
{
    struct dph_gltf_accessor a;
    char at[160];
    if (!dph_gltf_accessor_at(r->doc, p->attributes, name, place, NULL, &a, err))
        return false;
    snprintf(at, sizeof at, "%s.%s", place, name);
    return check_vector(r->doc, &a, components, at, err) &&
           dph_gltf_floats(r->doc, &a, at, out, err);
}

/* Fills the mesh of a body from the reader's open primitives. */
static bool fill_body(struct reader *r, size_t mesh_number, struct dph_body *body,
                      struct dph_error *err)
{
    size_t nvert = 0, corners = 0, nprimitive = r->nprimitive;
    bool normal = true, texcoord = true;
    for (size_t i = 0; i < nprimitive; i++) {
        nvert += r->primitive[i].position.count;
        corners += r->primitive[i].corners;
        normal = normal && r->primitive[i].normal;
        texcoord = texcoord && r->primitive[i].texcoord;
    }
    struct dph_mesh *mesh = &body->mesh;
    if (!dph_mesh_init(mesh, nvert, corners / 3, normal, texcoord, err))
        return false;
    size_t row = 0, corner = 0;
    for (size_t i = 0; i < nprimitive; i++) {
        const struct primitive *p = &r->primitive[i];
        char place[80], at[120];
        snprintf(place, sizeof place, "meshes[%zu].primitives[%zu]", mesh_number, p->number);
        snprintf(at, sizeof at, "%s.attributes.POSITION", place);
        if (!dph_gltf_floats(r->doc, &p->position, at, mesh->position + 3 * row, err))
            return false;
        snprintf(at, sizeof at, "%s.attributes", place);
        if (normal && !read_attribute(r, p, "NORMAL", 3, at, mesh->normal + 3 * row, err))
            return false;
        if (texcoord && !read_attribute(r, p, "TEXCOORD_0", 2, at, mesh->texcoord + 2 * row, err))
            return false;
        snprintf(at, sizeof at, "%s.indices", place);
        if (!read_indices(r, p, at, (uint32_t)row, mesh->index + corner, err))
            return false;
        row += p->position.count;
        corner += p->corners;
    }
    return !normal || finish_normals(mesh, err);
}

/* Reads one mesh; *body is its number, SIZE_MAX where it has no triangles. */
static bool read_mesh(struct reader *r, size_t number, size_t *body_number, struct dph_error *err)
{
    struct dph_scene *scene = r->scene;
    struct dph_document *doc = r->doc;
    json_t *object, *primitives;
    char place[48];
    *body_number = SIZE_MAX;
    snprintf(place, sizeof place, "meshes[%zu]", number);
    if (!dph_gltf_element(doc, "meshes", number, place, &object, err) ||
        !dph_gltf_array(doc, object, "primitives", place, &primitives, err))
        return false;
    if (!json_array_size(primitives))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "has no primitives");
    r->nprimitive = 0;
    for (size_t i = 0; i < json_array_size(primitives); i++) {
        bool skip;
        struct primitive *grown = dph_grow(r->primitive, r->nprimitive, &r->primitive_capacity,
                                           sizeof *grown);
        if (!grown)
            return dph_fail_memory(err);
        r->primitive = grown;
        if (!open_primitive(r, json_array_get(primitives, i), number, i, &grown[r->nprimitive],
                            &skip, err))
            return false;
        r->nprimitive += !skip;
    }
    if (!r->nprimitive)
        return true;
    struct dph_body *bodies =
        dph_grow(scene->body, scene->nbody, &r->body_capacity, sizeof *bodies);
    if (!bodies)
        return dph_fail_memory(err);
    scene->body = bodies;
    struct dph_body *body = &bodies[scene->nbody];
    *body = (struct dph_body){0};
    const char *name = json_string_value(json_object_get(object, "name"));
    if (!(body->name = dph_strdup(name ? name : "")))
        return dph_fail_memory(err);
    *body_number = scene->nbody++;
    if (!fill_body(r, number, body, err))
        return false;
    size_t first = doc->npart, row = 0;
    for (size_t i = 0; i < r->nprimitive; i++) {
        struct dph_gltf_part *parts =
            dph_grow(doc->part, doc->npart, &r->part_capacity, sizeof *parts);
        if (!parts)
            return dph_fail_memory(err);
        doc->part = parts;
        parts[doc->npart++] =
            (struct dph_gltf_part){*body_number, number, r->primitive[i].number, row,
                                   r->primitive[i].position.count};
        row += r->primitive[i].position.count;
    }
    double unit = 0;
    if (!dph_gltf_read_thickness(doc, body, first, doc->npart, &unit, err) ||
        !dph_gltf_read_rivals(doc, body, first, doc->npart, &unit, err))
        return false;
    if (unit && scene->mm_per_unit && unit != scene->mm_per_unit &&
        !dph_scene_warn(scene, "%s: %s: mm_per_unit is %g, another mesh says %g, which is used",
                        doc->path, place, unit, scene->mm_per_unit))
        return dph_fail_memory(err);
    if (!scene->mm_per_unit)
        scene->mm_per_unit = unit;
    return true;
}

/* A file that draws nothing is a collection of meshes; each is taken as it stands. */
static bool place_all(struct dph_scene *scene, const char *path, struct dph_error *err)
{
    scene->instance = dph_alloc(scene->nbody, sizeof *scene->instance);
    if (!scene->instance)
        return dph_fail_memory(err);
    scene->ninstance = scene->nbody;
    for (size_t i = 0; i < scene->nbody; i++)
        scene->instance[i] = (struct dph_instance){
            .body = i, .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    return dph_scene_warn(scene, "%s: no node of the default scene draws a mesh with triangles, so "
                          "every mesh is placed as it is", path) || dph_fail_memory(err);
}

bool dph_read_gltf(struct dph_scene *scene, struct dph_file *file, const char *path,
                   struct dph_error *err)
{
    struct reader r = {.scene = scene};
    size_t *body_of = NULL;
    json_t *meshes;
    bool ok = false;
    r.doc = scene->document = dph_gltf_document_create(file, path, err);
    if (!r.doc || !check_extensions(r.doc, err) ||
        !dph_gltf_array(r.doc, r.doc->root, "meshes", "", &meshes, err))
        return false;
    size_t nmesh = json_array_size(meshes);
    if (!(body_of = dph_alloc(nmesh, sizeof *body_of))) {
        dph_fail_memory(err);
        goto done;
    }
    for (size_t i = 0; i < nmesh; i++)
        if (!read_mesh(&r, i, &body_of[i], err))
            goto done;
    if (!scene->nbody) {
        dph_gltf_fail(r.doc, "meshes", DPH_ERROR_INPUT, err, "none of %zu holds triangles", nmesh);
        goto done;
    }
    if (!dph_gltf_read_nodes(scene, r.doc, body_of, nmesh, err))
        goto done;
    ok = scene->ninstance || place_all(scene, path, err);
done:
    dph_gltf_forget_views(r.doc);
    free(r.primitive);
    free(body_of);
    return ok;
}
