/* Charts and the page they are drawn on: what is written can be read again, is the same twice, and
 * survives what texts and numbers can do to it. */
#define _XOPEN_SOURCE 700
#include "canvas.h"
#include "chart.h"
#include "folder.h"
#include "text.h"

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

static void same_files(const char *a, const char *b)
{
    size_t na, nb;
    char *da = slurp(a, &na), *db = slurp(b, &nb);
    assert_int_equal(na, nb);
    assert_memory_equal(da, db, na);
    free(da);
    free(db);
}

enum { PANELS = 2, GROUPS = 4, SERIES = 12 };

static const char *const panels[] = {"unshared vertices", "indexed and ordered"};
static const char *const groups[] = {"1280 \xc3\x97 800, near", "1280 \xc3\x97 800, far",
                                     "5 \xc3\x97 5, near", "5 \xc3\x97 5, far"};
static const struct chart_series series[] = {
    {"lambert", "lambert"},
    {"shsss", "shsss 4, snorm8"},
    {"shsss", "shsss 16, snorm8"},
    {"shsss", "shsss 36, snorm8"},
    {"shsss", "shsss 36, snorm16"},
    {"shsss", "shsss 36, float"},
    {"patro", "patro"},
    {"green", "green"},
    {"green-gauss", "green-gauss"},
    {"prt-cpca", "prt-cpca 1 \xc3\x97 24"},
    {"prt-cpca", "prt-cpca 64 \xc3\x97 8"},
    {"prt", "prt 36"},
};

static struct chart made_up(struct chart_value *value, double spread)
{
    static const double ratio[SERIES] = {1,    1.05, 1.1, 1.22, 1.27, 1.42,
                                         1.06, 1.9,  2.3, 1.8,  1.5,  2.6};
    for (int p = 0; p < PANELS; p++)
        for (int g = 0; g < GROUPS; g++)
            for (int s = 0; s < SERIES; s++) {
                double fps = (g < 2 ? 55 : 140 * spread) * (p ? 1.7 : 1) / ratio[s];
                value[(p * GROUPS + g) * SERIES + s] =
                    (struct chart_value){fps, fps * 0.95, fps * 1.04, ratio[s]};
            }
    return (struct chart){
        .title = "Drawing speed by method",
        .subtitle = "candle, 59,704 triangles; light turning every frame; median of 500 frames, "
                    "whiskers from the 5th to the 95th percentile",
        .axis = "frames per second",
        .ratio = "grey: time of a frame over that of lambert",
        .foot = "llvmpipe (LLVM 14, 256 bits), Mesa 22.3.6; 2 processors; commit 0123456; "
                "diaphan bench draw --lights 1 -o out",
        .npanel = PANELS,
        .ngroup = GROUPS,
        .nseries = SERIES,
        .panel = panels,
        .group = groups,
        .series = series,
        .value = value,
    };
}

/* Both kinds are written, the same each time, and are what their names say. */
static void test_written(void **state)
{
    (void)state;
    struct chart_value value[PANELS * GROUPS * SERIES];
    struct dph_error err;
    struct dph_image image;
    for (int spread = 1; spread <= 100; spread *= 100) { /* a linear and a logarithmic axis */
        struct chart chart = made_up(value, spread);
        const char *const name[] = {"a.svg", "b.svg", "a.png", "b.png"};
        for (int i = 0; i < 4; i++)
            if (!chart_save(&chart, in_folder(name[i]), &err))
                fail_msg("%s", err.message);
        same_files(in_folder("a.svg"), in_folder("b.svg"));
        same_files(in_folder("a.png"), in_folder("b.png"));
        size_t size;
        char *svg = slurp(in_folder("a.svg"), &size);
        assert_ptr_equal(strstr(svg, "<?xml"), svg);
        assert_non_null(strstr(svg, "</svg>"));
        free(svg);
        assert_true(dph_image_load(&image, in_folder("a.png"), &err));
        assert_int_equal(image.width, 2000);
        assert_true(image.height > 1500 && image.height < 2400);
        /* the methods' colours are on the page: vermilion, which nothing else has */
        size_t found = 0, pixels = (size_t)image.width * (size_t)image.height;
        for (size_t i = 0; i < pixels; i++) {
            const float *p = image.pixel + 4 * i;
            found += lrint(255 * dph_srgb_encode((double)p[0])) == 0xd5 &&
                     lrint(255 * dph_srgb_encode((double)p[1])) == 0x5e &&
                     lrint(255 * dph_srgb_encode((double)p[2])) == 0x00;
        }
        assert_true(found > 1000);
        dph_image_finish(&image);
    }
}

