/* What the fuzz targets have in common: bytes in, a mesh or an error out, and a mesh must hold
 * what mesh.h promises. */
#ifndef DPH_FUZZ_READER_H
#define DPH_FUZZ_READER_H

#include "mesh/readers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef bool reader(struct dph_mesh *, const struct dph_file *, const char *, struct dph_scene *,
                    struct dph_error *);

static void require(bool holds)
{
    if (!holds)
        abort();
}

static int fuzz_reader(reader *read, const uint8_t *data, size_t size)
{
    struct dph_file file = {malloc(size + 1), size};
    struct dph_mesh mesh;
    struct dph_error err = {0};
    require(file.data != NULL);
    if (size)
        memcpy(file.data, data, size);
    file.data[size] = 0;
    if (read(&mesh, &file, "x", NULL, &err)) {
        struct dph_mesh_stats stats;
        require(mesh.ntri > 0);
        for (size_t i = 0; i < 3 * mesh.ntri; i++)
            require(mesh.index[i] < mesh.nvert);
        for (size_t i = 0; i < 3 * mesh.nvert; i++)
            require(isfinite(mesh.position[i]) && (!mesh.normal || isfinite(mesh.normal[i])));
        for (size_t i = 0; mesh.texcoord && i < 2 * mesh.nvert; i++)
            require(isfinite(mesh.texcoord[i]));
        require(dph_mesh_measure(&mesh, &stats, NULL));
        require(dph_mesh_make_normals(&mesh, 60, NULL, NULL));
        dph_mesh_finish(&mesh);
    } else {
        require(err.code != DPH_OK && strncmp(err.message, "x:", 2) == 0 && !strchr(err.message, '\n'));
    }
    dph_file_finish(&file);
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
