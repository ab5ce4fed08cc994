/* glTF: the node hierarchy, flattened into instances of the default scene.
 *
 * Nodes form a forest: nobody has two parents and no node is its own ancestor. Both are checked
 * over the whole file before anything is drawn. Walks use an explicit stack, so that a chain of a
 * million nodes costs memory and no stack. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NO_NODE SIZE_MAX
/* Instances that one file may ask for: each costs 72 bytes, EXT_mesh_gpu_instancing multiplies. */
#define INSTANCE_LIMIT ((size_t)1 << 22)

/* One walk over the forest. */
struct walk {
    struct dph_scene *scene;
    struct dph_document *doc;
    const size_t *body_of; /* (nmesh) */
    size_t nmesh;
    json_t *nodes;
    size_t nnode;
    size_t *parent;        /* (nnode) NO_NODE: a root   */
    double (*world)[16];   /* (nnode) column-major      */
    size_t *stack;         /* (nnode)                   */
    bool *named;           /* (nnode) root of the scene */
    size_t capacity;       /* of scene->instance        */
};

/* Index i of an array of node indices. */
static bool node_index(const struct walk *w, const json_t *list, size_t i, const char *place,
                       size_t *node, struct dph_error *err)
{
    const json_t *value = json_array_get(list, i);
    double real = json_number_value(value);
    if (!json_is_number(value) || real < 0 || real != floor(real) || real >= (double)w->nnode)
        return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                             "element %zu is %.17g, the file has %zu nodes", i, real, w->nnode);
    *node = (size_t)real;
    return true;
}

/* Fills `parent` and refuses what is no forest. */
static bool link_nodes(struct walk *w, struct dph_error *err)
{
    for (size_t i = 0; i < w->nnode; i++)
        w->parent[i] = NO_NODE;
    for (size_t i = 0; i < w->nnode; i++) {
        json_t *node, *children;
        char place[48];
        snprintf(place, sizeof place, "nodes[%zu]", i);
        if (!dph_gltf_element(w->doc, "nodes", i, place, &node, err) ||
            !dph_gltf_array(w->doc, node, "children", place, &children, err))
            return false;
        snprintf(place, sizeof place, "nodes[%zu].children", i);
        for (size_t k = 0; k < json_array_size(children); k++) {
            size_t child = 0;
            if (!node_index(w, children, k, place, &child, err))
                return false;
            if (w->parent[child] != NO_NODE)
                return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                                     "nodes[%zu] is a child of nodes[%zu] already", child,
                                     w->parent[child]);
            w->parent[child] = i;
        }
    }
    /* From the roots every node is reached once; what is not reached hangs on a cycle. */
    size_t reached = 0, depth = 0;
    for (size_t i = 0; i < w->nnode; i++)
        if (w->parent[i] == NO_NODE)
            w->stack[depth++] = i;
    while (depth) {
        const json_t *children =
            json_object_get(json_array_get(w->nodes, w->stack[--depth]), "children");
        reached++;
        for (size_t k = 0; k < json_array_size(children); k++)
            w->stack[depth++] = (size_t)json_number_value(json_array_get(children, k));
    }
    if (reached == w->nnode)
        return true;
    /* Every node that was not reached has a parent; following parents ends in the cycle. */
    memset(w->stack, 0, w->nnode * sizeof *w->stack);
    for (size_t start = 0; start < w->nnode; start++) {
        size_t at = start;
        while (at != NO_NODE && !w->stack[at]) {
            w->stack[at] = start + 1;
            at = w->parent[at];
        }
        if (at != NO_NODE && w->stack[at] == start + 1)
            return dph_gltf_fail(w->doc, "", DPH_ERROR_INPUT, err,
                                 "nodes[%zu].children: the node is its own ancestor", at);
    }
    return true;
}

/* c = a b, column-major; c may be a. */
static void multiply(const double a[16], const double b[16], double c[16])
{
    double r[16];
    for (int col = 0; col < 4; col++)
        for (int row = 0; row < 4; row++)
            r[4 * col + row] = a[row] * b[4 * col] + a[4 + row] * b[4 * col + 1] +
                               a[8 + row] * b[4 * col + 2] + a[12 + row] * b[4 * col + 3];
    memcpy(c, r, sizeof r);
}

/* Translation * rotation (quaternion x, y, z, w of any length but 0) * scale. */
static bool compose(const double t[3], const double q[4], const double s[3], double m[16])
{
    double norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(norm > 1e-30) || !isfinite(norm))
        return false;
    double k = 2 / norm, x = q[0], y = q[1], z = q[2], w = q[3];
    double r[9] = {1 - k * (y * y + z * z), k * (x * y + w * z), k * (x * z - w * y),
                   k * (x * y - w * z), 1 - k * (x * x + z * z), k * (y * z + w * x),
                   k * (x * z + w * y), k * (y * z - w * x), 1 - k * (x * x + y * y)};
    for (int col = 0; col < 3; col++) {
        for (int row = 0; row < 3; row++)
            m[4 * col + row] = r[3 * col + row] * s[col];
        m[4 * col + 3] = 0;
        m[12 + col] = t[col];
    }
    m[15] = 1;
    return true;
}

