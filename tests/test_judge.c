/* The comparison and its fits, on spheres. */
#include "gl_tests.h"
#include "render_shapes.h"

#include "judge/protocol.h"

static const double nowhere[3] = {0, 0, 0};

static void near(double value, double wanted, double tolerance)
{
    if (!(fabs(value - wanted) <= tolerance))
        fail_msg("%.9g is not %.9g +- %g", value, wanted, tolerance);
}

/* Training pictures that a method draws itself, with a material and a factor a channel. */
static struct dph_training draw_training(struct dph_renderer *renderer, struct dph_frame frame,
                                         const double gain[3])
{
    struct dph_training training = {
        .nlight = DPH_TRAINING_LIGHTS, .width = frame.width, .height = frame.height};
    size_t pixels = (size_t)frame.width * (size_t)frame.height;
    dph_training_lights(&frame.camera, 0, training.light);
    training.mask = calloc(pixels, 1);
    assert_non_null(training.mask);
    for (int l = 0; l < training.nlight; l++) {
        struct dph_image *image = &training.image[l];
        double square[3] = {0};
        frame.light[0] = training.light[l];
        assert_true(dph_image_init(image, frame.width, frame.height, NULL));
        assert_true(dph_renderer_draw(renderer, &frame, image, NULL));
        training.pixels = 0;
        for (size_t i = 0; i < pixels; i++) {
            training.mask[i] = image->pixel[4 * i + 3] >= .5F;
            training.pixels += training.mask[i];
            for (size_t c = 0; c < 3; c++) {
                image->pixel[4 * i + c] *= (float)gain[c];
                double value = (double)image->pixel[4 * i + c];
                square[c] += training.mask[i] ? value * value : 0;
            }
        }
        for (size_t c = 0; c < 3; c++)
            training.weight[l][c] = square[c] > 0 ? 1 / square[c] : 0;
    }
    assert_true(training.pixels > 100);
    return training;
}

/* The numbers that a picture was drawn with are found again. */
static void test_fit_recovers(void **state)
{
    (void)state;
    static const double one[3] = {1, 1, 1}, gain[3] = {.5, 1.5, 1};
    struct dph_mesh mesh = make_sphere(24, 5, nowhere);
    struct dph_thickness *t = sphere_thickness(&mesh, 5, 6, DPH_STORE_FLOAT);
    struct dph_scene *scene = scene_of(mesh, t);
    struct dph_renderer *renderer = dph_renderer_create(scene, NULL);
    assert_non_null(renderer);
    for (int formula = 0; formula < 2; formula++)
        for (int curve = 0; curve < 2; curve++) {
            struct dph_frame frame = small_frame("shsss", 96, 0, 0);
            struct dph_material *m = &frame.material, found;
            static const double sigma[3] = {.05, .3, .7}, base[3] = {.1, .07, .02},
                                front[3] = {.2, .1, .3}, back[3] = {.05, .2, .4};
            double error;
            m->formula = (enum dph_formula)formula;
            m->curve = (enum dph_curve)curve;
            memcpy(m->sigma, sigma, sizeof sigma);
            memcpy(m->base, base, sizeof base);
            memcpy(m->front, front, sizeof front);
            memcpy(m->back, back, sizeof back);
            struct dph_training training = draw_training(renderer, frame, one);
            struct dph_fitting fitting = {renderer, frame, &training, 10, NULL};
            for (int c = 0; c < 3; c++) /* it must not matter where it starts */
                fitting.frame.material.sigma[c] = fitting.frame.material.base[c] =
                    fitting.frame.material.front[c] = fitting.frame.material.back[c] = 1;
            assert_true(dph_fit_thickness(&fitting, &found, NULL));
            for (int c = 0; c < 3; c++) {
                if (curve == DPH_CURVE_EXP)
                    near(found.sigma[c] / sigma[c], 1, .02);
                near(found.base[c], base[c], .03 * base[c] + .002);
                near(found.front[c], front[c], .03 * front[c] + .002);
                near(found.back[c], formula == DPH_FORMULA_G ? back[c] : 0, .03 * back[c] + .002);
            }
            assert_true(dph_fit_error(&fitting, &found, one, &error, NULL));
            near(error, 0, curve == DPH_CURVE_EXP ? .005 : 1e-5);
            dph_training_finish(&training);
        }
    struct dph_frame frame = small_frame("lambert", 40, 0, 0);
    struct dph_training training = draw_training(renderer, frame, gain);
    struct dph_fitting fitting = {renderer, frame, &training, 10, NULL};
    double found[3], error;
    assert_true(dph_fit_gain(&fitting, found, NULL));
    for (int c = 0; c < 3; c++)
        near(found[c], gain[c], 1e-5);
    assert_true(dph_fit_error(&fitting, &frame.material, one, &error, NULL));
    assert_true(error > .1);
    assert_true(dph_fit_error(&fitting, &frame.material, found, &error, NULL));
    near(error, 0, 1e-5);
    dph_training_finish(&training);
    dph_renderer_destroy(renderer);
    dph_scene_destroy(scene);
}

