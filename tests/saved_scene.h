/* What tests of data in glTF files share: a small scene, a file for it and a second one, and ways to
 * break them.                                                                          Tests only. */
#ifndef DPH_TESTS_SAVED_SCENE_H
#define DPH_TESTS_SAVED_SCENE_H

#include <diaphan/scene.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char path[64], again[64];

/* main of the tests of one kind of data: names the files, runs the tests, removes the files. */
#define run_saved_tests(kind, tests)                                                               \
    (snprintf(path, sizeof path, "/tmp/diaphan-%s-%ld.glb", kind, (long)getpid()),                 \
     snprintf(again, sizeof again, "/tmp/diaphan-%s-%ld-again.glb", kind, (long)getpid()),         \
     without_files(cmocka_run_group_tests(tests, NULL, NULL)))

static inline int without_files(int failed)
{
    remove(path);
    remove(again);
    return failed;
}

/* A wavy sheet of side x side vertices. */
static inline struct dph_scene *wavy_sheet(uint32_t side, float height)
{
    struct dph_mesh mesh;
    assert_true(dph_mesh_init(&mesh, (size_t)side * side, 2 * (size_t)(side - 1) * (side - 1), true,
                              false, NULL));
    for (uint32_t v = 0; v < side * side; v++) {
        float x = (float)(v % side) / (float)side, y = (float)(v / side) / (float)side;
        float p[3] = {x, y, height * sinf(5 * x) * cosf(4 * y)}, n[3] = {0, 0, 1};
        memcpy(mesh.position + 3 * (size_t)v, p, sizeof p);
        memcpy(mesh.normal + 3 * (size_t)v, n, sizeof n);
    }
    uint32_t *index = mesh.index;
    for (uint32_t y = 0; y + 1 < side; y++)
        for (uint32_t x = 0; x + 1 < side; x++) {
            uint32_t a = y * side + x, t[6] = {a, a + 1, a + side, a + side, a + 1, a + side + 1};
            memcpy(index, t, sizeof t);
            index += 6;
        }
    struct dph_scene *scene = dph_scene_from_mesh(&mesh, "sheet", NULL);
    assert_non_null(scene);
    return scene;
}

static inline void save(struct dph_scene *scene, const char *where)
{
    struct dph_error err = {0};
    if (!dph_scene_save(scene, where, &err))
        fail_msg("%s", err.message);
}

static inline struct dph_scene *load(const char *where)
{
    struct dph_error err = {0};
    struct dph_scene *scene = dph_scene_load(where, &err);
    if (!scene)
        fail_msg("%s", err.message);
    return scene;
}

static inline long size_of(const char *where)
{
    FILE *file = fopen(where, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    fclose(file);
    return size;
}

/* Overwrites the first occurrence of `old` in the file by `new` of the same length, then expects
 * the message. */
static inline void expect_broken(const char *old, const char *new, const char *message)
{
    static char data[1 << 20];
    assert_int_equal(strlen(old), strlen(new));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t size = fread(data, 1, sizeof data, file), at = 0, length = strlen(old);
    fclose(file);
    while (at + length <= size && memcmp(data + at, old, length))
        at++;
    if (at + length > size)
        fail_msg("no %s in the file", old);
    memcpy(data + at, new, length);
    assert_non_null(file = fopen(again, "wb"));
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
    struct dph_error err = {0};
    struct dph_scene *scene = dph_scene_load(again, &err);
    if (scene || !strstr(err.message, message))
        fail_msg("%s -> %s: %s", old, new, scene ? "was read" : err.message);
    dph_scene_destroy(scene);
}

/* Saves the scene with a number that is none, expects the message, and puts the number back. */
static inline void expect_not_finite(struct dph_scene *scene, float *number, const char *message)
{
    float was = *number;
    struct dph_error err = {0};
    *number = NAN;
    save(scene, again);
    assert_null(dph_scene_load(again, &err));
    if (!strstr(err.message, message))
        fail_msg("%s", err.message);
    *number = was;
}

#endif
