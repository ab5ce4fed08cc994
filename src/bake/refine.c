/* Refinement: edges are halved at their midpoints, pass by pass, every edge longer than a
 * threshold that falls from the longest edge to the wanted spacing. Whether an edge is halved
 * depends on the edge alone, so both of its triangles agree, and each triangle is then cut into
 * two, three or four according to how many of its edges were. The pass that would make too many
 * positions is tried with higher thresholds and then left out: the samples become sparser than
 * wanted, evenly over the body. */
#include "bake/refine.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/mesh.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* No edge needs more passes: each halves the longest. */
enum { MOST_PASSES = 24 };

static double length_of(const float *position, uint32_t a, uint32_t b)
{
    double square = 0;
    for (size_t k = 0; k < 3; k++) {
        double d = (double)position[3 * (size_t)a + k] - (double)position[3 * (size_t)b + k];
        square += d * d;
    }
    return sqrt(square);
}

static double longest_edge(const struct dph_refined *mesh)
{
    double longest = 0;
    for (size_t t = 0; t < mesh->ntri; t++)
        for (size_t k = 0; k < 3; k++)
            longest = fmax(longest, length_of(mesh->position, mesh->index[3 * t + k],
                                              mesh->index[3 * t + (k + 1) % 3]));
    return longest;
}

/* Edges that are halved, by their ends: an open-addressing table whose size is a power of two. */
struct edges {
    size_t count, size;
    uint64_t *key;      /* (size) low end << 32 | high end, UINT64_MAX: free                       */
    uint32_t *midpoint; /* (size) its position                                                     */
};

static size_t find_edge(const struct edges *edges, uint32_t a, uint32_t b)
{
    uint64_t key = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
    size_t mask = edges->size - 1, at = (size_t)((key * 0x9e3779b97f4a7c15u) >> 20) & mask;
    while (edges->key[at] != UINT64_MAX && edges->key[at] != key)
        at = (at + 1) & mask;
    return at;
}

/* Lists the edges longer than `threshold`, and numbers their midpoints from `first` on. `count`
 * is the number of edges even where it exceeds `most`; the table is then not filled. False: out
 * of memory. */
static bool list_edges(const struct dph_refined *mesh, double threshold, size_t most, struct edges *edges)
{
    size_t corners = 0; /* every edge is seen at most as often as it is a side */
    for (size_t t = 0; t < mesh->ntri; t++)
        for (size_t k = 0; k < 3; k++)
            corners += length_of(mesh->position, mesh->index[3 * t + k],
                                 mesh->index[3 * t + (k + 1) % 3]) > threshold;
    *edges = (struct edges){.size = 16};
    while (edges->size < 2 * corners)
        edges->size *= 2;
    edges->key = dph_alloc(edges->size, sizeof *edges->key);
    edges->midpoint = dph_alloc(edges->size, sizeof *edges->midpoint);
    if (!edges->key || !edges->midpoint)
        return false;
    memset(edges->key, 0xff, edges->size * sizeof *edges->key);
    for (size_t t = 0; t < mesh->ntri && edges->count <= most; t++)
        for (size_t k = 0; k < 3; k++) {
            uint32_t a = mesh->index[3 * t + k], b = mesh->index[3 * t + (k + 1) % 3];
            if (!(length_of(mesh->position, a, b) > threshold))
                continue;
            size_t at = find_edge(edges, a, b);
            if (edges->key[at] == UINT64_MAX) {
                edges->key[at] = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
                edges->midpoint[at] = (uint32_t)(mesh->npos + edges->count++);
            }
        }
    return true;
}

static void edges_finish(struct edges *edges)
{
    free(edges->key);
    free(edges->midpoint);
}

/* Cuts one triangle by its halved edges (m[k] is the midpoint of side k, k+1, or UINT32_MAX).
 * Returns the triangles written. */
static size_t cut(const uint32_t corner[3], const uint32_t m[3], uint32_t *out)
{
    const uint32_t none = UINT32_MAX;
    int halved = (m[0] != none) + (m[1] != none) + (m[2] != none), first = 0;
    if (!halved) {
        memcpy(out, corner, 3 * sizeof *out);
        return 1;
    }
    if (halved == 3) {
        const uint32_t all[12] = {corner[0], m[0], m[2], m[0], corner[1], m[1],
                                  m[2], m[1], corner[2], m[0], m[1], m[2]};
        memcpy(out, all, sizeof all);
        return 4;
    }
    /* turn it so that side 0 is the halved one, or of two halved ones side 0 and 1 are */
    while (halved == 1 ? m[first] == none : m[(first + 2) % 3] != none)
        first++;
    uint32_t a = corner[first], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
    uint32_t ab = m[first], bc = m[(first + 1) % 3];
    if (halved == 1) {
        const uint32_t two[6] = {a, ab, c, ab, b, c};
        memcpy(out, two, sizeof two);
        return 2;
    }
    const uint32_t three[9] = {ab, b, bc, a, ab, bc, a, bc, c};
    memcpy(out, three, sizeof three);
    return 3;
}

