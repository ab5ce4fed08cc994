/* core/file.h - whole files in, whole files out.      Tier 0, private. */
#ifndef DPH_CORE_FILE_H
#define DPH_CORE_FILE_H

#include <diaphan/error.h>

/* The content of a file. `data` has a 0 byte beyond its end, so that text can be scanned without
 * looking at the size. */
struct dph_file {
    unsigned char *data;
    size_t size;
};

/* Reads a regular file of at most `limit` bytes. False: DPH_ERROR_INPUT (missing, not readable,
 * a folder), DPH_ERROR_LIMIT or DPH_ERROR_MEMORY, with the path in the message. */
bool dph_file_load(struct dph_file *file, const char *path, size_t limit, struct dph_error *err);
void dph_file_finish(struct dph_file *file);

/* An output that appears whole or not at all: it is written beside its place under another name,
 * flushed to the disk, and renamed. A failure, a full disk or a kill leaves an existing file as
 * it was. An existing file that is no regular file (a pipe, /dev/stdout) is written to directly. */
struct dph_output;

/* NULL: DPH_ERROR_OUTPUT or DPH_ERROR_MEMORY. */
struct dph_output *dph_output_open(const char *path, struct dph_error *err);
/* Appends; failures are remembered for dph_output_close. False once something has failed. */
bool dph_output_write(struct dph_output *out, const void *data, size_t size);
/* printf into the file. */
bool dph_output_printf(struct dph_output *out, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Puts the file in its place and frees `out`. False: DPH_ERROR_OUTPUT, and nothing is left
 * behind. */
bool dph_output_close(struct dph_output *out, struct dph_error *err);
/* Throws away what was written and frees `out`; accepts NULL. */
void dph_output_abandon(struct dph_output *out);

#endif
