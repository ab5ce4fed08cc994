/* Broken glTF: every mutation is refused with the right code and one line that names the place and
 * the value. */
#include "gltf_maker.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

/* A change of maker_tetra_json and what the message must hold. */
struct mutation {
    const char *find, *replace;
    enum dph_code code;
    const char *says;
};

#define IN DPH_ERROR_INPUT
#define UN DPH_ERROR_UNSUPPORTED
#define PRIM "meshes[0].primitives[0]"
#define BAKED PRIM ".extras.diaphan.thickness_sh"
#define ATTRIBUTE PRIM ".attributes._THICKNESS_SH_0"

static const struct mutation mutations[] = {
    /* JSON itself */
    {"'scene':0", "'scene':", IN, "JSON line 1"},
    {"'scene':0,", "'scene':0,'scene':0,", IN, "duplicate"},
    {"{'asset'", "[{'asset'", IN, "JSON line 1"},
    {"'count':4", "'count':1e999", IN, "JSON line 1"},
    {"'count':4", "'count':99999999999999999999", IN, "JSON line 1"},
    {"'name':'tetra'", "'name':'\xff'", IN, "JSON line 1"},
    /* version and extensions */
    {"'asset':{'version':'2.0'},", "", IN, "asset.version"},
    {"'version':'2.0'", "'version':'1.0'", UN, "asset.version: \"1.0\""},
    {"'version':'2.0'", "'version':'2.0','minVersion':'2.7'", UN, "asset.minVersion"},
    {"'scene':0", "'extensionsRequired':['KHR_gaussian_splatting'],'scene':0", UN,
     "extensionsRequired[0]: KHR_gaussian_splatting"},
    {"'scene':0", "'extensionsRequired':[7],'scene':0", IN, "extensionsRequired[0]"},
    {"'scene':0", "'extensionsRequired':{},'scene':0", IN, "extensionsRequired"},
    {"'indices':1,", "'indices':1,'extensions':{'KHR_draco_mesh_compression':{}},", DPH_OK, ""},
    {"'bufferView':0,", "", DPH_OK, ""}, /* zeros */
    /* buffers */
    {"'buffers':[{'byteLength':100}]", "'buffers':[{'byteLength':101}]", IN,
     "buffers[0]: byteLength is 101, its data ends after 100"},
    {"'buffers':[{'byteLength':100}]", "'buffers':[{}]", IN, "buffers[0]: byteLength is missing"},
    {"'buffers':[{'byteLength':100}]", "'buffers':[{'byteLength':-5}]", IN,
     "buffers[0].byteLength: -5"},
    {"'buffers':[{'byteLength':100}]", "'buffers':[{'byteLength':1e15}]", IN,
     "1000000000000000 is more"},
    {"'buffers':[{'byteLength':100}]", "'buffers':[7]", IN, "buffers[0]: is a number"},
    {"'buffers':[{'byteLength':100}]", "'buffers':7", IN, "buffers: is a number"},
    {"'buffers':[{'byteLength':100}]", "'buffers':[]", IN, "refers to buffers[0], the file has 0"},
    {"{'byteLength':100}", "{'byteLength':100,'uri':'data:;base64,@@@@'}", IN, "base64"},
    {"{'byteLength':100}", "{'byteLength':100,'uri':'data:;base64,AAAA'}", IN,
     "ends after 3 bytes"},
    {"{'byteLength':100}", "{'byteLength':100,'uri':'http://example.org/a.bin'}", IN,
     "relative path"},
    {"{'byteLength':100}", "{'byteLength':100,'uri':'/etc/passwd'}", IN, "only relative paths"},
    {"{'byteLength':100}", "{'byteLength':100,'uri':'is/not/there.bin'}", IN, "is/not/there.bin"},
    {"{'byteLength':100}", "{'byteLength':100,'uri':'a%00b.bin'}", IN, "zero byte"},
    {"{'byteLength':100}", "{'byteLength':100,'uri':['a']}", IN, "buffers[0]: uri"},
    /* buffer views */
    {"'byteOffset':48,'byteLength':24", "'byteOffset':90,'byteLength':24", IN,
     "bufferViews[1]: ends at byte 114, buffers[0] has 100"},
    {"'byteOffset':48,'byteLength':24", "'byteOffset':4294967290,'byteLength':24", IN,
     "bufferViews[1]"},
    {"{'buffer':0,'byteOffset':48", "{'buffer':3,'byteOffset':48", IN,
     "refers to buffers[3], the file has 1"},
    {"{'buffer':0,'byteOffset':48", "{'buffer':-1,'byteOffset':48", IN,
     "bufferViews[1].buffer: -1"},
    {"'byteOffset':0,'byteLength':48", "'byteOffset':0,'byteLength':48,'byteStride':8", IN,
     "elements of 12 bytes, bufferViews[0] a byteStride of 8"},
    {"'byteOffset':0,'byteLength':48", "'byteOffset':0,'byteLength':48,'byteStride':1000", IN,
     "more than 252"},
    {"'byteOffset':0,'byteLength':48", "'byteOffset':0,'byteLength':48.5", IN,
     "48.5 is not a count"},
    {"'byteOffset':0,'byteLength':48", "'byteOffset':0", IN,
     "bufferViews[0]: byteLength is missing"},
    /* accessors */
    {"'count':4,'type':'VEC3'", "'count':5,'type':'VEC3'", IN,
     PRIM ".attributes.POSITION: accessor 0 ends at byte 60"},
    {"'componentType':5126,'count':4", "'byteOffset':4,'componentType':5126,'count':4", IN,
     PRIM ".attributes.POSITION: accessor 0 ends at byte 52, its bufferViews[0] has 48"},
    {"'componentType':5126,'count':4", "'componentType':5126,'count':0", IN,
     "accessors[0]: count is 0"},
    {"'componentType':5126", "'componentType':5130", IN, "componentType 5130"},
    {"'componentType':5126", "'componentType':'FLOAT'", IN,
     "accessors[0].componentType: is a string"},
    {"'componentType':5126", "'componentType':5125", IN, "UNSIGNED_INT"},
    {"'componentType':5126", "'componentType':5126,'normalized':true", IN, "normalized"},
    {"'type':'VEC3'", "'type':'VEC2'", IN, "POSITION: has 2 components instead of 3"},
    {"'type':'VEC3'", "'type':'MAT4'", IN, "type \"MAT4\""},
    {"'bufferView':0,", "'bufferView':17,", IN, "refers to bufferViews[17], the file has 3"},
    {"'bufferView':1,'componentType':5123,'count':12",
     "'bufferView':1,'componentType':5123,'count':13", IN,
     PRIM ".indices: accessor 1 ends at byte 26"},
    {"'bufferView':1,'componentType':5123,'count':12",
     "'bufferView':1,'componentType':5123,'count':11", IN,
     PRIM ".indices: 11 corners do not make whole triangles"},
    {"'bufferView':1,'componentType':5123", "'bufferView':1,'componentType':5122", IN, "SHORT"},
    {"'bufferView':1,'componentType':5123,'count':12,'type':'SCALAR'",
     "'bufferView':0,'componentType':5125,'count':12,'type':'SCALAR'", IN,
     PRIM ".indices: element 3 is 1065353216"},
    {"'count':4,'type':'VEC3'", "'count':4,'type':'VEC3','sparse':{'count':5}", IN,
     "accessors[0].sparse.count"},
    {"'count':4,'type':'VEC3'", "'count':4,'type':'VEC3','sparse':{'count':1}", IN,
     "indices is missing"},
    {"'count':4,'type':'VEC3'",
     "'count':4,'type':'VEC3','sparse':{'count':3,'indices':{'bufferView':1,'componentType':5121},"
     "'values':{'bufferView':0}}",
     IN, "sparse.indices: element 1 is 0, not above the 0"},
    {"'count':4,'type':'VEC3'",
     "'count':4,'type':'VEC3','sparse':{'count':1,'indices':{'bufferView':2,'componentType':5121},"
     "'values':{'bufferView':0}}",
     IN, "sparse.indices: element 0 is 127, the accessor has 4"},
    {"'count':4,'type':'VEC3'",
     "'count':4,'type':'VEC3','sparse':{'count':4,'indices':{'bufferView':1,'byteOffset':10,"
     "'componentType':5125},'values':{'bufferView':0}}",
     IN, "accessor 0.sparse.indices ends at byte 26"},
    /* meshes */
    {"'attributes':{'POSITION':0", "'attributes':{'POSITION':9", IN,
     "refers to accessors[9], the file has 3"},
    {"'attributes':{'POSITION':0", "'attributes':{'POSITION':0,'NORMAL':2", IN,
     "NORMAL: has 4 components"},
    {"'attributes':{'POSITION':0", "'attributes':{'POSITION':0,'COLOR_0':1", IN,
     "COLOR_0: accessor 1 has 12 elements, POSITION has 4"},
    {"'indices':1,", "'indices':1,'mode':9,", IN, PRIM ".mode: 9 is more than 6"},
    {"'indices':1,", "'mode':1,", IN, "none of 1 holds triangles"},
    {"'indices':1,", "", IN, "4 corners do not make whole triangles"},
    {"'indices':1,", "'indices':'1',", IN, PRIM ".indices: is a string"},
    {"'meshes':[{", "'meshes':[{'primitives':[]},{", IN, "meshes[0]: has no primitives"},
    {"'meshes':", "'mashes':", IN, "none of 0 holds triangles"},
    /* nodes */
    {"'children':[1]", "'children':[1,1]", IN,
     "nodes[0].children: nodes[1] is a child of nodes[0] already"},
    {"'children':[1]", "'children':[2]", IN,
     "nodes[0].children: element 0 is 2, the file has 2 nodes"},
    {"'children':[1]", "'children':[0]", IN, "nodes[0].children: the node is its own ancestor"},
    {"{'mesh':0,'translation'", "{'children':[0],'mesh':0,'translation'", IN,
     "is its own ancestor"},
    {"'scenes':[{'nodes':[0]}]", "'scenes':[{'nodes':[1]}]", IN, "nodes[1], a child of nodes[0]"},
    {"'scenes':[{'nodes':[0]}]", "'scenes':[{'nodes':[0,0]}]", IN, "names nodes[0] twice"},
    {"'scenes':[{'nodes':[0]}]", "'scenes':[{'nodes':['a']}]", IN, "scenes[0].nodes: element 0"},
    {"'scene':0", "'scene':4", IN, "refers to scenes[4], the file has 1"},
    {"'translation':[1,2,3]", "'translation':[1,2]", IN, "nodes[1].translation: has 2 elements"},
    {"'translation':[1,2,3]", "'translation':[1,2,null]", IN, "nodes[1].translation[2]: is null"},
    {"'translation':[1,2,3]", "'rotation':[0,0,0,0]", IN, "nodes[1]: rotation"},
    {"'translation':[1,2,3]", "'scale':[1e300,1,1]", IN, "nodes[1]: its world matrix"},
    {"'translation':[1,2,3]", "'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],'scale':[1,1,1]", IN,
     "matrix and"},
    {"'translation':[1,2,3]", "'matrix':[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]", IN, "last row"},
    {"{'mesh':0,'translation'", "{'mesh':5,'translation'", IN,
     "nodes[1]: mesh is 5, the file has 1"},
    {"{'mesh':0,'translation':[1,2,3]}",
     "{'mesh':0,'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'ROTATION':0}}}}", IN,
     "ROTATION"},
    /* compression */
    {"'byteOffset':0,'byteLength':48",
     "'byteLength':48,'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength':48,"
     "'byteStride':12,'count':4,'mode':'ATTRIBUTES'}}",
     IN, "bufferViews[0].extensions.EXT_meshopt_compression"},
    {"'byteOffset':0,'byteLength':48",
     "'byteLength':48,'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength':480,"
     "'byteStride':12,'count':4,'mode':'ATTRIBUTES'}}",
     IN, "ends at byte 480, buffers[0] has 100"},
    {"'byteOffset':0,'byteLength':48",
     "'byteLength':48,'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength':48,"
     "'byteStride':12,'count':5,'mode':'ATTRIBUTES'}}",
     IN, "5 times 12 bytes"},
    {"'byteOffset':0,'byteLength':48",
     "'byteLength':4294967292,'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength':48,"
     "'byteStride':12,'count':357913941,'mode':'ATTRIBUTES'}}",
     IN, "48 bytes cannot hold 357913941"},
    {"'byteOffset':0,'byteLength':48",
     "'byteLength':48,'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength':48,"
     "'byteStride':12,'count':4,'mode':'NONSENSE'}}",
     IN, "NONSENSE"},
    /* thickness */
    {"'thickness_sh':{'version':1", "'thickness_sh':{'version':2", IN, BAKED ": version is 2"},
    {"'bands':2", "'bands':9", IN, BAKED ": bands is 9"},
    {"'bands':2", "'bands':0", IN, BAKED ": bands is 0"},
    {"'bands':2", "'bands':3", IN, BAKED ".scale: has 2 elements instead of 3"},
    {"'bands':2", "'bunds':2", IN, BAKED ": bands is missing"},
    {"'scale':[1,0.5]", "'scale':[1,-0.5]", IN, BAKED ": scale[1] is -0.5"},
    {"'scale':[1,0.5]", "'scale':[1,1e300]", IN, BAKED ": scale[1]"},
    {"'scale':[1,0.5]", "'scale':1", IN, BAKED ".scale: is a number"},
    {"'scale':[1,0.5],", "", IN, BAKED ": scale is missing"},
    {"'definition':'inside'", "'definition':'outside'", IN, BAKED ": definition \"outside\""},
    {"'fit':'weighted'", "'fit':5", IN, BAKED ": fit"},
    {"'order':'l*(l+1)+m'", "'order':'zonal'", IN, BAKED ": order"},
    {"'condon_shortley':true", "'condon_shortley':false", IN, BAKED ": condon_shortley"},
    {"'mm_per_unit':2", "'mm_per_unit':-2", IN, BAKED ": mm_per_unit is -2"},
    {"'thickness_sh':{", "'thickness_sh':[],'old':{", IN, BAKED ": is not an object"},
    {",'_THICKNESS_SH_0':2", "", IN, "_THICKNESS_SH_0 is missing"},
    {"'componentType':5120,'normalized':true", "'componentType':5120", IN, ATTRIBUTE ": BYTE"},
    {"'componentType':5120,'normalized':true", "'componentType':5121,'normalized':true", IN,
     ATTRIBUTE ": normalized UNSIGNED_BYTE"},
    {"'count':4,'type':'VEC4'", "'count':5,'type':'SCALAR'", IN,
     "_THICKNESS_SH_0: accessor 2 has 5 elements"},
    {"'count':4,'type':'VEC4'", "'count':4,'type':'VEC3'", IN, ATTRIBUTE ": has 3 components"},
    {"'primitives':[", "'primitives':[{'attributes':{'POSITION':0},'indices':1},", IN,
     "meshes[0]: only 1 of its 2 triangle primitives are baked"},
};

