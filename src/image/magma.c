/* The colour map "magma" of N. Smith and S. van der Walt (dedicated to the public domain with CC0),
 * which FLIP's error maps are shown in: lightness grows evenly, so that it reads in grey too. Here
 * it is a polyline through each eighth of its 256 colours and the last. */
#include <diaphan/metrics.h>

enum { KNOTS = 33 };

static const double colour[KNOTS][3] = {
    {.0015, .0005, .0139}, {.0137, .0118, .0687}, {.0396, .0311, .1335}, {.0743, .0520, .2027},
    {.1131, .0655, .2768}, {.1590, .0684, .3527}, {.2117, .0620, .4186}, {.2654, .0602, .4618},
    {.3167, .0717, .4854}, {.3660, .0903, .4980}, {.4147, .1104, .5047}, {.4635, .1299, .5077},
    {.5128, .1482, .5076}, {.5629, .1654, .5047}, {.6136, .1818, .4985}, {.6649, .1981, .4888},
    {.7164, .2150, .4753}, {.7674, .2337, .4578}, {.8169, .2559, .4365}, {.8633, .2837, .4124},
    {.9043, .3196, .3881}, {.9372, .3649, .3686}, {.9609, .4183, .3596}, {.9767, .4762, .3645},
    {.9867, .5356, .3822}, {.9928, .5949, .4103}, {.9961, .6537, .4462}, {.9973, .7118, .4882},
    {.9969, .7696, .5349}, {.9951, .8271, .5857}, {.9924, .8843, .6401}, {.9894, .9415, .6975},
    {.9871, .9914, .7495},
};

bool dph_image_init_magma(struct dph_image *image, const float *map, int width, int height,
                          struct dph_error *err)
{
    if (!dph_image_init(image, width, height, err))
        return false;
    size_t pixels = (size_t)width * (size_t)height;
    for (size_t i = 0; i < pixels; i++) {
        double at = 255 * (double)map[i];
        at = at >= 255 ? 255 : at > 0 ? at : 0; /* NaN: 0 */
        int knot = (int)(at / 8); /* 31 has only 7 steps to the end */
        double t = (at - 8 * knot) / (knot == KNOTS - 2 ? 7 : 8);
        for (int c = 0; c < 3; c++) {
            double encoded = colour[knot][c] + t * (colour[knot + 1][c] - colour[knot][c]);
            image->pixel[4 * i + (size_t)c] = (float)dph_srgb_decode(encoded);
        }
        image->pixel[4 * i + 3] = 1;
    }
    return true;
}
