/* The shaders as a compiler that is nobody's driver sees them (glslangValidator): every stage in
 * the variants that are drawn, and the public include in GLSL 3.30 and in GLSL ES 3.00. Skipped
 * where the program is not installed. */
#define _XOPEN_SOURCE 700
#include <diaphan/render.h>

#include "render/gl.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[] = "/tmp/dph-shaders-XXXXXX";

/* Compiles one text; `stage` is "vert" or "frag". */
static void validate(const char *what, const char *stage, const char *text)
{
    char path[128], command[512];
    snprintf(path, sizeof path, "%s/shader.%s", folder, stage);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    snprintf(command, sizeof command, "glslangValidator %s >%s/log 2>&1", path, folder);
    if (system(command)) {
        char log[2000] = "";
        snprintf(command, sizeof command, "%s/log", folder);
        FILE *in = fopen(command, "rb");
        if (in) {
            log[fread(log, 1, sizeof log - 1, in)] = 0;
            fclose(in);
        }
        fail_msg("%s: %s", what, log);
    }
}

static void test_stages(void **state)
{
    (void)state;
    static const struct {
        const char *name, *stage;
        int vectors, bytes;
    } stages[] = {{"body.vert", "vert", 0, 0},      {"body.vert", "vert", 1, 4},
                  {"body.vert", "vert", 4, 1},      {"body.vert", "vert", 9, 1},
                  {"body.vert", "vert", 4, 2},      {"body.vert", "vert", 9, 2},
                  {"body.vert", "vert", 9, 4},      {"clustered.vert", "vert", 1, 1},
                  {"clustered.vert", "vert", 9, 1}, {"shsss.frag", "frag", 9, 1},
                  {"lambert.frag", "frag", 0, 0},   {"thickness.frag", "frag", 9, 4}};
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++)
        for (int lights = 1; lights <= DPH_MAX_LIGHTS; lights += 15) {
            char defines[100], what[100];
            snprintf(defines, sizeof defines,
                     "#define DPH_LIGHTS %d\n#define DPH_VECTORS %d\n#define DPH_BYTES %d\n",
                     lights, stages[i].vectors, stages[i].bytes);
            snprintf(what, sizeof what, "%s, %d vectors, %d lights", stages[i].name,
                     stages[i].vectors, lights);
            struct dph_error err = {0};
            char *text = dph_shader_text(stages[i].name, defines, &err);
            if (!text)
                fail_msg("%s", err.message);
            validate(what, stages[i].stage, text);
            free(text);
        }
}

static void test_public_include(void **state)
{
    (void)state;
    static const char *const heads[] = {
        "#version 330 core\n", "#version 300 es\nprecision highp float;\n", "#version 450 core\n",
        ("#version 300 es\nprecision highp float;\n#define DPH_SLAB_FIT vec3(1.0),vec3(1.0),"
         "vec3(1.0),vec3(1.0),vec3(1.0),vec3(1.0),vec3(1.0)\n")};
    static const char body[] =
        "uniform DphMaterial m;\nuniform vec4 y[DPH_VECTORS];\nuniform vec3 a, b, c;\n"
        "layout(location = 0) out vec4 o;\n"
        "void main()\n{\n    vec4 k[DPH_VECTORS];\n    for (int i = 0; i < DPH_VECTORS; i++)\n"
        "        k[i] = y[i] * a.x;\n"
        "    float t = dph_thickness(k, y);\n"
        "    o = vec4(dph_radiance(m, t, a, b, c, a) + dph_lambert(m, a, b, c, a) + "
        "dph_ambient(m), 1.0);\n}\n";
    for (size_t i = 0; i < sizeof heads / sizeof *heads; i++)
        for (int vectors = 1; vectors <= 9; vectors += 4) {
            char *text = malloc(strlen(dph_shader_include) + sizeof body + 200);
            assert_non_null(text);
            sprintf(text, "%s#define DPH_VECTORS %d\n%s%s", heads[i], vectors, dph_shader_include,
                    body);
            validate(heads[i], "frag", text);
            free(text);
        }
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *const names[] = {"shader.vert", "shader.frag", "log"};
    char path[128];
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
    return rmdir(folder);
}

int main(void)
{
    if (system("glslangValidator --version >/dev/null 2>&1")) {
        printf("skipped: glslangValidator (package glslang-tools) is not installed\n");
        return 77;
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_stages),
                                       cmocka_unit_test(test_public_include)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
