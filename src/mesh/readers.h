/* mesh/readers.h - the file formats, one reader each.      Tier 1, private.
 *
 * A reader gets a file that is in memory already (with a 0 byte beyond its end) and fills what it
 * is handed; `path` is for messages and for files named inside. Every reader treats its input as
 * hostile: counts are checked against the file's size before memory is taken for them. */
#ifndef DPH_MESH_READERS_H
#define DPH_MESH_READERS_H

#include "core/file.h"
#include <diaphan/scene.h>

/* Fill a mesh as the file has it: normals where every corner has one, else NULL. False: see
 * dph_scene_load. `warn` may be used for dph_scene_warn. */
bool dph_read_obj(struct dph_mesh *mesh, const struct dph_file *file, const char *path,
                  struct dph_scene *warn, struct dph_error *err);
bool dph_read_ply(struct dph_mesh *mesh, const struct dph_file *file, const char *path,
                  struct dph_scene *warn, struct dph_error *err);
bool dph_read_stl(struct dph_mesh *mesh, const struct dph_file *file, const char *path,
                  struct dph_scene *warn, struct dph_error *err);

/* Fills the bodies, instances, document and mm_per_unit of an empty scene from .gltf or .glb. The
 * document may take over the file's memory; `file` is empty then. A `path` of "" follows no
 * external files. */
bool dph_read_gltf(struct dph_scene *scene, struct dph_file *file, const char *path,
                   struct dph_error *err);

/* Writers of bare meshes. */
bool dph_write_obj(const struct dph_mesh *mesh, const char *path, struct dph_error *err);
bool dph_write_ply(const struct dph_mesh *mesh, const char *path, struct dph_error *err);
bool dph_write_stl(const struct dph_mesh *mesh, const char *path, struct dph_error *err);

/* GLB from any scene, with its document where it has one. */
bool dph_write_gltf(const struct dph_scene *scene, const char *path, struct dph_error *err);

/* Frees a document; accepts NULL. */
void dph_document_destroy(struct dph_document *document);

#endif
