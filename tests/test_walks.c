/* Walks through a medium against closed forms and published numbers: slabs, half spaces, a sphere; and
 * through a mesh, from its surface until they leave. Seeds are fixed, so a test that passes once
 * passes always; every mean is held to three of its standard errors, and the error to a bound, so
 * that noise cannot hide a mistake. */
#include <diaphan/reference.h>
#include <diaphan/trace.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "mean.h"
#include "shapes.h"
#include "trace/medium.h"
#include "trace/walk.h"
/* Light from above on a slab of depth d, its cosine mu0: what comes out above and below. */
static void walk_slab(const struct dph_volume *volume, double d, double eta, double mu0, int count,
                      struct mean above[3], struct mean below[3])
{
    for (int i = 0; i < count; i++) {
        struct dph_random random = dph_random_seed(7, 0, (uint64_t)i);
        struct dph_walk walk;
        double to[3] = {sqrt(1 - mu0 * mu0), 0, mu0}, z = 0, weight[3] = {1, 1, 1};
        const double up[3] = {0, 0, -1}, down[3] = {0, 0, 1};
        int end = -1; /* 1: above, 2: below, 0: ended inside */
        dph_walk_begin(&walk, &random);
        if (eta > 1 && !dph_boundary_sample(&random, eta, up, to))
            end = 1;
        while (end < 0) {
            double s = dph_walk_flight(&walk, volume, &random);
            double wall = to[2] < 0 ? z / -to[2] : to[2] > 0 ? (d - z) / to[2] : INFINITY;
            if (s < wall) {
                z += s * to[2];
                dph_walk_scatter(&walk, volume, s);
                dph_phase_sample(&random, volume->anisotropy, to);
                if (!dph_walk_survive(&walk, volume, &random))
                    end = 0;
                assert_true(walk.scatterings < DPH_MAX_SCATTERINGS);
            } else {
                dph_walk_pass(&walk, wall);
                bool top = to[2] < 0;
                z = top ? 0 : d;
                if (eta <= 1 || dph_boundary_sample(&random, 1 / eta, top ? down : up, to))
                    end = top ? 1 : 2;
            }
        }
        if (walk.scatterings || end == 2)
            dph_walk_weight(&walk, volume, weight);
        for (int c = 0; c < 3; c++) {
            add(&above[c], end == 1 ? weight[c] : 0);
            add(&below[c], end == 2 ? weight[c] : 0);
        }
    }
}

/* Slabs: the case itself in the first channel, other densities of the same medium beside it, which
 * must not change what the first says. */
static void slabs_have_published_values(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        double albedo, g, tau, eta, mu0, above, below, error;
    } slab[] = {
        {"van de Hulst: a .9, g .75, tau 2", .9, .75, 2, 1, 1, .09739, .66096, 0},
        {"MCML: a .9, tau 2, index 1.5", .9, 0, 2, 1.5, 1, .25312, .28875, 1e-4},
        {"van de Hulst: a .99, tau 1, mu .5", .99, 0, 1, 1, .5, .48652, .49163, 0},
        {"van de Hulst: a .99, g .5, tau 4, mu .5", .99, .5, 4, 1, .5, .61996, .30605, 0},
        {"a 1, tau 4", 1, 0, 4, 1, 1, .6904, .3096, 3e-4},
        {"a 1, tau 10, index 1.3", 1, 0, 10, 1.3, 1, .8066, .1934, 7e-4},
        {"a .99, g .9, tau 20, index 1.3", .99, .9, 20, 1.3, 1, .28817, .27895, 1.8e-4},
    };
    int count = UNDER_SANITIZER ? 10000 : 200000;
    for (size_t i = 0; i < sizeof slab / sizeof *slab; i++) {
        struct mean above[3] = {{0}}, below[3] = {{0}};
        struct dph_volume volume;
        double ss[3], sa[3];
        for (int c = 0; c < 3; c++) {
            double st = c == 0 ? 1 : c == 1 ? 1.3 : .8;
            ss[c] = st * slab[i].albedo;
            sa[c] = st * (1 - slab[i].albedo);
        }
        dph_volume_init(&volume, ss, sa, slab[i].g);
        walk_slab(&volume, slab[i].tau, slab[i].eta, slab[i].mu0, count, above, below);
        check(slab[i].what, &above[0], slab[i].above, slab[i].error, 4e-3);
        check("", &below[0], slab[i].below, slab[i].error, 4e-3);
        if (slab[i].albedo == 1) /* nothing is lost in any channel */
            for (int c = 0; c < 3; c++) {
                struct mean all = {above[c].sum + below[c].sum, above[c].square + below[c].square,
                                   above[c].n};
                check("energy", &all, 1, 1e-9, 4e-3);
            }
    }
}

