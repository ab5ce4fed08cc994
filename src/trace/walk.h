/* trace/walk.h - random walks inside closed bodies.      Tier 2, private. */
#ifndef DPH_TRACE_WALK_H
#define DPH_TRACE_WALK_H

#include <diaphan/trace.h>

#include "trace/clearance.h"
#include "trace/medium.h"

/* Bodies of one medium with a matched boundary. Read-only for walks. Lengths are in mm. */
struct dph_space {
    struct dph_rays *rays;
    struct dph_clearance clearance; /* zeroed: none, which is only slower                          */
    struct dph_volume volume;
    double margin; /* distance at which rounding cannot lead across a surface                      */
};

/* Prepares rays and clearance for `volume`, which is set. False: as dph_rays_create. The space is
 * finished by the caller either way. */
bool dph_space_init(struct dph_space *space, const float *position, size_t npos,
                    const uint32_t *index, size_t ntri, int threads, struct dph_error *err);
void dph_space_finish(struct dph_space *space);

/* How a walk ended. */
enum dph_ending {
    DPH_ENDING_PLAIN = 0, /* absorbed                                                              */
    DPH_ENDING_LEFT,      /* of the bodies for good                                                */
    DPH_ENDING_LOST,      /* rounding or an open body led it astray                                */
    DPH_ENDING_CAPPED,    /* after DPH_MAX_SCATTERINGS                                             */
};

/* Called at every scattering, `flight` being the direction before it. False: the walk is lost. */
typedef bool dph_walk_visit(void *user, const struct dph_walk *walk, struct dph_random *random,
                            const double point[3], const double flight[3]);

/* Where a ray from a point inside, flown for a length inside the bodies, ends: not nearer to a
 * surface than the margin where there is room. Moves `point`. */
void dph_space_place(const struct dph_space *space, const struct dph_spans *spans, double length,
                     const double direction[3], double point[3]);

/* Goes on with a walk until it ends. `scattered`: it begins with a scattering at `point`, which it
 * reached along `flight`; otherwise with a flight along `flight`. `point` is inside by the margin.
 * At the end `point` is the last scattering (or the beginning), and after DPH_ENDING_LEFT `flight`
 * is the direction in which it left, dph_walk_weight its weight. `visit`: Nullable.
 *
 * To start at a surface, along any direction that goes in: dph_walk_begin, a point beside the
 * surface by the margin, `scattered` false. Every thread brackets its walks with dph_rays_enter
 * and dph_rays_leave. */
enum dph_ending dph_walk_run(const struct dph_space *space, struct dph_walk *walk,
                             struct dph_random *random, bool scattered, double point[3],
                             double flight[3], dph_walk_visit *visit, void *user);

/* A lower bound of the distance to every surface. */
static inline double dph_space_clear(const struct dph_space *space, const double point[3])
{
    ptrdiff_t cell = dph_clearance_cell(&space->clearance, point);
    return cell < 0 ? 0 : space->clearance.bound[cell] * space->clearance.unit;
}

#endif
