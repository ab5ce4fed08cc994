/* Scenes: which reader a file needs, what every body goes through after it, and which writer an
 * ending means. */
#include <diaphan/scene.h>

#include "core/fail.h"
#include "core/memory.h"
#include "mesh/readers.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FILE_LIMIT ((size_t)4 << 30)

/* Degrees between two faces above which formats without normals get an edge. */
#define CREASE 60.

/* ---- which format ---- */

enum format { UNKNOWN = 0, GLTF, OBJ, PLY, STL };

/* Whether `path` ends in `.ending`, in any case. */
static bool ends_in(const char *path, const char *ending)
{
    size_t n = strlen(path), k = strlen(ending);
    if (n <= k || path[n - k - 1] != '.')
        return false;
    for (size_t i = 0; i < k; i++)
        if (tolower((unsigned char)path[n - k + i]) != ending[i])
            return false;
    return true;
}

static enum format format_of_ending(const char *path)
{
    if (ends_in(path, "glb") || ends_in(path, "gltf"))
        return GLTF;
    return ends_in(path, "obj") ? OBJ : ends_in(path, "ply") ? PLY : ends_in(path, "stl") ? STL
                                                                                   : UNKNOWN;
}

/* Text that has a line "v x y z" near its beginning. */
static bool looks_like_obj(const struct dph_file *file)
{
    size_t end = file->size < 65536 ? file->size : 65536;
    bool fresh = true;
    for (size_t i = 0; i + 1 < end; i++) {
        if (!file->data[i])
            return false;
        if (fresh && file->data[i] == 'v' &&
            (file->data[i + 1] == ' ' || file->data[i + 1] == '\t'))
            return true;
        fresh = file->data[i] == '\n' || file->data[i] == '\r';
    }
    return false;
}

/* By content where a format can be told by it, then by ending, then by weaker signs. */
static enum format format_of(const struct dph_file *file, const char *path)
{
    const unsigned char *data = file->data;
    size_t at = file->size >= 3 && !memcmp(data, "\xEF\xBB\xBF", 3) ? 3 : 0;
    while (at < file->size && isspace(data[at]))
        at++;
    if (file->size >= 4 && !memcmp(data, "glTF", 4))
        return GLTF;
    if (file->size >= 4 && !memcmp(data, "ply", 3) && (data[3] == '\n' || data[3] == '\r'))
        return PLY;
    if (at < file->size && data[at] == '{')
        return GLTF;
    enum format ending = format_of_ending(path);
    if (ending)
        return ending;
    if (file->size >= 84) {
        size_t ntri = data[80] | (size_t)data[81] << 8 | (size_t)data[82] << 16 |
                      (size_t)data[83] << 24;
        if (file->size == 84 + 50 * ntri)
            return STL;
    }
    if (file->size - at >= 5 && !memcmp(data + at, "solid", 5))
        return STL;
    return looks_like_obj(file) ? OBJ : UNKNOWN;
}

/* ---- bodies ---- */

/* Six times the signed volume about the first vertex, and twice the area weighted by how far the
 * mesh's normals agree with its faces. */
static void orientation(const struct dph_mesh *mesh, double *volume, double *agreement)
{
    *volume = *agreement = 0;
    const float *o = mesh->position;
    for (size_t t = 0; t < mesh->ntri; t++) {
        const uint32_t *i = mesh->index + 3 * t;
        double e[3][3];
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                e[k][c] = (double)mesh->position[3 * (size_t)i[k] + (size_t)c] - o[c];
        double u[3], v[3], n[3];
        for (int c = 0; c < 3; c++) {
            u[c] = e[1][c] - e[0][c];
            v[c] = e[2][c] - e[0][c];
        }
        for (int c = 0; c < 3; c++) {
            n[c] = u[(c + 1) % 3] * v[(c + 2) % 3] - u[(c + 2) % 3] * v[(c + 1) % 3];
            *volume += n[c] * e[0][c];
        }
        for (int k = 0; mesh->normal && k < 3; k++)
            for (int c = 0; c < 3; c++)
                *agreement += n[c] * mesh->normal[3 * (size_t)i[k] + (size_t)c] / 3;
    }
}

/* Turns a closed body whose faces look inward. The thickness of a ray counts crossings by their
 * sense, so an inverted body would come out empty. The file's normals follow only if they were
 * turned inward too. */