/* Half spaces: 1 - sqrt(1-a) H(mu), whatever the density; and Giovanelli's, with its specular
 * part. */
static void half_spaces_have_exact_values(void **state)
{
    (void)state;
    static const double albedo[2][3] = {{.5, .9, .99}, {.8, .95, .999}};
    static const double mu[3] = {1, .5, .1};
    static const double expected[2][3][3] = {
        {{.11523, .41495, .75272}, {.16014, .50794, .81514}, {.24172, .62934, .87751}},
        {{.28525, .53554, .91285}, {.36797, .62618, .93806}, {.49071, .73274, .96077}}};
    static const double st[3] = {1, 2, .7};
    int count = UNDER_SANITIZER ? 3000 : 120000;
    struct dph_volume volume;
    for (int set = 0; set < 2; set++) {
        double ss[3], sa[3];
        for (int c = 0; c < 3; c++) {
            ss[c] = st[c] * albedo[set][c];
            sa[c] = st[c] - ss[c];
        }
        dph_volume_init(&volume, ss, sa, 0);
        for (int m = 0; m < 3; m++) {
            struct mean above[3] = {{0}}, below[3] = {{0}};
            walk_slab(&volume, INFINITY, 1, mu[m], count, above, below);
            for (int c = 0; c < 3; c++) {
                char what[64];
                snprintf(what, sizeof what, "half space: a %g, mu %g", albedo[set][c], mu[m]);
                check(what, &above[c], expected[set][m][c], 5e-6, 5e-3);
            }
        }
    }
    const double scattering[3] = {9, 9, 9}, absorption[3] = {1, 1, 1};
    struct mean above[3] = {{0}}, below[3] = {{0}};
    dph_volume_init(&volume, scattering, absorption, 0);
    walk_slab(&volume, INFINITY, 1.5, 1, 4 * count, above, below);
    check("Giovanelli: a .9, index 1.5", &above[0], .26008, 2e-4, 3e-3);
}

/* Moments of Henyey-Greenstein are powers of g, and its density integrates to 1. */
static void scattering_has_its_asymmetry(void **state)
{
    (void)state;
    static const double g[] = {.75, -.3, 0, 1e-9, .95};
    for (size_t i = 0; i < sizeof g / sizeof *g; i++) {
        struct mean cosine = {0}, second = {0};
        struct dph_random random = dph_random_seed(1, i, 0);
        double integral = 0;
        for (int n = 0; n < 100000; n++) {
            double before[3], after[3];
            uint64_t seed = (uint64_t)n * 77 + 5;
            random_direction(&seed, before);
            memcpy(after, before, sizeof after);
            dph_phase_sample(&random, g[i], after);
            double c = before[0] * after[0] + before[1] * after[1] + before[2] * after[2];
            add(&cosine, c);
            add(&second, 1.5 * c * c - .5);
            integral += dph_phase(g[i], (2 * n + 1) / 1e5 - 1) * 2 / 1e5 * 2 * PI;
        }
        check("mean cosine", &cosine, g[i], 0, 3e-3);
        check("second moment", &second, g[i] * g[i], 0, 3e-3);
        assert_true(fabs(integral - 1) < 1e-4);
    }
}

/* Walks that cross a sphere of two mean free paths without scattering: 2 (1 - (1+2t) e^-2t) /
 * (2t)^2, t the optical radius. */
