/* Scenes: telling formats apart, turning bodies that are inside out, bounds, warnings, saving. */
#define _XOPEN_SOURCE 700
#include <diaphan/scene.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char path[64];

/* A file of that ending in the temporary folder; loaded and removed again. */
static struct dph_scene *load(const char *ending, const void *data, size_t size,
                              struct dph_error *err)
{
    snprintf(path, sizeof path, "/tmp/diaphan-scene-%ld%s", (long)getpid(), ending);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
    struct dph_scene *scene = dph_scene_load(path, err);
    unlink(path);
    return scene;
}

static struct dph_scene *load_text(const char *ending, const char *text)
{
    struct dph_error err = {0};
    struct dph_scene *scene = load(ending, text, strlen(text), &err);
    if (!scene)
        fail_msg("%s: %s", ending, err.message);
    return scene;
}

static double volume(const struct dph_mesh *mesh)
{
    struct dph_mesh_stats stats;
    assert_true(dph_mesh_measure(mesh, &stats, NULL));
    return stats.volume;
}

static const char obj[] =
    "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nv 50 50 50\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty "
                          "float y\nproperty float z\n"
                          "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 "
                          "0\n1 0 0\n0 1 0\n3 0 1 2\n";
static const char stl[] = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 "
                          "0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
static const char gltf[] = " \n{\"asset\":{\"version\":\"2.0\"},\"meshes\":[{\"primitives\":[{"
                           "\"attributes\":{\"POSITION\":0}}]}],\"nodes\":[{\"mesh\":0}],"
                           "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,"
                           "\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,"
                           "\"byteLength\":36}],\"buffers\":[{\"byteLength\":36,\"uri\":\"data:;"
                           "base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}";

