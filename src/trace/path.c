/* One path of light against its way, from the camera through the bodies.
 *
 * Matched boundary. A camera ray goes straight through; what is behind counts exp(-st S), S being
 * the length of the ray inside. The rest, 1 - exp(-st S), is a path whose first scattering lies on
 * the ray. At every scattering each light adds
 *
 *     w p(L) exp(-st S(x, L)) E                                      (next-event estimation)
 *
 * and the surroundings are added where the path leaves for good. A ray through gaps and several
 * bodies is marched along its parts inside, so that a path never starts on a surface. Flights are
 * short in dense media: a ray as long as the flight is asked first, and only where that meets a
 * surface the whole ray is gathered. Rays to lights do the same with four mean free paths, and of
 * those that find nothing (their light is below exp(-4)) one in ten goes on and counts tenfold.
 *
 * Dielectric boundary. At a surface the path is reflected or refracted by chance with Fresnel's
 * share. Radiance over the square of the index is what stays the same across a boundary, and a path
 * begins and ends in air, so the weight stays 1. Lights are discs and are met by paths that leave.
 * Paths restart beside the surface by a margin that rounding cannot cross; inner walls of bodies
 * that overlap are passed. */
#include "trace/reference.h"

#include <math.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void advance(double point[3], const double direction[3], double length)
{
    for (int k = 0; k < 3; k++)
        point[k] += length * direction[k];
}

static void add_background(const struct dph_stage *stage, const double weight[3], double *radiance)
{
    for (int i = 0; i < 3 * stage->npicture; i++)
        radiance[i] += weight[i % 3] * stage->background[i % 3];
}

static void add_weighted(double radiance[3], const double weight[3], const double light[3])
{
    for (int c = 0; c < 3; c++)
        radiance[c] += weight[c] * light[c];
}

/* What a path that has met a body sees in the sky. Suns that are points have no radiance. */
static void add_sky(const struct dph_stage *stage, const double direction[3],
                    const double weight[3], bool surroundings, bool suns, double *radiance)
{
    if (stage->environment && surroundings) {
        double sky[3] = {0, 0, 0};
        stage->environment(stage->environment_user, direction, sky);
        add_weighted(radiance + 3 * stage->surroundings, weight, sky);
    }
    for (int i = 0; i < stage->nsun && suns; i++)
        if (stage->sun[i].cosine < 1 &&
            dot(direction, stage->sun[i].to_light) >= stage->sun[i].cosine)
            add_weighted(radiance + 3 * stage->sun[i].picture, weight, stage->sun[i].radiance);
}

/* Light of all suns at a scattering point. */
static enum dph_ending add_suns(const struct dph_stage *stage, const struct dph_walk *walk,
                                struct dph_random *random, const double point[3],
                                const double flight[3], double *radiance)
{
    static const double BEYOND = .1; /* of the rays that a short look finds dark */
    const struct dph_volume *volume = &stage->volume;
    for (int i = 0; i < stage->nsun; i++) {
        const struct dph_sun *sun = &stage->sun[i];
        double to[3] = {sun->to_light[0], sun->to_light[1], sun->to_light[2]};
        double weight[3], factor = 1;
        struct dph_spans spans;
        struct dph_hit hit;
        if (sun->cosine < 1)
            dph_cone_sample(random, sun->to_light, sun->cosine, to);
        if (volume->thinnest > 0 &&
            !dph_rays_nearest(stage->rays, point, to, 4 / volume->thinnest, &hit)) {
            if (dph_random_next(random) >= BEYOND)
                continue;
            factor = 1 / BEYOND;
        }
        dph_rays_spans(stage->rays, point, to, &spans);
        if (spans.overflow || !spans.inside)
            return DPH_ENDING_LOST;
        /* the disc's solid angle times its radiance, which is more than the irradiance on a plane */
        factor *= dph_phase(volume->anisotropy, dot(flight, to)) * sun->even;
        dph_walk_weight(walk, weight);
        for (int c = 0; c < 3; c++)
            weight[c] *= factor * exp(-volume->extinction[c] * spans.length);
        add_weighted(radiance + 3 * sun->picture, weight, sun->irradiance);
    }
    return DPH_ENDING_PLAIN;
}

/* The point at a length inside along a ray, not nearer to a surface than the margin where there is
 * room. */
static void place(const struct dph_spans *spans, double length, double margin,
                  const double direction[3], double point[3])
{
    int i = 0;
    for (; i + 1 < spans->count && length > spans->span[i][1] - spans->span[i][0]; i++)
        length -= spans->span[i][1] - spans->span[i][0];
    double room = spans->span[i][1] - spans->span[i][0], side = fmin(margin, room / 2);
    bool first = i == 0 && spans->inside; /* begins at the path's last point, not at a surface */
    length = fmin(fmax(length, first ? 0 : side), room - side);
    advance(point, direction, spans->span[i][0] + length);
}

