/* One path of light against its way, from the camera through the bodies.
 *
 * Matched boundary. A camera ray goes straight through; what is behind counts exp(-st S), S being
 * the length of the ray inside. The rest, 1 - exp(-st S), is a path whose first scattering lies on
 * the ray and that goes on as walk.h says. At every scattering each light adds
 *
 *     w p(L) exp(-st S(x, L)) E                                      (next-event estimation)
 *
 * and the surroundings are added where the path leaves for good. Rays to lights are cast by chance
 * (outlook.h), so that each has about the same to bring: see add_suns.
 *
 * Averaged over views. The camera ray only says which point of the surface is seen; the path goes on
 * from there in a direction w distributed as the cosine about the inward normal, max(0, -n.w) / pi,
 * so that its mean is the radiance that leaves the point, averaged over the directions in which it
 * leaves. Now light that is not scattered comes from a light as well,
 *
 *     E max(0, -n.L) / pi exp(-st S(x, L)),
 *
 * again with a ray by chance, and what leaves along w sees the surroundings.
 *
 * Dielectric boundary. At a surface the path is reflected or refracted by chance with Fresnel's
 * share. Radiance over the square of the index is what stays the same across a boundary, and a path
 * begins and ends in air, so the weight stays 1. Lights are discs and are met by paths that leave.
 * Paths restart beside the surface by a margin that rounding cannot cross; inner walls of bodies
 * that overlap are passed. */
#include "trace/reference.h"

#include <math.h>

#define PI 3.14159265358979323846

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void advance(double point[3], const double direction[3], double length)
{
    for (int k = 0; k < 3; k++)
        point[k] += length * direction[k];
}

/* What comes through along a ray without being scattered, by channel. */
static void pass(const struct dph_stage *stage, const struct dph_spans *spans, double weight[3])
{
    for (int c = 0; c < 3; c++)
        weight[c] = exp(-stage->space.volume.extinction[c] * spans->length);
}

static void add_background(const struct dph_stage *stage, const double weight[3],
                           double *radiance)
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

/* A path, where its light goes, and how much of a ray each light is due. */
struct tracing {
    const struct dph_stage *stage;
    double *radiance;
    double due[DPH_MAX_SUNS];
};

/* Light of the suns at a scattering point, each by a chance that follows what it may bring. Along
 * the path the chances of a light are added up, from a random beginning, and a ray is cast whenever
 * the sum comes to a whole number: systematic sampling. Each scattering has just its chance, and
 * the number of rays of a path varies by less than one. */
static bool add_suns(void *user, const struct dph_walk *walk, struct dph_random *random,
                     const double point[3], const double flight[3])
{
    /* EAGER: chance where all light comes through. CAREFUL: least share of the chance that the
     * clearance alone would give. Where that is below 1 / OFTEN all lights are skipped by chance. */
    static const double EAGER = 1.5, CAREFUL = .02, OFTEN = 16;
    struct tracing *tracing = user;
    const struct dph_stage *stage = tracing->stage;
    const struct dph_volume *volume = &stage->space.volume;
    const struct dph_outlook *outlook = &stage->outlook;
    const struct dph_clearance *clearance = &stage->space.clearance;
    ptrdiff_t cell = dph_clearance_cell(clearance, point);
    double clear = cell < 0 ? 1 : outlook->cleared[clearance->bound[cell]];
    double reach = EAGER * fmax(walk->carried[0], fmax(walk->carried[1], walk->carried[2]));
    double often = OFTEN * reach * clear, weight[3];
    bool weighed = false;
    if (often < 1) {
        if (dph_random_next(random) >= often)
            return true;
        reach /= often;
    } else {
        often = 1;
    }
    const uint8_t *depth = dph_outlook_at(outlook, point);
    for (int i = 0; i < stage->nsun; i++) {
        double share = depth ? fmin(fmax(outlook->passed[depth[i]], CAREFUL * clear), clear) : clear;
        double chance = fmin(reach * share, 1);
        tracing->due[i] += chance;
        if (tracing->due[i] < 1)
            continue;
        tracing->due[i] -= 1;
        const struct dph_sun *sun = &stage->sun[i];
        double to[3] = {sun->to_light[0], sun->to_light[1], sun->to_light[2]}, value[3];
        struct dph_spans spans;
        if (sun->cosine < 1)
            dph_cone_sample(random, sun->to_light, sun->cosine, to);
        dph_rays_spans(stage->space.rays, point, to, &spans);
        if (spans.overflow || !spans.inside)
            return false;
        if (!weighed)
            dph_walk_weight(walk, volume, weight);
        weighed = true;
        /* the disc's solid angle times its radiance, which is more than the irradiance on a plane */
        double factor =
            dph_phase(volume->anisotropy, dot(flight, to)) * sun->even / (often * chance);
        for (int c = 0; c < 3; c++)
            value[c] = factor * weight[c] * exp(-volume->extinction[c] * spans.length);
        add_weighted(tracing->radiance + 3 * sun->picture, value, sun->irradiance);
    }
    return true;
}

