/* diaphan/trace.h - rays against a mesh, through Embree.
 *     Tier 2. Only where the library was built with it.
 *
 * Used to check the sweep and to be measured beside it, and by the path-traced reference
 * (reference.h). */
#ifndef DIAPHAN_TRACE_H
#define DIAPHAN_TRACE_H

#include <diaphan/mesh.h>
#include <diaphan/thickness.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A mesh prepared for rays. Safe to query from several threads. */
struct dph_rays;

/* `position` (npos x 3), `index` (ntri x 3); both are copied. NULL: DPH_ERROR_MEMORY or
 * DPH_ERROR_CAPABILITY. */
struct dph_rays *dph_rays_create(const float *position, size_t npos, const uint32_t *index,
                                 size_t ntri, struct dph_error *err);
void dph_rays_destroy(struct dph_rays *rays);

/* Thickness from `norigin` of the mesh's own positions (ids `origin`, NULL: 0, 1, 2, ...) along
 * one unit direction, in the unit of the positions. Triangles that touch the origin by index are
 * skipped. DPH_THICKNESS_FIRST takes the nearest hit (rtcIntersect1): its distance where it is an
 * exit, 0 where it is an entry or where there is none; crossings nearer than a millionth of the
 * mesh's size are not seen. The others collect every hit through a filter: INSIDE is exits minus
 * entries, FARTHEST the last exit or 0. Nothing is mended where the mesh is open: see `balance`.
 * `thickness` (norigin); `balance` (norigin), Nullable: exits minus entries among the hits looked
 * at, for a closed mesh 1 where the ray starts inward. Turns on flush-to-zero for the calling
 * thread and restores its state. */
void dph_rays_thickness(const struct dph_rays *rays, enum dph_definition definition,
                        const uint32_t *origin, size_t norigin, const float direction[3],
                        float *thickness, int *balance);

/* The same for all positions and `count` directions, `direction` (count x 3), on `threads` threads
 * (0: all). `thickness` (count x npos), a row a direction. */
void dph_rays_thickness_all(const struct dph_rays *rays, enum dph_definition definition,
                            const float *direction, size_t count, int threads, float *thickness);

/* Where a ray meets the mesh. */
struct dph_hit {
    double distance;  /* from the origin, in the unit of the positions                             */
    double normal[3]; /* of the triangle, unit length, outward                                     */
};

/* The next four take any origin and a unit direction, in the space and unit of the positions. Every
 * thread that calls them brackets its calls with these: they turn on flush-to-zero and give the
 * state back. */
unsigned int dph_rays_enter(void);
void dph_rays_leave(unsigned int before);

/* The nearest hit at a distance from 0 to `limit` (INFINITY: any). False: none. A hit on the
 * origin's own triangle counts, so a caller starts beside the surface by dph_rays_margin. */
bool dph_rays_nearest(const struct dph_rays *rays, const double origin[3],
                      const double direction[3], double limit, struct dph_hit *hit);

/* Whether there is any hit at a distance from 0 to `limit`. */
bool dph_rays_blocked(const struct dph_rays *rays, const double origin[3],
                      const double direction[3], double limit);

/* How far from a surface, in the unit of the positions, a point must be so that rounding leaves it
 * on its side: a millionth of the mesh's size. */
double dph_rays_margin(const struct dph_rays *rays);

/* All crossings along a ray, nearest first, as parts of the ray inside the bodies. */
#define DPH_MAX_SPANS 128
struct dph_spans {
    int count;
    double span[DPH_MAX_SPANS][2]; /* where a part begins and ends                                 */
    double length;                 /* of all parts                                                 */
    bool inside;                   /* the origin is inside                                         */
    bool overflow;                 /* there were more crossings than are looked at                 */
};

/* Fills `spans`. A point is inside where more bodies are left than entered farther along the ray,
 * so that overlapping bodies count once. An edge that is met twice counts once. */
void dph_rays_spans(const struct dph_rays *rays, const double origin[3], const double direction[3],
                    struct dph_spans *spans);

#ifdef __cplusplus
}
#endif
#endif
