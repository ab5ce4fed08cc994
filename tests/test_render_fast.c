/* What makes drawing fast and must not be seen: bands chosen by light and camera, vertices shared
 * and ordered, programs without the terms that a material lacks. */
#include "gl_tests.h"
#include "render_shapes.h"

#include "render/draw.h"

static const double nowhere[3] = {0, 0, 0};

/* A sphere with a dent, so that all bands count, baked to six of them. */
static struct dph_scene *dented_sphere(enum dph_store store, bool loose)
{
    struct dph_mesh mesh = make_sphere(24, 1, nowhere);
    struct dph_thickness *t = sphere_thickness(&mesh, 1, 6, DPH_STORE_FLOAT);
    float *row = t->data;
    for (size_t v = 0; v < mesh.nvert; v++)
        for (int i = 0; i < 36; i++)
            row[36 * v + (size_t)i] += .1F * mesh.position[3 * v] * (float)sin(i + 1);
    struct dph_mesh drawn = mesh;
    if (loose) {
        drawn = unshare(&mesh);
        float *all = malloc(drawn.nvert * 36 * sizeof *all);
        assert_non_null(all);
        for (size_t v = 0; v < drawn.nvert; v++)
            memcpy(all + 36 * v, row + 36 * (size_t)mesh.index[v], 36 * sizeof *all);
        free(t->data);
        t->data = all;
        t->nvert = drawn.nvert;
    }
    struct dph_thickness *packed =
        dph_thickness_create(t->data, t->nvert, 6, NULL, t->nvert, store, NULL);
    assert_non_null(packed);
    dph_thickness_destroy(t);
    if (loose)
        dph_mesh_finish(&mesh);
    return scene_of(drawn, packed);
}

static double largest_difference(const struct dph_image *a, const struct dph_image *b)
{
    double worst = 0;
    for (size_t i = 0; i < 4 * (size_t)(a->width * a->height); i++)
        worst = fmax(worst, fabs((double)a->pixel[i] - (double)b->pixel[i]));
    return worst;
}

static struct dph_image draw(struct dph_renderer *renderer, const struct dph_frame *frame)
{
    struct dph_error err = {0};
    struct dph_image image;
    assert_true(dph_image_init(&image, frame->width, frame->height, NULL));
    if (!dph_renderer_draw(renderer, frame, &image, &err))
        fail_msg("%s", err.message);
    return image;
}

/* The most that the picture changes from one step to the next while the light turns from the front
 * to the side. */
static double largest_step(struct dph_renderer *renderer, const struct dph_frame *start,
                           double degrees)
{
    struct dph_frame frame = *start;
    struct dph_image last = {0};
    double largest = 0;
    for (double azimuth = 20; azimuth <= 80; azimuth += degrees) {
        dph_light_direction(azimuth, 0, frame.light[0].to_light);
        struct dph_image now = draw(renderer, &frame);
        if (last.pixel)
            largest = fmax(largest, largest_difference(&now, &last));
        dph_image_finish(&last);
        last = now;
    }
    dph_image_finish(&last);
    return largest;
}

/* With light from behind the picture is that of six bands, from the front that of two, to the bit,
 * and while the light turns from the one to the other nothing jumps: steps of a quarter of the size
 * change the picture by about a quarter, where a jump would stay. */
static void test_auto_bands(void **state)
{
    (void)state;
    for (int store = DPH_STORE_FLOAT; store <= DPH_STORE_SNORM8; store++) {
        struct dph_scene *scene = dented_sphere((enum dph_store)store, false);
        struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
        assert_non_null(renderer);
        struct dph_frame frame = small_frame("shsss", 48, 0, 0), fixed;
        frame.mm_per_unit = 8;
        frame.samples = 1;
        frame.bands = DPH_BANDS_AUTO;
        fixed = frame;
        static const struct {
            double azimuth;
            int bands;
        } ends[] = {{0, 2}, {25, 2}, {-20, 2}, {75, 6}, {180, 6}, {-110, 6}};
        for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
            dph_light_direction(ends[i].azimuth, 0, frame.light[0].to_light);
            dph_light_direction(ends[i].azimuth, 0, fixed.light[0].to_light);
            fixed.bands = ends[i].bands;
            struct dph_image a = draw(renderer, &frame), b = draw(renderer, &fixed);
            assert_true(largest_difference(&a, &b) == 0);
            fixed.bands = 8 - ends[i].bands;
            dph_image_finish(&b);
            b = draw(renderer, &fixed);
            assert_true(largest_difference(&a, &b) > .01);
            dph_image_finish(&a);
            dph_image_finish(&b);
        }
        double coarse = largest_step(renderer, &frame, .5);
        double fine = largest_step(renderer, &frame, .125);
        if (!(coarse < .2 && fine < .4 * coarse))
            fail_msg("store %d: steps of %g, in finer steps still %g", store, coarse, fine);
        dph_renderer_destroy(renderer);
        dph_scene_destroy(scene);
    }
}

