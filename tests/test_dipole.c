/* The dipole and its hierarchy: published and closed-form values, planes, spheres, brute force. */
#include "shapes.h"

#include "bake/dipole.h"
#include "bake/octree.h"
#include "bake/refine.h"

#include <diaphan/environment.h>
#include <diaphan/scene.h>
#include <diaphan/transfer.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static struct dph_transfer bake(const struct dph_mesh *mesh, const struct dph_transfer_params *params,
                                struct dph_transfer_report *report)
{
    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct dph_transfer transfer;
    struct dph_error err = {0};
    if (!dph_transfer_bake(&input, params, &transfer, report, &err))
        fail_msg("%s", err.message);
    return transfer;
}

static struct dph_transfer_params medium(double scattering, double absorption)
{
    struct dph_transfer_params params = dph_transfer_defaults();
    params.directions = 512;
    for (int c = 0; c < 3; c++) {
        params.scattering[c] = scattering * (1 + .5 * c);
        params.absorption[c] = absorption * (1 + 3 * c);
    }
    return params;
}

/* Skin 1, red, of Jensen et al. 2001. */
static void published_values(void **state)
{
    (void)state;
    assert_float_equal(dph_fresnel_diffuse(1.3), .4448, 5e-5);
    assert_float_equal(dph_fresnel_diffuse(1.5), .5967, 5e-5);
    assert_true(dph_fresnel_diffuse(1) == 0);
    assert_float_equal(dph_fresnel_transmittance(1.5, 1), .96, 1e-12);
    assert_true(dph_fresnel_transmittance(1, .3) == 1);
    assert_float_equal(dph_fresnel_transmittance(1.5, 1e-9), 0, 1e-6);
    struct dph_dipole skin;
    dph_dipole_init(&skin, .74, .032, 1.3);
    assert_float_equal(skin.real, 1.2953, 1e-4);
    assert_float_equal(skin.image, 5.7894, 1e-3);
    assert_float_equal(skin.transport, .27224, 1e-5);
    static const double r[4] = {0, 1, 2, 4}, want[4] = {.04443, .022019, .0072614, .0014517};
    for (int i = 0; i < 4; i++)
        assert_float_equal(dph_dipole_at(&skin, r[i]), want[i], 1e-5);
    assert_float_equal(dph_dipole_total(&skin), .436, 1e-3);
}

/* The whole plane and discs, summed over thin rings. */
static void integrals(void **state)
{
    (void)state;
    static const double media[][3] = {{.74, .032, 1.3}, {1.6, .0012, 1}, {.2, 1, 1.5}, {3, .01, 1}};
    for (size_t n = 0; n < 4; n++) {
        struct dph_dipole d;
        dph_dipole_init(&d, media[n][0], media[n][1], media[n][2]);
        double sum = 0, r = 0, reach = 40 / d.transport, step = d.real / 2000;
        assert_float_equal(dph_dipole_disc(&d, 0), 0, 1e-12);
        for (double next = 10 * d.real; r < reach; r += step) {
            if (r + step > next) {
                assert_float_equal(dph_dipole_disc(&d, r), sum, 1e-6);
                next *= 3;
            }
            if (r > 100 * d.real)
                step = r / 2e5 * 10;
            double m = r + step / 2;
            sum += dph_dipole_at(&d, m) * 2 * PI * m * step;
        }
        assert_float_equal(sum, dph_dipole_total(&d), 1e-5);
    }
    struct dph_dipole none;
    dph_dipole_init(&none, 0, 1, 1.3);
    assert_true(dph_dipole_total(&none) == 0 && dph_dipole_at(&none, 1) == 0);
    dph_dipole_init(&none, 1, 0, 1); /* no absorption: all comes back */
    assert_float_equal(dph_dipole_total(&none), 1, 1e-12);
}

