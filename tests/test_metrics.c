/* Measures between pictures: closed forms, and the figures that others have published for pairs. */
#include "gif.h"

#include <diaphan/metrics.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define near(a, b, tolerance) assert_float_equal((float)((a) - (b)), 0, (float)(tolerance))

static void grey(struct dph_image *image, int width, int height, double encoded)
{
    assert_true(dph_image_init(image, width, height, NULL));
    for (size_t i = 0; i < (size_t)width * (size_t)height * 4; i++)
        image->pixel[i] = i % 4 == 3 ? 1 : (float)dph_srgb_decode(encoded);
}

static void noise(struct dph_image *image, int width, int height, uint32_t seed)
{
    assert_true(dph_image_init(image, width, height, NULL));
    for (size_t i = 0; i < (size_t)width * (size_t)height * 4; i++) {
        seed = seed * 1664525 + 1013904223;
        image->pixel[i] = (float)(seed >> 8) / 16777216.0F;
    }
}

struct figures {
    double rmse, psnr, ssim, flip;
};

static struct figures measure(const struct dph_image *a, const struct dph_image *b,
                              const struct dph_metric_params *params)
{
    struct figures f;
    assert_true(dph_metric_rmse(a, b, params, &f.rmse, NULL, NULL));
    assert_true(dph_metric_ssim(a, b, params, &f.ssim, NULL, NULL));
    assert_true(dph_metric_flip(a, b, params, &f.flip, NULL, NULL));
    f.psnr = dph_metric_psnr(f.rmse);
    return f;
}

/* Equal pictures are equal by every measure, down to one pixel. */
static void test_identical(void **state)
{
    static const int size[][2] = {{1, 1}, {5, 5}, {1, 40}, {40, 1}, {11, 11}, {37, 23}};
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    for (size_t i = 0; i < sizeof size / sizeof size[0]; i++) {
        struct dph_image a;
        noise(&a, size[i][0], size[i][1], 7);
        struct figures f = measure(&a, &a, &params);
        assert_true(f.rmse == 0.0);
        assert_true(isinf(f.psnr) && f.psnr > 0);
        near(f.ssim, 1, 1e-12);
        assert_true(f.flip == 0.0);
        double relative = 1;
        assert_true(dph_metric_relative_rmse(&a, &a, &params, &relative, NULL));
        assert_true(relative == 0.0);
        dph_image_finish(&a);
    }
}

/* Constants x and y: RMSE |x - y|, SSIM (2xy + C1) / (x^2 + y^2 + C1); small pictures as large. */
static void test_constants(void **state)
{
    static const int size[][2] = {{1, 1}, {5, 5}, {12, 30}, {64, 16}};
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    double flip = -1;
    for (size_t i = 0; i < sizeof size / sizeof size[0]; i++) {
        struct dph_image a, b;
        grey(&a, size[i][0], size[i][1], 0.5);
        grey(&b, size[i][0], size[i][1], 0.6);
        struct figures f = measure(&a, &b, &params);
        near(f.rmse, 0.1, 1e-7);
        near(f.psnr, 20, 1e-5);
        near(f.ssim, (2 * 0.5 * 0.6 + 1e-4) / (0.25 + 0.36 + 1e-4), 1e-6);
        /* without structure FLIP is the redistributed difference of L* */
        double l[2];
        for (int k = 0; k < 2; k++)
            l[k] = 116 * cbrt(dph_srgb_decode(k ? 0.6 : 0.5)) - 16;
        /* the farthest: green (87.7347, -86.1827, 83.1793), blue (32.2970, 79.1875, -107.8602),
         * a and b times L / 100 */
        double da = -86.1827 * 0.877347 - 79.1875 * 0.322970;
        double db = 83.1793 * 0.877347 + 107.8602 * 0.322970;
        double farthest = pow(87.7347 - 32.2970 + sqrt(da * da + db * db), 0.7);
        double distance = pow(l[1] - l[0], 0.7);
        double knee = 0.4 * farthest;
        assert_true(distance < knee);
        near(f.flip, 0.95 / knee * distance, 1e-4);
        if (flip >= 0)
            near(f.flip, flip, 1e-6);
        flip = f.flip;
        double relative, y0 = dph_srgb_decode(0.5), y1 = dph_srgb_decode(0.6);
        assert_true(dph_metric_relative_rmse(&a, &b, &params, &relative, NULL));
        near(relative, (y1 - y0) / y0, 1e-6);
        dph_image_finish(&a);
        dph_image_finish(&b);
    }
}

