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
 * sigma of an exponential curve is searched: first on a grid, even in its logarithm, from 1/20 of
 * the object's size to a few mean free paths, then by golden sections around each channel's best.
 * The geometry is the same for all channels, so on the grid, where they share sigma, the three
 * pictures are the three channels of one. Other methods have one factor a channel. */
#include "judge/protocol.h"

#include "core/fail.h"

#include <math.h>
#include <string.h>

enum { GRID = 12, SECTIONS = 5 };

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

/* Basis pictures of one sigma for all channels: base in red, front in green, back in blue. */
static bool shared_basis(struct dph_fitting *fitting, double sigma, struct dph_image *image,
                         struct normal *normal, struct dph_error *err)
{
    const struct dph_training *training = fitting->training;
    size_t pixels = (size_t)training->width * (size_t)training->height;
    struct dph_material material = fitting->frame.material;
    for (int c = 0; c < 3; c++) {
        material.sigma[c] = sigma;
        material.base[c] = c == 0;
        material.front[c] = c == 1;
        material.back[c] = c == 2;
    }
    memset(normal, 0, sizeof *normal);
    for (int l = 0; l < training->nlight; l++) {
        if (!draw(fitting, &material, l, image, err))
            return false;
        for (size_t i = 0; i < pixels; i++) {
            if (!training->mask[i])
                continue;
            const float *m = image->pixel + 4 * i, *r = training->image[l].pixel + 4 * i;
            const double value[3] = {(double)m[0], (double)m[1], (double)m[2]};
            for (int c = 0; c < 3; c++)
                add(normal, l, c, value, (double)r[c]);
        }
    }
    return true;
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

/* The sections of one channel's logarithm of sigma: a point to try, and what became of it. */
struct section {
    double low, high, inner[2], value[2];
    double best, best_value;
};

static const double RATIO = 0.61803398874989485;

static double section_point(struct section *s, int round)
{
    if (round < 2)
        return s->inner[round] = round ? s->low + RATIO * (s->high - s->low)
                                       : s->high - RATIO * (s->high - s->low);
    if (s->value[0] < s->value[1]) { /* it is left of inner[1] */
        s->high = s->inner[1];
        s->inner[1] = s->inner[0];
        s->value[1] = s->value[0];
        s->value[0] = NAN;
        return s->inner[0] = s->high - RATIO * (s->high - s->low);
    }
    s->low = s->inner[0];
    s->inner[0] = s->inner[1];
    s->value[0] = s->value[1];
    s->value[1] = NAN;
    return s->inner[1] = s->low + RATIO * (s->high - s->low);
}

static void section_take(struct section *s, int round, double point, double value)
{
    s->value[round < 2 ? round : isnan(s->value[0]) ? 0 : 1] = value;
    if (value < s->best_value) {
        s->best_value = value;
        s->best = point;
    }
}

/* The best sigma of every channel. */
static bool search(struct dph_fitting *fitting, struct dph_image image[3], double sigma[3],
                   struct dph_error *err)
{
    struct normal normal;
    struct dph_medium medium;
    struct section section[3];
    double x[3], value[3][GRID], thickest = 0;
    dph_material_medium(&fitting->frame.material, &medium);
    for (int c = 0; c < 3; c++)
        thickest = fmax(thickest, medium.reduced_scattering[c] +
                                      fitting->frame.material.absorption[c]);
    double low = log(.05 / fitting->size_mm), high = log(fmax(4 * thickest, 50 / fitting->size_mm));
    double width = (high - low) / (GRID - 1);
    for (int g = 0; g < GRID; g++) {
        if (!dph_judge_step_checked(fitting->step, g / (GRID + 3. * SECTIONS), err) ||
            !shared_basis(fitting, exp(low + g * width), image, &normal, err))
            return false;
        for (int c = 0; c < 3; c++)
            value[c][g] = solve(fitting, &normal, c, x);
    }
    for (int c = 0; c < 3; c++) {
        int best = 0;
        for (int g = 1; g < GRID; g++)
            best = value[c][g] < value[c][best] ? g : best;
        double middle = low + best * width;
        section[c] = (struct section){.low = fmax(middle - width, low),
                                      .high = fmin(middle + width, high),
                                      .best = middle,
                                      .best_value = value[c][best]};
    }
    for (int round = 0; round < SECTIONS; round++) {
        double point[3];
        for (int c = 0; c < 3; c++) {
            point[c] = section_point(&section[c], round);
            sigma[c] = exp(point[c]);
        }
        if (!dph_judge_step_checked(fitting->step,
                                    (GRID + 3. * round) / (GRID + 3. * SECTIONS), err) ||
            !own_basis(fitting, sigma, image, &normal, err))
            return false;
        for (int c = 0; c < 3; c++)
            section_take(&section[c], round, point[c], solve(fitting, &normal, c, x));
    }
    for (int c = 0; c < 3; c++)
        sigma[c] = exp(section[c].best);
    return true;
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
        double one = dph_relative_error(&training->image[l], &image, training->mask,
                                        training->noise[l]);
        if (isfinite(one)) { /* a light that gives no more than noise says nothing */
            *error += one;
            count++;
        }
    }
    *error = count ? *error / count : NAN;
    dph_image_finish(&image);
    return ok;
}
