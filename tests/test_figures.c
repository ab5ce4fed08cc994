/* The contact sheet and the report of a comparison, of made-up pictures of a ball: all that should
 * stand there does, nothing is fetched, and hostile names and numbers break nothing. */
#define _XOPEN_SOURCE 700
#include "folder.h"
#include "report_html.h"
#include "sheet.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 320, HEIGHT = 200, LIGHTS = 3, METHODS = 7, ENTRIES = 2 * METHODS + 3 };

static const struct dph_method methods[METHODS] = {
    {.name = "lambert", .title = "Lambert"},
    {.name = "shsss", .title = "Spherical harmonics"},
    {.name = "green", .title = "Depth map"},
    {.name = "green-gauss", .title = "Depth map, blurred"},
    {.name = "prt", .title = "Precomputed radiance transfer"},
    {.name = "prt-cpca", .title = "Precomputed radiance transfer, CPCA"},
    {.name = "patro", .title = "Changed normals"},
};

/* A ball, lit from an azimuth: wrapped cosine, softer and browner with `error`, noisy with `noise`. */
static void ball(struct dph_image *image, double azimuth, double error, double noise, double gain)
{
    uint32_t seed = 5;
    double light[3] = {sin(azimuth / 57.3), 0.34, cos(azimuth / 57.3)};
    assert_true(dph_image_init(image, WIDTH, HEIGHT, NULL));
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double u = (x - 170) / 62.0, v = (96 - y) / 80.0, w = 1 - u * u - v * v;
            float *p = image->pixel + 4 * (y * WIDTH + x);
            if (w < 0)
                continue;
            double cosine = u * light[0] + v * light[1] + sqrt(w) * light[2];
            double value = fmax(0, (cosine + 0.6 - error) / 1.6) + 0.04 * error;
            for (int c = 0; c < 3; c++) {
                seed = seed * 1664525 + 1013904223;
                double grain = 1 + noise * ((seed >> 8) / 16777216.0 - 0.5);
                p[c] = (float)(gain * value * grain * pow(0.85 - 0.3 * error, c));
            }
            p[3] = 1;
        }
}

/* An entry's figures follow from its error, so that they can be told apart. */
static void fill_entry(struct dph_entry *entry, int method, bool fitted, bool shown, double gain)
{
    double error = (method * 0.09 + 0.05) * (fitted ? 0.6 : 1);
    *entry = (struct dph_entry){.method = &methods[method], .fitted = fitted, .shown = shown,
                                .bands = 6, .passes = 1, .seconds = 0.3 * method,
                                .bytes_per_vertex = 36.0 * method, .milliseconds = 0.7 + method,
                                .table_bytes = (size_t)method * 1000,
                                .training_before = 0.4, .training_after = 0.25,
                                .takes_thickness = method == 1, .gain = {1, 1.1, 0.9}};
    if (method == 1)
        strcpy(entry->variant, "6 bands");
    entry->shot = calloc(LIGHTS, sizeof *entry->shot);
    for (int l = 0; l < LIGHTS; l++) {
        struct dph_shot *shot = &entry->shot[l];
        shot->scores = (struct dph_scores){
            .psnr = 30 - 20 * error, .ssim = 1 - error / 4, .flip = error / 3, .rmse = error};
        shot->noisy = method == 4 && l == 2;
        if (shot->noisy)
            strcpy(shot->warning, "closer to the reference than its noise");
        if (!shown)
            continue;
        ball(&shot->image, 30 + 75 * l, error, 0, gain);
        shot->flip = calloc(WIDTH * HEIGHT, sizeof *shot->flip);
        for (size_t i = 0; i < WIDTH * HEIGHT; i++)
            if (shot->image.pixel[4 * i + 3] > 0)
                shot->flip[i] = (float)(error * (0.3 + 0.7 * (double)(i % WIDTH) / WIDTH));
    }
}

