/* Broken OBJ, PLY and STL files: each is refused with the right code, the place and the value, and
 * nothing is left behind. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mesh/readers.h"

enum format { OBJ, PLY, STL };

#define V3 "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define LIST "property list uchar int vertex_indices\n"
#define HEAD "ply\nformat ascii 1.0\nelement vertex 3\n" XYZ "element face 1\n" LIST "end_header\n"
#define LITTLE "ply\nformat binary_little_endian 1.0\n"
#define POINTS "0 0 0\n1 0 0\n0 1 0\n"
#define FACET "facet normal 0 0 1\nouter loop\n"

/* `size` 0: the text is all. */
static const struct {
    enum format format;
    const char *bytes;
    size_t size;
    enum dph_code code;
    const char *place, *value; /* what the message holds */
} broken[] = {
    {OBJ, "", 0, DPH_ERROR_INPUT, "x:1:", "without a face"},
    {OBJ, "\n\n# nothing\n", 0, DPH_ERROR_INPUT, "x:4:", "without a face"},
    {OBJ, V3, 0, DPH_ERROR_INPUT, "x:4:", "without a face"},
    {OBJ, V3 "f 1 2 9001\n", 0, DPH_ERROR_INPUT,
     "x:4:", "face refers to vertex 9001, the mesh has 3"},
    {OBJ, V3 "f 1 2 3\nf 1 2 4\nf 1 2 5\n", 0, DPH_ERROR_INPUT, "x:5:", "vertex 4, the mesh has 3"},
    {OBJ, "f 1 2 5\nf 1 2 4\n" V3 "v 1 1 1\n", 0, DPH_ERROR_INPUT,
     "x:1:", "vertex 5, the mesh has 4"},
    {OBJ, V3 "f 1 2 0\n", 0, DPH_ERROR_INPUT, "x:4:", "vertex 0"},
    {OBJ, V3 "f 1 2 -4\n", 0, DPH_ERROR_INPUT, "x:4:", "vertex -4, only 3"},
    {OBJ, V3 "f -1 -2 -9223372036854775808\n", 0, DPH_ERROR_INPUT, "x:4:", "vertex -"},
    {OBJ, V3 "f 1 2 99999999999999999999999\n", 0, DPH_ERROR_INPUT,
     "x:4:", "the most is 2147483648"},
    {OBJ, V3 "f 1 2 2147483648\n", 0, DPH_ERROR_INPUT, "x:4:", "vertex 2147483648, the mesh has 3"},
    {OBJ, V3 "f 1 2\n", 0, DPH_ERROR_INPUT, "x:4:", "face has 2 corners"},
    {OBJ, V3 "f \n", 0, DPH_ERROR_INPUT, "x:4:", "face has 0 corners"},
    {OBJ, V3 "f 1 2", 0, DPH_ERROR_INPUT, "x:4:", "face has 2 corners"},
    {OBJ, V3 "f 1 2 \\\n\\\n", 0, DPH_ERROR_INPUT, "x:6:", "face has 2 corners"},
    {OBJ, V3 "f 1/1 2/1 3/1\n", 0, DPH_ERROR_INPUT, "x:4:", "texture coordinate 1, the file has 0"},
    {OBJ, V3 "vn 0 0 1\nf 1//1 2//2 3//1\n", 0, DPH_ERROR_INPUT,
     "x:5:", "normal 2, the file has 1"},
    {OBJ, V3 "f 1/-1 2 3\n", 0, DPH_ERROR_INPUT, "x:4:", "texture coordinate -1, only 0"},
    {OBJ, V3 "f 1 2 x\n", 0, DPH_ERROR_INPUT, "x:4:", "not x"},
    {OBJ, V3 "f 1 2 3.5\n", 0, DPH_ERROR_INPUT, "x:4:", "not .5"},
    {OBJ, V3 "f 1/1/1/1 2 3\n", 0, DPH_ERROR_INPUT, "x:4:", "a corner looks like"},
    {OBJ, "v 1 2\n", 0, DPH_ERROR_INPUT, "x:1:", "vertex has 2 numbers"},
    {OBJ, "v 1 2 abc\n", 0, DPH_ERROR_INPUT, "x:1:", "not abc"},
    {OBJ, "\n\nv nan 0 0\n", 0, DPH_ERROR_INPUT, "x:3:", "not nan"},
    {OBJ, "v 0 inf 0\n", 0, DPH_ERROR_INPUT, "x:1:", "not inf"},
    {OBJ, "v 0 -1e39 0\n", 0, DPH_ERROR_INPUT, "x:1:", "finite, not -1e39"},
    {OBJ, "v 0 1,5 0\n", 0, DPH_ERROR_INPUT, "x:1:", "not 1,5"},
    {OBJ, "v 0 0x10 0\n", 0, DPH_ERROR_INPUT, "x:1:", "not 0x10"},
    {OBJ, "v 0 \0 0\n", 9, DPH_ERROR_INPUT, "x:1:", "not nothing"},
    {OBJ, V3 "vn 0 1\n", 0, DPH_ERROR_INPUT, "x:4:", "normal has 2 numbers"},
    {OBJ, V3 "vt \n", 0, DPH_ERROR_INPUT, "x:4:", "texture coordinate has 0 numbers"},
    {OBJ,
     "\x7f"
     "ELF\2\1\1\0\0\0",
     10, DPH_ERROR_INPUT, "x:1:", "without a face"},
    {OBJ, "v 0 0 \x1b[31m\n", 0, DPH_ERROR_INPUT, "x:1:", "not ?[31m"},

    {PLY, "", 0, DPH_ERROR_INPUT, "x:1:", "ends inside its header"},
    {PLY, "plx\n", 0, DPH_ERROR_INPUT, "x:1:", "does not begin with \"ply\""},
    {PLY, "ply\nformat ascii 1.0\nelement vertex 3\n", 0, DPH_ERROR_INPUT,
     "x:4:", "ends inside its header"},
    {PLY, "ply\nelement vertex 3\n" XYZ "end_header\n", 0, DPH_ERROR_INPUT, "x:6:", "no format"},
    {PLY, "ply\nformat text 1.0\n", 0, DPH_ERROR_INPUT, "x:2:", "\"text\""},
    {PLY, "ply\nformat ascii 2.0\n", 0, DPH_ERROR_UNSUPPORTED, "x:2:", "\"2.0\""},
    {PLY, "ply\nformat ascii 1.0\nelement vertex -3\n", 0, DPH_ERROR_INPUT, "x:3:", "\"-3\""},
    {PLY, "ply\nformat ascii 1.0\nelement vertex\n", 0, DPH_ERROR_INPUT, "x:3:", "no count"},
    {PLY, "ply\nformat ascii 1.0\nproperty float x\n", 0, DPH_ERROR_INPUT,
     "x:3:", "before the first element"},
    {PLY, "ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n", 0, DPH_ERROR_INPUT,
     "x:4:", "\"half\""},
    {PLY, "ply\nformat ascii 1.0\nelement vertex 1\nproperty float\n", 0, DPH_ERROR_INPUT,
     "x:4:", "without a name"},
    {PLY, "ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n", 0,
     DPH_ERROR_INPUT, "x:4:", "float"},
    {PLY, "ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n", 0, DPH_ERROR_INPUT,
     "x:4:", "comes twice"},
    {PLY, "ply\nformat ascii 1.0\nsurprise\n", 0, DPH_ERROR_INPUT, "x:3:", "\"surprise\""},
    {PLY, "ply\nformat ascii 1.0\nelement face 1\n" LIST "end_header\n3 0 1 2\n", 0,
     DPH_ERROR_INPUT, "x:6:", "no element \"vertex\""},
    {PLY,
     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float z\nend_header\n0 "
     "0\n",
     0, DPH_ERROR_INPUT, "x:7:", "no y"},
    {PLY, "ply\nformat ascii 1.0\nelement vertex 1000000000000\n" XYZ "end_header\n0 0 0\n", 0,
     DPH_ERROR_INPUT, "x:8:", "1000000000000 rows of \"vertex\""},
    {PLY,
     "ply\nformat ascii 1.0\nelement vertex 3\n" XYZ "element face 1\nproperty int "
                                                     "a\nend_header\n" POINTS "1\n",
     0, DPH_ERROR_INPUT, "x:12:", "no list vertex_indices"},
    {PLY,
     "ply\nformat ascii 1.0\nelement vertex 3\n" XYZ "element face 1\nproperty list int float "
                                                     "vertex_index\nend_header\n" POINTS "3 0 1 "
                                                                                         "2\n",
     0, DPH_ERROR_INPUT, "x:12:", "are floats"},
    {PLY, HEAD "0.00 0.00 0.00\n1.00 0.00 0.00\n0.00 1", 0, DPH_ERROR_INPUT, "x:12:", "ends"},
    {PLY, HEAD POINTS "3 0 1\n", 0, DPH_ERROR_INPUT, "x:14:", "ends where a number"},
    {PLY, HEAD POINTS "3 0 1 3\n", 0, DPH_ERROR_INPUT,
     "x:13:", "face 0 refers to vertex 3, the mesh has 3"},
    {PLY, HEAD POINTS "3 0 1 -1\n", 0, DPH_ERROR_INPUT, "x:13:", "face 0 refers to vertex -1"},
    {PLY, HEAD POINTS "2 0 1 \n", 0, DPH_ERROR_INPUT, "x:13:", "face 0 has 2 corners"},
    {PLY, HEAD POINTS "200 0 1 2\n", 0, DPH_ERROR_INPUT, "x:13:", "list of 200"},
    {PLY, HEAD POINTS "-3 0 1 2\n", 0, DPH_ERROR_INPUT, "x:13:", "list of -3"},
    {PLY, HEAD "0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", 0, DPH_ERROR_INPUT, "x:10:", "\"nan\""},
    {PLY, HEAD "0 0 1e99\n1 0 0\n0 1 0\n3 0 1 2\n", 0, DPH_ERROR_INPUT,
     "x:10:", "vertex 0 has the z inf"},
    {PLY, HEAD "0 0 0;\n1 0 0\n0 1 0\n3 0 1 2\n", 0, DPH_ERROR_INPUT, "x:10:", "\"0;\""},
    {PLY, "ply\nformat ascii 1.0\nelement vertex 3\n" XYZ "end_header\n" POINTS, 0, DPH_ERROR_INPUT,
     "x:", "without a triangle"},
    {PLY, LITTLE "element vertex 1\n" XYZ "end_header\n\0\0\0\0\0\0\xc0\x7f\0\0\0\0", 127,
     DPH_ERROR_INPUT, "byte 119", "vertex 0 has the y nan"},
    {PLY, LITTLE "element vertex 1\n" XYZ "end_header\n\0\0\0\0\0\0\0\0\0\0\0", 126,
     DPH_ERROR_INPUT, "byte 115", "1 rows of \"vertex\" do not fit in the 11 bytes"},
    {PLY,
     LITTLE "element face 1\n" LIST "element vertex 1\n" XYZ "end_"
                                                             "header\n\x03\0\0\0\0\7\0\0\0\0\0\0\0"
            "\0\0\0\0\0\0\0\0\0\0\0\0",
     194, DPH_ERROR_INPUT, "byte 174", "vertex 7, the mesh has 1"},
    {PLY,
     LITTLE "element vertex 0\n" XYZ "element junk 4000000000\nproperty list uint double "
                                     "a\nend_header\n\xff\xff\xff\xff",
     171, DPH_ERROR_INPUT, "byte 167", "4000000000 rows of \"junk\""},

    {STL, "", 0, DPH_ERROR_INPUT, "byte 0", "inside its header"},
    {STL, "sol", 0, DPH_ERROR_INPUT, "byte 3", "inside its header"},
    {STL, "solid\n", 0, DPH_ERROR_INPUT, "x:2:", "\"facet\" must stand here, not \"nothing\""},
    {STL, "solid\nendsolid\n", 0, DPH_ERROR_INPUT, "x:3:", "without a triangle"},
    {STL, "solid a\n" FACET "vertex 0 0 0\nvertex 1 0 0\n", 0, DPH_ERROR_INPUT,
     "x:6:", "\"vertex\" must stand here"},
    {STL, "solid a\n" FACET "vertex 0 0 0\nvertex 1 0 zero\n", 0, DPH_ERROR_INPUT,
     "x:5:", "\"zero\""},
    {STL, "solid a\n" FACET "vertex 0 0 0\nvertex 1 0 nan\n", 0, DPH_ERROR_INPUT,
     "x:5:", "\"nan\""},
    {STL, "solid a\n" FACET "vertex 0 0 0\nvertex 1 0 1e60\n", 0, DPH_ERROR_INPUT,
     "x:5:", "\"1e60\""},
    {STL, "solid a\n" FACET "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 1 1 0\n", 0,
     DPH_ERROR_INPUT, "x:7:", "\"endloop\" must stand here, not \"vertex\""},
    {STL, "solid a\nfacets\n", 0, DPH_ERROR_INPUT, "x:2:", "\"facets\""},
    {STL, "solid a\n" FACET "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n", 0,
     DPH_ERROR_INPUT, "x:9:", "\"nothing\""},
};

