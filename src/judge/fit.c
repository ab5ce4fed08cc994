/* Fitting the free numbers of a method to the truth under the training lights.
 *
 * The radiance of diaphan/material.h is linear in base, front and back: the picture is a sum
 *
 *     m = b B + f F + g G        (formula G; the paper's sum has no G),
 *
 * of pictures that the method's own shader draws with one of the three 1 and the others 0, edges
 * and all. So for a given curve T the best numbers follow from normal equations, with no number
 * negative (solve.c), a channel at a time. Every light's error is taken relative to the sum of
 * squares of its truth: the front, a hundred times brighter than the back, would decide everything
 * otherwise.
 *
 * sigma of an exponential curve is searched first, on a grid even in its logarithm, from 1/20 of
 * the object's size to a few mean free paths, then by golden sections. For this one picture a light
 * is enough: its channels are exp(-d / size), max(0, mu) and max(0, -mu), from which B, F and G of
 * any sigma follow at every pixel (but for pixels that several triangles share, which is why the
 * last step is drawn again). Other methods have one factor a channel. */
#include "judge/protocol.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GRID = 24, SECTIONS = 10 };

/* Sums over the object, by light and channel of the truth. */
struct normal {
    double matrix[DPH_TRAINING_LIGHTS][3][9]; /* by channel: products of its basis pictures */
    double right[DPH_TRAINING_LIGHTS][3][3];  /* by channel: with the truth                 */
};

/* Draws the frame under one training light. */
static bool draw(struct dph_fitting *fitting, const struct dph_material *material, int light,
                 struct dph_image *image, struct dph_error *err)
{
    struct dph_frame frame = fitting->frame;
    frame.material = *material;
    frame.nlight = 1;
    frame.light[0] = fitting->training->light[light];
    return dph_renderer_draw(fitting->renderer, &frame, image, err);
}

/* The weighted sum of a channel's normal equations over the lights. */
static void gather(const struct dph_fitting *fitting, const struct normal *normal, int channel,
                   int n, double matrix[9], double right[3])
{
    memset(matrix, 0, 9 * sizeof *matrix);
    memset(right, 0, 3 * sizeof *right);
    for (int l = 0; l < fitting->training->nlight; l++) {
        double weight = fitting->training->weight[l][channel];
        for (int i = 0; i < n; i++) {
            right[i] += weight * normal->right[l][channel][i];
            for (int j = 0; j < n; j++)
                matrix[i * n + j] += weight * normal->matrix[l][channel][3 * i + j];
        }
    }
}

/* Adds the products of three basis values with each other and with one channel of the truth. */
static void add(struct normal *normal, int light, int channel, const double value[3], double truth)
{
    for (int i = 0; i < 3; i++) {
        normal->right[light][channel][i] += value[i] * truth;
        for (int j = 0; j < 3; j++)
            normal->matrix[light][channel][3 * i + j] += value[i] * value[j];
    }
}

/* What one pixel of the object is under one training light. */
struct probe {
    float thickness; /* mm */
    float front, back; /* max(0, mu), max(0, -mu), times irradiance and coverage */
    float whole;     /* irradiance times coverage */
};

/* Draws what the shader has of thickness and angle; `probe` (nlight x pixels of the object). */
static bool draw_probes(struct dph_fitting *fitting, struct dph_image *image, struct probe *probe,
                        struct dph_error *err)
{
    const struct dph_training *training = fitting->training;
    size_t pixels = (size_t)training->width * (size_t)training->height;
    struct dph_material material = fitting->frame.material;
    material.formula = DPH_FORMULA_G;
    material.curve = DPH_CURVE_EXP;
    for (int c = 0; c < 3; c++) {
        material.sigma[c] = c == 0 ? 1 / fitting->size_mm : 0;
        material.base[c] = c == 0;
        material.front[c] = c == 1;
        material.back[c] = c == 2;
    }
    for (int l = 0; l < training->nlight; l++) {
        if (!draw(fitting, &material, l, image, err))
            return false;
        for (size_t i = 0; i < pixels; i++) {
            if (!training->mask[i])
                continue;
            const float *m = image->pixel + 4 * i;
            double whole = (double)m[3] * training->light[l].irradiance[0];
            double through = whole > 0 ? (double)m[0] / whole : 1;
            probe->whole = (float)whole;
            probe->front = m[1];
            probe->back = m[2];
            probe->thickness =
                (float)(-log(fmin(fmax(through, 1e-30), 1)) * fitting->size_mm);
            probe++;
        }
    }
    return true;
}

