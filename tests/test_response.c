/* The forms of a response against closed forms: squares that are squares, ramps of known colours,
 * plain cuts, and an optimum that quadrature finds to be one. */
#include "shapes.h"

#include "bake/view_gain.h"

#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { DIRECTIONS = 4096 };

/* Coefficients of zonal functions of the cosine. */
static void project_zonal(void (*radial)(double mu, double color[3]), double zonal[8][3])
{
    enum { STEPS = 20000 };
    memset(zonal, 0, 8 * sizeof *zonal);
    for (int k = 0; k < STEPS;
         k++) { /* of the band's Legendre polynomial, by its harmonic on the axis */
        double mu = -1 + 2 * (k + .5) / STEPS, y[64], color[3];
        radial(mu, color);
        dph_sh_eval(8, (double[3]){sqrt(1 - mu * mu), 0, mu}, y);
        for (int l = 0; l < 8; l++)
            for (int c = 0; c < 3; c++)
                zonal[l][c] += 2 * PI * 2 / STEPS * color[c] * y[l * (l + 1)];
    }
}

/* Rows of zonal functions of normal . w at a unit sphere's vertices, 8 bands: `radial`, and towards
 * one side of the body more and more `other`, so that its vertices are not all alike. */
static struct dph_transfer mixed_rows(const struct dph_mesh *mesh,
                                      void (*radial)(double mu, double color[3]),
                                      void (*other)(double mu, double color[3]))
{
    double pure[2][8][3];
    project_zonal(radial, pure[0]);
    project_zonal(other, pure[1]);
    struct dph_transfer t = {
        .npos = mesh->nvert, .nvert = mesh->nvert, .bands = 8, .channels = 3, .length = 192};
    t.vector = malloc(t.npos * t.length * sizeof *t.vector);
    t.area = malloc(t.npos * sizeof *t.area);
    t.position_of = malloc(t.nvert * sizeof *t.position_of);
    assert_true(t.vector && t.area && t.position_of);
    for (size_t v = 0; v < t.nvert; v++) {
        double n[3], length = 0, y[64];
        for (int k = 0; k < 3; k++) {
            n[k] = (double)mesh->position[3 * v + (size_t)k];
            length += n[k] * n[k];
        }
        for (int k = 0; k < 3; k++)
            n[k] /= sqrt(length);
        dph_sh_eval(8, n, y);
        double share = (1 + n[0]) / 2;
        for (int c = 0; c < 3; c++)
            for (int l = 0; l < 8; l++)
                for (int i = l * l; i < (l + 1) * (l + 1); i++)
                    t.vector[v * 192 + (size_t)(64 * c + i)] =
                        (float)(((1 - share) * pure[0][l][c] + share * pure[1][l][c]) *
                                sqrt(4 * PI / (2 * l + 1)) * y[i]);
        t.area[v] = (float)(.1 + .9 * sqrt(fmax(0, 1 - n[2] * n[2])));
        t.position_of[v] = (uint32_t)v;
    }
    return t;
}

static struct dph_transfer zonal_rows(const struct dph_mesh *mesh,
                                      void (*radial)(double mu, double color[3]))
{
    return mixed_rows(mesh, radial, radial);
}

static struct dph_response *create(const struct dph_transfer *full, enum dph_response_form form,
                                   int bands, enum dph_store store,
                                   struct dph_response_report *report)
{
    struct dph_error err = {0};
    struct dph_response_params params = dph_response_defaults();
    params.form = form;
    params.bands = bands;
    params.store = store;
    params.cpca.clusters = 4;
    params.cpca.vectors = 6;
    struct dph_response *response = dph_response_create(full, &params, report, &err);
    if (!response)
        fail_msg("%s", err.message);
    return response;
}

