/* Further channels of EXR files, read back by OpenEXR's own library without a line of ours between:
 * it is the reader that other programs have. And names and strides that are refused. */
#define _DEFAULT_SOURCE /* mkstemps */
#include <diaphan/image.h>

#include <openexr.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char path[] = "/tmp/dph-channels-XXXXXX.exr";

static float noise(uint32_t *state)
{
    *state = *state * 1664525 + 1013904223;
    return (float)(*state >> 8) / 16777216.0F;
}

/* Every value of one channel of the file, `out` (height x width). */
static void read_channel(exr_context_t exr, const char *name, int width, int height, float *out)
{
    exr_decode_pipeline_t decode = EXR_DECODE_PIPELINE_INITIALIZER;
    int32_t lines = 0;
    float scratch[16 * 64]; /* the other channels' values */
    assert_true(width <= 64);
    assert_int_equal(exr_get_scanlines_per_chunk(exr, 0, &lines), EXR_ERR_SUCCESS);
    assert_int_equal(lines, 16);
    for (int y = 0; y < height; y += lines) {
        exr_chunk_info_t chunk;
        assert_int_equal(exr_read_scanline_chunk_info(exr, 0, y, &chunk), EXR_ERR_SUCCESS);
        assert_int_equal(y ? exr_decoding_update(exr, 0, &chunk, &decode)
                           : exr_decoding_initialize(exr, 0, &chunk, &decode),
                         EXR_ERR_SUCCESS);
        bool found = false;
        for (int c = 0; c < decode.channel_count; c++) {
            bool wanted = !strcmp(decode.channels[c].channel_name, name);
            found = found || wanted;
            decode.channels[c].decode_to_ptr =
                (uint8_t *)(wanted ? out + (size_t)y * (size_t)width : scratch);
            decode.channels[c].user_bytes_per_element = 4;
            decode.channels[c].user_pixel_stride = 4;
            decode.channels[c].user_line_stride = 4 * width;
            decode.channels[c].user_data_type = EXR_PIXEL_FLOAT;
        }
        assert_true(found);
        if (!y)
            assert_int_equal(exr_decoding_choose_default_routines(exr, 0, &decode),
                             EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_run(exr, 0, &decode), EXR_ERR_SUCCESS);
    }
    exr_decoding_destroy(exr, &decode);
}

/* Three channels woven as the reference has them, one on its own; sizes around a chunk's 16 lines. */
static void test_round_trip(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {37, 16}, {5, 17}, {64, 50}};
    static const char *const sorted[8] = {"A",     "B", "G", "R", "samples", "variance.B",
                                          "variance.G", "variance.R"};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        int width = sizes[i][0], height = sizes[i][1];
        size_t count = (size_t)width * (size_t)height;
        struct dph_image a, b;
        struct dph_error err = {0};
        uint32_t seed = 7;
        float *woven = malloc(3 * count * sizeof *woven), *alone = malloc(count * sizeof *alone);
        float *got = malloc(count * sizeof *got);
        assert_true(woven && alone && got);
        assert_true(dph_image_init(&a, width, height, NULL));
        for (size_t k = 0; k < 4 * count; k++)
            a.pixel[k] = noise(&seed);
        for (size_t k = 0; k < 3 * count; k++)
            woven[k] = 1e-7F * noise(&seed); /* variances are small: half floats would lose them */
        for (size_t k = 0; k < count; k++)
            alone[k] = 1000 * noise(&seed) - 500;
        const struct dph_channel channel[4] = {{"variance.R", woven, 3},
                                               {"variance.G", woven + 1, 3},
                                               {"variance.B", woven + 2, 3},
                                               {"samples", alone, 1}};
        if (!dph_image_save_channels(&a, channel, 4, path, &err))
            fail_msg("%s", err.message);

        exr_context_t exr = NULL;
        exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
        const exr_attr_chlist_t *channels = NULL;
        exr_compression_t compression;
        exr_storage_t storage;
        int parts = 0;
        assert_int_equal(exr_start_read(&exr, path, &init), EXR_ERR_SUCCESS);
        assert_int_equal(exr_get_count(exr, &parts), EXR_ERR_SUCCESS);
        assert_int_equal(parts, 1);
        assert_int_equal(exr_get_storage(exr, 0, &storage), EXR_ERR_SUCCESS);
        assert_int_equal(storage, EXR_STORAGE_SCANLINE);
        assert_int_equal(exr_get_compression(exr, 0, &compression), EXR_ERR_SUCCESS);
        assert_int_equal(compression, EXR_COMPRESSION_ZIP);
        assert_int_equal(exr_get_channels(exr, 0, &channels), EXR_ERR_SUCCESS);
        assert_int_equal(channels->num_channels, 8);
        for (int c = 0; c < 8; c++) {
            assert_string_equal(channels->entries[c].name.str, sorted[c]);
            assert_int_equal(channels->entries[c].pixel_type, EXR_PIXEL_FLOAT);
        }
        for (int c = 0; c < 8; c++) {
            static const char *const rgba = "RGBA";
            read_channel(exr, sorted[c], width, height, got);
            for (size_t k = 0; k < count; k++) {
                float want = c < 4    ? a.pixel[4 * k + (size_t)(strchr(rgba, *sorted[c]) - rgba)]
                             : c == 4 ? alone[k]
                                      : woven[3 * k + (size_t)(7 - c)];
                assert_true(got[k] == want);
            }
        }
        exr_finish(&exr);

        if (!dph_image_load(&b, path, &err))
            fail_msg("%s", err.message);
        assert_memory_equal(a.pixel, b.pixel, 4 * count * sizeof *a.pixel);
        dph_image_finish(&a);
        dph_image_finish(&b);
        free(woven);
        free(alone);
        free(got);
    }
}

