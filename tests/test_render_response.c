/* Drawing the baked response: spheres of which it is known, in all forms, in bodies that are
 * turned, mirrored and larger; what the vertex stage sums against the same on the CPU; many lights.
 */
#include "gl_tests.h"
#include "render_shapes.h"

#include <diaphan/rivals.h>

static const double nowhere[3] = {0, 0, 0};

/* The response of a ball of a medium that swallows blue. */
static void glowing(double mu, double color[3])
{
    double v = .3 * exp(1.8 * (mu - 1));
    color[0] = v;
    color[1] = v * (.5 + .5 * (1 + mu) / 2);
    color[2] = v * (.2 + .6 * (1 + mu) / 2);
}

static void grey(double mu, double color[3])
{
    for (int c = 0; c < 3; c++)
        color[c] = .3 * exp(1.8 * (mu - 1));
}

/* Eight bands of a zonal function around each normal. */
static struct dph_transfer zonal_rows(const struct dph_mesh *mesh,
                                      void (*radial)(double mu, double color[3]))
{
    enum { STEPS = 20000 };
    double zonal[8][3] = {{0}}, y[64];
    for (int k = 0; k < STEPS; k++) {
        double mu = -1 + 2 * (k + .5) / STEPS, color[3];
        radial(mu, color);
        dph_sh_eval(8, (double[3]){sqrt(1 - mu * mu), 0, mu}, y);
        for (int l = 0; l < 8; l++)
            for (int c = 0; c < 3; c++)
                zonal[l][c] += 2 * PI * 2 / STEPS * color[c] * y[l * (l + 1)];
    }
    struct dph_transfer t = {
        .npos = mesh->nvert, .nvert = mesh->nvert, .bands = 8, .channels = 3, .length = 192};
    t.vector = malloc(t.npos * t.length * sizeof *t.vector);
    t.area = malloc(t.npos * sizeof *t.area);
    t.position_of = malloc(t.nvert * sizeof *t.position_of);
    assert_true(t.vector && t.area && t.position_of);
    for (size_t v = 0; v < t.nvert; v++) {
        double n[3];
        for (size_t k = 0; k < 3; k++)
            n[k] = (double)mesh->normal[3 * v + k];
        dph_sh_eval(8, n, y);
        for (int c = 0; c < 3; c++)
            for (int l = 0; l < 8; l++)
                for (int i = l * l; i < (l + 1) * (l + 1); i++)
                    t.vector[v * 192 + (size_t)(64 * c + i)] =
                        (float)(zonal[l][c] * sqrt(4 * PI / (2 * l + 1)) * y[i]);
        t.area[v] = 1;
        t.position_of[v] = (uint32_t)v;
    }
    return t;
}

static struct dph_scene *ball(void (*radial)(double mu, double color[3]),
                              enum dph_response_form form, int bands, enum dph_store store)
{
    struct dph_scene *scene = scene_of(make_sphere(32, 1, nowhere), NULL);
    struct dph_error err = {0};
    struct dph_response_params params = dph_response_defaults();
    params.form = form;
    params.bands = bands;
    params.store = store;
    params.cpca.clusters = 32;
    params.cpca.vectors = 8;
    struct dph_transfer rows = zonal_rows(&scene->body[0].mesh, radial);
    struct dph_rivals *rivals = calloc(1, sizeof *rivals);
    assert_non_null(rivals);
    scene->body[0].rivals = rivals;
    if (!(rivals->response = dph_response_create(&rows, &params, NULL, &err)))
        fail_msg("%s", err.message);
    dph_transfer_finish(&rows);
    return scene;
}

