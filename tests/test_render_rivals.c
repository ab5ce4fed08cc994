/* The other methods' drawing: transfer vectors against closed forms, in bodies that are turned and
 * mirrored; their compression against them; changed normals against plain shading. */
#include "gl_tests.h"
#include "render_shapes.h"

#include <diaphan/environment.h>
#include <diaphan/rivals.h>

static const double nowhere[3] = {0, 0, 0};

/* Transfer of an unshadowed diffuse sphere of albedo 1, .5 and .25 by channel: A_l y_lm(n) / pi. */
static struct dph_rivals *diffuse_transfer(const struct dph_mesh *mesh, int bands)
{
    size_t n = (size_t)(bands * bands);
    struct dph_rivals *rivals = calloc(1, sizeof *rivals);
    assert_non_null(rivals);
    struct dph_transfer *t = &rivals->transfer;
    *t = (struct dph_transfer){.npos = mesh->nvert,
                               .nvert = mesh->nvert,
                               .bands = bands,
                               .channels = 3,
                               .length = 3 * n,
                               .vector = malloc(mesh->nvert * 3 * n * sizeof(float)),
                               .area = malloc(mesh->nvert * sizeof(float)),
                               .position_of = malloc(mesh->nvert * sizeof(uint32_t))};
    assert_true(t->vector && t->area && t->position_of);
    for (size_t v = 0; v < mesh->nvert; v++) {
        double normal[3], value[64];
        for (size_t k = 0; k < 3; k++)
            normal[k] = (double)mesh->normal[3 * v + k];
        dph_sh_eval(bands, normal, value);
        t->area[v] = 1;
        t->position_of[v] = (uint32_t)(mesh->nvert - 1 - v); /* rows are not vertices */
        float *row = t->vector + (mesh->nvert - 1 - v) * 3 * n;
        for (int l = 0; l < bands; l++)
            for (size_t i = (size_t)(l * l); i < (size_t)((l + 1) * (l + 1)); i++)
                for (size_t c = 0; c < 3; c++)
                    row[c * n + i] = (float)(dph_sh_cosine(l) * value[i] / PI / (1 << c));
    }
    return rivals;
}

static struct dph_scene *transfer_scene(int bands)
{
    struct dph_scene *scene = scene_of(make_sphere(48, 1, nowhere), NULL);
    scene->body[0].rivals = diffuse_transfer(&scene->body[0].mesh, bands);
    return scene;
}

/* The clamped cosine in so many bands, over pi: what a facing white surface of irradiance 1
 * reflects is near 1/pi. */
static double band_limited(int bands, double mu)
{
    double sum = 0, before = 1, p = mu;
    for (int l = 0; l < bands; l++) {
        double legendre = l ? p : 1;
        sum += dph_sh_cosine(l) * (2 * l + 1) / (4 * PI) * legendre;
        if (l) {
            double next = ((2 * l + 1) * mu * p - l * before) / (l + 1);
            before = p;
            p = next;
        }
    }
    return fmax(sum, 0) / PI;
}

/* A sphere looks the same however it is turned and mirrored, and as the closed form says. */
static void test_transfer(void **state)
{
    (void)state;
    static const float turns[][16] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
        {0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1},           /* a third around (1,1,1) */
        {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},          /* a mirror */
        {.6F, 0, .8F, 0, 0, -1, 0, 0, -.8F, 0, .6F, 0, 0, 0, 0, 1}, /* turned and mirrored */
    };
    for (int bands = 2; bands <= 6; bands++)
        for (size_t turn = 0; turn < 4; turn++) {
            struct dph_scene *scene = transfer_scene(bands);
            memcpy(scene->instance[0].matrix, turns[turn], sizeof turns[turn]);
            struct dph_frame frame = small_frame("prt", 40, 65, 25);
            frame.samples = 1;
            for (int c = 0; c < 3; c++)
                frame.light[0].irradiance[c] = 1 + c;
            struct dph_image image = picture(scene, &frame);
            int judged = 0;
            for (int y = 0; y < 40; y++)
                for (int x = 0; x < 40; x++) {
                    double mu;
                    if (!cosine_at(x, y, 40, 3 * sqrt(3), frame.light[0].to_light, &mu))
                        continue;
                    judged++;
                    for (int c = 0; c < 3; c++) {
                        double want = band_limited(bands, mu) * (1 + c) / (1 << c);
                        if (!(fabs((double)pixel_at(&image, x, y)[c] - want) < .01))
                            fail_msg("%d bands, turn %zu, mu %g, channel %d: %g, not %g", bands,
                                     turn, mu, c, (double)pixel_at(&image, x, y)[c], want);
                    }
                }
            assert_true(judged > 300);
            dph_image_finish(&image);
            dph_scene_destroy(scene);
        }
}

/* Lights and surroundings are one vector: even surroundings of radiance 1 make white white,
 * surroundings that are a light's coefficients make its picture, and lights add up. */