/* No channels: the very bytes of dph_image_save. */
static void test_none(void **state)
{
    (void)state;
    static unsigned char bytes[2][4096];
    size_t size[2];
    struct dph_image image;
    uint32_t seed = 1;
    assert_true(dph_image_init(&image, 6, 5, NULL));
    for (int k = 0; k < 120; k++)
        image.pixel[k] = noise(&seed);
    for (int i = 0; i < 2; i++) {
        assert_true(i ? dph_image_save_channels(&image, NULL, 0, path, NULL)
                      : dph_image_save(&image, path, NULL, NULL));
        FILE *file = fopen(path, "rb");
        assert_non_null(file);
        size[i] = fread(bytes[i], 1, sizeof bytes[i], file);
        fclose(file);
    }
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    dph_image_finish(&image);
}

static void test_refusals(void **state)
{
    (void)state;
    struct dph_image image;
    struct dph_error err = {0};
    float values[4] = {0};
    static const struct {
        const char *name[2];
        int stride;
        const char *said;
    } bad[] = {
        {{"R", "x"}, 1, "channel R: the name is taken"},
        {{"x", "A"}, 1, "channel A: the name is taken"},
        {{"x", "Y"}, 1, "channel Y: the name is taken"},
        {{"x", "x"}, 1, "channel x: the name is taken"},
        {{"", "x"}, 1, "channel 1: a name has"},
        {{"x", "two words"}, 1, "channel 2: a name has"},
        {{"x", "\xc3\xa4"}, 1, "channel 2: a name has"},
        {{"x", "thirty-two_characters_are_beyond"}, 1, "channel 2: a name has"},
        {{"x", "y"}, 0, "a stride of 0"},
        {{"x", "y"}, 1025, "a stride of 1025"},
    };
    assert_true(dph_image_init(&image, 2, 2, NULL));
    unlink(path);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const struct dph_channel channel[2] = {{bad[i].name[0], values, bad[i].stride},
                                               {bad[i].name[1], values, bad[i].stride}};
        assert_false(dph_image_save_channels(&image, channel, 2, path, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        if (!strstr(err.message, bad[i].said))
            fail_msg("%s", err.message);
        assert_int_not_equal(access(path, F_OK), 0);
    }
    assert_false(dph_image_save_channels(&image, NULL, 65, path, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_false(dph_image_save_channels(&image, NULL, 0, "/tmp/dph-channels.png", &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    const struct dph_channel longest = {"thirty-one_characters_are_fine.", values, 1};
    assert_true(dph_image_save_channels(&image, &longest, 1, path, &err));
    dph_image_finish(&image);
}

static int make_path(void **state)
{
    (void)state;
    int file = mkstemps(path, 4);
    return file < 0 ? -1 : close(file);
}

static int remove_path(void **state)
{
    (void)state;
    return unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_none),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, make_path, remove_path);
}
