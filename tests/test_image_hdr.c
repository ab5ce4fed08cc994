#define _XOPEN_SOURCE 700
/* Radiance pictures: every kind of scan line, orientation and exposure; broken files fail in one line. */
#include <diaphan/image.h>

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

static char path[] = "/tmp/dph-hdr-XXXXXX";

static void store(const char *header, const unsigned char *data, size_t size)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs(header, f);
    assert_true(!size || fwrite(data, 1, size, f) == size);
    fclose(f);
}

static const char head[] = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n\n";

static void expect(const struct dph_image *image, int x, int y, double r, double g, double b)
{
    const float *p = image->pixel + 4 * (y * image->width + x);
    assert_float_equal(p[0], r, 1e-6);
    assert_float_equal(p[1], g, 1e-6);
    assert_float_equal(p[2], b, 1e-6);
    assert_true(p[3] == 1);
}

static void plain_pixels(void **state)
{
    (void)state;
    char text[200];
    struct dph_image image;
    static const struct {
        const char *size;
        bool up, left;
    } ways[] = {{"-Y 2 +X 3\n", false, false}, {"+Y 2 +X 3\n", true, false}, {"-Y 2 -X 3\n", false, true}};
    for (int n = 0; n < 3; n++) {
        /* three pixels, and one that is repeated twice */
        static const unsigned char lines[] = {127, 63, 0, 129, 1, 2, 3, 0, 8, 8, 8, 136,
                                              255, 0, 0, 128, 1, 1, 1, 2};
        snprintf(text, sizeof text, "%sEXPOSURE=2\n\n%s", "#?RGBE\n", ways[n].size);
        store(text, lines, sizeof lines);
        struct dph_error err = {0};
        if (!dph_image_load(&image, path, &err))
            fail_msg("%s", err.message);
        assert_int_equal(image.width * 10 + image.height, 32);
        int y = ways[n].up, x = ways[n].left ? 2 : 0, step = ways[n].left ? -1 : 1;
        expect(&image, x, y, 127.5 / 256, 63.5 / 256, .5 / 256);
        expect(&image, x + step, y, 0, 0, 0);
        expect(&image, x + 2 * step, y, 4.25, 4.25, 4.25);
        for (int i = 0; i < 3; i++)
            expect(&image, i, !y, 255.5 / 512, .5 / 512, .5 / 512);
        dph_image_finish(&image);
    }
}

static void run_lengths(void **state)
{
    (void)state;
    static const unsigned char line[] = {2, 2, 0, 10, 138, 7, 5, 1, 2, 3, 4, 5, 133, 9, 2, 1, 1, 136, 0, 138, 136};
    char text[200];
    snprintf(text, sizeof text, "%s-Y 1 +X 10\n", head);
    store(text, line, sizeof line);
    struct dph_image image;
    assert_true(dph_image_load(&image, path, NULL));
    for (int x = 0; x < 10; x++)
        expect(&image, x, 0, 7.5, x < 5 ? x + 1.5 : 9.5, x < 2 ? 1.5 : .5);
    dph_image_finish(&image);
    /* every cut and many changed bytes: an error or a picture, never more */
    for (size_t cut = 0; cut < sizeof line; cut++) {
        struct dph_error err = {0};
        store(text, line, cut);
        assert_false(dph_image_load(&image, path, &err));
        assert_int_equal(err.code, DPH_ERROR_INPUT);
        assert_non_null(strstr(err.message, "byte"));
        assert_null(strchr(err.message, '\n'));
    }
    for (size_t at = 0; at < sizeof line; at++)
        for (int value = 0; value < 256; value += 5) {
            unsigned char changed[sizeof line];
            memcpy(changed, line, sizeof line);
            changed[at] = (unsigned char)value;
            store(text, changed, sizeof changed);
            if (dph_image_load(&image, path, NULL))
                dph_image_finish(&image);
        }
}

static void broken_headers(void **state)
{
    (void)state;
    static const char *const headers[] = {
        "#?RADIANCE", "#?RADIANCE\n", "#?RADIANCE\n\n", "#?RADIANCE\n\n-Y 5\n", "#?RADIANCE\n\n-Y 0 +X 4\n",
        "#?RADIANCE\n\n-Y -3 +X 4\n", "#?RADIANCE\n\n-Y 30000 +X 30000\n", "#?RADIANCE\n\n-Y 999999999 +X 999999999\n",
        "#?RADIANCE\n\n-Z 4 +X 4\n", "#?RADIANCE\nEXPOSURE=x\n\n-Y 4 +X 4\n", "#?RADIANCE\nEXPOSURE=0\n\n-Y 4 +X 4\n",
        "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 4 +X 4\n", "#?RADIANCE\n\n+X 4 -Y 4\n", "#?RADIANCE\n\n-Y 4 +X 4",
    };
    for (size_t n = 0; n < sizeof headers / sizeof *headers; n++) {
        struct dph_image image;
        struct dph_error err = {0};
        store(headers[n], NULL, 0);
        assert_false(dph_image_load(&image, path, &err));
        assert_true(err.code == DPH_ERROR_INPUT || err.code == DPH_ERROR_LIMIT || err.code == DPH_ERROR_UNSUPPORTED);
        assert_null(image.pixel);
    }
}

static int start(void **state)
{
    (void)state;
    int file = mkstemp(path);
    return file < 0 ? -1 : close(file);
}

static int end(void **state)
{
    (void)state;
    return unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plain_pixels), cmocka_unit_test(run_lengths), cmocka_unit_test(broken_headers),
    };
    return cmocka_run_group_tests(tests, start, end);
}
