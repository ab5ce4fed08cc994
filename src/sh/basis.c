/* Real spherical harmonics in Cartesian form.
 *
 * The function of degree l and order m at the unit direction (x, y, z) is
 *
 *     y_lm = (-1)^m N_l|m| P_l|m|(z) C_m(x, y)      for m >= 0
 *     y_lm = (-1)^m N_l|m| P_l|m|(z) S_|m|(x, y)    for m <  0
 *
 * where C_m + i S_m = (x + i y)^m = sin^m(theta) e^(i m phi), and P_lm is the associated Legendre
 * function without its factor sin^m(theta). That factor has moved into C_m and S_m, so nothing is
 * divided by sin(theta) and the poles are points like any other (P.-P. Sloan, "Efficient Spherical
 * Harmonic Evaluation", JCGT 2(2), 2013). The recurrences are the classical ones (Abramowitz and
 * Stegun, 8.5.3):
 *
 *     P_mm = (2m-1)!!,   P_(m+1)m = (2m+1) z P_mm,   (l-m) P_lm = (2l-1) z P_(l-1)m - (l+m-1) P_(l-2)m
 *
 * and N_lm^2 = (2l+1)/(4 pi) (l-m)!/(l+m)!, twice that for m > 0, makes the set orthonormal over
 * the sphere. The sign (-1)^m is that of Condon and Shortley; it is carried by P_mm, hence by every
 * P_lm of that order.
 *
 * Only additions, multiplications, divisions and square roots occur: the values have the same bits
 * on every machine. */
#include <diaphan/sh.h>

#include <assert.h>
#include <math.h>

enum { MAX_BANDS = 16 };

void dph_sh_eval(int bands, const double direction[3], double *value)
{
    assert(bands >= 1 && bands <= MAX_BANDS);
    const double inverse_4pi = 0.079577471545947667884;
    double x = direction[0], y = direction[1], z = direction[2];
    double ratio[MAX_BANDS]; /* (l-m)! / (l+m)! for the order at hand, by l */
    double c = 1, s = 0;     /* C_m and S_m                                 */
    double diagonal = 1;     /* (-1)^m P_mm                                 */

    for (int l = 0; l < bands; l++)
        ratio[l] = 1;
    for (int m = 0; m < bands; m++) {
        double before = 0, p = diagonal;
        for (int l = m; l < bands; l++) {
            double norm = sqrt((m ? 2 : 1) * (2 * l + 1) * inverse_4pi * ratio[l]);
            value[l * (l + 1) + m] = norm * p * c;
            if (m)
                value[l * (l + 1) - m] = norm * p * s;
            /* the next degree of this order, then the next order of this degree */
            double next = ((2 * l + 1) * z * p - (l + m) * before) / (l + 1 - m);
            before = p;
            p = next;
            ratio[l] /= (double)((l + m + 1) * (l > m ? l - m : 1));
        }
        double turned = x * c - y * s;
        s = x * s + y * c;
        c = turned;
        diagonal *= -(2 * m + 1);
    }
}
