/* The order in which a body is drawn: equal vertices once, triangles and rows as caches like them.
 *
 * A file may write every corner of every triangle as a vertex of its own, and triangles in any
 * order. Here vertices that are equal in everything that is drawn become one row; triangles are put
 * in an order in which a vertex is used again while its shaded result is still at hand, fans around
 * one vertex after the other (P. Sander, D. Nehab, J. Barczak, "Fast triangle reordering for vertex
 * locality and reduced overdraw", SIGGRAPH 2007, section 3, as libmeshoptimizer has it), and rows in
 * the order of their first use. Triangles keep their corners and these their order, so that the
 * picture is the same. The same mesh gives the same order.
 *
 * Left out after measurements (candle, llvmpipe, 36 coefficients): the paper's second step, patches
 * that face outward first, took 4 % more of a frame from afar and saved nothing from near, where a
 * body hides little of itself; T. Forsyth's scores shade a fifth fewer vertices with a cache of 16 and
 * take 2 % more, as triangles follow each other less regularly. */
#include "render/draw.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/rivals.h>

#include <meshoptimizer.h>
#include <stdlib.h>
#include <string.h>

/* Vertices that are taken for being at hand. Drivers differ, from 16 to a thousand indices; at 24 and
 * 64 frames took 1 to 2 % longer. */
enum { CACHE = 32 };

/* All that makes two vertices differ in some picture. Transfer vectors belong to positions. */
static size_t streams_of(const struct dph_body *body, struct meshopt_Stream *stream)
{
    const struct dph_mesh *mesh = &body->mesh;
    const struct dph_thickness *t = body->thickness;
    const struct dph_rivals *rivals = body->rivals;
    size_t n = 0;
    stream[n++] = (struct meshopt_Stream){mesh->position, 12, 12};
    stream[n++] = (struct meshopt_Stream){mesh->normal, 12, 12};
    if (t) {
        size_t row = (size_t)t->components * dph_store_size(t->store);
        stream[n++] = (struct meshopt_Stream){t->data, row, row};
    }
    if (t && t->cluster)
        stream[n++] = (struct meshopt_Stream){t->cluster, sizeof *t->cluster, sizeof *t->cluster};
    if (rivals && rivals->normal)
        stream[n++] = (struct meshopt_Stream){rivals->normal, 12, 12};
    return n;
}

bool dph_gpu_body_order(struct dph_gpu_body *gpu, const struct dph_body *body, uint32_t *index,
                        struct dph_error *err)
{
    const struct dph_mesh *mesh = &body->mesh;
    const size_t corners = 3 * mesh->ntri;
    struct meshopt_Stream stream[5];
    size_t streams = streams_of(body, stream), unique;
    uint32_t *shared = dph_alloc(mesh->nvert, sizeof *shared), *moved = NULL;
    uint32_t *grouped = dph_alloc(corners, sizeof *grouped);
    bool ok = false;
    gpu->row_of = dph_alloc(mesh->nvert, sizeof *gpu->row_of);
    if (!shared || !grouped || !gpu->row_of) {
        dph_fail_memory(err);
        goto error;
    }
    unique = meshopt_generateVertexRemapMulti(shared, mesh->index, corners, mesh->nvert, stream,
                                              streams);
    moved = dph_alloc(unique, sizeof *moved);
    gpu->vertex = dph_alloc(unique, sizeof *gpu->vertex);
    if (!moved || !gpu->vertex) {
        dph_fail_memory(err);
        goto error;
    }
    meshopt_remapIndexBuffer(index, mesh->index, corners, shared);
    meshopt_optimizeVertexCacheFifo(grouped, index, corners, unique, CACHE);
    gpu->nvert = meshopt_optimizeVertexFetchRemap(moved, grouped, corners, unique);
    meshopt_remapIndexBuffer(index, grouped, corners, moved);
    for (size_t v = mesh->nvert; v-- > 0;) { /* the first of equal vertices has the last word */
        gpu->row_of[v] = shared[v] == UINT32_MAX ? UINT32_MAX : moved[shared[v]];
        if (gpu->row_of[v] != UINT32_MAX)
            gpu->vertex[gpu->row_of[v]] = (uint32_t)v;
    }
    ok = true;

error:
    free(shared);
    free(moved);
    free(grouped);
    return ok;
}
