/* diaphan/patro.h - normals blurred by scattering: translucency as a change of the model. Tier 2.
 *
 * Every position's normal is replaced by the mean of the normals around it, weighted by area and
 * by how far light scatters (after Patro 2007, as the paper that this project follows describes
 * it). Drawn with any plain shader: N.L is then irradiance blurred without its clamp. No light
 * ever passes through the body. Lengths are in the unit of the positions. */
#ifndef DIAPHAN_PATRO_H
#define DIAPHAN_PATRO_H

#include <diaphan/bake.h>

#ifdef __cplusplus
extern "C" {
#endif

enum dph_patro_kernel {
    DPH_PATRO_DIPOLE = 0, /* diffuse reflectance of the medium, index matched                      */
    DPH_PATRO_EXP,        /* exp(-r / distance) / r                                                */
    DPH_PATRO_GAUSS,      /* exp(-r^2 / (2 distance^2))                                            */
};

/* struct dph_patro_params p = dph_patro_defaults(); */
struct dph_patro_params {
    enum dph_patro_kernel kernel; /* DPH_PATRO_DIPOLE                                              */
    double distance;        /* how far light scatters, >= 0; neighbours count to three times this. 0: normals stay; 0 */
    double most_distance;   /* share of the bounding box's diagonal that `distance` is limited to, 0: no limit; .1 */
    double scattering, absorption; /* dipole: reduced, of one channel, 1 / unit of the positions, >= 0; 1, 0 */
    bool keep_length;       /* let normals become shorter where they disagree, which lowers the contrast as scattering does; true */
    bool same_side;         /* only neighbours whose normals make an acute angle with the position's own; false */
    int threads;            /* 0: as many as there are processors; 0                               */
    bool portable;          /* use no processor-specific code (the bytes are the same); false      */
    dph_progress *progress; /* Nullable; NULL                                                      */
    void *progress_user;
};

struct dph_patro_params dph_patro_defaults(void);

/* Sets distance, scattering and absorption from a medium of one channel (green, unless every
 * channel gets normals of its own): distance is 1 / the effective transport coefficient.
 * `scattering` (reduced) and `absorption` in 1/mm, mm_per_unit millimetres per unit of the
 * positions. Without absorption light goes any distance: most_distance then decides. */
void dph_patro_set_medium(struct dph_patro_params *params, double scattering, double absorption,
                          double mm_per_unit);

struct dph_patro_report {
    size_t positions;
    double distance;   /* as used                                                                  */
    double shortest;   /* length of the shortest mean normal, before the floor of .05              */
    int threads;       /* as used                                                                  */
    double seconds;    /* wall clock                                                               */
};

/* Fills `out` (nvert x 3). `normal` (nvert x 3): the model's, those of equal positions are
 * averaged, so that hard edges become smooth. Nullable: angle-weighted ones. With a distance of
 * 0, `out` is `normal`. A mean normal shorter than .05 (where opposite sides of a thin sheet
 * cancel) is lengthened to that, in the position's own direction if it has none. The same bytes
 * for any number of threads and on any processor. `report` is Nullable. False:
 * DPH_ERROR_ARGUMENT, _INPUT, _MEMORY, _CANCELLED. */
bool dph_patro_normals(const struct dph_bake_input *input, const float *normal,
                       const struct dph_patro_params *params, float *out, struct dph_patro_report *report,
                       struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