/* Every form and packing, from front and back, wherever the body stands and however large. */
static void test_sphere(void **state)
{
    (void)state;
    static const float turns[][16] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
        {0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1},           /* a third around (1,1,1) */
        {.6F, 0, .8F, 0, 0, -1, 0, 0, -.8F, 0, .6F, 0, 0, 0, 0, 1}, /* turned and mirrored */
    };
    static const enum dph_store stores[] = {DPH_STORE_FLOAT, DPH_STORE_SNORM16, DPH_STORE_SNORM8,
                                            DPH_STORE_CPCA};
    for (int form = 0; form < 3; form++)
        for (size_t s = 0; s < 4; s++)
            for (size_t turn = 0; turn < 3; turn++) {
                int bands = turn == 1 && form != DPH_RESPONSE_RGB ? 4 : 6;
                struct dph_scene *scene =
                    ball(glowing, (enum dph_response_form)form, bands, stores[s]);
                memcpy(scene->instance[0].matrix, turns[turn], sizeof turns[turn]);
                struct dph_frame frame = small_frame("response", 40, turn ? 65 : 140, 25);
                frame.samples = 1;
                frame.mm_per_unit = 7; /* lengths are none of its business */
                for (int c = 0; c < 3; c++)
                    frame.light[0].irradiance[c] = 1 + c;
                struct dph_image image = picture(scene, &frame);
                int judged = 0;
                for (int y = 0; y < 40; y++)
                    for (int x = 0; x < 40; x++) {
                        double mu, want[3];
                        if (!cosine_at(x, y, 40, 3 * sqrt(3), frame.light[0].to_light, &mu))
                            continue;
                        judged++;
                        glowing(mu, want);
                        for (int c = 0; c < 3; c++) {
                            double got = (double)pixel_at(&image, x, y)[c] / (1 + c);
                            double most =
                                .03 * want[c] + (stores[s] == DPH_STORE_CPCA ? .012 : .005);
                            if (!(fabs(got - want[c]) < most))
                                fail_msg("%s, %s, turn %zu, mu %g, channel %d: %g, not %g",
                                         dph_response_form_name((enum dph_response_form)form),
                                         dph_store_name(stores[s]), turn, mu, c, got, want[c]);
                        }
                    }
                assert_true(judged > 300);
                dph_image_finish(&image);
                dph_scene_destroy(scene);
            }
}

/* What the vertex stage sums, against the rows on the CPU, in a body of another scale. */
static void test_read_back(void **state)
{
    (void)state;
    static const enum dph_store stores[] = {DPH_STORE_FLOAT, DPH_STORE_SNORM16, DPH_STORE_SNORM8,
                                            DPH_STORE_CPCA};
    for (int form = 0; form < 2; form++)
        for (size_t s = 0; s < 4; s++) {
            struct dph_scene *scene = ball(glowing, (enum dph_response_form)form, 5, stores[s]);
            const struct dph_response *response = scene->body[0].rivals->response;
            const float matrix[16] = {0, 3, 0, 0, 0, 0, 3, 0, 3, 0, 0, 0, 1, 2, 3, 1};
            memcpy(scene->instance[0].matrix, matrix, sizeof matrix);
            struct dph_frame frame = small_frame("response", 16, 65, 25);
            struct dph_error err = {0};
            struct dph_renderer *renderer = dph_renderer_create(scene, &err);
            size_t nvert = scene->body[0].mesh.nvert;
            float *sum = malloc(nvert * sizeof *sum);
            assert_true(renderer && sum);
            if (!dph_renderer_thickness(renderer, &frame, 0, sum, &err))
                fail_msg("%s", err.message);
            const double *w = frame.light[0].to_light, own[3] = {w[1], w[2], w[0]};
            double top = (double)response->ramp.top;
            for (size_t v = 0; v < nvert; v++)
                assert_float_equal(sum[v] * (form ? top : sqrt(top)),
                                   dph_thickness_along(response->channel[0], v, own), 2e-5);
            free(sum);
            dph_renderer_destroy(renderer);
            dph_scene_destroy(scene);
        }
}

/* What the eye sees over the average: of a ball seen from far away, in a body that is turned and
 * mirrored. Compressed it has no gain, and a frame can leave it out. */
