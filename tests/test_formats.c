/* OBJ, PLY and STL: known answers from bytes in memory, the real models, and what is written comes
 * back. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <float.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "mesh/polygon.h"
#include "mesh/readers.h"
#include "mesh/scan.h"

typedef bool reader(struct dph_mesh *, const struct dph_file *, const char *, struct dph_scene *,
                    struct dph_error *);

static void read_bytes(reader *read, struct dph_mesh *mesh, const void *data, size_t size)
{
    struct dph_file file = {malloc(size + 1), size};
    struct dph_error err = {0};
    memcpy(file.data, data, size);
    file.data[size] = 0;
    if (!read(mesh, &file, "test", NULL, &err))
        fail_msg("%s", err.message);
    dph_file_finish(&file);
}

static void read_text(reader *read, struct dph_mesh *mesh, const char *text)
{
    read_bytes(read, mesh, text, strlen(text));
}

static void check_scan(const char *text, float wanted)
{
    float value;
    const char *end = dph_scan_float(text, &value);
    if (!end || *end || memcmp(&value, &wanted, sizeof value) != 0)
        fail_msg("%s: %.9g, wanted %.9g", text, end ? (double)value : NAN, (double)wanted);
}

static void test_numbers(void **state)
{
    (void)state;
    check_scan("0", 0.0f);
    check_scan("-0", -0.0f);
    check_scan("-.5", -0.5f);
    check_scan("+5.", 5.0f);
    check_scan("1e-3", 1e-3f);
    check_scan("1E+2", 100.0f);
    check_scan("3.4028234663852886e38", FLT_MAX);
    check_scan("3.4028236e38", INFINITY);
    check_scan("1.401298464324817e-45", 1.40129846e-45f);
    check_scan("0.7e-45", 0.0f);
    check_scan("1e-999999999999999999999", 0.0f);
    check_scan("0e999999999999999999999", 0.0f);
    check_scan("1e999999999999999999999", INFINITY);
    check_scan("16777217", 16777216.0f); /* the middle: to even */
    check_scan("16777217.0000000000000000000000000001", 16777218.0f);
    check_scan("16777216.9999999999999999999999999999", 16777216.0f);
    check_scan("1.000000059604644775390625", 1.0f); /* the middle between 1 and the next float */
    check_scan("1.000000059604644775390626", 1.00000012f);
    check_scan("1."
               "00000005960464477539062500000000000000000000000000000000000000000000000000000000000"
               "000"
               "0000000000000000000000000000000000000000000000000000000000000000000000000000001",
               1.00000012f);
    check_scan("0.000000000000000000000000000000000000000000000000000000000000001e63", 1.0f);
    check_scan("10000000000000000000000000000000000000000000000000000000000000000000000000000000000"
               "0000000000000000"
               "00000000000000000000000000000000000000000000000000000000000000000000000e-169",
               1.0f);
    float value;
    const char *none[] = {"", "-", ".", "nan", "inf", "e5", "1e", "1e+", "x"};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++)
        assert_null(dph_scan_float(none[i], &value));
}

/* 300,000 pseudo-random numbers of 1 to 25 digits: what strtof says, and printed numbers come
 * back. */
static void test_numbers_against_strtof(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 300000; i++) {
        char text[64];
        size_t n = 0;
        seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        uint64_t dice = seed >> 20;
        int digits = 1 + (int)(dice % 25), point = (int)(dice / 25 % 27);
        uint64_t r = seed;
        for (int d = 0; d < digits; d++) {
            if (d == point)
                text[n++] = '.';
            r = r * UINT64_C(6364136223846793005) + 1;
            text[n++] = (char)('0' + (r >> 33) % 10);
        }
        if (dice & 1 << 12)
            n += (size_t)sprintf(text + n, "e%d", (int)(dice >> 13 & 63) - 32);
        text[n] = 0;
        float value = -1, wanted = strtof(text, NULL);
        const char *end = dph_scan_float(text, &value);
        if (!end || *end || memcmp(&value, &wanted, sizeof value) != 0)
            fail_msg("%s: %.9g, wanted %.9g", text, (double)value, (double)wanted);
        if (isfinite(value)) {
            char back[24];
            int length = dph_print_float(back, value);
            assert_true(length > 0 && length < 24);
            assert_true(dph_scan_float(back, &wanted) == back + length && wanted == value);
        }
    }
}

