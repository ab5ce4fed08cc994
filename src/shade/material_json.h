/* shade/material_json.h - material files.      Tier 2, private. */
#ifndef DPH_SHADE_MATERIAL_JSON_H
#define DPH_SHADE_MATERIAL_JSON_H

#include <diaphan/material.h>

/* Reads a material file as material.h describes it into `material`; what the file does not give is
 * taken from `defaults`. `material` is written on success only. */
bool dph_material_load_json(const char *path, const struct dph_material *defaults,
                            struct dph_material *material, struct dph_error *err);

#endif