static bool local_matrix(const struct walk *w, const json_t *node, const char *place, double m[16],
                         struct dph_error *err)
{
    double t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    bool matrix, moved, turned, scaled;
    if (!dph_gltf_numbers(w->doc, node, "matrix", place, 16, m, &matrix, err) ||
        !dph_gltf_numbers(w->doc, node, "translation", place, 3, t, &moved, err) ||
        !dph_gltf_numbers(w->doc, node, "rotation", place, 4, q, &turned, err) ||
        !dph_gltf_numbers(w->doc, node, "scale", place, 3, s, &scaled, err))
        return false;
    if (!matrix)
        return compose(t, q, s, m) ||
               dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                             "rotation [%g, %g, %g, %g] is no quaternion", q[0], q[1], q[2], q[3]);
    if (moved || turned || scaled)
        return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                             "has a matrix and translation, rotation or scale");
    if (fabs(m[3]) > 1e-6 || fabs(m[7]) > 1e-6 || fabs(m[11]) > 1e-6 || fabs(m[15] - 1) > 1e-6)
        return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                             "matrix has the last row %g, %g, %g, %g instead of 0, 0, 0, 1", m[3],
                             m[7], m[11], m[15]);
    m[3] = m[7] = m[11] = 0;
    m[15] = 1;
    return true;
}

static bool add_instance(struct walk *w, size_t body, const double matrix[16], const char *place,
                         struct dph_error *err)
{
    struct dph_scene *scene = w->scene;
    if (scene->ninstance >= INSTANCE_LIMIT)
        return dph_gltf_fail(w->doc, place, DPH_ERROR_LIMIT, err, "more than %zu instances",
                             INSTANCE_LIMIT);
    struct dph_instance *grown =
        dph_grow(scene->instance, scene->ninstance, &w->capacity, sizeof *grown);
    if (!grown)
        return dph_fail_memory(err);
    scene->instance = grown;
    struct dph_instance *instance = &grown[scene->ninstance++];
    instance->body = body;
    for (int i = 0; i < 16; i++) {
        instance->matrix[i] = (float)matrix[i];
        if (!isfinite(instance->matrix[i]))
            return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                                 "its world matrix has the element %g", matrix[i]);
    }
    return true;
}

/* EXT_mesh_gpu_instancing: further copies, each by its own translation, rotation and scale inside
 * the node. */
static bool add_gpu_instances(struct walk *w, const json_t *extension, size_t body,
                              const double world[16], const char *place, struct dph_error *err)
{
    static const char *const name[3] = {"TRANSLATION", "ROTATION", "SCALE"};
    static const int width[3] = {3, 4, 3};
    float *value[3] = {NULL, NULL, NULL};
    json_t *attributes;
    size_t count = 0;
    bool ok = false;
    char at[120];
    snprintf(at, sizeof at, "%s.extensions.EXT_mesh_gpu_instancing", place);
    if (!dph_gltf_object(w->doc, extension, "attributes", at, &attributes, err))
        return false;
    snprintf(at, sizeof at, "%s.extensions.EXT_mesh_gpu_instancing.attributes", place);
    for (int i = 0; i < 3; i++) {
        struct dph_gltf_accessor a;
        bool found;
        if (!dph_gltf_accessor_at(w->doc, attributes, name[i], at, &found, &a, err))
            goto done;
        if (!found)
            continue;
        if (a.components != width[i] || a.type == DPH_GLTF_UINT || (count && a.count != count)) {
            dph_gltf_fail(w->doc, at, DPH_ERROR_INPUT, err,
                          "%s has %zu elements of %d components, expected %zu of %d", name[i],
                          a.count, a.components, count ? count : a.count, width[i]);
            goto done;
        }
        if (a.count > INSTANCE_LIMIT) {
            dph_gltf_fail(w->doc, at, DPH_ERROR_LIMIT, err, "%zu instances, more than %zu", a.count,
                          INSTANCE_LIMIT);
            goto done;
        }
        count = a.count;
        if (!(value[i] = dph_alloc(count * (size_t)width[i], sizeof(float)))) {
            dph_fail_memory(err);
            goto done;
        }
        if (!dph_gltf_floats(w->doc, &a, at, value[i], err))
            goto done;
    }
    for (size_t k = 0; k < count; k++) {
        double t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1}, m[16];
        double *const part[3] = {t, q, s};
        for (int i = 0; i < 3; i++)
            for (int c = 0; value[i] && c < width[i]; c++)
                part[i][c] = value[i][k * (size_t)width[i] + (size_t)c];
        if (!compose(t, q, s, m)) {
            dph_gltf_fail(w->doc, at, DPH_ERROR_INPUT, err, "ROTATION %zu is no quaternion", k);
            goto done;
        }
        multiply(world, m, m);
        if (!add_instance(w, body, m, place, err))
            goto done;
    }
    ok = true;
