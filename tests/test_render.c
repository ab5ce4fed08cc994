/* Drawing: the vertex stage against the CPU's dot product, pictures against closed forms, and what
 * must never be seen. */
#include "gl_tests.h"
#include "render_shapes.h"

#include "render/gl.h"

static const double nowhere[3] = {0, 0, 0};

/* The GPU's thickness of every vertex is the stored row times the light's values, for every store
 * and number of bands, in a body that is turned, stretched and moved. */
static void test_thickness_values(void **state)
{
    (void)state;
    /* columns: x turned by .7 about y and doubled, y times .5, z turned and tripled */
    double c = cos(.7), s = sin(.7);
    const float matrix[16] = {(float)(2 * c), 0, (float)(-2 * s), 0, 0, .5F, 0, 0,
                              (float)(3 * s), 0, (float)(3 * c),  0, 7, -3,  1, 1};
    static const double to_light[3] = {.36, .48, -.8};
    /* A^-1 L by hand: turn back, then divide */
    double object[3] = {(c * to_light[0] - s * to_light[2]) / 2, to_light[1] / .5,
                        (s * to_light[0] + c * to_light[2]) / 3};
    double inverse = sqrt(object[0] * object[0] + object[1] * object[1] + object[2] * object[2]);
    for (int k = 0; k < 3; k++)
        object[k] /= inverse; /* and |A object| = 1 / inverse */
    for (int store = DPH_STORE_FLOAT; store <= DPH_STORE_CPCA; store++)
        for (int bands = 1; bands <= 8; bands++)
            for (int use = 0; use <= 6; use += 2) {
                struct dph_mesh mesh = make_sphere(12, 1.5, nowhere);
                struct dph_thickness *t =
                    sphere_thickness(&mesh, 1.5, bands, (enum dph_store)store);
                struct dph_scene *scene = scene_of(mesh, t);
                size_t nvert = scene->body[0].mesh.nvert;
                memcpy(scene->instance[0].matrix, matrix, sizeof matrix);
                struct dph_frame frame = small_frame("shsss", 8, 0, 0);
                memcpy(frame.light[0].to_light, to_light, sizeof to_light);
                frame.mm_per_unit = .25;
                frame.bands = use;
                struct dph_error err = {0};
                struct dph_renderer *renderer = dph_renderer_create(scene, &err);
                float *got = malloc(nvert * sizeof *got);
                if (!renderer || !got || !dph_renderer_thickness(renderer, &frame, 0, got, &err))
                    fail_msg("%s", err.message);
                int used = bands < 6 ? bands : 6;
                if (use && use < used)
                    used = use;
                double value[64], largest = 0, worst = 0;
                dph_sh_eval(used, object, value);
                for (size_t v = 0; v < nvert; v++) {
                    float row[64];
                    double sum = 0;
                    dph_thickness_row(t, v, row);
                    for (int i = 0; i < used * used; i++)
                        sum += (double)row[i] * value[i];
                    sum *= .25 / inverse;
                    largest = fmax(largest, fabs(sum));
                    worst = fmax(worst, fabs(sum - (double)got[v]));
                }
                assert_true(largest > .1);
                if (!(worst <= 1e-4 * largest))
                    fail_msg("store %d, %d bands, %d used: off by %g of %g", store, bands, use,
                             worst, largest);
                free(got);
                dph_renderer_destroy(renderer);
                dph_scene_destroy(scene);
            }
}

static void test_indexed_and_unshared(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(24, 1, nowhere), loose = unshare(&mesh);
    struct dph_thickness *a = sphere_thickness(&mesh, 1, 6, DPH_STORE_SNORM8);
    struct dph_thickness *b = sphere_thickness(&loose, 1, 6, DPH_STORE_SNORM8);
    struct dph_scene *shared = scene_of(mesh, a), *unshared = scene_of(loose, b);
    struct dph_frame frame = small_frame("shsss", 100, 150, 30);
    frame.mm_per_unit = 10;
    struct dph_image one = picture(shared, &frame), other = picture(unshared, &frame),
                     again = picture(shared, &frame);
    size_t bytes = 100 * 100 * 4 * sizeof(float);
    assert_memory_equal(one.pixel, other.pixel, bytes);
    assert_memory_equal(one.pixel, again.pixel, bytes); /* two runs, the same bits */
    assert_true(pixel_at(&one, 50, 50)[0] > 0);
    dph_image_finish(&one);
    dph_image_finish(&other);
    dph_image_finish(&again);
    dph_scene_destroy(shared);
    dph_scene_destroy(unshared);
}