static bool turn(struct dph_scene *scene, struct dph_body *body, const char *path,
                 struct dph_error *err)
{
    double volume, agreement;
    struct dph_mesh_stats stats;
    if (!body->mesh.ntri)
        return true;
    orientation(&body->mesh, &volume, &agreement);
    if (!(volume < 0)) /* cheap, and sure for whatever is closed */
        return true;
    if (!dph_mesh_measure(&body->mesh, &stats, err))
        return false;
    if (!stats.closed || !(stats.volume < 0))
        return true;
    dph_mesh_flip(&body->mesh);
    /* the faces are turned now; normals that disagreed with them before agree now and were turned
     * too far */
    for (size_t i = 0; body->mesh.normal && agreement < 0 && i < 3 * body->mesh.nvert; i++)
        body->mesh.normal[i] = -body->mesh.normal[i];
    return dph_scene_warn(scene, "%s: body \"%.60s\" is closed and has a negative volume (%g); its "
                          "triangles are turned to face outward", path, body->name, stats.volume) ||
           dph_fail_memory(err);
}

/* Vertices that are transformed one by one for the bounds; a file can ask for far more by placing a
 * large body a million times. Beyond it the corners of the bodies' own boxes stand for them. */
#define BOUNDS_WORK ((size_t)1 << 32)

/* Takes one point of a body, placed by `m`, into the box. */
static void extend(double box[2][3], const float m[16], const double p[3])
{
    for (int c = 0; c < 3; c++) {
        double x = m[c] * p[0] + m[4 + c] * p[1] + m[8 + c] * p[2] + m[12 + c];
        box[0][c] = x < box[0][c] ? x : box[0][c];
        box[1][c] = x > box[1][c] ? x : box[1][c];
    }
}

/* Adds the instances `list` (count) of one body to the box. */
static void measure_body(const struct dph_scene *scene, const struct dph_mesh *mesh,
                         const size_t *list, size_t count, bool *used, double box[2][3])
{
    static const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    double own[2][3] = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    bool corners = mesh->nvert > BOUNDS_WORK / count;
    memset(used, 0, mesh->nvert * sizeof *used);
    for (size_t i = 0; i < 3 * mesh->ntri; i++)
        used[mesh->index[i]] = true;
    for (size_t k = 0; k < (corners ? 1 : count); k++)
        for (size_t v = 0; v < mesh->nvert; v++) {
            const float *p = mesh->position + 3 * v;
            if (used[v])
                extend(corners ? own : box, corners ? identity : scene->instance[list[k]].matrix,
                       (const double[3]){p[0], p[1], p[2]});
        }
    for (size_t k = 0; corners && mesh->ntri && k < count; k++)
        for (int i = 0; i < 8; i++)
            extend(box, scene->instance[list[k]].matrix,
                   (const double[3]){own[i & 1][0], own[i >> 1 & 1][1], own[i >> 2][2]});
}

/* Bounds of what the instances draw. */
static bool measure_bounds(struct dph_scene *scene, struct dph_error *err)
{
    double box[2][3] = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    size_t most = 0;
    for (size_t b = 0; b < scene->nbody; b++)
        most = scene->body[b].mesh.nvert > most ? scene->body[b].mesh.nvert : most;
    /* instances in the order of their bodies: a counting sort */
    size_t *first = dph_alloc_zero(scene->nbody + 1, sizeof *first);
    size_t *order = dph_alloc(scene->ninstance, sizeof *order);
    bool *used = dph_alloc(most, sizeof *used), ok = first && order && used;
    if (!ok) {
        dph_fail_memory(err);
        goto done;
    }
    for (size_t k = 0; k < scene->ninstance; k++)
        first[scene->instance[k].body]++;
    for (size_t b = 0, sum = 0; b <= scene->nbody; b++) {
        sum += first[b];
        first[b] = sum; /* the end of body b, until the instances are put before it */
    }
    for (size_t k = scene->ninstance; k-- > 0;)
        order[--first[scene->instance[k].body]] = k;
    for (size_t b = 0; b < scene->nbody; b++)
        if (first[b + 1] > first[b])
            measure_body(scene, &scene->body[b].mesh, order + first[b], first[b + 1] - first[b],
                         used, box);
    for (int c = 0; c < 3; c++) {
        bool any = box[0][c] <= box[1][c];
        scene->bounds[0][c] = any ? box[0][c] : 0;
        scene->bounds[1][c] = any ? box[1][c] : 0;
    }
done:
    free(first);
    free(order);
    free(used);
    return ok;
}

/* ---- loading ---- */

/* One body and one instance, without a mesh yet. */
static bool add_body(struct dph_scene *scene, const char *name, size_t length,
                     struct dph_error *err)
{
    scene->body = dph_alloc_zero(1, sizeof *scene->body);
    scene->instance = dph_alloc_zero(1, sizeof *scene->instance);
    if (!scene->body || !scene->instance || !(scene->body->name = dph_alloc(length + 1, 1)))
        return dph_fail_memory(err);
    memcpy(scene->body->name, name, length);
    scene->body->name[length] = 0;
    scene->nbody = scene->ninstance = 1;
    for (int i = 0; i < 16; i += 5)
        scene->instance->matrix[i] = 1;
    return true;
}

