/* bake/prepare.h - how a body's lengths are judged.      Tier 2, private. */
#ifndef DPH_BAKE_PREPARE_H
#define DPH_BAKE_PREPARE_H

#include <diaphan/scene.h>

/* How much longer a body's unit is in the scene than in its own space: the cube root of the
 * determinant, of the largest instance. */
double dph_scene_body_scale(const struct dph_scene *scene, size_t body);

#endif
