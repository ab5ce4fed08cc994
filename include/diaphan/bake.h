/* diaphan/bake.h - directional thickness from plain arrays: the start-up stage of SHSSS. Tier 2.
 *
 * From every vertex of a mesh the thickness of the body is sampled in directions spread evenly
 * over the sphere and projected to spherical harmonics (Tomaszewska, Stefanowski 2012). No
 * files, no GL, no globals. Lengths are in the unit of the positions. Vertices at one position
 * get one set of values. */
#ifndef DIAPHAN_BAKE_H
#define DIAPHAN_BAKE_H

#include <diaphan/thickness.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The mesh, in the caller's memory, read only. */
struct dph_bake_input {
    const float *position;   /* three floats a vertex, `stride` bytes apart                         */
    size_t stride;           /* in bytes; 0 means tightly packed, 12                                */
    size_t nvert;
    const uint32_t *index;   /* (ntri x 3), each < nvert. Nullable: vertices 3t, 3t+1, 3t+2          */
    size_t ntri;
};

/* All fields have defaults: struct dph_bake_params p = dph_bake_defaults(); */
struct dph_bake_params {
    int bands;                      /* 1 to 8; 6                                                   */
    int directions;                 /* 16 to 65536, odd numbers are raised by one; 1024            */
    enum dph_definition definition; /* DPH_THICKNESS_INSIDE                                        */
    enum dph_fit fit;               /* DPH_FIT_WEIGHTED                                            */
    double extinction;              /* weighted fit: effective transport coefficient of the material, 1 / unit of the
                                     * positions; 0: no material, decided by the size alone; 0     */
    double largest_side;            /* weighted fit: largest side of the object that the lengths are judged by; 0: of the
                                     * input's bounding box; 0                                     */
    int threads;                    /* 0: as many as there are processors; 0                       */
    bool portable;                  /* use no processor-specific code (the bytes are the same); false */
    dph_progress *progress;         /* Nullable; NULL                                              */
    void *progress_user;
};

struct dph_bake_params dph_bake_defaults(void);

/* What happened. */
struct dph_bake_report {
    size_t positions;      /* distinct positions                                                    */
    int directions;        /* as used                                                               */
    int threads;           /* as used                                                               */
    double untrusted;      /* share of (position, direction) pairs with a bad hit balance: they got the first exit,
                            * or 0 where there is none                                              */
    double seconds_sweep;  /* wall clock                                                            */
    double seconds_project;
};

/* How many floats dph_bake writes: nvert * bands * bands. */
size_t dph_bake_size(const struct dph_bake_input *input, const struct dph_bake_params *params);

/* Bakes. `coefficient` (nvert x bands * bands) is the caller's. `report` is Nullable. The same
 * input and parameters give the same bytes for any number of threads and on any processor.
 * Triangles without area are skipped; a vertex that no triangle uses is baked like any other.
 * Memory beside input and output: about 1 KiB a position. False: DPH_ERROR_ARGUMENT (a parameter
 * out of range), DPH_ERROR_INPUT (an index out of range, a number that is not finite, a mesh
 * smaller than 1e-15 or larger than 1e15 units), DPH_ERROR_MEMORY, DPH_ERROR_CANCELLED;
 * `coefficient` then holds nothing of use. */
bool dph_bake(const struct dph_bake_input *input, const struct dph_bake_params *params,
              float *coefficient, struct dph_bake_report *report, struct dph_error *err);

/* The samples themselves: the thickness of every vertex along +direction (`plus`, (nvert)) and
 * along -direction (`minus`, (nvert)), both Nullable, from one sweep. `bad_plus` and `bad_minus`
 * (nvert), Nullable, are 1 where the hit balance is wrong. `direction` need not be of unit
 * length. Uses definition, threads (one) and portable of the parameters. Errors as dph_bake. */
bool dph_bake_direction(const struct dph_bake_input *input, const struct dph_bake_params *params,
                        const double direction[3], float *plus, float *minus, uint8_t *bad_plus,
                        uint8_t *bad_minus, struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
