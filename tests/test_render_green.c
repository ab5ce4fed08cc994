/* Depth maps: ways through bodies against closed forms and against the sweep, the blur, and lights
 * at a point. S. Green's method promises what the definition "farthest" of the sweep computes. */
#include "gl_tests.h"
#include "render_shapes.h"

#include <diaphan/bake.h>

static const double nowhere[3] = {0, 0, 0};

/* What the method puts beside the exact way, in radii of the scene (method_green.c). */
static const double grow = .005, bias = .01;

static double texel(const struct dph_frame *frame)
{
    return 2 * 1.025 / frame->map_size;
}

static double scene_radius(const struct dph_scene *scene)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double side = scene->bounds[1][k] - scene->bounds[0][k];
        sum += side * side;
    }
    return sqrt(sum) / 2;
}

/* Thickness at the vertices by one of the two methods, the caller frees. */
static float *read_back(const struct dph_scene *scene, const struct dph_frame *frame)
{
    struct dph_error err = {0};
    struct dph_renderer *renderer = dph_renderer_create(scene, &err);
    float *s = malloc(scene->body[0].mesh.nvert * sizeof *s);
    if (!s || !renderer || !dph_renderer_thickness(renderer, frame, 0, s, &err))
        fail_msg("%s", err.message);
    dph_renderer_destroy(renderer);
    return s;
}

/* A box of half-sides `half` with n x n squares a side, flat, turned about y and then about x. */
static struct dph_mesh make_box(size_t n, const double half[3], double turn, double tilt)
{
    struct dph_mesh mesh;
    assert_true(dph_mesh_init(&mesh, 6 * (n + 1) * (n + 1), 12 * n * n, false, false, NULL));
    size_t v = 0, t = 0;
    for (size_t side = 0; side < 6; side++) {
        size_t first = v, axis = side / 2, u = (axis + 1) % 3, w = (axis + 2) % 3;
        for (size_t i = 0; i <= n; i++)
            for (size_t j = 0; j <= n; j++, v++) {
                double p[3], q[3];
                p[axis] = side & 1 ? half[axis] : -half[axis];
                p[u] = half[u] * (2.0 * (double)i / (double)n - 1);
                p[w] = half[w] * (2.0 * (double)j / (double)n - 1);
                q[0] = cos(turn) * p[0] + sin(turn) * p[2];
                q[2] = -sin(turn) * p[0] + cos(turn) * p[2];
                mesh.position[3 * v] = (float)q[0];
                mesh.position[3 * v + 1] = (float)(cos(tilt) * p[1] - sin(tilt) * q[2]);
                mesh.position[3 * v + 2] = (float)(sin(tilt) * p[1] + cos(tilt) * q[2]);
            }
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                uint32_t a = (uint32_t)(first + i * (n + 1) + j), b = a + 1,
                         c = a + (uint32_t)n + 1, d = c + 1;
                const uint32_t front[6] = {a, c, b, b, c, d}, back[6] = {a, b, c, b, d, c};
                memcpy(mesh.index + 3 * t, side & 1 ? front : back, sizeof front);
                t += 2;
            }
    }
    return mesh;
}

/* Puts `b` beside `a` in one mesh, both with normals, and empties both; `inward` turns b inside
 * out. */
static struct dph_mesh join(struct dph_mesh *a, struct dph_mesh *b, bool inward)
{
    struct dph_mesh mesh;
    assert_true(dph_mesh_init(&mesh, a->nvert + b->nvert, a->ntri + b->ntri, true, false, NULL));
    memcpy(mesh.position, a->position, 3 * a->nvert * sizeof(float));
    memcpy(mesh.normal, a->normal, 3 * a->nvert * sizeof(float));
    memcpy(mesh.position + 3 * a->nvert, b->position, 3 * b->nvert * sizeof(float));
    for (size_t i = 0; i < 3 * b->nvert; i++)
        mesh.normal[3 * a->nvert + i] = inward ? -b->normal[i] : b->normal[i];
    memcpy(mesh.index, a->index, 3 * a->ntri * sizeof *mesh.index);
    for (size_t i = 0; i < 3 * b->ntri; i++) {
        size_t other = inward ? i - i % 3 + 2 - i % 3 : i;
        mesh.index[3 * a->ntri + i] = b->index[other] + (uint32_t)a->nvert;
    }
    dph_mesh_finish(a);
    dph_mesh_finish(b);
    return mesh;
}