static void sphere_has_its_ballistic_share(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(3, 256, 128);
    struct dph_rays *rays =
        dph_rays_create(mesh.position, mesh.nvert, mesh.index, mesh.ntri, NULL);
    assert_non_null(rays);
    const double ss[3] = {.6, .6, .6}, sa[3] = {.2 / 3, .2 / 3, .2 / 3};
    struct dph_volume volume;
    struct mean share = {0};
    dph_volume_init(&volume, ss, sa, 0);
    unsigned int before = dph_rays_enter();
    for (uint64_t i = 0; i < 100000; i++) {
        struct dph_random random = dph_random_seed(3, 0, i);
        double r = 3 * sqrt(dph_random_next(&random)), a = 2 * PI * dph_random_next(&random);
        const double from[3] = {r * cos(a), 5, r * sin(a)}, to[3] = {0, -1, 0};
        struct dph_spans spans;
        struct dph_walk walk;
        dph_rays_spans(rays, from, to, &spans);
        assert_false(spans.inside);
        dph_walk_begin(&walk, &random);
        add(&share, dph_walk_flight(&walk, &volume, &random) >= spans.length);
    }
    dph_rays_leave(before);
    check("sphere: ballistic share", &share, .1135, 1e-4, 2e-3);
    dph_rays_destroy(rays);
    dph_mesh_finish(&mesh);
}

static bool count_visit(void *user, const struct dph_walk *walk, struct dph_random *random,
                        const double point[3], const double flight[3])
{
    int *count = user;
    (void)walk, (void)random, (void)point, (void)flight;
    ++*count;
    return true;
}

/* Walks that start at a surface: the grid of clearances spares rays and changes nothing else;
 * what is not absorbed leaves. */
static void walks_leave(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_room(2000, 4000);
    add_sphere(&mesh, 1, 24, 12, false);
    add_sphere(&mesh, .4, 24, 12, true);
    const double ss[3] = {8, 5, 6}, none[3] = {0, 0, 0}, sa[3] = {.1, .2, 3};
    for (int absorbing = 0; absorbing < 2; absorbing++) {
        struct dph_space space[2];
        struct mean left[3] = {{0}};
        int visits[2] = {0, 0};
        dph_volume_init(&space[0].volume, ss, absorbing ? sa : none, .3);
        assert_true(dph_space_init(&space[0], mesh.position, mesh.nvert, mesh.index, mesh.ntri, 0,
                                   NULL));
        space[1] = space[0];
        space[1].clearance = (struct dph_clearance){0};
        unsigned int before = dph_rays_enter();
        for (uint64_t i = 0; i < (UNDER_SANITIZER ? 2000 : 50000); i++) {
            double weight[2][3], flight[2][3];
            for (int s = 0; s < 2; s++) {
                struct dph_random random = dph_random_seed(11, absorbing, i);
                struct dph_walk walk;
                double point[3] = {0, 1 - 2 * space->margin, 0}; /* below a vertex */
                const double inward[3] = {.3, -.9, sqrt(.1)};
                memcpy(flight[s], inward, sizeof inward);
                dph_walk_begin(&walk, &random);
                enum dph_ending ending = dph_walk_run(&space[s], &walk, &random, false, point,
                                                      flight[s], count_visit, &visits[s]);
                assert_true(ending == DPH_ENDING_PLAIN || ending == DPH_ENDING_LEFT);
                dph_walk_weight(&walk, &space->volume, weight[s]);
                for (int c = 0; c < 3; c++)
                    weight[s][c] *= ending == DPH_ENDING_LEFT;
            }
            assert_memory_equal(weight[0], weight[1], sizeof *weight);
            assert_memory_equal(flight[0], flight[1], sizeof *flight);
            for (int c = 0; c < 3; c++)
                add(&left[c], weight[0][c]);
        }
        dph_rays_leave(before);
        assert_int_equal(visits[0], visits[1]);
        for (int c = 0; c < 3; c++)
            if (!absorbing)
                check("all walks leave", &left[c], 1, 1e-9, 1e-2);
        assert_true(!absorbing || value(&left[2]) < .5 * value(&left[0]));
        dph_space_finish(&space[0]);
    }
    dph_mesh_finish(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slabs_have_published_values),
        cmocka_unit_test(half_spaces_have_exact_values),
        cmocka_unit_test(scattering_has_its_asymmetry),
        cmocka_unit_test(sphere_has_its_ballistic_share),
        cmocka_unit_test(walks_leave),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
