/* The glTF reader: real models with known figures, and small files made here with known answers. */
#define _XOPEN_SOURCE 700
#include "gltf_maker.h"

#include <meshoptimizer.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

/* ---- real models ---- */

/* As MODELS.md says: what the default scene draws. Boxes are given there to four digits. */
static const struct model {
    const char *file;
    size_t triangles, vertices;
    double low[3], high[3];
} models[] = {
    {"GlassHurricaneCandleHolder.glb", 4126, 2386, {-.09517, 0, -.09517}, {.09517, .3066, .09517}},
    {"MosquitoInAmber/MosquitoInAmber.gltf",
     14349,
     18678,
     {-.0496, -.04854, -.05109},
     {.04764, .05113, .03683}},
    {"Suzanne/Suzanne.gltf", 3936, 11808, {-1.337, -.9746, -.8008}, {1.337, .9502, .8257}},
    {"ToyCar/ToyCar.gltf", 108936, 77429, {-.035, -.01621, -.03698}, {.03845, .01262, .03698}},
    {"CesiumMilkTruck.glb", 3624, 4823, {-1.396, .001452, -2.431}, {1.396, 2.584, 2.438}},
    {"Fox.glb", 576, 1728, {-12.59, -.1217, -88.1}, {12.59, 78.91, 66.62}},
    {"RiggedFigure.glb", 256, 370, {-.5895, -.195, 0}, {.5895, .1309, 1.45}},
    {"SimpleSparseAccessor.gltf", 12, 14, {0, 0, 0}, {6, 4, 0}},
    {"BoxInterleaved.glb", 12, 24, {-.5, -.5, -.5}, {.5, .5, .5}},
    {"NegativeScaleTest.glb", 7724, 3958, {-5.162, -4.454, -.5}, {5.162, 4.454, .5}},
    {"AvocadoQuantized/Avocado.gltf",
     682,
     406,
     {-.02128, -4.774e-05, -.01381},
     {.02128, .06285, .01381}},
    {"Avocado/Avocado.gltf", 682, 406, {-.02128, -4.774e-05, -.01381}, {.02128, .06285, .01381}},
    {"MorphPrimitivesTest.glb", 32, 30, {-.5, 0, -.5}, {.5, 0, .5}},
    {"AttenuationTest.glb", 292, 584, {-10, -10, -2}, {10, 10, 2}},
};

static void test_models(void **state)
{
    (void)state;
    if (access(DPH_DATA "/models", R_OK)) {
        print_message("skipped: %s/models is missing\n", DPH_DATA);
        skip();
    }
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        char path[512];
        struct dph_error err = {0};
        snprintf(path, sizeof path, "%s/models/%s", DPH_DATA, models[i].file);
        struct dph_scene *scene = dph_scene_load(path, &err);
        if (!scene)
            fail_msg("%s", err.message);
        size_t triangles = 0, vertices = 0;
        for (size_t k = 0; k < scene->ninstance; k++) {
            triangles += scene->body[scene->instance[k].body].mesh.ntri;
            vertices += scene->body[scene->instance[k].body].mesh.nvert;
        }
        assert_int_equal(triangles, models[i].triangles);
        assert_int_equal(vertices, models[i].vertices);
        for (int c = 0; c < 3; c++) {
            double digits = 6e-4 * fmax(fabs(models[i].low[c]), fabs(models[i].high[c]));
            if (fabs(scene->bounds[0][c] - models[i].low[c]) > digits ||
                fabs(scene->bounds[1][c] - models[i].high[c]) > digits)
                fail_msg("%s: axis %d from %g to %g", models[i].file, c, scene->bounds[0][c],
                         scene->bounds[1][c]);
        }
        dph_scene_destroy(scene);
    }
    struct dph_error err = {0};
    assert_null(dph_scene_load(DPH_DATA "/models/AvocadoDraco/Avocado.gltf", &err));
    assert_int_equal(err.code, DPH_ERROR_UNSUPPORTED);
    assert_non_null(strstr(err.message, "KHR_draco_mesh_compression"));
}

/* ---- made here ---- */

static struct dph_scene *must_load(const char *json, const void *bin, size_t size)
{
    struct dph_error err = {0};
    struct dph_scene *scene = maker_load(json, bin, size, &err);
    if (!scene)
        fail_msg("%s", err.message);
    return scene;
}

