/* diaphan/error.h - how every module of the library reports failure and progress.      Tier 0.
 *
 * A function that can fail returns NULL or false and describes the failure in the struct dph_error
 * that its caller passed last (NULL: the caller does not care). On success the struct is untouched.
 * The library never prints, never exits and never reads the environment. */
#ifndef DIAPHAN_ERROR_H
#define DIAPHAN_ERROR_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of these headers. */
#define DPH_VERSION "0.1.0"

/* Stable: values are never renumbered, new ones are appended. */
enum dph_code {
    DPH_OK = 0,
    DPH_ERROR_ARGUMENT,    /* a parameter out of its range, an unknown name            */
    DPH_ERROR_MEMORY,      /* an allocation failed                                     */
    DPH_ERROR_INPUT,       /* a file or an array is malformed or contradicts itself    */
    DPH_ERROR_UNSUPPORTED, /* a well-formed file needs something that is not offered   */
    DPH_ERROR_LIMIT,       /* a file asks for more than a reader accepts               */
    DPH_ERROR_OUTPUT,      /* a file could not be written                              */
    DPH_ERROR_CAPABILITY,  /* the machine lacks something, for instance a GL context   */
    DPH_ERROR_CANCELLED,   /* the progress callback returned false                     */
};

/* What went wrong. `message` is one whole sentence without a newline; for a file it begins with the
 * path and the place ("bunny.obj:812: face refers to vertex 9001, the mesh has 2503"). */
struct dph_error {
    enum dph_code code;
    char message[512];
};

/* Called during long work with the share done so far, 0 to 1, never decreasing; false cancels,
 * and the work then fails with DPH_ERROR_CANCELLED. It is called by one thread at a time, the
 * one that called the library. */
typedef bool dph_progress(void *user, double fraction);

/* The version the library was built as, "MAJOR.MINOR.PATCH". */
const char *dph_version(void);

#ifdef __cplusplus
}
#endif
#endif