/* By content where it says enough, whatever the ending; else by the ending. */
static void test_formats(void **state)
{
    (void)state;
    static const char *const endings[] = {".gltf", ".glb", ".obj", ".ply", ".stl", ".xyz", ""};
    unsigned char binary[84 + 50] = "binary STL";
    const float corner[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    binary[80] = 1;
    memcpy(binary + 84, corner, sizeof corner);
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        struct dph_scene *scene = load_text(endings[i], ply);
        assert_int_equal(scene->body->mesh.ntri, 1);
        assert_null(scene->document);
        dph_scene_destroy(scene);
        scene = load_text(endings[i], gltf);
        assert_int_equal(scene->body->mesh.ntri, 1);
        assert_non_null(scene->document);
        assert_null(scene->body->mesh.normal); /* flat, as glTF says */
        dph_scene_destroy(scene);
    }
    static const char *const others[] = {".obj", "", ".OBJ"}, *const solids[] = {".stl", ".xyz",
                                                                                 ".StL"};
    for (int i = 0; i < 3; i++) {
        struct dph_scene *scene = load_text(others[i], obj);
        assert_int_equal(scene->body->mesh.ntri, 4);
        assert_non_null(scene->body->mesh.normal);
        dph_scene_destroy(scene);
        scene = load_text(solids[i], stl);
        assert_int_equal(scene->body->mesh.ntri, 1);
        dph_scene_destroy(scene);
        scene = load(solids[i], binary, sizeof binary, NULL);
        assert_non_null(scene);
        assert_int_equal(scene->body->mesh.ntri, 1);
        dph_scene_destroy(scene);
    }
    struct dph_error err = {0};
    assert_null(load(".xyz", "hello", 5, &err));
    assert_int_equal(err.code, DPH_ERROR_UNSUPPORTED);
    assert_null(load("", "", 0, &err));
    assert_int_equal(err.code, DPH_ERROR_UNSUPPORTED);
    assert_null(load(".glb", "gl", 2, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_null(dph_scene_load("/tmp", &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    assert_null(dph_scene_load("/tmp/there/is/no/such.glb", &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
}

static void test_body(void **state)
{
    (void)state;
    struct dph_scene *scene = load_text(".name.obj", obj);
    assert_int_equal(scene->nbody, 1);
    assert_int_equal(scene->ninstance, 1);
    assert_int_equal(scene->nwarning, 0);
    assert_non_null(strstr(scene->body->name, ".name"));
    assert_null(strstr(scene->body->name, ".obj"));
    /* the vertex that no triangle uses does not count */
    static const double high[3] = {1, 2, 3};
    for (int c = 0; c < 3; c++)
        assert_true(scene->bounds[0][c] == 0 && scene->bounds[1][c] == high[c]);
    assert_true(dph_scene_size(scene) == 3);
    assert_true(dph_scene_warn(scene, "%d\n%s", 7, "is a number"));
    assert_string_equal(scene->warning[0], "7?is a number");
    dph_scene_destroy(scene);
    dph_scene_destroy(NULL);
}

/* A body placed so often that its box stands for its vertices: the same answer where nothing turns.
 */
static void test_many_instances(void **state)
{
    (void)state;
    static const char json[] =
        "{\"asset\":{\"version\":\"2.0\"},\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}"
        "]}],\"nodes\":[{\"mesh\":0,\"translation\":[1,2,3],\"extensions\":{\"EXT_mesh_gpu_instancing\":{"
        "\"attributes\":{\"TRANSLATION\":1}}}}],\"accessors\":[{\"componentType\":5126,\"count\":99999,"
        "\"type\":\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":0,\"componentType\":5121},"
        "\"values\":{\"bufferView\":0,\"byteOffset\":4}}},{\"componentType\":5126,\"count\":999999,"
        "\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":16}],\"buffers\":[{"
        "\"byteLength\":16,\"uri\":\"data:;base64,AAAAAAAAgD8AAABAAABAQA==\"}]}";
    struct dph_scene *scene = load_text(".gltf", json);
    static const double high[3] = {2, 4, 6};
    assert_int_equal(scene->ninstance, 999999);
    for (int c = 0; c < 3; c++)
        assert_true(scene->bounds[0][c] == 1 + c && scene->bounds[1][c] == high[c]);
    dph_scene_destroy(scene);
}

/* A tetrahedron whose faces look inward, with normals that look outward, inward, and none. */
static void test_turning(void **state)
{
    (void)state;
    static const char *const normals[] = {
        "vn -1 -1 -1\nvn 1 0 0\nvn 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//3\nf 1//1 4//4 2//2\nf 1//1 "
        "3//3 4//4\nf 2//2 4//4 3//3\n",
        "vn 1 1 1\nvn -1 0 0\nvn 0 -1 0\nvn 0 0 -1\nf 1//1 2//2 3//3\nf 1//1 4//4 2//2\nf 1//1 "
        "3//3 4//4\nf 2//2 4//4 3//3\n",
        "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n"};
    for (int i = 0; i < 3; i++) {
        char text[512];
        snprintf(text, sizeof text, "v 10 10 10\nv 11 10 10\nv 10 11 10\nv 10 10 11\n%s",
                 normals[i]);
        struct dph_scene *scene = load_text(".obj", text);
        const struct dph_mesh *mesh = &scene->body->mesh;
        assert_true(fabs(volume(mesh) - 1. / 6) < 1e-5);
        assert_int_equal(scene->nwarning, 1);
        assert_non_null(strstr(scene->warning[0], "negative volume"));
        for (size_t t = 0; t < mesh->ntri;
             t++) /* every corner's normal looks away from the middle */
            for (int k = 0; k < 3; k++) {
                size_t v = mesh->index[3 * t + (size_t)k];
                double out = 0;
                for (int c = 0; c < 3; c++)
                    out += mesh->normal[3 * v + (size_t)c] *
                           (mesh->position[3 * v + (size_t)c] - 10.25);
                assert_true(out > 0);
            }
        dph_scene_destroy(scene);
    }
    /* the same with a face missing is not closed and stays as it is */
    struct dph_scene *scene =
        load_text(".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\n");
    assert_int_equal(scene->nwarning, 0);
    dph_scene_destroy(scene);
}

/* The file itself is never changed: turned in memory, written as it was, turned again. */
static void test_turned_document(void **state)
{
    (void)state;
    struct dph_scene *scene = load_text(".obj", obj);
    dph_mesh_flip(&scene->body->mesh);
    char file[80];
    snprintf(file, sizeof file, "/tmp/diaphan-scene-%ld-turned.glb", (long)getpid());
    assert_true(dph_scene_save(scene, file, NULL));
    dph_scene_destroy(scene);
    for (int round = 0; round < 2; round++) {
        scene = dph_scene_load(file, NULL);
        assert_non_null(scene);
        assert_int_equal(scene->nwarning, 1);
        assert_true(volume(&scene->body->mesh) > 0);
        assert_true(dph_scene_save(scene, file, NULL));
        dph_scene_destroy(scene);
    }
    unlink(file);
}

static void test_save_bare(void **state)
{
    (void)state;
    static const char *const endings[] = {".obj", ".ply", ".stl", ".glb"};
    for (int i = 0; i < 4; i++) {
        struct dph_scene *scene = load_text(".obj", obj);
        char file[80];
        snprintf(file, sizeof file, "/tmp/diaphan-scene-%ld-out%s", (long)getpid(), endings[i]);
        assert_true(dph_scene_save(scene, file, NULL));
        struct dph_scene *again = dph_scene_load(file, NULL);
        assert_non_null(again);
        assert_int_equal(again->body->mesh.ntri, 4);
        assert_true(fabs(volume(&again->body->mesh) - 1) < 1e-6);
        dph_scene_destroy(again);
        dph_scene_destroy(scene);
        unlink(file);
    }
}

/* Counts of MODELS.md for the formats of one body; glTF is in test_gltf.c. */
static void test_models(void **state)
{
    (void)state;
    static const struct {
        const char *file;
        size_t triangles, positions;
        double low[3], high[3];
    } models[] = {
        {"bunny_scan_open.obj", 69451, 35947, {-.09469, .03299, -.06187}, {.06101, .1873, .0588}},
        {"bunny_closed_lr.obj", 6598, 3301, {-.7757, -.7689, -.5971}, {.7762, .767, .5991}},
        {"lucy_100k.ply", 99970, 49987, {225.9, -388.4, -605.9}, {1156, 145.3, 991.3}},
        {"spot.obj", 23062, 11533, {-.4634, -.7302, -.6996}, {.4642, 1.017, 1.078}},
        {"head_lps.obj", 17684, 8844, {-21.01, -28.98, -21}, {22.05, 11.02, 5.08}},
        {"skull.obj", 100002, 49999, {-4.395, 0, -5.622}, {4.293, 13.9, 6.49}},
        {"bun_zipper.ply", 69451, 35947, {-.09469, .03299, -.06187}, {.06101, .1873, .0588}},
    };
    if (access(DPH_DATA "/models", R_OK)) {
        print_message("skipped: %s/models is missing\n", DPH_DATA);
        skip();
    }
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        char file[512];
        struct dph_error err = {0};
        struct dph_mesh_stats stats;
        snprintf(file, sizeof file, "%s/models/%s", DPH_DATA, models[i].file);
        struct dph_scene *scene = dph_scene_load(file, &err);
        if (!scene)
            fail_msg("%s", err.message);
        assert_int_equal(scene->body->mesh.ntri, models[i].triangles);
        assert_true(dph_mesh_measure(&scene->body->mesh, &stats, NULL));
        if (stats.positions > models[i].positions || stats.positions + 1200 < models[i].positions)
            fail_msg("%s: %zu positions", models[i].file,
                     stats.positions); /* the scans have unused vertices */
        assert_non_null(scene->body->mesh.normal);
        for (int c = 0; c < 3; c++) {
            double digits = 6e-4 * fmax(fabs(models[i].low[c]), fabs(models[i].high[c]));
            if (fabs(scene->bounds[0][c] - models[i].low[c]) > digits ||
                fabs(scene->bounds[1][c] - models[i].high[c]) > digits)
                fail_msg("%s: axis %d from %g to %g", models[i].file, c, scene->bounds[0][c],
                         scene->bounds[1][c]);
        }
        dph_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_formats),         cmocka_unit_test(test_body),
        cmocka_unit_test(test_turning),         cmocka_unit_test(test_many_instances),
        cmocka_unit_test(test_turned_document), cmocka_unit_test(test_save_bare),
        cmocka_unit_test(test_models),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
