/* Lights in object space: what a body's placement does to directions and lengths. */
#include <diaphan/light.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

static struct dph_thickness stored(int bands)
{
    struct dph_thickness t = {
        .nvert = 0, .bands = bands, .components = (bands * bands + 3) / 4 * 4};
    for (int l = 0; l < DPH_MAX_BANDS; l++)
        t.scale[l] = 1;
    return t;
}

static struct dph_light_constants constants(const double to_light[3], const struct dph_thickness *t,
                                            const float *matrix, double mm)
{
    struct dph_light light = {.to_light = {to_light[0], to_light[1], to_light[2]},
                              .irradiance = {1, 2, 3}};
    struct dph_light_constants out;
    memset(&out, 0xff, sizeof out);
    dph_light_constants(&light, t, matrix, mm, 0, DPH_WINDOW_NONE, &out);
    return out;
}

static void test_direction(void **state)
{
    (void)state;
    double d[3];
    dph_light_direction(90, 0, d);
    assert_float_equal(d[0], 1, 1e-12);
    dph_light_direction(0, 0, d);
    assert_float_equal(d[2], 1, 1e-12);
    dph_light_direction(150, 30, d);
    assert_float_equal(d[0], .4330127, 1e-6);
    assert_float_equal(d[1], .5, 1e-6);
    assert_float_equal(d[2], -.75, 1e-6);
}

/* Values of the basis at (1,2,3)/sqrt 14, with the Condon-Shortley sign. */
static void test_values(void **state)
{
    (void)state;
    struct dph_thickness t = stored(3);
    t.scale[1] = 2;
    struct dph_light_constants k = constants((const double[3]){10, 20, 30}, &t, identity, .5);
    static const double want[9] = {.282094792,  -.261169028, .391753542,  -.130584514, .156078347,
                                   -.468235042, .292863596,  -.234117521, -.117058760};
    for (int i = 0; i < 9; i++)
        assert_float_equal(k.sh[i / 4][i % 4], .5 * (i > 0 && i < 4 ? 2 : 1) * want[i], 1e-7);
    for (int i = 9; i < 36; i++)
        assert_true(k.sh[i / 4][i % 4] == 0);
    assert_float_equal(k.to_light[2], 3 / sqrt(14), 1e-7);
    assert_true(k.irradiance[0] == 1 && k.irradiance[1] == 2 && k.irradiance[2] == 3);
}

/* A body turned by R under a light R L sees the light L. */
static void test_rotation(void **state)
{
    (void)state;
    struct dph_thickness t = stored(6);
    double c = cos(.7), s = sin(.7), l[3] = {.3, -.5, .8},
           rl[3] = {c * l[0] + s * l[2], l[1], -s * l[0] + c * l[2]};
    const float turn[16] = {(float)c, 0, (float)-s, 0, 0, 1, 0, 0,
                            (float)s, 0, (float)c,  0, 5, 6, 7, 1};
    struct dph_light_constants a = constants(l, &t, identity, 1), b = constants(rl, &t, turn, 1);
    for (int i = 0; i < 36; i++)
        assert_float_equal(a.sh[i / 4][i % 4], b.sh[i / 4][i % 4], 1e-6);
}

/* Scaled by 3: lengths are three times as long. Mirrored: no sign is lost. */
static void test_scale(void **state)
{
    (void)state;
    struct dph_thickness t = stored(6);
    const double l[3] = {.3, -.5, .8}, mirrored[3] = {-.3, -.5, .8};
    for (int k = 0; k < 3; k++) {
        float scale = k == 0 ? 3 : k == 1 ? 1e-6F : 1e6F;
        float m[16] = {0};
        m[0] = m[5] = m[10] = scale;
        m[15] = 1;
        struct dph_light_constants a = constants(l, &t, identity, 1), b = constants(l, &t, m, 1);
        for (int i = 0; i < 36; i++)
            assert_float_equal(a.sh[i / 4][i % 4], b.sh[i / 4][i % 4] / scale, 1e-6);
    }
    float flip[16];
    memcpy(flip, identity, sizeof flip);
    flip[0] = -1;
    struct dph_light_constants a = constants(l, &t, identity, 1),
                               b = constants(mirrored, &t, flip, 1);
    for (int i = 0; i < 36; i++)
        assert_float_equal(a.sh[i / 4][i % 4], b.sh[i / 4][i % 4], 1e-6);
}

