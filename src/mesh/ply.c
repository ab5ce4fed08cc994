/* PLY, the polygon file format of the Stanford 3D Scanning Repository (G. Turk 1994): ascii and
 * both binary orders.
 *
 * The header describes elements, rows of typed properties and lists; whatever is not needed is
 * stepped over by that description. Needed are x, y, z of `vertex`, and the list vertex_indices
 * (or vertex_index) of `face` or of `tristrips`, whose strips -1 parts. Taken where they are
 * complete: nx, ny, nz and a pair of texture coordinates, whose second one counts upward here and
 * downward in the library. Elements may come in any order: polygons are kept as lists of corners
 * and cut when all is read.
 *
 * No count is believed before the bytes that are left could hold that many rows. */
#include "mesh/readers.h"

#include "core/fail.h"
#include "core/memory.h"
#include "mesh/polygon.h"
#include "mesh/scan.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNT_LIMIT ((size_t)1 << 31)

enum type { INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64, TYPES, NO_LIST = TYPES };

static const int type_size[TYPES] = {1, 1, 2, 2, 4, 4, 4, 8};

static const struct {
    const char *name;
    enum type type;
} type_name[] = {
    {"char", INT8},     {"int8", INT8},       {"uchar", UINT8},    {"uint8", UINT8},
    {"short", INT16},   {"int16", INT16},     {"ushort", UINT16},  {"uint16", UINT16},
    {"int", INT32},     {"int32", INT32},     {"uint", UINT32},    {"uint32", UINT32},
    {"float", FLOAT32}, {"float32", FLOAT32}, {"double", FLOAT64}, {"float64", FLOAT64},
};

/* What a property of a vertex is good for. */
enum role { X, Y, Z, NX, NY, NZ, U, V, ROLES, UNUSED = ROLES };

static const struct {
    const char *name;
    enum role role;
} role_name[] = {
    {"x", X},         {"y", Y},         {"z", Z},         {"nx", NX},       {"ny", NY},
    {"nz", NZ},       {"s", U},         {"t", V},         {"u", U},         {"v", V},
    {"texture_u", U}, {"texture_v", V}, {"texture_s", U}, {"texture_t", V},
};

struct word {
    const char *text;
    size_t size;
};

struct property {
    struct word name;
    enum type type;
    enum type count_type; /* of a list; NO_LIST: one value */
    enum role role;
};

struct element {
    struct word name;
    uint64_t count;
    size_t first, nproperty; /* into the properties */
};

struct ply {
    const char *path;
    const char *begin, *cursor, *end;
    size_t line; /* 0: in binary data */
    bool ascii, swapped;
    struct element *element;
    size_t nelement, element_capacity;
    struct property *property;
    size_t nproperty, property_capacity;
    size_t nvert;
    uint32_t *corner; /* (ncorner) of all polygons */
    size_t ncorner, corner_capacity;
    uint32_t *face; /* (nface) corners of each */
    size_t nface, face_capacity;
    size_t ntri;
    struct dph_scene *warn; /* Nullable */
    struct dph_error *err;
};

/* Fails at the line or byte in hand. */
__attribute__((format(printf, 3, 4))) static bool fail(struct ply *p, enum dph_code code,
                                                       const char *format, ...)
{
    char what[256];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    if (p->line)
        return dph_fail(p->err, code, "%s:%zu: %s", p->path, p->line, what);
    return dph_fail(p->err, code, "%s: byte %zu: %s", p->path, (size_t)(p->cursor - p->begin),
                    what);
}

static bool is(struct word word, const char *text)
{
    return word.size == strlen(text) && memcmp(word.text, text, word.size) == 0;
}

/* A word as a printf argument pair for %.*s; names of hostile files may be long. */
#define SHOW(word) (int)((word).size < 40 ? (word).size : 40), (word).text

