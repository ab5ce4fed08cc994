/* Wavefront OBJ: v, vt, vn and f; everything else (groups, materials, smoothing, lines, points,
 * free-form surfaces) is passed over.
 *
 * The file is scanned once. A face may refer to vertices that come after it, and its polygon can
 * be cut only when they are known, so faces are kept as lists of corners until the end. An index
 * beyond what has been read is kept in mind with its line if it is higher than all such before;
 * the first of them that is beyond the end as well is what the message names.
 *
 * Texture coordinates and normals are kept where every corner has them. Corners with the same
 * three numbers become one vertex, numbered in order of appearance; a file with neither keeps its
 * vertices row for row. OBJ counts v upward, this library as glTF does, downward, hence 1 - v. */
#include "mesh/readers.h"

#include "core/fail.h"
#include "core/memory.h"
#include "mesh/polygon.h"
#include "mesh/scan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NONE UINT32_MAX
#define COUNT_LIMIT ((size_t)1 << 31)

enum { POSITION, TEXCOORD, NORMAL, KINDS };

static const char *const kind_name[KINDS] = {"vertex", "texture coordinate", "normal"};
static const int kind_size[KINDS] = {3, 2, 3};

/* An index beyond what was read before its line. */
struct promise {
    size_t index, line;
};

struct obj {
    const char *path;
    const char *cursor, *end;
    size_t line;
    float *value[KINDS]; /* (count x kind_size) */
    size_t count[KINDS], capacity[KINDS];
    struct promise *promise[KINDS]; /* (npromise), both fields rising */
    size_t npromise[KINDS], promise_capacity[KINDS];
    uint32_t (*corner)[KINDS]; /* (ncorner) NONE: not given */
    size_t ncorner, corner_capacity;
    uint32_t *face; /* (nface) number of corners */
    size_t nface, face_capacity;
    size_t ntri;
    bool missing[KINDS]; /* some corner has none */
    struct dph_error *err;
};

static bool fail(struct obj *o, enum dph_code code, const char *what, const char *at)
{
    return dph_fail(o->err, code, "%s:%zu: %s%s%s", o->path, o->line, what, at ? ", not " : "",
                    at ? dph_scan_word(at, o->end).text : "");
}

/* The length of a line end at `c`: 2 for CR LF, 1 for either alone, else 0. */
static int line_end(const char *c)
{
    return *c == '\n' ? 1 : *c == '\r' ? 1 + (c[1] == '\n') : 0;
}

/* Skips blanks, and line ends that a backslash takes back. */
static void skip_blanks(struct obj *o)
{
    const char *c = o->cursor;
    for (;;) {
        if (*c == ' ' || *c == '\t') {
            c++;
        } else if (*c == '\\' && line_end(c + 1)) {
            c += 1 + line_end(c + 1);
            o->line++;
        } else {
            break;
        }
    }
    o->cursor = c;
}

static bool at_line_end(const struct obj *o)
{
    return line_end(o->cursor) || *o->cursor == '#' || o->cursor >= o->end;
}

/* Goes to the start of the next line. */
static void skip_line(struct obj *o)
{
    const char *c = o->cursor;
    while (c < o->end && *c != '\n' && *c != '\r')
        c++;
    if (c < o->end) {
        c += line_end(c);
        o->line++;
    }
    o->cursor = c;
}

static bool is_word_end(const struct obj *o, const char *c)
{
    return *c == ' ' || *c == '\t' || *c == '\n' || *c == '\r' || *c == '#' || *c == '\\' ||
           c >= o->end;
}

/* Reads `need` numbers and up to `most` into `value`. */
static bool read_numbers(struct obj *o, int kind, int need, int most, float *value)
{
    for (int i = 0; i < most; i++) {
        skip_blanks(o);
        if (at_line_end(o)) {
            if (i < need)
                return dph_fail(o->err, DPH_ERROR_INPUT, "%s:%zu: %s has %d numbers, needs %d",
                                o->path, o->line, kind_name[kind], i, need);
            return true;
        }
        const char *next = dph_scan_float(o->cursor, &value[i]);
        if (!next || !is_word_end(o, next))
            return fail(o, DPH_ERROR_INPUT, "a number must stand here", o->cursor);
        if (!isfinite(value[i]))
            return fail(o, DPH_ERROR_INPUT, "a number must be finite", o->cursor);
        o->cursor = next;
    }
    return true;
}