/* Lit from behind, a sphere is darkest in the middle of the disc and grows brighter towards the
 * rim, alike on all sides. */
static void test_backlit_sphere(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(64, 1, nowhere);
    struct dph_thickness *t = sphere_thickness(&mesh, 1, 6, DPH_STORE_FLOAT);
    struct dph_scene *scene = scene_of(mesh, t);
    struct dph_frame frame = small_frame("shsss", 201, 180, 0);
    frame.samples =
        1; /* with more, where in a pixel that an edge crosses is shaded is the driver's choice */
    frame.mm_per_unit = 10;
    struct dph_image image = picture(scene, &frame);
    double last = 0, first = 0, tallest = 0;
    int edge = 0;
    for (int r = 0; r <= 100 && pixel_at(&image, 100 + r, 100)[3] == 1; r++) {
        double right = (double)pixel_at(&image, 100 + r, 100)[0],
               left = (double)pixel_at(&image, 100 - r, 100)[0];
        double above = (double)pixel_at(&image, 100, 100 - r)[0],
               below = (double)pixel_at(&image, 100, 100 + r)[0];
        assert_float_equal(left, right, .01 * right);
        assert_float_equal(above, right, .01 * right);
        assert_float_equal(below, right, .01 * right);
        first = r ? first : right;
        tallest = fmax(tallest, right);
        /* six bands ring by a few thousandths of the diameter near the rim: no visible fall */
        assert_true(right >= .98 * last);
        last = right;
        edge = r;
    }
    assert_in_range(edge, 60, 63); /* tan(asin(1 / (3 sqrt 3))) / tan(17.5 degrees) of 100 */
    assert_true(tallest > 2 * first && first > 0);
    dph_image_finish(&image);
    dph_scene_destroy(scene);
}

/* A Lambert sphere in perspective: every pixel well inside has radiance albedo / pi E cos, the
 * covered area is that of the disc. */
static void test_lambert_sphere(void **state)
{
    (void)state;
    const double far[3] = {1000, 2000, -500}; /* away from the origin: precision must not suffer */
    struct dph_scene *scene = scene_of(make_sphere(96, 2, far), NULL);
    struct dph_frame frame = small_frame("lambert", 160, 40, 25);
    for (int c = 0; c < 3; c++) {
        frame.light[0].irradiance[c] = 1 + c;
        frame.background[c] = .25 * c;
    }
    struct dph_material_constants k;
    dph_material_constants(&frame.material, &k);
    struct dph_image image = picture(scene, &frame);
    double radius = sqrt(12), eye = 3 * radius, area = 0; /* of the bounding box's sphere */
    for (int y = 0; y < 160; y++)
        for (int x = 0; x < 160; x++) {
            const float *p = pixel_at(&image, x, y);
            double scale = tan(35 * PI / 360) / 80;
            double d[3] = {(x + .5 - 80) * scale, (80 - y - .5) * scale, -1};
            double length = sqrt(d[0] * d[0] + d[1] * d[1] + 1);
            double b = -eye * d[2] / length,
                   discriminant = b * b - eye * eye + 4; /* from (0, 0, eye) */
            area += (double)p[3];
            assert_true(p[3] >= 0 && p[3] <= 1);
            if (discriminant < -.6) {
                assert_true(p[3] == 0 && p[0] == 0 && p[1] == .25F && p[2] == .5F);
            } else if (discriminant > .6) {
                double hit = b - sqrt(discriminant), mu = 0;
                for (int i = 0; i < 3; i++)
                    mu +=
                        (d[i] / length * hit + (i == 2 ? eye : 0)) / 2 * frame.light[0].to_light[i];
                assert_true(p[3] == 1);
                for (int c = 0; c < 3; c++)
                    assert_float_equal(p[c], (double)k.albedo[c] / PI * (1 + c) * fmax(mu, 0), .01);
            }
        }
    /* the cone that touches the sphere has half-angle asin(2 / eye) */
    double edge = tan(asin(2 / eye)) / tan(35 * PI / 360) * 80;
    assert_float_equal(area, PI * edge * edge, .01 * area);
    dph_image_finish(&image);
    dph_scene_destroy(scene);
}

/* The shader's formulas are those of the C library: one square of constant thickness, many
 * materials, lights on both sides. */