/* A sheet of squares in the plane z = 0, seen from above, and its middle vertex. */
static struct dph_mesh make_plane(double side, uint32_t n, size_t *middle)
{
    struct dph_mesh mesh = make_room((size_t)(n + 1) * (n + 1), 2 * (size_t)n * n);
    for (uint32_t j = 0; j <= n; j++)
        for (uint32_t i = 0; i <= n; i++)
            add_vertex(&mesh, side * (i / (double)n - .5), side * (j / (double)n - .5), 0);
    for (uint32_t j = 0; j < n; j++)
        for (uint32_t i = 0; i < n; i++) {
            uint32_t a = j * (n + 1) + i;
            add_triangle(&mesh, a, a + 1, a + n + 2);
            add_triangle(&mesh, a, a + n + 2, a + n + 1);
        }
    *middle = (size_t)(n / 2) * (n + 1) + n / 2;
    return mesh;
}

/* An evenly lit plane gives M = Rd_total E, for every coefficient: light from overhead or
 * anywhere. Whether its triangles are finer than the mean free path, are divided until they are,
 * or stay as coarse as six of them because the samples are rationed. */
static void white_planes(void **state)
{
    (void)state;
    static const struct {
        uint32_t n;
        size_t most;
        double allowed;
    } cases[] = {{120, 0, .025}, {2, 200000, .025}, {20, 0, .05}};
    for (size_t k = 0; k < 3; k++)
        for (int dielectric = 0; dielectric < 2; dielectric++) {
            size_t middle;
            struct dph_mesh mesh = make_plane(120, cases[k].n, &middle);
            struct dph_transfer_params params = medium(1, .05);
            params.ior = dielectric ? 1.4 : 1;
            params.most_samples = cases[k].most;
            struct dph_transfer_report report;
            struct dph_transfer t = bake(&mesh, &params, &report);
            params.kind = DPH_TRANSFER_IRRADIANCE;
            struct dph_transfer e = bake(&mesh, &params, NULL);
            double worst = 0;
            for (size_t c = 0; c < 3; c++) {
                struct dph_dipole d;
                dph_dipole_init(&d, params.scattering[c], params.absorption[c], params.ior);
                for (size_t i = 0; i < 36; i++)
                    worst = fmax(worst, fabs((double)t.vector[middle * 108 + 36 * c + i] * PI / dph_dipole_total(&d) -
                                             (double)e.vector[middle * 36 + i]) / (double)e.vector[middle * 36]);
                assert_true(report.returned[c] < 1.03 * dph_dipole_total(&d));
            }
            print_message("plane of %u x %u squares, index %.1f, %zu samples: error %.4f\n", (unsigned)cases[k].n,
                          (unsigned)cases[k].n, params.ior, report.samples, worst);
            assert_true(worst < cases[k].allowed);
            assert_true(k != 1 || (report.samples > 5000 && report.spacing <= report.spacing_wanted));
            assert_true(k != 2 || report.spacing > report.spacing_wanted);
            dph_transfer_finish(&t);
            dph_transfer_finish(&e);
            dph_mesh_finish(&mesh);
        }
}

static double relative(const struct dph_transfer *a, const struct dph_transfer *b)
{
    double error = 0, norm = 0;
    for (size_t i = 0; i < a->npos * a->length; i++) {
        error += pow((double)a->vector[i] - (double)b->vector[i], 2);
        norm += pow((double)b->vector[i], 2);
    }
    return sqrt(error / norm);
}

/* Groups against every sample for itself, on a scanned body; the worst position as well as all. */
static void hierarchy(void **state)
{
    (void)state;
    struct dph_error err;
    struct dph_scene *scene = dph_scene_load(DPH_DATA "/models/bunny_closed_lr.obj", &err);
    if (!scene) {
        print_message("skipped: %s\n", err.message);
        skip();
    }
    static const double angles[3] = {.05, .02, .005};
    double before = 1;
    struct dph_transfer_params params = medium(10, .05);
    params.most_samples = 0;
    params.solid_angle = 0;
    struct dph_transfer exact = bake(&scene->body[0].mesh, &params, NULL);
    for (int k = 0; k < 3; k++) {
        params.solid_angle = angles[k];
        struct dph_transfer t = bake(&scene->body[0].mesh, &params, NULL);
        double error = relative(&t, &exact), worst = 0;
        for (size_t p = 0; p < t.npos; p++)
            worst = fmax(worst, fabs((double)t.vector[p * 108] / (double)exact.vector[p * 108] - 1));
        print_message("solid angle %.3f: relative error %.5f, of one position %.4f\n", angles[k], error, worst);
        assert_true(error < .01 && worst < .03 && error < before);
        before = error;
        dph_transfer_finish(&t);
    }
    dph_transfer_finish(&exact);
    dph_scene_destroy(scene);
}