/* The next word of the header line that ends at `end`; empty where there is none. */
static struct word next_word(const char **cursor, const char *end)
{
    while (*cursor < end && (**cursor == ' ' || **cursor == '\t'))
        ++*cursor;
    struct word word = {*cursor, 0};
    while (*cursor < end && **cursor != ' ' && **cursor != '\t')
        ++*cursor;
    word.size = (size_t)(*cursor - word.text);
    return word;
}

static bool find_type(struct ply *p, struct word word, enum type *type)
{
    for (size_t i = 0; i < sizeof type_name / sizeof *type_name; i++)
        if (is(word, type_name[i].name)) {
            *type = type_name[i].type;
            return true;
        }
    return fail(p, DPH_ERROR_INPUT, "\"%.*s\" is no type", SHOW(word));
}

static bool read_element(struct ply *p, const char *c, const char *end)
{
    struct element element = {.name = next_word(&c, end), .first = p->nproperty};
    struct word number = next_word(&c, end);
    int64_t count = -1;
    const char *after = number.size ? dph_scan_integer(number.text, &count) : NULL;
    if (!after || after != number.text + number.size || count < 0)
        return fail(p, DPH_ERROR_INPUT, "element \"%.*s\" has no count, but \"%.*s\"",
                    SHOW(element.name), SHOW(number));
    for (size_t i = 0; i < p->nelement; i++)
        if (p->element[i].name.size == element.name.size &&
            memcmp(p->element[i].name.text, element.name.text, element.name.size) == 0)
            return fail(p, DPH_ERROR_INPUT, "element \"%.*s\" comes twice", SHOW(element.name));
    element.count = (uint64_t)count;
    if (p->nelement == 256) /* the comparison above is quadratic */
        return fail(p, DPH_ERROR_LIMIT, "more than 256 elements");
    struct element *room = dph_grow(p->element, p->nelement, &p->element_capacity, sizeof *room);
    if (!room)
        return dph_fail_memory(p->err);
    p->element = room;
    p->element[p->nelement++] = element;
    return true;
}

static bool read_property(struct ply *p, const char *c, const char *end)
{
    if (p->nelement == 0)
        return fail(p, DPH_ERROR_INPUT, "a property before the first element");
    struct property property = {.count_type = NO_LIST, .role = UNUSED};
    struct word word = next_word(&c, end);
    if (is(word, "list")) {
        if (!find_type(p, next_word(&c, end), &property.count_type))
            return false;
        if (property.count_type >= FLOAT32)
            return fail(p, DPH_ERROR_INPUT, "the length of a list cannot be a float");
        word = next_word(&c, end);
    }
    if (!find_type(p, word, &property.type))
        return false;
    property.name = next_word(&c, end);
    if (!property.name.size)
        return fail(p, DPH_ERROR_INPUT, "a property without a name");
    if (property.count_type == NO_LIST)
        for (size_t i = 0; i < sizeof role_name / sizeof *role_name; i++)
            if (is(property.name, role_name[i].name))
                property.role = role_name[i].role;
    struct property *room =
        dph_grow(p->property, p->nproperty, &p->property_capacity, sizeof *room);
    if (!room)
        return dph_fail_memory(p->err);
    p->property = room;
    p->property[p->nproperty++] = property;
    p->element[p->nelement - 1].nproperty++;
    return true;
}

static bool read_format(struct ply *p, const char *c, const char *end)
{
    const uint16_t one = 1;
    bool little_here = *(const unsigned char *)&one == 1;
    struct word format = next_word(&c, end), version = next_word(&c, end);
    p->ascii = is(format, "ascii");
    bool little = is(format, "binary_little_endian"), big = is(format, "binary_big_endian");
    if (!p->ascii && !little && !big)
        return fail(p, DPH_ERROR_INPUT, "\"%.*s\" is no format", SHOW(format));
    if (!is(version, "1.0"))
        return fail(p, DPH_ERROR_UNSUPPORTED, "version \"%.*s\", only 1.0 is known", SHOW(version));
    p->swapped = little != little_here;
    return true;
}