/* s = 2R max(0, -mu) less the bias, up to what the map's entry point moves by: two texels, and
 * `grow` inward. */
static void test_sphere(void **state)
{
    (void)state;
    const double far[3] = {300, -200, 1000};
    struct dph_scene *scene = scene_of(make_sphere(128, 2, far), NULL);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    double r = scene_radius(scene);
    static const double angles[][2] = {{0, 0}, {33, 20}, {150, -80}, {10, 90}};
    for (size_t a = 0; a < 4; a++)
        for (int size = 512; size <= 2048; size *= 4) {
            struct dph_frame frame = small_frame("green", 8, angles[a][0], angles[a][1]);
            frame.mm_per_unit = .5;
            frame.map_size = size;
            float *s = read_back(scene, &frame);
            double slack = .004 + 2e-3; /* facets, single precision */
            for (size_t v = 0; v < mesh->nvert; v++) {
                double mu = 0;
                for (size_t k = 0; k < 3; k++)
                    mu += (double)mesh->normal[3 * v + k] * frame.light[0].to_light[k];
                double across = 2 * sqrt(fmax(1 - mu * mu, 0));
                double inner = fmax(across * (1 - grow * r / 2) - 2 * texel(&frame) * r, 0),
                       outer = across + 2 * texel(&frame) * r;
                double most = -2 * mu + sqrt(4 - inner * inner) - bias * r;
                double least = outer >= 2 ? 0 : -2 * mu + sqrt(4 - outer * outer) - bias * r;
                double got = (double)s[v] / .5;
                if (!(got >= 0 && got >= least - slack && got <= fmax(most, 0) + slack))
                    fail_msg("light %zu, map %d, mu %g: %g, not %g to %g", a, size, mu, got, least,
                             most);
            }
            free(s);
        }
    dph_scene_destroy(scene);
}

/* Where the ray p - t l enters a box of half-sides h around 0, as a distance along l; false: it
 * misses. */
static bool box_entry(const double p[3], const double l[3], const double h[3], double *t)
{
    double near = -INFINITY, far = INFINITY;
    for (int k = 0; k < 3; k++) {
        double a = (-h[k] - p[k]) / l[k], b = (h[k] - p[k]) / l[k];
        near = fmax(near, fmin(a, b));
        far = fmin(far, fmax(a, b));
    }
    *t = far;
    return near < far;
}

/* A box on edge: within 1 % of the radius of the sweep's thickness, but for the band around the
 * outline that two texels and the growth blur. */
static void test_convex(void **state)
{
    (void)state;
    const double half[3] = {1, .8, .6}, l[3] = {.48, .6, .64};
    struct dph_scene *scene = scene_of(make_box(24, half, 0, 0), NULL);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    struct dph_frame frame = small_frame("green", 8, 0, 0);
    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct dph_bake_params params = dph_bake_defaults();
    struct dph_error err = {0};
    float *want = malloc(mesh->nvert * sizeof *want);
    assert_non_null(want);
    memcpy(frame.light[0].to_light, l, sizeof l);
    frame.mm_per_unit = 1;
    if (!dph_bake_direction(&input, &params, l, want, NULL, NULL, NULL, &err))
        fail_msg("%s", err.message);
    float *s = read_back(scene, &frame);
    double r = scene_radius(scene), band = (2 * texel(&frame) + grow) * r, worst = 0;
    size_t judged = 0;
    for (size_t v = 0; v < mesh->nvert; v++) {
        bool inside = true;
        for (int turn = 0; turn < 16; turn++) { /* points around it, across the light */
            double p[3], t, c = band * cos(turn * PI / 8), d = band * sin(turn * PI / 8);
            const double u[3] = {.8, 0, -.6}, w[3] = {-.36, .8, -.48};
            for (int k = 0; k < 3; k++)
                p[k] = (double)mesh->position[3 * v + (size_t)k] + c * u[k] + d * w[k];
            inside = inside && box_entry(p, l, half, &t);
        }
        assert_true(s[v] >= 0);
        if (!inside)
            continue;
        judged++;
        double expected = fmax((double)want[v] - bias * r, 0);
        worst = fmax(worst, fabs((double)s[v] - expected));
    }
    printf("box: off by %.4f of the radius at most, %zu of %zu vertices\n", worst / r, judged,
           mesh->nvert);
    assert_true(judged > mesh->nvert / 2);
    assert_true(worst < .01 * r);
    free(s);
    free(want);
    dph_scene_destroy(scene);
}

