/* A random walk through bodies with a matched boundary, which it crosses straight.
 *
 * A flight that is shorter than the clearance of its start meets no surface and needs no ray. Of
 * the others a ray as long as the flight is asked first, and only where that meets a surface all
 * crossings of the whole ray are gathered. The flight then runs along the ray's parts inside, over
 * gaps and through several bodies, so that a walk never starts on a surface. */
#include "trace/walk.h"

#include "core/fail.h"

#include <math.h>

bool dph_space_init(struct dph_space *space, const float *position, size_t npos,
                    const uint32_t *index, size_t ntri, int threads, struct dph_error *err)
{
    /* cells of a quarter of the shortest mean free path: finer ones spare few rays */
    const double *extinction = space->volume.extinction;
    double densest = fmax(extinction[0], fmax(extinction[1], extinction[2]));
    double cell = densest > 0 ? .25 / densest : INFINITY;
    if (!(space->rays = dph_rays_create(position, npos, index, ntri, err)))
        return false;
    space->margin = dph_rays_margin(space->rays);
    return dph_clearance_init(&space->clearance, position, npos, index, ntri, cell, threads, err);
}

void dph_space_finish(struct dph_space *space)
{
    dph_rays_destroy(space->rays);
    dph_clearance_finish(&space->clearance);
    space->rays = NULL;
}

void dph_space_place(const struct dph_space *space, const struct dph_spans *spans, double length,
                     const double direction[3], double point[3])
{
    int i = 0;
    for (; i + 1 < spans->count && length > spans->span[i][1] - spans->span[i][0]; i++)
        length -= spans->span[i][1] - spans->span[i][0];
    double room = spans->span[i][1] - spans->span[i][0], side = fmin(space->margin, room / 2);
    bool first = i == 0 && spans->inside; /* begins at the path's last point, not at a surface */
    length = fmin(fmax(length, first ? 0 : side), room - side);
    for (int k = 0; k < 3; k++)
        point[k] += (spans->span[i][0] + length) * direction[k];
}

enum dph_ending dph_walk_run(const struct dph_space *space, struct dph_walk *walk,
                             struct dph_random *random, bool scattered, double point[3],
                             double flight[3], dph_walk_visit *visit, void *user)
{
    const struct dph_volume *volume = &space->volume;
    for (;; scattered = true) {
        if (scattered) {
            if (visit && !visit(user, walk, random, point, flight))
                return DPH_ENDING_LOST;
            if (!dph_walk_survive(walk, volume, random))
                return DPH_ENDING_PLAIN;
            if (walk->scatterings >= DPH_MAX_SCATTERINGS)
                return DPH_ENDING_CAPPED;
            dph_phase_sample(random, volume->anisotropy, flight);
        }
        double length = dph_walk_flight(walk, volume, random), reach = length + space->margin;
        if (reach <= dph_space_clear(space, point) ||
            (isfinite(length) && !dph_rays_blocked(space->rays, point, flight, reach))) {
            for (int k = 0; k < 3; k++)
                point[k] += length * flight[k];
        } else {
            struct dph_spans spans;
            dph_rays_spans(space->rays, point, flight, &spans);
            if (spans.overflow || !spans.inside)
                return DPH_ENDING_LOST;
            if (length >= spans.length) {
                dph_walk_pass(walk, spans.length);
                return DPH_ENDING_LEFT;
            }
            dph_space_place(space, &spans, length, flight, point);
        }
        dph_walk_scatter(walk, volume, length);
    }
}