static bool read_header(struct ply *p)
{
    bool old_mac = false, formatted = false;
    for (p->line = 1;; p->line++) {
        const char *start = p->cursor, *end = start;
        while (end < p->end && *end != '\n' && *end != '\r')
            end++;
        if (end == p->end && !(end - start == 10 && memcmp(start, "end_header", 10) == 0))
            return fail(p, DPH_ERROR_INPUT, "the file ends inside its header");
        p->cursor = end < p->end ? end + 1 : end;
        if (p->line == 1)
            old_mac = *end == '\r' && p->cursor < p->end && *p->cursor != '\n';
        if (*end == '\r' && !old_mac && p->cursor < p->end && *p->cursor == '\n')
            p->cursor++;
        const char *c = start;
        struct word key = next_word(&c, end);
        bool ok = true;
        if (p->line == 1)
            ok = is(key, "ply") || fail(p, DPH_ERROR_INPUT, "the file does not begin with \"ply\"");
        else if (is(key, "format"))
            ok = formatted = read_format(p, c, end);
        else if (is(key, "element"))
            ok = read_element(p, c, end);
        else if (is(key, "property"))
            ok = read_property(p, c, end);
        else if (is(key, "end_header"))
            break;
        else if (key.size && !is(key, "comment") && !is(key, "obj_info"))
            ok = fail(p, DPH_ERROR_INPUT, "\"%.*s\" is no word of a header", SHOW(key));
        if (!ok)
            return false;
    }
    if (!formatted)
        return fail(p, DPH_ERROR_INPUT, "the header names no format");
    p->line = p->ascii ? p->line + 1 : 0;
    return true;
}

/* Goes to the next word of ascii data. */
static bool find_text(struct ply *p)
{
    const char *c = p->cursor;
    for (; c < p->end && (*c == ' ' || *c == '\t' || *c == '\n' || *c == '\r'); c++)
        p->line += *c == '\n' || (*c == '\r' && c[1] != '\n');
    p->cursor = c;
    return c < p->end || fail(p, DPH_ERROR_INPUT, "the file ends where a number should follow");
}

static bool take_text(struct ply *p, const char *after)
{
    if (!after || (after < p->end && (unsigned char)*after > ' '))
        return fail(p, DPH_ERROR_INPUT, "\"%s\" is not a number",
                    dph_scan_word(p->cursor, p->end).text);
    p->cursor = after;
    return true;
}

/* Reads one value; every type but one fits a double, and a float64 is wanted as float only. */
static bool read_value(struct ply *p, enum type type, double *value)
{
    if (p->ascii) {
        if (!find_text(p))
            return false;
        if (type >= FLOAT32) {
            float number = 0;
            const char *after = dph_scan_float(p->cursor, &number);
            *value = number;
            return take_text(p, after);
        }
        int64_t number = 0;
        const char *after = dph_scan_integer(p->cursor, &number);
        *value = (double)number;
        return take_text(p, after);
    }
    size_t size = (size_t)type_size[type];
    if ((size_t)(p->end - p->cursor) < size)
        return fail(p, DPH_ERROR_INPUT, "the file ends inside its data");
    unsigned char bytes[8];
    for (size_t i = 0; i < size; i++)
        bytes[i] = (unsigned char)p->cursor[p->swapped ? size - 1 - i : i];
    p->cursor += size;
    int16_t i16;
    uint16_t u16;
    int32_t i32;
    uint32_t u32;
    float f32;
    switch (type) {
    case INT8: *value = (signed char)bytes[0]; break;
    case UINT8: *value = bytes[0]; break;
    case INT16: memcpy(&i16, bytes, 2), *value = i16; break;
    case UINT16: memcpy(&u16, bytes, 2), *value = u16; break;
    case INT32: memcpy(&i32, bytes, 4), *value = i32; break;
    case UINT32: memcpy(&u32, bytes, 4), *value = u32; break;
    case FLOAT32: memcpy(&f32, bytes, 4), *value = f32; break;
    default: memcpy(value, bytes, 8); break;
    }
    return true;
}