/* A unit sphere stretched to an ellipsoid with half axes 1, 2, 4: the chord through its centre
 * along a unit direction w of the world is 2 / |A^-1 w|. The sphere's own chord is 2 in every
 * direction, stored as c_0 = 2 / y_0. */
static void test_ellipsoid(void **state)
{
    (void)state;
    struct dph_thickness t = stored(1);
    const float m[16] = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 4, 0, 0, 0, 0, 1};
    static const double directions[3][3] = {{1, 0, 0}, {0, 0, 1}, {1, 1, 1}};
    for (int i = 0; i < 3; i++) {
        const double *w = directions[i];
        double length = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
        double x = w[0] / length, y = w[1] / length / 2, z = w[2] / length / 4;
        struct dph_light_constants k = constants(w, &t, m, 1);
        assert_float_equal(k.sh[0][0] * 2 / .282094792, 2 / sqrt(x * x + y * y + z * z), 1e-5);
    }
    /* a shear: A e_z = (1, 0, 1); the light (1, 0, 1) is e_z of the object, and a unit of it is
     * sqrt 2 long */
    const float shear[16] = {1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1};
    struct dph_thickness two = stored(2);
    struct dph_light_constants k = constants((const double[3]){1, 0, 1}, &two, shear, 1);
    assert_float_equal(k.sh[0][2], .488602512 * sqrt(2), 1e-6);
    assert_float_equal(k.sh[0][1], 0, 1e-6);
    assert_float_equal(k.sh[0][3], 0, 1e-6);
}

static void test_bands_and_windows(void **state)
{
    (void)state;
    struct dph_thickness t = stored(8);
    struct dph_light light = {.to_light = {1, 2, 3}, .irradiance = {1, 1, 1}};
    struct dph_light_constants all, two, hann;
    dph_light_constants(&light, &t, identity, 1, 0, DPH_WINDOW_NONE,
                        &all); /* 6 of the 8 are drawn */
    assert_true(all.sh[8][3] != 0);
    dph_light_constants(&light, &t, identity, 1, 2, DPH_WINDOW_NONE, &two);
    for (int i = 0; i < 36; i++)
        assert_true(two.sh[i / 4][i % 4] == (i < 4 ? all.sh[i / 4][i % 4] : 0));
    dph_light_constants(&light, &t, identity, 1, 0, DPH_WINDOW_HANN, &hann);
    static const double factor[6] = {1, .93301, .75, .5, .25, .06699};
    for (int l = 0; l < 6; l++)
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            assert_float_equal(hann.sh[i / 4][i % 4], factor[l] * (double)all.sh[i / 4][i % 4],
                               1e-5);
}