static void expect_index(const struct dph_scene *scene, const uint32_t *index, size_t ntri)
{
    assert_int_equal(scene->nbody, 1);
    assert_int_equal(scene->body->mesh.ntri, ntri);
    for (size_t i = 0; i < 3 * ntri; i++)
        assert_int_equal(scene->body->mesh.index[i], index[i]);
}

static void test_tetra(void **state)
{
    (void)state;
    struct dph_scene *scene = must_load(maker_tetra_json, &maker_tetra, sizeof maker_tetra);
    uint32_t index[12];
    for (int i = 0; i < 12; i++)
        index[i] = maker_tetra.wide[i];
    expect_index(scene, index, 4);
    assert_string_equal(scene->body->name, "tetra");
    assert_memory_equal(scene->body->mesh.position, maker_tetra.position, 48);
    assert_null(scene->body->mesh.normal);
    assert_int_equal(scene->ninstance, 2);
    assert_true(scene->instance[1].matrix[12] == 1 && scene->instance[1].matrix[13] == 2 &&
                scene->instance[1].matrix[14] == 3);

    const struct dph_thickness *t = scene->body->thickness;
    assert_non_null(t);
    assert_int_equal(t->bands, 2);
    assert_int_equal(t->components, 4);
    assert_int_equal(t->store, DPH_STORE_SNORM8);
    assert_int_equal(t->directions, 64);
    assert_true(t->scale[0] == 1 && t->scale[1] == .5f && scene->mm_per_unit == 2);
    assert_memory_equal(t->data, maker_tetra.thickness, 16);
    float row[4];
    dph_thickness_row(t, 3, row);
    assert_true(fabs(row[0] - 100. / 127) < 1e-6 && fabs(row[1] + .5 * 100 / 127) < 1e-6);
    dph_scene_destroy(scene);
}

/* Strips, fans and unindexed triangles over five vertices. */
static void test_modes(void **state)
{
    (void)state;
    static const float position[6][3] = {{0, 0, 0}, {1, 0, 0},  {1, 1, 0},
                                         {0, 1, 0}, {-1, 1, 1}, {5, 5, 5}};
    static const struct {
        const char *mode;
        size_t ntri;
        uint32_t index[12];
    } cases[] = {
        {"", 2, {0, 1, 2, 3, 4, 5}},
        {"'mode':5,", 4, {0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4}},
        {"'mode':6,", 4, {1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5, 0}},
    };
    for (int i = 0; i < 3; i++) {
        /* points and lines beside it do not count */
        char *json = maker_json(
            "{'asset':{'version':'2.0'},'meshes':[{'primitives':[{'mode':0,'attributes':{"
            "'POSITION':0}},{MODE'attributes':{'POSITION':0}},{'mode':3,'attributes':{"
            "'POSITION':0}}]}],'nodes':[{'mesh':0}],'accessors':[{'bufferView':0,"
            "'componentType':5126,'count':6,'type':'VEC3'}],'bufferViews':[{'buffer':0,"
            "'byteLength':72}],'buffers':[{'byteLength':72}]}",
            "MODE", cases[i].mode);
        struct dph_scene *scene = must_load(json, position, sizeof position);
        expect_index(scene, cases[i].index, cases[i].ntri);
        assert_int_equal(scene->body->mesh.nvert, 6);
        dph_scene_destroy(scene);
        free(json);
    }
}

/* One file with interleaved rows: SHORT positions (plain), normalized BYTE normals, normalized
 * UNSIGNED_SHORT texture coordinates, and UNSIGNED_BYTE indices in two primitives that share all
 * attributes. */