/* A longer bar for a larger value: twice the value, twice the pixels. */
static void test_proportion(void **state)
{
    (void)state;
    struct chart_value value[2] = {{50, NAN, NAN, NAN}, {100, NAN, NAN, NAN}};
    const char *const panel[] = {"p"}, *const group[] = {"g"};
    struct chart_series two[2] = {{"green", "one"}, {"prt", "two"}};
    struct chart chart = {"t", NULL, "x", NULL, NULL, 1, 1, 2, panel, group, two, value};
    struct dph_image image;
    struct dph_error err;
    assert_true(chart_save(&chart, in_folder("p.png"), &err));
    assert_true(dph_image_load(&image, in_folder("p.png"), &err));
    double count[2] = {0};
    for (size_t i = 0; i < (size_t)image.width * (size_t)image.height; i++) {
        const float *p = image.pixel + 4 * i;
        unsigned colour = 0;
        for (int c = 0; c < 3; c++)
            colour = colour << 8 | (unsigned)lrint(255 * dph_srgb_encode((double)p[c]));
        count[0] += colour == 0x009e73;
        count[1] += colour == 0x0072b2;
    }
    dph_image_finish(&image);
    assert_true(fabs((count[1] - 400) / (count[0] - 400) - 2) < 0.02); /* the legend's are alike */
}

/* Numbers that are none, and texts that no font and no XML has, break nothing. */
static void test_hostile(void **state)
{
    (void)state;
    char endless[6000];
    memset(endless, 'W', sizeof endless - 1);
    endless[sizeof endless - 1] = 0;
    struct chart_value value[4] = {{NAN, NAN, NAN, NAN},
                                   {0, 0, 0, 0},
                                   {INFINITY, -INFINITY, INFINITY, INFINITY},
                                   {-3, 1, NAN, -1}};
    const char *const panel[] = {"<script>&\"'"}, *const group[] = {"", endless};
    struct chart_series two[2] = {{"none", "\xff\xfe \xc3"}, {"", "\xe6\x97\xa5\xe6\x9c\xac \n\t"}};
    struct chart chart = {endless, "\x01", "", "", endless, 1, 2, 2, panel, group, two, value};
    struct dph_error err;
    if (!chart_save(&chart, in_folder("h.svg"), &err) ||
        !chart_save(&chart, in_folder("h.png"), &err))
        fail_msg("%s", err.message);
    assert_false(chart_save(&chart, in_folder("h.gif"), &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    chart.nseries = 65;
    assert_false(chart_save(&chart, in_folder("h.png"), &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    chart.nseries = 2;
    assert_false(chart_save(&chart, in_folder("missing/h.png"), &err));
    assert_int_equal(err.code, DPH_ERROR_OUTPUT);
}

/* A picture set at its own size has the bytes that its PNG has. */
static void test_picture(void **state)
{
    (void)state;
    struct dph_image image;
    struct dph_error err;
    struct dph_tone tone = {0};
    assert_true(dph_image_init(&image, 64, 16, &err));
    for (size_t i = 0; i < 64 * 16; i++)
        for (size_t c = 0; c < 4; c++)
            image.pixel[4 * i + c] = (float)(i * (c + 1)) / 700 - 0.1F;
    image.pixel[0] = NAN;
    assert_true(dph_image_save(&image, in_folder("i.png"), &tone, &err));
    struct canvas *canvas = canvas_create(CANVAS_RASTER, 64, 16, 1, &err);
    assert_non_null(canvas);
    canvas_picture(canvas, 0, 0, 64, 16, &image, 0);
    assert_true(canvas_save(canvas, in_folder("j.png"), &err));
    canvas_destroy(canvas);
    same_files(in_folder("i.png"), in_folder("j.png"));
    unsigned char *data;
    size_t size, whole;
    assert_true(dph_image_encode_png(&image, &tone, &data, &size, &err));
    char *file = slurp(in_folder("i.png"), &whole);
    assert_int_equal(size, whole);
    assert_memory_equal(data, file, size);
    free(data);
    free(file);
    dph_image_finish(&image);
    assert_null(canvas_create(CANVAS_RASTER, 1e6, 10, 1, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    canvas_destroy(NULL);
}

static void test_texts(void **state)
{
    (void)state;
    char *clean = text_clean("a\x01\xc3\xa9\xff\xed\xa0\x80z");
    assert_string_equal(clean, "a?\xc3\xa9????z");
    free(clean);
    char *out;
    size_t size;
    FILE *stream = open_memstream(&out, &size);
    text_escape(stream, "<a href='x\">&\xc3\xa9\xff");
    fclose(stream);
    assert_string_equal(out, "&lt;a href=&#39;x&quot;&gt;&amp;\xc3\xa9?");
    free(out);
    struct dph_error err;
    struct canvas *canvas = canvas_create(CANVAS_RASTER, 10, 10, 1, &err);
    const struct type type = {10, 0, false, ALIGN_LEFT};
    double one = canvas_text_width(canvas, &type, "word word");
    assert_true(one > 10);
    assert_int_equal(canvas_paragraph(canvas, 0, 0, one * 1.01, 1, &type,
                                      "word word word word word", false), 3);
    assert_int_equal(canvas_paragraph(canvas, 0, 0, 1, 1, &type, "word word", true), 2);
    assert_int_equal(canvas_paragraph(canvas, 0, 0, 1, 1, &type, "", true), 0);
    canvas_destroy(canvas);
    canvas_forget_fonts();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_written), cmocka_unit_test(test_proportion),
        cmocka_unit_test(test_hostile), cmocka_unit_test(test_picture),
        cmocka_unit_test(test_texts),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