/* A light in front and one behind: each has its own bands, and the picture is their sum. */
static void test_auto_bands_of_two_lights(void **state)
{
    (void)state;
    struct dph_scene *scene = dented_sphere(DPH_STORE_SNORM8, false);
    struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
    struct dph_frame both = small_frame("shsss", 48, 10, 0), one;
    both.mm_per_unit = 8;
    both.samples = 1;
    both.nlight = 2;
    both.light[1] = both.light[0];
    dph_light_direction(170, 0, both.light[1].to_light);
    both.bands = DPH_BANDS_AUTO;
    one = both;
    one.nlight = 1;
    one.bands = 2;
    struct dph_image sum = draw(renderer, &both), front = draw(renderer, &one);
    one.light[0] = both.light[1];
    one.bands = 6;
    struct dph_image back = draw(renderer, &one);
    for (size_t i = 0; i < 48 * 48 * 4; i++)
        if (i % 4 != 3)
            assert_float_equal(sum.pixel[i], front.pixel[i] + back.pixel[i], 1e-5);
    dph_image_finish(&sum);
    dph_image_finish(&front);
    dph_image_finish(&back);
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

/* Equal vertices become one row, the same whether the file shares them or not and every time, and
 * the pictures are those without sharing, to the bit. */
static void test_order(void **state)
{
    (void)state;
    for (int store = DPH_STORE_FLOAT; store <= DPH_STORE_SNORM8; store++) {
        struct dph_scene *shared = dented_sphere((enum dph_store)store, false);
        struct dph_scene *loose = dented_sphere((enum dph_store)store, true);
        struct dph_renderer_params apart = {.unshared = true};
        struct dph_renderer *a = dph_renderer_create(shared, NULL),
                            *b = dph_renderer_create(loose, NULL),
                            *again = dph_renderer_create(loose, NULL),
                            *c = dph_renderer_create_with(loose, &apart, NULL);
        assert_true(a && b && again && c);
        const size_t corners = 3 * loose->body[0].mesh.ntri, rows = b->body[0].nvert;
        assert_int_equal(c->body[0].nvert, corners);
        assert_true(!c->body[0].indexed && b->body[0].indexed);
        assert_int_equal(a->body[0].nvert, rows);
        /* 23 rings of 48, on whose seam equal ones meet, and poles, where -0 is not 0 */
        assert_in_range(rows, 23 * 48 + 2, 23 * 48 + 8);
        assert_memory_equal(b->body[0].vertex, again->body[0].vertex, rows * sizeof(uint32_t));
        for (size_t v = 0; v < corners; v++) {
            const float *p = loose->body[0].mesh.position;
            uint32_t row = b->body[0].row_of[v];
            assert_true(row < rows);
            assert_memory_equal(p + 3 * v, p + 3 * (size_t)b->body[0].vertex[row],
                                3 * sizeof *p);
        }
        for (int m = 0; m < 2; m++) {
            struct dph_frame frame = small_frame(m ? "lambert" : "shsss", 64, 60, 30);
            frame.mm_per_unit = 8;
            struct dph_image one = draw(a, &frame), two = draw(b, &frame), three = draw(c, &frame);
            assert_true(largest_difference(&one, &three) == 0);
            assert_true(largest_difference(&two, &three) == 0);
            assert_true(pixel_at(&one, 32, 32)[0] > 0);
            dph_image_finish(&one);
            dph_image_finish(&two);
            dph_image_finish(&three);
        }
        dph_renderer_destroy(a);
        dph_renderer_destroy(b);
        dph_renderer_destroy(again);
        dph_renderer_destroy(c);
        dph_scene_destroy(shared);
        dph_scene_destroy(loose);
    }
}

/* One renderer, materials that differ in what they have: each gets its own program, and the terms
 * come and go. */
static void test_programs_of_materials(void **state)
{
    (void)state;
    struct dph_scene *scene = dented_sphere(DPH_STORE_SNORM8, false);
    struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
    for (int m = 0; m < 2; m++) {
        struct dph_frame plain = small_frame(m ? "lambert" : "shsss", 48, 30, 20), other;
        plain.mm_per_unit = 8;
        struct dph_image before = draw(renderer, &plain);
        for (int i = 0; i < 5; i++) {
            other = plain;
            other.material.specular = i == 0;
            other.material.rim = i == 1;
            other.material.ambient = i == 2;
            other.material.formula = i == 3 ? DPH_FORMULA_PAPER : DPH_FORMULA_G;
            other.material.curve = i == 4 ? DPH_CURVE_EXP : DPH_CURVE_SLAB;
            struct dph_image with = draw(renderer, &other), after = draw(renderer, &plain);
            bool concerned = m == 0 || i == 0 || i == 2;
            assert_true((largest_difference(&before, &with) > .01) == concerned);
            assert_true(largest_difference(&before, &after) == 0);
            dph_image_finish(&after);
            other.live_material = true; /* uniforms instead of constants, and another polynomial */
            after = draw(renderer, &other);
            assert_true(largest_difference(&with, &after) < (m || i == 4 ? 1e-5 : 5e-4));
            dph_image_finish(&with);
            dph_image_finish(&after);
        }
        dph_image_finish(&before);
    }
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

/* More materials than programs are kept: the first one's is made again, and draws the same. */
static void test_many_materials(void **state)
{
    (void)state;
    struct dph_scene *scene = dented_sphere(DPH_STORE_SNORM8, false);
    struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
    struct dph_frame frame = small_frame("lambert", 16, 30, 20);
    struct dph_image first = draw(renderer, &frame);
    struct dph_material wax = frame.material;
    for (int i = 0; i < 40; i++) {
        frame.material.absorption[1] = .01 + .003 * i;
        struct dph_image other = draw(renderer, &frame);
        assert_true(largest_difference(&first, &other) > 0);
        dph_image_finish(&other);
    }
    frame.material = wax;
    struct dph_image again = draw(renderer, &frame);
    assert_true(largest_difference(&first, &again) == 0);
    dph_image_finish(&first);
    dph_image_finish(&again);
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

/* The lowest integer of a file by others stands for -1, as its neighbour does. */
static void test_lowest_integers(void **state)
{
    (void)state;
    for (int store = DPH_STORE_SNORM16; store <= DPH_STORE_SNORM8; store++) {
        struct dph_scene *scene = dented_sphere((enum dph_store)store, false);
        struct dph_thickness *t = scene->body[0].thickness;
        for (size_t i = 0; i < t->nvert * (size_t)t->components; i += 7) {
            if (store == DPH_STORE_SNORM8)
                ((int8_t *)t->data)[i] = INT8_MIN;
            else
                ((int16_t *)t->data)[i] = INT16_MIN;
        }
        struct dph_frame frame = small_frame("shsss", 16, 150, 30);
        struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
        size_t nvert = scene->body[0].mesh.nvert;
        float *got = malloc(nvert * sizeof *got);
        assert_true(renderer && got);
        assert_true(dph_renderer_thickness(renderer, &frame, 0, got, NULL));
        for (size_t v = 0; v < nvert; v++)
            assert_float_equal(got[v], dph_thickness_along(t, v, frame.light[0].to_light), 1e-4);
        free(got);
        dph_renderer_destroy(renderer);
        dph_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_auto_bands),
        cmocka_unit_test(test_auto_bands_of_two_lights),
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_programs_of_materials),
        cmocka_unit_test(test_many_materials),
        cmocka_unit_test(test_lowest_integers),
    };
    return run_gl_tests(tests);
}