/* 8-band rows of (sum s_i y_i)^2, s of `n` functions, the same in all channels times `color`. */
static struct dph_transfer square_rows(const float *s, size_t npos, int n, const double color[3])
{
    float *direction = malloc(3 * DIRECTIONS * sizeof *direction);
    struct dph_transfer t = {.npos = npos, .nvert = npos, .bands = 8, .channels = 3, .length = 192};
    t.vector = calloc(npos * t.length, sizeof *t.vector);
    t.area = malloc(npos * sizeof *t.area);
    t.position_of = malloc(npos * sizeof *t.position_of);
    double(*y)[64] = malloc(DIRECTIONS * sizeof *y), *sum = calloc(npos * 64, sizeof *sum);
    assert_true(direction && t.vector && t.area && t.position_of && y && sum);
    dph_sh_directions(DIRECTIONS, direction);
    for (int d = 0; d < DIRECTIONS; d++)
        dph_sh_eval(8,
                    (double[3]){(double)direction[3 * d], (double)direction[3 * d + 1],
                                (double)direction[3 * d + 2]},
                    y[d]);
    for (size_t p = 0; p < npos; p++) {
        t.area[p] = 1;
        t.position_of[p] = (uint32_t)p;
        for (int d = 0; d < DIRECTIONS; d++) {
            double root = 0;
            for (int i = 0; i < n; i++)
                root += (double)s[p * (size_t)n + (size_t)i] * y[d][i];
            for (int i = 0; i < 64; i++)
                sum[p * 64 + (size_t)i] += 4 * PI / DIRECTIONS * root * root * y[d][i];
        }
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < 64; i++)
                t.vector[p * 192 + 64 * c + i] = (float)(color[c] * sum[p * 64 + i]);
    }
    free(direction);
    free(y);
    free(sum);
    return t;
}

static float noise(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / (1 << 23) - 1;
}

/* What is a square of a sum that is positive is found to be one, whatever the number of rows. */
static void squares_are_recovered(void **state)
{
    (void)state;
    enum { ROWS = 37 };
    for (int bands = 1; bands <= 3; bands++) {
        int n = bands * bands;
        float s[ROWS * 9], row[9];
        uint32_t seed = 7;
        for (int p = 0; p < ROWS; p++)
            for (int i = 0; i < n; i++)
                s[p * n + i] = i == 0 ? 1 : (n > 4 ? .14f : .35f) * noise(&seed);
        struct dph_transfer t = square_rows(s, ROWS, n, (double[3]){1, 1, 1});
        struct dph_response_report report;
        struct dph_response *r = create(&t, DPH_RESPONSE_ROOT, bands, DPH_STORE_FLOAT, &report);
        for (int p = 0; p < ROWS; p++) {
            dph_thickness_row(r->channel[0], (size_t)p, row);
            for (int i = 0; i < n; i++)
                assert_float_equal(row[i], s[p * n + i], 2e-3);
        }
        assert_true(report.error < 3e-3 && report.error_rgb < 3e-3);
        for (int k = 0; k < DPH_RAMP_ENTRIES; k++) /* grey */
            for (int c = 0; c < 3; c++)
                assert_float_equal(r->ramp.color[k][c], r->ramp.top * (float)(k * k) / 529,
                                   (k < 8 ? 2e-2f : 2e-3f) * r->ramp.top);
        dph_response_destroy(r);
        dph_transfer_finish(&t);
    }
}

static void glowing(double mu, double color[3])
{
    double v = .3 * exp(2.5 * (mu - 1));
    color[0] = v;
    color[1] = v * (.4 + .6 * (1 + mu) / 2);
    color[2] = v * (.1 + .6 * (1 + mu) / 2);
}

/* Steeper, with a terminator: what a dense body does. */
static void terminated(double mu, double color[3])
{
    double v = fmax(mu, 0) / PI + .01;
    for (int c = 0; c < 3; c++)
        color[c] = v;
}

/* No neighbour of the answer is nearer: the integral by quadrature at the coefficients that were
 * found, and with each of them changed a little. From three bands on, the answer is pulled towards
 * the projection of the root. */