static void test_numbers_in_other_locales(void **state)
{
    (void)state;
    const char *comma[] = {"de_DE.UTF-8", "pl_PL.UTF-8", "fr_FR.UTF-8"};
    size_t i = 0;
    while (i < 3 && !setlocale(LC_ALL, comma[i]))
        i++;
    if (i == 3) {
        print_message("no locale with a decimal comma is installed\n");
        skip();
    }
    check_scan("1.00000005960464477539062600000000000", 1.00000012f);
    char text[24];
    dph_print_float(text, 0.5f);
    setlocale(LC_ALL, "C");
    assert_string_equal(text, "0.5");
}

static double area_of(const float *position, const uint32_t *triangle, size_t ntri)
{
    double area = 0; /* in x and y, signed: overlapping triangles or ones outside would show */
    for (size_t t = 0; t < ntri; t++, triangle += 3) {
        const float *a = position + 3 * triangle[0], *b = position + 3 * triangle[1],
                    *c = position + 3 * triangle[2];
        double s = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0;
        assert_true(s >= 0);
        area += s;
    }
    return area;
}

/* A star, a comb and a spiral: all triangles run the polygon's way and make up its area. */
static void test_concave_polygons(void **state)
{
    (void)state;
    enum { N = 200 };
    static float p[N * 3];
    static uint32_t vertex[N], out[(N - 2) * 3];
    struct dph_polygon_work work = {0};
    for (int shape = 0; shape < 3; shape++) {
        for (uint32_t i = 0; i < N; i++) {
            double a = 6.283185307179586 * i / N, r = i & 1 ? 1 : 0.3, x, y;
            if (shape == 0) {
                x = r * cos(a), y = r * sin(a);
            } else if (shape == 1) {
                x = i < 2 ? (i ? 100 : 0) : (i == N - 1 ? 0 : 100 - (i - 1) / 2), y = i < 2   ? 0
                                                                                      : i & 2 ? 5
                                                                                              : 1;
            } else { /* out along one arm of a spiral, back along the other */
                double s = (i < N / 2 ? i : N - 1 - i) / 10.0, w = (i < N / 2 ? 0.55 : 0);
                x = (1 + s + w) * cos(s), y = (1 + s + w) * sin(s);
                if (i >= N / 2)
                    x = (1 + s) * cos(s), y = (1 + s) * sin(s);
            }
            p[3 * i] = (float)x, p[3 * i + 1] = (float)y, p[3 * i + 2] = 7;
            vertex[i] = i;
        }
        double wanted = 0;
        for (uint32_t i = 0; i < N; i++) {
            uint32_t j = (i + 1) % N;
            wanted += ((double)p[3 * i] * p[3 * j + 1] - (double)p[3 * i + 1] * p[3 * j]) / 2;
        }
        assert_true(wanted > 0);
        assert_true(dph_polygon_split(p, vertex, 1, N, out, &work));
        assert_true(fabs(area_of(p, out, N - 2) - wanted) < 1e-5 * wanted);
    }
    /* an arrow head of four corners: the diagonal must be the one inside */
    const float arrow[12] = {0, 0, 0, 2, 1, 0, 0, 2, 0, 0.5f, 1, 0};
    const uint32_t corner[4] = {0, 1, 2, 3};
    assert_true(dph_polygon_split(arrow, corner, 1, 4, out, &work));
    assert_true(fabs(area_of(arrow, out, 2) - 1.5) < 1e-6);
    dph_polygon_finish(&work);
}

