/* Media: reflectance and transport against the published table, the slab curve against its closed
 * form and random walks, and material files, good and bad. */
#define _XOPEN_SOURCE 700
#include <diaphan/material.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

static struct dph_material find(const char *name)
{
    struct dph_material material;
    struct dph_error err;
    if (!dph_material_load(name, &material, &err))
        fail_msg("%s", err.message);
    return material;
}

static void test_presets(void **state)
{
    (void)state;
    static const char *const names[] = {"wax",     "apple",      "chicken1", "chicken2", "cream",
                                        "ketchup", "marble",     "potato",   "skimmilk", "skin1",
                                        "skin2",   "spectralon", "wholemilk"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        assert_string_equal(find(names[i]).name, names[i]);
    assert_string_equal(find("Marble").name, "marble");
    size_t count = 0;
    while (dph_material_preset(count))
        count++;
    assert_int_equal(count, 13);
}

/* 1 / str as methods of the same media publish it, and the index-matched reflectance worked out by
 * hand for a few. */
static void test_medium(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double length[3];
    } rows[] = {{"apple", {6.96, 6.40, 1.90}},     {"chicken1", {11.6, 3.88, 1.75}},
                {"chicken2", {9.44, 3.35, 1.79}},  {"cream", {15.0, 4.66, 2.54}},
                {"ketchup", {4.76, .58, .39}},     {"marble", {8.51, 5.57, 3.95}},
                {"potato", {14.3, 7.23, 2.04}},    {"skimmilk", {18.4, 10.4, 3.50}},
                {"skin1", {3.67, 1.37, .68}},      {"skin2", {4.82, 1.69, 1.09}},
                {"wholemilk", {10.9, 6.58, 2.51}}, {"wax", {13.2, 8.0, 4.0}}};
    struct dph_medium medium;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct dph_material material = find(rows[i].name);
        dph_material_medium(&material, &medium);
        for (int c = 0; c < 3; c++)
            assert_float_equal(1 / medium.transport[c], rows[i].length[c],
                               .006 * rows[i].length[c] + .005);
    }
    struct dph_material spectralon = find("spectralon");
    dph_material_medium(&spectralon, &medium);
    assert_true(medium.reflectance[0] == 1 && medium.transport[0] == 0);

    /* integral of R_d over the plane, from the dipole's own closed form at A = 1, against numerical
     * integration of the profile */
    struct dph_material skin = find("skin1");
    dph_material_medium(&skin, &medium);
    for (int c = 0; c < 3; c++) {
        double extinction = medium.reduced_scattering[c] + skin.absorption[c];
        double albedo = medium.reduced_scattering[c] / extinction, k = medium.transport[c];
        double zr = 1 / extinction, zv = zr * 7 / 3, sum = 0, step = .01;
        for (double r = step / 2; r < 120; r += step) {
            double a = sqrt(r * r + zr * zr), b = sqrt(r * r + zv * zv);
            sum += 2 * PI * r * step * albedo / (4 * PI) *
                   (zr * (k * a + 1) * exp(-k * a) / (a * a * a) +
                    zv * (k * b + 1) * exp(-k * b) / (b * b * b));
        }
        assert_float_equal(medium.reflectance[c], sum, 2e-4);
    }
    /* anisotropy reduces */
    skin.anisotropy = .9;
    struct dph_medium reduced;
    dph_material_medium(&skin, &reduced);
    assert_float_equal(reduced.reduced_scattering[0], .1 * medium.reduced_scattering[0], 1e-12);
}

/* A medium of extinction 1 and this albedo in every channel. */
static struct dph_material_constants slab(double albedo)
{
    struct dph_material material = find("wax");
    struct dph_material_constants constants;
    for (int c = 0; c < 3; c++) {
        material.scattering[c] = albedo;
        material.absorption[c] = 1 - albedo;
    }
    dph_material_constants(&material, &constants);
    return constants;
}

