/* diaphan/response_scene.h - the response of a whole scene: what dph_response_bake (response_bake.h)
 * and dph_response_create (response.h) make of every body, in its own space and unit.      Tier 2.
 *     The bake only where the library was built with Embree. */
#ifndef DIAPHAN_RESPONSE_SCENE_H
#define DIAPHAN_RESPONSE_SCENE_H

#include <diaphan/response.h>
#include <diaphan/rivals.h>

#ifdef __cplusplus
extern "C" {
#endif

/* struct dph_scene_response_params p = dph_scene_response_defaults(); `material` has to be set. */
struct dph_scene_response_params {
    const struct dph_material *material; /* baked with its reduced scattering, without anisotropy */
    double size_mm;      /* largest side of the scene in mm; 0: as dph_scene_millimetres says; 0  */
    double noise;        /* of the bake, relative, at most; 0: until there are most_walks; .05    */
    double most_walks;   /* a position, on average; 65536                                         */
    uint64_t seed;       /* 1                                                                     */
    struct dph_response_params form; /* its threads and progress are not read                     */
    bool keep_rows;      /* keep what forms are made of, for dph_scene_form_response; false       */
    int threads;         /* 0: as many as there are processors; 0                                 */
    dph_progress *progress; /* Nullable; NULL                                                     */
    void *progress_user;
};

struct dph_scene_response_params dph_scene_response_defaults(void);

/* What happened, over the bodies. */
struct dph_scene_response_report {
    size_t positions;
    double walks;        /* all together                                                          */
    double noise;        /* estimated, of the body where it is largest                            */
    bool reached;        /* everywhere the noise that was asked for                               */
    double lost;         /* walks that an open mesh or rounding led astray                        */
    double error, error_rgb;    /* of the form, as dph_response_report; mean over the positions   */
    double seconds_bake, seconds_form, seconds_view; /* wall clock                                */
};

/* Bakes the response of all bodies, replaces what there was and adds DPH_PRODUCT_RESPONSE to the
 * bodies' products. Sets the scene's mm_per_unit. A body without triangles is passed over. `report`
 * is Nullable. False: errors as dph_response_bake and dph_response_create; bodies baked until then
 * keep what they have. */
bool dph_scene_bake_response(struct dph_scene *scene, const struct dph_scene_response_params *params,
                             struct dph_scene_response_report *report, struct dph_error *err);

/* Makes the response anew, in another form, from rows that a bake kept; bodies without rows stay as
 * they are. `report` is Nullable; what belongs to the bake is 0 in it. False: errors as
 * dph_response_create. */
bool dph_scene_form_response(struct dph_scene *scene, const struct dph_response_params *form,
                             struct dph_scene_response_report *report, struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
