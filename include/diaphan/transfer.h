/* diaphan/transfer.h - precomputed radiance transfer: how a body answers to light from far away.
 * Tier 2.
 *
 * For distant light with the SH coefficients l_i (environment.h), the radiance that leaves a
 * position is the dot product of its transfer vector with l (Sloan, Kautz, Snyder 2002). Four
 * kinds of body: diffuse without shadows, with them, with light reflected on itself, and
 * translucent (Sloan et al. 2003; the dipole of Jensen et al. 2001, gathered as in Jensen,
 * Buhler 2002). From plain arrays; no files, no GL. Light and body share their axes: turn the
 * light into the body's space, not the vectors. Lengths are in the unit of the positions. */
#ifndef DIAPHAN_TRANSFER_H
#define DIAPHAN_TRANSFER_H

#include <diaphan/bake.h>

#ifdef __cplusplus
extern "C" {
#endif

enum dph_transfer_kind {
    DPH_TRANSFER_TRANSLUCENT = 0, /* shadowed irradiance, spread below the surface; radiance, 3 channels     */
    DPH_TRANSFER_UNSHADOWED,      /* albedo / pi times the clamped cosine; radiance, 3 channels              */
    DPH_TRANSFER_SHADOWED,        /* the same with the body's own shadow; radiance, 3 channels               */
    DPH_TRANSFER_INTERREFLECTED,  /* the same and light that was reflected up to `bounces` times; 3 channels */
    DPH_TRANSFER_IRRADIANCE,      /* shadowed irradiance that enters; 1 channel                              */
};

/* All fields have defaults: struct dph_transfer_params p = dph_transfer_defaults(); the media
 * are those of no material. */
struct dph_transfer_params {
    enum dph_transfer_kind kind; /* DPH_TRANSFER_TRANSLUCENT                                       */
    int bands;                   /* 1 to 8; 6                                                      */
    int directions;              /* 16 to 65536, odd numbers are raised by one; 1024               */
    double albedo[3];            /* diffuse kinds, 0 to 1; 1                                       */
    int bounces;                 /* interreflected, 1 to 16; 2                                     */
    double scattering[3];        /* translucent: reduced, 1 / unit of the positions (a material's 1/mm times mm per unit), >= 0; 1 */
    double absorption[3];        /* translucent: 1 / unit, >= 0; 0                                 */
    double ior;                  /* translucent, irradiance: relative index, 1 to 4. Above 1 the Fresnel transmittance weights the light
                                  * that enters and the dipole reflects light back inside; what leaves is spread evenly, without another
                                  * factor. 1: index matched, no such factors; 1                   */
    double solid_angle;          /* translucent: a group of samples is taken as one where its area over the squared distance is below this;
                                  * 0: never; .05                                                  */
    size_t most_samples;         /* translucent: coarse triangles are divided until their edges suit the shortest mean free path, but not beyond
                                  * this many samples (or the positions, if these are more); 200000 */
    int threads;                 /* 0: as many as there are processors; 0                          */
    bool portable;               /* use no processor-specific code (the bytes are the same); false */
    dph_progress *progress;      /* Nullable; NULL                                                 */
    void *progress_user;
};

struct dph_transfer_params dph_transfer_defaults(void);

/* Transfer vectors of one body, a row a distinct position: what is drawn, compressed or stored.
 * Owns its arrays. Safe to read from several threads. */
struct dph_transfer {
    size_t npos, nvert;
    int bands, channels;   /* channels: 3 (RGB) or 1                                               */
    size_t length;         /* of a row: channels * bands * bands                                   */
    float *vector;         /* (npos x channels x bands * bands) by channel                         */
    float *area;           /* (npos) a third of the adjacent triangles' areas: weights for fits     */
    uint32_t *position_of; /* (nvert) the row of each vertex                                       */
};

/* What happened. */
struct dph_transfer_report {
    size_t positions;      /* distinct positions                                                   */
    size_t samples;        /* translucent: points at which irradiance was gathered                 */
    double spacing;        /* translucent: longest edge between samples                            */
    double spacing_wanted; /* translucent: 1.9 mean free paths of the shortest channel; where `spacing` is larger, it was most_samples that
                            * ended the division, or triangles without area                        */
    double returned[3];    /* translucent: flux that leaves over flux that enters, under even light from everywhere, by channel. The dipole is no
                            * exact solution, and the sum may exceed 1 a little on bent surfaces    */
    int directions;        /* as used                                                              */
    int threads;           /* as used                                                              */
    double seconds_sweep, seconds_project, seconds_gather; /* wall clock                           */
};

/* Bakes into `transfer`, which dph_transfer_finish empties. `report` is Nullable. Normals are
 * the angle-weighted ones of the positions. The same input and parameters give the same bytes
 * for any number of threads and on any processor. Memory beside input and output: about 1 KiB a
 * sample. False: DPH_ERROR_ARGUMENT (a parameter out of range), DPH_ERROR_INPUT (an index out of
 * range, a number that is not finite), DPH_ERROR_MEMORY, DPH_ERROR_CANCELLED; `transfer` is then
 * empty. */
bool dph_transfer_bake(const struct dph_bake_input *input, const struct dph_transfer_params *params,
                       struct dph_transfer *transfer, struct dph_transfer_report *report,
                       struct dph_error *err);

/* Frees the arrays and empties it; accepts an empty one. */
void dph_transfer_finish(struct dph_transfer *transfer);

#ifdef __cplusplus
}
#endif
#endif
