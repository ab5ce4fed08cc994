/* diaphan/scene.h - files: meshes in, baked glTF out.      Tier 2.
 *
 * Reads glTF 2.0 (.gltf, .glb), Wavefront OBJ, PLY and STL; writes GLB with thickness as vertex
 * attributes, and bare meshes. A body is what is baked as one: all triangle primitives of one glTF
 * mesh, or all faces of a file of another format. An instance is a body placed in the scene by a
 * node. Every input is treated as hostile. */
#ifndef DIAPHAN_SCENE_H
#define DIAPHAN_SCENE_H

#include <diaphan/mesh.h>
#include <diaphan/thickness.h>

#ifdef __cplusplus
extern "C" {
#endif

struct dph_rivals; /* diaphan/rivals.h */
void dph_rivals_destroy(struct dph_rivals *rivals); /* accepts NULL */

/* One body, in its own space and unit. For a glTF mesh `mesh` is the concatenation, in file order,
 * of its triangle primitives' vertices, row for row (so that attributes can be written back), and
 * of their triangles. normal is NULL where the file has none and the format says flat (glTF); other
 * formats get angle-weighted normals with a crease of 60 degrees. */
struct dph_body {
    char *name;                      /* never NULL, may be empty                             */
    struct dph_mesh mesh;
    struct dph_thickness *thickness; /* (mesh.nvert rows). Nullable: not baked               */
    struct dph_rivals *rivals;       /* what other methods need. Nullable: not baked         */
};

/* A body in the scene: world = matrix * body space. */
struct dph_instance {
    size_t body;
    float matrix[16]; /* column-major, affine */
};

struct dph_document; /* the glTF file of a scene, kept so that it can be written back whole */

/* A loaded file. Owns everything in it. Safe to read from several threads. */
struct dph_scene {
    size_t nbody;
    struct dph_body *body;         /* (nbody)                                                */
    size_t ninstance;
    struct dph_instance *instance; /* (ninstance), those of the default scene                */
    double bounds[2][3];           /* of all instances, world space                          */
    double mm_per_unit;            /* of the scene, from a baked file; 0: not known          */
    size_t nwarning;
    char **warning;                /* (nwarning) whole sentences for the user                */
    struct dph_document *document; /* Nullable: not from glTF                                */
};

/* Loads `path`, whatever its format (told by its content, then by its ending). Meshes come in their
 * rest pose: skinned ones in their bind pose without the node's transform, morph targets not
 * applied. A closed body of negative volume (in its own space) is turned inside out in memory, with
 * a warning; saving leaves a document's triangles as they were. Draco-compressed geometry is
 * refused. Limits: 2^31 vertices or triangles, files of 4 GiB.
 * NULL: DPH_ERROR_INPUT, _UNSUPPORTED (with the mend), _LIMIT or _MEMORY, the message beginning
 * with file and place. */
struct dph_scene *dph_scene_load(const char *path, struct dph_error *err);

/* A scene of one body and one instance from a mesh, which is moved into it (and emptied). `name` is
 * copied.
 * NULL: DPH_ERROR_MEMORY, and the mesh is unchanged. */
struct dph_scene *dph_scene_from_mesh(struct dph_mesh *mesh, const char *name,
                                      struct dph_error *err);

/* Frees it; accepts NULL. */
void dph_scene_destroy(struct dph_scene *scene);

/* Adds a printf-formatted sentence to scene->warning. False: DPH_ERROR_MEMORY, nothing is added. */
bool dph_scene_warn(struct dph_scene *scene, const char *format, ...);

/* Largest side of scene->bounds, in the scene's unit. */
double dph_scene_size(const struct dph_scene *scene);

/* Writes the scene as GLB, or, for an ending other than .glb on a scene without glTF document, as
 * bare mesh (.obj, .ply, .stl: the first body only). A document comes back with everything that was
 * in it; bodies with thickness gain the attributes and extras that docs/file-format.md describes.
 * The file appears whole or not at all.
 * False: DPH_ERROR_OUTPUT, DPH_ERROR_ARGUMENT (an ending that is not known, or thickness of another
 * number of vertices than the body has) or DPH_ERROR_MEMORY. */
bool dph_scene_save(const struct dph_scene *scene, const char *path, struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