static double cost_of(const struct dph_transfer *t, const float *s, int n, const float *direction,
                      int count)
{
    double cost = 0, y[64], start[36] = {0}, whole = 0;
    for (int d = 0; d < count; d++) {
        double root = 0, f = 0;
        dph_sh_eval(8,
                    (double[3]){(double)direction[3 * d], (double)direction[3 * d + 1],
                                (double)direction[3 * d + 2]},
                    y);
        for (int i = 0; i < n; i++)
            root += (double)s[i] * y[i];
        for (int i = 0; i < 64; i++)
            f += (.2126 * (double)t->vector[i] + .7152 * (double)t->vector[64 + i] +
                  .0722 * (double)t->vector[128 + i]) *
                 y[i];
        cost += 4 * PI * (root * root - f) * (root * root - f) / count;
        for (int i = 0; i < n; i++)
            start[i] += 4 * PI * sqrt(fmax(0, f)) * y[i] / count;
    }
    for (int i = 0; i < n; i++)
        whole += start[i] * start[i];
    for (int i = 0; n > 4 && i < n; i++)
        cost += .2 * whole / PI * ((double)s[i] - start[i]) * ((double)s[i] - start[i]);
    return cost;
}

static void answers_are_optimal(void **state)
{
    (void)state;
    float *direction = malloc(3 * DIRECTIONS * sizeof *direction);
    assert_non_null(direction);
    dph_sh_directions(DIRECTIONS, direction);
    struct dph_mesh mesh = make_sphere(1, 8, 6);
    for (int bands = 2; bands <= 6; bands += 2) {
        struct dph_transfer t = zonal_rows(&mesh, bands == 4 ? terminated : glowing);
        struct dph_response *r = create(&t, DPH_RESPONSE_ROOT, bands, DPH_STORE_FLOAT, NULL);
        float s[36];
        dph_thickness_row(r->channel[0], 0, s);
        double least = cost_of(&t, s, bands * bands, direction, DIRECTIONS);
        for (int i = 0; i < bands * bands; i++)
            for (int sign = -1; sign <= 1; sign += 2) {
                float kept = s[i];
                s[i] += .01f * (float)sign;
                assert_true(cost_of(&t, s, bands * bands, direction, DIRECTIONS) > least);
                s[i] = kept;
            }
        dph_response_destroy(r);
        dph_transfer_finish(&t);
    }
    dph_mesh_finish(&mesh);
    free(direction);
}

/* A thin sheet: as bright from behind as from the front. */
static void thin(double mu, double color[3])
{
    double v = .02 + .15 * mu * mu + .15 * fmax(0, mu);
    color[0] = v;
    color[1] = .8 * v;
    color[2] = .5 * v;
}

/* More bands are nearer; with few of them the root is clearly ahead of the linear form, and the
 * ramp, which mends what is wrong everywhere alike, ahead of three channels without one. */
static void roots_beat_sums(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 24, 16);
    void (*const shape[2])(double, double[3]) = {glowing, terminated};
    for (int k = 0; k < 2; k++) {
        struct dph_transfer t = mixed_rows(&mesh, shape[k], thin);
        double before[3] = {9, 9, 9};
        for (int bands = 2; bands <= 6; bands += bands == 4 ? 2 : 1) {
            struct dph_response_report root, linear, rgb;
            dph_response_destroy(create(&t, DPH_RESPONSE_ROOT, bands, DPH_STORE_SNORM8, &root));
            dph_response_destroy(create(&t, DPH_RESPONSE_LINEAR, bands, DPH_STORE_SNORM8, &linear));
            dph_response_destroy(create(&t, DPH_RESPONSE_RGB, bands, DPH_STORE_SNORM8, &rgb));
            print_message(
                "%s, %d bands: root %.4f, linear %.4f, rgb %.4f; in colour %.4f, %.4f, %.4f\n",
                k ? "terminated" : "glowing", bands, root.error, linear.error, rgb.error,
                root.error_rgb, linear.error_rgb, rgb.error_rgb);
            /* a cut in the light needs odd and even bands: one more may bring nothing */
            assert_true(root.error < 1.01 * before[0] && linear.error < 1.01 * before[1] &&
                        rgb.error < 1.01 * before[2]);
            if (bands == 2)
                assert_true(root.error < .85 * linear.error && linear.error < .5 * rgb.error);
            before[0] = root.error, before[1] = linear.error, before[2] = rgb.error;
        }
        assert_true(before[0] < .08);
        dph_transfer_finish(&t);
    }
    dph_mesh_finish(&mesh);
}