static bool read_values(struct obj *o, int kind)
{
    float value[3] = {0, 0, 0};
    if (!read_numbers(o, kind, kind == TEXCOORD ? 1 : 3, kind_size[kind], value))
        return false;
    if (o->count[kind] >= COUNT_LIMIT)
        return fail(o, DPH_ERROR_LIMIT, "more than 2147483648 rows of one kind", NULL);
    int size = kind_size[kind];
    float *room =
        dph_grow(o->value[kind], o->count[kind], &o->capacity[kind], (size_t)size * sizeof(float));
    if (!room)
        return dph_fail_memory(o->err);
    o->value[kind] = room;
    memcpy(room + (size_t)size * o->count[kind]++, value, (size_t)size * sizeof(float));
    return true;
}

/* Remembers that a face needs row `index` of a kind, which is not there yet. */
static bool add_promise(struct obj *o, int kind, size_t index)
{
    size_t n = o->npromise[kind];
    if (n && o->promise[kind][n - 1].index >= index)
        return true;
    struct promise *room = dph_grow(o->promise[kind], n, &o->promise_capacity[kind], sizeof *room);
    if (!room)
        return dph_fail_memory(o->err);
    o->promise[kind] = room;
    room[o->npromise[kind]++] = (struct promise){index, o->line};
    return true;
}

/* Reads one number of a corner into a row that counts from 0. */
static bool read_index(struct obj *o, int kind, uint32_t *row)
{
    int64_t number;
    const char *next = dph_scan_integer(o->cursor, &number);
    if (!next)
        return fail(o, DPH_ERROR_INPUT, "a face needs the number of a vertex here", o->cursor);
    int64_t count = (int64_t)o->count[kind];
    int64_t index = number < 0 ? count + number : number - 1;
    if (number == 0)
        return dph_fail(o->err, DPH_ERROR_INPUT, "%s:%zu: face refers to %s 0, the first is 1",
                        o->path, o->line, kind_name[kind]);
    if (index < 0)
        return dph_fail(o->err, DPH_ERROR_INPUT,
                        "%s:%zu: face refers to %s %lld, only %zu come before it", o->path, o->line,
                        kind_name[kind], (long long)number, o->count[kind]);
    if (index >= (int64_t)COUNT_LIMIT)
        return dph_fail(o->err, DPH_ERROR_INPUT,
                        "%s:%zu: face refers to %s %lld, the most is 2147483648", o->path, o->line,
                        kind_name[kind], (long long)number);
    o->cursor = next;
    *row = (uint32_t)index;
    return index < count || add_promise(o, kind, (size_t)index);
}

static bool read_corner(struct obj *o)
{
    uint32_t corner[KINDS] = {NONE, NONE, NONE};
    if (!read_index(o, POSITION, &corner[POSITION]))
        return false;
    if (*o->cursor == '/') {
        o->cursor++;
        if (*o->cursor != '/' && !is_word_end(o, o->cursor) &&
            !read_index(o, TEXCOORD, &corner[TEXCOORD]))
            return false;
        if (*o->cursor == '/') {
            o->cursor++;
            if (!is_word_end(o, o->cursor) && !read_index(o, NORMAL, &corner[NORMAL]))
                return false;
        }
    }
    if (!is_word_end(o, o->cursor))
        return fail(o, DPH_ERROR_INPUT, "a corner looks like 1, 1/2, 1//3 or 1/2/3", o->cursor);
    for (int k = TEXCOORD; k < KINDS; k++)
        o->missing[k] |= corner[k] == NONE;
    void *room = dph_grow(o->corner, o->ncorner, &o->corner_capacity, sizeof *o->corner);
    if (!room)
        return dph_fail_memory(o->err);
    o->corner = room;
    memcpy(o->corner[o->ncorner++], corner, sizeof corner);
    return true;
}