static void fill_material(struct dph_judged *judged, const char *name, double gain, size_t nstudy)
{
    *judged = (struct dph_judged){.samples = 256, .seconds_truth = 41.2, .seconds_training = 12.5,
                                  .paths = 1000000, .lost = 3};
    strcpy(judged->material.name, name);
    for (int c = 0; c < 3; c++) {
        judged->material.scattering[c] = 1.5 - 0.25 * c;
        judged->material.absorption[c] = 0.003 * (c + 1);
        judged->material.sigma[c] = 0.2 * (c + 1);
        judged->material.base[c] = judged->material.front[c] = judged->material.back[c] = NAN;
    }
    judged->material.ior = 1.3;
    judged->truth = calloc(LIGHTS, sizeof *judged->truth);
    for (int l = 0; l < LIGHTS; l++) {
        struct dph_truth *truth = &judged->truth[l];
        ball(&truth->image, 30 + 75 * l, 0, 0.1, gain);
        truth->mask = calloc(WIDTH * HEIGHT, 1);
        for (size_t i = 0; i < WIDTH * HEIGHT; i++) {
            truth->mask[i] = truth->image.pixel[4 * i + 3] > 0;
            truth->pixels += truth->mask[i];
        }
        truth->noise = (struct dph_noise){
            .psnr = 41.5, .ssim = 0.994, .flip = 0.011, .rmse = l == 1 ? (double)NAN : 0.013};
    }
    judged->entry = calloc(ENTRIES, sizeof *judged->entry);
    for (int m = 0; m < METHODS; m++)
        for (int fitted = 0; fitted < 2; fitted++)
            if (m != 5 || !fitted)
                fill_entry(&judged->entry[judged->nentry++], m, fitted, true, gain);
    for (size_t i = 0; i < nstudy; i++) {
        fill_entry(&judged->entry[judged->nentry], 1, false, false, gain);
        snprintf(judged->entry[judged->nentry++].variant, 48, "study %zu", i);
    }
}

static void make(struct dph_comparison *c, const char *const *materials, size_t nmaterial)
{
    static const char *const lights[] = {"front", "side", "back"};
    *c = (struct dph_comparison){.nlight = LIGHTS, .nmaterial = nmaterial, .width = WIDTH,
                                 .height = HEIGHT, .samples = 256, .seed = 1, .size_mm = 20,
                                 .mm_per_unit = 0.5, .triangles = 69666, .vertices = 34835,
                                 .camera = {0, 15, 3.5, 35}, .seconds = 123.4};
    strcpy(c->renderer, "llvmpipe (LLVM 15.0.6, 256 bits), 4.5 (Core Profile) Mesa 22.3.6");
    for (int l = 0; l < LIGHTS; l++) {
        strcpy(c->light[l].name, lights[l]);
        c->light[l].azimuth = 30 + 75 * l;
        c->light[l].elevation = 20;
    }
    c->material = calloc(nmaterial, sizeof *c->material);
    for (size_t m = 0; m < nmaterial; m++)
        fill_material(&c->material[m], materials[m], m ? 0.12 : 1, m == 0 ? 3 : 0);
}

static void finish(struct dph_comparison *c)
{
    for (size_t m = 0; m < c->nmaterial; m++) {
        struct dph_judged *judged = &c->material[m];
        for (size_t l = 0; l < c->nlight; l++) {
            dph_image_finish(&judged->truth[l].image);
            free(judged->truth[l].mask);
        }
        for (size_t e = 0; e < judged->nentry; e++) {
            for (size_t l = 0; l < c->nlight; l++) {
                dph_image_finish(&judged->entry[e].shot[l].image);
                free(judged->entry[e].shot[l].flip);
            }
            free(judged->entry[e].shot);
        }
        free(judged->truth);
        free(judged->entry);
    }
    free(c->material);
}

static size_t count(const char *text, const char *part)
{
    size_t n = 0;
    for (const char *at = text; (at = strstr(at, part)); at += strlen(part))
        n++;
    return n;
}