/* A hollow sphere: the way to the farthest exit, gap and all, not the length inside. */
static void test_shell(void **state)
{
    (void)state;
    struct dph_mesh outer = make_sphere(64, 1, nowhere), inner = make_sphere(48, .6, nowhere);
    struct dph_scene *scene = scene_of(join(&outer, &inner, true), NULL);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    struct dph_frame frame = small_frame("green", 8, 70, 25);
    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct dph_bake_params params = dph_bake_defaults();
    float *want[2];
    double r = scene_radius(scene), worst = 0, gap = 0;
    for (int i = 0; i < 2; i++) {
        params.definition = i ? DPH_THICKNESS_INSIDE : DPH_THICKNESS_FARTHEST;
        want[i] = malloc(mesh->nvert * sizeof **want);
        assert_non_null(want[i]);
        assert_true(dph_bake_direction(&input, &params, frame.light[0].to_light, want[i], NULL,
                                       NULL, NULL, NULL));
    }
    frame.mm_per_unit = 1;
    float *s = read_back(scene, &frame);
    size_t judged = 0;
    for (size_t v = 0; v < mesh->nvert; v++) {
        double along = 0, square = 0;
        for (size_t k = 0; k < 3; k++) {
            double p = (double)mesh->position[3 * v + k];
            along += p * frame.light[0].to_light[k];
            square += p * p;
        }
        if (square - along * along > .7 * .7) /* the rim is test_sphere's */
            continue;
        judged++;
        double expected = fmax((double)want[0][v] - bias * r, 0);
        worst = fmax(worst, fabs((double)s[v] - expected));
        gap = fmax(gap, (double)s[v] - (double)want[1][v]);
    }
    assert_true(judged > mesh->nvert / 4);
    assert_true(worst < .01 * r);
    assert_true(gap > 1.1); /* the hollow is 1.2 wide */
    for (int i = 0; i < 2; i++)
        free(want[i]);
    free(s);
    dph_scene_destroy(scene);
}

/* A map that is the same everywhere stays what it is, up to its very edge, however wide the blur;
 * the hollows behind an edge are filled. */