/* Against a plain double sum of the published formula at points, where samples are much denser
 * than the mean free path. */
static void plain_sum(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 96, 48);
    struct dph_transfer_params params = medium(3, .2);
    struct dph_transfer t = bake(&mesh, &params, NULL);
    params.kind = DPH_TRANSFER_IRRADIANCE;
    struct dph_transfer e = bake(&mesh, &params, NULL);
    for (size_t p = 0; p < t.npos; p += 501)
        for (size_t c = 0; c < 3; c++) {
            struct dph_dipole d;
            dph_dipole_init(&d, params.scattering[c], params.absorption[c], 1);
            double sum[36] = {0}, scale = 0;
            for (size_t q = 0; q < t.npos; q++) {
                double r2 = 0;
                for (size_t k = 0; k < 3; k++)
                    r2 += pow((double)mesh.position[3 * p + k] - (double)mesh.position[3 * q + k], 2);
                double w = dph_dipole_at(&d, sqrt(r2)) * e.area[q];
                for (size_t i = 0; i < 36; i++)
                    sum[i] += w * e.vector[q * 36 + i] / PI;
            }
            for (int i = 0; i < 36; i++)
                scale = fmax(scale, fabs(sum[i]));
            for (size_t i = 0; i < 36; i++)
                assert_float_equal(t.vector[p * 108 + 36 * c + i], sum[i], .01 * scale);
        }
    dph_transfer_finish(&t);
    dph_transfer_finish(&e);
    dph_mesh_finish(&mesh);
}

/* A light's radiance at a position. */
static double radiance(const struct dph_transfer *t, size_t p, size_t channel, const double to[3])
{
    double y[36], sum = 0;
    dph_sh_eval(6, to, y);
    for (size_t i = 0; i < 36; i++)
        sum += (double)t->vector[p * 108 + 36 * channel + i] * y[i];
    return sum;
}

/* A sphere under any light depends on mu alone, and gives back no more than it gets. */
static void spheres(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 96, 48);
    struct dph_transfer_params params = medium(4, .1);
    params.directions = 4096;
    struct dph_transfer_report report;
    struct dph_transfer t = bake(&mesh, &params, &report);
    for (int c = 0; c < 3; c++) {
        struct dph_dipole d;
        dph_dipole_init(&d, params.scattering[c], params.absorption[c], 1);
        print_message("sphere: %.3f of the light comes back, of a half space %.3f\n", report.returned[c],
                      dph_dipole_total(&d));
        assert_true(report.returned[c] < 1 && report.returned[c] > .7 * dph_dipole_total(&d));
    }
    double low[20], high[20], top = 0;
    for (int b = 0; b < 20; b++)
        low[b] = INFINITY, high[b] = -INFINITY;
    uint64_t seed = 3;
    for (int k = 0; k < 8; k++) {
        double to[3];
        random_direction(&seed, to);
        for (size_t p = 0; p < t.npos; p++) {
            const float *n = mesh.position + 3 * p;
            double mu = to[0] * n[0] + to[1] * n[1] + to[2] * n[2], at = (mu + 1) * 10;
            int b = (int)at;
            if (b > 19 || at - b < .45 || at - b > .55) /* narrow slices: mu varies by .01 */
                continue;
            double value = radiance(&t, p, 0, to);
            low[b] = fmin(low[b], value);
            high[b] = fmax(high[b], value);
            top = fmax(top, value);
        }
    }
    for (int b = 0; b < 20; b++)
        assert_true(high[b] - low[b] < .03 * top);
    /* light comes through to the far side, and around the terminator */
    assert_true(low[9] > .02 * top && low[19] > 5 * low[9]);
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

