/* Filling struct dph_error. */
#include "core/fail.h"

#include <stdarg.h>
#include <stdio.h>

const char *dph_version(void)
{
    return DPH_VERSION;
}

bool dph_fail(struct dph_error *err, enum dph_code code, const char *format, ...)
{
    if (!err)
        return false;
    err->code = code;
    va_list args;
    va_start(args, format);
    vsnprintf(err->message, sizeof err->message, format, args);
    va_end(args);
    for (char *c = err->message; *c; c++)
        if ((unsigned char)*c < 32 || *c == 127)
            *c = '?';
    return false;
}

bool dph_fail_memory(struct dph_error *err)
{
    return dph_fail(err, DPH_ERROR_MEMORY, "out of memory");
}