static void test_blur(void **state)
{
    (void)state;
    const double half[3] = {1, 1, .5};
    struct dph_scene *scene = scene_of(make_box(8, half, 0, 0), NULL);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    struct dph_frame frame = small_frame("green", 8, 0, 0);
    frame.mm_per_unit = 1;
    frame.map_size = 256;
    float *sharp = read_back(scene, &frame);
    frame.method = dph_method_find("green-gauss");
    static const double widths[] = {0, .04, .2, 1, -1};
    for (size_t i = 0; i < 5; i++) {
        frame.blur_mm = widths[i];
        float *blurred = read_back(scene, &frame);
        for (size_t v = 0; v < mesh->nvert; v++) {
            double z = (double)mesh->position[3 * v + 2];
            assert_float_equal(sharp[v], fmax(.5 - z - bias * 1.5, 0), 1e-4);
            assert_float_equal(blurred[v], sharp[v], 1e-4);
        }
        free(blurred);
    }
    free(sharp);
    dph_scene_destroy(scene);

    /* a step of the entry distance, seen from behind: a square beyond a half as wide one */
    struct dph_mesh near = make_square(true), far = make_square(true);
    for (size_t v = 0; v < 4; v++) {
        near.position[3 * v] = near.position[3 * v] * .5F - .5F;
        near.position[3 * v + 2] = 1;
    }
    scene = scene_of(join(&far, &near, false), NULL);
    frame.blur_mm = .1;
    frame.map_size = 1024;
    frame.samples = 1;
    frame.width = frame.height = 200; /* the step lies between pixels */
    frame.material.curve = DPH_CURVE_EXP;
    frame.camera = (struct dph_camera){180, 0, 100, 1};
    for (int c = 0; c < 3; c++) {
        frame.material.sigma[c] = 1;
        frame.material.base[c] = 1;
        frame.material.front[c] = frame.material.back[c] = 0;
    }
    struct dph_image image = picture(scene, &frame);
    double tallest = 0, last = 0;
    for (int x = 100 - 40; x <= 100 + 40; x++) { /* radiance pi exp(-s), s from 0 to 1: monotone */
        double s = -log((double)pixel_at(&image, x, 100)[0] / PI);
        assert_true(s >= -1e-6 && s < 1);
        tallest = fmax(tallest, fabs(s - last));
        last = x == 60 ? s : last;
        tallest = x == 60 ? 0 : tallest;
        last = s;
    }
    assert_true(tallest < .15 && tallest > .01); /* a Gaussian's slope, not a step */
    dph_image_finish(&image);
    frame.method = dph_method_find("green");
    image = picture(scene, &frame);
    tallest = 0;
    for (int x = 60; x < 140; x++)
        tallest = fmax(tallest, fabs((double)pixel_at(&image, x, 100)[0] -
                                     (double)pixel_at(&image, x + 1, 100)[0]));
    assert_true(tallest > .8 * PI * (1 - exp(-1))); /* unblurred it is one */
    dph_image_finish(&image);
    dph_scene_destroy(scene);
}

/* Light from all sides on something concave: never negative, always a number, and back where it
 * began. */
static void test_turn(void **state)
{
    (void)state;
    const double beside[3] = {1.5, .4, .2};
    struct dph_mesh one = make_sphere(24, 1, nowhere), other = make_sphere(24, .7, beside);
    struct dph_scene *scene = scene_of(join(&one, &other, false), NULL);
    for (int gauss = 0; gauss < 2; gauss++) {
        const char *name = gauss ? "green-gauss" : "green";
        struct dph_frame frame = small_frame(name, 48, 0, 0);
        frame.map_size = 256;
        frame.samples = 1;
        struct dph_image first = picture(scene, &frame);
        for (int i = 0; i <= 24; i++) {
            dph_light_direction(15 * i, 90 * sin(i), frame.light[0].to_light);
            float *s = read_back(scene, &frame);
            for (size_t v = 0; v < scene->body[0].mesh.nvert; v++)
                assert_true(s[v] >= 0 && s[v] < 25);
            free(s);
            struct dph_image image = picture(scene, &frame);
            for (size_t p = 0; p < 48 * 48 * 4; p++)
                assert_true(image.pixel[p] >= 0 && image.pixel[p] < 1e3F);
            dph_image_finish(&image);
        }
        dph_light_direction(360, 0, frame.light[0].to_light);
        struct dph_image again = picture(scene, &frame);
        for (size_t p = 0; p < 48 * 48 * 4; p++)
            assert_float_equal(again.pixel[p], first.pixel[p], 1e-4);
        dph_image_finish(&first);
        dph_image_finish(&again);
    }
    dph_scene_destroy(scene);
}

