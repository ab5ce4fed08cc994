/* Vertex normals from triangles.
 *
 * A face counts with the angle that it has at the vertex (G. Thuermer, C. A. Wuethrich, "Computing
 * vertex normals from polygonal facets", Journal of Graphics Tools 3(1), 1998), so that the result
 * does not depend on how a flat part is cut into triangles.
 *
 * With a crease, the corners around a position are split into fans: two corners belong to one fan
 * where their triangles share an edge at that position and their face normals differ by no more
 * than the crease angle. Each fan gets a normal of its own, and a vertex that appears in several
 * fans becomes several vertices.
 *
 * Everything is computed in double from the differences of float coordinates, which neither
 * overflows nor underflows at any scale that float has. Only + - * / and the square root are used,
 * so that every processor and C library gives the same bytes. */
#include <diaphan/mesh.h>

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A triangle whose height is less than this share of its longest side has no direction worth
 * having. */
#define FLATNESS 1e-10

/* A sum of weighted normals that is shorter than this (radians) is what rounding leaves of faces
 * that cancel. */
#define CANCELLED 1e-6

/* atan of 0 <= t <= 1 by its power series, after atan t = pi/4 + atan((t - 1) / (t + 1)) has
 * brought |t| below tan(pi/8), where twelve terms leave less than 1e-11. */
static double arc_tangent(double t)
{
    const double quarter_pi = 0.78539816339744830962;
    double base = 0;
    if (t > 0.41421356237309504880) {
        base = quarter_pi;
        t = (t - 1) / (t + 1);
    }
    double square = t * t, sum = 0;
    for (int k = 23; k >= 1; k -= 2)
        sum = 1.0 / k - square * sum;
    return base + t * sum;
}

/* The angle in 0..pi whose sine and cosine are in the ratio of s >= 0 to c. */
static double angle_of(double s, double c)
{
    const double half_pi = 1.57079632679489661923;
    double size = fabs(c);
    double angle = s <= size ? arc_tangent(s / size) : half_pi - arc_tangent(size / s);
    return c < 0 ? 2 * half_pi - angle : angle;
}

/* A triangle's sides, k from corner k to the next; its normal, whose length is twice the area;
 * returns that length, or 0 for a triangle that has no area to speak of. */
static double sides_of(const float *p[3], double side[3][3], double normal[3])
{
    double longest = 0;
    for (int k = 0; k < 3; k++) {
        double square = 0;
        for (int a = 0; a < 3; a++) {
            side[k][a] = (double)p[k == 2 ? 0 : k + 1][a] - p[k][a];
            square += side[k][a] * side[k][a];
        }
        longest = square > longest ? square : longest;
    }
    const double *u = side[0], *v = side[1];
    normal[0] = u[1] * v[2] - u[2] * v[1];
    normal[1] = u[2] * v[0] - u[0] * v[2];
    normal[2] = u[0] * v[1] - u[1] * v[0];
    double area = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    return area > FLATNESS * longest ? area : 0;
}

static double corner_angle(double side[3][3], double area, int k)
{
    const double *out = side[k], *in = side[k == 0 ? 2 : k - 1];
    return angle_of(area, -(out[0] * in[0] + out[1] * in[1] + out[2] * in[2]));
}

/* Writes the unit vector along `sum`, or (0, 0, 1) where it has no length. */
static void unit_or_up(const double sum[3], float normal[3])
{
    double size = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    bool none = !(size > CANCELLED);
    for (int a = 0; a < 3; a++)
        normal[a] = none ? (float)(a == 2) : (float)(sum[a] / size);
}

void dph_mesh_position_normals(const float *position, size_t npos, const uint32_t *index,
                               size_t ntri, float *normal_out)
{
    memset(normal_out, 0, npos * 3 * sizeof *normal_out);
    for (size_t t = 0; t < ntri; t++) {
        const float *p[3];
        double side[3][3], normal[3];
        for (int k = 0; k < 3; k++)
            p[k] = position + 3 * (size_t)index[3 * t + k];
        double area = sides_of(p, side, normal);
        if (area == 0)
            continue;
        for (int k = 0; k < 3; k++) {
            float *sum = normal_out + 3 * (size_t)index[3 * t + k];
            double weight = corner_angle(side, area, k) / area;
            for (int a = 0; a < 3; a++)
                sum[a] += (float)(weight * normal[a]);
        }
    }
    for (size_t i = 0; i < npos; i++) {
        float *n = normal_out + 3 * i;
        double sum[3] = {n[0], n[1], n[2]};
        unit_or_up(sum, n);
    }
}

