/* OpenEXR through OpenEXRCore, the C library of OpenEXR 3.1.
 *
 * The library reads and writes at offsets, so both directions go through a buffer in memory: a read
 * never sees more than the file, and a written file reaches the disk whole through dph_output.
 * Written: one part, scan lines, ZIP (16 lines a chunk), 32-bit float channels R, G, B, A and those
 * that the caller adds, with rows from the top; the library sorts them by name, as the format wants.
 * Nothing in the header depends on the machine or the time. */
#include "core/fail.h"
#include "core/memory.h"
#include "image/formats.h"

#include <openexr.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_CHANNELS = 64, MAX_STRIDE = 1024 };

/* What a context's callbacks see. */
struct stream {
    const struct dph_file *in;
    unsigned char *out;
    size_t size, capacity;
    bool memory;       /* an allocation failed                    */
    char message[160]; /* the first error that the library states */
};

static void on_error(exr_const_context_t ctxt, exr_result_t code, const char *message)
{
    void *user = NULL;
    if (!ctxt || exr_get_user_data(ctxt, &user) != EXR_ERR_SUCCESS || !user)
        return;
    struct stream *s = user;
    if (!s->message[0])
        snprintf(s->message, sizeof s->message, "%s",
                 message ? message : exr_get_default_error_message(code));
}

static int64_t size_of(exr_const_context_t ctxt, void *user)
{
    (void)ctxt;
    const struct stream *s = user;
    return (int64_t)s->in->size;
}

static int64_t read_at(exr_const_context_t ctxt, void *user, void *buffer, uint64_t size,
                       uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    (void)ctxt;
    (void)fail;
    const struct stream *s = user;
    if (offset >= s->in->size)
        return 0;
    size_t left = s->in->size - (size_t)offset, count = size < left ? (size_t)size : left;
    memcpy(buffer, s->in->data + offset, count);
    return (int64_t)count;
}

static int64_t write_at(exr_const_context_t ctxt, void *user, const void *buffer, uint64_t size,
                        uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    (void)ctxt;
    (void)fail;
    struct stream *s = user;
    size_t end = (size_t)offset + (size_t)size;
    if (end > s->capacity) {
        size_t capacity = s->capacity * 2 > end ? s->capacity * 2 : end + 65536;
        unsigned char *bigger = realloc(s->out, capacity);
        if (!bigger) {
            s->memory = true;
            return -1;
        }
        memset(bigger + s->capacity, 0, capacity - s->capacity);
        s->out = bigger;
        s->capacity = capacity;
    }
    memcpy(s->out + offset, buffer, (size_t)size);
    if (end > s->size)
        s->size = end;
    return (int64_t)size;
}

static exr_context_initializer_t initializer(struct stream *s)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = on_error;
    init.user_data = s;
    init.read_fn = s->in ? read_at : NULL;
    init.size_fn = s->in ? size_of : NULL;
    init.write_fn = s->in ? NULL : write_at;
    init.max_image_width = init.max_image_height = 32768;
    init.zip_level = 6;
    return init;
}

/* Which of R, G, B, A a channel feeds: 0 to 3, 4 for Y (grey), -1 for the others. */
static int slot_of(const char *name)
{
    static const char *const names[5] = {"R", "G", "B", "A", "Y"};
    for (int i = 0; i < 5; i++)
        if (!strcmp(name, names[i]))
            return i;
    return -1;
}

