/* Level of detail by the places of light and camera.
 *
 * Tomaszewska and Stefanowski choose the indices of the coefficients from the position of the object
 * relative to the camera and from the light's, and say that four coefficients do with light from the
 * front. That is read here as a level of detail: what of a body is seen under a light that stands
 * beside the camera faces the light, and its thickness towards it is next to 0; seen against the
 * light, it is all that matters. The switch is a fade: the number of bands is a continuous function
 * of the angle between light and camera, and a band's weight a smooth one of that number. */
#include <diaphan/light.h>

#include <math.h>

/* Cosines of the angle between light and camera, from the body: all bands at FULL and below, from 70
 * degrees on, two at FRONT and above, up to 26 degrees. Between 50 and 70 degrees two bands err the
 * most: the light grazes what is seen. */
#define FULL 0.35
#define FRONT 0.9
#define FEWEST 2

double dph_light_detail(const double to_light[3], const double to_eye[3])
{
    double dot = 0, light = 0, eye = 0;
    for (int k = 0; k < 3; k++) {
        dot += to_light[k] * to_eye[k];
        light += to_light[k] * to_light[k];
        eye += to_eye[k] * to_eye[k];
    }
    double length = sqrt(light) * sqrt(eye);
    if (!(length > 0) || !isfinite(length))
        return DPH_DRAW_BANDS;
    double front = (dot / length - FULL) / (FRONT - FULL);
    return DPH_DRAW_BANDS - (DPH_DRAW_BANDS - FEWEST) * fmin(fmax(front, 0), 1);
}

void dph_light_fade(struct dph_light_constants *constants, double bands)
{
    for (int l = 0; l < DPH_DRAW_BANDS; l++) {
        double t = fmin(fmax(bands - l, 0), 1);
        float weight = (float)(t * t * (3 - 2 * t));
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            constants->sh[i / 4][i % 4] *= weight;
    }
}
