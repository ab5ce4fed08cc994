/* Walks of light through a homogeneous medium: how far, in which direction, with what weight.
 *
 * One path serves three channels. Distances are drawn for one of them, the hero, chosen evenly at
 * the beginning; the path could have come from any of the three, and the balance heuristic (Veach
 * and Guibas 1995; over wavelengths: Wilkie et al. 2014) weighs it with the mean of the three
 * densities. With p_c the product over the path of
 *
 *     st_c exp(-st_c s)  where it was scattered after s,  exp(-st_c s)  where it met a boundary,
 *
 * the path's value in channel c is p_c times the product of its albedos, and its weight
 *
 *     w_c = carried_c * p_c / ((p_0 + p_1 + p_2) / 3),
 *
 * never above three times `carried`, however long the path grows. The densities follow from the
 * length flown and the number of scatterings, so that they are computed only when light is met.
 *
 * Directions follow Henyey and Greenstein (1941), in the form that has no difference of nearly
 * equal numbers at g near 0; the cosine is between the directions of flight, so its mean is g. */
#include "trace/medium.h"

#include <math.h>

#define PI 3.14159265358979323846

struct dph_random dph_random_seed(uint64_t seed, uint64_t pixel, uint64_t sample)
{
    uint64_t state = dph_random_mix(seed + 0x9e3779b97f4a7c15u);
    state = dph_random_mix(state ^ dph_random_mix(pixel + 0x6a09e667f3bcc909u));
    return (struct dph_random){dph_random_mix(state ^ dph_random_mix(sample + 0xbb67ae8584caa73bu))};
}

void dph_volume_init(struct dph_volume *volume, const double scattering[3],
                     const double absorption[3], double anisotropy)
{
    volume->anisotropy = anisotropy;
    volume->thinnest = INFINITY;
    for (int c = 0; c < 3; c++) {
        double extinction = scattering[c] + absorption[c];
        volume->extinction[c] = extinction;
        volume->path[c] = extinction > 0 ? 1 / extinction : 0;
        volume->denser[c] = log(extinction);
        volume->albedo[c] = extinction > 0 ? scattering[c] / extinction : 0;
        volume->thinnest = fmin(volume->thinnest, extinction);
    }
}

double dph_phase(double g, double cosine)
{
    double square = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * PI * square * sqrt(square));
}

/* Turns `direction` by an angle of the given cosine, about itself by a random one. The frame is
 * that of Duff et al. (2017), continuous but for the sign of z. */
static void deflect(struct dph_random *random, double cosine, double direction[3])
{
    double angle = 2 * PI * dph_random_next(random), sine = sqrt(fmax(0, 1 - cosine * cosine));
    double x = sine * cos(angle), y = sine * sin(angle);
    const double n[3] = {direction[0], direction[1], direction[2]};
    double sign = n[2] < 0 ? -1 : 1, a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    direction[0] = x * (1 + sign * n[0] * n[0] * a) + y * b + cosine * n[0];
    direction[1] = x * sign * b + y * (sign + n[1] * n[1] * a) + cosine * n[1];
    direction[2] = -x * sign * n[0] - y * n[1] + cosine * n[2];
    double length = sqrt(direction[0] * direction[0] + direction[1] * direction[1] +
                         direction[2] * direction[2]);
    for (int k = 0; k < 3; k++)
        direction[k] /= length;
}

void dph_phase_sample(struct dph_random *random, double g, double direction[3])
{
    if (g == 0) { /* Marsaglia 1972: a point in the unit disc, lifted to the sphere */
        double x, y, square;
        do {
            x = 2 * dph_random_next(random) - 1;
            y = 2 * dph_random_next(random) - 1;
            square = x * x + y * y;
        } while (square >= 1);
        double side = 2 * sqrt(1 - square);
        direction[0] = x * side;
        direction[1] = y * side;
        direction[2] = 1 - 2 * square;
        return;
    }
    /* (1 + g^2 - q^2) / (2 g) with q = (1 - g^2) / (1 + g t), multiplied out; t from -1 to 1 */
    double t = 2 * dph_random_next(random) - 1, d = 1 + g * t;
    double cosine =
        (2 * t + g * (t * t + 3) + 2 * g * g * t + g * g * g * (t * t - 1)) / (2 * d * d);
    deflect(random, fmin(fmax(cosine, -1), 1), direction);
}

void dph_cone_sample(struct dph_random *random, const double axis[3], double cosine,
                     double direction[3])
{
    for (int k = 0; k < 3; k++)
        direction[k] = axis[k];
    deflect(random, 1 - dph_random_next(random) * (1 - cosine), direction);
}

void dph_cosine_sample(struct dph_random *random, const double axis[3], double direction[3])
{
    for (int k = 0; k < 3; k++)
        direction[k] = axis[k];
    deflect(random, sqrt(1 - dph_random_next(random)), direction);
}

double dph_fresnel(double cosine, double eta, double *refracted)
{
    double square = 1 - (1 - cosine * cosine) / (eta * eta);
    if (square <= 0) {
        *refracted = 0;
        return 1;
    }
    *refracted = sqrt(square);
    double across = (cosine - eta * *refracted) / (cosine + eta * *refracted);
    double along = (eta * cosine - *refracted) / (eta * cosine + *refracted);
    return .5 * (across * across + along * along);
}

bool dph_boundary_sample(struct dph_random *random, double eta, const double normal[3],
                         double direction[3])
{
    double refracted, cosine = 0, length = 0;
    for (int k = 0; k < 3; k++)
        cosine -= direction[k] * normal[k];
    double share = dph_fresnel(fmin(cosine, 1), eta, &refracted);
    bool through = dph_random_next(random) >= share;
    for (int k = 0; k < 3; k++) {
        direction[k] = through ? direction[k] / eta + (cosine / eta - refracted) * normal[k]
                               : direction[k] + 2 * cosine * normal[k];
        length += direction[k] * direction[k];
    }
    for (int k = 0; k < 3; k++)
        direction[k] /= sqrt(length);
    return through;
}

void dph_walk_begin(struct dph_walk *walk, struct dph_random *random)
{
    *walk = (struct dph_walk){.hero = (int)(3 * dph_random_next(random)),
                              .share = {1, 1, 1},
                              .carried = {1, 1, 1}};
}

void dph_walk_weight(const struct dph_walk *walk, const struct dph_volume *volume,
                     double weight[3])
{
    double density[3], largest = -INFINITY, sum = 0;
    for (int c = 0; c < 3; c++) {
        density[c] = -volume->extinction[c] * walk->length;
        if (walk->scatterings)
            density[c] += walk->scatterings * volume->denser[c];
        largest = fmax(largest, density[c]);
    }
    for (int c = 0; c < 3; c++) {
        density[c] = walk->share[c] * exp(density[c] - largest);
        sum += density[c];
    }
    for (int c = 0; c < 3; c++)
        weight[c] = walk->carried[c] * density[c] * 3 / sum;
}

bool dph_walk_roulette(struct dph_walk *walk, const struct dph_volume *volume,
                       struct dph_random *random)
{
    double weight[3];
    dph_walk_weight(walk, volume, weight);
    double largest = fmax(weight[0], fmax(weight[1], weight[2]));
    if (largest >= .05)
        return true;
    double chance = largest / .1;
    if (!(dph_random_next(random) < chance))
        return false;
    for (int c = 0; c < 3; c++)
        walk->carried[c] /= chance;
    return true;
}
