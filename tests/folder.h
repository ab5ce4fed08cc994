/* A folder of a test program's own, for what it writes. Needs _XOPEN_SOURCE 700.     Tests only. */
#ifndef DPH_TESTS_FOLDER_H
#define DPH_TESTS_FOLDER_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { FOLDER_NAMES = 128 };

static char folder[] = "/tmp/diaphan-test-XXXXXX";
static char folder_path[FOLDER_NAMES][256];
static int folder_paths;

/* The path of a name in it. */
static inline const char *in_folder(const char *name)
{
    char path[sizeof *folder_path];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    for (int i = 0; i < folder_paths; i++)
        if (!strcmp(folder_path[i], path))
            return folder_path[i];
    assert_true(folder_paths < FOLDER_NAMES);
    return strcpy(folder_path[folder_paths++], path);
}

/* A file's bytes, with a 0 behind them. */
static inline char *slurp(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    char *data = malloc(*size + 1);
    assert_non_null(data);
    assert_int_equal(fread(data, 1, *size, file), *size);
    data[*size] = 0;
    fclose(file);
    return data;
}

/* For cmocka_run_group_tests. */
static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

/* Fails where something lies there that no test has named: a file that was not finished. DPH_KEEP in
 * the environment keeps all, to look at what is drawn. */
static int remove_folder(void **state)
{
    (void)state;
    if (getenv("DPH_KEEP"))
        return 0;
    while (folder_paths)
        remove(folder_path[--folder_paths]); /* a folder after what is in it */
    return rmdir(folder);
}

#endif