/* One pass over the mesh with a filled table. False: out of memory, the mesh is unchanged or has
 * more room than it needs. */
static bool halve(struct dph_refined *mesh, const struct edges *edges)
{
    float *position = realloc(mesh->position, (mesh->npos + edges->count) * 3 * sizeof *position);
    if (!position)
        return false;
    mesh->position = position;
    uint32_t *index = dph_alloc(mesh->ntri, 12 * sizeof *index);
    if (!index)
        return false;
    for (size_t i = 0; i < edges->size; i++)
        if (edges->key[i] != UINT64_MAX)
            for (size_t k = 0; k < 3; k++) {
                double a = position[3 * (size_t)(edges->key[i] >> 32) + k];
                double b = position[3 * (size_t)(edges->key[i] & UINT32_MAX) + k];
                position[3 * (size_t)edges->midpoint[i] + k] = (float)((a + b) / 2);
            }
    size_t ntri = 0;
    for (size_t t = 0; t < mesh->ntri; t++) {
        const uint32_t *corner = mesh->index + 3 * t;
        uint32_t midpoint[3];
        for (size_t k = 0; k < 3; k++) {
            size_t at = find_edge(edges, corner[k], corner[(k + 1) % 3]);
            midpoint[k] = edges->key[at] == UINT64_MAX ? UINT32_MAX : edges->midpoint[at];
        }
        ntri += cut(corner, midpoint, index + 3 * ntri);
    }
    free(mesh->index);
    mesh->index = index;
    mesh->ntri = ntri;
    mesh->npos += edges->count;
    return true;
}

/* Midpoints may fall on other positions, by rounding or where an edge meets another's middle. */
static bool join_equal(struct dph_refined *mesh, struct dph_error *err)
{
    uint32_t *position_of = dph_alloc(mesh->npos, sizeof *position_of);
    if (!position_of)
        return dph_fail_memory(err);
    size_t npos = dph_mesh_weld(mesh->position, 3 * sizeof(float), mesh->npos, position_of, err);
    bool ok = npos != SIZE_MAX;
    if (ok) {
        for (size_t i = 0; i < 3 * mesh->ntri; i++)
            mesh->index[i] = position_of[mesh->index[i]];
        for (size_t v = 0; v < mesh->npos; v++) /* numbers never grow by welding */
            memmove(mesh->position + 3 * (size_t)position_of[v], mesh->position + 3 * v, 3 * sizeof(float));
        mesh->npos = npos;
    }
    free(position_of);
    return ok;
}

bool dph_refine(const float *position, size_t npos, const uint32_t *index, size_t ntri, double spacing,
                size_t most, struct dph_refined *refined, struct dph_error *err)
{
    struct edges edges = {0};
    *refined = (struct dph_refined){.npos = npos, .ntri = ntri};
    refined->position = dph_alloc(npos, 3 * sizeof *position);
    refined->index = dph_alloc(ntri, 3 * sizeof *index);
    if (!refined->position || !refined->index)
        goto memory;
    if (npos)
        memcpy(refined->position, position, npos * 3 * sizeof *position);
    if (ntri)
        memcpy(refined->index, index, ntri * 3 * sizeof *index);
    refined->longest = longest_edge(refined);
    most = most < UINT32_MAX / 8 ? most : UINT32_MAX / 8;
    for (int pass = 0; pass < MOST_PASSES && refined->longest > spacing && refined->npos < most; pass++) {
        size_t room = most - refined->npos;
        bool fits = false;
        for (double share = .5; share < .95 && !fits; share *= 1.2) {
            edges_finish(&edges);
            if (!list_edges(refined, fmax(spacing, refined->longest * share), room, &edges))
                goto memory;
            fits = edges.count <= room;
        }
        if (!fits)
            break;
        if (!halve(refined, &edges))
            goto memory;
        refined->longest = longest_edge(refined);
    }
    if (refined->npos > npos && !join_equal(refined, err)) {
        edges_finish(&edges);
        dph_refined_finish(refined);
        return false;
    }
    edges_finish(&edges);
    return true;
memory:
    edges_finish(&edges);
    dph_refined_finish(refined);
    return dph_fail_memory(err);
}

void dph_refined_finish(struct dph_refined *refined)
{
    free(refined->position);
    free(refined->index);
    *refined = (struct dph_refined){0};
}
