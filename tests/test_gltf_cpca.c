/* Thickness as clustered principal components in glTF: written, read back, baked over, and broken
 * on purpose. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>

#include <cmocka.h>

#include "fabricate.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static char path[64], again[64];

/* A wavy sheet of 60 x 60 vertices. */
static struct dph_scene *make_scene(void)
{
    enum { SIDE = 60 };
    struct dph_mesh mesh;
    assert_true(dph_mesh_init(&mesh, SIDE * SIDE, 2 * (SIDE - 1) * (SIDE - 1), true, false, NULL));
    for (uint32_t v = 0; v < SIDE * SIDE; v++) {
        float x = (float)(v % SIDE) / SIDE, y = (float)(v / SIDE) / SIDE;
        float p[3] = {x, y, sinf(5 * x) * cosf(4 * y)}, n[3] = {0, 0, 1};
        memcpy(mesh.position + 3 * (size_t)v, p, sizeof p);
        memcpy(mesh.normal + 3 * (size_t)v, n, sizeof n);
    }
    uint32_t *index = mesh.index;
    for (uint32_t y = 0; y + 1 < SIDE; y++)
        for (uint32_t x = 0; x + 1 < SIDE; x++) {
            uint32_t a = y * SIDE + x, t[6] = {a, a + 1, a + SIDE, a + SIDE, a + 1, a + SIDE + 1};
            memcpy(index, t, sizeof t);
            index += 6;
        }
    struct dph_scene *scene = dph_scene_from_mesh(&mesh, "sheet", NULL);
    assert_non_null(scene);
    return scene;
}

static void save(struct dph_scene *scene, const char *where)
{
    struct dph_error err = {0};
    if (!dph_scene_save(scene, where, &err))
        fail_msg("%s", err.message);
}

static struct dph_scene *load(const char *where)
{
    struct dph_error err = {0};
    struct dph_scene *scene = dph_scene_load(where, &err);
    if (!scene)
        fail_msg("%s", err.message);
    return scene;
}

static void assert_same(const struct dph_thickness *a, const struct dph_thickness *b)
{
    assert_non_null(b);
    assert_int_equal(a->store, b->store);
    assert_int_equal(a->nvert, b->nvert);
    assert_int_equal(a->bands, b->bands);
    assert_int_equal(a->components, b->components);
    assert_int_equal(a->clusters, b->clusters);
    assert_int_equal(a->vectors, b->vectors);
    assert_int_equal(a->directions, b->directions);
    assert_int_equal(a->fit, b->fit);
    assert_int_equal(a->definition, b->definition);
    assert_memory_equal(a->data, b->data, a->nvert * (size_t)a->components);
    assert_memory_equal(a->cluster, b->cluster, a->nvert * sizeof *a->cluster);
    assert_memory_equal(a->table, b->table, dph_thickness_shared(a));
}

static void test_round_trip(void **unused)
{
    (void)unused;
    for (int bands = 1; bands <= 8; bands++) { /* 5: more than 256 clusters */
        struct dph_scene *scene = make_scene();
        assert_true(fabricate_thickness(scene, bands, DPH_STORE_CPCA));
        if (bands == 5)
            assert_true(scene->body->thickness->clusters > 256);
        save(scene, path);
        struct dph_scene *back = load(path);
        assert_same(scene->body->thickness, back->body->thickness);
        assert_true(fabs(back->mm_per_unit - scene->mm_per_unit) < 1e-9);
        save(back, again); /* and through a document */
        struct dph_scene *third = load(again);
        assert_same(scene->body->thickness, third->body->thickness);
        dph_scene_destroy(third);
        dph_scene_destroy(back);
        dph_scene_destroy(scene);
    }
}

static long size_of(const char *where)
{
    FILE *file = fopen(where, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    fclose(file);
    return size;
}

/* One store over the other takes its place: nothing of the old one is read, and the file does not
 * grow from bake to bake. */
static void test_bake_over(void **unused)
{
    (void)unused;
    static const enum dph_store stores[] = {DPH_STORE_CPCA, DPH_STORE_SNORM8, DPH_STORE_CPCA,
                                            DPH_STORE_CPCA, DPH_STORE_FLOAT, DPH_STORE_CPCA};
    struct dph_scene *scene = make_scene();
    long first = 0;
    save(scene, path);
    dph_scene_destroy(scene);
    for (size_t i = 0; i < sizeof stores / sizeof *stores; i++) {
        scene = load(path);
        assert_true(fabricate_thickness(scene, 6, stores[i]));
        save(scene, path);
        struct dph_scene *back = load(path);
        assert_int_equal(back->body->thickness->store, stores[i]);
        if (stores[i] == DPH_STORE_CPCA)
            assert_same(scene->body->thickness, back->body->thickness);
        if (!i)
            first = size_of(path);
        else if (stores[i] == DPH_STORE_CPCA)
            assert_true(size_of(path) <= first + 2048);
        dph_scene_destroy(back);
        dph_scene_destroy(scene);
    }
}

/* Overwrites the first occurrence of `old` in the file by `new` of the same length, then expects
 * the message. */
static void expect_broken(const char *old, const char *new, const char *message)
{
    static char data[1 << 20];
    assert_int_equal(strlen(old), strlen(new));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t size = fread(data, 1, sizeof data, file), at = 0, length = strlen(old);
    fclose(file);
    while (at + length <= size && memcmp(data + at, old, length))
        at++;
    assert_true(at + length <= size);
    memcpy(data + at, new, length);
    assert_non_null(file = fopen(again, "wb"));
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
    struct dph_error err = {0};
    struct dph_scene *scene = dph_scene_load(again, &err);
    if (scene || !strstr(err.message, message))
        fail_msg("%s -> %s: %s", old, new, scene ? "was read" : err.message);
}

static void test_broken(void **unused)
{
    (void)unused;
    struct dph_scene *scene = make_scene();
    assert_true(fabricate_thickness(scene, 6, DPH_STORE_CPCA));
    assert_int_equal(scene->body->thickness->clusters, 20);
    save(scene, path);
    expect_broken("\"clusters\":20", "\"clusters\":99", "need");
    expect_broken("\"clusters\":20", "\"clusters\":01", "");
    expect_broken("\"clusters\":20", "\"clusters\":-1", "clusters");
    expect_broken("\"clusters\":20", "\"clusters\":12", "there are 12 clusters");
    expect_broken("\"vectors\":5", "\"vectors\":0", "vectors is 0");
    expect_broken("\"vectors\":5", "\"vectors\":9", "need");
    expect_broken("\"vectors\":5", "\"victors\":5", "vectors");
    expect_broken("\"bands\":6", "\"bands\":7", "need");
    expect_broken("_THICKNESS_CPCA_1", "_THICKNESS_OTHER1", "_THICKNESS_CPCA_1 is missing");
    expect_broken("_THICKNESS_CLUSTER", "_THICKNESS_CLASTER", "_THICKNESS_CLUSTER is missing");
    /* a number of the table that is none */
    scene->body->thickness->table[77] = NAN;
    save(scene, again);
    struct dph_error err = {0};
    assert_null(dph_scene_load(again, &err));
    assert_non_null(strstr(err.message, "number 77 of bufferView"));
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_bake_over),
        cmocka_unit_test(test_broken),
    };
    snprintf(path, sizeof path, "/tmp/diaphan-cpca-%ld.glb", (long)getpid());
    snprintf(again, sizeof again, "/tmp/diaphan-cpca-%ld-again.glb", (long)getpid());
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    remove(path);
    remove(again);
    return failed;
}