static int failures; /* all of a test's, so that one run shows them */

static void check(struct dph_file file, enum dph_code code, const char *says, const char *what)
{
    struct dph_error err = {0};
    struct dph_scene *scene = maker_read(file, &err);
    if ((scene != NULL) != (code == DPH_OK) || err.code != code || !strstr(err.message, says) ||
        strchr(err.message, '\n') || (!scene && strncmp(err.message, "made.glb: ", 10))) {
        print_error("%s: code %d instead of %d, \"%s\" should hold \"%s\"\n", what, err.code, code,
                    err.message, says);
        failures++;
    }
    dph_scene_destroy(scene);
}

static void test_mutations(void **state)
{
    (void)state;
    failures = 0;
    check(maker_glb("{}", NULL, 0), IN, "asset.version", "empty object");
    for (size_t i = 0; i < sizeof mutations / sizeof *mutations; i++) {
        const struct mutation *m = &mutations[i];
        char *json = maker_json(maker_tetra_json, m->find, m->replace);
        check(maker_glb(json, &maker_tetra, sizeof maker_tetra), m->code, m->says, m->replace);
        free(json);
    }
    assert_int_equal(failures, 0);
}

/* The container, byte by byte. */
static void test_container(void **state)
{
    (void)state;
    failures = 0;
    static const struct {
        size_t at;
        unsigned value;
        enum dph_code code;
        const char *says;
    } bytes[] = {
        {4, 1, UN, "GLB version 1"},
        {8, 12, IN, "GLB header says"},
        {9, 255, IN, "GLB header says"},
        {12, 1, IN, "not a multiple of 4"},
        {15, 255, IN, "byte 12: chunk of"},
        {16, 'X', IN, "instead of JSON"},
    };
    char *json = maker_json(maker_tetra_json, NULL, NULL);
    for (size_t i = 0; i < sizeof bytes / sizeof *bytes; i++) {
        struct dph_file file = maker_glb(json, &maker_tetra, sizeof maker_tetra);
        file.data[bytes[i].at] = (unsigned char)bytes[i].value;
        check(file, bytes[i].code, bytes[i].says, "byte of the header");
    }
    /* cut off anywhere; the length in the header is first left as it was, then corrected */
    size_t whole = 0, step = 1;
    for (size_t cut = 4; !whole || cut < whole; cut += step)
        for (int corrected = 0; corrected < 2; corrected++) {
            struct dph_file file = maker_glb(json, &maker_tetra, sizeof maker_tetra);
            whole = file.size;
            step = cut < 32 ? 1 : 13;
            /* a file of exactly the cut size, so that the sanitizers see every byte beyond it */
            unsigned char *data = malloc(cut + 1);
            memcpy(data, file.data, cut);
            data[cut] = 0;
            free(file.data);
            file = (struct dph_file){data, cut};
            if (corrected && cut >= 12)
                maker_u32(file.data + 8, cut);
            check(file, IN, "", "cut off");
        }
    /* two BIN chunks, BIN missing, a chunk that is not known */
    struct dph_file file = maker_glb(json, &maker_tetra, sizeof maker_tetra);
    size_t bin = 8 + sizeof maker_tetra;
    unsigned char *twice = malloc(file.size + bin + 1);
    memcpy(twice, file.data, file.size);
    memcpy(twice + file.size, file.data + file.size - bin, bin + 1);
    maker_u32(twice + 8, file.size + bin);
    struct dph_file other = {malloc(file.size + bin + 1), file.size + bin};
    memcpy(other.data, twice, file.size + bin + 1);
    memcpy(other.data + file.size + 4, "XTRA", 4);
    check((struct dph_file){twice, file.size + bin}, IN, "BIN chunk, which must be the second",
          "two BIN");
    check(other, DPH_OK, "", "unknown chunk");
    dph_file_finish(&file);
    check(maker_glb(json, NULL, 0), IN, "needs buffers[0]: has no uri", "no BIN");
    free(json);
    assert_int_equal(failures, 0);
}