static void test_formulas(void **state)
{
    (void)state;
    static const char *const names[] = {"wax", "marble", "skin1", "ketchup", "spectralon"};
    static const double lengths[] = {-3, 0, .1, 1, 7, 300}, elevations[] = {90, 50, -10, -60};
    struct dph_frame frame = small_frame("shsss", 9, 0, 0);
    frame.samples = 1; /* the point that is shaded is the middle of the pixel */
    for (size_t m = 0; m < 5; m++)
        for (int variant = 0; variant < 4; variant++)
            for (size_t i = 0; i < 6; i++) {
                struct dph_scene *scene =
                    scene_of(make_square(true), constant_thickness(4, lengths[i]));
                struct dph_error err = {0};
                struct dph_renderer *renderer = dph_renderer_create(scene, &err);
                assert_true(dph_material_load(names[m], &frame.material, NULL));
                frame.material.curve = variant & 1 ? DPH_CURVE_EXP : DPH_CURVE_SLAB;
                frame.material.formula = variant & 2 ? DPH_FORMULA_PAPER : DPH_FORMULA_G;
                frame.material.specular = variant == 1 ? 1.5 : 0;
                frame.material.rim = variant == 2 ? .5 : 0;
                frame.material.ambient = variant == 3 ? .1 : 0;
                frame.mm_per_unit = 2;
                struct dph_material_constants k;
                dph_material_constants(&frame.material, &k);
                for (size_t e = 0; e < 4; e++) {
                    struct dph_image image;
                    assert_true(dph_image_init(&image, 9, 9, NULL));
                    dph_light_direction(0, elevations[e], frame.light[0].to_light);
                    frame.live_material = e & 1;
                    if (!renderer || !dph_renderer_draw(renderer, &frame, &image, &err))
                        fail_msg("%s", err.message);
                    /* the middle pixel looks straight along the normal */
                    double mu = cos(elevations[e] * PI / 180), sine = sin(elevations[e] * PI / 180);
                    double halfway = sqrt((1 + mu) / 2),
                           fresnel = (double)k.f0 + (1 - (double)k.f0) * pow(1 - halfway, 5);
                    for (int c = 0; c < 3; c++) {
                        double t = dph_material_transmittance(&k, c, 2 * lengths[i]),
                               front = fmax(mu, 0), back = fmax(-mu, 0);
                        double want = variant & 2
                                          ? (double)k.front[c] * front + (double)k.base[c] * t
                                          : t * ((double)k.base[c] + (double)k.front[c] * front +
                                                 (double)k.back[c] * back);
                        want +=
                            (double)k.specular * 48 / (8 * PI) * pow(halfway, 40) * fresnel * front;
                        want += 0 * sine; /* no rim: the eye is on the normal */
                        want = PI * want + (double)(k.ambient * k.albedo[c]);
                        double got = (double)pixel_at(&image, 4, 4)[c];
                        /* 1 / T in the shader is a polynomial, or sinh where the material lives */
                        double slack = variant & 1 ? 1e-7 : (e & 1 ? 5e-4 : 2e-4) * PI *
                                       (double)(k.base[c] + k.front[c] + k.back[c]);
                        if (!(fabs(got - want) <= 2e-4 * want + slack))
                            fail_msg("%s, variant %d, %g mm, elevation %g, channel %d: %g, not %g",
                                     names[m], variant, 2 * lengths[i], elevations[e], c, got,
                                     want);
                    }
                    dph_image_finish(&image);
                }
                dph_renderer_destroy(renderer);
                dph_scene_destroy(scene);
            }
}

/* An open sheet looks the same from both sides, with normals and without. */
static void test_open_sheet(void **state)
{
    (void)state;
    for (int normals = 0; normals < 2; normals++) {
        struct dph_scene *scene = scene_of(make_square(normals), constant_thickness(4, 1));
        struct dph_frame front = small_frame("lambert", 9, 0, 40),
                         behind = small_frame("lambert", 9, 180, 40);
        behind.camera.azimuth = 180;
        struct dph_image a = picture(scene, &front), b = picture(scene, &behind);
        assert_true(pixel_at(&a, 4, 4)[0] > .5F);
        assert_float_equal(pixel_at(&a, 4, 4)[0], pixel_at(&b, 4, 4)[0], 1e-5);
        dph_image_finish(&a);
        dph_image_finish(&b);
        front.method = dph_method_find("thickness");
        a = picture(scene, &front);
        assert_float_equal(pixel_at(&a, 4, 4)[0], 1 / sqrt(8),
                           1e-5); /* of the bounding sphere's diameter */
        dph_image_finish(&a);
        float thickness[4];
        struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
        assert_true(dph_renderer_thickness(renderer, &front, 0, thickness, NULL));
        for (int v = 0; v < 4; v++)
            assert_float_equal(thickness[v], 1, 1e-5);
        dph_renderer_destroy(renderer);
        dph_scene_destroy(scene);
    }
}

