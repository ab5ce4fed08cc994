/* The response bake against closed forms, against walks in an exact sphere that share no code with
 * it, and against itself without sharing. */
#include "shapes.h"

#include <diaphan/response_bake.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

static struct dph_bake_input input_of(const struct dph_mesh *mesh)
{
    return (struct dph_bake_input){.position = mesh->position, .nvert = mesh->nvert,
                                   .index = mesh->index, .ntri = mesh->ntri};
}

static struct dph_response_bake_params medium(double r, double g, double b, double absorption)
{
    struct dph_response_bake_params p = dph_response_bake_defaults();
    const double scattering[3] = {r, g, b};
    for (int c = 0; c < 3; c++) {
        p.scattering[c] = scattering[c];
        p.absorption[c] = absorption;
    }
    p.bands = 4;
    p.noise = UNDER_SANITIZER ? .3 : .05;
    p.directions = 512;
    return p;
}

static struct dph_transfer bake(const struct dph_mesh *mesh,
                                const struct dph_response_bake_params *params,
                                struct dph_response_bake_report *report)
{
    struct dph_bake_input input = input_of(mesh);
    struct dph_response_bake_report local;
    struct dph_transfer transfer;
    struct dph_error err = {0};
    if (!dph_response_bake(&input, params, &transfer, report ? report : &local, &err))
        fail_msg("%s", err.message);
    return transfer;
}

/* Two flat boxes, `gap` apart. */
static struct dph_mesh two_sheets(double side, double thick, double gap, uint32_t n)
{
    struct dph_mesh box = make_box(side, side, thick, n);
    struct dph_mesh mesh = make_room(2 * box.nvert, 2 * box.ntri);
    for (uint32_t copy = 0; copy < 2; copy++) {
        for (size_t v = 0; v < box.nvert; v++) {
            const float *p = box.position + 3 * v;
            add_vertex(&mesh, (double)p[0], (double)p[1], (double)p[2] + copy * (thick + gap));
        }
        uint32_t base = copy * (uint32_t)box.nvert;
        for (size_t t = 0; t < box.ntri; t++)
            add_triangle(&mesh, base + box.index[3 * t], base + box.index[3 * t + 1],
                         base + box.index[3 * t + 2]);
    }
    dph_mesh_finish(&box);
    return mesh;
}

/* Coefficient l of a function of the angle to the normal, from the 2l+1 of a transfer vector. */
static double zonal(const float *coefficient, int l, const double normal[3])
{
    double y[64], sum = 0;
    dph_sh_eval(l + 1, normal, y);
    for (int i = l * l; i < (l + 1) * (l + 1); i++)
        sum += (double)coefficient[i] * y[i];
    return sum * sqrt(4 * PI / (2 * l + 1));
}

static double legendre(int l, double x)
{
    double a = 1, b = x;
    for (int k = 1; k < l; k++) {
        double c = ((2 * k + 1) * x * b - k * a) / (k + 1);
        a = b, b = c;
    }
    return l ? b : a;
}

/* No scattering, sphere: max(0, -mu) / pi exp(-sa 2 R |mu|). */
static void light_only_passes(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1.5, 192, 96);
    struct dph_response_bake_params p = medium(0, 0, 0, .3);
    struct dph_response_bake_report report;
    p.absorption[1] = 0, p.absorption[2] = 2;
    p.directions = 4096;
    struct dph_transfer t = bake(&mesh, &p, &report);
    assert_true(report.reached && report.walks == 0 && report.noise == 0);
    assert_int_equal(t.length, 48);
    double worst = 0;
    for (int c = 0; c < 3; c++)
        for (int l = 0; l < 4; l++) {
            double exact = 0;
            for (int i = 0; i < 10000; i++) {
                double mu = -(i + .5) / 10000;
                exact += 2 * PI * -mu / PI * exp(p.absorption[c] * 2 * 1.5 * mu) *
                         legendre(l, mu) / 10000 * sqrt((2 * l + 1) / (4 * PI));
            }
            for (size_t v = 0; v < t.npos; v += 61) {
                const float *at = mesh.position + 3 * v;
                double n[3] = {(double)at[0] / 1.5, (double)at[1] / 1.5, (double)at[2] / 1.5};
                worst = fmax(worst, fabs(zonal(t.vector + v * 48 + c * 16, l, n) - exact));
            }
        }
    printf("no scattering: coefficients within %.5f\n", worst);
    assert_true(worst < 2e-3);
    dph_transfer_finish(&t);
    p.straight = false; /* then nothing is left */
    t = bake(&mesh, &p, &report);
    for (size_t i = 0; i < t.npos * t.length; i++)
        assert_true(t.vector[i] == 0);
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