static bool read_as(enum format format, const void *data, size_t size, struct dph_mesh *mesh,
                    struct dph_error *err)
{
    struct dph_file file = {malloc(size + 1), size};
    memcpy(file.data, data, size);
    file.data[size] = 0;
    bool ok = (format == OBJ   ? dph_read_obj
               : format == PLY ? dph_read_ply
                               : dph_read_stl)(mesh, &file, "x", NULL, err);
    dph_file_finish(&file);
    return ok;
}

static void expect(enum format format, const void *data, size_t size, enum dph_code code,
                   const char *place, const char *value)
{
    struct dph_mesh mesh;
    struct dph_error err = {0};
    if (read_as(format, data, size, &mesh, &err))
        fail_msg("accepted: %s %s", place, value);
    if (err.code != code || strncmp(err.message, "x:", 2) != 0 || !strstr(err.message, place) ||
        !strstr(err.message, value) || strchr(err.message, '\n'))
        fail_msg("code %d \"%s\", wanted %d with \"%s\" and \"%s\"", err.code, err.message, code,
                 place, value);
    assert_null(mesh.position);
    assert_null(mesh.index);
    assert_false(read_as(format, data, size, &mesh, NULL)); /* a caller who does not care */
}

static void test_table(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++)
        expect(broken[i].format, broken[i].bytes,
               broken[i].size ? broken[i].size : strlen(broken[i].bytes), broken[i].code,
               broken[i].place, broken[i].value);
}