/* Checks the header and allocates the picture. `grey`: Y stands for R, G and B. */
static bool read_header(exr_context_t exr, struct dph_image *image, bool *grey, int *top,
                        const struct dph_file *file, const char *path, struct dph_error *err)
{
    exr_storage_t storage;
    exr_attr_box2i_t window;
    exr_compression_t compression;
    const exr_attr_chlist_t *channels;
    int parts = 0;
    if (exr_get_count(exr, &parts) || exr_get_storage(exr, 0, &storage) ||
        exr_get_data_window(exr, 0, &window) || exr_get_compression(exr, 0, &compression) ||
        exr_get_channels(exr, 0, &channels))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: header: lacks an attribute", path);
    if (parts != 1 || storage != EXR_STORAGE_SCANLINE)
        return dph_fail(err, DPH_ERROR_UNSUPPORTED,
                        "%s: header: only files of one part of scan lines are read; this has %d %s",
                        path, parts, parts != 1 ? "parts" : "part of tiles or deep samples");
    bool have[5] = {false};
    size_t row_bytes = 0;
    int64_t width = (int64_t)window.max.x - window.min.x + 1;
    int64_t height = (int64_t)window.max.y - window.min.y + 1;
    for (int i = 0; i < channels->num_channels; i++) {
        const exr_attr_chlist_entry_t *entry = &channels->entries[i];
        int slot = slot_of(entry->name.str);
        size_t bytes = entry->pixel_type == EXR_PIXEL_HALF ? 2 : 4;
        if (width > 0 && width <= 32768)
            row_bytes += bytes * (size_t)width;
        if (slot < 0)
            continue;
        if (entry->x_sampling != 1 || entry->y_sampling != 1)
            return dph_fail(err, DPH_ERROR_UNSUPPORTED, "%s: channel %s: is subsampled by %d x %d",
                            path, entry->name.str, entry->x_sampling, entry->y_sampling);
        if (entry->pixel_type == EXR_PIXEL_UINT)
            return dph_fail(err, DPH_ERROR_UNSUPPORTED, "%s: channel %s: holds integers", path,
                            entry->name.str);
        have[slot] = true;
    }
    *grey = have[4] && !have[0] && !have[1] && !have[2];
    if (!*grey && !(have[0] && have[1] && have[2]))
        return dph_fail(err, DPH_ERROR_UNSUPPORTED,
                        "%s: header: has neither channels R, G and B nor Y", path);
    if (!dph_image_check_claim(path, "data window", width, height,
                               compression == EXR_COMPRESSION_NONE ? row_bytes * 1032 : row_bytes,
                               file->size, err))
        return false;
    if (!dph_image_init(image, (int)width, (int)height, err))
        return false;
    size_t count = (size_t)width * (size_t)height;
    if (!have[3])
        for (size_t i = 0; i < count; i++)
            image->pixel[4 * i + 3] = 1;
    *top = window.min.y;
    return true;
}

/* Decodes one chunk, whose first line is line `y` of the picture. Channels are decoded into planes of their own
 * and then woven: 3.1's short cut for interleaved half floats mixes channels up. */
static exr_result_t read_chunk(exr_context_t exr, exr_decode_pipeline_t *decode, bool *begun,
                               int line, float *plane[5], size_t plane_size,
                               struct dph_image *image, bool grey, int y)
{
    exr_chunk_info_t chunk;
    exr_result_t result = exr_read_scanline_chunk_info(exr, 0, line, &chunk);
    if (result)
        return result;
    result = *begun ? exr_decoding_update(exr, 0, &chunk, decode)
                    : exr_decoding_initialize(exr, 0, &chunk, decode);
    if (result)
        return result;
    size_t width = (size_t)image->width, lines = (size_t)chunk.height;
    if ((size_t)chunk.width != width || lines * width > plane_size ||
        lines > (size_t)(image->height - y))
        result = EXR_ERR_CORRUPT_CHUNK;
    for (int c = 0; c < decode->channel_count && !result; c++) {
        exr_coding_channel_info_t *channel = &decode->channels[c];
        int slot = slot_of(channel->channel_name);
        channel->decode_to_ptr = NULL;
        if (slot < 0 || (grey ? slot < 3 : slot == 4))
            continue;
        channel->decode_to_ptr = (uint8_t *)plane[slot];
        channel->user_pixel_stride = 4;
        channel->user_line_stride = image->width * 4;
        channel->user_bytes_per_element = 4;
        channel->user_data_type = EXR_PIXEL_FLOAT;
    }
    if (!*begun && !result)
        result = exr_decoding_choose_default_routines(exr, 0, decode);
    *begun = true; /* even after a failure: the pipeline has buffers to free */
    if (!result)
        result = exr_decoding_run(exr, 0, decode);
    for (int c = 0; c < decode->channel_count && !result; c++) {
        if (!decode->channels[c].decode_to_ptr)
            continue;
        int slot = slot_of(decode->channels[c].channel_name);
        float *out = image->pixel + (size_t)y * width * 4;
        for (size_t i = 0; i < lines * width; i++) {
            if (slot < 4)
                out[4 * i + (size_t)slot] = plane[slot][i];
            else
                out[4 * i] = out[4 * i + 1] = out[4 * i + 2] = plane[4][i];
        }
    }
    return result;
}