/* The part of a path that is scattered at least once. `flight` begins at `point`; `spans` are its
 * parts inside. */
static enum dph_ending scattered(const struct dph_stage *stage, struct dph_random *random,
                                 const struct dph_spans *spans, double point[3], double flight[3],
                                 double *radiance)
{
    const struct dph_volume *volume = &stage->space.volume;
    double weight[3];
    struct dph_walk walk;
    dph_walk_begin(&walk, random);
    double extinction = volume->extinction[walk.hero];
    double share = -expm1(-extinction * spans->length);
    if (!(share > 0))
        return DPH_ENDING_PLAIN;
    double length = fmin(-log1p(-dph_random_next(random) * share) / extinction, spans->length);
    dph_space_place(&stage->space, spans, length, flight, point);
    /* the density of a first scattering that is sure to happen is larger by the chance that a free
     * flight has of one, in each channel */
    for (int c = 0; c < 3; c++) {
        double chance = -expm1(-volume->extinction[c] * spans->length);
        walk.carried[c] *= chance;
        walk.share[c] = chance > 0 ? share / chance : 0;
    }
    dph_walk_scatter(&walk, volume, length);
    struct tracing tracing;
    tracing.stage = stage;
    tracing.radiance = radiance;
    double begin = dph_random_next(random);
    for (int i = 0; i < stage->nsun; i++) {
        tracing.due[i] = begin;
        begin += begin < .381966 ? .618034 : -.381966; /* lights take turns */
    }
    enum dph_ending ending = dph_walk_run(&stage->space, &walk, random, true, point, flight,
                                          add_suns, &tracing);
    if (ending == DPH_ENDING_LEFT && stage->environment) {
        dph_walk_weight(&walk, volume, weight);
        add_sky(stage, flight, weight, true, false, radiance);
    }
    return ending;
}

static enum dph_ending matched(const struct dph_stage *stage, struct dph_random *random,
                               const double origin[3], const double direction[3],
                               double *radiance, bool *covered)
{
    double point[3] = {origin[0], origin[1], origin[2]};
    double flight[3] = {direction[0], direction[1], direction[2]}, weight[3];
    struct dph_spans spans;
    dph_rays_spans(stage->space.rays, point, flight, &spans);
    *covered = spans.count > 0;
    if (spans.overflow)
        return DPH_ENDING_LOST;
    pass(stage, &spans, weight);
    add_background(stage, weight, radiance);
    if (!*covered)
        return DPH_ENDING_PLAIN;
    add_sky(stage, flight, weight, false, true, radiance);
    return scattered(stage, random, &spans, point, flight, radiance);
}

/* Light of the suns that comes to a point of the surface straight, from within. */
static bool add_unscattered(const struct dph_stage *stage, struct dph_random *random,
                            const double point[3], const double inward[3], double *radiance)
{
    static const double CAREFUL = .05; /* the least chance of a ray */
    const struct dph_outlook *outlook = &stage->outlook;
    const uint8_t *depth = dph_outlook_at(outlook, point);
    for (int i = 0; i < stage->nsun; i++) {
        const struct dph_sun *sun = &stage->sun[i];
        double to[3] = {sun->to_light[0], sun->to_light[1], sun->to_light[2]}, weight[3];
        double chance = depth ? fmax(outlook->passed[depth[i]], CAREFUL) : 1;
        struct dph_spans spans;
        if (sun->cosine < 1)
            dph_cone_sample(random, sun->to_light, sun->cosine, to);
        double cosine = dot(inward, to);
        if (cosine <= 0 || (chance < 1 && dph_random_next(random) >= chance))
            continue;
        dph_rays_spans(stage->space.rays, point, to, &spans);
        if (spans.overflow || !spans.inside)
            return false;
        pass(stage, &spans, weight);
        for (int c = 0; c < 3; c++)
            weight[c] *= cosine / PI * sun->even / chance;
        add_weighted(radiance + 3 * sun->picture, weight, sun->irradiance);
    }
    return true;
}