static enum dph_ending matched(const struct dph_stage *stage, struct dph_random *random,
                               const double origin[3], const double direction[3],
                               double *radiance, bool *covered)
{
    const struct dph_volume *volume = &stage->volume;
    double point[3] = {origin[0], origin[1], origin[2]};
    double flight[3] = {direction[0], direction[1], direction[2]}, weight[3];
    struct dph_spans spans;
    struct dph_walk walk;
    dph_rays_spans(stage->rays, point, flight, &spans);
    *covered = spans.count > 0;
    if (spans.overflow)
        return DPH_ENDING_LOST;
    for (int c = 0; c < 3; c++)
        weight[c] = exp(-volume->extinction[c] * spans.length);
    add_background(stage, weight, radiance);
    if (!*covered)
        return DPH_ENDING_PLAIN;
    add_sky(stage, flight, weight, false, true, radiance);

    dph_walk_begin(&walk, random);
    double extinction = volume->extinction[walk.hero];
    double share = -expm1(-extinction * spans.length);
    if (!(share > 0))
        return DPH_ENDING_PLAIN;
    double length = fmin(-log1p(-dph_random_next(random) * share) / extinction, spans.length);
    place(&spans, length, stage->margin, flight, point);
    /* the density of a first scattering that is sure to happen is larger by the chance that a free
     * flight has of one, in each channel */
    for (int c = 0; c < 3; c++) {
        double chance = -expm1(-volume->extinction[c] * spans.length);
        walk.carried[c] *= chance;
        walk.share[c] = chance > 0 ? share / chance : 0;
    }
    dph_walk_scatter(&walk, volume, length);
    for (;;) {
        enum dph_ending ending = add_suns(stage, &walk, random, point, flight, radiance);
        if (ending != DPH_ENDING_PLAIN)
            return ending;
        dph_phase_sample(random, volume->anisotropy, flight);
        if (!dph_walk_survive(&walk, random))
            return DPH_ENDING_PLAIN;
        if (walk.scatterings >= DPH_MAX_SCATTERINGS)
            return DPH_ENDING_CAPPED;
        struct dph_hit hit;
        length = dph_walk_flight(&walk, volume, random);
        if (!dph_rays_nearest(stage->rays, point, flight, length + stage->margin, &hit)) {
            if (!isfinite(length))
                return DPH_ENDING_LOST;
            advance(point, flight, length);
        } else {
            dph_rays_spans(stage->rays, point, flight, &spans);
            if (spans.overflow || !spans.inside)
                return DPH_ENDING_LOST;
            if (length >= spans.length) {
                dph_walk_pass(&walk, volume, spans.length);
                dph_walk_weight(&walk, weight);
                add_sky(stage, flight, weight, true, false, radiance);
                return DPH_ENDING_PLAIN;
            }
            place(&spans, length, stage->margin, flight, point);
        }
        dph_walk_scatter(&walk, volume, length);
    }
}

static enum dph_ending dielectric(const struct dph_stage *stage, struct dph_random *random,
                                  const double origin[3], const double direction[3],
                                  double *radiance, bool *covered)
{
    const struct dph_volume *volume = &stage->volume;
    double point[3] = {origin[0], origin[1], origin[2]};
    double flight[3] = {direction[0], direction[1], direction[2]}, weight[3];
    int depth = 0; /* bodies that the point is in */
    struct dph_walk walk;
    *covered = false;
    dph_walk_begin(&walk, random);
    for (int events = 0; events < DPH_MAX_SCATTERINGS; events++) {
        struct dph_hit hit;
        double length = depth > 0 ? dph_walk_flight(&walk, volume, random) : INFINITY;
        if (!dph_rays_nearest(stage->rays, point, flight, length + stage->margin, &hit)) {
            if (!depth && !*covered) {
                const double one[3] = {1, 1, 1};
                add_background(stage, one, radiance);
                return DPH_ENDING_PLAIN;
            }
            if (!depth) {
                dph_walk_weight(&walk, weight);
                add_sky(stage, flight, weight, true, true, radiance);
                return DPH_ENDING_PLAIN;
            }
            if (!isfinite(length))
                return DPH_ENDING_LOST;
        } else if (depth && length < hit.distance) {
            /* within the margin of the surface: stays on this side of it */
            length = fmax(0, fmin(length, hit.distance - stage->margin));
        } else {
            bool out = dot(flight, hit.normal) > 0;
            advance(point, flight, hit.distance);
            if (depth)
                dph_walk_pass(&walk, volume, hit.distance);
            *covered = true;
            if (out && !depth)
                return DPH_ENDING_LOST; /* a body's wall from inside, without having entered */
            if (depth > 1 || (depth && !out)) {
                depth += out ? -1 : 1;
                advance(point, hit.normal, out ? stage->margin : -stage->margin);
                continue;
            }
            double against[3];
            for (int k = 0; k < 3; k++)
                against[k] = out ? -hit.normal[k] : hit.normal[k];
            bool through = dph_boundary_sample(random, out ? 1 / stage->eta : stage->eta, against,
                                               flight);
            depth = through ? !depth : depth;
            advance(point, hit.normal, depth ? -stage->margin : stage->margin);
            continue;
        }
        advance(point, flight, length);
        if (dot(point, point) > 1.1 * stage->radius * stage->radius)
            return DPH_ENDING_LOST;
        dph_walk_scatter(&walk, volume, length);
        if (!dph_walk_survive(&walk, random))
            return DPH_ENDING_PLAIN;
        dph_phase_sample(random, volume->anisotropy, flight);
    }
    return DPH_ENDING_CAPPED;
}

enum dph_ending dph_path_trace(const struct dph_stage *stage, struct dph_random *random,
                               const double origin[3], const double direction[3],
                               double *radiance, bool *covered)
{
    if (stage->boundary == DPH_BOUNDARY_DIELECTRIC)
        return dielectric(stage, random, origin, direction, radiance, covered);
    return matched(stage, random, origin, direction, radiance, covered);
}