/* Sixteen lights in one pass are the sum of sixteen pictures, and nothing is negative or not a
 * number even where two bands ring. */
static void test_many_lights(void **state)
{
    (void)state;
    struct dph_mesh mesh = make_sphere(24, 1, nowhere);
    struct dph_thickness *t = sphere_thickness(&mesh, 1, 6, DPH_STORE_SNORM8);
    struct dph_scene *scene = scene_of(mesh, t);
    struct dph_frame frame = small_frame("shsss", 64, 0, 0), single = frame;
    frame.mm_per_unit = single.mm_per_unit = 8;
    frame.bands = single.bands = 2;
    static double sum[64 * 64 * 4];
    frame.nlight = DPH_MAX_LIGHTS;
    for (int i = 0; i < frame.nlight; i++) {
        dph_light_direction(47 * i, 90 - 11 * i, frame.light[i].to_light);
        for (int c = 0; c < 3; c++)
            frame.light[i].irradiance[c] = .1 * i + c;
        single.light[0] = frame.light[i];
        struct dph_image image = picture(scene, &single);
        for (size_t p = 0; p < 64 * 64 * 4; p++) {
            assert_true(image.pixel[p] >= 0 && image.pixel[p] < 1e6F);
            sum[p] += (double)image.pixel[p];
        }
        dph_image_finish(&image);
    }
    struct dph_image all = picture(scene, &frame);
    for (size_t p = 0; p < 64 * 64 * 4; p++)
        if (p % 4 != 3)
            assert_float_equal(all.pixel[p], sum[p], 1e-5 * sum[p] + 1e-6);
    assert_true(pixel_at(&all, 32, 32)[1] > 1);
    dph_image_finish(&all);
    dph_scene_destroy(scene);
}

/* A mirrored instance under the mirrored light gives the mirrored picture: the faces turn, the
 * normals do not. */
static void test_mirrored(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        struct dph_mesh mesh = make_sphere(24, 1, nowhere);
        for (size_t v = 0; v < mesh.nvert; v++) /* something without symmetry */
            mesh.position[3 * v] *= mesh.position[3 * v] > 0 ? 1.5F : 1;
        struct dph_thickness *t = sphere_thickness(&mesh, 1, 6, DPH_STORE_FLOAT);
        struct dph_scene *scene = scene_of(mesh, t);
        struct dph_frame frame = small_frame(k ? "lambert" : "shsss", 64, 60, 20);
        frame.samples = 1;
        struct dph_image a = picture(scene, &frame);
        scene->instance[0].matrix[0] = -1;
        double low = scene->bounds[0][0];
        scene->bounds[0][0] = -scene->bounds[1][0];
        scene->bounds[1][0] = -low;
        dph_light_direction(-60, 20, frame.light[0].to_light);
        struct dph_image b = picture(scene, &frame);
        double difference = 0;
        for (int y = 0; y < 64; y++)
            for (int x = 0; x < 64; x++)
                if (pixel_at(&a, x, y)[3] == 1 && pixel_at(&b, 63 - x, y)[3] == 1)
                    difference = fmax(difference, fabs((double)pixel_at(&a, x, y)[0] -
                                                       (double)pixel_at(&b, 63 - x, y)[0]));
        assert_true(difference < .003);
        dph_image_finish(&a);
        dph_image_finish(&b);
        dph_scene_destroy(scene);
    }
}

/* A picture larger than a tile has no seam: it agrees with one drawn small, each of whose pixels
 * covers 16 x 16 of the large one. The tiles meet at 2048, on the sphere. */
static void test_tiles(void **state)
{
    (void)state;
    struct dph_scene *scene = scene_of(make_sphere(32, 1, nowhere), NULL);
    struct dph_frame small = small_frame("lambert", 4, 80, 30), large;
    small.camera = (struct dph_camera){0, 0, 4, .5};
    small.width = 144;
    large = small;
    large.width = 144 * 16;
    large.height = 4 * 16;
    large.samples = 1;
    struct dph_image a = picture(scene, &small), b = picture(scene, &large);
    assert_true(pixel_at(&b, 2047, 32)[3] == 1 && pixel_at(&b, 2048, 32)[3] == 1 &&
                pixel_at(&b, 2047, 32)[0] > .5F);
    for (int y = 0; y < 4; y++)
        for (int x = 10; x < 134; x++) {
            double mean = 0;
            for (int i = 0; i < 256; i++)
                mean += (double)pixel_at(&b, 16 * x + i % 16, 16 * y + i / 16)[0] / 256;
            assert_float_equal(pixel_at(&a, x, y)[0], mean, .02);
        }
    for (int x = 2000; x < 2100; x++) /* pixel by pixel */
        assert_float_equal(pixel_at(&b, x, 30)[0], pixel_at(&b, x + 1, 30)[0], .003);
    dph_image_finish(&a);
    dph_image_finish(&b);
    dph_scene_destroy(scene);
}