/* Reads the length of a list and sees that the bytes that are left could hold it. */
static bool read_length(struct ply *p, const struct property *property, uint32_t *length)
{
    double value;
    if (!read_value(p, property->count_type, &value))
        return false;
    size_t item = p->ascii ? 2 : (size_t)type_size[property->type];
    if (value < 0 || value > (double)((size_t)(p->end - p->cursor) + 1) / (double)item ||
        value > (double)COUNT_LIMIT)
        return fail(p, DPH_ERROR_INPUT,
                    "a list of %.0f numbers does not fit in the %zu bytes that are left", value,
                    (size_t)(p->end - p->cursor));
    *length = (uint32_t)value;
    return true;
}

static bool skip_property(struct ply *p, const struct property *property)
{
    double value;
    uint32_t n = 1;
    if (property->count_type != NO_LIST && !read_length(p, property, &n))
        return false;
    while (n-- > 0)
        if (!read_value(p, property->type, &value))
            return false;
    return true;
}

/* Sees that the bytes that are left could hold the rows of an element. */
static bool check_rows(struct ply *p, const struct element *element)
{
    uint64_t bytes = 0, left = (uint64_t)(p->end - p->cursor);
    for (size_t i = 0; i < element->nproperty; i++) {
        const struct property *property = &p->property[element->first + i];
        enum type first = property->count_type != NO_LIST ? property->count_type : property->type;
        bytes += p->ascii ? 2 : (uint64_t)type_size[first];
    }
    left += p->ascii; /* the last number needs no blank */
    if (bytes && element->count > left / bytes)
        return fail(p, DPH_ERROR_INPUT,
                    "%llu rows of \"%.*s\" do not fit in the %llu bytes that are left",
                    (unsigned long long)element->count, SHOW(element->name),
                    (unsigned long long)(p->end - p->cursor));
    return true;
}

static bool skip_element(struct ply *p, const struct element *element)
{
    for (uint64_t row = 0; element->nproperty && row < element->count; row++)
        for (size_t i = 0; i < element->nproperty; i++)
            if (!skip_property(p, &p->property[element->first + i]))
                return false;
    return true;
}

static bool read_vertices(struct ply *p, const struct element *element, struct dph_mesh *mesh)
{
    bool normal = mesh->normal != NULL;
    for (size_t v = 0; v < mesh->nvert; v++) {
        float value[ROLES] = {0};
        for (size_t i = 0; i < element->nproperty; i++) {
            const struct property *property = &p->property[element->first + i];
            if (property->role == UNUSED) {
                if (!skip_property(p, property))
                    return false;
                continue;
            }
            const char *start = p->cursor;
            double number;
            if (!read_value(p, property->type, &number))
                return false;
            if (!(fabs(number) <= (double)FLT_MAX)) {
                p->cursor = p->ascii ? p->cursor : start;
                return fail(p, DPH_ERROR_INPUT,
                            "vertex %zu has the %.*s %g, which no float can hold", v,
                            SHOW(property->name), number);
            }
            value[property->role] = (float)number;
        }
        memcpy(mesh->position + 3 * v, value, 3 * sizeof(float));
        if (mesh->texcoord) {
            mesh->texcoord[2 * v] = value[U];
            mesh->texcoord[2 * v + 1] = 1 - value[V];
        }
        if (mesh->normal) {
            double n[3] = {value[NX], value[NY], value[NZ]};
            double size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            normal &= size > 0;
            for (int k = 0; k < 3; k++)
                mesh->normal[3 * v + k] =
                    (float)(fabs(size - 1) < 1e-6 || size == 0 ? n[k] : n[k] / size);
        }
    }
    if (mesh->normal && !normal) { /* one without length makes them all useless */
        if (p->warn)
            dph_scene_warn(p->warn,
                           "%s: the normals are not used: one has no length; new ones are made",
                           p->path);
        free(mesh->normal);
        mesh->normal = NULL;
    }
    return true;
}

