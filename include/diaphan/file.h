/* diaphan/file.h - a whole file out of memory, for what has no writer of its own.      Tier 0.
 *
 * For reports, charts and figures, which are made in memory first. */
#ifndef DIAPHAN_FILE_H
#define DIAPHAN_FILE_H

#include <diaphan/error.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Writes `size` bytes to `path` as every output of the project is written: the file appears whole
 * or not at all, and an existing one survives a failure. False: DPH_ERROR_OUTPUT or _MEMORY. */
bool dph_file_save(const char *path, const void *data, size_t size, struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
