/* Pictures: the sRGB curve's published values, round trips through PNG and EXR, and files that lie. */
#define _XOPEN_SOURCE 700
#include "folder.h"

#include <diaphan/image.h>

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static unsigned char *load(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    unsigned char *data = malloc(1 << 22);
    assert_non_null(data);
    *size = fread(data, 1, 1 << 22, file);
    fclose(file);
    return data;
}

static void store(const char *path, const unsigned char *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
}

/* Noise of a fixed seed, with values below 0 and above 1 where `wide`. */
static void fill(struct dph_image *image, int width, int height, bool wide)
{
    assert_true(dph_image_init(image, width, height, NULL));
    uint32_t state = 12345;
    for (size_t i = 0; i < (size_t)width * (size_t)height * 4; i++) {
        state = state * 1664525 + 1013904223;
        float x = (float)(state >> 8) / 16777216.0F;
        image->pixel[i] = wide ? 40 * x - 4 : x;
    }
}

static void test_curve(void **state)
{
    (void)state;
    /* IEC 61966-2-1: the 8-bit code 188 is the classic middle of linear .5; the segments meet at
     * .0031308 */
    assert_float_equal(dph_srgb_encode(.5), .735356983, 1e-8);
    assert_float_equal(dph_srgb_encode(.18), .461356129, 1e-8);
    assert_float_equal(dph_srgb_encode(.0031308), .04044993, 1e-7);
    assert_float_equal(dph_srgb_encode(.001), .01292, 1e-12);
    assert_true(dph_srgb_encode(-1) == 0 && dph_srgb_encode(2) == 1 && dph_srgb_encode(NAN) == 0);
    for (int i = 0; i <= 1000; i++)
        assert_float_equal(dph_srgb_decode(dph_srgb_encode(i / 1000.)), i / 1000., 2e-6);
}

