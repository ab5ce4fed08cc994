/* diaphan/prepare.h - baking a whole scene: what turns a loaded file into one that can be drawn or
 * saved.      Tier 2.
 *
 * Joins scene.h, bake.h and material.h: every body is baked in its own space and unit, on its
 * distinct positions, and packed. Sizes are judged in the scene: a body with several instances by
 * its largest one. */
#ifndef DIAPHAN_PREPARE_H
#define DIAPHAN_PREPARE_H

#include <diaphan/bake.h>
#include <diaphan/cpca.h>
#include <diaphan/material.h>
#include <diaphan/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

/* struct dph_scene_bake_params p = dph_scene_bake_defaults(); */
struct dph_scene_bake_params {
    struct dph_bake_params bake; /* `extinction` and `largest_side` are worked out here, not read */
    enum dph_store store;        /* DPH_STORE_SNORM8 */
    struct dph_cpca_params cpca; /* DPH_STORE_CPCA; its `threads`, `portable` and progress are not
                                  * read */
    double size_mm;              /* largest side of the scene in mm; see dph_scene_millimetres; 0 */
    const struct dph_material *material; /* weighted fit: by the light that this medium lets through
                                          * (green channel). Nullable: the size decides; NULL */
    bool missing_only;           /* leave the bodies alone that are baked already; false */
};

struct dph_scene_bake_params dph_scene_bake_defaults(void);

/* What happened, summed over the bodies that were baked. */
struct dph_scene_bake_report {
    size_t bodies;
    size_t triangles, vertices;
    size_t positions;       /* distinct points a body */
    int directions;         /* as used */
    int threads;            /* as used */
    double untrusted;       /* share of (position, direction) pairs with a bad hit balance */
    double seconds_sweep, seconds_project;
    double seconds_store;   /* welding and packing */
    double error;           /* DPH_STORE_CPCA: relative error of the stored coefficients, mean over
                             * the positions of the bodies; else 0 */
};

/* Millimetres per unit of a scene: such that its largest side is `size_mm`; for 0 what its file
 * says, else such that the largest side is 25 mm. A scene without extent: 1. */
double dph_scene_millimetres(const struct dph_scene *scene, double size_mm);

/* Bakes the bodies of a scene and sets its mm_per_unit. A body without vertices is passed over. For
 * a body of which more than one pair in a hundred cannot be trusted a warning is added to the scene
 * that names the cause and the mend, and one for all others with an open border. `report` is
 * Nullable. False: errors as dph_bake; bodies baked until then keep what they have. */
bool dph_scene_bake(struct dph_scene *scene, const struct dph_scene_bake_params *params,
                    struct dph_scene_bake_report *report, struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