static void test_binary_stl(void **state)
{
    (void)state;
    unsigned char bytes[84 + 100] = "whatever";
    bytes[80] = 2;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 9; k++)
            bytes[84 + 50 * i + 12 + 4 * k + 3] = (unsigned char)(0x3f + k);
    struct dph_mesh mesh;
    assert_true(read_as(STL, bytes, sizeof bytes, &mesh, NULL));
    dph_mesh_finish(&mesh);
    expect(STL, bytes, sizeof bytes - 1, DPH_ERROR_INPUT, "byte 80",
           "2 triangles need 184 bytes, the file has 183");
    expect(STL, bytes, 84, DPH_ERROR_INPUT, "byte 80", "the file has 84");
    expect(STL, bytes, 83, DPH_ERROR_INPUT, "byte 83", "header");
    bytes[83] = 0xff;
    expect(STL, bytes, sizeof bytes, DPH_ERROR_INPUT, "byte 80",
           "4278190082 triangles need 213909504184 bytes");
    bytes[83] = 0;
    bytes[80] = 1;
    expect(STL, bytes, sizeof bytes, DPH_ERROR_INPUT, "byte 80",
           "1 triangles need 134 bytes, the file has 184");
    bytes[80] = 0;
    expect(STL, bytes, 84, DPH_ERROR_INPUT, "byte 80", "0 triangles");
    bytes[80] = 2;
    memset(bytes + 84 + 50 + 12 + 8, 0xff, 4);
    expect(STL, bytes, sizeof bytes, DPH_ERROR_INPUT, "byte 154",
           "triangle 1 has the coordinate -nan");
}