static bool read_face(struct obj *o)
{
    size_t first = o->ncorner;
    for (skip_blanks(o); !at_line_end(o); skip_blanks(o))
        if (!read_corner(o))
            return false;
    size_t n = o->ncorner - first;
    if (n < 3)
        return dph_fail(o->err, DPH_ERROR_INPUT, "%s:%zu: face has %zu corners, needs 3", o->path,
                        o->line, n);
    o->ntri += n - 2;
    if (o->ntri > COUNT_LIMIT)
        return fail(o, DPH_ERROR_LIMIT, "more than 2147483648 triangles", NULL);
    uint32_t *room = dph_grow(o->face, o->nface, &o->face_capacity, sizeof *room);
    if (!room)
        return dph_fail_memory(o->err);
    o->face = room;
    o->face[o->nface++] = (uint32_t)n;
    return true;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

static bool read_lines(struct obj *o)
{
    if (o->end - o->cursor >= 3 && memcmp(o->cursor, "\xef\xbb\xbf", 3) == 0)
        o->cursor += 3; /* a byte order mark */
    while (o->cursor < o->end) {
        skip_blanks(o);
        const char *c = o->cursor;
        bool ok = true;
        int kind = c[0] != 'v'                  ? -1
                   : is_blank(c[1])             ? POSITION
                   : !is_blank(c[1] ? c[2] : 0) ? -1
                   : c[1] == 't'                ? TEXCOORD
                   : c[1] == 'n'                ? NORMAL
                                                : -1;
        if (kind >= 0) {
            o->cursor += kind == POSITION ? 1 : 2;
            ok = read_values(o, kind);
        } else if (c[0] == 'f' && is_blank(c[1])) {
            o->cursor++;
            ok = read_face(o);
        }
        if (!ok)
            return false;
        skip_line(o);
    }
    return true;
}

/* Checks what could only be known at the end. */
static bool check(struct obj *o)
{
    const struct promise *broken = NULL;
    int of = 0;
    for (int k = 0; k < KINDS; k++)
        for (size_t i = 0; i < o->npromise[k]; i++)
            if (o->promise[k][i].index >= o->count[k]) {
                if (!broken || o->promise[k][i].line < broken->line) {
                    broken = &o->promise[k][i];
                    of = k;
                }
                break;
            }
    if (broken)
        return dph_fail(o->err, DPH_ERROR_INPUT, "%s:%zu: face refers to %s %zu, the %s %zu",
                        o->path, broken->line, kind_name[of], broken->index + 1,
                        of == POSITION ? "mesh has" : "file has", o->count[of]);
    if (o->nface == 0)
        return fail(o, DPH_ERROR_INPUT, "the file ends without a face", NULL);
    return true;
}

/* Tells the user that what the file has of a kind was not used. */
static void warn_dropped(const struct obj *o, int kind, struct dph_scene *warn)
{
    if (warn && o->missing[kind] && o->count[kind])
        dph_scene_warn(warn, "%s: the %ss are not used: %s", o->path, kind_name[kind],
                       kind == NORMAL ? "a corner has none, or one has no length; new ones are made"
                                      : "a corner has none");
}

/* Normals to unit length; a normal without length makes them all useless. */
static void normalize(struct obj *o)
{
    for (size_t i = 0; i < o->count[NORMAL]; i++) {
        float *n = o->value[NORMAL] + 3 * i;
        double size = sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
        if (size == 0) {
            o->missing[NORMAL] = true;
            return;
        }
        for (int k = 0; k < 3 && fabs(size - 1) >= 1e-6;
             k++) /* what is unit length stays as it is */
            n[k] = (float)(n[k] / size);
    }
}

static uint64_t hash_corner(const uint32_t corner[KINDS])
{
    uint64_t h = (corner[0] | (uint64_t)corner[1] << 32) * UINT64_C(0x9e3779b97f4a7c15);
    h ^= h >> 32;
    h = (h ^ corner[2]) * UINT64_C(0x6a09e667f3bcc909);
    return h ^ h >> 29;
}

/* Numbers the distinct corners in order of appearance; `first` receives the first corner of each.
 * Both have ncorner elements. Returns their count, 0: out of memory. */
static size_t number_corners(const struct obj *o, uint32_t *vertex_of, size_t *first)
{
    size_t capacity = 1024;
    while (capacity < o->ncorner + o->ncorner / 2)
        capacity *= 2;
    uint32_t *slot = dph_alloc(capacity, sizeof *slot);
    if (!slot)
        return 0;
    memset(slot, 0xff, capacity * sizeof *slot);
    size_t count = 0;
    for (size_t i = 0; i < o->ncorner; i++) {
        size_t s = hash_corner(o->corner[i]) & (capacity - 1);
        while (slot[s] != NONE &&
               memcmp(o->corner[first[slot[s]]], o->corner[i], sizeof *o->corner) != 0)
            s = (s + 1) & (capacity - 1);
        if (slot[s] == NONE) {
            slot[s] = (uint32_t)count;
            first[count++] = i;
        }
        vertex_of[i] = slot[s];
    }
    free(slot);
    return count;
}

/* Cuts the faces into triangles; `vertex_of` is NULL where vertices are the file's positions. */
static bool fill_triangles(const struct obj *o, const uint32_t *vertex_of, struct dph_mesh *mesh)
{
    struct dph_polygon_work work = {0};
    uint32_t *out = mesh->index;
    size_t corner = 0;
    for (size_t f = 0; f < o->nface; corner += o->face[f++]) {
        size_t n = o->face[f];
        if (!dph_polygon_split(o->value[POSITION], o->corner[corner], KINDS, n, out, &work)) {
            dph_polygon_finish(&work);
            return dph_fail_memory(o->err);
        }
        for (size_t i = 0; i < 3 * (n - 2); i++, out++)
            *out = vertex_of ? vertex_of[corner + *out] : o->corner[corner + *out][POSITION];
    }
    dph_polygon_finish(&work);
    return true;
}

static void fill_vertex(const struct obj *o, const uint32_t corner[KINDS], size_t v,
                        struct dph_mesh *mesh)
{
    memcpy(mesh->position + 3 * v, o->value[POSITION] + 3 * (size_t)corner[POSITION],
           3 * sizeof(float));
    if (mesh->texcoord) {
        const float *t = o->value[TEXCOORD] + 2 * (size_t)corner[TEXCOORD];
        mesh->texcoord[2 * v] = t[0];
        mesh->texcoord[2 * v + 1] = 1 - t[1];
    }
    if (mesh->normal)
        memcpy(mesh->normal + 3 * v, o->value[NORMAL] + 3 * (size_t)corner[NORMAL],
               3 * sizeof(float));
}

static bool build(struct obj *o, struct dph_mesh *mesh, struct dph_scene *warn)
{
    bool ok = false;
    uint32_t *vertex_of = NULL;
    size_t *first = NULL;
    normalize(o);
    warn_dropped(o, TEXCOORD, warn);
    warn_dropped(o, NORMAL, warn);
    for (size_t i = 0; i < o->ncorner; i++)
        for (int k = TEXCOORD; k < KINDS; k++)
            if (o->missing[k])
                o->corner[i][k] = NONE;
    bool normal = !o->missing[NORMAL], texcoord = !o->missing[TEXCOORD];
    if (!normal && !texcoord) {
        if (!dph_mesh_init(mesh, o->count[POSITION], o->ntri, false, false, o->err))
            return false;
        memcpy(mesh->position, o->value[POSITION], o->count[POSITION] * 3 * sizeof(float));
        ok = fill_triangles(o, NULL, mesh);
        goto error;
    }
    if (o->ncorner >= NONE) {
        fail(o, DPH_ERROR_LIMIT, "more than 4294967294 corners", NULL);
        goto error;
    }
    vertex_of = dph_alloc(o->ncorner, sizeof *vertex_of);
    first = dph_alloc(o->ncorner, sizeof *first);
    size_t nvert = vertex_of && first ? number_corners(o, vertex_of, first) : 0;
    if (!nvert) {
        dph_fail_memory(o->err);
        goto error;
    }
    if (!dph_mesh_init(mesh, nvert, o->ntri, normal, texcoord, o->err))
        goto error;
    for (size_t v = 0; v < nvert; v++)
        fill_vertex(o, o->corner[first[v]], v, mesh);
    ok = fill_triangles(o, vertex_of, mesh);
error:
    free(vertex_of);
    free(first);
    return ok;
}

bool dph_read_obj(struct dph_mesh *mesh, const struct dph_file *file, const char *path,
                  struct dph_scene *warn, struct dph_error *err)
{
    memset(mesh, 0, sizeof *mesh);
    struct obj o = {.path = path, .cursor = (const char *)file->data, .line = 1, .err = err};
    o.end = o.cursor + file->size;
    bool ok = read_lines(&o) && check(&o) && build(&o, mesh, warn);
    for (int k = 0; k < KINDS; k++) {
        free(o.value[k]);
        free(o.promise[k]);
    }
    free(o.corner);
    free(o.face);
    if (!ok)
        dph_mesh_finish(mesh);
    return ok;
}