static bool load_mesh(struct dph_scene *scene, const struct dph_file *file, enum format format,
                      const char *path, struct dph_error *err)
{
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    if (!add_body(scene, name, dot && dot > name ? (size_t)(dot - name) : strlen(name), err))
        return false;
    struct dph_mesh *mesh = &scene->body->mesh;
    bool ok = format == OBJ   ? dph_read_obj(mesh, file, path, scene, err)
              : format == PLY ? dph_read_ply(mesh, file, path, scene, err)
                              : dph_read_stl(mesh, file, path, scene, err);
    /* turned first, so that normals made here look outward */
    return ok && turn(scene, scene->body, path, err) &&
           (mesh->normal || dph_mesh_make_normals(mesh, CREASE, NULL, err));
}

struct dph_scene *dph_scene_load(const char *path, struct dph_error *err)
{
    struct dph_file file = {0};
    struct dph_scene *scene = dph_alloc_zero(1, sizeof *scene);
    if (!scene) {
        dph_fail_memory(err);
        return NULL;
    }
    if (!dph_file_load(&file, path, FILE_LIMIT, err))
        goto error;
    enum format format = format_of(&file, path);
    if (!format) {
        dph_fail(err, DPH_ERROR_UNSUPPORTED,
                 "%s: neither glTF (.glb, .gltf) nor OBJ, PLY or STL; convert it to one of them",
                 path);
        goto error;
    }
    if (format != GLTF) {
        if (!load_mesh(scene, &file, format, path, err))
            goto error;
    } else {
        if (!dph_read_gltf(scene, &file, path, err))
            goto error;
        for (size_t i = 0; i < scene->nbody; i++)
            if (!turn(scene, &scene->body[i], path, err))
                goto error;
    }
    dph_file_finish(&file);
    if (!measure_bounds(scene, err))
        goto error;
    return scene;

error:
    dph_file_finish(&file);
    dph_scene_destroy(scene);
    return NULL;
}

struct dph_scene *dph_scene_from_mesh(struct dph_mesh *mesh, const char *name,
                                      struct dph_error *err)
{
    struct dph_scene *scene = dph_alloc_zero(1, sizeof *scene);
    if (!scene) {
        dph_fail_memory(err);
        return NULL;
    }
    if (!add_body(scene, name, strlen(name), err))
        goto error;
    scene->body->mesh = *mesh;
    if (!measure_bounds(scene, err)) {
        scene->body->mesh = (struct dph_mesh){0};
        goto error;
    }
    *mesh = (struct dph_mesh){0};
    return scene;

error:
    dph_scene_destroy(scene);
    return NULL;
}

void dph_scene_destroy(struct dph_scene *scene)
{
    if (!scene)
        return;
    for (size_t i = 0; i < scene->nbody; i++) {
        free(scene->body[i].name);
        dph_mesh_finish(&scene->body[i].mesh);
        dph_thickness_destroy(scene->body[i].thickness);
        dph_rivals_destroy(scene->body[i].rivals);
    }
    for (size_t i = 0; i < scene->nwarning; i++)
        free(scene->warning[i]);
    free(scene->body);
    free(scene->instance);
    free(scene->warning);
    dph_document_destroy(scene->document);
    free(scene);
}

bool dph_scene_warn(struct dph_scene *scene, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    for (char *c = text; *c; c++)
        if ((unsigned char)*c < 32 || *c == 127)
            *c = '?';
    char *copy = dph_strdup(text);
    char **grown = copy ? realloc(scene->warning, (scene->nwarning + 1) * sizeof *grown) : NULL;
    if (!grown) {
        free(copy);
        return false;
    }
    scene->warning = grown;
    grown[scene->nwarning++] = copy;
    return true;
}

double dph_scene_size(const struct dph_scene *scene)
{
    double size = 0;
    for (int c = 0; c < 3; c++)
        size = fmax(size, scene->bounds[1][c] - scene->bounds[0][c]);
    return size;
}

/* ---- saving ---- */

bool dph_scene_save(const struct dph_scene *scene, const char *path, struct dph_error *err)
{
    if (ends_in(path, "glb"))
        return dph_write_gltf(scene, path, err);
    if (ends_in(path, "gltf"))
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "%s: glTF is written as one binary file; name the output .glb", path);
    enum format format = format_of_ending(path);
    if (!format)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "%s: an output ends in .glb, .obj, .ply or .stl", path);
    if (scene->document)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "%s: what was loaded from glTF is written as glTF; name the output .glb",
                        path);
    if (!scene->nbody)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%s: a scene without bodies", path);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    return format == OBJ   ? dph_write_obj(mesh, path, err)
           : format == PLY ? dph_write_ply(mesh, path, err) : dph_write_stl(mesh, path, err);
}