/* Every prefix of a good file, and every file with one byte changed, is read or refused, but never
 * crashes, and says why. */
static void test_prefixes_and_changes(void **state)
{
    (void)state;
    static const char obj[] = V3 "v 1 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf -1//1 2//1 "
                                 "3//1\n";
    static const char ply[] = LITTLE "element vertex 3\n" XYZ "element face 1\n" LIST "end_header\n"
                                     "\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0"
                                     "\0\0\x80\x3f\0\0\0\0\x03\0\0\0\0\1\0\0\0\2\0\0\0";
    static const char stl[] = "solid a\n" FACET "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
                                                "0\nendloop\nendfacet\nendsolid a\n";
    const char *good[3] = {obj, ply, stl};
    const size_t size[3] = {sizeof obj - 1, sizeof ply - 1, sizeof stl - 1};
    for (int f = 0; f < 3; f++) {
        struct dph_mesh mesh;
        assert_true(read_as((enum format)f, good[f], size[f], &mesh, NULL));
        dph_mesh_finish(&mesh);
        for (size_t n = 0; n < size[f]; n++) {
            struct dph_error err = {0};
            if (read_as((enum format)f, good[f], n, &mesh, &err))
                dph_mesh_finish(&mesh);
            else
                assert_true(err.code != DPH_OK && strncmp(err.message, "x:", 2) == 0);
        }
        for (size_t n = 0; n < size[f]; n++)
            for (int change = 1; change < 256; change = change * 3 + 1) {
                char copy[512];
                struct dph_error err = {0};
                memcpy(copy, good[f], size[f]);
                copy[n] = (char)(copy[n] ^ change);
                if (read_as((enum format)f, copy, size[f], &mesh, &err))
                    dph_mesh_finish(&mesh);
                else
                    assert_true(err.code != DPH_OK && strncmp(err.message, "x:", 2) == 0);
            }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_binary_stl),
        cmocka_unit_test(test_prefixes_and_changes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