/* Numbers in the data. */
static void test_numbers(void **state)
{
    (void)state;
    failures = 0;
    char *json = maker_json(maker_tetra_json, NULL, NULL);
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        struct maker_tetra tetra = maker_tetra;
        tetra.position[2][1] = bad[i];
        check(maker_glb(json, &tetra, sizeof tetra), IN,
              PRIM ".attributes.POSITION: element 2 has component 1", "not finite");
    }
    const uint16_t index[] = {4, 65535};
    for (int i = 0; i < 2;
         i++) { /* 65535 restarts a primitive where that is allowed; here it is not */
        struct maker_tetra tetra = maker_tetra;
        tetra.wide[7] = index[i];
        check(maker_glb(json, &tetra, sizeof tetra), IN, PRIM ".indices: element 7 is", "index");
    }
    free(json);
    json = maker_json(maker_tetra_json, "'indices':1,",
                      "'indices':1,'extensions':{'KHR_draco_mesh_compression':{'bufferView':0}},");
    char *required = maker_json(json, "\"scene\":0",
                                "'extensionsRequired':['KHR_draco_mesh_compression'],'scene':0");
    check(maker_glb(required, &maker_tetra, sizeof maker_tetra), UN,
          PRIM ": KHR_draco_mesh_compression is not supported", "Draco");
    free(required);
    free(json);
    assert_int_equal(failures, 0);
}