/* From a point: the way from where the ray of light meets the sphere first. */
static void test_point_light(void **state)
{
    (void)state;
    struct dph_scene *scene = scene_of(make_sphere(96, 1, nowhere), NULL);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    double r = scene_radius(scene);
    for (int kind = 0; kind < 2; kind++)
        for (double away = 2; away < 40; away *= 3) {
            struct dph_frame frame = small_frame("green", 8, 50, 35);
            struct dph_light *light = &frame.light[0];
            frame.mm_per_unit = 1;
            light->kind = kind ? DPH_LIGHT_SPOT : DPH_LIGHT_POINT;
            light->angle = kind ? 60 : 0;
            for (int k = 0; k < 3; k++)
                light->position[k] = away * light->to_light[k];
            float *s = read_back(scene, &frame);
            double worst = 0;
            size_t judged = 0;
            for (size_t v = 0; v < mesh->nvert; v++) {
                double d[3], square = 0, b = 0;
                for (int k = 0; k < 3; k++) {
                    d[k] = (double)mesh->position[3 * v + (size_t)k] - light->position[k];
                    square += d[k] * d[k];
                }
                double length = sqrt(square);
                for (int k = 0; k < 3; k++)
                    b += light->position[k] * d[k] / length;
                double discriminant =
                    b * b - away * away + 1; /* the cosine at the entry, squared */
                if (discriminant < .5)
                    continue;
                judged++;
                double way = length - (-b - sqrt(discriminant));
                worst = fmax(worst, fabs((double)s[v] - fmax(way - bias * r, 0)));
            }
            assert_true(judged > mesh->nvert / 8);
            if (!(worst < .01 * r))
                fail_msg("light at %g: off by %g of the radius", away, worst / r);
            free(s);
        }
    dph_scene_destroy(scene);
}

/* A point far away is a distant light, for every method that takes one. */
static void test_far_point(void **state)
{
    (void)state;
    static const char *const names[] = {"lambert", "shsss", "green", "green-gauss"};
    const double aside[3] = {5, 0, 0};
    struct dph_mesh mesh = make_sphere(48, 1, aside);
    struct dph_thickness *t = sphere_thickness(&mesh, 1, 6, DPH_STORE_FLOAT);
    struct dph_scene *scene = scene_of(mesh, t);
    for (size_t n = 0; n < 4; n++) {
        struct dph_frame frame = small_frame(names[n], 64, 130, 20), point;
        frame.samples = 1;
        frame.mm_per_unit = 8;
        point = frame;
        point.light[0].kind = DPH_LIGHT_POINT;
        for (int k = 0; k < 3; k++) {
            point.light[0].position[k] = aside[k] + 3000 * frame.light[0].to_light[k];
            point.light[0].irradiance[k] = frame.light[0].irradiance[k] * 9e6;
        }
        struct dph_image a = picture(scene, &frame), b = picture(scene, &point);
        double sum = 0, off = 0;
        for (size_t p = 0; p < 64 * 64 * 4; p++) {
            /* where light grazes, the ways of a few pixels near the rim differ by some texels */
            off += fabs((double)a.pixel[p] - (double)b.pixel[p]);
            if (n < 2)
                assert_float_equal(a.pixel[p], b.pixel[p], .003);
            sum += (double)a.pixel[p];
        }
        assert_true(sum > 64 && off < .005 * sum);
        dph_image_finish(&a);
        dph_image_finish(&b);
    }
    dph_scene_destroy(scene);
}

/* A square under a point light is lit by I cos / d^2 at every point; a spot lights what is in its
 * cone alike and nothing else. */
