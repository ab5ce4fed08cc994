/* Triangle meshes that own their arrays. */
#include <diaphan/mesh.h>

#include "core/fail.h"
#include "core/memory.h"

#include <stdlib.h>
#include <string.h>

/* 2^31: every index fits 32 bits with one to spare for a mark. */
#define COUNT_LIMIT ((size_t)1 << 31)

bool dph_mesh_init(struct dph_mesh *mesh, size_t nvert, size_t ntri, bool normal, bool texcoord,
                   struct dph_error *err)
{
    memset(mesh, 0, sizeof *mesh);
    if (nvert > COUNT_LIMIT || ntri > COUNT_LIMIT)
        return dph_fail(err, DPH_ERROR_LIMIT,
                        "a mesh of %zu vertices and %zu triangles is more than the %zu of either "
                        "that are handled",
                        nvert, ntri, COUNT_LIMIT);
    mesh->position = dph_alloc(nvert, 3 * sizeof(float));
    mesh->index = dph_alloc(ntri, 3 * sizeof(uint32_t));
    if (normal)
        mesh->normal = dph_alloc(nvert, 3 * sizeof(float));
    if (texcoord)
        mesh->texcoord = dph_alloc(nvert, 2 * sizeof(float));
    if (!mesh->position || !mesh->index || (normal && !mesh->normal) ||
        (texcoord && !mesh->texcoord)) {
        dph_mesh_finish(mesh);
        return dph_fail_memory(err);
    }
    mesh->nvert = nvert;
    mesh->ntri = ntri;
    return true;
}

void dph_mesh_finish(struct dph_mesh *mesh)
{
    free(mesh->position);
    free(mesh->normal);
    free(mesh->texcoord);
    free(mesh->index);
    memset(mesh, 0, sizeof *mesh);
}

void dph_mesh_flip(struct dph_mesh *mesh)
{
    for (size_t t = 0; t < mesh->ntri; t++) {
        uint32_t *corner = mesh->index + 3 * t;
        uint32_t second = corner[1];
        corner[1] = corner[2];
        corner[2] = second;
    }
    if (mesh->normal)
        for (size_t i = 0; i < 3 * mesh->nvert; i++)
            mesh->normal[i] = -mesh->normal[i];
}