/* The sphere is the same from everywhere: what is drawn depends on the angle alone, and the ramp
 * gives the colour that belongs to it. */
static void ramps_give_colors(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 24, 16);
    struct dph_transfer t = zonal_rows(&mesh, glowing);
    struct dph_response *r = create(&t, DPH_RESPONSE_ROOT, 6, DPH_STORE_FLOAT, NULL);
    float *direction = malloc(3 * 512 * sizeof *direction);
    assert_non_null(direction);
    dph_sh_directions(512, direction);
    for (size_t v = 0; v < mesh.nvert; v += 31)
        for (int d = 0; d < 512; d++) {
            double w[3], mu = 0, wanted[3], color[3];
            for (int k = 0; k < 3; k++) {
                w[k] = (double)direction[3 * d + k];
                mu += w[k] * (double)mesh.position[3 * v + (size_t)k];
            }
            glowing(mu, wanted);
            dph_response_along(r, v, w, 0, color);
            for (int c = 0; c < 3; c++)
                assert_float_equal(color[c], wanted[c], .02 * wanted[c] + .0015);
        }
    for (int k = 8; k < DPH_RAMP_ENTRIES; k++) /* values that there are */
        assert_true(r->ramp.color[k][2] < r->ramp.color[k][1] &&
                    r->ramp.color[k][1] < r->ramp.color[k][0]);
    double least[3], below[3];
    dph_ramp_color(&r->ramp, 0, least);
    dph_ramp_color(&r->ramp, -1, below);
    assert_memory_equal(least, below, sizeof least);
    free(direction);
    dph_response_destroy(r);
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

/* RGB rows are cut, not changed; and what a preset takes. */
static void forms_and_bytes(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 12, 8);
    struct dph_transfer t = zonal_rows(&mesh, glowing);
    struct dph_response *r = create(&t, DPH_RESPONSE_RGB, 3, DPH_STORE_FLOAT, NULL);
    float row[9];
    for (int c = 0; c < 3; c++) {
        dph_thickness_row(r->channel[c], 5, row);
        assert_memory_equal(row, t.vector + 5 * 192 + 64 * c, sizeof row);
    }
    assert_int_equal(dph_response_payload(r), 108);
    dph_response_destroy(r);

    static const size_t bytes[4][3] = {{4, 2, 4}, {9, 3, 12}, {16, 4, 16}, {36, 6, 36}};
    for (int i = 0; i < 4; i++) {
        struct dph_response_params params = dph_response_defaults();
        struct dph_error err;
        assert_true(dph_response_preset((int)bytes[i][0], &params));
        assert_int_equal(params.bands, bytes[i][1]);
        assert_non_null(r = dph_response_create(&t, &params, NULL, &err));
        assert_int_equal(dph_response_payload(r), bytes[i][0]);
        assert_int_equal(dph_response_fetched(r), bytes[i][2]);
        assert_int_equal(dph_response_shared(r), 24 * 12);
        dph_response_destroy(r);
        assert_false(dph_response_preset((int)bytes[i][0] + 1, &params));
    }
    /* compressed: a sphere's rows are alike but for the turn, and 24 weights lose little */
    for (int form = 0; form < 3; form++) {
        struct dph_response_report plain, packed;
        dph_response_destroy(create(&t, (enum dph_response_form)form, 4, DPH_STORE_FLOAT, &plain));
        r = create(&t, (enum dph_response_form)form, 4, DPH_STORE_CPCA, &packed);
        assert_int_equal(dph_response_payload(r), 7);
        assert_true(packed.error < plain.error + .05);
        dph_response_destroy(r);
    }
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

static bool same(const struct dph_response *a, const struct dph_response *b)
{
    const struct dph_thickness *x = a->channel[0], *y = b->channel[0];
    return !memcmp(&a->ramp, &b->ramp, sizeof a->ramp) && x->components == y->components &&
           !memcmp(x->data, y->data, x->nvert * (size_t)x->components * dph_store_size(x->store)) &&
           !memcmp(x->scale, y->scale, sizeof x->scale);
}

