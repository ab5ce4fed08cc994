/* Any bytes through the glTF reader, and through the writer where they are a scene. */
#include "mesh/readers.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct dph_file file = {malloc(size + 1), size};
    struct dph_scene *scene = calloc(1, sizeof *scene);
    struct dph_error err = {0};
    if (file.data && scene) {
        memcpy(file.data, data, size);
        file.data[size] = 0;
        /* the path "" has no folder, so nothing outside is read */
        if (dph_read_gltf(scene, &file, "", &err)) {
            for (size_t i = 0; i < scene->ninstance; i++)
                if (scene->instance[i].body >= scene->nbody)
                    abort();
            for (size_t b = 0; b < scene->nbody; b++)
                for (size_t i = 0; i < 3 * scene->body[b].mesh.ntri; i++)
                    if (scene->body[b].mesh.index[i] >= scene->body[b].mesh.nvert)
                        abort();
            dph_write_gltf(scene, "/dev/null", NULL);
        } else if (err.code == DPH_OK || !*err.message || strchr(err.message, '\n')) {
            abort();
        }
    }
    dph_file_finish(&file);
    dph_scene_destroy(scene);
    return 0;
}