/* Decodes the chunks one after another into the picture. */
static exr_result_t read_chunks(exr_context_t exr, struct dph_image *image, bool grey, int top)
{
    exr_decode_pipeline_t decode = EXR_DECODE_PIPELINE_INITIALIZER;
    bool begun = false;
    int32_t lines = 1;
    exr_result_t result = exr_get_scanlines_per_chunk(exr, 0, &lines);
    if (result || lines < 1)
        return result ? result : EXR_ERR_CORRUPT_CHUNK;
    size_t plane_size = (size_t)lines * (size_t)image->width;
    float *buffer = dph_alloc(plane_size, 5 * sizeof *buffer), *plane[5];
    if (!buffer)
        return EXR_ERR_OUT_OF_MEMORY;
    for (size_t i = 0; i < 5; i++)
        plane[i] = buffer + i * plane_size;
    for (int y = 0; y < image->height && !result; y += lines)
        result = read_chunk(exr, &decode, &begun, top + y, plane, plane_size, image, grey, y);
    if (begun)
        exr_decoding_destroy(exr, &decode);
    free(buffer);
    return result;
}

bool dph_read_exr(struct dph_image *image, const struct dph_file *file, const char *path,
                  struct dph_error *err)
{
    struct stream s = {.in = file};
    exr_context_initializer_t init = initializer(&s);
    exr_context_t exr = NULL;
    bool grey = false, ok = false;
    int top = 0;
    *image = (struct dph_image){0};
    exr_result_t result = exr_start_read(&exr, path, &init);
    if (result) {
        dph_fail(err, DPH_ERROR_INPUT, "%s: header: %s", path,
                 s.message[0] ? s.message : exr_get_default_error_message(result));
    } else if (read_header(exr, image, &grey, &top, file, path, err)) {
        result = read_chunks(exr, image, grey, top);
        ok = !result;
        if (!ok)
            dph_fail(err,
                     result == EXR_ERR_OUT_OF_MEMORY             ? DPH_ERROR_MEMORY
                     : result == EXR_ERR_FEATURE_NOT_IMPLEMENTED ? DPH_ERROR_UNSUPPORTED
                                                                 : DPH_ERROR_INPUT,
                     "%s: pixels: %s", path,
                     s.message[0] ? s.message : exr_get_default_error_message(result));
    }
    exr_finish(&exr);
    if (!ok)
        dph_image_finish(image);
    return ok;
}

/* What is to be written. */
struct picture {
    const struct dph_image *image;
    const struct dph_channel *channel; /* (nchannel) beside R, G, B and A */
    int nchannel;
};

/* Where a channel's values lie, and how many floats apart those of neighbours are. */
static const float *values_of(const struct picture *picture, const char *name, int *stride)
{
    for (int i = 0; i < picture->nchannel; i++)
        if (!strcmp(name, picture->channel[i].name)) {
            *stride = picture->channel[i].stride;
            return picture->channel[i].value;
        }
    *stride = 4;
    return picture->image->pixel + slot_of(name);
}

static exr_result_t write_chunks(exr_context_t exr, const struct picture *picture)
{
    exr_encode_pipeline_t encode = EXR_ENCODE_PIPELINE_INITIALIZER;
    bool begun = false;
    int32_t lines = 1;
    int width = picture->image->width, height = picture->image->height;
    exr_result_t result = exr_get_scanlines_per_chunk(exr, 0, &lines);
    for (int y = 0; y < height && !result; y += lines) {
        exr_chunk_info_t chunk = {0};
        result = exr_write_scanline_chunk_info(exr, 0, y, &chunk);
        if (result)
            break;
        result = begun ? exr_encoding_update(exr, 0, &chunk, &encode)
                       : exr_encoding_initialize(exr, 0, &chunk, &encode);
        if (!begun && result)
            break;
        for (int c = 0; c < encode.channel_count && !result; c++) {
            exr_coding_channel_info_t *channel = &encode.channels[c];
            int stride;
            const float *value = values_of(picture, channel->channel_name, &stride);
            value += (size_t)y * (size_t)width * (size_t)stride;
            channel->encode_from_ptr = (const uint8_t *)value;
            channel->user_pixel_stride = 4 * stride;
            channel->user_line_stride = 4 * stride * width;
            channel->user_bytes_per_element = 4;
            channel->user_data_type = EXR_PIXEL_FLOAT;
        }
        if (!begun && !result)
            result = exr_encoding_choose_default_routines(exr, 0, &encode);
        begun = true;
        if (!result)
            result = exr_encoding_run(exr, 0, &encode);
    }
    if (begun)
        exr_encoding_destroy(exr, &encode);
    return result;
}