static void test_slab(void **state)
{
    (void)state;
    /* the diffusion slab's values beside random walks in a slab of d mean free paths */
    static const struct {
        double albedo, d, want, walk, tolerance;
    } rows[] = {{.99, 1, .705, .653, .06},
                {.99, 4, .276, .277, .01},
                {.99, 16, .0292, .0295, .001},
                {.999, 8, .171, .172, .005},
                {.9, 4, .113, .128, .02}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct dph_material_constants constants = slab(rows[i].albedo);
        double t = dph_material_transmittance(&constants, 1, rows[i].d);
        assert_float_equal(t, rows[i].want, .003 * rows[i].want + 1e-4);
        assert_float_equal(t, rows[i].walk, rows[i].tolerance);
    }
    /* no absorption: T = (zr + ze) / (d + 2 ze) */
    struct dph_material_constants clear = slab(1);
    assert_float_equal(dph_material_transmittance(&clear, 0, 10), (5 / 3.) / (10 + 4 / 3.), 1e-7);
    /* and hardly any is close to it, on both sides of the switch between series and exponentials */
    struct dph_material_constants hardly = slab(1 - 1e-9);
    assert_float_equal(dph_material_transmittance(&hardly, 0, 10), (5 / 3.) / (10 + 4 / 3.), 1e-6);
}

/* In every medium T is 1 at the surface and below, falls without a step, stays finite and above or
 * at 0. */
static void test_curve_shape(void **state)
{
    (void)state;
    struct dph_material media[32];
    size_t count = 0;
    while (dph_material_preset(count)) {
        media[count] = *dph_material_preset(count);
        count++;
    }
    static const double odd[][2] = {{0, 0},   {0, .3},    {1e-9, 0}, {1e-9, 1e-9},
                                    {1e6, 0}, {1e6, 1e6}, {0, 1e6},  {1, 1e-12}};
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        media[count] = media[0];
        for (int c = 0; c < 3; c++) {
            media[count].scattering[c] = odd[i][0];
            media[count].absorption[c] = odd[i][1];
        }
        count++;
    }
    for (size_t i = 0; i < count; i++)
        for (int curve = 0; curve < 2; curve++) {
            struct dph_material_constants k;
            media[i].curve = curve ? DPH_CURVE_EXP : DPH_CURVE_SLAB;
            dph_material_constants(&media[i], &k);
            for (int c = 0; c < 3; c++) {
                assert_true(isfinite(k.rate[c]) && isfinite(k.offset[c]) &&
                            isfinite(k.numerator[c]));
                assert_true(dph_material_transmittance(&k, c, 0) == 1);
                assert_true(dph_material_transmittance(&k, c, -5) == 1);
                double last = 1;
                for (double d = 1e-4; d < 1e7; d *= 1.02) {
                    double t = dph_material_transmittance(&k, c, d);
                    if (!(t >= 0 && t <= last * (1 + 1e-6)))
                        fail_msg("%s, curve %d, channel %d: T(%g) = %g after %g", media[i].name,
                                 curve, c, d, t, last);
                    last = t;
                }
                assert_true(k.albedo[c] >= 0 && k.albedo[c] <= 1);
            }
        }
}

/* The largest error of a fit, at thicknesses that are not those of the fitting, in floats. */
static double fit_error(const struct dph_material_constants *k, const struct dph_material_fit *fit)
{
    double worst = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < 4000; i++) {
            float d = i ? k->offset[c] * (float)pow(10, -3 + 11 * (i / 4000.)) : 0, p = 0;
            for (int j = DPH_FIT_TERMS; j-- > 0;)
                p = p * d + fit->term[j][c];
            double t = p > 0 ? fmin(1, 1 / (double)p) : 9;
            worst = fmax(worst, fabs(t - dph_material_transmittance(k, c, (double)d)));
        }
    return worst;
}