static void test_nothing(void **state)
{
    (void)state;
    struct dph_thickness t = stored(6);
    static const struct dph_light_constants zero;
    const float flat[16] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const float twice[16] = {1, 2, 3, 0, 1, 2, 3, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const float lost[16] = {NAN, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const double up[3] = {0, 1, 0}, none[3] = {0, 0, 0}, broken[3] = {NAN, 1, 0},
                 far[3] = {INFINITY, 0, 0};
    const struct dph_light_constants cases[] = {
        constants(none, &t, identity, 1), constants(broken, &t, identity, 1),
        constants(far, &t, identity, 1),  constants(up, &t, flat, 1),
        constants(up, &t, twice, 1),      constants(up, &t, lost, 1)};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_memory_equal(&cases[i], &zero, sizeof zero);
}

/* Seen from a point: direction, the inverse square, and a spot's cone, which is full up to nine
 * tenths of its angle and dark beyond it. */
static void test_local(void **state)
{
    (void)state;
    struct dph_light distant = {.to_light = {1, 2, 3}, .irradiance = {4, 5, 6}, .angle = 3}, out;
    dph_light_at(&distant, (const double[3]){7, 8, 9}, &out);
    assert_memory_equal(&out, &distant, sizeof out);
    struct dph_light light = {
        .kind = DPH_LIGHT_POINT, .position = {1, 2, 3}, .irradiance = {4, 8, 12}};
    dph_light_at(&light, (const double[3]){1, 2, 1}, &out);
    assert_true(out.kind == DPH_LIGHT_DISTANT && out.to_light[0] == 0 && out.to_light[2] == 1);
    for (int c = 0; c < 3; c++)
        assert_float_equal(out.irradiance[c], 1 + c, 1e-12);
    dph_light_at(&light, light.position, &out);
    assert_true(out.to_light[0] == 0 && out.to_light[1] == 0 && out.to_light[2] == 0);
    light.kind = DPH_LIGHT_SPOT;
    light.to_light[2] = 5;
    light.angle = 20;
    static const double share[][2] = {{0, 1}, {17.9, 1}, {20.1, 0}, {170, 0}};
    for (size_t i = 0; i < 4; i++) {
        double a = share[i][0] * 3.14159265358979323846 / 180;
        dph_light_at(&light, (const double[3]){1 + 2 * sin(a), 2, 3 - 2 * cos(a)}, &out);
        assert_float_equal(out.irradiance[1], 2 * share[i][1], 1e-9);
    }
    dph_light_at(&light, (const double[3]){1 + 2 * sin(.33), 2, 3 - 2 * cos(.33)}, &out);
    assert_true(out.irradiance[1] > .1 && out.irradiance[1] < 1.9);
}

/* A disc's values are the mean of those of its points. */
static void test_disc(void **state)
{
    (void)state;
    const double pi = 3.14159265358979323846;
    struct dph_thickness t = stored(6);
    for (double angle = .001; angle < 91; angle = angle < 1 ? angle * 30 : angle + 20) {
        struct dph_light light = {.to_light = {0, .6, .8}, .irradiance = {1, 1, 1}, .angle = angle};
        struct dph_light_constants got, one;
        double mean[36] = {0};
        const int rings = 200, steps = 64;
        dph_light_constants(&light, &t, identity, 1, 0, DPH_WINDOW_NONE, &got);
        light.angle = 0;
        for (int r = 0; r < rings; r++) { /* rings of equal area */
            double z = 1 - (1 - cos(angle * pi / 180)) * (r + .5) / rings, s = sqrt(1 - z * z);
            for (int i = 0; i < steps; i++) {
                double x = s * cos(2 * pi * i / steps), y = s * sin(2 * pi * i / steps);
                light.to_light[0] = x;
                light.to_light[1] = .6 * z + .8 * y;
                light.to_light[2] = .8 * z - .6 * y;
                dph_light_constants(&light, &t, identity, 1, 0, DPH_WINDOW_NONE, &one);
                for (int k = 0; k < 36; k++)
                    mean[k] += (double)one.sh[k / 4][k % 4] / (rings * steps);
            }
        }
        for (int k = 0; k < 36; k++)
            assert_float_equal(got.sh[k / 4][k % 4], mean[k], 1e-4);
    }
}

/* Two bands in front, six from the side on, and nothing but a slope between; the length of a
 * direction does not matter, and without one all bands stay. */
static void test_detail(void **state)
{
    (void)state;
    const double eye[3] = {0, 0, 7}, none[3] = {0, 0, 0};
    double last = 2;
    for (int degrees = 0; degrees <= 180; degrees++) {
        double angle = degrees * 3.14159265358979323846 / 180;
        const double light[3] = {.3 * sin(angle), 0, .3 * cos(angle)};
        double detail = dph_light_detail(light, eye);
        assert_true(detail >= last && detail < last + .2);
        if (degrees <= 25)
            assert_true(detail == 2);
        if (degrees >= 70)
            assert_true(detail == 6);
        last = detail;
    }
    assert_true(dph_light_detail(none, eye) == 6 && dph_light_detail(eye, none) == 6);
    struct dph_light_constants constants;
    for (int tenths = 20; tenths <= 60; tenths++) {
        for (int i = 0; i < 36; i++)
            constants.sh[i / 4][i % 4] = 1;
        dph_light_fade(&constants, .1 * tenths);
        for (int i = 0; i < 36; i++) {
            int l = (int)sqrt(i);
            double beyond = .1 * tenths - l, value = (double)constants.sh[i / 4][i % 4];
            if (beyond <= 0)
                assert_true(value == 0);
            else if (beyond >= 1)
                assert_true(value == 1);
            else
                assert_true(value > 0 && value <= 1.5 * beyond);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_direction), cmocka_unit_test(test_values),
        cmocka_unit_test(test_rotation),  cmocka_unit_test(test_scale),
        cmocka_unit_test(test_ellipsoid), cmocka_unit_test(test_bands_and_windows),
        cmocka_unit_test(test_nothing),   cmocka_unit_test(test_local),
        cmocka_unit_test(test_disc),      cmocka_unit_test(test_detail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