static void bytes_do_not_depend_on_threads(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 30, 20);
    struct dph_transfer t = zonal_rows(&mesh, terminated);
    struct dph_response_params params = dph_response_defaults();
    struct dph_error err;
    params.store = DPH_STORE_FLOAT;
    params.threads = 1;
    struct dph_response *one = dph_response_create(&t, &params, NULL, &err);
    params.threads = 5;
    params.portable = true;
    struct dph_response *other = dph_response_create(&t, &params, NULL, &err);
    assert_true(one && other && same(one, other));
    dph_response_destroy(one);
    dph_response_destroy(other);
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

static bool never(void *user, double fraction)
{
    (void)user;
    return fraction < .5;
}

static void refusals(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 8, 6);
    struct dph_transfer t = zonal_rows(&mesh, glowing);
    struct dph_response_params params = dph_response_defaults();
    struct dph_error err = {0};
    params.bands = 7;
    assert_null(dph_response_create(&t, &params, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    params = dph_response_defaults();
    params.progress = never;
    assert_null(dph_response_create(&t, &params, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_CANCELLED);
    params = dph_response_defaults();
    t.vector[200] = NAN;
    assert_null(dph_response_create(&t, &params, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_INPUT);
    /* no light at all */
    memset(t.vector, 0, t.npos * t.length * sizeof *t.vector);
    struct dph_response_report report;
    struct dph_response *dark = dph_response_create(&t, &params, &report, &err);
    assert_non_null(dark);
    double color[3];
    dph_response_along(dark, 3, (double[3]){0, 0, 1}, 0, color);
    assert_true(color[0] == 0 && color[1] == 0 && color[2] == 0 && report.error == 0);
    dph_response_destroy(dark);
    t.channels = 1;
    assert_null(dph_response_create(&t, &params, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    dph_transfer_finish(&t);
    dph_mesh_finish(&mesh);
}

/* Numbers from -1 to 1 that are the same every time. */
static double draw(uint32_t *state)
{
    *state = *state * 1664525U + 1013904223U;
    return (double)*state / 2147483648.0 - 1;
}

static void draw_direction(uint32_t *state, double direction[3])
{
    double length = 0;
    for (int k = 0; k < 3; k++)
        length += pow(direction[k] = draw(state), 2);
    for (int k = 0; k < 3; k++)
        direction[k] /= sqrt(length);
}

/* The polynomial as response.h writes it, the numbers for a shader, and the even one. */
static void views_are_polynomials(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(1, 16, 8);
    struct dph_transfer rows = mixed_rows(&mesh, glowing, terminated);
    uint32_t seed = 1;
    for (int bands = 1; bands <= 4; bands += 3) {
        struct dph_response_params params = dph_response_defaults();
        params.bands = bands;
        struct dph_response *r = dph_response_create(&rows, &params, NULL, NULL);
        assert_non_null(r);
        assert_true(dph_response_view(r, 3, (double[3]){1, 0, 0}, (double[3]){0, 1, 0}) == 1);
        for (int round = 0; round < 100; round++) {
            double l[3], v[3], y[2][4], q[4] = {0}, sum = 0, c;
            size_t vertex = (size_t)(round * 7) % mesh.nvert;
            float row[64];
            draw_direction(&seed, l);
            draw_direction(&seed, v);
            c = l[0] * v[0] + l[1] * v[1] + l[2] * v[2];
            for (int k = 0; k < DPH_VIEW_TERMS; k++)
                r->view.term[k] = (float)(.1 * draw(&seed) + (k == 0));
            dph_thickness_row(r->channel[0], vertex, row);
            dph_sh_eval(2, v, y[0]);
            dph_sh_eval(2, l, y[1]);
            q[0] = (double)row[0] * y[0][0];
            for (int i = 1; i < bands * bands && i < 4; i++) {
                q[1] += (double)row[i] * y[0][i];
                q[2] += (double)row[i] * y[1][i];
            }
            double p = dph_response_value(r, vertex, l), power = 1;
            q[3] = sqrt(p);
            for (int i = 0; i < 4; i++)
                q[i] *= sqrt(PI);
            const float *t = r->view.term;
            for (int k = 0; k < 3; k++, power *= c) {
                sum += power * (double)*t++;
                for (int i = 0; i < 4; i++)
                    sum += power * (double)*t++ * q[i];
                for (int i = 0; i < 4; i++)
                    for (int j = i; j < 4; j++)
                        sum += power * (double)*t++ * q[i] * q[j];
            }
            sum = fmin(fmax(sum, 0), 4);
            assert_float_equal(dph_response_view(r, vertex, l, v), sum, 1e-6);
            struct dph_view_constants s;
            const float *scale = r->channel[0]->scale;
            double u = sqrt(p / (double)r->ramp.top), x[4] = {0};
            dph_view_constants(r, l, v, &s);
            x[0] = (double)s.mean * (double)row[0] / (double)scale[0];
            for (int i = 1; i < bands * bands && i < 4; i++) {
                x[1] += (double)s.eye[i - 1] * (double)row[i] / (double)scale[1];
                x[2] += (double)s.light[i - 1] * (double)row[i] / (double)scale[1];
            }
            x[3] = u;
            double shader = (double)s.even;
            for (int i = 0; i < 4; i++)
                shader += x[i] * ((double)s.linear[i] + (double)s.square[i] * x[i]);
            for (int i = 0; i < 3; i++)
                shader += (double)s.mixed[i] * x[0] * x[i + 1] +
                          (double)s.cross[i] * x[i < 2 ? 1 : 2] * x[i > 0 ? 3 : 2];
            assert_float_equal(fmin(fmax(shader, 0), 4), sum, 1e-5);
        }
        dph_response_destroy(r);
    }
    dph_transfer_finish(&rows);
    dph_mesh_finish(&mesh);
}

/* Pictures that a polynomial made are explained by it; no light, no change. */
static void views_are_recovered(void **state)
{
    (void)state;
    struct dph_view_equations equations = {{0}, {0}};
    struct dph_view_gain gain = dph_view_solve(&equations), made = dph_view_even();
    uint32_t seed = 7;
    for (int k = 0; k < DPH_VIEW_TERMS; k++) {
        assert_true(gain.term[k] == (k == 0));
        made.term[k] += (float)(.04 * draw(&seed));
    }
    double worst = 0;
    for (int i = 0; i < 22000; i++) {
        double term[DPH_VIEW_TERMS], q[4], exact = 0, found = 0, p;
        for (int k = 0; k < 4; k++)
            q[k] = .5 * (1 + draw(&seed));
        p = q[3] * q[3];
        dph_view_terms(draw(&seed), q, term);
        for (int k = 0; k < DPH_VIEW_TERMS; k++)
            exact += (double)made.term[k] * term[k];
        if (i >= 20000) { /* others than it was fitted to */
            gain = i == 20000 ? dph_view_solve(&equations) : gain;
            for (int k = 0; k < DPH_VIEW_TERMS; k++)
                found += (double)gain.term[k] * term[k];
            worst = fmax(worst, p * fabs(found - exact));
            continue;
        }
        struct dph_view_equations one;
        for (int a = 0, k = 0; a < DPH_VIEW_TERMS; a++) {
            for (int b = 0; b <= a; b++)
                one.matrix[k++] = p * p * term[a] * term[b];
            one.right[a] = p * exact * p * term[a];
        }
        dph_view_add(&equations, &one);
    }
    assert_true(worst < .01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(squares_are_recovered),
        cmocka_unit_test(answers_are_optimal),
        cmocka_unit_test(roots_beat_sums),
        cmocka_unit_test(ramps_give_colors),
        cmocka_unit_test(forms_and_bytes),
        cmocka_unit_test(bytes_do_not_depend_on_threads),
        cmocka_unit_test(refusals),
        cmocka_unit_test(views_are_polynomials),
        cmocka_unit_test(views_are_recovered),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