static struct dph_judge_params tiny(const struct dph_method *const *method, size_t nmethod,
                                    const struct dph_material *material)
{
    struct dph_judge_params params = dph_judge_defaults();
    params.method = method;
    params.nmethod = nmethod;
    params.material = material;
    params.nmaterial = 1;
    params.width = 48;
    params.height = 30;
    params.samples = 16;
    params.training_width = 32;
    params.training_height = 20;
    params.training_samples = 8;
    params.held_samples = 64;
    params.size_mm = 10;
    params.bake.bake.directions = 128;
    params.rivals.directions = 128;
    return params;
}

static void test_sphere(void **state)
{
    (void)state;
    const struct dph_method *const method[2] = {dph_method_find("lambert"),
                                                dph_method_find("shsss")};
    struct dph_error err = {0};
    struct dph_scene *scene = scene_of(make_sphere(12, 1, nowhere), NULL);
    struct dph_judge_params params = tiny(method, 2, dph_material_preset(0));
    struct dph_comparison *c = dph_comparison_create(scene, &params, "a name", &err);
    if (!c)
        fail_msg("%s", err.message);
    assert_null(scene->body[0].thickness); /* the scene is as it was */
    assert_int_equal(c->nmaterial, 1);
    assert_int_equal(c->nlight, 3);
    assert_string_equal(c->renderer, "a name");
    near(c->size_mm, 10, 1e-6);
    struct dph_judged *wax = &c->material[0];
    assert_int_equal(wax->nentry, 6); /* lambert, shsss with 6 and 2 bands, each fitted and not */
    assert_int_equal(wax->samples, 16);
    assert_int_equal(wax->held.nlight, DPH_JUDGE_HELD_LIGHTS);
    assert_true(wax->held.samples == 64 && wax->held.pixels > 60 && wax->held.noise_rmse > 0);
    assert_true(isnan(wax->held.views_rmse)); /* no method is a response */
    for (size_t i = 0; i < wax->nentry; i++) {
        const struct dph_entry *entry = &wax->entry[i];
        assert_true(entry->shown);
        assert_int_equal(entry->fitted, i % 2);
        assert_int_equal(entry->bands, i < 2 ? 0 : i < 4 ? 6 : 2);
        assert_int_equal((int)entry->payload_bytes, i < 2 ? 0 : i < 4 ? 36 : 4);
        assert_true(entry->milliseconds > 0);
        if (!(entry->rmse_all_lights > 0 && entry->rmse_all_lights < 1))
            fail_msg("%s: all lights %g", entry->method->name, entry->rmse_all_lights);
        assert_true(isnan(entry->rmse_all_lights_view_averaged));
        if (entry->fitted)
            assert_true(entry->training_after < entry->training_before);
        for (size_t l = 0; l < 3; l++) {
            const struct dph_shot *shot = &entry->shot[l];
            assert_non_null(shot->image.pixel);
            assert_non_null(shot->flip);
            /* noise makes errors below the truth's size larger, and those above it smaller */
            assert_true(shot->scores.rmse >= 0 && (shot->scores.rmse < shot->scores.rmse_raw) ==
                                                      (shot->scores.rmse_raw < 1));
            assert_true(isfinite(shot->scores.psnr) && shot->scores.flip > 0);
            assert_true(isnan(shot->scores.rmse_view_averaged));
        }
    }
    for (size_t l = 0; l < 3; l++) {
        assert_true(wax->truth[l].pixels > 150 && wax->truth[l].mean > 0);
        assert_true(isfinite(wax->truth[l].noise.psnr) && wax->truth[l].noise.rmse > 0);
    }
    /* light from behind goes through: plain shading cannot, thickness can */
    assert_true(wax->entry[0].shot[2].scores.rmse > .6);
    assert_true(wax->entry[3].shot[2].scores.rmse < .6 * wax->entry[0].shot[2].scores.rmse);
    /* with 16 samples the noise is told */
    assert_true(wax->entry[3].shot[0].noisy && *wax->entry[3].shot[0].warning);

    struct dph_comparison *again = dph_comparison_create(scene, &params, NULL, &err);
    assert_non_null(again);
    for (size_t i = 0; i < wax->nentry; i++)
        for (size_t l = 0; l < 3; l++)
            assert_memory_equal(&wax->entry[i].shot[l].scores,
                                &again->material[0].entry[i].shot[l].scores,
                                sizeof(struct dph_scores));
    dph_comparison_destroy(again);
    dph_comparison_destroy(c);

    struct dph_material fitted;
    double before, after;
    params.method = &method[1];
    params.nmethod = 1;
    if (!dph_judge_fit(scene, &params, &fitted, &before, &after, &err))
        fail_msg("%s", err.message);
    assert_true(after < before && fitted.curve == DPH_CURVE_EXP && fitted.sigma[0] > 0);
    params.method = method;
    assert_false(dph_judge_fit(scene, &params, &fitted, &before, &after, &err));
    assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    dph_scene_destroy(scene);
}

