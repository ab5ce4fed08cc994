/* As many samples a pixel as are asked for, whatever GL has: finer pictures, averaged. */
#include "gl_tests.h"
#include "render_shapes.h"

#include "render/draw.h"

static const double nowhere[3] = {0, 0, 0};

/* How a picture with so many samples is made here. */
static struct dph_target target_of(int width, int height, int samples)
{
    struct dph_target target = {0};
    struct dph_error err;
    if (!dph_target_fit(&target, width, height, samples, &err))
        fail_msg("%s", err.message);
    return target;
}

static struct dph_image draw(struct dph_renderer *renderer, const struct dph_frame *frame)
{
    struct dph_image image = {0};
    struct dph_error err;
    if (!dph_image_init(&image, frame->width, frame->height, &err) ||
        !dph_renderer_draw(renderer, frame, &image, &err))
        fail_msg("%s", err.message);
    return image;
}

static void test_enough_samples(void **state)
{
    (void)state;
    GLint most = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    for (int samples = 1; samples <= 16; samples++) {
        struct dph_target target = target_of(5000, 30, samples);
        GLint has = 0, width = 0;
        glBindRenderbuffer(GL_RENDERBUFFER, target.color);
        glGetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_SAMPLES, &has);
        glGetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_WIDTH, &width);
        glBindRenderbuffer(GL_RENDERBUFFER, 0);
        const int square = target.finer * target.finer;
        assert_true(square * (has > 1 ? has : 1) >= samples && square * target.samples >= samples);
        assert_true(samples > 1 || target.finer == 1); /* no more than needed */
        if (most < samples)
            assert_true(target.finer > 1);
        assert_int_equal(target.width * target.finer, width);
        assert_true(width <= 2048 && width > 2048 - target.finer && target.height == 30);
        dph_target_finish(&target);
    }
}

/* The mean over squares of a finer picture, by hand, is the picture: in every channel, with every
 * kind of pass, across tiles in both directions, and whatever the renderer drew before. */
