/* LDR-FLIP: the difference that an eye sees when two pictures alternate in one place.
 *
 * P. Andersson, J. Nilsson, T. Akenine-Moller, M. Oskarsson, K. Astrom, M. D. Fairchild: FLIP: A
 * Difference Evaluator for Alternating Images. Proceedings of the ACM on Computer Graphics and
 * Interactive Techniques (High Performance Graphics) 3(2), 2020.
 *
 * Colour. Both pictures go to YCxCz (Y = 116 y - 16, Cx = 500 (x - y), Cz = 200 (y - z), with x, y,
 * z the CIE coordinates over those of white: CIELAB without its curve), where each channel is
 * blurred with what the eye cannot resolve in it,
 *
 *     g(r) ~ a1 sqrt(pi / b1) exp(-pi^2 r^2 / b1) + a2 sqrt(pi / b2) exp(-pi^2 r^2 / b2),
 *
 * r in degrees; (a1, b1, a2, b2) = (1, 0.0047, 0, -), (1, 0.0053, 0, -), (34.1, 0.04, 13.5, 0.025).
 * The result is clipped to the RGB cube and goes to CIELAB, a and b times L / 100 (Hunt: colours
 * fade in the dark). The distance is |dL| + sqrt(da^2 + db^2), to the power qc = 0.7; of the
 * largest one (green to blue) the first share pc = 0.4 is mapped to [0, pt = 0.95], the rest
 * above.
 *
 * Features. Y / 116 of the unblurred pictures meets the first and the second derivative of a
 * Gaussian of sigma = 0.082 / 2 degrees, along x and along y, each scaled so that its positive
 * weights sum to 1 and its negative ones to -1. The lengths of the two vectors (edges, points) are
 * compared:
 *
 *     Ef = (max(| |edge_r| - |edge_t| |, | |point_r| - |point_t| |) / sqrt(2)) ^ (qf = 0.5).
 *
 * FLIP = Ec ^ (1 - Ef). Beyond the border the nearest pixel repeats.
 *
 * All these filters are products of a function of x and one of y (the blue-yellow one a sum of
 * two), so each row of the result sums columns first, then along itself, with a few rows of
 * scratch. */
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"
#include "image/metric.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;
static const double qc = 0.7, qf = 0.5, pc = 0.4, pt = 0.95, feature_width = 0.082;

/* Linear sRGB to CIE XYZ over that of white (D65), from the primaries of IEC 61966-2-1: rows sum
 * to 1. */
static const double to_relative[3][3] = {
    {0.412386563 / 0.950428545, 0.357591491 / 0.950428545, 0.180450491 / 0.950428545},
    {0.212636822, 0.715182982, 0.072180196},
    {0.019330620 / 1.088900371, 0.119197164 / 1.088900371, 0.950372587 / 1.088900371},
};

/* The one-dimensional filters, and the rows that they give. */
enum kernel { ACHROMATIC, RED_GREEN, BLUE_YELLOW, BLUE_YELLOW_2, SMOOTH, FIRST, SECOND, KERNELS };
enum row { LIGHT, RED, BLUE, EDGE_X, EDGE_Y, POINT_X, POINT_Y, ROWS };
enum { MAX_RADIUS = 140 }; /* at 1000 pixels per degree: 136 */

struct work {
    struct dph_metric_pair pair;
    float *map;          /* Nullable */
    float *plane[2][3];  /* (height x width) Y, Cx, Cz */
    double *scratch;     /* (workers x (KERNELS x (width + 2 margin) + 2 x ROWS x width)) */
    size_t scratch_size; /* of a worker */
    int margin;          /* the largest radius */
    int radius[KERNELS];
    double tap[KERNELS][2 * MAX_RADIUS + 1];
    double second_share;  /* of BLUE_YELLOW_2 in the blue-yellow filter */
    double inverse[3][3]; /* of to_relative */
    double farthest;      /* HyAB^qc of green and blue */
};

