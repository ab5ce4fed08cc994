/* diaphan/light.h - the per-frame CPU stage: what a shader needs of a light to draw a baked body.      Tier 2.
 *
 * Directions point to the light. World space is right-handed, y up for the azimuths of
 * dph_light_direction. */
#ifndef DIAPHAN_LIGHT_H
#define DIAPHAN_LIGHT_H

#include <diaphan/thickness.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A distant light. */
struct dph_light {
    double to_light[3];   /* world space, any length but 0                                          */
    double irradiance[3]; /* RGB, on a plane perpendicular to it; pi makes facing white paper radiance 1 */
};

/* The direction of azimuth and elevation in degrees: (cos el sin az, sin el, cos el cos az). */
void dph_light_direction(double azimuth, double elevation, double direction[3]);

/* What is uploaded for one light and one instance: 36 SH values and three numbers. */
struct dph_light_constants {
    float sh[9][4];       /* y_i(light in object space) * scale[l] * window[l] * mm per unit along the light; the dot
                           * product with a vertex's stored components is the thickness in mm, not clamped */
    float to_light[3];    /* world space, unit length                                               */
    float irradiance[3];
};

/* Fills `out` for a body with `thickness`, placed by `matrix` (column-major, object to world) in a
 * scene of `mm_per_unit`. The light goes into the object's space as A^-1 L, normalised, lengths
 * come back as |A L_object| (A: the linear part). `bands`: how many of the stored bands to use, 0:
 * all; never more than DPH_DRAW_BANDS. A light of length 0 or a singular matrix gives zeros. */
void dph_light_constants(const struct dph_light *light, const struct dph_thickness *thickness,
                         const float matrix[16], double mm_per_unit, int bands,
                         enum dph_window window, struct dph_light_constants *out);

#ifdef __cplusplus
}
#endif
#endif