/* Any unit of length gives the same; media without scattering nothing; without absorption finite
 * numbers. */
static void units_and_limits(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_box(1, 2, 3, 6);
    struct dph_transfer_params params = medium(4, .1);
    struct dph_transfer t = bake(&mesh, &params, NULL);
    for (int power = -30; power <= 30; power += 60) {
        struct dph_mesh scaled = make_box(1, 2, 3, 6);
        struct dph_transfer_params p = params;
        for (size_t i = 0; i < 3 * scaled.nvert; i++)
            scaled.position[i] = ldexpf(scaled.position[i], power);
        for (int c = 0; c < 3; c++) {
            p.scattering[c] = ldexp(p.scattering[c], -power);
            p.absorption[c] = ldexp(p.absorption[c], -power);
        }
        struct dph_transfer again = bake(&scaled, &p, NULL);
        assert_true(relative(&again, &t) < 1e-4);
        dph_transfer_finish(&again);
        dph_mesh_finish(&scaled);
    }
    dph_transfer_finish(&t);
    static const double limits[][2] = {{0, 1}, {0, 0}, {1, 0}, {1e-25, 1e-25}, {1e25, 1e25}, {1e-20, 1e20}, {1e6, 0}};
    for (size_t n = 0; n < sizeof limits / sizeof *limits; n++) {
        params.most_samples = 1000;
        for (int c = 0; c < 3; c++) {
            params.scattering[c] = limits[n][0];
            params.absorption[c] = limits[n][1];
        }
        t = bake(&mesh, &params, NULL);
        for (size_t i = 0; i < t.npos * t.length; i++)
            assert_true(isfinite(t.vector[i]) && (limits[n][0] > 0 || t.vector[i] == 0));
        dph_transfer_finish(&t);
    }
    dph_mesh_finish(&mesh);
}

/* Division keeps a closed body closed, its volume and area, its first positions; and keeps to
 * its ration. */
static void refinement(void **state)
{
    (void)state;
    struct dph_mesh box = make_box(1, 2, 5, 1);
    uint32_t position_of[24], index[36];
    float position[72];
    size_t npos = dph_mesh_weld(box.position, 12, box.nvert, position_of, NULL);
    for (size_t i = 0; i < 36; i++)
        index[i] = position_of[box.index[i]];
    for (size_t v = 0; v < 24; v++)
        memcpy(position + 3 * position_of[v], box.position + 3 * v, 12);
    for (double spacing = 3; spacing > .05; spacing /= 2.1) {
        struct dph_refined r;
        assert_true(dph_refine(position, npos, index, 12, spacing, 1 << 20, &r, NULL));
        assert_true(r.longest <= spacing);
        assert_memory_equal(r.position, position, npos * 12);
        struct dph_mesh mesh = {.nvert = r.npos, .ntri = r.ntri, .position = r.position, .index = r.index};
        struct dph_mesh_stats stats;
        assert_true(dph_mesh_measure(&mesh, &stats, NULL));
        assert_true(stats.closed);
        assert_float_equal(stats.area, 34, 1e-4);
        assert_float_equal(stats.volume, 10, 1e-4);
        size_t all = r.npos;
        dph_refined_finish(&r);
        assert_true(dph_refine(position, npos, index, 12, spacing, all / 2, &r, NULL));
        assert_true(r.npos <= (all / 2 > npos ? all / 2 : npos));
        dph_refined_finish(&r);
    }
    dph_mesh_finish(&box);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(published_values), cmocka_unit_test(integrals), cmocka_unit_test(white_planes),
        cmocka_unit_test(hierarchy), cmocka_unit_test(plain_sum), cmocka_unit_test(spheres),
        cmocka_unit_test(units_and_limits), cmocka_unit_test(refinement),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