static void test_view(void **state)
{
    (void)state;
    static const enum dph_store stores[] = {DPH_STORE_FLOAT, DPH_STORE_SNORM16, DPH_STORE_SNORM8,
                                            DPH_STORE_CPCA};
    for (size_t s = 0; s < 5; s++) { /* the last one leaves it out */
        struct dph_scene *scene = ball(grey, DPH_RESPONSE_ROOT, 6, stores[s % 4]);
        const float matrix[16] = {.6F, 0, .8F, 0, 0, -1, 0, 0, -.8F, 0, .6F, 0, 0, 0, 0, 1};
        const double turned[2][3] = {{.6, 0, .8}, {-.8, 0, .6}};
        memcpy(scene->instance[0].matrix, matrix, sizeof matrix);
        struct dph_response *response = scene->body[0].rivals->response;
        const struct dph_mesh *mesh = &scene->body[0].mesh;
        for (int k = 0; k < DPH_VIEW_TERMS; k++)
            response->view.term[k] = (k == 0 ? .5F : 0) + .03F * (float)(k % 4);
        struct dph_frame frame = small_frame("response", 40, 115, 25);
        frame.samples = 1;
        frame.view_averaged = s == 4;
        frame.camera.distance = 30; /* all of it along one direction */
        frame.camera.fov = 2 * atan(1.2 / (30 * sqrt(3))) * 180 / PI;
        struct dph_image image = picture(scene, &frame);
        const double *world = frame.light[0].to_light, axis[3] = {0, 0, 1};
        double light[3], eye[3];
        for (int k = 0; k < 3; k++) {
            const double *row = k == 1 ? NULL : turned[k / 2];
            light[k] = row ? row[0] * world[0] + row[2] * world[2] : -world[1];
            eye[k] = row ? row[0] * axis[0] + row[2] * axis[2] : -axis[1];
        }
        int judged = 0;
        for (size_t v = 0; v < mesh->nvert; v++) { /* where a vertex is drawn */
            double n[3], at[3], color[3];
            for (size_t k = 0; k < 3; k++)
                n[k] = (double)mesh->normal[3 * v + k];
            for (int k = 0; k < 3; k++)
                at[k] = (double)matrix[k] * n[0] + (double)matrix[4 + k] * n[1] +
                        (double)matrix[8 + k] * n[2];
            if (at[2] < .4)
                continue;
            int x = (int)(20 + at[0] * 20 / 1.2), y = (int)(20 - at[1] * 20 / 1.2);
            dph_response_along(response, v, light, 0, color);
            double gain = s < 3 ? dph_response_view(response, v, light, eye) : 1;
            assert_true(s > 2 || fabs(gain - 1) > .05);
            judged++;
            assert_float_equal(pixel_at(&image, x, y)[1] / PI, color[1] * gain,
                               .14 * color[1] + .004);
        }
        assert_true(judged > 300);
        dph_image_finish(&image);
        dph_scene_destroy(scene);
    }
}

static void add_light(struct dph_frame *frame, double azimuth, double elevation, double r, double g,
                      double b)
{
    struct dph_light *light = &frame->light[frame->nlight++];
    *light = (struct dph_light){.irradiance = {r, g, b}};
    dph_light_direction(azimuth, elevation, light->to_light);
}

/* Largest difference of two pictures of one sample a pixel: with several a triangle at the outline
 * is shaded at places beyond its edge, where the ramp ends and sums go on. */
static double difference(const struct dph_scene *a, const struct dph_frame *first,
                         const struct dph_scene *b, const struct dph_frame *second)
{
    struct dph_frame one = *first, other = *second;
    one.samples = other.samples = 1;
    struct dph_image x = picture(a, &one), y = picture(b, &other);
    double most = 0, brightest = 0;
    for (size_t i = 0; i < (size_t)x.width * (size_t)x.height * 4; i++) {
        most = fmax(most, fabs((double)x.pixel[i] - (double)y.pixel[i]));
        brightest = i % 4 < 3 ? fmax(brightest, (double)x.pixel[i]) : brightest;
    }
    dph_image_finish(&x);
    dph_image_finish(&y);
    return most / brightest;
}

/* In a grey body three channels and one with its ramp are the same, whatever the lights and where
 * they are summed. */
static void test_lights(void **state)
{
    (void)state;
    struct dph_scene *root = ball(grey, DPH_RESPONSE_ROOT, 6, DPH_STORE_FLOAT);
    struct dph_scene *linear = ball(grey, DPH_RESPONSE_LINEAR, 6, DPH_STORE_FLOAT);
    struct dph_scene *rgb = ball(grey, DPH_RESPONSE_RGB, 6, DPH_STORE_FLOAT);
    struct dph_frame frame = small_frame("response", 32, 65, 25);
    frame.nlight = 0;
    add_light(&frame, 65, 25, 1, 1, 1);
    add_light(&frame, -120, 10, 2, 2, 2);
    add_light(&frame, 0, -60, .5, .5, .5); /* of one hue: one sum */
    assert_true(difference(linear, &frame, rgb, &frame) < .01);
    assert_true(difference(root, &frame, rgb, &frame) < .02);
    add_light(&frame, 170, 20, 0, 3, 1); /* three sums */
    assert_true(difference(linear, &frame, rgb, &frame) < .02);
    assert_true(difference(root, &frame, rgb, &frame) < .02);
    struct dph_frame shiny = frame; /* each its own: a highlight that is next to nothing */
    shiny.material.specular = 1e-6;
    assert_true(difference(linear, &frame, linear, &shiny) < .01);
    /* surroundings: even light makes the mean of the response; and they add to lights */
    frame.has_environment = true;
    for (int c = 0; c < 3; c++) {
        frame.environment[c][0] = sqrt(4 * PI) * (c + 1);
        frame.environment[c][2] = .5;
    }
    assert_true(difference(linear, &frame, rgb, &frame) < .01);
    shiny = frame;
    shiny.material.specular = 1e-6;
    assert_true(difference(linear, &frame, linear, &shiny) < .01);
    dph_scene_destroy(root);
    dph_scene_destroy(linear);
    dph_scene_destroy(rgb);
}