/* Names are the caller's: what another program could not tell apart or print is refused. */
static bool check_channels(const struct picture *picture, const char *path, struct dph_error *err)
{
    if (picture->nchannel < 0 || picture->nchannel > MAX_CHANNELS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%s: %d further channels: 0 to %d", path,
                        picture->nchannel, (int)MAX_CHANNELS);
    for (int i = 0; i < picture->nchannel; i++) {
        const struct dph_channel *channel = &picture->channel[i];
        size_t length = strlen(channel->name), plain = 0;
        while (plain < length && channel->name[plain] > ' ' && channel->name[plain] <= '~')
            plain++;
        if (length < 1 || length > 31 || plain < length)
            return dph_fail(err, DPH_ERROR_ARGUMENT,
                            "%s: channel %d: a name has 1 to 31 ASCII characters and no spaces",
                            path, i + 1);
        bool twice = slot_of(channel->name) >= 0;
        for (int j = 0; j < i; j++)
            twice = twice || !strcmp(channel->name, picture->channel[j].name);
        if (twice)
            return dph_fail(err, DPH_ERROR_ARGUMENT, "%s: channel %s: the name is taken", path,
                            channel->name);
        if (channel->stride < 1 || channel->stride > MAX_STRIDE)
            return dph_fail(err, DPH_ERROR_ARGUMENT, "%s: channel %s: a stride of %d: 1 to %d",
                            path, channel->name, channel->stride, (int)MAX_STRIDE);
    }
    return true;
}

bool dph_write_exr(const struct dph_image *image, const struct dph_channel *channel, int nchannel,
                   const char *path, struct dph_error *err)
{
    const struct picture picture = {image, channel, nchannel};
    if (!check_channels(&picture, path, err))
        return false;
    struct stream s = {0};
    exr_context_initializer_t init = initializer(&s);
    exr_context_t exr = NULL;
    int part = 0;
    /* the name is for the library's messages only: it writes to the stream */
    exr_result_t result = exr_start_write(&exr, "picture.exr", EXR_WRITE_FILE_DIRECTLY, &init);
    if (!result)
        result = exr_add_part(exr, NULL, EXR_STORAGE_SCANLINE, &part);
    if (!result)
        result = exr_initialize_required_attr_simple(exr, part, image->width, image->height,
                                                     EXR_COMPRESSION_ZIP);
    static const char *const names[4] = {"R", "G", "B", "A"};
    for (int c = 0; c < 4 && !result; c++)
        result = exr_add_channel(exr, part, names[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC,
                                 1, 1);
    for (int c = 0; c < nchannel && !result; c++)
        result = exr_add_channel(exr, part, channel[c].name, EXR_PIXEL_FLOAT,
                                 EXR_PERCEPTUALLY_LINEAR, 1, 1);
    if (!result)
        result = exr_write_header(exr);
    if (!result)
        result = write_chunks(exr, &picture);
    exr_result_t finished = exr_finish(&exr); /* writes the table of chunks */
    if (!result)
        result = finished;
    bool ok = !result;
    if (!ok && (s.memory || result == EXR_ERR_OUT_OF_MEMORY))
        dph_fail_memory(err);
    else if (!ok)
        dph_fail(err, DPH_ERROR_OUTPUT, "%s: %s", path,
                 s.message[0] ? s.message : exr_get_default_error_message(result));
    struct dph_output *out = ok ? dph_output_open(path, err) : NULL;
    if (out)
        dph_output_write(out, s.out, s.size);
    ok = out && dph_output_close(out, err);
    free(s.out);
    return ok;
}