/* The ends: black and white are as far as RMSE goes, green and blue as far as FLIP does. */
static void test_extremes(void **state)
{
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    struct dph_image a, b;
    grey(&a, 20, 20, 0);
    grey(&b, 20, 20, 1);
    struct figures f = measure(&a, &b, &params);
    near(f.rmse, 1, 1e-9);
    near(f.psnr, 0, 1e-6);
    near(f.ssim, 1e-4 / (1 + 1e-4), 1e-9);
    double relative;
    assert_true(dph_metric_relative_rmse(&a, &b, &params, &relative, NULL));
    assert_true(isinf(relative));
    for (size_t i = 0; i < 400; i++) {
        a.pixel[4 * i + 1] = 1;
        b.pixel[4 * i + 0] = b.pixel[4 * i + 1] = 0;
    }
    f = measure(&a, &b, &params);
    near(f.flip, 1, 1e-6);
    near(f.rmse, sqrt(2.0 / 3), 1e-7);
    dph_image_finish(&a);
    dph_image_finish(&b);
}

/* The same both ways round, for any number of threads, and less than equal. */
static void test_symmetry_and_threads(void **state)
{
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    struct dph_image a, b;
    noise(&a, 61, 47, 1);
    noise(&b, 61, 47, 2);
    struct figures f[4];
    f[0] = measure(&a, &b, &params);
    f[1] = measure(&b, &a, &params);
    params.threads = 1;
    f[2] = measure(&a, &b, &params);
    params.threads = 5;
    f[3] = measure(&a, &b, &params);
    near(f[0].rmse, f[1].rmse, 1e-12);
    near(f[0].ssim, f[1].ssim, 1e-12);
    near(f[0].flip, f[1].flip, 1e-12);
    for (int i = 2; i < 4; i++)
        assert_true(f[i].rmse == f[0].rmse && f[i].ssim == f[0].ssim && f[i].flip == f[0].flip);
    assert_true(f[0].ssim < 0.2 && f[0].flip > 0.05);
    dph_image_finish(&a);
    dph_image_finish(&b);
}

/* What a mask hides does not count, but for FLIP's blur, which ends with its filters' reach. */
static void test_masks(void **state)
{
    enum { W = 96, H = 40 };
    static uint8_t mask[W * H];
    static float map[W * H];
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    struct dph_image a, b;
    noise(&a, W, H, 3);
    noise(&b, W, H, 3);
    for (size_t i = 0; i < W * H; i++)
        if (i % W >= 60)
            b.pixel[4 * i] = 1 - b.pixel[4 * i]; /* the right part differs */
        else
            mask[i] = i % W < 48;
    params.mask = mask;
    struct figures f = measure(&a, &b, &params);
    assert_true(f.rmse == 0.0 && f.flip == 0.0);
    near(f.ssim, 1, 1e-12);
    params.mask = NULL;
    f = measure(&a, &b, &params);
    assert_true(f.rmse > 0.05 && f.ssim < 0.99 && f.flip > 0.01);

    /* the mean of a map over a mask is the masked figure */
    for (size_t i = 0; i < W * H; i++)
        mask[i] = i % W > 50 && i / W > 3;
    params.mask = mask;
    f = measure(&a, &b, &params);
    double flip, rmse, mean = 0, square = 0, n = 0;
    assert_true(dph_metric_flip(&a, &b, &params, &flip, map, NULL));
    for (size_t i = 0; i < W * H; i++) {
        if (!mask[i])
            assert_true(map[i] == 0.0F);
        mean += (double)map[i];
        n += mask[i];
    }
    near(flip, mean / n, 1e-6);
    assert_true(dph_metric_rmse(&a, &b, &params, &rmse, map, NULL));
    for (size_t i = 0; i < W * H; i++)
        square += (double)map[i] * (double)map[i];
    near(rmse, sqrt(square / n), 1e-6);
    assert_true(rmse == f.rmse && flip == f.flip);

    /* a rectangle as mask is the rectangle cut out, for the measures that look at nothing else */
    struct dph_image c, d;
    assert_true(dph_image_init(&c, W - 51, H - 4, NULL));
    assert_true(dph_image_init(&d, W - 51, H - 4, NULL));
    for (int y = 4; y < H; y++) {
        size_t from = 4 * ((size_t)y * W + 51), to = 4 * (size_t)(y - 4) * (W - 51);
        memcpy(c.pixel + to, a.pixel + from, 4 * (W - 51) * sizeof(float));
        memcpy(d.pixel + to, b.pixel + from, 4 * (W - 51) * sizeof(float));
    }
    struct dph_metric_params plain = dph_metric_defaults();
    struct figures cut = measure(&c, &d, &plain);
    near(cut.rmse, f.rmse, 1e-9);
    near(cut.ssim, f.ssim, 1e-9);

    /* a mask in which no window fits still gives an index, over its pixels */
    memset(mask, 0, sizeof mask);
    mask[20 * W + 70] = mask[20 * W + 71] = 1;
    f = measure(&a, &b, &params);
    assert_true(isfinite(f.ssim) && f.ssim < 1);
    dph_image_finish(&a);
    dph_image_finish(&b);
    dph_image_finish(&c);
    dph_image_finish(&d);
}

