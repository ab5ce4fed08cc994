/* diaphan/mesh.h - triangle meshes in memory: welding, normals, closedness, the candle. Tier 1.
 *
 * Not here: files (scene.h). Coordinates are right-handed, in whatever unit the caller uses;
 * triangles are counter-clockwise seen from outside. A "vertex" is a row of the arrays; a
 * "position" is a distinct point: vertices with equal coordinates share one. */
#ifndef DIAPHAN_MESH_H
#define DIAPHAN_MESH_H

#include <diaphan/error.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A triangle mesh that owns its arrays (malloc; released by dph_mesh_finish).
 * Safe to read from several threads, not to change. */
struct dph_mesh {
    size_t nvert;
    size_t ntri;
    float *position;  /* (nvert x 3)                                                       */
    float *normal;    /* (nvert x 3) unit length. Nullable: faces are flat                 */
    float *texcoord;  /* (nvert x 2) as in glTF, the second counts downward. Nullable      */
    uint32_t *index;  /* (ntri x 3), each < nvert                                          */
};

/* Allocates the arrays of an empty mesh, uninitialised; `normal` and `texcoord` only if asked
 * for. False: DPH_ERROR_MEMORY or DPH_ERROR_LIMIT (more than 2^31 vertices or triangles), and
 * the mesh is empty. */
bool dph_mesh_init(struct dph_mesh *mesh, size_t nvert, size_t ntri, bool normal, bool texcoord,
                   struct dph_error *err);

/* Frees the arrays and empties the mesh. Accepts an empty mesh. */
void dph_mesh_finish(struct dph_mesh *mesh);

/* Numbers the distinct positions of `nvert` vertices in order of first appearance. `stride` is
 * the distance in bytes from one vertex's three floats to the next; -0 equals +0, nothing else
 * is rounded. Writes the position of each vertex to `position_of` (nvert) and returns their
 * count. SIZE_MAX: DPH_ERROR_MEMORY, or DPH_ERROR_INPUT for a number that is not finite. */
size_t dph_mesh_weld(const float *position, size_t stride, size_t nvert, uint32_t *position_of,
                     struct dph_error *err);

/* Makes one of all vertices that are equal in every array (-0 equals +0, nothing else is rounded), in
 * order of first appearance; the arrays keep their memory. Triangles stay as they are and in their
 * order. False: DPH_ERROR_MEMORY, and the mesh is unchanged. */
bool dph_mesh_share(struct dph_mesh *mesh, struct dph_error *err);

/* What a mesh is made of, after welding by exact position. Edges are counted over triangles that
 * have three distinct positions. */
struct dph_mesh_stats {
    size_t positions;         /* distinct positions that a triangle uses                       */
    size_t degenerate;        /* triangles with two or three equal positions                   */
    size_t boundary_edges;    /* edges with one triangle                                       */
    size_t nonmanifold_edges; /* edges with three or more                                      */
    size_t flipped_edges;     /* edges with two triangles that run along it the same way       */
    size_t components;        /* bodies connected by shared positions                          */
    bool closed;              /* no boundary, non-manifold or flipped edge, at least one triangle */
    double area;              /* unit^2                                                        */
    double volume;            /* unit^3, signed; positive where triangles face outward         */
    double bounds[2][3];      /* minimum and maximum of the vertices that triangles use        */
};

/* Fills `stats`. False: DPH_ERROR_MEMORY or DPH_ERROR_INPUT. */
bool dph_mesh_measure(const struct dph_mesh *mesh, struct dph_mesh_stats *stats, struct dph_error *err);

/* Angle-weighted unit normals, one per position (Thuermer, Wuethrich 1998), for `nvert` vertices
 * that share position ids as dph_mesh_weld gives them. `normal_out` is (npos x 3); a position
 * without area, or whose faces cancel, gets (0, 0, 1). */
void dph_mesh_position_normals(const float *position /* (npos x 3) */, size_t npos,
                               const uint32_t *index /* (ntri x 3), < npos */, size_t ntri,
                               float *normal_out);

/* Replaces a mesh's normals by angle-weighted ones, splitting vertices where two faces meet at
 * more than `crease_degrees` (0: every face flat; 180: all smooth). Faces are averaged per
 * connected smooth fan around a position. `vertex_of`: Nullable; receives a malloc'ed array (new
 * nvert) of the old vertex of each new one, which the caller frees. Old vertices keep their
 * numbers and their order, copies come after them; one that no triangle uses gets (0, 0, 1).
 * False: DPH_ERROR_MEMORY, _INPUT (a position that is not finite) or _LIMIT (more than 2^32 / 3
 * triangles), and the mesh is unchanged. */
bool dph_mesh_make_normals(struct dph_mesh *mesh, double crease_degrees, uint32_t **vertex_of,
                           struct dph_error *err);

/* Reverses every triangle (and the normals, where there are any). */
void dph_mesh_flip(struct dph_mesh *mesh);

/* The candle of the paper's experiment: a closed, procedural body with rim, molten hollow and
 * drips, 59,704 triangles, with unshared vertices (179,112; index is 0, 1, 2, ...), smooth
 * normals, y up, standing on y = 0 and 2 units tall. The same numbers on every machine. */
bool dph_mesh_init_candle(struct dph_mesh *mesh, struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