/* exp(-x^2 / (2 sigma^2)) on whole x, scaled to sum to 1; returns the sum before that. */
static double set_gaussian(struct work *work, enum kernel which, int radius, double sigma)
{
    double sum = 0;
    work->radius[which] = radius;
    for (int x = -radius; x <= radius; x++)
        sum += work->tap[which][x + radius] = exp(-0.5 * (x / sigma) * (x / sigma));
    for (int k = 0; k <= 2 * radius; k++)
        work->tap[which][k] /= sum;
    return sum;
}

/* Positive weights to a sum of 1, negative ones to -1. */
static void balance(double *tap, int count)
{
    double positive = 0, negative = 0;
    for (int k = 0; k < count; k++)
        *(tap[k] > 0 ? &positive : &negative) += fabs(tap[k]);
    for (int k = 0; k < count; k++)
        tap[k] /= tap[k] > 0 ? positive : negative;
}

static void set_kernels(struct work *work, double pixels_per_degree)
{
    /* exp(-pi^2 r^2 / b) has sigma = sqrt(b / (2 pi^2)) degrees */
    static const double b[4] = {0.0047, 0.0053, 0.04, 0.025};
    double sigma[4], widest = 0, sum[4];
    for (int i = 0; i < 4; i++) {
        sigma[i] = sqrt(b[i] / (2 * pi * pi)) * pixels_per_degree;
        if (sigma[i] > widest)
            widest = sigma[i];
    }
    int radius = (int)ceil(3 * widest);
    for (int i = 0; i < 4; i++)
        sum[i] = set_gaussian(work, (enum kernel)(ACHROMATIC + i), radius, sigma[i]);
    double one = 34.1 * sqrt(pi / b[2]) * sum[2] * sum[2];
    double two = 13.5 * sqrt(pi / b[3]) * sum[3] * sum[3];
    work->second_share = two / (one + two);

    double sd = 0.5 * feature_width * pixels_per_degree;
    int reach = (int)ceil(3 * sd);
    set_gaussian(work, SMOOTH, reach, sd);
    work->radius[FIRST] = work->radius[SECOND] = reach;
    for (int x = -reach; x <= reach; x++) {
        double g = work->tap[SMOOTH][x + reach];
        work->tap[FIRST][x + reach] = -x * g;
        work->tap[SECOND][x + reach] = (x * x / (sd * sd) - 1) * g;
    }
    balance(work->tap[FIRST], 2 * reach + 1);
    balance(work->tap[SECOND], 2 * reach + 1);
    work->margin = radius > reach ? radius : reach;
}

static void set_inverse(double out[3][3])
{
    const double(*m)[3] = to_relative;
    double determinant = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
            out[j][i] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
            if (i == 0)
                determinant += m[0][j] * out[j][0];
        }
    for (int i = 0; i < 9; i++)
        out[i / 3][i % 3] /= determinant;
}

static void multiply(const double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

/* Linear RGB in [0, 1] to CIELAB with Hunt's correction. */
static void to_lab(const double rgb[3], double lab[3])
{
    const double delta = 6.0 / 29;
    double t[3];
    multiply(to_relative, rgb, t);
    for (int k = 0; k < 3; k++)
        t[k] = t[k] > delta * delta * delta ? cbrt(t[k]) : t[k] / (3 * delta * delta) + 4.0 / 29;
    lab[0] = 116 * t[1] - 16;
    lab[1] = 0.01 * lab[0] * (500 * (t[0] - t[1]));
    lab[2] = 0.01 * lab[0] * (200 * (t[1] - t[2]));
}

/* Its sum of lightness and colour distance, to the power qc. */
static double lab_distance(const double a[3], const double b[3])
{
    return pow(fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]), qc);
}