/* What the response stores is an average over views, near to the truth that is one as well. The
 * picture is as far from that as the two truths are apart, or would be, were it not for what the
 * eye sees over the average. */
static void test_views(void **state)
{
    (void)state;
    const struct dph_method *const method[2] = {dph_method_find("response"),
                                                dph_method_find("shsss")};
    struct dph_error err = {0};
    struct dph_scene *scene = scene_of(make_sphere(16, 1, nowhere), NULL);
    struct dph_judge_params params = tiny(method, 2, dph_material_preset(0));
    params.size_mm = 2; /* thin, so that views differ */
    params.samples = params.held_samples = 200;
    params.response.noise = .1;
    params.fit = false;
    struct dph_comparison *c = dph_comparison_create(scene, &params, NULL, &err);
    if (!c)
        fail_msg("%s", err.message);
    const struct dph_judged *wax = &c->material[0];
    double floor = wax->held.views_rmse;
    assert_int_equal(wax->nentry, 7); /* response with 6, 4, 3 bands, shsss with 6, 2, 4, 3 */
    printf("    views are %.3f apart; from the picture and the average: ", floor);
    for (size_t i = 0; i < 3; i++) {
        const struct dph_entry *entry = &wax->entry[i];
        double both[2] = {entry->rmse_all_lights, entry->rmse_all_lights_view_averaged};
        printf("%.3f %.3f; ", both[0], both[1]);
        assert_true(both[1] < .5 * floor && both[1] < .15);
        assert_true(both[0] < .6 * floor);
        for (size_t l = 0; l < 3; l++)
            assert_true(entry->shot[l].scores.rmse_view_averaged < wax->truth[l].views_rmse);
    }
    printf("\n");
    for (size_t i = 3; i < 7; i++) {
        static const int bands[] = {6, 2, 4, 3};
        const struct dph_entry *entry = &wax->entry[i];
        assert_true(entry->bands == bands[i - 3] && entry->shown == (i < 5));
        assert_int_equal((int)entry->payload_bytes, entry->bands * entry->bands);
        assert_true(entry->rmse_all_lights_view_averaged > 0);
    }
    assert_true(floor > .1);
    for (size_t l = 0; l < 3; l++)
        assert_true(wax->truth[l].views.pixel && wax->truth[l].views_rmse > .05);
    dph_comparison_destroy(c);
    params.boundary = DPH_BOUNDARY_DIELECTRIC; /* is not averaged */
    params.samples = params.held_samples = 4;
    if (!(c = dph_comparison_create(scene, &params, NULL, &err)))
        fail_msg("%s", err.message);
    assert_true(isnan(c->material[0].truth[0].views_rmse) &&
                isnan(c->material[0].entry[0].rmse_all_lights_view_averaged) &&
                isnan(c->material[0].entry[0].shot[0].scores.rmse_view_averaged));
    dph_comparison_destroy(c);
    dph_scene_destroy(scene);
}