static void test_linear(void **state)
{
    (void)state;
    struct dph_scene *scene = transfer_scene(6);
    struct dph_frame frame = small_frame("prt", 24, 65, 25), around;
    around = frame;
    around.has_environment = true;
    around.environment[0][0] = around.environment[1][0] = sqrt(4 * PI);
    memset(around.light[0].irradiance, 0, sizeof around.light[0].irradiance);
    struct dph_image image = picture(scene, &around);
    assert_float_equal(pixel_at(&image, 12, 12)[0], 1, 1e-3);
    assert_float_equal(pixel_at(&image, 12, 12)[1], .5, 1e-3);
    assert_float_equal(pixel_at(&image, 12, 12)[2], 0, 1e-6);
    dph_image_finish(&image);
    frame.light[0].angle = 20;
    for (int c = 0; c < 3; c++) {
        dph_environment_disc(6, frame.light[0].to_light, 20, around.environment[c]);
        for (int i = 0; i < 36; i++)
            around.environment[c][i] *= frame.light[0].irradiance[c];
    }
    image = picture(scene, &frame);
    struct dph_image other = picture(scene, &around);
    double sum = 0;
    for (size_t p = 0; p < 24 * 24 * 4; p++) {
        assert_float_equal(image.pixel[p], other.pixel[p], 1e-3);
        sum += (double)image.pixel[p];
    }
    assert_true(sum > 24);
    dph_image_finish(&other);
    around.light[0] = frame.light[0]; /* both: twice the light */
    other = picture(scene, &around);
    for (size_t p = 0; p < 24 * 24 * 4; p++)
        if (p % 4 != 3)
            assert_float_equal(2 * image.pixel[p], other.pixel[p], 2e-3);
    dph_image_finish(&image);
    dph_image_finish(&other);
    dph_scene_destroy(scene);
}

/* Compressed with vectors to spare it draws what the vectors themselves do; the weights' bytes cost
 * a little. */
static void test_clusters(void **state)
{
    (void)state;
    static const int presets[][2] = {{1, 24}, {1, 36}, {16, 8}, {30, 5}};
    for (size_t i = 0; i < 4; i++) {
        struct dph_scene *scene = transfer_scene(4);
        struct dph_rivals *rivals = scene->body[0].rivals;
        struct dph_cpca_params params = dph_cpca_defaults();
        struct dph_error err = {0};
        params.clusters = presets[i][0];
        params.vectors = presets[i][1];
        rivals->clusters = dph_cpca_create(rivals->transfer.vector, rivals->transfer.npos,
                                           (int)rivals->transfer.length, NULL, &params, &err);
        if (!rivals->clusters)
            fail_msg("%s", err.message);
        struct dph_frame frame = small_frame("prt", 40, 65, 25);
        struct dph_image want = picture(scene, &frame);
        frame.method = dph_method_find("prt-cpca");
        struct dph_image got = picture(scene, &frame);
        double square = 0, sum = 0;
        for (size_t p = 0; p < 40 * 40 * 4; p++) {
            double d = (double)want.pixel[p] - (double)got.pixel[p];
            square += d * d;
            sum += (double)want.pixel[p] * (double)want.pixel[p];
        }
        if (!(sqrt(square / sum) < fmax(.01, 1.5 * rivals->clusters->error_snorm8)))
            fail_msg("%d clusters, %d vectors: off by %g, the compression by %g", presets[i][0],
                     presets[i][1], sqrt(square / sum), rivals->clusters->error_snorm8);
        struct dph_renderer *renderer = dph_renderer_create(scene, &err);
        struct dph_cost cost;
        assert_true(dph_renderer_cost(renderer, &frame, &cost, &err));
        assert_true(cost.passes == 1 && cost.bytes_per_vertex == (presets[i][1] + 3) / 4 * 4 + 4);
        dph_renderer_destroy(renderer);
        dph_image_finish(&want);
        dph_image_finish(&got);
        dph_scene_destroy(scene);
    }
}

/* The model's own normals draw what lambert does, shorter ones are darker, and from behind all is
 * black. */