static void convert_row(void *context, size_t y, int worker)
{
    struct work *work = context;
    size_t width = (size_t)work->pair.width;
    (void)worker;
    for (int k = 0; k < 2; k++)
        for (size_t i = y * width; i < (y + 1) * width; i++) {
            double rgb[3], t[3];
            for (size_t c = 0; c < 3; c++)
                rgb[c] = dph_metric_clip(&work->pair, work->pair.pixel[k][4 * i + c]);
            multiply(to_relative, rgb, t);
            work->plane[k][0][i] = (float)(116 * t[1] - 16);
            work->plane[k][1][i] = (float)(500 * (t[0] - t[1]));
            work->plane[k][2][i] = (float)(200 * (t[1] - t[2]));
        }
}

/* Row `y` of a plane, filtered along the columns, with its ends repeated into the margins. */
static void filter_columns(const struct work *work, enum kernel which, const float *plane, int y,
                           double *line)
{
    size_t width = (size_t)work->pair.width, margin = (size_t)work->margin;
    int radius = work->radius[which], last = work->pair.height - 1;
    memset(line, 0, (width + 2 * margin) * sizeof *line);
    for (int k = -radius; k <= radius; k++) {
        int from = y + k < 0 ? 0 : y + k > last ? last : y + k;
        const float *source = plane + (size_t)from * width;
        double tap = work->tap[which][k + radius];
        for (size_t x = 0; x < width; x++)
            line[margin + x] += tap * (double)source[x];
    }
    for (size_t i = 0; i < margin; i++) {
        line[i] = line[margin];
        line[margin + width + i] = line[margin + width - 1];
    }
}

/* out += share x (line filtered along itself). */
static void filter_line(const struct work *work, enum kernel which, double share,
                        const double *line, double *out)
{
    size_t width = (size_t)work->pair.width;
    int radius = work->radius[which];
    for (int k = -radius; k <= radius; k++) {
        const double *source = line + work->margin + k;
        double tap = share * work->tap[which][k + radius];
        for (size_t x = 0; x < width; x++)
            out[x] += tap * source[x];
    }
}

/* All rows of one picture that the result's row `y` needs. */
static void filter_row(const struct work *work, int picture, int y, double *lines, double *rows)
{
    static const int source[KERNELS] = {0, 1, 2, 2, 0, 0, 0};
    static const struct {
        enum row row;
        enum kernel columns, along;
    } step[] = {
        {LIGHT, ACHROMATIC, ACHROMATIC},
        {RED, RED_GREEN, RED_GREEN},
        {BLUE, BLUE_YELLOW, BLUE_YELLOW},
        {BLUE, BLUE_YELLOW_2, BLUE_YELLOW_2},
        {EDGE_X, SMOOTH, FIRST},
        {EDGE_Y, FIRST, SMOOTH},
        {POINT_X, SMOOTH, SECOND},
        {POINT_Y, SECOND, SMOOTH},
    };
    size_t width = (size_t)work->pair.width, stride = width + 2 * (size_t)work->margin;
    for (int k = 0; k < KERNELS; k++)
        filter_columns(work, (enum kernel)k, work->plane[picture][source[k]], y,
                       lines + (size_t)k * stride);
    memset(rows, 0, ROWS * width * sizeof *rows);
    for (size_t s = 0; s < sizeof step / sizeof step[0]; s++) {
        double share = step[s].along == BLUE_YELLOW     ? 1 - work->second_share
                       : step[s].along == BLUE_YELLOW_2 ? work->second_share
                                                        : 1;
        filter_line(work, step[s].along, share, lines + (size_t)step[s].columns * stride,
                    rows + (size_t)step[s].row * width);
    }
}

/* The blurred colour of pixel x, clipped to what a screen can show, in Hunt's CIELAB. */
static void blurred_lab(const struct work *work, const double *rows, size_t x, double lab[3])
{
    size_t width = (size_t)work->pair.width;
    double y = (rows[LIGHT * width + x] + 16) / 116, rgb[3];
    double t[3] = {y + rows[RED * width + x] / 500, y, y - rows[BLUE * width + x] / 200};
    multiply(work->inverse, t, rgb);
    for (int k = 0; k < 3; k++)
        rgb[k] = rgb[k] > 1 ? 1 : rgb[k] > 0 ? rgb[k] : 0;
    to_lab(rgb, lab);
}