/* In any medium the polynomial is as good as it says. */
static void test_fit(void **state)
{
    (void)state;
    struct dph_material_constants k;
    struct dph_material_fit fit;
    for (size_t i = 0; dph_material_preset(i); i++) {
        dph_material_constants(dph_material_preset(i), &k);
        if (!dph_material_fit(&k, &fit) || fit_error(&k, &fit) > 2e-4)
            fail_msg("%s: %g, says %g", dph_material_preset(i)->name, fit_error(&k, &fit),
                     fit.error);
    }
    static const double extinction[] = {1e-3, 1, 1e6}, absorbed[] = {0, 1e-4, 1e-3, .01, .03, .4, 1};
    struct dph_material material = *dph_material_preset(0);
    for (size_t e = 0; e < 3; e++)
        for (size_t a = 0; a < 7; a++) {
            for (int c = 0; c < 3; c++) {
                material.absorption[c] = extinction[e] * pow(absorbed[a], 1 + .1 * c);
                material.scattering[c] = extinction[e] - material.absorption[c];
            }
            dph_material_constants(&material, &k);
            if (!dph_material_fit(&k, &fit) || fit_error(&k, &fit) > 2e-4 || fit.error > 2e-4)
                fail_msg("extinction %g, absorbed %g: %g, says %g", extinction[e], absorbed[a],
                         fit_error(&k, &fit), fit.error);
        }
    /* next to no absorption, and so thin media that floats do not reach the sixth power of their
     * millimetres: it says no, or has a fit all the same */
    for (double thin = 1e-9; thin < 10; thin *= 1.7)
        for (int c = 0; c <= 10; c++) {
            for (int j = 0; j < 3; j++) {
                material.absorption[j] = thin * pow(10, -c);
                material.scattering[j] = thin - material.absorption[j];
            }
            dph_material_constants(&material, &k);
            if (dph_material_fit(&k, &fit))
                assert_true(fit.error <= 1e-3 && fit_error(&k, &fit) <= 1.1e-3);
            else
                assert_true(fit.error > 1e-3);
        }
    material.scattering[0] = material.absorption[0] = 0; /* nothing is lost in it */
    dph_material_constants(&material, &k);
    k.rate[1] = k.rate[2] = 0;
    k.offset[1] = k.offset[2] = 1;
    k.numerator[1] = k.numerator[2] = 1e30F;
    assert_true(dph_material_fit(&k, &fit) && fit.term[0][0] == 1 && fit.term[1][0] == 0);
    k.curve = DPH_CURVE_EXP;
    assert_false(dph_material_fit(&k, &fit));
}

static void test_constants(void **state)
{
    (void)state;
    struct dph_material material = find("wax");
    struct dph_medium medium;
    struct dph_material_constants k;
    dph_material_medium(&material, &medium);
    dph_material_constants(&material, &k);
    assert_float_equal(k.base[1], .25 * medium.reflectance[1] / PI, 1e-7);
    assert_float_equal(k.front[1], .6 * medium.reflectance[1] / PI, 1e-7);
    assert_float_equal(k.back[1], .35 / PI, 1e-7);
    assert_float_equal(k.f0, .0337, 1e-4);
    material.formula = DPH_FORMULA_PAPER;
    material.curve = DPH_CURVE_EXP;
    material.base[2] = .125;
    dph_material_constants(&material, &k);
    assert_float_equal(k.base[1], medium.reflectance[1] / PI, 1e-7);
    assert_float_equal(k.front[1], medium.reflectance[1] / PI, 1e-7);
    assert_true(k.base[2] == .125F && k.back[0] == 0);
    assert_float_equal(dph_material_transmittance(&k, 0, 5), exp(-5 * medium.transport[0]), 1e-6);
}

static char path[] = "/tmp/dph-material-XXXXXX";

static bool load_text(const char *text, struct dph_material *material, struct dph_error *err)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    return dph_material_load(path, material, err);
}

