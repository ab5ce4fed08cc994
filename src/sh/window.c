/* Windows: factors by band that damp the ringing of a truncated expansion.
 *
 * A function with a jump, cut off after n bands, overshoots beside the jump (Gibbs). Weights that
 * fall towards the last band trade the overshoot for blur; both windows are taken over from Fourier
 * series, where Lanczos's sigma factors and von Hann's raised cosine do the same. Drawing applies
 * them to the values of the light, because a dot product does not care which side they are on: what
 * is stored stays exact, and a window can be changed without another bake. */
#include <diaphan/sh.h>

#include <assert.h>
#include <math.h>

double dph_sh_window(enum dph_window window, int l, int bands)
{
    assert(l >= 0 && l < bands);
    const double pi = 3.14159265358979323846;
    double x = pi * l / bands;
    switch (window) {
    case DPH_WINDOW_HANN:
        return .5 * (1 + cos(x));
    case DPH_WINDOW_LANCZOS:
        return l ? sin(x) / x : 1;
    case DPH_WINDOW_NONE:
        break;
    }
    return 1;
}