/* The exposure goes before the clip; what is not a number is black. */
static void test_exposure_and_odd_values(void **state)
{
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    struct dph_image a, b;
    grey(&a, 16, 16, 0.5);
    grey(&b, 16, 16, 0.5);
    for (size_t i = 0; i < 256 * 4; i++)
        b.pixel[i] *= 8;
    params.exposure = 20; /* both white */
    struct figures f = measure(&a, &b, &params);
    assert_true(f.rmse == 0.0 && f.flip == 0.0);
    params.exposure = 0;
    f = measure(&a, &b, &params);
    near(f.rmse, 0.5, 1e-6);
    for (size_t i = 0; i < 256 * 4; i++) {
        a.pixel[i] = i % 2 ? NAN : -INFINITY;
        b.pixel[i] = 0;
    }
    f = measure(&a, &b, &params);
    assert_true(f.rmse == 0.0 && f.flip == 0.0);
    a.pixel[0] = INFINITY;
    f = measure(&a, &b, &params);
    assert_true(isfinite(f.rmse) && isfinite(f.ssim) && isfinite(f.flip) && f.flip > 0);
    dph_image_finish(&a);
    dph_image_finish(&b);
}

/* A denser screen blurs over more pixels: fine noise is seen less. The ends of the range work. */
static void test_pixels_per_degree(void **state)
{
    static const double ppd[] = {20, 67, 200, 1, 1000};
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    struct dph_image a, b;
    noise(&a, 150, 100, 5);
    noise(&b, 150, 100, 6);
    double flip[5];
    for (int i = 0; i < 5; i++) {
        params.pixels_per_degree = ppd[i];
        assert_true(dph_metric_flip(&a, &b, &params, &flip[i], NULL, NULL));
        assert_true(isfinite(flip[i]) && flip[i] > 0 && flip[i] < 1);
    }
    assert_true(flip[0] > flip[1] && flip[1] > flip[2]);
    dph_image_finish(&a);
    dph_image_finish(&b);
}

