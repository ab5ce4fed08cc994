/* Whole files in, whole files out. */
#define _XOPEN_SOURCE 700
#include "core/file.h"

#include <diaphan/file.h>

#include "core/fail.h"
#include "core/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool dph_file_load(struct dph_file *file, const char *path, size_t limit, struct dph_error *err)
{
    *file = (struct dph_file){0};
    int fd = open(path, O_RDONLY | O_NONBLOCK); /* a pipe nobody writes to must not hang */
    if (fd < 0)
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s", path, strerror(errno));
    struct stat info;
    if (fstat(fd, &info) || !S_ISREG(info.st_mode)) {
        close(fd);
        return dph_fail(err, DPH_ERROR_INPUT, "%s: not a regular file", path);
    }
    if (info.st_size < 0 || (unsigned long long)info.st_size > limit) {
        close(fd);
        return dph_fail(err, DPH_ERROR_LIMIT, "%s: %lld bytes, more than the %zu that are read",
                        path, (long long)info.st_size, limit);
    }
    size_t size = (size_t)info.st_size;
    unsigned char *data = malloc(size + 1);
    if (!data) {
        close(fd);
        return dph_fail_memory(err);
    }
    size_t done = 0;
    while (done < size) {
        ssize_t got = read(fd, data + done, size - done);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            break;
        done += (size_t)got;
    }
    close(fd);
    if (done < size) {
        free(data);
        return dph_fail(err, DPH_ERROR_INPUT, "%s: ends after %zu of %zu bytes", path, done, size);
    }
    data[size] = 0;
    *file = (struct dph_file){data, size};
    return true;
}

void dph_file_finish(struct dph_file *file)
{
    free(file->data);
    *file = (struct dph_file){0};
}

struct dph_output {
    FILE *stream;
    char *path;      /* where it belongs                            */
    char *temporary; /* where it is written; NULL: directly to path */
    int failed;      /* errno of the first failure                  */
};

/* The file that `path` names after following symbolic links, so that a link stays a link. Malloc'ed; NULL: out of memory. */
static char *final_path(const char *path)
{
    char *resolved = realpath(path, NULL);
    return resolved ? resolved : dph_strdup(path);
}

struct dph_output *dph_output_open(const char *path, struct dph_error *err)
{
    struct dph_output *out = calloc(1, sizeof *out);
    if (!out || !(out->path = final_path(path)))
        goto memory;
    struct stat info;
    bool exists = stat(out->path, &info) == 0;
    if (exists && S_ISDIR(info.st_mode)) {
        dph_fail(err, DPH_ERROR_OUTPUT, "%s: is a folder", path);
        goto error;
    }
    if (exists && !S_ISREG(info.st_mode)) {
        out->stream = fopen(out->path, "wb");
    } else {
        size_t bytes = strlen(out->path) + 16;
        if (!(out->temporary = malloc(bytes)))
            goto memory;
        snprintf(out->temporary, bytes, "%s.XXXXXX", out->path);
        int fd = mkstemp(out->temporary);
        if (fd < 0) {
            free(out->temporary);
            out->temporary = NULL;
        } else {
            mode_t mask = umask(0);
            umask(mask);
            if (fchmod(fd, exists ? info.st_mode & 0777 : 0666 & ~mask) == 0)
                out->stream = fdopen(fd, "wb");
            if (!out->stream)
                close(fd);
        }
    }
    if (!out->stream) {
        dph_fail(err, DPH_ERROR_OUTPUT, "%s: %s", path, strerror(errno));
        goto error;
    }
    return out;

memory:
    dph_fail_memory(err);
error:
    dph_output_abandon(out);
    return NULL;
}

bool dph_output_write(struct dph_output *out, const void *data, size_t size)
{
    if (!out->failed && size && fwrite(data, 1, size, out->stream) != size)
        out->failed = errno ? errno : EIO;
    return !out->failed;
}

bool dph_output_printf(struct dph_output *out, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (!out->failed && vfprintf(out->stream, format, args) < 0)
        out->failed = errno ? errno : EIO;
    va_end(args);
    return !out->failed;
}

bool dph_output_close(struct dph_output *out, struct dph_error *err)
{
    if (!out->failed && fflush(out->stream))
        out->failed = errno;
    if (!out->failed && out->temporary && fsync(fileno(out->stream)))
        out->failed = errno;
    if (fclose(out->stream) && !out->failed)
        out->failed = errno;
    out->stream = NULL;
    if (!out->failed && out->temporary) {
        if (rename(out->temporary, out->path))
            out->failed = errno;
        else {
            free(out->temporary);
            out->temporary = NULL;
        }
    }
    bool ok = !out->failed;
    if (!ok)
        dph_fail(err, DPH_ERROR_OUTPUT, "%s: %s", out->path, strerror(out->failed));
    dph_output_abandon(out);
    return ok;
}

void dph_output_abandon(struct dph_output *out)
{
    if (!out)
        return;
    if (out->stream)
        fclose(out->stream);
    if (out->temporary)
        unlink(out->temporary);
    free(out->temporary);
    free(out->path);
    free(out);
}

bool dph_file_save(const char *path, const void *data, size_t size, struct dph_error *err)
{
    struct dph_output *out = dph_output_open(path, err);
    if (!out)
        return false;
    dph_output_write(out, data, size);
    return dph_output_close(out, err);
}