/* The normal equations of one channel for a sigma, solved; the value that is to be least. */
static double try_sigma(const struct dph_fitting *fitting, const struct probe *probe, int channel,
                        double sigma)
{
    const struct dph_training *training = fitting->training;
    size_t pixels = (size_t)training->width * (size_t)training->height;
    bool paper = fitting->frame.material.formula == DPH_FORMULA_PAPER;
    int n = paper ? 2 : 3;
    double matrix[9] = {0}, right[3] = {0}, x[3];
    for (int l = 0; l < training->nlight; l++) {
        double weight = training->weight[l][channel];
        const float *truth = training->image[l].pixel + channel;
        for (size_t i = 0; i < pixels; i++) {
            if (!training->mask[i])
                continue;
            double t = exp(-sigma * (double)probe->thickness);
            const double value[3] = {t * (double)probe->whole,
                                     (paper ? 1 : t) * (double)probe->front,
                                     t * (double)probe->back};
            for (int j = 0; j < n; j++) {
                right[j] += weight * value[j] * (double)truth[4 * i];
                for (int k = 0; k <= j; k++)
                    matrix[j * n + k] += weight * value[j] * value[k];
            }
            probe++;
        }
    }
    for (int j = 0; j < n; j++)
        for (int k = j + 1; k < n; k++)
            matrix[j * n + k] = matrix[k * n + j];
    return dph_solve_nonnegative(n, matrix, right, x);
}

/* Basis pictures where every channel has its own curve: one after the other. `image` (3). */
static bool own_basis(struct dph_fitting *fitting, const double sigma[3],
                      struct dph_image image[3], struct normal *normal, struct dph_error *err)
{
    const struct dph_training *training = fitting->training;
    size_t pixels = (size_t)training->width * (size_t)training->height;
    struct dph_material material = fitting->frame.material;
    int unknowns = material.formula == DPH_FORMULA_PAPER ? 2 : 3;
    memset(normal, 0, sizeof *normal);
    for (int l = 0; l < training->nlight; l++) {
        for (int k = 0; k < unknowns; k++) {
            for (int c = 0; c < 3; c++) {
                material.sigma[c] = sigma[c];
                material.base[c] = k == 0;
                material.front[c] = k == 1;
                material.back[c] = k == 2;
            }
            if (!draw(fitting, &material, l, &image[k], err))
                return false;
        }
        for (size_t i = 0; i < pixels; i++) {
            if (!training->mask[i])
                continue;
            for (size_t c = 0; c < 3; c++) {
                double value[3] = {0};
                for (int k = 0; k < unknowns; k++)
                    value[k] = (double)image[k].pixel[4 * i + c];
                add(normal, l, (int)c, value, (double)training->image[l].pixel[4 * i + c]);
            }
        }
    }
    return true;
}

/* Solves a channel; the value that is to be least, up to a constant. */
static double solve(const struct dph_fitting *fitting, const struct normal *normal, int channel,
                    double x[3])
{
    double matrix[9], right[3];
    int n = fitting->frame.material.formula == DPH_FORMULA_PAPER ? 2 : 3;
    gather(fitting, normal, channel, n, matrix, right);
    x[2] = 0;
    return dph_solve_nonnegative(n, matrix, right, x);
}

/* The best sigma of one channel, between exp(low) and exp(high). */
static double search_channel(const struct dph_fitting *fitting, const struct probe *probe,
                             int channel, double low, double high)
{
    static const double ratio = 0.38196601125010515; /* of the larger part, as a golden section */
    double width = (high - low) / (GRID - 1), least = INFINITY, middle = low;
    for (int g = 0; g < GRID; g++) {
        double value = try_sigma(fitting, probe, channel, exp(low + g * width));
        if (value < least) {
            least = value;
            middle = low + g * width;
        }
    }
    double left = fmax(middle - width, low), right = fmin(middle + width, high);
    for (int round = 0; round < SECTIONS; round++) {
        bool above = right - middle > middle - left;
        double point = middle + ratio * (above ? right - middle : left - middle);
        double value = try_sigma(fitting, probe, channel, exp(point));
        if (value < least) {
            if (above)
                left = middle;
            else
                right = middle;
            middle = point;
            least = value;
        } else if (above) {
            right = point;
        } else {
            left = point;
        }
    }
    return exp(middle);
}