static void test_refusals(void **state)
{
    (void)state;
    struct dph_scene *scene = scene_of(make_square(true), NULL);
    struct dph_frame frame = small_frame("shsss", 16, 0, 0), bad;
    struct dph_error err = {0};
    struct dph_image image;
    struct dph_renderer *renderer = dph_renderer_create(scene, &err);
    assert_non_null(renderer);
    assert_true(dph_image_init(&image, 16, 16, NULL));
    assert_false(dph_renderer_draw(renderer, &frame, &image, &err)); /* not baked */
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_non_null(strstr(err.message, "shsss"));
    frame.method = dph_method_find("lambert");
    bad = frame;
    bad.width = 17;
    assert_false(dph_renderer_draw(renderer, &bad, &image, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    bad = frame;
    bad.nlight = 0;
    assert_false(dph_renderer_draw(renderer, &bad, &image, &err));
    bad = frame;
    bad.camera.distance = NAN;
    assert_false(dph_renderer_draw(renderer, &bad, &image, &err));
    assert_true(dph_renderer_draw(renderer, &frame, &image, &err)); /* and still works */
    assert_true(pixel_at(&image, 8, 8)[3] == 1);
    dph_image_finish(&image);
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

static void test_methods(void **state)
{
    (void)state;
    const struct dph_method *method;
    for (size_t i = 0; (method = dph_method_at(i)); i++) {
        assert_ptr_equal(dph_method_find(method->name), method);
        assert_true(method->title[0] && method->paper[0]);
    }
    assert_non_null(dph_method_find("lambert"));
    assert_null(dph_method_find("lamberd"));
}

/* A misspelt uniform is an error, a declared one that the compiler dropped is not, and a compiler's
 * error names file and line. */
static void test_uniforms(void **state)
{
    (void)state;
    struct dph_program program;
    struct dph_error err = {0};
    const char *defines = "#define DPH_LIGHTS 1\n#define DPH_VECTORS 0\n";
    if (!dph_program_init(&program, "body.vert", "lambert.frag", defines, NULL, &err))
        fail_msg("%s", err.message);
    glUseProgram(program.id);
    dph_set_float(&program, "u_material.rim", 1);
    dph_set_float(&program, "u_material.specular", 1);
    if (!dph_program_check(&program, "test", &err))
        fail_msg("%s", err.message);
    static const char *const wrong[] = {"u_materiel.rim", "u_material.rimm", "u_clap", "rim",
                                        "u_light[0].color"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        dph_set_float(&program, wrong[i], 1);
        assert_false(dph_program_check(&program, "test", &err));
        assert_non_null(strstr(err.message, wrong[i]));
    }
    dph_set_float(&program, "u_clip", 1); /* a matrix */
    assert_false(dph_program_check(&program, "test", &err));
    assert_int_equal(err.code, DPH_ERROR_CAPABILITY);
    glUseProgram(0);
    dph_program_finish(&program);
    assert_false(dph_program_init(&program, "body.vert", "none.frag", defines, NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    /* without its define the vertex stage cannot be compiled: the message has the file of shaders/
     * and the line */
    assert_false(
        dph_program_init(&program, "body.vert", NULL, "#define DPH_VECTORS 9\n", NULL, &err));
    assert_int_equal(err.code, DPH_ERROR_CAPABILITY);
    if (strncmp(err.message, "shaders/frame.glsl:", 19) || atoi(err.message + 19) < 5)
        fail_msg("%s", err.message);
    assert_true(glGetError() == GL_NO_ERROR);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_thickness_values), cmocka_unit_test(test_indexed_and_unshared),
        cmocka_unit_test(test_backlit_sphere),   cmocka_unit_test(test_lambert_sphere),
        cmocka_unit_test(test_formulas),         cmocka_unit_test(test_open_sheet),
        cmocka_unit_test(test_many_lights),      cmocka_unit_test(test_mirrored),
        cmocka_unit_test(test_refusals),         cmocka_unit_test(test_methods),
        cmocka_unit_test(test_uniforms),         cmocka_unit_test(test_tiles),
    };
    return run_gl_tests(tests);
}
