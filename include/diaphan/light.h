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

enum dph_light_kind { DPH_LIGHT_DISTANT = 0, DPH_LIGHT_POINT, DPH_LIGHT_SPOT };

/* A light. Zeros beyond the first two members make it distant and a point of the sky. */
struct dph_light {
    double to_light[3];   /* distant: world space, any length but 0; spot: from where it aims back to it  */
    double irradiance[3]; /* RGB. distant: on a plane perpendicular to it; pi makes facing white paper radiance 1.
                           * point, spot: the same at a distance of one unit of the scene, falling with
                           * the square of the distance                                             */
    enum dph_light_kind kind; /* DPH_LIGHT_DISTANT                                                  */
    double position[3];   /* point, spot: world space                                               */
    double angle;         /* half-angle in degrees. distant: of its disc, 0 to 90, even radiance; spot: of its
                           * cone, above 0 and below 90, fading smoothly over the outer tenth         */
};

/* What a light is as seen from a point of the world: distant, with the direction and the irradiance there. A distant
 * light stays as it is. At the light itself it has the direction 0, and none. */
void dph_light_at(const struct dph_light *light, const double point[3], struct dph_light *out);

/* The direction of azimuth and elevation in degrees: (cos el sin az, sin el, cos el cos az). */
void dph_light_direction(double azimuth, double elevation, double direction[3]);

/* The unit direction of a body's own space that a placement (column-major, object to world) turns into
 * `world`, of any length but 0. False: it is 0, or the matrix is singular. */
bool dph_light_in_object(const float matrix[16], const double world[3], double object[3]);

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
 * all; never more than DPH_DRAW_BANDS. A light of length 0 or a singular matrix gives zeros. The light is a distant
 * one (dph_light_at makes others so); for a disc it is the mean thickness over the disc. */
void dph_light_constants(const struct dph_light *light, const struct dph_thickness *thickness,
                         const float matrix[16], double mm_per_unit, int bands,
                         enum dph_window window, struct dph_light_constants *out);

/* Level of detail: how many bands of thickness a light is worth, a number from 2 to DPH_DRAW_BANDS.
 * `to_light` and `to_eye` lead away from the body, any length. 2 where the light is well in front
 * of the body, as the camera sees it, so that what is seen is lit from outside and its thickness is
 * next to nothing; all where the light is beside it or behind, and shines through. It changes
 * continuously with both directions; a length of 0 gives DPH_DRAW_BANDS. */
double dph_light_detail(const double to_light[3], const double to_eye[3]);

/* Takes out what is beyond that many bands: the values of degree l are multiplied by a smooth
 * function of bands - l that is 0 up to 0 and 1 from 1 on. So a band has vanished when it is no
 * longer needed, and nothing jumps when the attributes that hold it are not fetched any more. */
void dph_light_fade(struct dph_light_constants *constants, double bands);

#ifdef __cplusplus
}
#endif
#endif