static void test_file(void **state)
{
    (void)state;
    struct dph_material m;
    struct dph_error err = {0};
    if (!load_text("{\"scattering\": [1, 2.5, 3], \"absorption\": [0.001, 0, 0.01], "
                   "\"anisotropy\": 0.5, \"ior\": 1.4,\n"
                   " \"back\": [1, 0.5, 0.25], \"specular\": 1, \"name\": \"jade\", \"formula\": "
                   "\"paper\"}",
                   &m, &err))
        fail_msg("%s", err.message);
    assert_string_equal(m.name, "jade");
    assert_true(m.scattering[1] == 2.5 && m.absorption[2] == .01 && m.anisotropy == .5 &&
                m.ior == 1.4);
    assert_true(m.back[1] == .5 && m.specular == 1 && m.shininess == 40 && isnan(m.front[0]));
    assert_true(m.formula == DPH_FORMULA_PAPER && m.curve == DPH_CURVE_EXP);
    assert_true(load_text("{\"scattering\": [1, 2, 3], \"absorption\": [0, 0, 0], \"formula\": "
                          "\"paper\", \"curve\": \"slab\"}",
                          &m, &err));
    assert_true(m.curve == DPH_CURVE_SLAB && m.anisotropy == 0 && m.ior == 1.3);
}

static void test_bad_files(void **state)
{
    (void)state;
    static const struct {
        const char *text, *word;
    } files[] = {
        {"", ":1:"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0],\n\"ior\": }", ":2:"},
        {"[1, 2, 3]", "object"},
        {"{\"scattering\": [1,2,3]}", "\"absorption\" is missing"},
        {"{\"scattering\": [1,2], \"absorption\": [0,0,0]}", "scattering"},
        {"{\"scattering\": 1, \"absorption\": [0,0,0]}", "scattering"},
        {"{\"scattering\": [1,2,\"3\"], \"absorption\": [0,0,0]}", "scattering[2]"},
        {"{\"scattering\": [1,2,-3], \"absorption\": [0,0,0]}", "scattering[2]: -3"},
        {"{\"scattering\": [1,2,1e400], \"absorption\": [0,0,0]}", ":1:"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,1e7]}", "absorption[2]"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0], \"anisotropy\": 1}", "anisotropy"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0], \"ior\": 0.9}", "ior"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0], \"ior\": null}", "null"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0], \"shinyness\": 3}",
         "\"shinyness\"; known are scattering"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0], \"curve\": \"lut\"}", "\"lut\""},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0], \"absorption\": [0,0,0]}",
         "duplicate"},
        {"{\"scattering\": [1,2,3], \"absorption\": [0,0,0], \"name\": 3}", "name"},
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        struct dph_material material;
        memset(&material, 7, sizeof material);
        struct dph_material before = material;
        struct dph_error err = {0};
        assert_false(load_text(files[i].text, &material, &err));
        assert_int_equal(err.code, DPH_ERROR_INPUT);
        assert_int_equal(strncmp(err.message, path, strlen(path)), 0);
        if (!strstr(err.message, files[i].word))
            fail_msg("'%s' lacks '%s'", err.message, files[i].word);
        assert_memory_equal(&material, &before, sizeof before);
    }
    struct dph_material material;
    struct dph_error err = {0};
    assert_false(dph_material_load("waxx", &material, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_non_null(strstr(err.message, "wholemilk"));
    assert_false(dph_material_load("no/such.json", &material, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
}

static int make_file(void **state)
{
    (void)state;
    int fd = mkstemp(path);
    return fd < 0 ? -1 : close(fd);
}

static int remove_file(void **state)
{
    (void)state;
    return unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_presets),   cmocka_unit_test(test_medium),
        cmocka_unit_test(test_slab),      cmocka_unit_test(test_curve_shape),
        cmocka_unit_test(test_fit),       cmocka_unit_test(test_constants),
        cmocka_unit_test(test_file),      cmocka_unit_test(test_bad_files),
    };
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