done:
    for (int i = 0; i < 3; i++)
        free(value[i]);
    return ok;
}

static bool visit(struct walk *w, size_t i, struct dph_error *err)
{
    static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const json_t *node = json_array_get(w->nodes, i);
    char place[48];
    size_t mesh;
    double local[16];
    snprintf(place, sizeof place, "nodes[%zu]", i);
    if (!local_matrix(w, node, place, local, err))
        return false;
    if (w->parent[i] == NO_NODE)
        memcpy(w->world[i], local, sizeof local);
    else
        multiply(w->world[w->parent[i]], local, w->world[i]);
    if (!json_object_get(node, "mesh"))
        return true;
    if (!dph_gltf_size(w->doc, node, "mesh", place, DPH_GLTF_REQUIRED, SIZE_MAX, &mesh, err))
        return false;
    if (mesh >= w->nmesh)
        return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                             "mesh is %zu, the file has %zu meshes", mesh, w->nmesh);
    size_t body = w->body_of[mesh];
    if (body == SIZE_MAX)
        return true;
    const json_t *copies = dph_gltf_extension(node, "EXT_mesh_gpu_instancing", NULL);
    if (copies)
        return add_gpu_instances(w, copies, body, w->world[i], place, err);
    /* A skin's joints place the vertices in the scene; the node's own transform does not count. */
    bool skinned = json_object_get(node, "skin") != NULL;
    return add_instance(w, body, skinned ? identity : w->world[i], place, err);
}

/* Puts the roots of the default scene on the stack, the first on top. */
static bool push_roots(struct walk *w, size_t *depth, struct dph_error *err)
{
    json_t *scenes, *scene, *roots;
    size_t which;
    char place[48];
    if (!dph_gltf_array(w->doc, w->doc->root, "scenes", "", &scenes, err) ||
        !dph_gltf_size(w->doc, w->doc->root, "scene", "", 0, SIZE_MAX, &which, err))
        return false;
    *depth = 0;
    if (!json_array_size(scenes) && !json_object_get(w->doc->root, "scene")) {
        for (size_t i = w->nnode; i-- > 0;)
            if (w->parent[i] == NO_NODE)
                w->stack[(*depth)++] = i;
        return true;
    }
    if (!dph_gltf_element(w->doc, "scenes", which, "scene", &scene, err))
        return false;
    snprintf(place, sizeof place, "scenes[%zu]", which);
    if (!dph_gltf_array(w->doc, scene, "nodes", place, &roots, err))
        return false;
    snprintf(place, sizeof place, "scenes[%zu].nodes", which);
    for (size_t k = json_array_size(roots); k-- > 0;) {
        size_t node = 0;
        if (!node_index(w, roots, k, place, &node, err))
            return false;
        if (w->parent[node] != NO_NODE)
            return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err,
                                 "element %zu is nodes[%zu], a child of nodes[%zu] and no root", k,
                                 node, w->parent[node]);
        if (w->named[node])
            return dph_gltf_fail(w->doc, place, DPH_ERROR_INPUT, err, "names nodes[%zu] twice",
                                 node);
        w->named[node] = true;
        w->stack[(*depth)++] = node;
    }
    return true;
}

bool dph_gltf_read_nodes(struct dph_scene *scene, struct dph_document *doc, const size_t *body_of,
                         size_t nmesh, struct dph_error *err)
{
    struct walk w = {.scene = scene, .doc = doc, .body_of = body_of, .nmesh = nmesh};
    bool ok = false;
    size_t depth = 0;
    if (!dph_gltf_array(doc, doc->root, "nodes", "", &w.nodes, err))
        return false;
    w.nnode = json_array_size(w.nodes);
    w.parent = dph_alloc(w.nnode, sizeof *w.parent);
    w.world = dph_alloc(w.nnode, sizeof *w.world);
    w.stack = dph_alloc(w.nnode, sizeof *w.stack);
    w.named = dph_alloc_zero(w.nnode, sizeof *w.named);
    if (!w.parent || !w.world || !w.stack || !w.named) {
        dph_fail_memory(err);
        goto done;
    }
    if (!link_nodes(&w, err) || !push_roots(&w, &depth, err))
        goto done;
    while (depth) {
        size_t i = w.stack[--depth];
        if (!visit(&w, i, err))
            goto done;
        const json_t *children = json_object_get(json_array_get(w.nodes, i), "children");
        for (size_t k = json_array_size(children); k-- > 0;)
            w.stack[depth++] = (size_t)json_number_value(json_array_get(children, k));
    }
    ok = true;
done:
    free(w.parent);
    free(w.world);
    free(w.stack);
    free(w.named);
    return ok;
}
