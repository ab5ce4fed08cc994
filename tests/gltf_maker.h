/* glTF made in memory, for the tests of its reader and writer. JSON is written with ' for ", which
 * C strings like better. */
#ifndef DPH_TESTS_GLTF_MAKER_H
#define DPH_TESTS_GLTF_MAKER_H

#include "mesh/readers.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A copy of `text` with ' turned into ", and the first `find` (Nullable) into `replace`. Aborts
 * where `find` is not there. */
static inline char *maker_json(const char *text, const char *find, const char *replace)
{
    const char *at = find ? strstr(text, find) : NULL;
    if (find && !at) {
        fprintf(stderr, "the text to replace is not there: %s\n", find);
        abort();
    }
    size_t head = at ? (size_t)(at - text) : strlen(text), extra = at ? strlen(replace) : 0;
    const char *tail = at ? at + strlen(find) : "";
    char *out = malloc(head + extra + strlen(tail) + 1);
    if (!out)
        abort();
    memcpy(out, text, head);
    if (at)
        memcpy(out + head, replace, extra);
    memcpy(out + head + extra, tail, strlen(tail) + 1);
    for (char *c = out; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    return out;
}

static inline void maker_u32(unsigned char *p, size_t value)
{
    for (int i = 0; i < 4; i++)
        p[i] = (unsigned char)(value >> 8 * i);
}

/* A GLB of JSON (with ") and, where `bin_size` is not 0, a BIN chunk. */
static inline struct dph_file maker_glb(const char *json, const void *bin, size_t bin_size)
{
    size_t text = strlen(json), json_size = (text + 3) & ~(size_t)3;
    size_t padded = (bin_size + 3) & ~(size_t)3;
    struct dph_file file = {.size = 20 + json_size + (bin_size ? 8 + padded : 0)};
    file.data = calloc(file.size + 1, 1);
    if (!file.data)
        abort();
    memcpy(file.data, "glTF\2\0\0", 8);
    maker_u32(file.data + 8, file.size);
    maker_u32(file.data + 12, json_size);
    memcpy(file.data + 16, "JSON", 4);
    memset(file.data + 20, ' ', json_size);
    memcpy(file.data + 20, json, text);
    if (bin_size) {
        unsigned char *chunk = file.data + 20 + json_size;
        maker_u32(chunk, padded);
        memcpy(chunk + 4, "BIN", 4);
        memcpy(chunk + 8, bin, bin_size);
    }
    return file;
}

/* Reads a file in memory (and frees it) as "made.glb". */
static inline struct dph_scene *maker_read(struct dph_file file, struct dph_error *err)
{
    struct dph_scene *scene = calloc(1, sizeof *scene);
    if (!scene)
        abort();
    bool ok = dph_read_gltf(scene, &file, "made.glb", err);
    dph_file_finish(&file);
    if (ok)
        return scene;
    dph_scene_destroy(scene);
    return NULL;
}

/* Reads JSON (with ') and a binary chunk. */
static inline struct dph_scene *maker_load(const char *text, const void *bin, size_t bin_size,
                                           struct dph_error *err)
{
    char *json = maker_json(text, NULL, NULL);
    struct dph_scene *scene = maker_read(maker_glb(json, bin, bin_size), err);
    free(json);
    return scene;
}

/* A tetrahedron with thickness in two bands: positions, 16-bit and 8-bit indices, coefficients. */
struct maker_tetra {
    float position[4][3];
    uint16_t wide[12];
    uint8_t narrow[12];
    int8_t thickness[4][4];
};

static const struct maker_tetra maker_tetra = {
    {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}},
    {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3},
    {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3},
    {{127, 0, -127, 64}, {1, 2, 3, 4}, {-5, -6, -7, -8}, {100, -100, 50, -50}},
};

static const char maker_tetra_json[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],"
    "'nodes':[{'mesh':0,'children':[1]},{'mesh':0,'translation':[1,2,3]}],"
    "'meshes':[{'name':'tetra','primitives':[{'attributes':{'POSITION':0,'_THICKNESS_SH_0':2},"
    "'indices':1,'extras':{'diaphan':{'thickness_sh':{'version':1,'bands':2,'order':'l*(l+1)+m',"
    "'condon_shortley':true,'scale':[1,0.5],'definition':'inside','fit':'weighted',"
    "'directions':64,'mm_per_unit':2}}}}]}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'},"
    "{'bufferView':1,'componentType':5123,'count':12,'type':'SCALAR'},"
    "{'bufferView':2,'componentType':5120,'normalized':true,'count':4,'type':'VEC4'}],"
    "'bufferViews':[{'buffer':0,'byteOffset':0,'byteLength':48},"
    "{'buffer':0,'byteOffset':48,'byteLength':24},"
    "{'buffer':0,'byteOffset':84,'byteLength':16}],'buffers':[{'byteLength':100}]}";

#endif