/* A walk in an exact sphere of radius 1 that starts at (0, 0, 1): cosine of the direction in which
 * it leaves, and its weight. */
static double sphere_walk(uint64_t *seed, double scattering, double absorption, double *weight)
{
    double x[3] = {0, 0, 1}, d[3];
    double c = sqrt(next_random(seed)), a = 2 * PI * next_random(seed), s = sqrt(1 - c * c);
    d[0] = s * cos(a), d[1] = s * sin(a), d[2] = -c;
    *weight = 1;
    for (;;) {
        double b = x[0] * d[0] + x[1] * d[1] + x[2] * d[2];
        double q = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] - 1;
        double out = -b + sqrt(fmax(0, b * b - q));
        double flight = -log(1 - next_random(seed)) / (scattering + absorption);
        if (flight >= out)
            return d[2];
        for (int k = 0; k < 3; k++)
            x[k] += flight * d[k];
        *weight *= scattering / (scattering + absorption);
        random_direction(seed, d);
    }
}

static void sphere_agrees_with_walks(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 64, 32);
    struct dph_response_bake_params p = medium(4, 6, 2, .2);
    struct dph_response_bake_report report;
    struct dph_transfer t = bake(&mesh, &p, &report);
    size_t ncoef = 16;
    printf("sphere: %zu positions, noise %.3f, %.0f walks a position, %.1f s\n", report.positions,
           report.noise, report.walks / (double)report.positions, report.seconds_walk);
    int walks = UNDER_SANITIZER ? 20000 : 400000;
    for (int c = 0; c < 3; c++) {
        double sum[4] = {0}, square[4] = {0};
        uint64_t seed = 11 + (uint64_t)c;
        for (int i = 0; i < walks; i++) {
            double weight, mu = sphere_walk(&seed, p.scattering[c], .2, &weight);
            for (int l = 0; l < 4; l++) {
                double v = weight * legendre(l, mu) * sqrt((2 * l + 1) / (4 * PI));
                sum[l] += v, square[l] += v * v;
            }
        }
        for (int l = 0; l < 4; l++) {
            double mean = sum[l] / walks,
                   error = sqrt((square[l] / walks - mean * mean) / walks), own = 0, spread = 0;
            for (size_t v = 0; v < t.npos; v++) {
                double n[3] = {mesh.position[3 * v], mesh.position[3 * v + 1],
                               mesh.position[3 * v + 2]};
                double z = zonal(t.vector + v * t.length + (size_t)c * ncoef, l, n);
                own += z / (double)t.npos;
                spread += z * z / (double)t.npos;
            }
            spread = sqrt(fmax(0, spread - own * own));
            /* the mesh's own error: chords a little inside the sphere, .1 % here */
            double tolerance = 3 * hypot(error, spread / sqrt((double)t.npos)) + 1.5e-3;
            printf("  channel %d, band %d: %.5f, walks %.5f, tolerance %.5f, spread %.5f\n", c, l,
                   own, mean, tolerance, spread);
            assert_true(fabs(own - mean) < tolerance);
            assert_true(spread < 2 * p.noise * .5); /* rotation symmetric within the noise */
        }
    }
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

/* Even light comes back whole where nothing is absorbed. */
static void white_furnace(void **state)
{
    (void)state;
    struct dph_mesh shell = make_room(2000, 4000); /* with a cavity */
    add_sphere(&shell, 1, 24, 12, false);
    add_sphere(&shell, .8, 24, 12, true);
    struct dph_mesh mesh[4] = {make_box(1, 2, 1.5, 4), shell, two_sheets(2, .2, .02, 6),
                               make_sphere(1, 40, 20)};
    for (int m = 0; m < 4; m++) {
        struct dph_response_bake_params p = medium(3, 5, 8, 0);
        struct dph_response_bake_report r;
        struct dph_transfer t = bake(&mesh[m], &p, &r);
        double worst = 0;
        for (size_t v = 0; v < t.npos; v++)
            for (size_t c = 0; c < 3; c++)
                worst = fmax(worst,
                             fabs((double)t.vector[v * t.length + 16 * c] * sqrt(4 * PI) - 1));
        printf("furnace %d: %.4f %.4f %.4f of 1, at worst %.3f off, noise %.3f, lost %g of %g\n", m,
               r.returned[0], r.returned[1], r.returned[2], worst, r.noise, r.lost, r.walks);
        for (int c = 0; c < 3; c++)
            assert_true(fabs(r.returned[c] - 1) < (UNDER_SANITIZER ? .05 : .01));
        assert_true(worst < 6 * p.noise);
        assert_true(r.lost <= 1e-5 * r.walks && r.capped == 0);
        dph_transfer_finish(&t);
        dph_mesh_finish(&mesh[m]);
    }
}