static bool add_corner(struct ply *p, uint32_t vertex)
{
    uint32_t *room = dph_grow(p->corner, p->ncorner, &p->corner_capacity, sizeof *room);
    if (!room)
        return dph_fail_memory(p->err);
    p->corner = room;
    p->corner[p->ncorner++] = vertex;
    return true;
}

static bool add_face(struct ply *p, uint32_t ncorner)
{
    p->ntri += ncorner - 2;
    if (p->ntri > COUNT_LIMIT)
        return fail(p, DPH_ERROR_LIMIT, "more than 2147483648 triangles");
    uint32_t *room = dph_grow(p->face, p->nface, &p->face_capacity, sizeof *room);
    if (!room)
        return dph_fail_memory(p->err);
    p->face = room;
    p->face[p->nface++] = ncorner;
    return true;
}

/* Reads the number of a vertex; `least` is -1 where that is allowed. */
static bool read_index(struct ply *p, enum type type, size_t row, int least, double *index)
{
    const char *start = p->cursor;
    if (!read_value(p, type, index))
        return false;
    if (*index < least || *index >= (double)p->nvert) {
        p->cursor = p->ascii ? p->cursor : start;
        return fail(p, DPH_ERROR_INPUT, "face %zu refers to vertex %.0f, the mesh has %zu", row,
                    *index, p->nvert);
    }
    return true;
}

static bool read_polygon(struct ply *p, const struct property *property, size_t row)
{
    uint32_t n;
    const char *start = p->cursor;
    if (!read_length(p, property, &n))
        return false;
    if (n < 3) {
        p->cursor = p->ascii ? p->cursor : start;
        return fail(p, DPH_ERROR_INPUT, "face %zu has %u corners, needs 3", row, n);
    }
    for (uint32_t i = 0; i < n; i++) {
        double index;
        if (!read_index(p, property->type, row, 0, &index) || !add_corner(p, (uint32_t)index))
            return false;
    }
    return add_face(p, n);
}

/* A strip of triangles; every second one runs the other way, and those that only turn a corner
 * have two equal vertices. */
static bool read_strip(struct ply *p, const struct property *property, size_t row)
{
    uint32_t n, held = 0, last[2] = {0, 0};
    if (!read_length(p, property, &n))
        return false;
    for (uint32_t i = 0; i < n; i++) {
        double number;
        if (!read_index(p, property->type, row, -1, &number))
            return false;
        if (number < 0) {
            held = 0;
            continue;
        }
        uint32_t index = (uint32_t)number;
        if (held >= 2 && last[0] != last[1] && last[0] != index && last[1] != index) {
            bool odd = held & 1;
            if (!add_corner(p, last[odd]) || !add_corner(p, last[!odd]) || !add_corner(p, index) ||
                !add_face(p, 3))
                return false;
        }
        last[0] = last[1];
        last[1] = index;
        held++;
    }
    return true;
}

static bool is_index_list(const struct property *property)
{
    return property->count_type != NO_LIST &&
           (is(property->name, "vertex_indices") || is(property->name, "vertex_index"));
}

/* Reads `face` or `tristrips`. */
static bool read_faces(struct ply *p, const struct element *element, bool strips)
{
    const struct property *property = p->property + element->first;
    size_t list = 0;
    while (list < element->nproperty && !is_index_list(&property[list]))
        list++;
    if (list == element->nproperty)
        return element->count == 0 ||
               fail(p, DPH_ERROR_INPUT, "element \"%.*s\" has no list vertex_indices",
                    SHOW(element->name));
    if (property[list].type >= FLOAT32)
        return fail(p, DPH_ERROR_INPUT, "the numbers of vertices in \"%.*s\" are floats",
                    SHOW(element->name));
    for (uint64_t row = 0; row < element->count; row++)
        for (size_t i = 0; i < element->nproperty; i++) {
            bool ok = i != list ? skip_property(p, &property[i])
                      : strips  ? read_strip(p, &property[i], (size_t)row)
                                : read_polygon(p, &property[i], (size_t)row);
            if (!ok)
                return false;
        }
    return true;
}

