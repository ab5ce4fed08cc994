/* What the benchmark stands on: unshared vertices draw the same picture, and the figures of a
 * measurement are consistent. Nothing here asserts a speed. */
#include "gl_tests.h"
#include "render_shapes.h"

static const double nowhere[3] = {0, 0, 0};

static struct dph_scene *sphere(enum dph_store store)
{
    struct dph_mesh mesh = make_sphere(20, 1, nowhere);
    struct dph_thickness *thickness = sphere_thickness(&mesh, 1, 4, store);
    return scene_of(mesh, thickness);
}

static struct dph_image draw(const struct dph_scene *scene, const struct dph_frame *frame,
                             bool unshared)
{
    struct dph_image image = {0};
    struct dph_error err = {0};
    const struct dph_renderer_params params = {.unshared = unshared};
    struct dph_renderer *renderer = dph_renderer_create_with(scene, &params, &err);
    if (!renderer || !dph_image_init(&image, frame->width, frame->height, &err) ||
        !dph_renderer_draw(renderer, frame, &image, &err))
        fail_msg("%s", err.message);
    dph_renderer_destroy(renderer);
    return image;
}

/* The same corners in the same triangles: the same picture, whatever the coefficients' type. */
static void test_unshared(void **state)
{
    (void)state;
    static const enum dph_store stores[] = {DPH_STORE_FLOAT, DPH_STORE_SNORM8, DPH_STORE_CPCA};
    for (size_t s = 0; s < 3; s++) {
        struct dph_scene *scene = sphere(stores[s]);
        struct dph_frame frame = small_frame("shsss", 48, 150, 20);
        struct dph_image shared = draw(scene, &frame, false), own = draw(scene, &frame, true);
        double lit = 0;
        for (size_t i = 0; i < 4 * 48 * 48; i++) {
            lit += (double)shared.pixel[i];
            if (!(fabs((double)(shared.pixel[i] - own.pixel[i])) < 1e-5))
                fail_msg("store %zu, number %zu: %g and %g", s, i, (double)shared.pixel[i],
                         (double)own.pixel[i]);
        }
        assert_true(lit > 100);
        dph_image_finish(&shared);
        dph_image_finish(&own);
        dph_scene_destroy(scene);
    }
}

static bool count_steps(void *user, double fraction)
{
    double *last = user;
    assert_true(fraction >= *last && fraction <= 1);
    *last = fraction;
    return true;
}

static void test_figures(void **state)
{
    (void)state;
    struct dph_error err = {0};
    struct dph_scene *scene = sphere(DPH_STORE_SNORM8);
    struct dph_renderer *renderer = dph_renderer_create(scene, &err);
    struct dph_timing_job job[3];
    struct dph_timing timing[3];
    struct dph_timing_params params = dph_timing_defaults();
    double last = 0;
    assert_non_null(renderer);
    static const char *const names[3] = {"lambert", "shsss", "green"};
    for (size_t j = 0; j < 3; j++) {
        job[j] = (struct dph_timing_job){renderer, small_frame(names[j], 32, 30, 20)};
        job[j].frame.map_size = 64;
        job[j].frame.samples = 1 + 3 * (int)(j == 1);
    }
    params.seconds = .03;
    params.rounds = 3;
    params.progress = count_steps;
    params.progress_user = &last;
    if (!dph_renderer_measure(job, 3, &params, timing, &err))
        fail_msg("%s", err.message);
    assert_true(last > .999);
    for (size_t j = 0; j < 3; j++) {
        const struct dph_timing *t = &timing[j];
        assert_true(t->frames >= 3);
        assert_true(t->ms_p05 > 0 && t->ms_p05 <= t->ms_median && t->ms_median <= t->ms_p95);
        assert_true(t->cpu_ms > 0 && t->ratio > 0);
        assert_true(t->ratio_error >= 0 && isfinite(t->ratio_error) && t->others >= 0);
        assert_int_equal(t->gpu, dph_gl_timers());
        if (!t->gpu)
            assert_true(t->cpu_ms <= t->ms_median);
    }
    assert_true(timing[0].ratio == 1);
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

static bool stop(void *user, double fraction)
{
    (void)user;
    return fraction < .3;
}

static void test_refusals(void **state)
{
    (void)state;
    struct dph_error err = {0};
    struct dph_scene *scene = sphere(DPH_STORE_SNORM8);
    struct dph_renderer *renderer = dph_renderer_create(scene, &err);
    struct dph_timing_job job = {renderer, small_frame("shsss", 16, 30, 20)};
    struct dph_timing timing;
    struct dph_timing_params params = dph_timing_defaults();
    params.seconds = 0;
    assert_false(dph_renderer_measure(&job, 1, &params, &timing, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    params.seconds = .01;
    params.rounds = 0;
    assert_false(dph_renderer_measure(&job, 1, &params, &timing, &err));
    params.rounds = 4;
    assert_false(dph_renderer_measure(&job, 0, &params, &timing, &err));
    params.progress = stop;
    assert_false(dph_renderer_measure(&job, 1, &params, &timing, &err));
    assert_int_equal(err.code, DPH_ERROR_CANCELLED);
    params.progress = NULL;
    job.frame.method = dph_method_find("prt");
    assert_false(dph_renderer_measure(&job, 1, &params, &timing, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    assert_non_null(strstr(err.message, "prt"));
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unshared),
        cmocka_unit_test(test_figures),
        cmocka_unit_test(test_refusals),
    };
    return run_gl_tests(tests);
}