static void test_patro(void **state)
{
    (void)state;
    struct dph_scene *scene = scene_of(make_sphere(48, 1, nowhere), NULL);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    struct dph_rivals *rivals = scene->body[0].rivals = calloc(1, sizeof *rivals);
    assert_non_null(rivals);
    rivals->normal = malloc(mesh->nvert * 3 * sizeof(float));
    assert_non_null(rivals->normal);
    struct dph_frame frame = small_frame("lambert", 40, 65, 25);
    frame.samples = 1;
    struct dph_image want = picture(scene, &frame);
    frame.method = dph_method_find("patro");
    for (int half = 0; half < 2; half++) {
        for (size_t i = 0; i < 3 * mesh->nvert; i++)
            rivals->normal[i] = mesh->normal[i] * (half ? .5F : 1);
        struct dph_image got = picture(scene, &frame);
        for (size_t p = 0; p < 40 * 40 * 4; p++)
            if (p % 4 != 3)
                assert_float_equal(got.pixel[p], want.pixel[p] * (half ? .5F : 1), 2e-3);
        dph_image_finish(&got);
    }
    dph_light_direction(180, 0, frame.light[0].to_light);
    struct dph_image dark = picture(scene, &frame);
    for (size_t p = 0; p < 40 * 40 * 4; p++)
        assert_true(p % 4 == 3 || dark.pixel[p] < .01F);
    dph_image_finish(&dark);
    dph_image_finish(&want);
    dph_scene_destroy(scene);
}

/* What a scene bakes can be drawn, by every method, from the front and from behind. */
static void test_bake(void **state)
{
    (void)state;
    struct dph_scene *scene = scene_of(make_sphere(16, 1, nowhere), NULL);
    struct dph_rivals_params params = dph_rivals_defaults();
    struct dph_rivals_report report;
    struct dph_error err = {0};
    struct dph_frame frame = small_frame("prt", 24, 20, 20);
    params.material = &frame.material;
    params.size_mm = 8;
    params.directions = 128;
    params.clusters = 8;
    if (!dph_scene_bake_rivals(scene, DPH_PRODUCT_NORMALS | DPH_PRODUCT_CLUSTERS, &params, &report,
                               &err))
        fail_msg("%s", err.message);
    frame.mm_per_unit = 0;
    assert_float_equal(scene->mm_per_unit, 4, 1e-6);
    assert_true(report.seconds_transfer > 0 && report.seconds_clusters > 0 && report.error < .2);
    const struct dph_mesh *mesh = &scene->body[0].mesh;
    for (size_t v = 0; v < mesh->nvert;
         v++) { /* on a sphere the mean normal is the normal, shorter */
        double dot = 0, square = 0;
        for (size_t k = 0; k < 3; k++) {
            double n = (double)scene->body[0].rivals->normal[3 * v + k];
            dot += n * (double)mesh->normal[3 * v + k];
            square += n * n;
        }
        assert_true(square <= 1.0001 && square > .5 && dot > .995 * sqrt(square));
    }
    static const char *const names[] = {"prt", "prt-cpca", "patro"};
    for (size_t i = 0; i < 3; i++) {
        frame.method = dph_method_find(names[i]);
        dph_light_direction(20, 20, frame.light[0].to_light);
        struct dph_image front = picture(scene, &frame);
        dph_light_direction(180, 0, frame.light[0].to_light);
        struct dph_image back = picture(scene, &frame);
        assert_true(pixel_at(&front, 12, 12)[0] > .3F);
        assert_true(pixel_at(&back, 12, 12)[0] < .5F * pixel_at(&front, 12, 12)[0]);
        if (i < 2) /* they glow */
            assert_true(pixel_at(&back, 12, 12)[0] > .001F);
        else
            assert_true(pixel_at(&back, 12, 12)[0] == 0);
        dph_image_finish(&front);
        dph_image_finish(&back);
    }
    dph_scene_destroy(scene);
}

static void test_refusals(void **state)
{
    (void)state;
    struct dph_frame frame = small_frame("prt", 8, 0, 0);
    struct dph_error err = {0};
    frame.light[0].kind = DPH_LIGHT_POINT;
    assert_false(dph_frame_check_lights(&frame, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_true(strstr(err.message, "point") && strstr(err.message, "shsss"));
    frame.light[0].kind = DPH_LIGHT_DISTANT;
    assert_true(dph_frame_check_lights(&frame, &err));
    frame.has_environment = true;
    assert_true(dph_frame_check_lights(&frame, &err));
    frame.method = dph_method_find("shsss");
    assert_false(dph_frame_check_lights(&frame, &err));
    assert_true(strstr(err.message, "surroundings") && strstr(err.message, "prt-cpca"));
    /* nothing baked */
    struct dph_scene *scene = scene_of(make_square(true), NULL);
    struct dph_renderer *renderer = dph_renderer_create(scene, &err);
    struct dph_image image;
    assert_true(dph_image_init(&image, 8, 8, NULL));
    static const char *const names[] = {"prt", "prt-cpca", "patro"};
    for (size_t i = 0; i < 3; i++) {
        frame = small_frame(names[i], 8, 0, 0);
        assert_false(dph_renderer_draw(renderer, &frame, &image, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
        assert_non_null(strstr(err.message, names[i]));
    }
    dph_image_finish(&image);
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_transfer), cmocka_unit_test(test_linear),
        cmocka_unit_test(test_clusters), cmocka_unit_test(test_patro),
        cmocka_unit_test(test_bake),     cmocka_unit_test(test_refusals),
    };
    return run_gl_tests(tests);
}