/* The crop is the ball and its air; columns pair the fitted with the plain. */
static void test_shared(void **state)
{
    (void)state;
    static const char *const names[] = {"wax", "marble"};
    struct dph_comparison c;
    make(&c, names, 2);
    struct figure_crop crop = figure_crop(&c);
    assert_int_equal(crop.x, 170 - 62 - 8);
    assert_int_equal(crop.width, 2 * 62 + 1 + 2 * 8);
    assert_int_equal(crop.y, 16 - 8);
    assert_int_equal(crop.height, 2 * 80 + 1 + 2 * 8);
    struct figure_column *column;
    assert_int_equal(figure_columns(&c.material[0], true, &column), METHODS);
    assert_ptr_equal(column[0].plain->method, &methods[0]);
    assert_ptr_equal(column[0].fitted, &c.material[0].entry[1]);
    assert_null(column[5].fitted);
    assert_ptr_equal(figure_shown(&column[5]), column[5].plain);
    assert_ptr_equal(figure_shown(&column[6]), column[6].fitted);
    free(column);
    assert_int_equal(figure_columns(&c.material[0], false, &column), 3);
    free(column);
    assert_int_equal(figure_columns(&c.material[1], false, &column), 0);
    free(column);
    /* the brightest light of the second material reaches 0.12: shown at least a stop brighter */
    assert_int_equal(figure_stops(&c.material[0].truth[0]), 0);
    assert_true(figure_stops(&c.material[1].truth[0]) == 2);
    finish(&c);
}

/* Larger: pixels are repeated. Smaller: light is averaged, none is lost. */
static void test_resampling(void **state)
{
    (void)state;
    struct dph_image image, out;
    assert_true(dph_image_init(&image, 7, 5, NULL));
    for (size_t i = 0; i < 7 * 5 * 4; i++)
        image.pixel[i] = (float)((i * 37) % 101) / 101;
    struct figure_crop crop = {1, 2, 4, 3};
    assert_true(figure_picture(&image, &crop, 12, 9, &out, NULL));
    for (int y = 0; y < 9; y++)
        for (int x = 0; x < 12; x++)
            assert_true(out.pixel[4 * (y * 12 + x)] ==
                        image.pixel[4 * ((y / 3 + 2) * 7 + x / 3 + 1)]);
    dph_image_finish(&out);
    double whole = 0, part = 0;
    struct figure_crop all = {0, 0, 7, 5};
    assert_true(figure_picture(&image, &all, 3, 2, &out, NULL));
    for (size_t i = 0; i < 7 * 5; i++)
        whole += (double)image.pixel[4 * i] / 35;
    for (size_t i = 0; i < 3 * 2; i++)
        part += (double)out.pixel[4 * i] / 6;
    assert_true(fabs(whole - part) < 1e-6);
    dph_image_finish(&out);
    dph_image_finish(&image);
}

/* Equal comparisons give equal sheets, of a size that follows from what is on them. */
static void test_sheet(void **state)
{
    (void)state;
    static const char *const names[] = {"wax", "marble"};
    struct dph_comparison c;
    struct figure_run run = {"bunny.obj", "diaphan compare bunny.obj -o out"};
    struct dph_error err;
    struct dph_image image;
    size_t na, nb;
    make(&c, names, 2);
    if (!sheet_save(&c, &run, in_folder("a.png"), &err))
        fail_msg("%s", err.message);
    assert_true(sheet_save(&c, &run, in_folder("b.png"), &err));
    char *a = slurp(in_folder("a.png"), &na), *b = slurp(in_folder("b.png"), &nb);
    assert_int_equal(na, nb);
    assert_memory_equal(a, b, na);
    free(a);
    free(b);
    assert_true(dph_image_load(&image, in_folder("a.png"), &err));
    double width = 2 * 30 + 8 * (112 + 10) - 10; /* points; two materials are twice as high */
    double scale = image.width / width;
    assert_true(scale > 2.4 && scale <= 3);
    assert_true(image.height > 2 * scale * width * 0.9 && image.height < 2 * scale * width * 1.4);
    dph_image_finish(&image);
    assert_false(sheet_save(&c, &run, in_folder("missing/a.png"), &err));
    assert_int_equal(err.code, DPH_ERROR_OUTPUT);
    finish(&c);
}