static void test_sizes(void **state)
{
    (void)state;
    struct dph_image image;
    struct dph_error err = {0};
    assert_false(dph_image_init(&image, 0, 5, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_false(dph_image_init(&image, 5, 32769, &err));
    assert_null(image.pixel);
    dph_image_finish(&image);
}

static void test_png_round_trip(void **state)
{
    (void)state;
    struct dph_image a, b, c;
    struct dph_tone tone = {0};
    fill(&a, 37, 23, false);
    assert_true(dph_image_save(&a, in_folder("a.png"), &tone, NULL));
    assert_true(dph_image_load(&b, in_folder("a.png"), NULL));
    assert_int_equal(b.width, 37);
    assert_int_equal(b.height, 23);
    for (size_t i = 0; i < 37 * 23 * 4; i++) {
        if (i % 4 == 3)
            assert_true(b.pixel[i] == 1);
        else /* the nearest of 256 codes */
            assert_float_equal(dph_srgb_encode((double)a.pixel[i]),
                               dph_srgb_encode((double)b.pixel[i]), .5 / 255 + 1e-6);
    }
    /* what was read once is written and read without further loss, and as the same bytes */
    assert_true(dph_image_save(&b, in_folder("b.png"), &tone, NULL));
    assert_true(dph_image_load(&c, in_folder("b.png"), NULL));
    assert_memory_equal(b.pixel, c.pixel, 37 * 23 * 4 * sizeof(float));
    size_t size_a, size_b;
    unsigned char *bytes_a = load(in_folder("a.png"), &size_a);
    unsigned char *bytes_b = load(in_folder("b.png"), &size_b);
    assert_int_equal(size_a, size_b);
    assert_memory_equal(bytes_a, bytes_b, size_a);
    bool srgb = false;
    for (size_t i = 0; i + 4 < size_a; i++)
        srgb |= !memcmp(bytes_a + i, "sRGB", 4);
    assert_true(srgb);
    free(bytes_a);
    free(bytes_b);
    dph_image_finish(&a);
    dph_image_finish(&b);
    dph_image_finish(&c);
}

/* The 8-bit codes that single values become: decoding codes back through an independent formula
 * would hide an error in both. */
static void test_png_codes(void **state)
{
    (void)state;
    static const struct {
        float value;
        double exposure;
        bool linear;
        int code;
    } cases[] = {{.5F, 0, false, 188}, {.18F, 0, false, 118}, {.25F, 1, false, 188},
                 {1, 0, false, 255},   {0, 0, false, 0},      {-3, 0, false, 0},
                 {9, 0, false, 255},   {.5F, 0, true, 128},   {.25F, 0, true, 64},
                 {2, -1, true, 255},   {NAN, 0, false, 0},    {INFINITY, 0, false, 255},
                 {.0014F, 0, false, 5}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct dph_image a, b;
        struct dph_tone tone = {.exposure = cases[i].exposure, .linear = cases[i].linear};
        assert_true(dph_image_init(&a, 1, 1, NULL));
        a.pixel[0] = a.pixel[1] = a.pixel[2] = cases[i].value;
        assert_true(dph_image_save(&a, in_folder("c.png"), &tone, NULL));
        assert_true(dph_image_load(&b, in_folder("c.png"), NULL));
        int code = (int)lround(255 * dph_srgb_encode((double)b.pixel[1]));
        assert_int_equal(code, cases[i].code);
        dph_image_finish(&a);
        dph_image_finish(&b);
    }
}

/* Depths and colour types that others write. `value` is the top left sample in 0..1 after the
 * file's own coding. */
static void write_other(const char *path, int depth, int type, bool interlaced)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    if (setjmp(png_jmpbuf(png)))
        fail();
    png_init_io(png, file);
    png_set_IHDR(png, info, 16, 16, depth, type,
                 interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, 0, 0);
    png_color palette[2] = {{0, 0, 0}, {188, 188, 188}};
    if (type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, palette, 2);
    png_write_info(png, info);
    static png_byte row[16 * 8];
    /* left half 0, right half: all ones (palette entry 1), opaque */
    memset(row, 0, sizeof row);
    size_t bytes = png_get_rowbytes(png, info);
    memset(row + bytes / 2, type == PNG_COLOR_TYPE_PALETTE && depth == 8 ? 1 : 255,
           bytes - bytes / 2);
    int passes = png_set_interlace_handling(png);
    for (int p = 0; p < passes; p++)
        for (int y = 0; y < 16; y++)
            png_write_row(png, row);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    fclose(file);
}

static void test_png_kinds(void **state)
{
    (void)state;
    static const struct {
        int depth, type;
        float right, left_alpha;
    } kinds[] = {{1, PNG_COLOR_TYPE_GRAY, 1, 1},       {2, PNG_COLOR_TYPE_GRAY, 1, 1},
                 {8, PNG_COLOR_TYPE_GRAY, 1, 1},       {16, PNG_COLOR_TYPE_GRAY, 1, 1},
                 {8, PNG_COLOR_TYPE_GRAY_ALPHA, 1, 0}, {16, PNG_COLOR_TYPE_GRAY_ALPHA, 1, 0},
                 {8, PNG_COLOR_TYPE_RGB, 1, 1},        {16, PNG_COLOR_TYPE_RGB, 1, 1},
                 {8, PNG_COLOR_TYPE_RGB_ALPHA, 1, 0},  {16, PNG_COLOR_TYPE_RGB_ALPHA, 1, 0},
                 {1, PNG_COLOR_TYPE_PALETTE, 0, 1},    {8, PNG_COLOR_TYPE_PALETTE, 0, 1}};
    float middle = (float)dph_srgb_decode(188 / 255.);
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        for (int interlaced = 0; interlaced < 2; interlaced++) {
            write_other(in_folder("k.png"), kinds[i].depth, kinds[i].type, interlaced);
            struct dph_image image;
            struct dph_error err = {0};
            if (!dph_image_load(&image, in_folder("k.png"), &err))
                fail_msg("depth %d, type %d: %s", kinds[i].depth, kinds[i].type, err.message);
            const float *left = image.pixel, *right = image.pixel + 15 * 4;
            float want = kinds[i].type == PNG_COLOR_TYPE_PALETTE ? middle : kinds[i].right;
            assert_true(left[0] == 0 && left[1] == 0 && left[2] == 0);
            assert_true(left[3] == kinds[i].left_alpha && right[3] == 1);
            assert_true(right[0] == want && right[1] == want && right[2] == want);
            dph_image_finish(&image);
        }
}

static void test_exr_round_trip(void **state)
{
    (void)state;
    /* heights around the 16 lines of a ZIP chunk; noise, and a flat picture that compresses */
    static const int sizes[][2] = {{1, 1}, {37, 15}, {37, 16}, {5, 17}, {64, 100}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int flat = 0; flat < 2; flat++) {
            struct dph_image a, b;
            struct dph_error err = {0};
            fill(&a, sizes[i][0], sizes[i][1], true);
            size_t bytes = (size_t)a.width * (size_t)a.height * 4 * sizeof(float);
            if (flat)
                memset(a.pixel, 0, bytes);
            if (!dph_image_save(&a, in_folder("a.exr"), NULL, &err))
                fail_msg("%s", err.message);
            if (!dph_image_load(&b, in_folder("a.exr"), &err))
                fail_msg("%s", err.message);
            assert_int_equal(b.width, a.width);
            assert_int_equal(b.height, a.height);
            assert_memory_equal(a.pixel, b.pixel, bytes);
            assert_true(dph_image_save(&b, in_folder("b.exr"), NULL, NULL));
            size_t size_a, size_b;
            unsigned char *bytes_a = load(in_folder("a.exr"), &size_a);
            unsigned char *bytes_b = load(in_folder("b.exr"), &size_b);
            assert_int_equal(size_a, size_b);
            assert_memory_equal(bytes_a, bytes_b, size_a);
            free(bytes_a);
            free(bytes_b);
            dph_image_finish(&a);
            dph_image_finish(&b);
        }
}

/* A growing buffer for a file made by hand. */
static unsigned char hand[4096];
static size_t hand_size;

static void put(const void *data, size_t size)
{
    assert_true(hand_size + size <= sizeof hand);
    memcpy(hand + hand_size, data, size);
    hand_size += size;
}

static void put_int(int32_t value)
{
    const unsigned char bytes[4] = {(unsigned char)value, (unsigned char)(value >> 8),
                                    (unsigned char)(value >> 16), (unsigned char)(value >> 24)};
    put(bytes, 4);
}

static void put_attribute(const char *name, const char *type, int32_t size)
{
    put(name, strlen(name) + 1);
    put(type, strlen(type) + 1);
    put_int(size);
}

/* Half floats as other programs write them, here 5 x 3, uncompressed, with a data window off the
 * origin: every channel has a value of its own, so that a mixed-up order shows. */
static void test_exr_half(void **state)
{
    (void)state;
    static const char *const channels[] = {"A", "B", "G", "R"};
    static const uint16_t value[4] = {0x3c00, 0x3400, 0x3800, 0x4000}; /* 1, .25, .5, 2 */
    hand_size = 0;
    put_int(20000630);
    put_int(2);
    put_attribute("channels", "chlist", 4 * 18 + 1);
    for (int c = 0; c < 4; c++) {
        put(channels[c], 2);
        put_int(1); /* half */
        put_int(0);
        put_int(1);
        put_int(1);
    }
    put("", 1);
    put_attribute("compression", "compression", 1);
    put("", 1);
    static const char *const windows[] = {"dataWindow", "displayWindow"};
    for (int w = 0; w < 2; w++) {
        put_attribute(windows[w], "box2i", 16);
        put_int(10);
        put_int(-7);
        put_int(14);
        put_int(-5);
    }
    put_attribute("lineOrder", "lineOrder", 1);
    put("", 1);
    put_attribute("pixelAspectRatio", "float", 4);
    put_int(0x3f800000);
    put_attribute("screenWindowCenter", "v2f", 8);
    put_int(0);
    put_int(0);
    put_attribute("screenWindowWidth", "float", 4);
    put_int(0x3f800000);
    put("", 1);
    int32_t first = (int32_t)hand_size + 3 * 8, chunk = 8 + 4 * 5 * 2;
    for (int y = 0; y < 3; y++) {
        put_int(first + y * chunk);
        put_int(0);
    }
    for (int y = 0; y < 3; y++) {
        put_int(-7 + y);
        put_int(4 * 5 * 2);
        for (int c = 0; c < 4; c++)
            for (int x = 0; x < 5; x++) {
                uint16_t half = y == 1 && x == 3 ? 0 : value[c];
                const unsigned char bytes[2] = {(unsigned char)half, (unsigned char)(half >> 8)};
                put(bytes, 2);
            }
    }
    store(in_folder("a.exr"), hand, hand_size);
    struct dph_image image;
    struct dph_error err = {0};
    if (!dph_image_load(&image, in_folder("a.exr"), &err))
        fail_msg("%s", err.message);
    assert_int_equal(image.width, 5);
    assert_int_equal(image.height, 3);
    for (int i = 0; i < 15; i++) {
        static const float want[4] = {2, .5F, .25F, 1};
        for (int c = 0; c < 4; c++)
            assert_true(image.pixel[4 * i + c] == (i == 8 ? 0 : want[c]));
    }
    dph_image_finish(&image);
}

/* Every truncation and a few thousand changed bytes: an error with the path, or a picture, never a
 * crash. A truncated file is always an error. */
static void torture(const char *good, const char *bad)
{
    size_t size;
    unsigned char *data = load(good, &size);
    for (size_t cut = 0; cut<size; cut += size> 2000 && cut > 600 ? 97 : 1) {
        struct dph_image image;
        struct dph_error err = {0};
        store(bad, data, cut);
        if (dph_image_load(&image, bad, &err))
            fail_msg("%s: cut at %zu of %zu is accepted", bad, cut, size);
        assert_int_equal(strncmp(err.message, bad, strlen(bad)), 0);
        assert_null(image.pixel);
    }
    uint32_t seed = 7;
    for (int i = 0; i < 3000; i++) {
        seed = seed * 1664525 + 1013904223;
        size_t at = (seed >> 8) % (i % 2 && size > 420 ? 420 : size);
        unsigned char old = data[at];
        data[at] = (unsigned char)(i % 3 ? old ^ (1u << (seed >> 28 & 7)) : seed >> 16);
        store(bad, data, size);
        struct dph_image image;
        struct dph_error err = {0};
        if (!dph_image_load(&image, bad, &err))
            assert_int_equal(strncmp(err.message, bad, strlen(bad)), 0);
        dph_image_finish(&image);
        data[at] = old;
    }
    free(data);
}

static void test_broken(void **state)
{
    (void)state;
    struct dph_image image;
    struct dph_error err = {0};
    fill(&image, 21, 19, false);
    assert_true(dph_image_save(&image, in_folder("good.png"), NULL, NULL));
    assert_true(dph_image_save(&image, in_folder("good.exr"), NULL, NULL));
    dph_image_finish(&image);
    torture(in_folder("good.png"), in_folder("bad.png"));
    torture(in_folder("good.exr"), in_folder("bad.exr"));

    assert_false(dph_image_load(&image, in_folder("missing.png"), &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    store(in_folder("text.png"), (const unsigned char *)"hello, world", 12);
    assert_false(dph_image_load(&image, in_folder("text.png"), &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
}

static void test_unwritable(void **state)
{
    (void)state;
    struct dph_image image;
    struct dph_error err = {0};
    fill(&image, 4, 4, false);
    assert_false(dph_image_save(&image, in_folder("a.jpg"), NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_false(dph_image_save(&image, in_folder("none/a.png"), NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_OUTPUT);
    assert_false(dph_image_save(&image, in_folder("none/a.exr"), NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_OUTPUT);
    if (access("/dev/full", W_OK) == 0) {
        if (symlink("/dev/full", in_folder("full.png")) == 0) {
            assert_false(dph_image_save(&image, in_folder("full.png"), NULL, &err));
            assert_int_equal(err.code, DPH_ERROR_OUTPUT);
        }
    }
    dph_image_finish(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_curve),          cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_png_round_trip), cmocka_unit_test(test_png_codes),
        cmocka_unit_test(test_png_kinds),      cmocka_unit_test(test_exr_round_trip),
        cmocka_unit_test(test_exr_half),       cmocka_unit_test(test_broken),
        cmocka_unit_test(test_unwritable),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