/* |a - b|^2 over |b|^2, weighted with area. */
static double distance(const struct dph_transfer *a, const struct dph_transfer *b)
{
    double sum = 0, all = 0;
    for (size_t v = 0; v < a->npos; v++)
        for (size_t i = 0; i < a->length; i++) {
            double x = (double)a->vector[v * a->length + i];
            double y = (double)b->vector[v * a->length + i];
            sum += (double)a->area[v] * (x - y) * (x - y);
            all += (double)a->area[v] * y * y;
        }
    return sum / all;
}

/* Shared walks and walks of every position's own agree as well as their estimated noise says. */
static void sharing_changes_nothing(void **state)
{
    (void)state;
    struct dph_mesh mesh[3] = {make_box(1, 2, 1.5, 4), two_sheets(1, .25, .02, 5),
                               make_sphere(1, 32, 16)};
    for (int m = 0; m < 3; m++) {
        struct dph_response_bake_params p = medium(2, 3, 1.5, .1);
        struct dph_response_bake_report shared, plain;
        p.smooth = false;
        struct dph_transfer a = bake(&mesh[m], &p, &shared);
        p.plain = true;
        p.seed = 77;
        struct dph_transfer b = bake(&mesh[m], &p, &plain);
        double told = shared.noise * shared.noise + plain.noise * plain.noise;
        double ratio = distance(&a, &b) / told;
        printf("shared %.0f, plain %.0f walks a position; differ by %.2f of the noise\n",
               shared.walks / (double)a.npos, plain.walks / (double)a.npos, sqrt(ratio));
        assert_true(ratio > .7 && ratio < 1.35);
        dph_transfer_finish(&a);
        dph_transfer_finish(&b);
        dph_mesh_finish(&mesh[m]);
    }
}

/* The estimate says how far a bake is from one with sixteen times its walks: as it is, and smoothed,
 * where it is cautious but not by much. */
static void noise_is_honest(void **state)
{
    (void)state;
    struct dph_mesh mesh[3] = {make_sphere(1, 48, 24), make_box(1, 2, 1.5, 16),
                               two_sheets(1, .25, .02, 16)};
    for (int m = 0; m < 3; m++) {
        struct dph_response_bake_params p = medium(4, 5, 6, .05);
        struct dph_response_bake_report report, rough, fine;
        p.noise = 0;
        p.most_walks = 96;
        struct dph_transfer smooth = bake(&mesh[m], &p, &report);
        p.smooth = false;
        struct dph_transfer plain = bake(&mesh[m], &p, &rough);
        p.most_walks *= UNDER_SANITIZER ? 4 : 16;
        p.seed = 5;
        struct dph_transfer truth = bake(&mesh[m], &p, &fine);
        double found = sqrt(distance(&plain, &truth)), told = hypot(rough.noise, fine.noise);
        double found_smooth = sqrt(distance(&smooth, &truth));
        double told_smooth = hypot(report.noise, fine.noise);
        printf("noise told %.4f, found %.4f; smoothed: told %.4f, found %.4f; walks %g and %g\n",
               told, found, told_smooth, found_smooth, rough.walks, fine.walks);
        assert_true(fabs(report.noise_walks / rough.noise - 1) < 1e-6);
        assert_true(fabs(found / told - 1) < .1);
        assert_true(found_smooth < 1.1 * told_smooth && found_smooth > .7 * told_smooth);
        assert_true(found_smooth < found);
        dph_transfer_finish(&smooth);
        dph_transfer_finish(&plain);
        dph_transfer_finish(&truth);
        dph_mesh_finish(&mesh[m]);
    }
}

