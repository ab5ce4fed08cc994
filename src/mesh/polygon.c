/* Polygons into triangles by cutting ears (G. H. Meisters, "Polygons have ears", American
 * Mathematical Monthly 82, 1975).
 *
 * The polygon is seen along the axis that its normal is closest to; the normal is Newell's (M. E.
 * Newell, R. G. Newell, T. L. Sancha 1972), which also serves polygons that are not quite plane.
 * An ear is a convex corner whose triangle holds no other corner. A simple polygon always has one;
 * where rounding or a polygon that crosses itself leaves none, the rest becomes a fan. The work is
 * bounded, because the polygon may come from a hostile file. */
#include "mesh/polygon.h"

#include "core/memory.h"

#include <math.h>
#include <stdlib.h>

/* Larger polygons become fans: the search for ears grows with the square of the corners. */
#define MOST_CORNERS 2048

static double cross(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static void fan(size_t n, uint32_t *triangle)
{
    for (uint32_t i = 2; i < n; i++, triangle += 3) {
        triangle[0] = 0;
        triangle[1] = i - 1;
        triangle[2] = i;
    }
}

/* Projects the corners so that the polygon runs counter-clockwise. */
static void project(const float *position, const uint32_t *vertex, size_t stride, size_t n,
                    double (*point)[2])
{
    double normal[3] = {0, 0, 0};
    const float *origin = position + 3 * (size_t)vertex[0];
    for (size_t i = 0; i < n; i++) {
        const float *p = position + 3 * (size_t)vertex[i * stride];
        const float *q = position + 3 * (size_t)vertex[(i + 1) % n * stride];
        for (int k = 0; k < 3; k++) {
            int a = (k + 1) % 3, b = (k + 2) % 3;
            double pa = (double)p[a] - origin[a], pb = (double)p[b] - origin[b];
            double qa = (double)q[a] - origin[a], qb = (double)q[b] - origin[b];
            normal[k] += pa * qb - pb * qa;
        }
    }
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(normal[k]) > fabs(normal[axis]))
            axis = k;
    int x = (axis + 1) % 3, y = (axis + 2) % 3;
    for (size_t i = 0; i < n; i++) {
        const float *p = position + 3 * (size_t)vertex[i * stride];
        point[i][0] = (double)p[x] - origin[x];
        point[i][1] = normal[axis] < 0 ? (double)origin[y] - p[y] : (double)p[y] - origin[y];
    }
}

/* Strictly: a fan about a corner between two in line with it would begin with a triangle without
 * area. */
static bool is_convex(double (*point)[2], size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (cross(point[i], point[(i + 1) % n], point[(i + 2) % n]) <= 0)
            return false;
    return true;
}

static bool same(const double a[2], const double b[2])
{
    return a[0] == b[0] && a[1] == b[1];
}

/* Whether a corner is an ear of what is left of the polygon. `budget` loses one for every corner
 * looked at. */
static bool is_ear(double (*point)[2], const uint32_t *next, uint32_t before, uint32_t tip,
                   uint32_t after, size_t *budget)
{
    const double *a = point[before], *b = point[tip], *c = point[after];
    if (cross(a, b, c) <= 0)
        return false;
    for (uint32_t i = next[after]; i != before; i = next[i]) {
        if (*budget == 0)
            return false;
        --*budget;
        const double *p = point[i];
        if (same(p, a) || same(p, b) || same(p, c))
            continue;
        if (cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0)
            return false;
    }
    return true;
}

static void cut_ears(double (*point)[2], uint32_t *link, size_t n, uint32_t *triangle)
{
    uint32_t *next = link, *previous = link + n;
    for (uint32_t i = 0; i < n; i++) {
        next[i] = i + 1 < n ? i + 1 : 0;
        previous[i] = i > 0 ? i - 1 : (uint32_t)n - 1;
    }
    size_t left = n, misses = 0, budget = 2 * n * n;
    uint32_t i = 0;
    while (left > 3 && misses < left && budget > 0) {
        uint32_t before = previous[i], after = next[i];
        if (!is_ear(point, next, before, i, after, &budget)) {
            i = after;
            misses++;
            continue;
        }
        triangle[0] = before;
        triangle[1] = i;
        triangle[2] = after;
        triangle += 3;
        next[before] = after;
        previous[after] = before;
        left--;
        misses = 0;
        i = next[after]; /* not the neighbour: slivers would pile up at one corner */
    }
    uint32_t first = i; /* a triangle, or what has no ear */
    for (uint32_t b = next[first], c = next[b]; c != first; b = c, c = next[c], triangle += 3) {
        triangle[0] = first;
        triangle[1] = b;
        triangle[2] = c;
    }
}

bool dph_polygon_split(const float *position, const uint32_t *vertex, size_t stride, size_t n,
                       uint32_t *triangle, struct dph_polygon_work *work)
{
    if (n == 3 || n > MOST_CORNERS) {
        fan(n, triangle);
        return true;
    }
    if (n > work->capacity) {
        dph_polygon_finish(work);
        work->point = dph_alloc(MOST_CORNERS, sizeof *work->point);
        work->link = dph_alloc(MOST_CORNERS, 2 * sizeof *work->link);
        if (!work->point || !work->link)
            return false;
        work->capacity = MOST_CORNERS;
    }
    project(position, vertex, stride, n, work->point);
    if (is_convex(work->point, n))
        fan(n, triangle);
    else
        cut_ears(work->point, work->link, n, triangle);
    return true;
}

void dph_polygon_finish(struct dph_polygon_work *work)
{
    free(work->point);
    free(work->link);
    *work = (struct dph_polygon_work){0};
}