/* Makes room for the vertices that the header promises. */
static bool prepare_vertices(struct ply *p, const struct element *element, struct dph_mesh *mesh)
{
    bool has[ROLES + 1] = {false};
    for (size_t i = 0; i < element->nproperty; i++)
        has[p->property[element->first + i].role] = true;
    if (!has[X] || !has[Y] || !has[Z])
        return fail(p, DPH_ERROR_INPUT, "the vertices have no %s",
                    !has[X]   ? "x"
                    : !has[Y] ? "y"
                              : "z");
    if (!check_rows(p, element))
        return false;
    if (p->nvert > COUNT_LIMIT)
        return fail(p, DPH_ERROR_LIMIT, "more than 2147483648 vertices");
    return dph_mesh_init(mesh, p->nvert, 0, has[NX] && has[NY] && has[NZ], has[U] && has[V],
                         p->err);
}

/* Cuts the polygons. */
static bool fill_triangles(struct ply *p, struct dph_mesh *mesh)
{
    uint32_t *out = dph_alloc(p->ntri, 3 * sizeof *out);
    if (!out)
        return dph_fail_memory(p->err);
    free(mesh->index);
    mesh->index = out;
    mesh->ntri = p->ntri;
    struct dph_polygon_work work = {0};
    bool ok = true;
    const uint32_t *corner = p->corner;
    for (size_t f = 0; ok && f < p->nface; f++) {
        size_t n = p->face[f];
        ok = dph_polygon_split(mesh->position, corner, 1, n, out, &work) || dph_fail_memory(p->err);
        for (size_t i = 0; ok && i < 3 * (n - 2); i++, out++)
            *out = corner[*out];
        corner += n;
    }
    dph_polygon_finish(&work);
    return ok;
}

static bool read_data(struct ply *p, struct dph_mesh *mesh)
{
    const struct element *vertices = NULL;
    for (size_t i = 0; i < p->nelement; i++)
        if (is(p->element[i].name, "vertex"))
            vertices = &p->element[i];
    if (!vertices)
        return fail(p, DPH_ERROR_INPUT, "the header has no element \"vertex\"");
    p->nvert = vertices->count < SIZE_MAX ? (size_t)vertices->count : SIZE_MAX;
    if (!prepare_vertices(p, vertices, mesh))
        return false;
    for (size_t i = 0; i < p->nelement; i++) {
        const struct element *element = &p->element[i];
        bool face = is(element->name, "face"), strips = is(element->name, "tristrips");
        if (!check_rows(p, element))
            return false;
        bool ok = element == vertices ? read_vertices(p, element, mesh)
                  : face || strips    ? read_faces(p, element, strips)
                                      : skip_element(p, element);
        if (!ok)
            return false;
    }
    if (p->ntri == 0)
        return fail(p, DPH_ERROR_INPUT, "the file ends without a triangle");
    return fill_triangles(p, mesh);
}

bool dph_read_ply(struct dph_mesh *mesh, const struct dph_file *file, const char *path,
                  struct dph_scene *warn, struct dph_error *err)
{
    memset(mesh, 0, sizeof *mesh);
    struct ply p = {.path = path, .begin = (const char *)file->data, .warn = warn, .err = err};
    p.cursor = p.begin;
    p.end = p.begin + file->size;
    bool ok = read_header(&p) && read_data(&p, mesh);
    free(p.element);
    free(p.property);
    free(p.corner);
    free(p.face);
    if (!ok)
        dph_mesh_finish(mesh);
    return ok;
}
