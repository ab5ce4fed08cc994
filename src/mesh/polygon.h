/* mesh/polygon.h - polygons into triangles.      Tier 1, private. */
#ifndef DPH_MESH_POLYGON_H
#define DPH_MESH_POLYGON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Memory that is used again from polygon to polygon. Starts as zeros. */
struct dph_polygon_work {
    double (*point)[2];
    uint32_t *link; /* next and previous corner */
    size_t capacity;
};

/* Cuts a polygon into n - 2 triangles of corner numbers 0 .. n-1. `vertex` (n) are the rows of
 * `position` that its corners stand for, `stride` the distance between two of them in `vertex`,
 * counted in numbers. A convex one becomes a fan about its first corner, another one that is
 * simple and nearly plane is cut by its ears, anything else becomes a fan. Writes (n - 2) x 3
 * numbers. False: out of memory. */
bool dph_polygon_split(const float *position, const uint32_t *vertex, size_t stride, size_t n,
                       uint32_t *triangle, struct dph_polygon_work *work);

void dph_polygon_finish(struct dph_polygon_work *work);

#endif