static void test_obj(void **state)
{
    (void)state;
    struct dph_mesh mesh;
    read_text(dph_read_obj, &mesh,
              "\xef\xbb\xbf# a tetrahedron, with everything that is to be passed over\r\n"
              "mtllib none.mtl\r\no thing\r\ng a b\r\ns off\r\nusemtl wax\r\n"
              "v 0 0 0 1.0\r\n\tv\t1 -0 0 0.5 0.5 0.5\r\nv .0 1. 0\r\nv 0 0 \\\r\n 1e0\r\n"
              "p 1 2\nl 1 2 3\n#f 9 9 9\nvp 0.5\n"
              "f 1 3 2\nf -4 -3 -1\r\nf 1 4 \\\n 3 # the last but one\nf 2 3 4");
    assert_int_equal(mesh.nvert, 4);
    assert_int_equal(mesh.ntri, 4);
    assert_null(mesh.normal);
    assert_null(mesh.texcoord);
    struct dph_mesh_stats s;
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_true(s.closed && fabs(s.volume - 1 / 6.0) < 1e-12);
    dph_mesh_finish(&mesh);

    /* corners become vertices in order of appearance; v counts upward in the file */
    read_text(dph_read_obj, &mesh,
              "f 3/1/1 2/2/1 1/3/1 4/3/1\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.25 0.75\nvt "
              "1\nvt 0 0\nvn 0 0 -2\n"
              "f 3/1/1 2/2/1 4/1/1\n");
    assert_int_equal(mesh.nvert, 5);
    assert_int_equal(mesh.ntri, 3);
    const uint32_t index[9] = {0, 1, 2, 0, 2, 3, 0, 1, 4};
    assert_memory_equal(mesh.index, index, sizeof index);
    const float texcoord[10] = {0.25f, 0.25f, 1, 1, 0, 1, 0, 1, 0.25f, 0.25f};
    assert_memory_equal(mesh.texcoord, texcoord, sizeof texcoord);
    assert_true(mesh.normal[2] == -1 && mesh.position[0] == 1 && mesh.position[1] == 1);
    dph_mesh_finish(&mesh);

    /* what not every corner has is dropped; the file's rows stay, also those that no face uses */
    read_text(dph_read_obj, &mesh,
              "v 9 9 9\rv 0 0 0\rv 1 0 0\rv 0 1 0\rvn 0 0 1\rf 2//1 3//1 4//1\rf 2//1 3//1 4\r");
    assert_int_equal(mesh.nvert, 4);
    assert_null(mesh.normal);
    dph_mesh_finish(&mesh);
    read_text(dph_read_obj, &mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nf 1//1 2//1 3//1\n");
    assert_null(mesh.normal);
    dph_mesh_finish(&mesh);
}

/* A tetrahedron as binary PLY with one scalar type a property, lists before the one that counts
 * and elements before and behind. */
static size_t make_binary_ply(unsigned char *out, bool big)
{
    size_t n = (size_t)sprintf((char *)out,
                               "ply\nformat binary_%s_endian 1.0\ncomment x\nobj_info y\n"
                               "element material 2\nproperty list ushort double gains\nproperty "
                               "int8 id\n"
                               "element vertex 4\nproperty uint8 red\nproperty double x\nproperty "
                               "short y\n"
                               "property list char uint16 links\nproperty float z\nproperty int "
                               "nx\nproperty uint ny\nproperty char nz\n"
                               "element face 4\nproperty float quality\nproperty list uint16 "
                               "uint32 vertex_index\nproperty list int float uv\n"
                               "element edge 1\nproperty int a\nend_header\n",
                               big ? "big" : "little");
    const uint16_t one = 1;
    bool swap = big == (*(const unsigned char *)&one == 1);
#define PUT(type, value)                                                                           \
    do {                                                                                           \
        type number_ = (value);                                                                    \
        unsigned char bytes_[sizeof number_];                                                      \
        memcpy(bytes_, &number_, sizeof number_);                                                  \
        for (size_t i_ = 0; i_ < sizeof number_; i_++)                                             \
            out[n++] = bytes_[swap ? sizeof number_ - 1 - i_ : i_];                                \
    } while (0)
    for (int m = 0; m < 2; m++) {
        PUT(uint16_t, (uint16_t)m);
        for (int k = 0; k < m; k++)
            PUT(double, 0.1);
        PUT(int8_t, -1);
    }
    for (int v = 0; v < 4; v++) {
        PUT(uint8_t, 200);
        PUT(double, v == 1 ? 1.5 : 0);
        PUT(int16_t, v == 2 ? -300 : 0);
        PUT(int8_t, 1);
        PUT(uint16_t, 7);
        PUT(float, v == 3 ? 2.5f : 0);
        PUT(int32_t, 0);
        PUT(uint32_t, 3);
        PUT(int8_t, -4);
    }
    const uint32_t face[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    for (int f = 0; f < 4; f++) {
        PUT(float, 1);
        PUT(uint16_t, 3);
        for (int k = 0; k < 3; k++)
            PUT(uint32_t, face[f][k]);
        PUT(int32_t, 2);
        PUT(float, 0.5f);
        PUT(float, 0.5f);
    }
    PUT(int32_t, 5);
#undef PUT
    return n;
}

static void test_ply(void **state)
{
    (void)state;
    struct dph_mesh mesh;
    struct dph_mesh_stats s;
    static unsigned char bytes[2000];
    for (int big = 0; big < 2; big++) {
        read_bytes(dph_read_ply, &mesh, bytes, make_binary_ply(bytes, big));
        assert_int_equal(mesh.nvert, 4);
        assert_true(dph_mesh_measure(&mesh, &s, NULL));
        assert_true(s.closed && fabs(s.volume - 1.5 * 300 * 2.5 / 6) < 1e-9);
        assert_true(fabsf(mesh.normal[1] - 0.6f) < 1e-7f && fabsf(mesh.normal[2] + 0.8f) < 1e-7f);
        dph_mesh_finish(&mesh);
    }
    read_text(dph_read_ply, &mesh,
              "ply\r\nformat ascii 1.0\r\ncomment a comment\r\nelement face 1\r\n"
              "property list uchar int vertex_index\r\nelement vertex 4\r\nproperty float "
              "x\r\nproperty float y\r\n"
              "property float z\r\nproperty float s\r\nproperty float t\r\nend_header\r\n"
              "4 0 1 2 3\r\n0 0 0 0 0\r\n1 0 0 1 0\r\n0.25 0.25 0 1 1\r\n0 1 0 0 0.25");
    assert_int_equal(mesh.ntri, 2);
    assert_true(fabs(area_of(mesh.position, mesh.index, 2) - 0.25) < 1e-7);
    assert_true(mesh.texcoord[7] == 0.75f);
    dph_mesh_finish(&mesh);

    read_text(dph_read_ply, &mesh,
              "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
              "property float z\nelement tristrips 1\nproperty list int int "
              "vertex_indices\nend_header\n"
              "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n10 0 1 2 3 4 -1 0 1 1 2\n");
    const uint32_t index[9] = {0, 1, 2, 2, 1, 3, 2, 3, 4};
    assert_int_equal(mesh.ntri, 3);
    assert_memory_equal(mesh.index, index, sizeof index);
    dph_mesh_finish(&mesh);
}

static const char stl_text[] = "solid one\nfacet normal 0 0 nan\nouter loop\nvertex 0 0 0\nvertex "
                               "0 1 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid one\n"
                               "SOLID\n FACET NORMAL 0 0 0\n  OUTER LOOP\n VERTEX 0 0 0\n VERTEX 1 "
                               "0 0\n VERTEX 0 0 1\n ENDLOOP\n ENDFACET\n"
                               "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 0 1 vertex 0 1 "
                               "0 endloop endfacet\r\n"
                               "facet normal 0 0 0 outer loop vertex 1 0 0 vertex 0 1 0 vertex 0 0 "
                               "1e0 endloop endfacet\nendsolid";

static void test_stl(void **state)
{
    (void)state;
    struct dph_mesh mesh;
    struct dph_mesh_stats s;
    read_text(dph_read_stl, &mesh, stl_text);
    assert_int_equal(mesh.nvert, 4);
    assert_true(dph_mesh_measure(&mesh, &s, NULL));
    assert_true(s.closed && fabs(s.volume - 1 / 6.0) < 1e-12);

    unsigned char bytes[84 + 200] = "solid as an ascii file begins";
    bytes[80] = 4;
    for (size_t t = 0; t < 4; t++)
        for (size_t k = 0; k < 3; k++)
            memcpy(bytes + 84 + 50 * t + 12 + 12 * k, mesh.position + 3 * mesh.index[3 * t + k],
                   12);
    struct dph_mesh again;
    read_bytes(dph_read_stl, &again, bytes, sizeof bytes);
    assert_int_equal(again.nvert, 4);
    assert_memory_equal(again.position, mesh.position, 48);
    assert_memory_equal(again.index, mesh.index, 48);
    dph_mesh_finish(&again);
    dph_mesh_finish(&mesh);
}

/* Writes a mesh with awkward numbers in every format and reads it back, bit for bit. */
static void test_writers(void **state)
{
    (void)state;
    struct dph_mesh mesh, back;
    assert_true(dph_mesh_init(&mesh, 5, 3, true, true, NULL));
    const float value[15] = {1e-40f, -3.4e38f, 0.1f,   16777215,    1 / 3.0f,
                             -0.0f,  1e20f,    7e-30f, 1.00000012f, 123456.789f,
                             -2,     3,        4,      5,           6};
    memcpy(mesh.position, value, sizeof value);
    const uint32_t index[9] = {0, 1, 2, 2, 1, 3, 4, 3, 2};
    memcpy(mesh.index, index, sizeof index);
    for (int v = 0; v < 5; v++) {
        float n[3] = {(float)sin(v), (float)cos(v), 0};
        memcpy(mesh.normal + 3 * v, n, sizeof n);
        mesh.texcoord[2 * v] = 0.1f * (float)v;
        mesh.texcoord[2 * v + 1] = (float)v / 16;
    }
    static const struct {
        const char *ending;
        bool (*write)(const struct dph_mesh *, const char *, struct dph_error *);
        reader *read;
    } format[3] = {{"obj", dph_write_obj, dph_read_obj},
                   {"ply", dph_write_ply, dph_read_ply},
                   {"stl", dph_write_stl, dph_read_stl}};
    for (int i = 0; i < 3; i++) {
        char path[64];
        snprintf(path, sizeof path, "test_formats_%ld.%s", (long)getpid(), format[i].ending);
        struct dph_error err = {0};
        struct dph_file file;
        if (!format[i].write(&mesh, path, &err) || !dph_file_load(&file, path, 1 << 20, &err) ||
            !format[i].read(&back, &file, path, NULL, &err))
            fail_msg("%s", err.message);
        unlink(path);
        assert_int_equal(back.ntri, mesh.ntri);
        for (size_t k = 0; k < 9; k++)
            assert_memory_equal(back.position + 3 * back.index[k], mesh.position + 3 * index[k],
                                12);
        if (i < 2) {
            assert_memory_equal(back.position, mesh.position, sizeof value);
            assert_memory_equal(back.normal, mesh.normal, sizeof value);
            assert_memory_equal(back.texcoord, mesh.texcoord, 40);
        }
        dph_file_finish(&file);
        dph_mesh_finish(&back);
        assert_false(format[i].write(&mesh, "no/such/folder/x", &err));
        assert_int_equal(err.code, DPH_ERROR_OUTPUT);
    }
    dph_mesh_finish(&mesh);
}

/* MODELS.md: triangles, vertices, boundary edges, box. */
static void test_real_models(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        reader *read;
        size_t ntri, nvert, boundary; /* nvert 0: corners differ in more than their position */
        double low[3], high[3];
    } model[] = {
        {"bunny_scan_open.obj",
         dph_read_obj,
         69451,
         35947,
         223,
         {-0.09469, 0.03299, -0.06187},
         {0.06101, 0.1873, 0.0588}},
        {"bunny_closed_hr.obj",
         dph_read_obj,
         59664,
         29834,
         0,
         {-0.7702, -0.7685, -0.5972},
         {0.7795, 0.7699, 0.6014}},
        {"bunny_closed_lr.obj",
         dph_read_obj,
         6598,
         0,
         0,
         {-0.7757, -0.7689, -0.5971},
         {0.7762, 0.767, 0.5991}},
        {"nefertiti_100k.obj",
         dph_read_obj,
         99938,
         49971,
         0,
         {-119.3, -181.3, -247.3},
         {119.4, 181.2, 247.3}},
        {"spot.obj",
         dph_read_obj,
         23062,
         0,
         0,
         {-0.4634, -0.7302, -0.6996},
         {0.4642, 1.017, 1.078}},
        {"head_lps.obj", dph_read_obj, 17684, 0, 0, {-21.01, -28.98, -21}, {22.05, 11.02, 5.08}},
        {"skull.obj", dph_read_obj, 100002, 49999, 0, {-4.395, 0, -5.622}, {4.293, 13.9, 6.49}},
        {"lucy_100k.ply",
         dph_read_ply,
         99970,
         49987,
         0,
         {225.9, -388.4, -605.9},
         {1156, 145.3, 991.3}},
        {"bun_zipper.ply",
         dph_read_ply,
         69451,
         35947,
         223,
         {-0.09469, 0.03299, -0.06187},
         {0.06101, 0.1873, 0.0588}},
    };
    size_t found = 0;
    for (size_t i = 0; i < sizeof model / sizeof *model; i++) {
        char path[1024];
        struct dph_file file;
        struct dph_mesh mesh;
        struct dph_mesh_stats s;
        struct dph_error err = {0};
        snprintf(path, sizeof path, "%s/models/%s", DPH_DATA, model[i].name);
        if (access(path, R_OK))
            continue;
        found++;
        if (!dph_file_load(&file, path, SIZE_MAX, &err) ||
            !model[i].read(&mesh, &file, path, NULL, &err) || !dph_mesh_measure(&mesh, &s, &err))
            fail_msg("%s", err.message);
        assert_int_equal(mesh.ntri, model[i].ntri);
        if (model[i].nvert)
            assert_int_equal(mesh.nvert, model[i].nvert);
        assert_int_equal(s.boundary_edges, model[i].boundary);
        assert_int_equal(s.nonmanifold_edges + s.flipped_edges, 0);
        assert_true(s.closed == (model[i].boundary == 0));
        assert_true(s.volume > 0);
        for (int k = 0; k < 3; k++) { /* the list gives four digits */
            assert_true(fabs(s.bounds[0][k] - model[i].low[k]) <= 6e-4 * fabs(model[i].low[k]));
            assert_true(fabs(s.bounds[1][k] - model[i].high[k]) <= 6e-4 * fabs(model[i].high[k]));
        }
        dph_mesh_finish(&mesh);
        dph_file_finish(&file);
    }
    if (!found) {
        print_message("no models in %s\n", DPH_DATA);
        skip();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_numbers_against_strtof),
        cmocka_unit_test(test_numbers_in_other_locales),
        cmocka_unit_test(test_concave_polygons),
        cmocka_unit_test(test_obj),
        cmocka_unit_test(test_ply),
        cmocka_unit_test(test_stl),
        cmocka_unit_test(test_writers),
        cmocka_unit_test(test_real_models),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