static void same_bytes_for_any_threads(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 32, 16);
    struct dph_response_bake_params p = medium(3, 4, 5, .1);
    p.noise = .5;
    p.threads = 1;
    struct dph_transfer one = bake(&mesh, &p, NULL);
    const int threads[2] = {2, 5};
    for (int i = 0; i < 2; i++) {
        p.threads = threads[i];
        struct dph_transfer more = bake(&mesh, &p, NULL);
        assert_memory_equal(one.vector, more.vector, one.npos * one.length * sizeof(float));
        dph_transfer_finish(&more);
    }
    p.seed = 2;
    struct dph_transfer other = bake(&mesh, &p, NULL);
    assert_memory_not_equal(one.vector, other.vector, one.npos * one.length * sizeof(float));
    dph_transfer_finish(&other);
    dph_transfer_finish(&one);
    dph_mesh_finish(&mesh);
}

/* Anisotropic walks: back-to-front scattering brings more light through a slab than even one. */
static void anisotropy_counts(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 16, 8);
    double returned[3];
    for (int i = 0; i < 3; i++) {
        struct dph_response_bake_params p = medium(4, 4, 4, 0);
        struct dph_response_bake_report r;
        p.anisotropy = i == 0 ? -.5 : i == 1 ? 0 : .8;
        p.noise = UNDER_SANITIZER ? .5 : .1;
        struct dph_transfer t = bake(&mesh, &p, &r);
        double through = 0; /* light from behind the surface */
        for (size_t v = 0; v < t.npos; v++) {
            double n[3] = {mesh.position[3 * v], mesh.position[3 * v + 1],
                           mesh.position[3 * v + 2]};
            through -= zonal(t.vector + v * t.length, 1, n) / (double)t.npos;
        }
        returned[i] = through;
        assert_true(fabs(r.returned[0] - 1) < .03);
        dph_transfer_finish(&t);
    }
    assert_true(returned[0] < returned[1] && returned[1] < returned[2]);
    dph_mesh_finish(&mesh);
}

static bool count_calls(void *user, double fraction)
{
    double *last = user;
    assert_true(fraction >= *last && fraction <= 1);
    *last = fraction;
    return true;
}

static bool stop_halfway(void *user, double fraction)
{
    (void)user;
    return fraction < .5;
}

/* A walk as sphere_walk's, against a direction of sight in the plane of x and z, in a medium without
 * absorption. False: it left without being scattered. */
static bool seen_walk(uint64_t *seed, double scattering, double eye, double out_direction[3])
{
    double x[3] = {0, 0, 1}, *d = out_direction;
    d[0] = -sqrt(1 - eye * eye), d[1] = 0, d[2] = -eye;
    for (bool scattered = false;; scattered = true) {
        double b = x[0] * d[0] + x[1] * d[1] + x[2] * d[2];
        double q = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] - 1;
        double out = -b + sqrt(fmax(0, b * b - q));
        double flight = -log(1 - next_random(seed)) / scattering;
        if (flight >= out)
            return scattered;
        for (int k = 0; k < 3; k++)
            x[k] += flight * d[k];
        random_direction(seed, d);
    }
}

static struct dph_response *form_of(const struct dph_transfer *rows, enum dph_response_form form,
                                    enum dph_store store)
{
    struct dph_response_params params = dph_response_defaults();
    struct dph_error err = {0};
    params.form = form;
    params.bands = 4;
    params.store = store;
    struct dph_response *response = dph_response_create(rows, &params, NULL, &err);
    if (!response)
        fail_msg("%s", err.message);
    return response;
}

/* What an eye sees of a thin sphere, from flat to straight, under even light and as the moment of
 * light along its direction: walks in an exact sphere against the average over views and against
 * the average with its gain. */