/* One end of an edge at the position in hand. */
struct spoke {
    uint32_t neighbour; /* the position at its other end */
    uint32_t member;    /* which corner of the position it belongs to */
};

/* Everything that is needed to split one position's corners into fans. */
struct work {
    const struct dph_mesh *mesh;
    uint32_t *position_of; /* (nvert)                                                            */
    size_t *start;         /* (npos + 1) into `corner`                                           */
    uint32_t *corner;      /* (3 ntri) 3 * triangle + k, by position                             */
    float *face;           /* (ntri x 3) unit normals; 0 for a triangle without area             */
    uint32_t *fan;         /* (most corners of a position) union-find over its corners           */
    uint32_t *made;        /* (as many) the last new vertex that was made for a fan, or NONE     */
    double (*sum)[3];      /* (as many) of weighted normals of a fan                             */
    struct spoke *spoke;   /* (twice as many)                                                    */
    uint32_t *origin;      /* (capacity) the old vertex of each new one                          */
    float *normal;         /* (capacity x 3)                                                     */
    size_t count, capacity;
};

#define NONE UINT32_MAX

static int compare_spokes(const void *a, const void *b)
{
    const struct spoke *p = a, *q = b;
    if (p->neighbour != q->neighbour)
        return p->neighbour < q->neighbour ? -1 : 1;
    return p->member < q->member ? -1 : p->member > q->member;
}

static void sort_spokes(struct spoke *spoke, size_t n)
{
    if (n > 48) {
        qsort(spoke, n, sizeof *spoke, compare_spokes);
        return;
    }
    for (size_t i = 1; i < n; i++) {
        struct spoke s = spoke[i];
        size_t k = i;
        for (; k > 0 && compare_spokes(&s, &spoke[k - 1]) < 0; k--)
            spoke[k] = spoke[k - 1];
        spoke[k] = s;
    }
}

