/* A mesh with one row a position. */
#include "bake/welded.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/mesh.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lengths, and the products of lengths and coefficients, must stay within single precision. */
static const double SMALLEST_SIDE = 1e-15, LARGEST_SIDE = 1e15;

bool dph_welded_init(struct dph_welded *welded, const struct dph_bake_input *input,
                     struct dph_error *err)
{
    size_t stride = input->stride ? input->stride : 3 * sizeof(float);
    size_t nvert = input->nvert, corners = 3 * input->ntri;
    *welded = (struct dph_welded){.ntri = input->ntri};
    if (input->ntri > INT32_MAX || nvert > INT32_MAX)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "a mesh has at most 2^31 - 1 vertices and triangles");
    if (!input->index && corners > nvert)
        return dph_fail(err, DPH_ERROR_INPUT,
                        "%zu triangles without indices need %zu vertices, there are %zu",
                        input->ntri, corners, nvert);
    welded->position_of = dph_alloc(nvert, sizeof *welded->position_of);
    welded->index = dph_alloc(corners, sizeof *welded->index);
    if (!welded->position_of || !welded->index)
        goto memory;
    welded->npos = dph_mesh_weld(input->position, stride, nvert, welded->position_of, err);
    if (welded->npos == SIZE_MAX)
        goto error;
    welded->position = dph_alloc(welded->npos, 3 * sizeof *welded->position);
    if (!welded->position)
        goto memory;
    for (size_t v = nvert; v-- > 0;) { /* backwards: the first of equal points stays */
        const char *from = (const char *)input->position + v * stride;
        memcpy(welded->position + 3 * (size_t)welded->position_of[v], from, 3 * sizeof(float));
    }
    for (size_t i = 0; i < corners; i++) {
        size_t v = input->index ? input->index[i] : i;
        if (v >= nvert) {
            dph_fail(err, DPH_ERROR_INPUT, "triangle %zu refers to vertex %zu, the mesh has %zu",
                     i / 3, v, nvert);
            goto error;
        }
        welded->index[i] = welded->position_of[v];
    }
    for (size_t k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t p = 0; p < welded->npos; p++) {
            low = fmin(low, welded->position[3 * p + k]);
            high = fmax(high, welded->position[3 * p + k]);
        }
        welded->side = fmax(welded->side, high - low);
    }
    if (welded->side > 0 && (welded->side < SMALLEST_SIDE || welded->side > LARGEST_SIDE)) {
        dph_fail(err, DPH_ERROR_INPUT,
                 "the mesh is %g units large, what can be baked is %g to %g", welded->side,
                 SMALLEST_SIDE, LARGEST_SIDE);
        goto error;
    }
    return true;

memory:
    dph_fail_memory(err);
error:
    dph_welded_finish(welded);
    return false;
}

void dph_welded_finish(struct dph_welded *welded)
{
    free(welded->position);
    free(welded->index);
    free(welded->position_of);
    *welded = (struct dph_welded){0};
}
