/* diaphan/response_bake.h - how a translucent body answers to light from far away, by random walks.
 *     Tier 2. Only where the library was built with Embree.
 *
 * The response p(x, w) of a position x is the radiance that leaves x, averaged over the directions
 * in which it leaves (weighted with their cosine to the normal), per irradiance of a plane
 * perpendicular to light from direction w. The medium is homogeneous, its boundary index matched:
 * all orders of scattering count, front light and the body's own shadow included. Radiance under
 * distant light with the SH coefficients l_i (environment.h) is the dot product of its transfer
 * vector, the response's SH coefficients, with l.
 *
 * A walk starts at x, distributed as the cosine about the inward normal, and leaves for good in a
 * direction w_k with the weights a_k of three channels: coefficient i is the mean of a_k y_i(w_k).
 * See docs/theory.md for what is shared between positions. */
#ifndef DIAPHAN_RESPONSE_BAKE_H
#define DIAPHAN_RESPONSE_BAKE_H

#include <diaphan/response.h>

#ifdef __cplusplus
extern "C" {
#endif

/* All fields have defaults: struct dph_response_bake_params p = dph_response_bake_defaults(); the
 * media are those of no material. */
struct dph_response_bake_params {
    int bands;              /* 1 to 8; 8: forms of fewer bands are fitted to more */
    double scattering[3];   /* not reduced, 1 / unit of the positions (a material's 1/mm times mm
                             * per unit), >= 0; 1 */
    double absorption[3];   /* 1 / unit, >= 0; 0 */
    double anisotropy;      /* g of Henyey-Greenstein, -1 < g < 1. Positions share work only where
                             * it is 0: a reduced medium bakes much faster; 0 */
    double noise;           /* walks are added until the estimated noise is at most this; 0: until
                             * there are most_walks; .05 */
    double most_walks;      /* a position, on average; 1 to 1e9; 65536 */
    bool straight;          /* with light that comes through without being scattered. It leaves the way
                             * it came, so that an eye sees none of it unless it looks straight into
                             * the light; true */
    int directions;         /* of light that comes through without being scattered, 16 to 65536, odd
                             * numbers are raised by one; 1024 */
    uint64_t seed;          /* other numbers give independent noise; 1 */
    bool smooth;            /* smooth over the surface as far as it lowers the error; true */
    bool plain;             /* positions share no walks: slow, to check by; false */
    int threads;            /* 0: as many as there are processors; 0 */
    bool portable;          /* use no processor-specific code (the bytes are the same); false */
    dph_progress *progress; /* Nullable; NULL */
    void *progress_user;
};

struct dph_response_bake_params dph_response_bake_defaults(void);

/* What happened. */
struct dph_response_bake_report {
    size_t positions;   /* distinct positions */
    double noise;       /* estimated standard error of what is baked: root of the summed squares of
                         * the coefficients' errors over that of the coefficients, of the first 6
                         * bands, all channels, all positions weighted with their area; from the
                         * scatter of independent passes. What smoothing distorts is included */
    double noise_walks; /* the same before smoothing */
    bool reached;       /* the noise that was asked for; false: most_walks ended it */
    int passes;
    double walks;       /* all together */
    double scatterings; /* of all walks */
    double lost;        /* walks led astray by rounding or an open mesh: they count as dark */
    double capped;      /* walks given up after a million scatterings: as dark too */
    double returned[3]; /* mean over the area of what leaves under even light 1 from everywhere: 1
                         * without absorption, within noise */
    int threads;        /* as used */
    double seconds_sweep; /* wall clock: light that is not scattered */
    double seconds_walk;  /* wall clock: walks */
};

/* Bakes into `transfer` (3 channels), which dph_transfer_finish empties. `report` is Nullable.
 * Normals are the angle-weighted ones of the positions. The same input and parameters give the same
 * bytes for any number of threads. The mesh should be closed. Memory beside input and output: about
 * 2.5 KiB a position, twice that while unscattered light is gathered in 8 bands. False:
 * DPH_ERROR_ARGUMENT (a parameter out of range), DPH_ERROR_INPUT (an index out of range, a number
 * that is not finite), DPH_ERROR_MEMORY, DPH_ERROR_CAPABILITY (Embree), DPH_ERROR_CANCELLED;
 * `transfer` is then empty. */
bool dph_response_bake(const struct dph_bake_input *input,
                       const struct dph_response_bake_params *params, struct dph_transfer *transfer,
                       struct dph_response_bake_report *report, struct dph_error *err);

/* Finds how much more than its average over views a body sends to an eye (response.h): the terms
 * with the least squared error of the radiance, light that comes through unscattered left out, over
 * all positions, views and lights, given what `response` (baked from the same input, in the root
 * form, not stored as DPH_STORE_CPCA) says of the average. Of `params` it takes the medium, the noise,
 * the seed, the threads and the progress. 262144 walks, fewer where the noise is above .05 (with
 * its inverse square, 16384 at least); the same terms for any number of threads. False: as
 * dph_response_bake, and DPH_ERROR_ARGUMENT for another response; `gain` is then even. */
bool dph_response_view_fit(const struct dph_bake_input *input,
                           const struct dph_response_bake_params *params,
                           const struct dph_response *response, struct dph_view_gain *gain,
                           struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