static void test_inverse_square(void **state)
{
    (void)state;
    struct dph_scene *scene = scene_of(make_square(true), NULL);
    struct dph_frame frame = small_frame("lambert", 101, 0, 0);
    struct dph_light *light = &frame.light[0];
    struct dph_material_constants k;
    frame.samples = 1;
    frame.camera = (struct dph_camera){0, 0, 1000, .1};
    dph_material_constants(&frame.material, &k);
    for (int spot = 0; spot < 2; spot++) {
        light->kind = spot ? DPH_LIGHT_SPOT : DPH_LIGHT_POINT;
        light->angle = spot ? 30 : 0;
        for (int i = 0; i < 3; i++) {
            light->position[i] = i == 2 ? 1.5 : .25;
            light->to_light[i] = i == 2 ? 7 : 0;
            light->irradiance[i] = 2 + i;
        }
        struct dph_image image = picture(scene, &frame);
        double pixel = 1000 * sqrt(2) * tan(.05 * PI / 180) / 50.5;
        int lit = 0, dark = 0;
        for (int y = 0; y < 101; y++)
            for (int x = 0; x < 101; x++) {
                double dx = (x - 50) * pixel - .25, dy = (50 - y) * pixel - .25,
                       square = dx * dx + dy * dy + 2.25;
                if (fabs(dx + .25) > .97 || fabs(dy + .25) > .97)
                    continue;
                double angle = acos(1.5 / sqrt(square)) * 180 / PI;
                for (int c = 0; c < 3; c++) {
                    double want = (double)k.albedo[c] / PI * (2 + c) * 1.5 / sqrt(square) / square;
                    double got = (double)pixel_at(&image, x, y)[c];
                    if (!spot || angle < 26.9)
                        assert_float_equal(got, want, .005 * want);
                    else if (angle > 30.1)
                        assert_true(got == 0);
                    else
                        assert_true(got <= want * 1.005);
                }
                lit += angle < 26.9;
                dark += angle > 30.1;
            }
        assert_true(lit > 500 && dark > 500);
        dph_image_finish(&image);
    }
    dph_scene_destroy(scene);
}

/* A map a light: sixteen at once are the sum of single ones. */
static void test_many_maps(void **state)
{
    (void)state;
    const double beside[3] = {1.5, .4, .2};
    struct dph_mesh one = make_sphere(16, 1, nowhere), other = make_sphere(16, .7, beside);
    struct dph_scene *scene = scene_of(join(&one, &other, false), NULL);
    static double sum[32 * 32 * 4];
    for (int gauss = 0; gauss < 2; gauss++) {
        struct dph_frame frame = small_frame(gauss ? "green-gauss" : "green", 32, 0, 0), single;
        struct dph_error err = {0};
        struct dph_cost cost;
        memset(sum, 0, sizeof sum);
        frame.map_size = 128;
        frame.nlight = DPH_MAX_LIGHTS;
        single = frame;
        single.nlight = 1;
        for (int i = 0; i < frame.nlight; i++) {
            struct dph_light *light = &frame.light[i];
            dph_light_direction(47 * i, 80 - 10 * i, light->to_light);
            for (int c = 0; c < 3; c++)
                light->irradiance[c] = .1 * i + c;
            single.light[0] = *light;
            struct dph_image image = picture(scene, &single);
            for (size_t p = 0; p < 32 * 32 * 4; p++)
                sum[p] += (double)image.pixel[p];
            dph_image_finish(&image);
        }
        struct dph_image all = picture(scene, &frame);
        for (size_t p = 0; p < 32 * 32 * 4; p++)
            if (p % 4 != 3)
                assert_float_equal(all.pixel[p], sum[p], 1e-4 * sum[p] + 1e-5);
        dph_image_finish(&all);
        struct dph_renderer *renderer = dph_renderer_create(scene, &err);
        assert_true(dph_renderer_cost(renderer, &frame, &cost, &err));
        assert_int_equal(cost.passes, gauss ? 49 : 17);
        assert_true(cost.table_bytes >= 128 * 128 * (16 * 8 + 4));
        assert_true(cost.bytes_per_vertex == 4);
        frame.map_size = 100;
        assert_false(dph_renderer_cost(renderer, &frame, &cost, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        frame.map_size = 8192; /* 16 GiB of maps */
        struct dph_image image;
        assert_true(dph_image_init(&image, 32, 32, NULL));
        assert_false(dph_renderer_draw(renderer, &frame, &image, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        frame.map_size = 64; /* and it still draws */
        assert_true(dph_renderer_draw(renderer, &frame, &image, &err));
        dph_image_finish(&image);
        dph_renderer_destroy(renderer);
    }
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere),    cmocka_unit_test(test_convex),
        cmocka_unit_test(test_shell),     cmocka_unit_test(test_blur),
        cmocka_unit_test(test_turn),      cmocka_unit_test(test_point_light),
        cmocka_unit_test(test_far_point), cmocka_unit_test(test_inverse_square),
        cmocka_unit_test(test_many_maps),
    };
    return run_gl_tests(tests);
}