static void test_refusals(void **state)
{
    static const uint8_t nothing[25];
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    struct dph_image a, b;
    struct dph_error err;
    double value;
    grey(&a, 5, 5, 0.5);
    grey(&b, 5, 4, 0.5);
    assert_false(dph_metric_rmse(&a, &b, &params, &value, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_non_null(strstr(err.message, "5 x 5 and 5 x 4"));
    assert_false(dph_metric_ssim(&a, &b, &params, &value, NULL, &err));
    assert_false(dph_metric_flip(&a, &b, &params, &value, NULL, &err));
    assert_false(dph_metric_relative_rmse(&a, &b, &params, &value, &err));
    params.mask = nothing;
    assert_false(dph_metric_ssim(&a, &a, &params, &value, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    params = dph_metric_defaults();
    params.pixels_per_degree = NAN;
    assert_false(dph_metric_flip(&a, &a, &params, &value, NULL, &err));
    params.pixels_per_degree = 1e6;
    assert_false(dph_metric_flip(&a, &a, &params, &value, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    dph_image_finish(&a);
    dph_image_finish(&b);
}

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The published run of FLIP's own tool: mean, weighted quartiles, extremes, and the coloured map,
 * which its other implementations are let 3 steps a channel. */
static void test_published_flip(void **state)
{
    (void)state;
    struct dph_metric_params params = dph_metric_defaults();
    struct dph_image a, b, told, map_image;
    if (!dph_image_load(&a, DPH_DATA "/flip/tree-ref.png", NULL)) {
        print_message("skipped: %s/flip is absent\n", DPH_DATA);
        skip();
    }
    assert_true(dph_image_load(&b, DPH_DATA "/flip/tree-test.png", NULL));
    assert_true(dph_image_load(&told, DPH_DATA "/flip/tree-comparison-cli.png", NULL));
    size_t pixels = (size_t)a.width * (size_t)a.height;
    float *map = malloc(pixels * sizeof *map);
    double flip;
    assert_true(dph_metric_flip(&a, &b, &params, &flip, map, NULL));
    print_message("FLIP %.6f, published 0.133285\n", flip);
    near(flip, 0.133285, 1e-4);

    assert_true(dph_image_init_magma(&map_image, map, a.width, a.height, NULL));
    int worst = 0;
    for (size_t i = 0; i < 4 * pixels; i++) {
        int step = abs((int)lround(255 * dph_srgb_encode((double)map_image.pixel[i])) -
                       (int)lround(255 * dph_srgb_encode((double)told.pixel[i])));
        if (step > worst)
            worst = step;
    }
    print_message("colours of the map: at most %d steps from the published ones\n", worst);
    assert_true(worst <= 3);

    qsort(map, pixels, sizeof *map, ascending);
    static const double share[3] = {0.25, 0.5, 0.75}, quartile[3] = {0.184924, 0.333241, 0.503441};
    double sum = 0;
    size_t i = 0;
    for (int q = 0; q < 3; q++) {
        for (; sum + (double)map[i] <= share[q] * flip * (double)pixels; i++)
            sum += (double)map[i];
        near((double)map[i], quartile[q], 1e-4);
    }
    near((double)map[0], 0, 1e-4);
    near((double)map[pixels - 1], 0.983044, 1e-4);
    free(map);
    dph_image_finish(&a);
    dph_image_finish(&b);
    dph_image_finish(&told);
    dph_image_finish(&map_image);
}

/* A grey GIF whose bytes are taken as sRGB, after averaging cell x cell pixels. */
static void shrunk(struct dph_image *image, const struct gif *gif, int cell)
{
    assert_true(dph_image_init(image, gif->width / cell, gif->height / cell, NULL));
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            double sum = 0;
            for (int j = 0; j < cell; j++)
                for (int i = 0; i < cell; i++)
                    sum += gif->pixel[(y * cell + j) * gif->width + x * cell + i];
            float *out = image->pixel + 4 * ((size_t)y * (size_t)image->width + (size_t)x);
            out[0] = out[1] = out[2] = (float)dph_srgb_decode(sum / (cell * cell) / 255);
        }
}

static void test_published_ssim(void **state)
{
    (void)state;
    static const double published[] = {0.682372, 0.820202}; /* the first is a recomputation */
    struct dph_metric_params params = dph_metric_defaults();
    struct gif reference = {0}, test = {0};
    if (!gif_load(&reference, DPH_DATA "/ssim/goldhill.gif")) {
        print_message("skipped: %s/ssim is absent\n", DPH_DATA);
        skip();
    }
    assert_true(gif_load(&test, DPH_DATA "/ssim/goldhill_jpeg.gif"));
    for (int cell = 1; cell <= 2; cell++) {
        struct dph_image a, b;
        double ssim, rmse;
        shrunk(&a, &reference, cell);
        shrunk(&b, &test, cell);
        assert_true(dph_metric_ssim(&a, &b, &params, &ssim, NULL, NULL));
        print_message("SSIM %.6f, averaged over %d x %d pixels; published %.4f\n", ssim, cell,
                      cell, published[cell - 1]);
        near(ssim, published[cell - 1], 1e-5);
        if (cell == 1) {
            assert_true(dph_metric_rmse(&a, &b, &params, &rmse, NULL, NULL));
            near(dph_metric_psnr(rmse), 27.431389, 1e-4);
        }
        dph_image_finish(&a);
        dph_image_finish(&b);
    }
    free(reference.pixel);
    free(test.pixel);
}

/* The map's ends and order: black to pale yellow, lighter with every step. */
static void test_magma(void **state)
{
    enum { N = 1000 };
    static float map[N];
    (void)state;
    struct dph_image image;
    for (int i = 0; i < N; i++)
        map[i] = (float)i / (N - 1);
    map[0] = NAN;
    assert_true(dph_image_init_magma(&image, map, N, 1, NULL));
    double last = -1;
    for (int i = 0; i < N; i++) {
        const float *p = image.pixel + 4 * i;
        double y = 0.2126 * (double)p[0] + 0.7152 * (double)p[1] + 0.0722 * (double)p[2];
        assert_true(y > last);
        last = y;
    }
    near(dph_srgb_encode((double)image.pixel[4 * (N - 1) + 1]), 0.9914, 1e-4);
    dph_image_finish(&image);
    assert_false(dph_image_init_magma(&image, map, 0, 1, NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_identical),
        cmocka_unit_test(test_constants),
        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_symmetry_and_threads),
        cmocka_unit_test(test_masks),
        cmocka_unit_test(test_exposure_and_odd_values),
        cmocka_unit_test(test_pixels_per_degree),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_published_flip),
        cmocka_unit_test(test_published_ssim),
        cmocka_unit_test(test_magma),
    };
    return cmocka_run_group_tests_name("metrics", tests, NULL, NULL);
}