static void test_quantized(void **state)
{
    (void)state;
    struct row {
        int16_t position[3], pad;
        int8_t normal[4];
        uint16_t texcoord[2];
    };
    static const struct {
        struct row row[3];
        uint8_t index[8];
    } bin = {{{{-3, 7, 32767}, 0, {0, 0, 127, 0}, {0, 65535}},
              {{4, 0, 0}, 0, {0, -128, 0, 0}, {32768, 1}},
              {{0, 5, -1}, 0, {90, 90, 0, 0}, {13107, 26214}}}, {0, 1, 2, 0, 0, 2, 1, 0}};
    _Static_assert(sizeof(struct row) == 16, "interleaved rows");
    struct dph_scene *scene = must_load(
        "{'asset':{'version':'2.0'},'extensionsRequired':['KHR_mesh_quantization','KHR_texture_basisu'],"
        "'extensionsUsed':['KHR_mesh_quantization'],'meshes':[{'primitives':[{'attributes':{'POSITION':0,"
        "'NORMAL':1,'TEXCOORD_0':2},'indices':3},{'attributes':{'POSITION':0,'NORMAL':1,'TEXCOORD_0':2},"
        "'indices':4}]}],'nodes':[{'mesh':0}],"
        "'accessors':[{'bufferView':0,'componentType':5122,'count':3,'type':'VEC3'},"
        "{'bufferView':0,'byteOffset':8,'componentType':5120,'normalized':true,'count':3,'type':'VEC3'},"
        "{'bufferView':0,'byteOffset':12,'componentType':5123,'normalized':true,'count':3,'type':'VEC2'},"
        "{'bufferView':1,'componentType':5121,'count':3,'type':'SCALAR'},"
        "{'bufferView':1,'byteOffset':4,'componentType':5121,'count':3,'type':'SCALAR'}],"
        "'bufferViews':[{'buffer':0,'byteLength':48,'byteStride':16},{'buffer':0,'byteOffset':48,'byteLength':8}],"
        "'buffers':[{'byteLength':56}]}",
        &bin, sizeof bin);
    const struct dph_mesh *mesh = &scene->body->mesh;
    static const uint32_t index[6] = {0, 1, 2, 3, 5, 4};
    expect_index(scene, index, 2);
    assert_int_equal(mesh->nvert, 6); /* rows of a primitive are its own */
    for (int copy = 0; copy < 2; copy++) {
        const float *p = mesh->position + 9 * copy, *n = mesh->normal + 9 * copy,
                    *t = mesh->texcoord + 6 * copy;
        assert_true(p[0] == -3 && p[1] == 7 && p[2] == 32767 && p[3] == 4 && p[7] == 5 &&
                    p[8] == -1);
        assert_true(n[2] == 1 && n[4] == -1 && fabs(n[6] - sqrt(.5)) < 1e-6);
        assert_true(t[0] == 0 && t[1] == 1 && fabs(t[2] - 32768. / 65535) < 1e-6 &&
                    fabs(t[4] - .2) < 1e-6);
    }
    dph_scene_destroy(scene);
}

/* A sparse accessor with and without a view below it. */
static void test_sparse(void **state)
{
    (void)state;
    static const struct {
        float base[3][3], value[2][3];
        uint16_t index[2];
    } bin = {{{1, 1, 1}, {2, 2, 2}, {3, 3, 3}}, {{4, 5, 6}, {7, 8, 9}}, {0, 2}};
    static const float with[9] = {4, 5, 6, 2, 2, 2, 7, 8, 9},
                       without[9] = {4, 5, 6, 0, 0, 0, 7, 8, 9};
    for (int i = 0; i < 2; i++) {
        char *json = maker_json(
            "{'asset':{'version':'2.0'},'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],"
            "'nodes':[{'mesh':0}],'accessors':[{BASE'componentType':5126,'count':3,'type':'VEC3','sparse':{'count':2,"
            "'indices':{'bufferView':1,'byteOffset':24,'componentType':5123},'values':{'bufferView':1}}}],"
            "'bufferViews':[{'buffer':0,'byteLength':36},{'buffer':0,'byteOffset':36,'byteLength':28}],"
            "'buffers':[{'byteLength':64}]}",
            "BASE", i ? "" : "'bufferView':0,");
        struct dph_scene *scene = must_load(json, &bin, sizeof bin);
        assert_memory_equal(scene->body->mesh.position, i ? without : with, 36);
        dph_scene_destroy(scene);
        free(json);
    }
}