static void eyes_see_more_than_the_average(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 64, 32);
    struct dph_bake_input input = input_of(&mesh);
    struct dph_response_bake_params p = medium(2, 2, 2, 0);
    struct dph_view_gain other;
    struct dph_error err = {0};
    p.straight = false;
    struct dph_transfer t = bake(&mesh, &p, NULL);
    struct dph_response *response = form_of(&t, DPH_RESPONSE_ROOT, DPH_STORE_SNORM8);
    p.threads = 1;
    if (!dph_response_view_fit(&input, &p, response, &response->view, &err))
        fail_msg("%s", err.message);
    size_t top = 0; /* the vertex that is farthest along z */
    for (size_t v = 1; v < mesh.nvert; v++)
        top = mesh.position[3 * v + 2] > mesh.position[3 * top + 2] ? v : top;
    double error[2] = {0};
    uint64_t seed = 5;
    for (int e = 0; e < 4; e++) {
        enum { LIGHTS = 2048 };
        const int walks = UNDER_SANITIZER ? 20000 : 200000;
        double cosine = (e + .5) / 4, eye[3] = {sqrt(1 - cosine * cosine), 0, cosine};
        double exact[2] = {0}, got[2][2] = {{0}}, w[3];
        for (int i = 0; i < walks; i++)
            if (seen_walk(&seed, 2, cosine, w)) {
                exact[0] += 1. / walks;
                exact[1] += (w[0] * eye[0] + w[2] * eye[2]) / walks;
            }
        float *light = malloc(3 * LIGHTS * sizeof *light);
        assert_non_null(light);
        dph_sh_directions(LIGHTS, light);
        for (int i = 0; i < LIGHTS; i++) {
            double color[3], share = 4 * PI / LIGHTS;
            for (int k = 0; k < 3; k++)
                w[k] = (double)light[3 * i + k];
            double along = w[0] * eye[0] + w[2] * eye[2];
            dph_response_along(response, top, w, 0, color);
            double gain = dph_response_view(response, top, w, eye);
            got[0][0] += share * color[1];
            got[0][1] += share * color[1] * along;
            got[1][0] += share * color[1] * gain;
            got[1][1] += share * color[1] * gain * along;
        }
        free(light);
        printf("n.v %.3f: seen %.3f %.3f, average %.3f %.3f, with gain %.3f %.3f\n", cosine,
               exact[0], exact[1], got[0][0], got[0][1], got[1][0], got[1][1]);
        for (int k = 0; k < 4; k++)
            error[k / 2] += pow(got[k / 2][k % 2] - exact[k % 2], 2);
    }
    assert_true(error[1] < (UNDER_SANITIZER ? .4 : .2) * error[0]);
    p.threads = 2;
    assert_true(dph_response_view_fit(&input, &p, response, &other, &err));
    assert_memory_equal(&response->view, &other, sizeof other);
    dph_response_destroy(response);
    /* what cannot be */
    for (int i = 0; i < 2; i++) {
        const struct dph_view_gain even = dph_view_even();
        response = i ? form_of(&t, DPH_RESPONSE_LINEAR, DPH_STORE_FLOAT)
                     : form_of(&t, DPH_RESPONSE_ROOT, DPH_STORE_CPCA);
        assert_false(dph_response_view_fit(&input, &p, response, &other, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        assert_memory_equal(&other, &even, sizeof even);
        dph_response_destroy(response);
    }
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

static void progress_limits_and_mistakes(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 16, 8);
    struct dph_bake_input input = input_of(&mesh);
    struct dph_response_bake_report report;
    struct dph_transfer t;
    struct dph_error err;
    double last = 0;
    struct dph_response_bake_params good = medium(3, 4, 5, .1), p = good;
    p.noise = .3;
    p.progress = count_calls, p.progress_user = &last;
    t = bake(&mesh, &p, NULL);
    assert_true(last == 1);
    dph_transfer_finish(&t);
    p.progress = stop_halfway;
    assert_false(dph_response_bake(&input, &p, &t, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_CANCELLED);
    assert_null(t.vector);
    p = good, p.noise = 1e-4, p.most_walks = 200;
    t = bake(&mesh, &p, &report);
    assert_true(!report.reached && report.noise > p.noise);
    assert_true(report.walks <= 200. * (double)report.positions);
    dph_transfer_finish(&t);
    for (int mistake = 0; mistake < 7; mistake++) {
        p = good;
        switch (mistake) {
        case 0: p.bands = 9; break;
        case 1: p.noise = NAN; break;
        case 2: p.anisotropy = 1; break;
        case 3: p.scattering[1] = -1; break;
        case 4: p.most_walks = 0; break;
        case 5: p.directions = 2; break;
        default: p.absorption[0] = INFINITY; break;
        }
        assert_false(dph_response_bake(&input, &p, &t, NULL, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    }
    struct dph_bake_input empty = {.position = mesh.position};
    assert_true(dph_response_bake(&empty, &good, &t, NULL, &err));
    assert_int_equal(t.npos, 0);
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_only_passes),
        cmocka_unit_test(sphere_agrees_with_walks),
        cmocka_unit_test(white_furnace),
        cmocka_unit_test(sharing_changes_nothing),
        cmocka_unit_test(noise_is_honest),
        cmocka_unit_test(same_bytes_for_any_threads),
        cmocka_unit_test(anisotropy_counts),
        cmocka_unit_test(eyes_see_more_than_the_average),
        cmocka_unit_test(progress_limits_and_mistakes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