/* The best sigma of every channel. */
static bool search(struct dph_fitting *fitting, struct dph_image *image, double sigma[3],
                   struct dph_error *err)
{
    const struct dph_training *training = fitting->training;
    struct dph_medium medium;
    double thickest = 0;
    struct probe *probe = dph_alloc((size_t)training->nlight * training->pixels, sizeof *probe);
    if (!probe)
        return dph_fail_memory(err);
    dph_material_medium(&fitting->frame.material, &medium);
    for (int c = 0; c < 3; c++)
        thickest = fmax(thickest, medium.reduced_scattering[c] +
                                      fitting->frame.material.absorption[c]);
    double low = log(.05 / fitting->size_mm), high = log(fmax(4 * thickest, 50 / fitting->size_mm));
    bool ok = draw_probes(fitting, image, probe, err);
    for (int c = 0; c < 3 && ok; c++) {
        ok = dph_judge_step_checked(fitting->step, c / 3., err);
        if (ok)
            sigma[c] = search_channel(fitting, probe, c, low, high);
    }
    free(probe);
    return ok;
}

static bool begin_images(const struct dph_training *training, struct dph_image *image, int count,
                         struct dph_error *err)
{
    for (int k = 0; k < count; k++)
        if (!dph_image_init(&image[k], training->width, training->height, err))
            return false;
    return true;
}

bool dph_fit_thickness(struct dph_fitting *fitting, struct dph_material *material,
                       struct dph_error *err)
{
    struct dph_image image[3] = {{0}};
    struct normal normal;
    double sigma[3], x[3];
    *material = fitting->frame.material;
    memcpy(sigma, material->sigma, sizeof sigma);
    bool ok = begin_images(fitting->training, image, 3, err) &&
              (material->curve != DPH_CURVE_EXP || search(fitting, image, sigma, err)) &&
              own_basis(fitting, sigma, image, &normal, err);
    for (int c = 0; c < 3 && ok; c++) {
        solve(fitting, &normal, c, x);
        material->sigma[c] = sigma[c];
        material->base[c] = x[0];
        material->front[c] = x[1];
        material->back[c] = x[2];
    }
    for (int k = 0; k < 3; k++)
        dph_image_finish(&image[k]);
    return ok;
}

bool dph_fit_gain(struct dph_fitting *fitting, double gain[3], struct dph_error *err)
{
    const struct dph_training *training = fitting->training;
    size_t pixels = (size_t)training->width * (size_t)training->height;
    struct dph_image image = {0};
    double square[3] = {0}, product[3] = {0};
    bool ok = begin_images(training, &image, 1, err);
    for (int l = 0; l < training->nlight && ok; l++) {
        ok = draw(fitting, &fitting->frame.material, l, &image, err);
        for (size_t i = 0; i < pixels && ok; i++)
            for (size_t c = 0; c < 3 && training->mask[i]; c++) {
                double m = (double)image.pixel[4 * i + c];
                double r = (double)training->image[l].pixel[4 * i + c];
                square[c] += training->weight[l][c] * m * m;
                product[c] += training->weight[l][c] * m * r;
            }
    }
    for (int c = 0; c < 3; c++)
        gain[c] = square[c] > 0 && product[c] > 0 ? product[c] / square[c] : square[c] > 0 ? 0 : 1;
    dph_image_finish(&image);
    return ok;
}

bool dph_fit_error(struct dph_fitting *fitting, const struct dph_material *material,
                   const double gain[3], double *error, struct dph_error *err)
{
    const struct dph_training *training = fitting->training;
    size_t pixels = (size_t)training->width * (size_t)training->height;
    struct dph_image image = {0};
    int count = 0;
    *error = 0;
    bool ok = begin_images(training, &image, 1, err);
    for (int l = 0; l < training->nlight && ok; l++) {
        if (!(ok = draw(fitting, material, l, &image, err)))
            break;
        for (size_t i = 0; i < pixels; i++)
            for (size_t c = 0; c < 3; c++)
                image.pixel[4 * i + c] *= (float)gain[c];
        double one = dph_relative_error(&training->image[l], training->noise[l], &image, 0,
                                        training->mask);
        if (isfinite(one)) { /* a light that gives no more than noise says nothing */
            *error += one;
            count++;
        }
    }
    *error = count ? *error / count : NAN;
    dph_image_finish(&image);
    return ok;
}