/* Few bytes that ask for much: refused before memory is taken. */
static void test_bombs(void **state)
{
    (void)state;
    failures = 0;
    check(maker_glb("{\"asset\":{\"version\":\"2.0\"},\"meshes\":[{\"primitives\":[{\"attributes\":"
                    "{\"POSITION\":0}}]}],\"accessors\":[{\"componentType\":5126,\"count\":"
                    "2147483646,\"type\":\"VEC3\"}]}", NULL, 0), DPH_ERROR_LIMIT,
          "accessors[0]: 2147483646 elements without data", "zeros");

    /* one accessor used by thousands of primitives */
    size_t count = 50000, used;
    char *json = malloc(count * 40 + 1000);
    used = (size_t)sprintf(json, "{\"asset\":{\"version\":\"2.0\"},\"meshes\":[{\"primitives\":[");
    for (size_t i = 0; i < count; i++)
        used += (size_t)sprintf(json + used, "%s{\"attributes\":{\"POSITION\":0}}", i ? "," : "");
    sprintf(json + used, "]}],\"accessors\":[{\"componentType\":5126,\"count\":999999,\"type\":"
            "\"VEC3\"}]}");
    check(maker_glb(json, NULL, 0), DPH_ERROR_LIMIT, "vertices and corners", "shared");

    /* deep JSON */
    for (size_t i = 0; i < count; i++)
        json[i] = '[';
    json[count] = 0;
    check(maker_glb(json, NULL, 0), IN, "JSON line 1", "deep");

    /* a chain of nodes as long as the file, from the wrong end */
    used = (size_t)sprintf(json, "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{}");
    for (size_t i = 1; i < count; i++)
        used += (size_t)sprintf(json + used, ",{\"children\":[%zu]}", i - 1);
    sprintf(json + used, "],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
            "\"accessors\":[{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}]}");
    check(maker_glb(json, NULL, 0), DPH_OK, "", "chain");
    free(json);

    /* a million copies of a million vertices take no longer than any other large file */
    struct dph_scene *scene = maker_load(
        "{'asset':{'version':'2.0'},'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],"
        "'nodes':[{'mesh':0,'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':"
        "0}}}}],'accessors':[{'componentType':5126,'count':999999,'type':'VEC3'}]}",
        NULL, 0, NULL);
    assert_non_null(scene);
    assert_int_equal(scene->ninstance, 999999);
    dph_scene_destroy(scene);
    assert_int_equal(failures, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mutations),
        cmocka_unit_test(test_container),
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_bombs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