static void test_report(void **state)
{
    (void)state;
    static const char *const names[] = {"wax", "marble"};
    struct dph_comparison c;
    struct figure_run run = {"bunny.obj", "diaphan compare bunny.obj -o out"};
    struct dph_error err;
    size_t size;
    make(&c, names, 2);
    if (!report_html_save(&c, &run, in_folder("report.html"), &err))
        fail_msg("%s", err.message);
    char *text = slurp(in_folder("report.html"), &size);
    assert_int_equal(strlen(text), size);
    assert_int_equal(count(text, "{{"), 0);
    /* references and 13 entries, by light and material; maps for entries only */
    assert_int_equal(count(text, "data-kind=\"picture\""), 14 * LIGHTS * 2);
    assert_int_equal(count(text, "data-kind=\"map\""), 13 * LIGHTS * 2);
    assert_int_equal(count(text, "data:image/png;base64,iVBORw0KGgo"), 27 * LIGHTS * 2 + 1);
    assert_int_equal(count(text, "http:") + count(text, "https:") + count(text, "//www"), 0);
    assert_int_equal(count(text, "<table"), 4); /* overview, materials, study */
    assert_int_equal(count(text, "noise of the reference"), 3);
    assert_true(count(text, "closer to the reference than its noise") > 4);
    free(text);
    assert_false(report_html_save(&c, &run, in_folder("missing/r.html"), &err));
    assert_int_equal(err.code, DPH_ERROR_OUTPUT);
    finish(&c);
}

/* Names of files are anybody's; numbers may be none. */
static void test_hostile(void **state)
{
    (void)state;
    static const char *const names[] = {"\"><script>alert('x')</script>&amp;\xff\xe2\x82"};
    struct dph_comparison c;
    struct figure_run run = {"<b>&\"'\xc3\xa9\xe6\x97\xa5\x01.obj", "diaphan '<i>'"};
    struct dph_error err;
    size_t size;
    char *warning[] = {strdup("</ul><script>alert(2)</script>")};
    make(&c, names, 1);
    c.nwarning = 1;
    c.warning = warning;
    struct dph_entry *entry = c.material[0].entry;
    strcpy(entry[0].variant, "<u>' onerror='alert(3)");
    strcpy(entry[1].variant, entry[0].variant);
    strcpy(entry[0].shot[0].warning, "\"<q>");
    entry[0].shot[0].scores = (struct dph_scores){
        .psnr = INFINITY, .ssim = NAN, .flip = NAN, .rmse = NAN};
    entry[2].shot[1].image.pixel[4] = NAN;
    entry[2].shot[1].flip[0] = NAN;
    entry[2].seconds = entry[2].milliseconds = NAN;
    entry[3].bytes_per_vertex = INFINITY;
    if (!report_html_save(&c, &run, in_folder("h.html"), &err) ||
        !sheet_save(&c, &run, in_folder("h.png"), &err))
        fail_msg("%s", err.message);
    char *text = slurp(in_folder("h.html"), &size);
    assert_int_equal(count(text, "<script>"), 1); /* its own */
    assert_int_equal(count(text, "<b>&") + count(text, "<i>'") + count(text, "<u>") +
                         count(text, "<q>"), 0);
    assert_int_equal(count(text, "onerror='"), 0);
    assert_true(count(text, "&lt;b&gt;&amp;&quot;&#39;\xc3\xa9\xe6\x97\xa5?.obj") >= 2);
    free(text);
    c.nwarning = 0;
    free(warning[0]);
    /* no object anywhere, no entry */
    memset(c.material[0].truth[0].mask, 0, WIDTH * HEIGHT);
    memset(c.material[0].truth[1].mask, 0, WIDTH * HEIGHT);
    memset(c.material[0].truth[2].mask, 0, WIDTH * HEIGHT);
    size_t kept = c.material[0].nentry;
    c.material[0].nentry = 0;
    run = (struct figure_run){0};
    assert_true(report_html_save(&c, &run, in_folder("h.html"), &err));
    assert_true(sheet_save(&c, &run, in_folder("h.png"), &err));
    c.material[0].nentry = kept;
    finish(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shared), cmocka_unit_test(test_resampling),
        cmocka_unit_test(test_sheet),  cmocka_unit_test(test_report),
        cmocka_unit_test(test_hostile),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