static void test_average_by_hand(void **state)
{
    (void)state;
    static const char *const names[] = {"lambert", "shsss", "green", "green-gauss"};
    static const int sizes[][2] = {{40, 28}, {1100, 6}, {6, 1100}, {40, 28}};
    struct dph_mesh mesh = make_sphere(24, 1, nowhere);
    struct dph_thickness *t = sphere_thickness(&mesh, 1, 4, DPH_STORE_SNORM8);
    struct dph_scene *scene = scene_of(mesh, t);
    struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
    assert_non_null(renderer);
    for (size_t n = 0; n < 4; n++)
        for (size_t s = 0; s < 4; s++)
            for (int samples = 2; samples <= 16; samples += 7) {
                struct dph_frame frame = small_frame(names[n], 1, 120, 20), large;
                frame.width = sizes[s][0];
                frame.height = sizes[s][1];
                frame.samples = samples;
                frame.background[1] = .5;
                if (frame.width + frame.height > 1000) /* tiles meet on the sphere */
                    frame.camera.fov = frame.width > 1000 ? .115 : 21;
                struct dph_target target = target_of(frame.width, frame.height, samples);
                const int finer = target.finer;
                large = frame;
                large.width *= finer;
                large.height *= finer;
                large.samples = target.samples;
                dph_target_finish(&target);
                struct dph_image image = draw(renderer, &frame), fine = draw(renderer, &large);
                double partly = 0;
                for (int y = 0; y < frame.height; y++)
                    for (int x = 0; x < frame.width; x++)
                        for (int c = 0; c < 4; c++) {
                            double mean = 0, got = (double)pixel_at(&image, x, y)[c];
                            for (int i = 0; i < finer * finer; i++)
                                mean += (double)pixel_at(&fine, finer * x + i % finer,
                                                         finer * y + i / finer)[c] /
                                        (finer * finer);
                            if (!(fabs(got - mean) <= 1e-6 * (1 + mean)))
                                fail_msg("%s, %d samples, (%d, %d), channel %d: %g, not %g",
                                         names[n], samples, x, y, c, got, mean);
                            partly += c == 3 && got > 0 && got < 1;
                        }
                assert_true(partly > 0 || s % 3); /* edges are in the small pictures */
                if (frame.width + frame.height > 1000)
                    assert_true(pixel_at(&image, frame.width > 1000 ? 1024 : 3,
                                         frame.width > 1000 ? 3 : 1100 - 1024)[3] == 1);
                dph_image_finish(&image);
                dph_image_finish(&fine);
            }
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

/* Where 16 samples need tiles and 4 do not, the two agree inside the object: but for pixels in
 * which triangles meet, where what few samples shade is a little outside of them, and much nearer
 * than neighbouring pixels are. */
static void test_no_seam(void **state)
{
    (void)state;
    struct dph_scene *scene = scene_of(make_sphere(200, 1, nowhere), NULL);
    struct dph_frame frame = small_frame("lambert", 1, 80, 30);
    frame.camera.fov = .115;
    frame.width = 1100;
    frame.height = 6;
    struct dph_image four = picture(scene, &frame);
    frame.samples = 16;
    struct dph_image sixteen = picture(scene, &frame);
    double steps = 0, mean = 0;
    for (int y = 0; y < frame.height; y++)
        for (int x = 960; x < 1060; x++) {
            assert_true(pixel_at(&sixteen, x, y)[3] == 1 && pixel_at(&four, x, y)[3] == 1);
            const double other = (double)pixel_at(&four, x, y)[0];
            const double off = fabs((double)pixel_at(&sixteen, x, y)[0] - other);
            assert_true(off < 5e-4);
            mean += off / (6 * 100);
            steps += fabs(other - (double)pixel_at(&four, x - 1, y)[0]) / (6 * 100);
        }
    assert_true(steps > 1e-3 && mean < 1e-4); /* half a pixel would be seen */
    dph_image_finish(&four);
    dph_image_finish(&sixteen);
    dph_scene_destroy(scene);
}

/* The part of a convex polygon where sign * (coordinate - at) >= 0. */
static int cut(double (*point)[2], int count, int axis, double at, double sign)
{
    double out[16][2];
    int n = 0;
    for (int i = 0; i < count; i++) {
        const double *a = point[i], *b = point[(i + 1) % count];
        const double da = sign * (a[axis] - at), db = sign * (b[axis] - at);
        if (da >= 0)
            memcpy(out[n++], a, sizeof out[0]);
        if ((da >= 0) != (db >= 0)) {
            for (int k = 0; k < 2; k++)
                out[n][k] = a[k] + da / (da - db) * (b[k] - a[k]);
            n++;
        }
    }
    memcpy(point, out, (size_t)n * sizeof out[0]);
    return n;
}

/* The area of a convex quadrilateral within the pixel at (x, y). */
static double covered(double (*corner)[2], int x, int y)
{
    double point[16][2], twice = 0;
    memcpy(point, corner, 4 * sizeof point[0]);
    int n = cut(point, 4, 0, x, 1);
    n = cut(point, n, 0, x + 1, -1);
    n = cut(point, n, 1, y, 1);
    n = cut(point, n, 1, y + 1, -1);
    for (int i = 0; i < n; i++) {
        const double *a = point[i], *b = point[(i + 1) % n];
        twice += a[0] * b[1] - a[1] * b[0];
    }
    return fabs(twice) / 2;
}

/* Coverage of a slanted square's edges against the exact area in every pixel, and of all of it. */
static void test_coverage(void **state)
{
    (void)state;
    enum { SIDE = 96 };
    const double c = cos(.3), s = sin(.3), eye = 3 * sqrt(2) * (c + s);
    const double scale = SIDE / 2 / (eye * tan(35 * PI / 360));
    struct dph_mesh mesh = make_square(true);
    double corner[4][2], error[2] = {0}, area[2] = {0};
    for (size_t v = 0; v < 4; v++) {
        float *p = mesh.position + 3 * v;
        double x = (double)p[0], y = (double)p[1];
        p[0] = (float)(c * x - s * y);
        p[1] = (float)(s * x + c * y);
        corner[v][0] = SIDE / 2 + scale * (c * x - s * y);
        corner[v][1] = SIDE / 2 - scale * (s * x + c * y);
    }
    struct dph_scene *scene = scene_of(mesh, NULL);
    int edges = 0;
    for (int i = 0; i < 2; i++) {
        struct dph_frame frame = small_frame("lambert", SIDE, 0, 0);
        frame.samples = i ? 16 : 4;
        struct dph_image image = picture(scene, &frame);
        edges = 0;
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                double exact = covered(corner, x, y), got = (double)pixel_at(&image, x, y)[3];
                area[i] += got;
                error[i] += (got - exact) * (got - exact);
                edges += exact > 0 && exact < 1;
                if (!(fabs(got - exact) < (i ? .2 : .4)))
                    fail_msg("%d samples at (%d, %d): %g, not %g", frame.samples, x, y, got, exact);
            }
        error[i] = sqrt(error[i] / edges);
        dph_image_finish(&image);
    }
    print_message("coverage of %d pixels on edges: off by %.4f with 4 samples, %.4f with 16\n",
                  edges, error[0], error[1]);
    assert_true(edges > 100 && error[1] < .7 * error[0] && error[1] < .06);
    assert_float_equal(area[1], 4 * scale * scale, .001 * area[1]);
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_enough_samples),
        cmocka_unit_test(test_average_by_hand),
        cmocka_unit_test(test_no_seam),
        cmocka_unit_test(test_coverage),
    };
    return run_gl_tests(tests);
}
