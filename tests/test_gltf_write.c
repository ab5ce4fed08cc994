/* The glTF writer: nothing of a document is lost, what is added reads back, a second bake replaces
 * the first. */
#define _XOPEN_SOURCE 700
#include "fabricate.h"
#include "folder.h"
#include "gltf_maker.h"
#include "mesh/gltf.h"

#include <ftw.h>
#include <setjmp.h>
#include <stdarg.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static void put_file(const char *name, const void *data, size_t size)
{
    FILE *file = fopen(in_folder(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
}

static struct dph_scene *must_load(const char *path)
{
    struct dph_error err = {0};
    struct dph_scene *scene = dph_scene_load(path, &err);
    if (!scene)
        fail_msg("%s", err.message);
    return scene;
}

static void must_save(const struct dph_scene *scene, const char *path)
{
    struct dph_error err = {0};
    if (!dph_scene_save(scene, path, &err))
        fail_msg("%s", err.message);
}

static struct dph_file must_read(const char *path)
{
    struct dph_file file;
    assert_true(dph_file_load(&file, path, (size_t)1 << 30, NULL));
    return file;
}

/* ---- comparing documents ---- */

/* Equal in content, in the order of keys and in the form of numbers. */
static void expect_same(json_t *a, json_t *b, const char *what)
{
    if (!a && !b)
        return;
    if (!a || !b)
        fail_msg("%s: only in the %s", what, a ? "input" : "output");
    char *one = json_dumps(a, JSON_COMPACT | JSON_ENCODE_ANY),
         *two = json_dumps(b, JSON_COMPACT | JSON_ENCODE_ANY);
    if (strcmp(one, two))
        fail_msg("%s: %.300s is now %.300s", what, one, two);
    free(one);
    free(two);
}

static json_t *without(json_t *object, const char *const *keys)
{
    json_t *copy = json_copy(object);
    for (; *keys; keys++)
        json_object_del(copy, *keys);
    return copy;
}

static void expect_same_without(json_t *a, json_t *b, const char *const *keys, const char *what)
{
    json_t *one = without(a, keys), *two = without(b, keys);
    expect_same(one, two, what);
    json_decref(one);
    json_decref(two);
}

static void compare_primitive(json_t *a, json_t *b)
{
    static const char *const touched[] = {"attributes", "extras", NULL}, *const ours[] = {"diaphan",
                                                                                          NULL};
    expect_same_without(a, b, touched, "primitive");
    json_t *now = json_copy(json_object_get(b, "attributes"));
    const char *key;
    json_t *value;
    void *next;
    json_object_foreach_safe(now, next, key, value)
        if (!strncmp(key, "_THICKNESS_SH_", 14))
            json_object_del(now, key);
    json_t *was = json_copy(json_object_get(a, "attributes"));
    json_object_foreach_safe(was, next, key, value)
        if (!strncmp(key, "_THICKNESS_SH_", 14))
            json_object_del(was, key);
    expect_same(was, now, "attributes");
    json_decref(now);
    json_decref(was);
    json_t *extras = json_object_get(a, "extras");
    if (json_is_object(extras))
        expect_same_without(extras, json_object_get(b, "extras"), ours, "extras");
}

static void compare_documents(const char *input, const char *output)
{
    static const char *const lists[] = {"meshes",  "accessors", "bufferViews",
                                        "buffers", "images",    NULL};
    static const char *const place[] = {"buffer", "byteOffset", NULL}, *const link[] = {
                                                                           "uri", "bufferView",
                                                                           "mimeType", NULL};
    struct dph_file one = must_read(input), two = must_read(output);
    struct dph_document *a = dph_gltf_document_create(&one, input, NULL);
    struct dph_document *b = dph_gltf_document_create(&two, output, NULL);
    assert_true(a && b);
    expect_same_without(a->root, b->root, lists, "root");
    size_t i, k;
    json_t *value, *primitive;
    json_array_foreach(json_object_get(a->root, "meshes"), i, value) {
        static const char *const primitives[] = {"primitives", NULL};
        json_t *now = json_array_get(json_object_get(b->root, "meshes"), i);
        expect_same_without(value, now, primitives, "mesh");
        json_array_foreach(json_object_get(value, "primitives"), k, primitive)
            compare_primitive(primitive, json_array_get(json_object_get(now, "primitives"), k));
    }
    json_array_foreach(json_object_get(a->root, "accessors"), i, value)
        expect_same(value, json_array_get(json_object_get(b->root, "accessors"), i), "accessor");
    json_array_foreach(json_object_get(a->root, "bufferViews"), i, value) {
        struct dph_gltf_view was, now;
        expect_same_without(value, json_array_get(json_object_get(b->root, "bufferViews"), i),
                            place, "view");
        if (!dph_gltf_view(a, i, "", &was, NULL))
            continue; /* its buffer is missing */
        assert_true(dph_gltf_view(b, i, "", &now, NULL));
        assert_int_equal(was.size, now.size);
        assert_memory_equal(was.data, now.data, was.size);
    }
    json_array_foreach(json_object_get(a->root, "images"), i, value) {
        json_t *now = json_array_get(json_object_get(b->root, "images"), i);
        if (json_equal(value, now))
            continue;
        struct dph_file image;
        struct dph_gltf_view view;
        expect_same_without(value, now, link, "image");
        assert_true(
            dph_gltf_external(a, json_string_value(json_object_get(value, "uri")), &image, NULL));
        assert_true(dph_gltf_view(b, (size_t)json_integer_value(json_object_get(now, "bufferView")),
                                  "", &view, NULL));
        assert_int_equal(view.size, image.size);
        assert_memory_equal(view.data, image.data, view.size);
        dph_file_finish(&image);
    }
    dph_document_destroy(a);
    dph_document_destroy(b);
    dph_file_finish(&one);
    dph_file_finish(&two);
}

static void compare_scenes(const struct dph_scene *a, const struct dph_scene *b)
{
    assert_int_equal(a->nbody, b->nbody);
    assert_int_equal(a->ninstance, b->ninstance);
    assert_memory_equal(a->instance, b->instance, a->ninstance * sizeof *a->instance);
    if (a->mm_per_unit != b->mm_per_unit)
        fail_msg("mm_per_unit %.17g is now %.17g", a->mm_per_unit, b->mm_per_unit);
    for (size_t i = 0; i < a->nbody; i++) {
        const struct dph_mesh *m = &a->body[i].mesh, *n = &b->body[i].mesh;
        const struct dph_thickness *t = a->body[i].thickness, *u = b->body[i].thickness;
        assert_string_equal(a->body[i].name, b->body[i].name);
        assert_int_equal(m->nvert, n->nvert);
        assert_int_equal(m->ntri, n->ntri);
        assert_memory_equal(m->position, n->position, m->nvert * 12);
        assert_memory_equal(m->index, n->index, m->ntri * 12);
        assert_true(!m->normal == !n->normal);
        assert_true((t != NULL) == (u != NULL));
        if (!t)
            continue;
        assert_true(t->bands == u->bands && t->components == u->components &&
                    t->store == u->store && t->definition == u->definition && t->fit == u->fit &&
                    t->directions == u->directions);
        assert_memory_equal(t->scale, u->scale, (size_t)t->bands * sizeof *t->scale);
        assert_memory_equal(t->data, u->data,
                            t->nvert * (size_t)t->components * dph_store_size(t->store));
    }
}

/* ---- tests ---- */

static int visited;

static int visit(const char *path, const struct stat *info, int type, struct FTW *where)
{
    (void)where;
    (void)info;
    const char *dot = strrchr(path, '.');
    if (type != FTW_F || !dot || (strcmp(dot, ".glb") && strcmp(dot, ".gltf")) ||
        strstr(path, "Draco"))
        return 0;
    visited++;
    static const struct {
        int bands;
        enum dph_store store;
    } forms[] = {{6, DPH_STORE_SNORM8}, {5, DPH_STORE_SNORM16}, {8, DPH_STORE_FLOAT}};
    for (int i = 0; i < 3; i++) {
        struct dph_scene *scene = must_load(path);
        assert_true(fabricate_thickness(scene, forms[i].bands, forms[i].store));
        must_save(scene, in_folder("out.glb"));
        struct dph_scene *again = must_load(in_folder("out.glb"));
        compare_scenes(scene, again);
        compare_documents(path, in_folder("out.glb"));
        if (i == 0) { /* the same bake on top of itself changes no byte, a smaller one shrinks the
                         file */
            struct dph_file one = must_read(in_folder("out.glb"));
            assert_true(fabricate_thickness(again, forms[i].bands, forms[i].store));
            must_save(again, in_folder("again.glb"));
            struct dph_file two = must_read(in_folder("again.glb"));
            if (one.size != two.size || memcmp(one.data, two.data, one.size))
                fail_msg("%s: baked again it has %zu bytes instead of %zu, or others", path,
                         two.size, one.size);
            dph_scene_destroy(again);
            again = must_load(in_folder("again.glb"));
            assert_true(fabricate_thickness(again, 2, DPH_STORE_SNORM8));
            must_save(again, in_folder("small.glb"));
            dph_scene_destroy(again);
            again = must_load(in_folder("small.glb"));
            assert_int_equal(again->body->thickness->bands, 2);
            compare_documents(path, in_folder("small.glb"));
            dph_file_finish(&two);
            two = must_read(in_folder("small.glb"));
            assert_true(two.size < one.size);
            dph_file_finish(&one);
            dph_file_finish(&two);
        }
        dph_scene_destroy(scene);
        dph_scene_destroy(again);
    }
    return 0;
}

static void test_models(void **state)
{
    (void)state;
    if (nftw(DPH_DATA "/models", visit, 8, FTW_PHYS) || !visited) {
        print_message("skipped: no models in %s/models\n", DPH_DATA);
        skip();
    }
}

/* A document with all that is awkward: several buffers, one missing, images there and not there,
 * extras of every kind, extensions that nobody knows, vertices shared by primitives. */
static const char awkward[] =
    "{'zeta':{'kept':[1.0,1,1e-300,0.1,-0.0,12345678901234567,true,null,'\\u00e9\\u0001\\\\\\/"
    "']},'asset':{'version':'2.0'},"
    "'extensionsUsed':['ACME_thing'],'nodes':[{'mesh':0,'extras':3}],"
    "'meshes':[{'name':'a','extras':'mesh','primitives':["
    "{'attributes':{'POSITION':0,'_TEMPERATURE':4},'indices':1,'extras':'text','extensions':{'ACME_"
    "thing':{'x':[]}}},"
    "{'attributes':{'POSITION':0},'indices':1,'extras':{'b':1,'diaphan':{'other':2},'a':2}},"
    "{'attributes':{'POSITION':2},'indices':3,'extras':{'diaphan':[5]}},{'mode':0,'attributes':{'"
    "POSITION':0}}]}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3','min':[0,0,0],'max':"
    "[1,2,3]},"
    "{'bufferView':1,'componentType':5123,'count':12,'type':'SCALAR'},"
    "{'bufferView':2,'componentType':5126,'count':4,'type':'VEC3','min':[0,0,0],'max':[1,2,3]},"
    "{'bufferView':3,'componentType':5121,'count':12,'type':'SCALAR'},"
    "{'bufferView':4,'componentType':5126,'count':4,'type':'SCALAR'}],"
    "'bufferViews':[{'buffer':1,'byteLength':48},{'buffer':1,'byteOffset':48,'byteLength':24},"
    "{'buffer':BUF,'byteOffset':0,'byteLength':48},{'buffer':BUF,'byteOffset':72,'byteLength':12},"
    "{'buffer':0,'byteLength':16},{'buffer':3,'byteLength':8}],"
    "'buffers':[FIRST,{'byteLength':100,'uri':'b.bin','name':'B'},{'byteLength':100,'uri':'c%20c."
    "bin'},"
    "{'byteLength':8,'uri':'data:application/octet-stream;base64,AAECAwQFBgc='}],"
    "'images':[{'uri':'p.png'},{'uri':'missing.png'},{'uri':'text.png','name':'no "
    "image'},{'uri':'p.png','name':'twice'},"
    "{'bufferView':5,'mimeType':'image/png'},{'uri':'data:image/"
    "png;base64,iVBORw0KGgo='}],'alpha':0}";

static void test_awkward(void **state)
{
    (void)state;
    put_file("b.bin", &maker_tetra, sizeof maker_tetra);
    put_file("c c.bin", &maker_tetra, sizeof maker_tetra);
    put_file("a.bin", "0123456789abcdefXY",
             18); /* four odd floats; two bytes more than are declared */
    put_file("p.png", "\x89PNG\r\n\x1a\nnot really", 18);
    put_file("text.png", "hello", 5);
    static const char *const first[] = {
        "{'byteLength':16,'uri':'a.bin'}",
        "{'byteLength':16,'uri':'data:;base64,AAAAAAAAAAAAAAAAAAAAAA=='}",
        "{'byteLength':16,'uri':'not-there.bin','extras':[1]}", "{'byteLength':16}"};
    for (int i = 0; i < 4; i++) {
        char *one = maker_json(awkward, "BUF", "2"), *two = maker_json(one, "BUF", "2");
        char *json = maker_json(two, "FIRST", first[i]);
        put_file("in.gltf", json, strlen(json));
        struct dph_scene *scene = must_load(in_folder("in.gltf"));
        assert_int_equal(scene->body->mesh.nvert, 12);
        assert_true(fabricate_thickness(scene, 6, DPH_STORE_SNORM8));
        must_save(scene, in_folder("out.glb"));
        struct dph_scene *again = must_load(in_folder("out.glb"));
        compare_scenes(scene, again);
        compare_documents(in_folder("in.gltf"), in_folder("out.glb"));

        const json_t *root = again->document->root;
        const json_t *buffers = json_object_get(root, "buffers");
        assert_int_equal(json_array_size(buffers), i < 2 ? 4 : 5);
        assert_null(json_object_get(json_array_get(buffers, 0), "uri"));
        assert_int_equal(again->document->buffer[0].source, DPH_GLTF_BIN);
        if (i == 2) /* what could not be read is still named */
            assert_string_equal(json_string_value(
                                    json_object_get(json_array_get(buffers, 1), "uri")),
                                "not-there.bin");
        /* pictures: two of one file share a view, text is no picture */
        const json_t *images = json_object_get(root, "images");
        assert_true(json_equal(json_object_get(json_array_get(images, 0), "bufferView"),
                               json_object_get(json_array_get(images, 3), "bufferView")));
        assert_string_equal(json_string_value(
                                json_object_get(json_array_get(images, 0), "mimeType")),
                            "image/png");
        assert_string_equal(json_string_value(json_object_get(json_array_get(images, 1), "uri")),
                            "missing.png");
        assert_string_equal(json_string_value(json_object_get(json_array_get(images, 2), "uri")),
                            "text.png");
        /* extras */
        const json_t *primitives =
            json_object_get(json_array_get(json_object_get(root, "meshes"), 0), "primitives");
        json_t *extras[4];
        for (size_t p = 0; p < 4; p++)
            extras[p] = json_object_get(json_array_get(primitives, p), "extras");
        assert_string_equal(json_string_value(json_object_get(extras[0], "extras")), "text");
        assert_int_equal(json_integer_value(
                             json_object_get(json_object_get(extras[1], "diaphan"), "other")),
                         2);
        assert_true(json_is_array(json_object_get(json_object_get(extras[2], "diaphan"), "value")));
        assert_null(extras[3]);
        /* the same vertices, the same attributes: the first two primitives share theirs */
        for (int k = 0; k < 9; k++) {
            char name[32];
            snprintf(name, sizeof name, "_THICKNESS_SH_%d", k);
            const json_t *index[3];
            for (size_t p = 0; p < 3; p++)
                index[p] =
                    json_object_get(json_object_get(json_array_get(primitives, p), "attributes"),
                                    name);
            assert_true(json_equal(index[0], index[1]) && !json_equal(index[0], index[2]));
        }
        assert_int_equal(json_array_size(json_object_get(root, "accessors")), 5 + 18);
        /* a second bake does not let it grow */
        struct dph_file before = must_read(in_folder("out.glb"));
        assert_true(fabricate_thickness(again, 6, DPH_STORE_SNORM8));
        must_save(again, in_folder("again.glb"));
        struct dph_file after = must_read(in_folder("again.glb"));
        assert_int_equal(before.size, after.size);
        assert_memory_equal(before.data, after.data, before.size);
        dph_file_finish(&before);
        dph_file_finish(&after);
        dph_scene_destroy(again);
        dph_scene_destroy(scene);
        free(one);
        free(two);
        free(json);
    }
}

/* The layout of what is added, value by value. */
static void test_layout(void **state)
{
    (void)state;
    char *json = maker_json(maker_tetra_json, NULL, NULL);
    struct dph_file glb = maker_glb(json, &maker_tetra, sizeof maker_tetra);
    /* a chunk of a kind that is not known comes back as well */
    unsigned char *longer = realloc(glb.data, glb.size + 13);
    assert_non_null(longer);
    memcpy(longer + glb.size, "\4\0\0\0XTRAabcd", 13);
    maker_u32(longer + 8, glb.size + 12);
    put_file("in.glb", longer, glb.size + 12);
    free(longer);
    free(json);
    struct dph_scene *scene = must_load(in_folder("in.glb"));
    static const float coefficient[4][4] = {{2, 0, 0, .5f},
                                            {-2, 1, 0, 0},
                                            {1, -.5f, .25f, 0},
                                            {0, 0, 0, 0}};
    dph_thickness_destroy(scene->body->thickness);
    scene->body->thickness =
        dph_thickness_create(&coefficient[0][0], 4, 2, NULL, 4, DPH_STORE_SNORM16, NULL);
    scene->mm_per_unit = .1;
    must_save(scene, in_folder("out.glb"));
    dph_scene_destroy(scene);
    struct dph_file out = must_read(in_folder("out.glb"));
    assert_memory_equal(out.data + out.size - 12, "\4\0\0\0XTRAabcd", 12);
    assert_true(strstr((const char *)out.data + 20,
                       "{\"version\":1,\"bands\":2,\"order\":\"l*(l+1)+m\",\"condon_shortley\":"
                       "true,\"scale\":[2.0,1.0],"
                       "\"definition\":\"inside\",\"fit\":\"sphere\",\"mm_per_unit\":0.1}"));
    struct dph_document *doc = dph_gltf_document_create(&out, "", NULL);
    struct dph_gltf_accessor a;
    float value[16];
    assert_true(dph_gltf_accessor(doc, 2, "", &a, NULL)); /* in the place of the old one */
    assert_true(a.type == DPH_GLTF_SHORT && a.normalized && a.components == 4 && a.count == 4 &&
                a.stride == 8);
    assert_true(dph_gltf_floats(doc, &a, "", value, NULL));
    for (int i = 0; i < 16; i++)
        assert_true(fabsf(value[i] * (i % 4 ? 1.f : 2.f) - (&coefficient[0][0])[i]) < 1e-4f);
    assert_int_equal(json_array_size(json_object_get(doc->root, "accessors")), 3);
    assert_int_equal(json_array_size(json_object_get(doc->root, "bufferViews")), 3);
    dph_document_destroy(doc);
    dph_file_finish(&out);
}

/* Compressed geometry stays compressed and in its place; a Draco copy, which has its own order of
 * vertices, goes. */
static void test_compressed(void **state)
{
    (void)state;
    char *packed = maker_json(
        maker_tetra_json, "'byteOffset':0,'byteLength':48",
        "'byteLength':48,'extensions':{'KHR_meshopt_compression':{'buffer':0,'byteOffset':96,"
        "'byteLength':4,'byteStride':12,'count':4,'mode':'ATTRIBUTES'}}");
    char *json = maker_json(packed, "\"indices\":1,",
                            "'indices':1,'extensions':{'KHR_draco_mesh_compression':{'bufferView':"
                            "0,'attributes':{}}},");
    struct maker_tetra bin = maker_tetra;
    bin.thickness[3][0] = (int8_t)0xa1; /* a version that is not known, so that the copy is read */
    struct dph_file glb = maker_glb(json, &bin, sizeof bin);
    put_file("in.glb", glb.data, glb.size);
    dph_file_finish(&glb);
    struct dph_scene *scene = must_load(in_folder("in.glb"));
    assert_true(fabricate_thickness(scene, 4, DPH_STORE_SNORM8));
    must_save(scene, in_folder("out.glb"));
    struct dph_scene *again = must_load(in_folder("out.glb"));
    compare_scenes(scene, again);
    const json_t *root = again->document->root;
    expect_same(json_array_get(json_object_get(scene->document->root, "bufferViews"), 0),
                json_array_get(json_object_get(root, "bufferViews"), 0), "compressed view");
    const json_t *mesh = json_array_get(json_object_get(root, "meshes"), 0);
    assert_null(
        json_object_get(json_array_get(json_object_get(mesh, "primitives"), 0), "extensions"));
    /* the compressed bytes lie where the old thickness was, so nothing was cut off */
    assert_true(again->document->buffer[0].size > sizeof bin);
    assert_memory_equal(again->document->buffer[0].data, &bin, sizeof bin);
    dph_scene_destroy(scene);
    dph_scene_destroy(again);
    free(packed);
    free(json);
}

/* Scenes that never were glTF. */
static void test_plain(void **state)
{
    (void)state;
    static const size_t sizes[] = {3, 100, 65535, 65536, 70000};
    for (int unshared = 0; unshared < 2; unshared++)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            size_t nvert = unshared ? sizes[s] / 3 * 3 : sizes[s],
                   ntri = unshared ? nvert / 3 : nvert - 2;
            struct dph_mesh mesh = {0};
            assert_true(dph_mesh_init(&mesh, nvert, ntri, s % 2, s % 3 == 0, NULL));
            for (size_t v = 0; v < nvert; v++) {
                for (int c = 0; c < 3; c++)
                    mesh.position[3 * v + (size_t)c] = (float)sin((double)v * (c + 1.7)) * 1e-3f;
                if (mesh.normal)
                    memcpy(mesh.normal + 3 * v, (const float[3]){0, .6f, .8f}, 12);
                if (mesh.texcoord)
                    memcpy(mesh.texcoord + 2 * v, (const float[2]){.25f, (float)v}, 8);
            }
            for (size_t i = 0; i < 3 * ntri; i++)
                mesh.index[i] = (uint32_t)(unshared ? i : i / 3 + i % 3);
            struct dph_scene *scene = dph_scene_from_mesh(&mesh, "a \"name\"\n", NULL);
            assert_non_null(scene);
            assert_null(mesh.position);
            if (s != 1)
                assert_true(fabricate_thickness(scene, 3, (enum dph_store)(s % 3)));
            must_save(scene, in_folder("plain.glb"));
            struct dph_scene *again = must_load(in_folder("plain.glb"));
            compare_scenes(scene, again);
            const json_t *primitive = json_array_get(
                json_object_get(json_array_get(json_object_get(again->document->root, "meshes"), 0),
                                "primitives"),
                0);
            bool indexed = json_object_get(primitive, "indices") != NULL;
            assert_true(indexed == !unshared || nvert == 3);
            if (scene->body->mesh.normal)
                assert_memory_equal(scene->body->mesh.normal, again->body->mesh.normal, nvert * 12);
            if (scene->body->mesh.texcoord)
                assert_memory_equal(scene->body->mesh.texcoord, again->body->mesh.texcoord,
                                    nvert * 8);
            dph_scene_destroy(scene);
            dph_scene_destroy(again);
        }
}

static void test_numbers(void **state)
{
    (void)state;
    /* every number that JSON was given reads back as it was */
    static const char text[] =
        "[0.1,1e22,1.0,-0.0,5e-324,1.7976931348623157e308,0.30000000000000004,1,9007199254740993]";
    json_t *json = json_loads(text, 0, NULL);
    struct dph_gltf_output out = {.root = json};
    assert_true(dph_gltf_emit(&out, in_folder("numbers.glb"), NULL, 0, NULL));
    struct dph_file file = must_read(in_folder("numbers.glb"));
    json_t *again = json_loadb((const char *)file.data + 20, file.size - 20, 0, NULL);
    assert_true(json_equal(json, again));
    assert_non_null(strstr((const char *)file.data + 20, "[0.1,1e+22,1.0,-0.0,"));
    assert_true(dph_gltf_shortest(.1f) == .1 && (float)dph_gltf_shortest(1.f / 3) == 1.f / 3);
    json_decref(json);
    json_decref(again);
    dph_file_finish(&file);
}

static void test_refusals(void **state)
{
    (void)state;
    struct dph_error err = {0};
    struct dph_scene *scene = maker_load(maker_tetra_json, &maker_tetra, sizeof maker_tetra, &err);
    assert_non_null(scene);
    assert_false(dph_scene_save(scene, in_folder("no/folder.glb"), &err));
    assert_int_equal(err.code, DPH_ERROR_OUTPUT);
    static const char *const name[] = {"out.gltf", "out.obj", "out.png", "out"};
    for (int i = 0; i < 4; i++) {
        assert_false(dph_scene_save(scene, in_folder(name[i]), &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        assert_int_equal(access(in_folder(name[i]), F_OK), -1);
    }
    /* thickness of other rows than the document has */
    dph_thickness_destroy(scene->body->thickness);
    static const float one[3];
    scene->body->thickness = dph_thickness_create(one, 3, 1, NULL, 3, DPH_STORE_FLOAT, NULL);
    assert_false(dph_scene_save(scene, in_folder("rows.glb"), &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_int_equal(access(in_folder("rows.glb"), F_OK), -1);
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_models),   cmocka_unit_test(test_awkward),
        cmocka_unit_test(test_layout),   cmocka_unit_test(test_compressed),
        cmocka_unit_test(test_plain),    cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