/* In a coloured one the hue of several lights is that of their mean. */
static void test_colors(void **state)
{
    (void)state;
    struct dph_scene *linear = ball(glowing, DPH_RESPONSE_LINEAR, 6, DPH_STORE_FLOAT);
    struct dph_scene *rgb = ball(glowing, DPH_RESPONSE_RGB, 6, DPH_STORE_FLOAT);
    struct dph_frame frame = small_frame("response", 32, 65, 25);
    assert_true(difference(linear, &frame, rgb, &frame) < .02);
    add_light(&frame, 100, 25, 3, 2, 1);
    assert_true(difference(linear, &frame, rgb, &frame) < .08);
    frame.bands = 4; /* fewer of what is stored */
    assert_true(difference(linear, &frame, rgb, &frame) < .12);
    dph_scene_destroy(linear);
    dph_scene_destroy(rgb);
}

/* A point light far away is a distant one, in the root form and in the linear one. */
static void test_point(void **state)
{
    (void)state;
    for (int form = 0; form < 2; form++) {
        struct dph_scene *scene = ball(glowing, (enum dph_response_form)form, 6, DPH_STORE_SNORM8);
        struct dph_frame far = small_frame("response", 32, 65, 25), near = far;
        near.light[0].kind = DPH_LIGHT_POINT;
        for (int k = 0; k < 3; k++) {
            near.light[0].position[k] = 2000 * far.light[0].to_light[k];
            near.light[0].irradiance[k] = far.light[0].irradiance[k] * 2000 * 2000;
        }
        assert_true(difference(scene, &far, scene, &near) < .005);
        dph_scene_destroy(scene);
    }
}

static void refuse(struct dph_scene *scene, const struct dph_frame *frame, const char *what)
{
    struct dph_error err = {0};
    struct dph_image image;
    struct dph_renderer *renderer = dph_renderer_create(scene, &err);
    assert_true(renderer && dph_image_init(&image, frame->width, frame->height, NULL));
    assert_false(dph_renderer_draw(renderer, frame, &image, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    if (!strstr(err.message, what))
        fail_msg("%s", err.message);
    dph_image_finish(&image);
    dph_renderer_destroy(renderer);
}

static void test_cost_and_refusals(void **state)
{
    (void)state;
    struct dph_scene *root = ball(glowing, DPH_RESPONSE_ROOT, 6, DPH_STORE_SNORM8);
    struct dph_scene *rgb = ball(glowing, DPH_RESPONSE_RGB, 3, DPH_STORE_SNORM8);
    struct dph_frame frame = small_frame("response", 8, 65, 25), around = frame, point = frame;
    struct dph_error err;
    struct dph_cost cost;
    struct dph_renderer *renderer = dph_renderer_create(root, &err);
    assert_true(renderer && dph_renderer_cost(renderer, &frame, &cost, &err));
    assert_int_equal(cost.passes, 1);
    assert_float_equal(cost.bytes_per_vertex, 36, 0);
    assert_int_equal(cost.table_bytes, 24 * 12);
    dph_renderer_destroy(renderer);
    around.has_environment = true;
    refuse(root, &around, "surroundings");
    point.light[0].kind = DPH_LIGHT_POINT;
    point.light[0].position[0] = 5;
    refuse(rgb, &point, "distant");
    struct dph_scene *bare = scene_of(make_square(true), NULL);
    refuse(bare, &frame, "response");
    dph_scene_destroy(bare);
    dph_scene_destroy(root);
    dph_scene_destroy(rgb);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere), cmocka_unit_test(test_read_back),
        cmocka_unit_test(test_view),
        cmocka_unit_test(test_lights), cmocka_unit_test(test_colors),
        cmocka_unit_test(test_point),  cmocka_unit_test(test_cost_and_refusals),
    };
    return run_gl_tests(tests);
}