/* A grid, compressed by the library's own encoders. */
static void test_meshopt(void **state)
{
    (void)state;
    enum { SIDE = 20, NVERT = SIDE * SIDE, NINDEX = 6 * (SIDE - 1) * (SIDE - 1) };
    static float position[NVERT][3], normal[NVERT][4];
    static uint32_t index[NINDEX];
    static unsigned char bin[65536];
    size_t n = 0;
    for (int v = 0; v < NVERT; v++) {
        float *p = position[v];
        p[0] = (float)(v % SIDE);
        p[1] = (float)(v / SIDE);
        p[2] = (float)((v * 7) % 5) / 4;
        normal[v][0] = (float)sin(v);
        normal[v][2] = (float)cos(v);
    }
    for (uint32_t y = 0; y + 1 < SIDE; y++)
        for (uint32_t x = 0; x + 1 < SIDE; x++) {
            const uint32_t a = y * SIDE + x,
                           quad[6] = {a, a + 1, a + SIDE, a + SIDE, a + 1, a + SIDE + 1};
            memcpy(index + n, quad, sizeof quad);
            n += 6;
        }
    static int8_t oct[NVERT][4];
    static uint32_t exponent[NVERT][3];
    meshopt_encodeFilterOct(oct, NVERT, 4, 8, &normal[0][0]);
    meshopt_encodeFilterExp(exponent, NVERT, 12, 16, &position[0][0]);

    for (int variant = 0; variant < 4; variant++) {
        bool sequence = variant & 1, filtered = variant & 2;
        meshopt_encodeIndexVersion(1);
        size_t a =
            meshopt_encodeVertexBuffer(bin, sizeof bin,
                                       filtered ? (void *)exponent : (void *)position, NVERT, 12);
        size_t b = meshopt_encodeVertexBuffer(bin + a, sizeof bin - a, oct, NVERT, 4);
        size_t c = sequence
                       ? meshopt_encodeIndexSequence(bin + a + b, sizeof bin - a - b, index, NINDEX)
                       : meshopt_encodeIndexBuffer(bin + a + b, sizeof bin - a - b, index, NINDEX);
        assert_true(a && b && c);
        char json[4096];
        snprintf(
            json, sizeof json,
            "{'asset':{'version':'2.0'},'extensionsRequired':['EXT_meshopt_compression'],'meshes':[{'primitives':[{"
            "'attributes':{'POSITION':0,'NORMAL':1},'indices':2}]}],'nodes':[{'mesh':0}],'accessors':[{'bufferView':0,"
            "'componentType':5126,'count':%d,'type':'VEC3'},{'bufferView':1,'componentType':5120,'normalized':true,"
            "'count':%d,'type':'VEC3'},{'bufferView':2,'componentType':%d,'count':%d,'type':'SCALAR'}],'bufferViews':["
            "{'buffer':1,'byteLength':%d,'byteStride':12,'extensions':{'EXT_meshopt_compression':{'buffer':0,"
            "'byteLength':%zu,'byteStride':12,'count':%d,'mode':'ATTRIBUTES','filter':'%s'}}},"
            "{'buffer':1,'byteLength':%d,'byteStride':4,'extensions':{'EXT_meshopt_compression':{'buffer':0,"
            "'byteOffset':%zu,'byteLength':%zu,'byteStride':4,'count':%d,'mode':'ATTRIBUTES','filter':'OCTAHEDRAL'}}},"
            "{'buffer':1,'byteLength':%d,'extensions':{'%s_meshopt_compression':{'buffer':0,"
            "'byteOffset':%zu,'byteLength':%zu,'byteStride':%d,'count':%d,'mode':'%s'}}}],"
            "'buffers':[{'byteLength':%zu},{'byteLength':99999,'extensions':{'EXT_meshopt_compression':{'fallback':true}}}]}",
            NVERT, NVERT, sequence ? 5125 : 5123, NINDEX, NVERT * 12, a, NVERT,
            filtered ? "EXPONENTIAL" : "NONE", NVERT * 4, a, b, NVERT, NINDEX * (sequence ? 4 : 2),
            sequence ? "KHR" : "EXT", a + b, c, sequence ? 4 : 2, NINDEX,
            sequence ? "INDICES" : "TRIANGLES", a + b + c);
        struct dph_scene *scene = must_load(json, bin, a + b + c);
        const struct dph_mesh *mesh = &scene->body->mesh;
        assert_int_equal(mesh->nvert, NVERT);
        assert_int_equal(mesh->ntri, NINDEX / 3);
        assert_memory_equal(mesh->position, position,
                            sizeof position); /* 16 bits hold these exactly */
        for (int v = 0; v < NVERT; v++)
            for (int k = 0; k < 3; k++)
                assert_true(fabs(mesh->normal[3 * v + k] - normal[v][k]) < .02);
        /* the triangle codec may turn a triangle, but not over */
        for (size_t t = 0; t < NINDEX / 3; t++) {
            const uint32_t *is = mesh->index + 3 * t, *was = index + 3 * t;
            int turn = is[0] == was[0] ? 0 : is[0] == was[1] ? 1 : 2;
            for (int k = 0; k < 3; k++)
                assert_int_equal(is[k], was[(k + turn) % 3]);
        }
        dph_scene_destroy(scene);

        if (!sequence && !filtered) { /* damage: refused or read, never more */
            for (size_t i = 0; i < a + b + c; i += 3) {
                bin[i] ^= 0xff;
                dph_scene_destroy(maker_load(json, bin, a + b + c, NULL));
                bin[i] ^= 0xff;
            }
            bin[0] |= 1; /* a version that 0.18 does not know */
            struct dph_error err = {0};
            assert_null(maker_load(json, bin, a + b + c, &err));
            assert_int_equal(err.code, DPH_ERROR_UNSUPPORTED);
        }
    }
}