static double flip_at(const struct work *work, const double *rows[2], size_t x)
{
    size_t width = (size_t)work->pair.width;
    double lab[2][3], edge[2], point[2];
    for (int k = 0; k < 2; k++) {
        blurred_lab(work, rows[k], x, lab[k]);
        edge[k] = hypot(rows[k][EDGE_X * width + x], rows[k][EDGE_Y * width + x]) / 116;
        point[k] = hypot(rows[k][POINT_X * width + x], rows[k][POINT_Y * width + x]) / 116;
    }
    double distance = lab_distance(lab[0], lab[1]), knee = pc * work->farthest;
    double colour = distance < knee ? pt / knee * distance
                                    : pt + (distance - knee) / (work->farthest - knee) * (1 - pt);
    double feature = fmax(fabs(edge[0] - edge[1]), fabs(point[0] - point[1]));
    feature = fmin(pow(feature / sqrt(2), qf), 1);
    return pow(fmin(colour, 1), 1 - feature);
}

static void flip_row(void *context, size_t y, int worker)
{
    struct work *work = context;
    struct dph_metric_pair *pair = &work->pair;
    size_t width = (size_t)pair->width;
    double *lines = work->scratch + (size_t)worker * work->scratch_size;
    double *rows = lines + KERNELS * (width + 2 * (size_t)work->margin);
    const double *both[2] = {rows, rows + ROWS * width};
    for (int k = 0; k < 2; k++)
        filter_row(work, k, (int)y, lines, rows + (size_t)k * ROWS * width);
    for (size_t x = 0; x < width; x++) {
        size_t i = y * width + x;
        double flip = 0;
        if (!pair->mask || pair->mask[i]) {
            flip = flip_at(work, both, x);
            pair->sum[y] += flip;
            pair->count[y]++;
        }
        if (work->map)
            work->map[i] = (float)flip;
    }
}

bool dph_metric_flip(const struct dph_image *reference, const struct dph_image *test,
                     const struct dph_metric_params *params, double *flip, float *map,
                     struct dph_error *err)
{
    bool ok = false;
    struct dph_metric_pair pair;
    if (!dph_metric_begin(&pair, reference, test, params, err))
        return false;
    size_t width = (size_t)pair.width, height = (size_t)pair.height;
    struct work *work = dph_alloc_zero(1, sizeof *work);
    if (!work) {
        dph_fail_memory(err);
        goto error;
    }
    work->pair = pair;
    work->map = map;
    set_kernels(work, params->pixels_per_degree);
    set_inverse(work->inverse);
    double green[3], blue[3];
    to_lab((const double[3]){0, 1, 0}, green);
    to_lab((const double[3]){0, 0, 1}, blue);
    work->farthest = lab_distance(green, blue);

    work->scratch_size = KERNELS * (width + 2 * (size_t)work->margin) + 2 * ROWS * width;
    work->scratch = dph_alloc((size_t)pair.workers * work->scratch_size, sizeof *work->scratch);
    bool room = work->scratch != NULL;
    for (int k = 0; k < 6; k++) {
        float **plane = &work->plane[k / 3][k % 3];
        *plane = dph_alloc(width * height, sizeof **plane);
        room = room && *plane;
    }
    if (!room) {
        dph_fail_memory(err);
        goto error;
    }
    dph_parallel(pair.workers, height, convert_row, work);
    dph_parallel(pair.workers, height, flip_row, work);
    *flip = dph_metric_mean(&pair);
    ok = true;

error:
    if (work) {
        free(work->scratch);
        for (int k = 0; k < 6; k++)
            free(work->plane[k / 3][k % 3]);
    }
    free(work);
    dph_metric_end(&pair);
    return ok;
}
