/* What a mesh is made of: borders, orientation, bodies, area and volume.
 *
 * Two triangles share an edge where they share two positions. The directed edges are sorted by two
 * stable counting passes, by their higher and then by their lower end, so the cost is linear
 * whatever the mesh looks like; equal edges then lie side by side. Bodies are found by union-find
 * with path halving (Tarjan, van Leeuwen 1984). */
#include <diaphan/mesh.h>

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct edge {
    uint32_t low, high; /* positions; the top bit of `high` says that the triangle runs downward */
};

#define DOWNWARD 0x80000000u

static bool is_degenerate(const uint32_t corner[3])
{
    return corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0];
}

/* The edges of all triangles with three distinct positions; returns their number. */
static size_t list_edges(const uint32_t *triangle, size_t ntri, struct edge *edge)
{
    size_t n = 0;
    for (size_t t = 0; t < ntri; t++) {
        const uint32_t *corner = triangle + 3 * t;
        if (is_degenerate(corner))
            continue;
        for (int k = 0; k < 3; k++) {
            uint32_t a = corner[k], b = corner[(k + 1) % 3];
            edge[n++] = a < b ? (struct edge){a, b} : (struct edge){b, a | DOWNWARD};
        }
    }
    return n;
}

/* One stable counting pass; `start` has npos + 1 elements. */
static void sort_pass(const struct edge *from, struct edge *to, size_t n, size_t *start,
                      size_t npos, bool by_low)
{
    memset(start, 0, (npos + 1) * sizeof *start);
    for (size_t i = 0; i < n; i++)
        start[(by_low ? from[i].low : from[i].high & ~DOWNWARD) + 1]++;
    for (size_t p = 0; p < npos; p++)
        start[p + 1] += start[p];
    for (size_t i = 0; i < n; i++)
        to[start[by_low ? from[i].low : from[i].high & ~DOWNWARD]++] = from[i];
}

static bool count_edges(const uint32_t *triangle, size_t ntri, size_t npos,
                        struct dph_mesh_stats *stats, struct dph_error *err)
{
    bool ok = false;
    struct edge *edge = dph_alloc(ntri, 3 * sizeof *edge);
    struct edge *sorted = dph_alloc(ntri, 3 * sizeof *sorted);
    size_t *start = dph_alloc(npos + 1, sizeof *start);
    if (!edge || !sorted || !start) {
        dph_fail_memory(err);
        goto error;
    }
    size_t n = list_edges(triangle, ntri, edge);
    sort_pass(edge, sorted, n, start, npos, false);
    sort_pass(sorted, edge, n, start, npos, true);
    for (size_t i = 0; i < n;) {
        size_t end = i, downward = 0;
        while (end < n && edge[end].low == edge[i].low &&
               (edge[end].high & ~DOWNWARD) == (edge[i].high & ~DOWNWARD))
            downward += edge[end++].high >> 31;
        size_t count = end - i;
        if (count == 1)
            stats->boundary_edges++;
        else if (count > 2)
            stats->nonmanifold_edges++;
        else if (downward != 1)
            stats->flipped_edges++;
        i = end;
    }
    ok = true;
error:
    free(edge);
    free(sorted);
    free(start);
    return ok;
}

static uint32_t find_root(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

#define UNUSED UINT32_MAX

/* Counts the positions in use and the bodies; `parent` has npos elements. */
static void count_components(const uint32_t *triangle, size_t ntri, size_t npos, uint32_t *parent,
                             struct dph_mesh_stats *stats)
{
    memset(parent, 0xff, npos * sizeof *parent);
    for (size_t i = 0; i < 3 * ntri; i++)
        parent[triangle[i]] = triangle[i];
    for (size_t p = 0; p < npos; p++)
        stats->positions += parent[p] != UNUSED;
    for (size_t t = 0; t < ntri; t++) {
        for (int k = 1; k < 3; k++) {
            uint32_t a = find_root(parent, triangle[3 * t]);
            uint32_t b = find_root(parent, triangle[3 * t + k]);
            if (a < b) /* the lower one stays: the outcome does not depend on the order */
                parent[b] = a;
            else
                parent[a] = b;
        }
    }
    for (size_t p = 0; p < npos; p++)
        stats->components += parent[p] == p;
}

/* Bounds, area, and the volume by the divergence theorem. The volume is taken about the centre of
 * the box, because tetrahedra that reach to a far origin would cancel most of their digits. */
static void measure_space(const struct dph_mesh *mesh, struct dph_mesh_stats *stats)
{
    for (size_t i = 0; i < 3 * mesh->ntri; i++) {
        const float *p = mesh->position + 3 * (size_t)mesh->index[i];
        for (int k = 0; k < 3; k++) {
            if (i == 0 || p[k] < stats->bounds[0][k])
                stats->bounds[0][k] = p[k];
            if (i == 0 || p[k] > stats->bounds[1][k])
                stats->bounds[1][k] = p[k];
        }
    }
    double centre[3];
    for (int k = 0; k < 3; k++)
        centre[k] = 0.5 * (stats->bounds[0][k] + stats->bounds[1][k]);
    double area = 0, volume = 0;
    for (size_t t = 0; t < mesh->ntri; t++) {
        double p[3][3];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                p[c][k] = mesh->position[3 * (size_t)mesh->index[3 * t + c] + k] - centre[k];
        double u[3], v[3];
        for (int k = 0; k < 3; k++) {
            u[k] = p[1][k] - p[0][k];
            v[k] = p[2][k] - p[0][k];
        }
        double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                       u[0] * v[1] - u[1] * v[0]};
        area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        volume += p[0][0] * n[0] + p[0][1] * n[1] + p[0][2] * n[2];
    }
    stats->area = area / 2;
    stats->volume = volume / 6;
}

bool dph_mesh_measure(const struct dph_mesh *mesh, struct dph_mesh_stats *stats,
                      struct dph_error *err)
{
    bool ok = false;
    memset(stats, 0, sizeof *stats);
    uint32_t *position_of = dph_alloc(mesh->nvert, sizeof *position_of);
    uint32_t *parent = NULL;
    uint32_t *triangle = dph_alloc(mesh->ntri, 3 * sizeof *triangle);
    if (!position_of || !triangle) {
        dph_fail_memory(err);
        goto error;
    }
    size_t npos = dph_mesh_weld(mesh->position, 3 * sizeof(float), mesh->nvert, position_of, err);
    if (npos == SIZE_MAX)
        goto error;
    for (size_t i = 0; i < 3 * mesh->ntri; i++) {
        if (mesh->index[i] >= mesh->nvert) {
            dph_fail(err, DPH_ERROR_INPUT, "triangle %zu refers to vertex %u, the mesh has %zu",
                     i / 3, mesh->index[i], mesh->nvert);
            goto error;
        }
        triangle[i] = position_of[mesh->index[i]];
    }
    parent = position_of; /* its numbers are in `triangle` now; no more positions than vertices */
    position_of = NULL;
    for (size_t t = 0; t < mesh->ntri; t++)
        stats->degenerate += is_degenerate(triangle + 3 * t);
    count_components(triangle, mesh->ntri, npos, parent, stats);
    free(parent);
    parent = NULL;
    if (!count_edges(triangle, mesh->ntri, npos, stats, err))
        goto error;
    measure_space(mesh, stats);
    stats->closed = mesh->ntri > stats->degenerate && !stats->boundary_edges &&
                    !stats->nonmanifold_edges && !stats->flipped_edges;
    ok = true;
error:
    free(position_of);
    free(triangle);
    free(parent);
    return ok;
}
