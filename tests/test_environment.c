/* Distant light: closed forms of the projection, discs, and operations on coefficients. */
#include "shapes.h"

#include <diaphan/environment.h>
#include <diaphan/light.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static float *make_picture(int width, int height, float value)
{
    float *pixel = malloc((size_t)width * (size_t)height * 3 * sizeof *pixel);
    assert_non_null(pixel);
    for (size_t i = 0; i < (size_t)width * (size_t)height * 3; i++)
        pixel[i] = value;
    return pixel;
}

/* Radiance 1 everywhere: the sum of the solid angles is 4 pi, and any normal gets the irradiance pi. */
static void white(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {2, 1}, {7, 5}, {64, 32}, {100, 600}, {2050, 1030}, {600, 3000}};
    for (size_t n = 0; n < sizeof sizes / sizeof *sizes; n++) {
        int width = sizes[n][0], height = sizes[n][1];
        float *pixel = make_picture(width, height, 1);
        double l[3 * 64];
        assert_true(dph_environment_project(pixel, width, height, 3, 8, 0, l, NULL));
        for (int c = 0; c < 3; c++) {
            assert_float_equal(l[64 * c] * sqrt(4 * PI), 4 * PI, 1e-9);
            /* one column of pixels is one of a few hundred strips, or the picture's own where it has as many rows */
            for (int i = 1; i < 64; i++)
                assert_float_equal(l[64 * c + i], 0, width < 64 && height > 64 ? .02 : 2e-4);
        }
        double n0[3] = {.36, .48, .8}, y[64], e = 0;
        dph_sh_eval(8, n0, y);
        for (int l_ = 0; l_ < 8; l_++)
            for (int i = l_ * l_; i < (l_ + 1) * (l_ + 1); i++)
                e += dph_sh_cosine(l_) * y[i] * l[i];
        assert_float_equal(e, PI, .01);
        free(pixel);
    }
}

/* A small bright patch is a point light where dph_light_direction says; the channels keep apart. */
static void where_it_shines(void **state)
{
    (void)state;
    enum { W = 720, H = 360 };
    static const double places[][2] = {{0, 0}, {90, 0}, {-90, 45}, {150, 30}, {30, -80}};
    for (size_t n = 0; n < sizeof places / sizeof *places; n++) {
        float *pixel = make_picture(W, H, 0);
        double to[3], back[3], y[36], l[108];
        int x = (int)((180 - places[n][0]) * W / 360), row = (int)((90 - places[n][1]) * H / 180);
        dph_environment_direction(W, H, x + .5, row + .5, back);
        dph_light_direction(places[n][0] - .25, places[n][1] - .25, to);
        for (int k = 0; k < 3; k++)
            assert_float_equal(back[k], to[k], 1e-12);
        for (int c = 0; c < 3; c++)
            pixel[3 * (row * W + x) + c] = (float)(c + 1);
        assert_true(dph_environment_project(pixel, W, H, 3, 6, 2, l, NULL));
        dph_sh_eval(6, to, y);
        double angle = 2 * PI / W * 2 * sin(PI / H / 2) * cos((places[n][1] - .25) * PI / 180);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 36; i++)
                assert_float_equal(l[36 * c + i] / angle, (c + 1) * y[i], 3e-3 * (c + 1));
        free(pixel);
    }
}

/* A picture of a function of few bands gives its coefficients back, at any resolution, with or without alpha. */
static void round_trip(void **state)
{
    (void)state;
    static const int heights[] = {100, 512, 1500};
    for (size_t n = 0; n < 3; n++) {
        int height = heights[n], width = 2 * height;
        float *pixel = malloc((size_t)width * (size_t)height * 4 * sizeof *pixel);
        assert_non_null(pixel);
        for (int row = 0; row < height; row++)
            for (int x = 0; x < width; x++) {
                double s[3], y[16];
                dph_environment_direction(width, height, x + .5, row + .5, s);
                dph_sh_eval(4, s, y);
                float *to = pixel + 4 * ((size_t)row * (size_t)width + (size_t)x);
                to[0] = (float)(2 + y[7]);
                to[1] = (float)(2 + y[1] + y[14]);
                to[2] = (float)(3 + y[12]);
                to[3] = NAN;
            }
        double l[3 * 16], again[3 * 16];
        assert_true(dph_environment_project(pixel, width, height, 4, 4, 1, l, NULL));
        const double want[3][3] = {{2, 7, 7}, {2, 1, 14}, {3, 12, 12}};
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 16; i++)
                assert_float_equal(l[16 * c + i],
                                   i == 0 ? want[c][0] * sqrt(4 * PI) : i == (int)want[c][1] || i == (int)want[c][2],
                                   1e-3);
        for (int threads = 2; threads <= 8; threads *= 2) {
            assert_true(dph_environment_project(pixel, width, height, 4, 4, threads, again, NULL));
            assert_memory_equal(l, again, sizeof l);
        }
        free(pixel);
    }
}

