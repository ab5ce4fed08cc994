/* trace/medium.h - walks of light through a homogeneous medium, without its geometry.      Tier 2, private. */
#ifndef DPH_TRACE_MEDIUM_H
#define DPH_TRACE_MEDIUM_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* Random numbers of one path. Any seed will do. */
struct dph_random {
    uint64_t state;
};

/* The numbers of one sample of one pixel. */
struct dph_random dph_random_seed(uint64_t seed, uint64_t pixel, uint64_t sample);

/* Steele, Lea and Flood's SplitMix64 (2014): a counter and a bijective mixer. */
static inline uint64_t dph_random_mix(uint64_t z)
{
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

/* Evenly in [0, 1). */
static inline double dph_random_next(struct dph_random *random)
{
    random->state += 0x9e3779b97f4a7c15u;
    return (double)(dph_random_mix(random->state) >> 11) * 0x1p-53;
}

/* A homogeneous medium. Lengths are in whatever unit the coefficients are per. */
struct dph_volume {
    double extinction[3]; /* scattering + absorption, by channel                                   */
    double path[3];       /* 1 / extinction, 0 where that is 0                                     */
    double denser[3];     /* log of the extinction                                                 */
    double albedo[3];     /* scattering / extinction, 0 where both are 0                           */
    double anisotropy;    /* g of Henyey-Greenstein, -1 < g < 1                                    */
    double thinnest;      /* the least extinction                                                  */
};
void dph_volume_init(struct dph_volume *volume, const double scattering[3],
                     const double absorption[3], double anisotropy);

/* Henyey-Greenstein's phase function, per steradian. `cosine`: between the directions of flight
 * before and after. */
double dph_phase(double g, double cosine);

/* Turns a unit direction of flight by a scattering of asymmetry g. */
void dph_phase_sample(struct dph_random *random, double g, double direction[3]);

/* A unit direction within `half_angle` of `axis`, evenly over the solid angle; `cosine` is the
 * cosine of the half angle. */
void dph_cone_sample(struct dph_random *random, const double axis[3], double cosine,
                     double direction[3]);

/* A unit direction distributed as the cosine to `axis`, unit length, on its side. */
void dph_cosine_sample(struct dph_random *random, const double axis[3], double direction[3]);

/* The share of light that a smooth boundary reflects, unpolarised. `cosine` > 0: of incidence.
 * `eta`: index beyond over index before. `refracted`: its cosine beyond, 0 where reflection is
 * total. */
double dph_fresnel(double cosine, double eta, double *refracted);

/* Reflects or refracts a unit direction at a boundary with the unit normal `normal` against the
 * direction (their dot product is negative), at random by the Fresnel share. True: refracted. */
bool dph_boundary_sample(struct dph_random *random, double eta, const double normal[3],
                         double direction[3]);

/* A path inside a medium: what the weights of its three channels follow from. */
struct dph_walk {
    int hero;          /* the channel that distances are drawn for                                 */
    int scatterings;
    double length;     /* flown                                                                    */
    double share[3];   /* what the path's probability densities by channel have beyond those of its
                        * flights; 1                                                               */
    double carried[3]; /* products of albedos and of roulettes                                     */
};

/* Where a walk gives up, so that nothing runs forever. Such walks are counted, see reference.h. */
#define DPH_MAX_SCATTERINGS 1000000

void dph_walk_begin(struct dph_walk *walk, struct dph_random *random);

/* The length of the next flight. INFINITY where the medium is clear. */
static inline double dph_walk_flight(const struct dph_walk *walk, const struct dph_volume *volume,
                                     struct dph_random *random)
{
    double depth = -log(1 - dph_random_next(random));
    return volume->extinction[walk->hero] > 0 ? depth * volume->path[walk->hero] : INFINITY;
}

/* The walk flew a length and was scattered there, or came to the boundary. */
static inline void dph_walk_scatter(struct dph_walk *walk, const struct dph_volume *volume,
                                    double length)
{
    walk->length += length;
    walk->scatterings++;
    for (int c = 0; c < 3; c++)
        walk->carried[c] *= volume->albedo[c];
}

static inline void dph_walk_pass(struct dph_walk *walk, double length)
{
    walk->length += length;
}

/* What light that meets the walk now counts, by channel. */
void dph_walk_weight(const struct dph_walk *walk, const struct dph_volume *volume,
                     double weight[3]);

/* Russian roulette: false ends a walk of little weight; one that goes on weighs more. It is played
 * at every eighth scattering only, since weights take time. */
bool dph_walk_roulette(struct dph_walk *walk, const struct dph_volume *volume,
                       struct dph_random *random);
static inline bool dph_walk_survive(struct dph_walk *walk, const struct dph_volume *volume,
                                    struct dph_random *random)
{
    return walk->scatterings % 8 || dph_walk_roulette(walk, volume, random);
}

#endif
