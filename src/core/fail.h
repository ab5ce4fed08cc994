/* core/fail.h - filling struct dph_error.      Tier 0, private. */
#ifndef DPH_CORE_FAIL_H
#define DPH_CORE_FAIL_H

#include <diaphan/error.h>

/* Describes a failure in `err` (Nullable) and returns false, so that `return dph_fail(...)`
 * reads well. Control characters in the message (names from hostile files) become '?'. */
bool dph_fail(struct dph_error *err, enum dph_code code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The message for an allocation that failed. */
bool dph_fail_memory(struct dph_error *err);

#endif