static void hostile_pictures(void **state)
{
    (void)state;
    float pixel[12] = {NAN, -1, INFINITY, -INFINITY, 1, 1, 0, 0, 0, NAN, NAN, NAN};
    double l[108];
    struct dph_error err;
    assert_true(dph_environment_project(pixel, 2, 2, 3, 6, 1, l, &err));
    for (int i = 0; i < 108; i++)
        assert_true(isfinite(l[i]));
    assert_true(l[0] == 0);
    assert_false(dph_environment_project(pixel, 0, 2, 3, 6, 1, l, &err));
    assert_false(dph_environment_project(pixel, 2, 2, 2, 6, 1, l, &err));
    assert_false(dph_environment_project(pixel, 2, 2, 3, 9, 1, l, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
}

/* Irradiance 1, whatever the angle; a point at 0; against a sum over the disc. */
static void discs(void **state)
{
    (void)state;
    const double to[3] = {.6, 0, .8};
    double y[64], l[64], zonal[16];
    dph_sh_eval(8, to, y);
    dph_environment_disc(8, to, 0, l);
    for (int i = 0; i < 64; i++)
        assert_float_equal(l[i], y[i], 1e-14);
    dph_environment_disc(8, to, 1e-5, l);
    for (int i = 0; i < 64; i++)
        assert_float_equal(l[i], y[i], 1e-11);
    for (double half = 5; half <= 90; half += 17) {
        /* mean over rings of the cap, weighted by nothing but area; radiance 1 / (pi sin^2) */
        double c = cos(half * PI / 180), want[8] = {0};
        enum { STEPS = 20000 };
        for (int k = 0; k < STEPS; k++) {
            const double t = c + (1 - c) * (k + .5) / STEPS, s[3] = {sqrt(1 - t * t), 0, t};
            double at[64];
            dph_sh_eval(8, s, at);
            for (int i = 0; i < 8; i++)
                want[i] += 2 * PI * (1 - c) / STEPS * at[i * (i + 1)] / (PI * (1 - c * c));
        }
        dph_environment_disc_zonal(8, half, zonal);
        for (int i = 0; i < 8; i++)
            assert_float_equal(zonal[i], want[i], 1e-6);
        /* energy: the clamped cosine facing the disc, in all bands that it has; few are left out at 16 */
        double e = 0;
        dph_environment_disc_zonal(16, half, zonal);
        for (int i = 0; i < 16; i++)
            e += dph_sh_cosine(i) * zonal[i] * sqrt((2 * i + 1) / (4 * PI));
        assert_float_equal(e, 1, 8e-3);
    }
}

static void cosine_and_normalization(void **state)
{
    (void)state;
    static const double cosine[9] = {3.141593, 2.094395, .785398, 0, -.130900, 0, .049087, 0, -.024544};
    for (int l = 0; l < 9; l++)
        assert_float_equal(dph_sh_cosine(l), cosine[l], 1e-6);
    static const double factor[7] = {0, 0, 4. / 3, 16. / 17, 16. / 17, 32. / 31, 32. / 31};
    for (int n = 2; n <= 6; n++)
        assert_float_equal(dph_sh_normalization(n), factor[n], 1e-12);
    double zonal[4], c[16];
    for (int l = 0; l < 4; l++)
        zonal[l] = dph_sh_cosine(l) * sqrt((2 * l + 1) / (4 * PI));
    const double n[3] = {.6, .64, .48};
    dph_sh_eval(4, n, c);
    dph_sh_convolve(4, zonal, c);
    double y[16];
    dph_sh_eval(4, n, y);
    for (int i = 0; i < 16; i++)
        assert_float_equal(c[i], y[i] * cosine[i < 1 ? 0 : i < 4 ? 1 : i < 9 ? 2 : 3], 1e-6);
}

/* A turned function has the turned values; twice turned is turned by the product; energies stay. */
static void rotations(void **state)
{
    (void)state;
    const double a = .7, b = -1.9;
    const double r[9] = {cos(a), -sin(a) * cos(b), sin(a) * sin(b), sin(a), cos(a) * cos(b), -cos(a) * sin(b), 0, sin(b), cos(b)};
    for (int bands = 1; bands <= 8; bands++) {
        uint64_t seed = 5;
        double in[64], out[64];
        for (int i = 0; i < bands * bands; i++)
            in[i] = next_random(&seed) - .5;
        dph_sh_rotate(bands, r, in, out);
        for (int k = 0; k < 20; k++) {
            double s[3], turned[3], y[64], before = 0, after = 0;
            random_direction(&seed, s);
            for (int i = 0; i < 3; i++)
                turned[i] = r[3 * i] * s[0] + r[3 * i + 1] * s[1] + r[3 * i + 2] * s[2];
            dph_sh_eval(bands, s, y);
            for (int i = 0; i < bands * bands; i++)
                before += in[i] * y[i];
            dph_sh_eval(bands, turned, y);
            for (int i = 0; i < bands * bands; i++)
                after += out[i] * y[i];
            assert_float_equal(before, after, 1e-12);
        }
        for (int l = 0; l < bands; l++) {
            double e[2] = {0, 0};
            for (int i = l * l; i < (l + 1) * (l + 1); i++)
                e[0] += in[i] * in[i], e[1] += out[i] * out[i];
            assert_float_equal(e[0], e[1], 1e-12);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white), cmocka_unit_test(where_it_shines), cmocka_unit_test(round_trip),
        cmocka_unit_test(hostile_pictures), cmocka_unit_test(discs), cmocka_unit_test(cosine_and_normalization),
        cmocka_unit_test(rotations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