static uint32_t find_root(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

static bool is_flat(const float normal[3])
{
    return normal[0] == 0 && normal[1] == 0 && normal[2] == 0;
}

/* Joins the fans of two corners where their faces are smooth to each other. */
static void join(struct work *w, const uint32_t *corner, uint32_t a, uint32_t b,
                 double least_cosine)
{
    const float *m = w->face + 3 * (size_t)(corner[a] / 3);
    const float *n = w->face + 3 * (size_t)(corner[b] / 3);
    double cosine = (double)m[0] * n[0] + (double)m[1] * n[1] + (double)m[2] * n[2];
    if (is_flat(m) || is_flat(n) || cosine < least_cosine)
        return;
    a = find_root(w->fan, a);
    b = find_root(w->fan, b);
    if (a < b)
        w->fan[b] = a;
    else
        w->fan[a] = b;
}

/* An edge with more triangles than this joins neighbours in the list only, or a hostile file could
 * make the work quadratic. */
#define MOST_PAIRS 8

/* Splits the n corners of one position: w->fan[i] becomes the first corner of the fan of i. */
static void split_fans(struct work *w, const uint32_t *corner, uint32_t n, double least_cosine)
{
    for (uint32_t i = 0; i < n; i++) {
        uint32_t first = corner[i] / 3 * 3, k = corner[i] % 3;
        const uint32_t *index = w->mesh->index + first;
        w->fan[i] = i;
        w->spoke[2 * i] = (struct spoke){w->position_of[index[(k + 1) % 3]], i};
        w->spoke[2 * i + 1] = (struct spoke){w->position_of[index[(k + 2) % 3]], i};
    }
    sort_spokes(w->spoke, 2 * (size_t)n);
    for (size_t i = 0; i < 2 * (size_t)n;) {
        size_t end = i + 1;
        while (end < 2 * (size_t)n && w->spoke[end].neighbour == w->spoke[i].neighbour)
            end++;
        for (size_t a = i; a < end; a++) {
            size_t last = end - i <= MOST_PAIRS || a + 2 > end ? end : a + 2;
            for (size_t b = a + 1; b < last; b++)
                join(w, corner, w->spoke[a].member, w->spoke[b].member, least_cosine);
        }
        i = end;
    }
    for (uint32_t i = 0; i < n; i++) /* in rising order a corner's parent is final already */
        w->fan[i] = w->fan[w->fan[i]];
}

/* Makes one more vertex out of `old`. NONE: out of memory. */
static uint32_t add_vertex(struct work *w, uint32_t old)
{
    if (w->count == w->capacity) {
        size_t wanted = w->capacity + w->capacity / 2;
        uint32_t *origin = realloc(w->origin, wanted * sizeof *origin);
        if (!origin)
            return NONE;
        w->origin = origin;
        float *normal = realloc(w->normal, wanted * 3 * sizeof *normal);
        if (!normal)
            return NONE;
        w->normal = normal;
        w->capacity = wanted;
    }
    w->origin[w->count] = old;
    return (uint32_t)w->count++;
}

/* Sums the normals of the fans at one position. */
static void sum_fans(struct work *w, const uint32_t *corner, uint32_t n)
{
    uint32_t fallback = 0; /* a triangle without area goes to the first fan that has some */
    while (fallback + 1 < n && is_flat(w->face + 3 * (size_t)(corner[fallback] / 3)))
        fallback++;
    memset(w->sum, 0, n * sizeof *w->sum);
    for (uint32_t i = 0; i < n; i++) {
        const float *p[3];
        double side[3][3], normal[3];
        for (uint32_t k = 0; k < 3; k++)
            p[k] = w->mesh->position + 3 * (size_t)w->mesh->index[corner[i] / 3 * 3 + k];
        double area = sides_of(p, side, normal);
        if (area == 0) {
            w->fan[i] = w->fan[fallback];
            continue;
        }
        double weight = corner_angle(side, area, (int)(corner[i] % 3)) / area;
        for (int a = 0; a < 3; a++)
            w->sum[w->fan[i]][a] += weight * normal[a];
    }
}

/* Hands out the vertices of one position, a vertex for every pair of an old vertex and a fan, and
 * writes them to `index`. The first fan of an old vertex keeps its number. Corners are taken by
 * old vertex, so that the last vertex that was made for a fan is the only one to look at. */
static bool assign_vertices(struct work *w, const uint32_t *corner, uint32_t n, uint32_t *index)
{
    for (uint32_t i = 0; i < n; i++) {
        w->spoke[i] = (struct spoke){w->mesh->index[corner[i]], i};
        w->made[i] = NONE;
    }
    sort_spokes(w->spoke, n);
    for (uint32_t s = 0; s < n; s++) {
        uint32_t old = w->spoke[s].neighbour, i = w->spoke[s].member;
        uint32_t *made = &w->made[w->fan[i]];
        if (*made == NONE || w->origin[*made] != old) {
            *made = s == 0 || w->spoke[s - 1].neighbour != old ? old : add_vertex(w, old);
            if (*made == NONE)
                return false;
            unit_or_up(w->sum[w->fan[i]], w->normal + 3 * (size_t)*made);
        }
        index[corner[i]] = *made;
    }
    return true;
}

/* Lists the corners of every position. Returns the most that one has, SIZE_MAX where memory is
 * short. */
static size_t list_corners(struct work *w, size_t npos)
{
    size_t ncorner = 3 * w->mesh->ntri, most = 0;
    w->start = dph_alloc_zero(npos + 2, sizeof *w->start);
    w->corner = dph_alloc(ncorner, sizeof *w->corner);
    if (!w->start || !w->corner)
        return SIZE_MAX;
    for (size_t i = 0; i < ncorner; i++)
        w->start[w->position_of[w->mesh->index[i]] + 2]++;
    for (size_t p = 2; p < npos + 2; p++) {
        most = w->start[p] > most ? w->start[p] : most;
        w->start[p] += w->start[p - 1];
    }
    for (size_t i = 0; i < ncorner; i++) /* moves the starts one to the left */
        w->corner[w->start[w->position_of[w->mesh->index[i]] + 1]++] = (uint32_t)i;
    return most;
}

/* Takes the memory for `work`. */
static bool prepare(struct work *w, size_t npos)
{
    const struct dph_mesh *mesh = w->mesh;
    size_t most = list_corners(w, npos);
    if (most == SIZE_MAX)
        return false;
    w->capacity = mesh->nvert + 64;
    w->count = mesh->nvert;
    w->face = dph_alloc_zero(mesh->ntri, 3 * sizeof *w->face);
    w->fan = dph_alloc(most, sizeof *w->fan);
    w->spoke = dph_alloc(most, 2 * sizeof *w->spoke);
    w->made = dph_alloc(most, sizeof *w->made);
    w->sum = dph_alloc(most, sizeof *w->sum);
    w->origin = dph_alloc(w->capacity, sizeof *w->origin);
    w->normal = dph_alloc(w->capacity, 3 * sizeof *w->normal);
    if (!w->face || !w->fan || !w->spoke || !w->made || !w->sum || !w->origin || !w->normal)
        return false;
    for (size_t v = 0; v < mesh->nvert; v++) {
        w->origin[v] = (uint32_t)v;
        memcpy(w->normal + 3 * v, (float[3]){0, 0, 1}, 3 * sizeof(float));
    }
    for (size_t t = 0; t < mesh->ntri; t++) {
        const float *p[3];
        double side[3][3], normal[3];
        for (int k = 0; k < 3; k++)
            p[k] = mesh->position + 3 * (size_t)mesh->index[3 * t + k];
        double area = sides_of(p, side, normal);
        if (area != 0)
            for (int a = 0; a < 3; a++)
                w->face[3 * t + a] = (float)(normal[a] / area);
    }
    return true;
}

static void release(struct work *w)
{
    free(w->position_of);
    free(w->start);
    free(w->corner);
    free(w->face);
    free(w->fan);
    free(w->spoke);
    free(w->made);
    free(w->sum);
    free(w->origin);
    free(w->normal);
}

bool dph_mesh_make_normals(struct dph_mesh *mesh, double crease_degrees, uint32_t **vertex_of,
                           struct dph_error *err)
{
    /* 180 degrees joins whatever shares an edge, 0 nothing; in between, the rounding of the face
     * normals must not decide about a right angle or a plane. */
    double least_cosine = crease_degrees >= 180 ? -2
                          : crease_degrees <= 0
                              ? 2
                              : cos(crease_degrees * (3.14159265358979323846 / 180)) - 3e-7;
    struct work w = {.mesh = mesh};
    struct dph_mesh result = {0};
    if (mesh->ntri > UINT32_MAX / 3)
        return dph_fail(err, DPH_ERROR_LIMIT,
                        "%zu triangles are more than the %u whose normals can be made", mesh->ntri,
                        UINT32_MAX / 3);
    w.position_of = dph_alloc(mesh->nvert, sizeof *w.position_of);
    if (!w.position_of)
        goto memory;
    size_t npos = dph_mesh_weld(mesh->position, 3 * sizeof(float), mesh->nvert, w.position_of, err);
    if (npos == SIZE_MAX)
        goto error;
    uint32_t *index = result.index = dph_alloc(mesh->ntri, 3 * sizeof *index);
    if (!index || !prepare(&w, npos))
        goto memory;
    for (size_t p = 0; p < npos; p++) {
        const uint32_t *corner = w.corner + w.start[p];
        uint32_t n = (uint32_t)(w.start[p + 1] - w.start[p]);
        split_fans(&w, corner, n, least_cosine);
        sum_fans(&w, corner, n);
        if (!assign_vertices(&w, corner, n, index))
            goto memory;
    }
    result.nvert = w.count;
    result.ntri = mesh->ntri;
    result.position = dph_alloc(w.count, 3 * sizeof(float));
    result.texcoord = mesh->texcoord ? dph_alloc(w.count, 2 * sizeof(float)) : NULL;
    if (!result.position || (mesh->texcoord && !result.texcoord))
        goto memory;
    for (size_t v = 0; v < w.count; v++) {
        size_t old = w.origin[v];
        memcpy(result.position + 3 * v, mesh->position + 3 * old, 3 * sizeof(float));
        if (mesh->texcoord)
            memcpy(result.texcoord + 2 * v, mesh->texcoord + 2 * old, 2 * sizeof(float));
    }
    result.normal = w.normal;
    w.normal = NULL;
    if (vertex_of) {
        *vertex_of = w.origin;
        w.origin = NULL;
    }
    dph_mesh_finish(mesh);
    *mesh = result;
    release(&w);
    return true;

memory:
    dph_fail_memory(err);
error:
    release(&w);
    dph_mesh_finish(&result);
    return false;
}
