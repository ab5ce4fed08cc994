/* Distant light as spherical harmonics.
 *
 * A picture's pixel is a patch between two parallels and two meridians, of solid angle (sin
 * el_top - sin el_bottom) dphi. Pixels of small pictures are too large for the basis to be taken
 * at their centres: they are divided until there are ROWS rows; those of large ones are first
 * joined, by solid angle, to no fewer.
 *
 * A disc of half-angle b with radiance L has the irradiance E = pi L sin^2 b and the
 * coefficients 2 pi (1 - cos b) L Pbar_l y_lm, where Pbar_l, the mean of Legendre's P_l over the
 * cap, comes from a Gauss rule that is exact; so small discs go over into points without
 * cancellation:
 *
 *   l_lm = E 2 / (1 + cos b) Pbar_l y_lm(direction)
 *
 * Rotation: R f has the coefficients integral of f(R^-1 s) y_i(s) ds. Products of two functions
 * of n bands are of degree 2n - 2, which n Gauss points in z and 2n - 1 longitudes integrate
 * exactly. */
#include <diaphan/environment.h>

#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { ROWS = 512, MOST_ROWS = 1024 };

void dph_environment_direction(int width, int height, double x, double y, double direction[3])
{
    double azimuth = PI - 2 * PI * x / width, elevation = PI / 2 - PI * y / height;
    direction[0] = cos(elevation) * sin(azimuth);
    direction[1] = sin(elevation);
    direction[2] = cos(elevation) * cos(azimuth);
}

/* How a picture is cut into strips, each summed by one task. */
struct projection {
    const float *pixel;
    int width, height, components, bands;
    int split, join;     /* strips a row of pixels, or rows and columns of pixels joined to one    */
    double *sum;         /* (strips x 3 x bands * bands)                                           */
};

static double radiance_of(float value)
{
    return value > 0 ? value < 1e30f ? (double)value : 1e30 : 0; /* what is not a number fails the first test */
}

static void project_strip(void *context, size_t strip, int worker)
{
    (void)worker;
    const struct projection *p = context;
    int ncoef = p->bands * p->bands, columns = p->split > 1 ? p->width * p->split : p->width;
    double *sum = p->sum + strip * 3 * (size_t)ncoef;
    /* the strip's rows, in pixels */
    double top = p->split > 1 ? (double)strip / p->split : (double)strip * p->join;
    double bottom = p->split > 1 ? (double)(strip + 1) / p->split : fmin(top + p->join, p->height);
    int row0 = (int)((strip / (size_t)p->split) * (size_t)p->join);
    int row1 = p->split > 1 ? row0 + 1 : (int)bottom;
    for (int x0 = 0; x0 < columns; x0 += p->join) {
        int x1 = x0 + p->join < columns ? x0 + p->join : columns;
        double light[3] = {0, 0, 0};
        for (int row = row0; row < row1; row++) {
            double a = p->split > 1 ? top : row, b = p->split > 1 ? bottom : row + 1;
            double angle = (cos(PI * a / p->height) - cos(PI * b / p->height)) * 2 * PI / columns;
            for (int x = x0; x < x1; x++) {
                const float *pixel = p->pixel +
                    ((size_t)row * (size_t)p->width + (size_t)(x / p->split)) * (size_t)p->components;
                for (int c = 0; c < 3; c++)
                    light[c] += angle * radiance_of(pixel[c]);
            }
        }
        double direction[3], y[DPH_MAX_BANDS * DPH_MAX_BANDS];
        dph_environment_direction(columns, p->height, (x0 + x1) / 2.0, (top + bottom) / 2, direction);
        dph_sh_eval(p->bands, direction, y);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < ncoef; i++)
                sum[c * ncoef + i] += light[c] * y[i];
    }
}

bool dph_environment_project(const float *pixel, int width, int height, int components, int bands,
                             int threads, double *coefficient, struct dph_error *err)
{
    if (width < 1 || height < 1 || width > 1 << 20 || height > 1 << 20 || components < 3)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "surroundings of %d x %d pixels with %d components", width,
                        height, components);
    if (bands < 1 || bands > DPH_MAX_BANDS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "bands are 1 to %d, not %d", DPH_MAX_BANDS, bands);
    size_t length = 3 * (size_t)(bands * bands);
    struct projection p = {.pixel = pixel, .width = width, .height = height, .components = components,
                           .bands = bands, .split = 1, .join = 1};
    if (height < ROWS)
        p.split = (ROWS + height - 1) / height;
    else if (height > MOST_ROWS)
        p.join = height / ROWS;
    size_t strips = p.split > 1 ? (size_t)height * (size_t)p.split
                                : ((size_t)height + (size_t)p.join - 1) / (size_t)p.join;
    p.sum = dph_alloc_zero(strips, length * sizeof *p.sum);
    if (!p.sum)
        return dph_fail_memory(err);
    dph_parallel(dph_thread_count(threads), strips, project_strip, &p);
    memset(coefficient, 0, length * sizeof *coefficient);
    for (size_t s = 0; s < strips; s++)
        for (size_t i = 0; i < length; i++)
            coefficient[i] += p.sum[s * length + i];
    free(p.sum);
    return true;
}

