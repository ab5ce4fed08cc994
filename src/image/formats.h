/* image/formats.h - the picture files, one format each.      Tier 1, private. */
#ifndef DPH_IMAGE_FORMATS_H
#define DPH_IMAGE_FORMATS_H

#include "core/file.h"
#include <diaphan/image.h>
#include <stdint.h>

/* More pixels than this are not read: as floats they would take 2 GiB. */
#define DPH_IMAGE_MAX_PIXELS ((size_t)1 << 27)
/* Nor is a larger file. */
#define DPH_IMAGE_MAX_FILE ((size_t)4 << 30)

/* Each fills an uninitialised image from a file in memory, or writes one. Errors as dph_image_load
 * and dph_image_save. */
bool dph_read_png(struct dph_image *image, const struct dph_file *file, const char *path,
                  struct dph_error *err);
bool dph_write_png(const struct dph_image *image, const char *path, const struct dph_tone *tone,
                   struct dph_error *err);
bool dph_read_exr(struct dph_image *image, const struct dph_file *file, const char *path,
                  struct dph_error *err);
bool dph_read_hdr(struct dph_image *image, const struct dph_file *file, const char *path,
                  struct dph_error *err);
bool dph_write_exr(const struct dph_image *image, const struct dph_channel *channel, int nchannel,
                   const char *path, struct dph_error *err);

/* Whether a picture of this size may be read from a file of `file_size` bytes, `row_bytes` a row
 * before compression. Deflate, the strongest of the compressions in use, shrinks by at most 1032 :
 * 1, so a header that claims more lies. `place` follows the path. */
bool dph_image_check_claim(const char *path, const char *place, int64_t width, int64_t height,
                           size_t row_bytes, size_t file_size, struct dph_error *err);

#endif