/* A codec version that is not known is refused, unless the uncompressed copy is in the file. */
static void test_fallback(void **state)
{
    (void)state;
    char *json = maker_json(
        maker_tetra_json, "'byteOffset':0,'byteLength':48",
        "'byteLength':48,'extensions':{'KHR_meshopt_compression':{'buffer':0,'byteOffset':96,"
        "'byteLength':4,'byteStride':12,'count':4,'mode':'ATTRIBUTES'}}");
    struct maker_tetra bin = maker_tetra;
    bin.thickness[3][0] = (int8_t)0xa1;
    struct dph_scene *scene = must_load(json, &bin, sizeof bin);
    assert_memory_equal(scene->body->mesh.position, bin.position, 48);
    dph_scene_destroy(scene);
    free(json);
}

/* Transforms: a quarter turn about z, a scale and a matrix above; skins and
 * EXT_mesh_gpu_instancing. */
static void test_nodes(void **state)
{
    (void)state;
    static const struct {
        float position[3][3], offset[2][3], scale[2][3];
    } bin = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{10, 0, 0}, {0, 20, 0}}, {{2, 2, 2}, {1, 1, 5}}};
    static const char json[] =
        "{'asset':{'version':'2.0'},'scene':1,'scenes':[{'nodes':[5]},{'nodes':[0,3,4]}],'nodes':["
        "{'matrix':[2,0,0,0, 0,2,0,0, 0,0,2,0, 1,1,1,1],'children':[2,1]},"
        "{'rotation':[0,0,0.7071067811865476,0.7071067811865476],'translation':[0,0,5],'scale':[1,3,1],'mesh':0},"
        "{'mesh':0},{'mesh':0,'skin':0,'translation':[100,100,100]},"
        "{'mesh':0,'translation':[0,0,1],'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':1,'SCALE':2}}}},"
        "{'mesh':0,'scale':[9,9,9]}],"
        "'skins':[{'joints':[1]}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],'accessors':["
        "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},{'bufferView':0,'byteOffset':36,'componentType':5126,"
        "'count':2,'type':'VEC3'},{'bufferView':0,'byteOffset':60,'componentType':5126,'count':2,'type':'VEC3'}],"
        "'bufferViews':[{'buffer':0,'byteLength':84}],'buffers':[{'byteLength':84}]}";
    static const float expected[5][16] = {
        {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 1, 1,
         1}, /* node 2 comes first, as its parent lists it */
        {0, 2, 0, 0, -6, 0, 0, 0, 0, 0, 2, 0, 1, 1, 11, 1},
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
        {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 10, 0, 1, 1},
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 5, 0, 0, 20, 1, 1},
    };
    struct dph_scene *scene = must_load(json, &bin, sizeof bin);
    assert_int_equal(scene->ninstance, 5);
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 16; k++)
            if (fabs(scene->instance[i].matrix[k] - expected[i][k]) > 1e-5)
                fail_msg("instance %d, element %d: %g", i, k, scene->instance[i].matrix[k]);
    dph_scene_destroy(scene);

    /* without "scene" the first one counts, without scenes every root */
    char *first = maker_json(json, "'scene':1,", "");
    scene = must_load(first, &bin, sizeof bin);
    assert_int_equal(scene->ninstance, 1);
    assert_true(scene->instance->matrix[0] == 9);
    dph_scene_destroy(scene);
    free(first);
    char *none = maker_json(json, "'scene':1,'scenes':[{'nodes':[5]},{'nodes':[0,3,4]}],", "");
    scene = must_load(none, &bin, sizeof bin);
    assert_int_equal(scene->ninstance, 6);
    dph_scene_destroy(scene);
    free(none);
    /* a file that draws nothing: every mesh as it is, with a warning */
    char *nothing =
        maker_json(json, "'scene':1,'scenes':[{'nodes':[5]},{'nodes':[0,3,4]}]", "'scenes':[{}]");
    scene = must_load(nothing, &bin, sizeof bin);
    assert_int_equal(scene->ninstance, 1);
    assert_int_equal(scene->nwarning, 1);
    dph_scene_destroy(scene);
    free(nothing);
}

