/* Meshes with closed forms, and numbers to test with.      Tests only. */
#ifndef DPH_TESTS_SHAPES_H
#define DPH_TESTS_SHAPES_H

#include <diaphan/mesh.h>

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sanitizers slow long loops down tenfold, and look for other mistakes than these loops do. */
#if defined(__SANITIZE_ADDRESS__)
#define UNDER_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define UNDER_SANITIZER 1
#endif
#endif
#ifndef UNDER_SANITIZER
#define UNDER_SANITIZER 0
#endif

static const double PI = 3.14159265358979323846;

/* The same numbers everywhere, evenly in [0, 1). */
static inline double next_random(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / 9007199254740992.0;
}

static inline void random_direction(uint64_t *seed, double d[3])
{
    double z = 2 * next_random(seed) - 1, a = 2 * PI * next_random(seed), r = sqrt(1 - z * z);
    d[0] = r * cos(a);
    d[1] = r * sin(a);
    d[2] = z;
}

/* Adds a vertex or a triangle to a mesh with room for them. */
static inline uint32_t add_vertex(struct dph_mesh *mesh, double x, double y, double z)
{
    float *p = mesh->position + 3 * mesh->nvert;
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
    return (uint32_t)mesh->nvert++;
}

static inline void add_triangle(struct dph_mesh *mesh, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *i = mesh->index + 3 * mesh->ntri++;
    i[0] = a, i[1] = b, i[2] = c;
}

/* An empty mesh with room. */
static inline struct dph_mesh make_room(size_t nvert, size_t ntri)
{
    struct dph_mesh mesh;
    bool ok = dph_mesh_init(&mesh, nvert, ntri, false, false, NULL);
    assert(ok);
    (void)ok;
    mesh.nvert = mesh.ntri = 0;
    return mesh;
}

/* The box from 0 to (x, y, z), every face n x n squares; vertices on edges of faces are
 * repeated. */
static inline struct dph_mesh make_box(double x, double y, double z, uint32_t n)
{
    struct dph_mesh mesh = make_room(6 * (size_t)(n + 1) * (n + 1), 12 * (size_t)n * n);
    const double size[3] = {x, y, z};
    for (int face = 0; face < 6; face++) {
        int w = face / 2, u = (w + 1) % 3, v = (w + 2) % 3;
        uint32_t base = (uint32_t)mesh.nvert;
        for (uint32_t j = 0; j <= n; j++)
            for (uint32_t i = 0; i <= n; i++) {
                double p[3];
                p[u] = size[u] * i / n, p[v] = size[v] * j / n, p[w] = face & 1 ? size[w] : 0;
                add_vertex(&mesh, p[0], p[1], p[2]);
            }
        for (uint32_t j = 0; j < n; j++)
            for (uint32_t i = 0; i < n; i++) {
                uint32_t a = base + j * (n + 1) + i, b = a + 1, c = a + n + 2, d = a + n + 1;
                if (face & 1)
                    add_triangle(&mesh, a, b, c), add_triangle(&mesh, a, c, d);
                else
                    add_triangle(&mesh, a, c, b), add_triangle(&mesh, a, d, c);
            }
    }
    return mesh;
}

/* A sphere of latitudes and longitudes around the origin, z its axis; inward: seen as a cavity.
 * Added to `mesh`, which has room for (rings - 1) * segments + 2 vertices and 2 * segments *
 * (rings - 1) triangles. */
static inline void add_sphere(struct dph_mesh *mesh, double radius, uint32_t segments, uint32_t rings,
                              bool inward)
{
    size_t first = mesh->ntri;
    uint32_t top = add_vertex(mesh, 0, 0, radius), base = (uint32_t)mesh->nvert;
    for (uint32_t r = 1; r < rings; r++)
        for (uint32_t s = 0; s < segments; s++) {
            double t = PI * r / rings, a = 2 * PI * s / segments;
            add_vertex(mesh, radius * sin(t) * cos(a), radius * sin(t) * sin(a), radius * cos(t));
        }
    uint32_t bottom = add_vertex(mesh, 0, 0, -radius);
    for (uint32_t s = 0; s < segments; s++) {
        uint32_t n = (s + 1) % segments;
        add_triangle(mesh, top, base + s, base + n);
        for (uint32_t r = 0; r + 2 < rings; r++) {
            uint32_t a = base + r * segments + s, b = base + r * segments + n;
            add_triangle(mesh, a, a + segments, b + segments);
            add_triangle(mesh, a, b + segments, b);
        }
        uint32_t last = base + (rings - 2) * segments;
        add_triangle(mesh, bottom, last + n, last + s);
    }
    for (size_t t = first; inward && t < mesh->ntri; t++) {
        uint32_t swap = mesh->index[3 * t];
        mesh->index[3 * t] = mesh->index[3 * t + 1];
        mesh->index[3 * t + 1] = swap;
    }
}

static inline struct dph_mesh make_sphere(double radius, uint32_t segments, uint32_t rings)
{
    struct dph_mesh mesh = make_room((size_t)(rings - 1) * segments + 2, 2 * (size_t)segments * (rings - 1));
    add_sphere(&mesh, radius, segments, rings, false);
    return mesh;
}

/* A capped cylinder along z, from 0 to `height`. */
static inline struct dph_mesh make_cylinder(double radius, double height, uint32_t segments, uint32_t rings)
{
    struct dph_mesh mesh = make_room((size_t)(rings + 1) * segments + 2, 2 * (size_t)segments * (rings + 1));
    uint32_t bottom = add_vertex(&mesh, 0, 0, 0), top = add_vertex(&mesh, 0, 0, height);
    for (uint32_t r = 0; r <= rings; r++)
        for (uint32_t s = 0; s < segments; s++)
            add_vertex(&mesh, radius * cos(2 * PI * s / segments), radius * sin(2 * PI * s / segments),
                       height * r / rings);
    for (uint32_t s = 0; s < segments; s++) {
        uint32_t n = (s + 1) % segments;
        add_triangle(&mesh, bottom, 2 + n, 2 + s);
        for (uint32_t r = 0; r < rings; r++) {
            uint32_t a = 2 + r * segments + s, b = 2 + r * segments + n;
            add_triangle(&mesh, a, b, b + segments);
            add_triangle(&mesh, a, b + segments, a + segments);
        }
        add_triangle(&mesh, top, 2 + rings * segments + s, 2 + rings * segments + n);
    }
    return mesh;
}

/* Turns all positions by a rotation (rows). */
static inline void rotate_mesh(struct dph_mesh *mesh, double r[3][3])
{
    for (size_t v = 0; v < mesh->nvert; v++) {
        float *p = mesh->position + 3 * v;
        const double q[3] = {p[0], p[1], p[2]};
        for (int k = 0; k < 3; k++)
            p[k] = (float)(r[k][0] * q[0] + r[k][1] * q[1] + r[k][2] * q[2]);
    }
}

/* A rotation about an axis that is none of the coordinate axes. */
static inline void some_rotation(double r[3][3])
{
    const double axis[3] = {2.0 / 7, 3.0 / 7, 6.0 / 7}, c = cos(1.1), s = sin(1.1);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            r[i][j] = axis[i] * axis[j] * (1 - c) + (i == j ? c : 0);
    for (int k = 0; k < 3; k++) {
        r[(k + 1) % 3][(k + 2) % 3] -= s * axis[k];
        r[(k + 2) % 3][(k + 1) % 3] += s * axis[k];
    }
}

#endif
