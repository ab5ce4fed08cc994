/* The per-frame CPU stage of SHSSS: a light and an instance become 36 numbers (Tomaszewska,
 * Stefanowski 2012).
 *
 * A body is baked in its own space, so the light goes there: with A the linear part of the
 * instance's matrix, the direction is A^-1 L, made unit length L_o. One unit of length along L_o is
 * |A L_o| units of the scene and that many times mm_per_unit millimetres. The factor, the scale by
 * which a band is stored and the window are all folded into the values of the harmonics, so that a
 * vertex needs nothing but the dot product. */
#include <diaphan/light.h>

#include <math.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)

void dph_light_direction(double azimuth, double elevation, double direction[3])
{
    double a = azimuth * DEGREE, e = elevation * DEGREE;
    direction[0] = cos(e) * sin(a);
    direction[1] = sin(e);
    direction[2] = cos(e) * cos(a);
}

/* Scales v to unit length without overflow; false for zero and for what is not finite. */
static bool normalise(double v[3])
{
    double largest = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    if (!(largest > 0) || !isfinite(largest) || !isfinite(v[0] + v[1] + v[2]))
        return false;
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        v[i] /= largest;
        sum += v[i] * v[i];
    }
    double length = sqrt(sum);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return true;
}

/* out = A^-1 v up to a positive factor, for the linear part of a column-major matrix: the rows of
 * the adjugate are cross products of columns. False for a singular matrix. The columns are brought
 * to a common size first, so that tiny and huge scales work alike. */
static bool solve(const float matrix[16], const double v[3], double out[3])
{
    double column[3][3], largest = 0;
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++) {
            column[c][r] = matrix[4 * c + r];
            largest = fmax(largest, fabs(column[c][r]));
        }
    if (!(largest > 0) || !isfinite(largest))
        return false;
    double cross[3][3], determinant = 0, size = 1;
    for (int c = 0; c < 3; c++) {
        double length = 0;
        for (int r = 0; r < 3; r++) {
            column[c][r] /= largest;
            length += column[c][r] * column[c][r];
        }
        size *= sqrt(length);
    }
    for (int c = 0; c < 3; c++) {
        const double *a = column[(c + 1) % 3], *b = column[(c + 2) % 3];
        for (int r = 0; r < 3; r++)
            cross[c][r] = a[(r + 1) % 3] * b[(r + 2) % 3] - a[(r + 2) % 3] * b[(r + 1) % 3];
    }
    for (int r = 0; r < 3; r++)
        determinant += column[0][r] * cross[0][r];
    if (!(fabs(determinant) > 1e-12 * size)) /* flat within the rounding of floats */
        return false;
    for (int c = 0; c < 3; c++)
        out[c] = (cross[c][0] * v[0] + cross[c][1] * v[1] + cross[c][2] * v[2]) / determinant;
    return true;
}

void dph_light_at(const struct dph_light *light, const double point[3], struct dph_light *out)
{
    struct dph_light at = *light;
    if (light->kind != DPH_LIGHT_DISTANT) {
        double square = 0, axis[3], unit[3], share = 1;
        for (int k = 0; k < 3; k++) {
            unit[k] = light->position[k] - point[k];
            square += unit[k] * unit[k];
            axis[k] = light->to_light[k];
        }
        at = (struct dph_light){.kind = DPH_LIGHT_DISTANT};
        if (square > 0 && normalise(unit)) {
            if (light->kind == DPH_LIGHT_SPOT) {
                double dark = cos(light->angle * DEGREE), full = cos(.9 * light->angle * DEGREE);
                double cosine = normalise(axis)
                                    ? axis[0] * unit[0] + axis[1] * unit[1] + axis[2] * unit[2]
                                    : -1;
                double t = fmin(fmax((cosine - dark) / (full - dark), 0), 1);
                share = t * t * (3 - 2 * t);
            }
            for (int k = 0; k < 3; k++) {
                at.to_light[k] = unit[k];
                at.irradiance[k] = light->irradiance[k] * share / square;
            }
        }
    }
    *out = at;
}

/* Mean of a function of degree l that is rotationally symmetric over a disc of half-angle `angle`
 * around its axis, over its value there: the mean of P_l over the disc, (P_l-1(c) - P_l+1(c)) /
 * ((2l + 1)(1 - c)) with c the cosine of the angle. */
static double disc_mean(int l, double angle)
{
    double c = cos(angle * DEGREE), before = 1, p = 1, after = c;
    if (l == 0 || !(1 - c > 1e-12))
        return 1;
    for (int k = 0; k < l; k++) { /* P_l-1, P_l, P_l+1 */
        double next = ((2 * k + 3) * c * after - (k + 1) * p) / (k + 2);
        before = p;
        p = after;
        after = next;
    }
    return (before - after) / ((2 * l + 1) * (1 - c));
}

bool dph_light_in_object(const float matrix[16], const double world[3], double object[3])
{
    double unit[3] = {world[0], world[1], world[2]};
    return normalise(unit) && solve(matrix, unit, object) && normalise(object);
}

void dph_light_constants(const struct dph_light *light, const struct dph_thickness *thickness,
                         const float matrix[16], double mm_per_unit, int bands,
                         enum dph_window window, struct dph_light_constants *out)
{
    memset(out, 0, sizeof *out);
    double to_light[3], object[3];
    memcpy(to_light, light->to_light, sizeof to_light);
    if (!normalise(to_light) || !solve(matrix, to_light, object) || !normalise(object))
        return;
    for (int i = 0; i < 3; i++) {
        out->to_light[i] = (float)to_light[i];
        out->irradiance[i] = (float)light->irradiance[i];
    }
    double length = 0; /* |A L_o| */
    for (int r = 0; r < 3; r++) {
        double sum = 0;
        for (int c = 0; c < 3; c++)
            sum += (double)matrix[4 * c + r] * object[c];
        length += sum * sum;
    }
    double factor = sqrt(length) * mm_per_unit;

    int used = thickness->bands < DPH_DRAW_BANDS ? thickness->bands : DPH_DRAW_BANDS;
    if (bands > 0 && bands < used)
        used = bands;
    double value[DPH_DRAW_BANDS * DPH_DRAW_BANDS];
    if (used < 1) /* no thickness: the directions alone */
        return;
    dph_sh_eval(used, object, value);
    for (int l = 0; l < used; l++) {
        double weight = factor * (double)thickness->scale[l] * dph_sh_window(window, l, used) *
                        disc_mean(l, light->angle);
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            out->sh[i / 4][i % 4] = (float)(value[i] * weight);
    }
}