static enum dph_ending averaged(const struct dph_stage *stage, struct dph_random *random,
                                const double origin[3], const double direction[3],
                                double *radiance, bool *covered)
{
    const double one[3] = {1, 1, 1};
    double point[3] = {origin[0], origin[1], origin[2]}, inward[3], flight[3], weight[3];
    struct dph_spans spans;
    struct dph_hit hit;
    *covered = dph_rays_nearest(stage->space.rays, point, direction, INFINITY, &hit);
    if (!*covered) {
        add_background(stage, one, radiance);
        return DPH_ENDING_PLAIN;
    }
    if (dot(direction, hit.normal) > 0)
        return DPH_ENDING_LOST; /* a body's wall from inside */
    for (int k = 0; k < 3; k++)
        inward[k] = -hit.normal[k];
    advance(point, direction, hit.distance);
    advance(point, inward, stage->space.margin);
    dph_cosine_sample(random, inward, flight);
    dph_rays_spans(stage->space.rays, point, flight, &spans);
    if (spans.overflow || !spans.inside ||
        (stage->straight && !add_unscattered(stage, random, point, inward, radiance)))
        return DPH_ENDING_LOST;
    pass(stage, &spans, weight);
    add_sky(stage, flight, weight, true, false, radiance);
    return scattered(stage, random, &spans, point, flight, radiance);
}

static enum dph_ending dielectric(const struct dph_stage *stage, struct dph_random *random,
                                  const double origin[3], const double direction[3],
                                  double *radiance, bool *covered)
{
    const struct dph_volume *volume = &stage->space.volume;
    double point[3] = {origin[0], origin[1], origin[2]};
    double flight[3] = {direction[0], direction[1], direction[2]}, weight[3];
    int depth = 0; /* bodies that the point is in */
    struct dph_walk walk;
    *covered = false;
    dph_walk_begin(&walk, random);
    for (int events = 0; events < DPH_MAX_SCATTERINGS; events++) {
        struct dph_hit hit;
        double length = depth > 0 ? dph_walk_flight(&walk, volume, random) : INFINITY;
        double reach = length + stage->space.margin;
        if ((depth > 0 && reach <= dph_space_clear(&stage->space, point)) ||
            !dph_rays_nearest(stage->space.rays, point, flight, reach, &hit)) {
            if (!depth && !*covered) {
                const double one[3] = {1, 1, 1};
                add_background(stage, one, radiance);
                return DPH_ENDING_PLAIN;
            }
            if (!depth) {
                dph_walk_weight(&walk, volume, weight);
                add_sky(stage, flight, weight, true, true, radiance);
                return DPH_ENDING_PLAIN;
            }
            if (!isfinite(length))
                return DPH_ENDING_LOST;
        } else if (depth && length < hit.distance) {
            /* within the margin of the surface: stays on this side of it */
            length = fmax(0, fmin(length, hit.distance - stage->space.margin));
        } else {
            bool out = dot(flight, hit.normal) > 0;
            advance(point, flight, hit.distance);
            if (depth)
                dph_walk_pass(&walk, hit.distance);
            *covered = true;
            if (out && !depth)
                return DPH_ENDING_LOST; /* a body's wall from inside, without having entered */
            if (depth > 1 || (depth && !out)) {
                depth += out ? -1 : 1;
                advance(point, hit.normal, out ? stage->space.margin : -stage->space.margin);
                continue;
            }
            double against[3];
            for (int k = 0; k < 3; k++)
                against[k] = out ? -hit.normal[k] : hit.normal[k];
            bool through = dph_boundary_sample(random, out ? 1 / stage->eta : stage->eta, against,
                                               flight);
            depth = through ? !depth : depth;
            advance(point, hit.normal, depth ? -stage->space.margin : stage->space.margin);
            continue;
        }
        advance(point, flight, length);
        if (dot(point, point) > 1.1 * stage->radius * stage->radius)
            return DPH_ENDING_LOST;
        dph_walk_scatter(&walk, volume, length);
        if (!dph_walk_survive(&walk, volume, random))
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
    return stage->view_averaged ? averaged(stage, random, origin, direction, radiance, covered)
                                : matched(stage, random, origin, direction, radiance, covered);
}