/* A study adds rows without pictures; fewer bands of a plain projection cost fewer bytes. */
static void test_study(void **state)
{
    (void)state;
    const struct dph_method *const method[1] = {dph_method_find("shsss")};
    struct dph_error err = {0};
    struct dph_scene *scene = scene_of(make_sphere(6, 1, nowhere), NULL);
    struct dph_judge_params params = tiny(method, 1, dph_material_preset(0));
    params.study = true;
    params.fit = false;
    params.nlight = 1;
    struct dph_comparison *c = dph_comparison_create(scene, &params, NULL, &err);
    if (!c)
        fail_msg("%s", err.message);
    assert_int_equal(c->material[0].nentry, 2 + 32);
    for (size_t i = 2; i < 34; i++) {
        const struct dph_entry *entry = &c->material[0].entry[i];
        assert_false(entry->shown || entry->fitted);
        assert_null(entry->shot[0].image.pixel);
        assert_int_equal((int)entry->payload_bytes, entry->bands * entry->bands);
    }
    dph_comparison_destroy(c);
    dph_scene_destroy(scene);
}

struct stop {
    enum dph_judge_phase phase;
    int calls;
};

static bool stop_at(void *user, enum dph_judge_phase phase, const char *material, double fraction)
{
    struct stop *stop = user;
    assert_string_equal(material, "wax");
    assert_true(fraction >= 0 && fraction <= 1);
    stop->calls += phase == stop->phase;
    return phase != stop->phase || stop->calls <= 2;
}

/* Cancelling the reference keeps its samples; cancelling anything else ends the work. */
static void test_cancel(void **state)
{
    (void)state;
    const struct dph_method *const method[2] = {dph_method_find("shsss"),
                                                dph_method_find("response")};
    struct dph_scene *scene = scene_of(make_sphere(6, 1, nowhere), NULL);
    struct dph_judge_params params = tiny(method, 2, dph_material_preset(0));
    params.response.noise = 1;
    for (int phase = DPH_JUDGE_BAKE; phase <= DPH_JUDGE_DRAW; phase++) {
        struct stop stop = {(enum dph_judge_phase)phase, 0};
        struct dph_error err = {0};
        params.samples = phase == DPH_JUDGE_TRUTH ? 4000 : 4;
        params.training_samples = phase == DPH_JUDGE_TRAINING ? 4000 : 4;
        params.views_samples = phase == DPH_JUDGE_VIEWS ? 4000 : 4;
        params.held_samples = phase == DPH_JUDGE_HELD ? 4000 : 4;
        params.progress = stop_at;
        params.progress_user = &stop;
        struct dph_comparison *c = dph_comparison_create(scene, &params, NULL, &err);
        assert_true(stop.calls > 0);
        if (phase >= DPH_JUDGE_TRUTH && phase <= DPH_JUDGE_HELD) {
            if (!c)
                fail_msg("%s", err.message);
            assert_int_equal(c->nwarning, phase == DPH_JUDGE_TRUTH);
            assert_true(phase != DPH_JUDGE_TRUTH || c->material[0].samples < 4000);
            assert_true(c->material[0].held.samples < 4000);
        } else {
            assert_null(c);
            assert_int_equal(err.code, DPH_ERROR_CANCELLED);
        }
        assert_null(scene->body[0].thickness);
        dph_comparison_destroy(c);
    }
    dph_scene_destroy(scene);
}

static void test_refusals(void **state)
{
    (void)state;
    const struct dph_method *const method[2] = {dph_method_find("shsss"), dph_method_find("shsss")};
    const struct dph_method *const quantity[1] = {dph_method_find("thickness")};
    struct dph_scene *scene = scene_of(make_sphere(6, 1, nowhere), NULL);
    for (int i = 0; i < 7; i++) {
        struct dph_judge_params params = tiny(method, 1, dph_material_preset(0));
        struct dph_error err = {0};
        switch (i) {
        case 0: params.nmethod = 0; break;
        case 1: params.nmethod = 2; break;
        case 2: params.method = quantity; break;
        case 3: params.nlight = DPH_JUDGE_LIGHTS + 1; break;
        case 4: params.width = 0; break;
        case 5: params.samples = 0; break;
        case 6: params.held_samples = -1; break;
        }
        assert_null(dph_comparison_create(scene, &params, NULL, &err));
        assert_int_equal(err.code, DPH_ERROR_ARGUMENT);
    }
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fit_recovers), cmocka_unit_test(test_sphere),
        cmocka_unit_test(test_views),        cmocka_unit_test(test_study),
        cmocka_unit_test(test_cancel),       cmocka_unit_test(test_refusals),
    };
    return run_gl_tests(tests);
}