/* Nodes and weights of Gauss and Legendre on [-1, 1], exact to degree 2 count - 1, by Newton's
 * method. */
static void gauss_legendre(int count, double *node, double *weight)
{
    for (int i = 0; i < count; i++) {
        double x = cos(PI * (i + 0.75) / (count + 0.5)), slope = 1;
        for (int step = 0; step < 20; step++) {
            double before = 1, p = x;
            for (int l = 1; l < count; l++) {
                double next = ((2 * l + 1) * x * p - l * before) / (l + 1);
                before = p;
                p = next;
            }
            slope = count * (x * p - before) / (x * x - 1);
            x -= p / slope;
        }
        node[i] = x;
        weight[i] = 2 / ((1 - x * x) * slope * slope);
    }
}

enum { GAUSS = 8 }; /* exact to degree 15 */

void dph_environment_disc_zonal(int bands, double half_angle, double *zonal)
{
    assert(bands >= 1 && bands <= 16 && half_angle >= 0 && half_angle <= 90);
    double node[GAUSS], weight[GAUSS], s = sin(half_angle * PI / 360), depth = 2 * s * s; /* 1 - cos b */
    gauss_legendre(GAUSS, node, weight);
    for (int l = 0; l < bands; l++)
        zonal[l] = 0;
    for (int i = 0; i < GAUSS; i++) {
        double t = 1 - depth * (1 - node[i]) / 2, before = 0, p = 1;
        for (int l = 0; l < bands; l++) {
            zonal[l] += weight[i] / 2 * p;
            double next = ((2 * l + 1) * t * p - l * before) / (l + 1);
            before = p;
            p = next;
        }
    }
    for (int l = 0; l < bands; l++)
        zonal[l] *= 2 / (2 - depth) * sqrt((2 * l + 1) / (4 * PI));
}

void dph_environment_disc(int bands, const double direction[3], double half_angle, double *coefficient)
{
    double zonal[16];
    dph_sh_eval(bands, direction, coefficient);
    dph_environment_disc_zonal(bands, half_angle, zonal);
    dph_sh_convolve(bands, zonal, coefficient);
}

double dph_sh_cosine(int l)
{
    if (l == 1)
        return 2 * PI / 3;
    if (l % 2)
        return 0;
    /* 2 pi (-1)^(l/2-1) / ((l+2)(l-1)) l! / (2^l (l/2)!^2) (Ramamoorthi, Hanrahan 2001) */
    double binomial = 1;
    for (int k = 1; k <= l / 2; k++)
        binomial *= (2 * k - 1) / (2.0 * k);
    return 2 * PI * (l % 4 ? 1 : -1) / ((l + 2.0) * (l - 1.0)) * binomial;
}

double dph_sh_normalization(int bands)
{
    double sum = 0;
    for (int l = 0; l < bands; l++)
        sum += dph_sh_cosine(l) * (2 * l + 1) / (4 * PI);
    return 1 / sum;
}

void dph_sh_convolve(int bands, const double *zonal, double *coefficient)
{
    for (int l = 0; l < bands; l++)
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            coefficient[i] *= sqrt(4 * PI / (2 * l + 1)) * zonal[l];
}

void dph_sh_rotate(int bands, const double rotation[9], const double *in, double *out)
{
    assert(bands >= 1 && bands <= DPH_MAX_BANDS);
    enum { MOST = DPH_MAX_BANDS * DPH_MAX_BANDS };
    double node[DPH_MAX_BANDS], weight[DPH_MAX_BANDS], sum[MOST] = {0}, here[MOST], there[MOST];
    int ncoef = bands * bands, columns = 2 * bands - 1;
    gauss_legendre(bands, node, weight);
    for (int i = 0; i < bands; i++)
        for (int j = 0; j < columns; j++) {
            double r = sqrt(1 - node[i] * node[i]), a = 2 * PI * j / columns, back[3], value = 0;
            const double s[3] = {r * cos(a), r * sin(a), node[i]};
            for (int k = 0; k < 3; k++) /* the inverse is the transpose */
                back[k] = rotation[k] * s[0] + rotation[3 + k] * s[1] + rotation[6 + k] * s[2];
            dph_sh_eval(bands, s, here);
            dph_sh_eval(bands, back, there);
            for (int k = 0; k < ncoef; k++)
                value += in[k] * there[k];
            for (int k = 0; k < ncoef; k++)
                sum[k] += weight[i] * 2 * PI / columns * value * here[k];
        }
    memcpy(out, sum, (size_t)ncoef * sizeof *out);
}
