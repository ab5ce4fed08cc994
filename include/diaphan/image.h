/* diaphan/image.h - pictures in linear float: PNG, EXR, Radiance.      Tier 1.
 *
 * Rows run from the top. Channels are linear, scene-referred; alpha is coverage. */
#ifndef DIAPHAN_IMAGE_H
#define DIAPHAN_IMAGE_H

#include <diaphan/error.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Owns `pixel`. */
struct dph_image {
    int width, height;
    float *pixel; /* (height x width x 4) RGBA */
};

/* Allocates a picture of zeros. False: DPH_ERROR_ARGUMENT (a side below 1 or above 32768) or
 * DPH_ERROR_MEMORY. */
bool dph_image_init(struct dph_image *image, int width, int height, struct dph_error *err);
void dph_image_finish(struct dph_image *image);

/* The one output transform: color * 2^exposure, clipped to [0, 1], sRGB (IEC 61966-2-1). */
struct dph_tone {
    double exposure; /* stops */
    bool linear;     /* write the clipped value itself, without the sRGB curve */
};

/* Linear to sRGB, [0, 1] to [0, 1]. */
double dph_srgb_encode(double linear);
double dph_srgb_decode(double encoded);

/* Writes .png (8 bit RGB through `tone`, with an sRGB chunk) or .exr (single-part scanline, ZIP,
 * 32-bit float R, G, B, A, linear, `tone` not applied), told by the ending. The file appears whole
 * or not at all. False: DPH_ERROR_ARGUMENT (another ending), _OUTPUT, _MEMORY. */
bool dph_image_save(const struct dph_image *image, const char *path, const struct dph_tone *tone,
                    struct dph_error *err);

/* A further channel of an .exr file, as large as the picture. */
struct dph_channel {
    const char *name;   /* 1 to 31 ASCII characters without spaces, by custom LAYER.COMPONENT, as
                         * variance.R; not R, G, B, A or Y, and no two alike                       */
    const float *value; /* (height x width), rows from the top, `stride` floats from one to the next */
    int stride;         /* 1 to 1024                                                               */
};

/* Writes .exr as dph_image_save does, with `channel` (nchannel, at most 64) beside R, G, B and A.
 * Programs that know nothing of them, and dph_image_load, read the picture alone. False:
 * DPH_ERROR_ARGUMENT (another ending, names, strides), _OUTPUT, _MEMORY. */
bool dph_image_save_channels(const struct dph_image *image, const struct dph_channel *channel,
                             int nchannel, const char *path, struct dph_error *err);

/* The bytes of the .png that dph_image_save would write, into memory: *data (*size bytes) is the
 * caller's to free(). False: DPH_ERROR_MEMORY. */
bool dph_image_encode_png(const struct dph_image *image, const struct dph_tone *tone,
                          unsigned char **data, size_t *size, struct dph_error *err);

/* Reads .png (any depth and colour type; decoded from sRGB to linear), .exr (R, G, B and A or Y;
 * missing alpha is 1, other channels are passed over) or .hdr (Radiance RGBE, alpha is 1), told by
 * the content. False: DPH_ERROR_INPUT, _LIMIT, _UNSUPPORTED, _MEMORY. */
bool dph_image_load(struct dph_image *image, const char *path, struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
