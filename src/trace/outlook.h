/* trace/outlook.h - from where inside the bodies a light is worth asking for.  Tier 2, private. */
#ifndef DPH_TRACE_OUTLOOK_H
#define DPH_TRACE_OUTLOOK_H

#include "trace/walk.h"

/* For every light and every cell of a grid about how much of the light comes there straight. Only
 * chances are derived from it, so it need not be right. */
struct dph_outlook {
    int nlight;
    double low[3], cells;
    int size[3];
    uint8_t *depth;        /* (size[2] x size[1] x size[0] x nlight) inside length, in `unit`      */
    double unit;           /* mm                                                                   */
    double passed[256];    /* exp(-extinction * unit * i) of the thinnest channel                  */
    double cleared[256];   /* the same of the clearance's unit                                     */
};

/* `direction` (nlight x 3): towards each light, unit length. False: DPH_ERROR_MEMORY. */
bool dph_outlook_init(struct dph_outlook *outlook, const struct dph_space *space,
                      const double *direction, int nlight, int threads, struct dph_error *err);
void dph_outlook_finish(struct dph_outlook *outlook);

/* Depths of a point's cell (nlight), NULL beyond the grid. */
static inline const uint8_t *dph_outlook_at(const struct dph_outlook *outlook,
                                            const double point[3])
{
    double x = (point[0] - outlook->low[0]) * outlook->cells;
    double y = (point[1] - outlook->low[1]) * outlook->cells;
    double z = (point[2] - outlook->low[2]) * outlook->cells;
    const int *n = outlook->size;
    if (!(x >= 0 && y >= 0 && z >= 0 && x < n[0] && y < n[1] && z < n[2]))
        return NULL;
    size_t cell = ((size_t)z * (size_t)n[1] + (size_t)y) * (size_t)n[0] + (size_t)x;
    return outlook->depth + cell * (size_t)outlook->nlight;
}

#endif