/* Thickness as tools leave it: lower-case names, one attribute turned into floats. */
static void test_thickness_of_tools(void **state)
{
    (void)state;
    char *lower = maker_json(maker_tetra_json, "'_THICKNESS_SH_0'", "'_thickness_sh_0'");
    struct dph_scene *scene = must_load(lower, &maker_tetra, sizeof maker_tetra);
    assert_memory_equal(scene->body->thickness->data, maker_tetra.thickness, 16);
    dph_scene_destroy(scene);
    free(lower);
    /* floats: the scales are taken into the values; here the positions' bytes (and 16 bytes more)
     * serve as floats */
    char *floats = maker_json(
        maker_tetra_json,
        "{'bufferView':2,'componentType':5120,'normalized':true,'count':4,'type':'VEC4'}",
        "{'bufferView':2,'componentType':5126,'count':4,'type':'VEC4'}");
    char *json = maker_json(floats, "{\"buffer\":0,\"byteOffset\":84,\"byteLength\":16}",
                            "{'buffer':0,'byteLength':64}");
    struct maker_tetra bin = maker_tetra;
    memcpy(bin.wide, maker_tetra.position, 16); /* the fourth row; no longer valid indices */
    memset(bin.wide, 0, sizeof bin.wide);
    scene = must_load(json, &bin, sizeof bin);
    const struct dph_thickness *t = scene->body->thickness;
    assert_int_equal(t->store, DPH_STORE_FLOAT);
    const float *value = t->data, *stored = &maker_tetra.position[0][0];
    for (int i = 0; i < 12; i++)
        assert_true(value[i] == stored[i] * (i % 4 ? .5f : 1));
    assert_true(t->scale[0] == 1 && t->scale[1] == 1);
    dph_scene_destroy(scene);
    free(floats);
    free(json);
}

/* A .gltf with a data URI, and with a file whose name has a blank, in a folder above. */
static void test_files(void **state)
{
    (void)state;
    char folder[] = "/tmp/diaphan-gltf-XXXXXX", path[600];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a b.bin", folder);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fwrite(&maker_tetra, sizeof maker_tetra, 1, file);
    fclose(file);
    snprintf(path, sizeof path, "%s/sub", folder);
    assert_int_equal(mkdir(path, 0700), 0);
    static const char *const uri[] = {"../a%20b.bin", "../a b.bin", "../a%2", "http://x/a.bin"};
    for (int i = 0; i < 4; i++) {
        char buffer[200];
        snprintf(buffer, sizeof buffer, "{'byteLength':100,'uri':'%s'}", uri[i]);
        char *json = maker_json(maker_tetra_json, "{'byteLength':100}", buffer);
        snprintf(path, sizeof path, "%s/sub/model.gltf", folder);
        file = fopen(path, "wb");
        fputs(json, file);
        fclose(file);
        free(json);
        struct dph_error err = {0};
        struct dph_scene *scene = dph_scene_load(path, &err);
        if ((scene != NULL) != (i < 2))
            fail_msg("%s: %s", uri[i], err.message);
        if (scene)
            assert_memory_equal(scene->body->mesh.position, maker_tetra.position, 48);
        dph_scene_destroy(scene);
    }
    unlink(path);
    snprintf(path, sizeof path, "%s/sub", folder);
    rmdir(path);
    snprintf(path, sizeof path, "%s/a b.bin", folder);
    unlink(path);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_models),   cmocka_unit_test(test_tetra),
        cmocka_unit_test(test_modes),    cmocka_unit_test(test_quantized),
        cmocka_unit_test(test_sparse),   cmocka_unit_test(test_meshopt),
        cmocka_unit_test(test_fallback),
        cmocka_unit_test(test_nodes),    cmocka_unit_test(test_thickness_of_tools),
        cmocka_unit_test(test_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
