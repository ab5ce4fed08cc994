/* A GL context for a test program that draws, and peace with the leak checker.      Tests only. */
#ifndef DPH_TESTS_GL_TESTS_H
#define DPH_TESTS_GL_TESTS_H

#include <diaphan/render.h>

#include <stdio.h>

/* Drivers lose some bytes of their own, and can only be named as long as they are loaded: under
 * the leak checker the context stays, within its reach. */
void __lsan_disable(void) __attribute__((weak));
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:_dri.so\nleak:libgallium\nleak:libEGL\nleak:libnvidia\n";
}

static struct dph_gl *gl;

/* False: there is no context, and the reason is printed. */
static inline bool begin_gl(void)
{
    struct dph_error err;
    gl = dph_gl_create_headless(&err);
    if (gl)
        printf("%s\n", dph_gl_name(gl));
    else
        printf("skipped: %s\n", err.message);
    return gl;
}

static inline int end_gl(int failed)
{
    if (!__lsan_disable)
        dph_gl_destroy(gl);
    return failed;
}

/* main of a program whose tests draw; `tests` is an array. */
#define run_gl_tests(tests) (begin_gl() ? end_gl(cmocka_run_group_tests(tests, NULL, NULL)) : 77)

#endif
