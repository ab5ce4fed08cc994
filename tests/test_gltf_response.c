/* A baked response in glTF: written, read back in every form and packing, baked over, beside other
 * data, and broken on purpose. */
#include "saved_scene.h"

#include <diaphan/rivals.h>

#include <stdlib.h>

enum { SIDE = 12, COUNT = SIDE * SIDE };

static struct dph_scene *make_scene(void)
{
    struct dph_scene *scene = wavy_sheet(SIDE, .2F);
    scene->mm_per_unit = 20;
    return scene;
}

/* Some rows that are not alike, in another order than the vertices. */
static void bake(struct dph_scene *scene, enum dph_response_form form, int bands,
                 enum dph_store store, int clusters)
{
    struct dph_transfer t = {
        .npos = COUNT, .nvert = COUNT, .bands = 6, .channels = 3, .length = 108};
    struct dph_response_params params = dph_response_defaults();
    struct dph_error err = {0};
    uint32_t seed = 3;
    t.vector = malloc(COUNT * 108 * sizeof *t.vector);
    t.area = malloc(COUNT * sizeof *t.area);
    t.position_of = malloc(COUNT * sizeof *t.position_of);
    assert_true(t.vector && t.area && t.position_of);
    for (uint32_t v = 0; v < COUNT; v++) {
        t.area[v] = 1;
        t.position_of[v] = COUNT - 1 - v;
        for (int i = 0; i < 108; i++)
            t.vector[v * 108 + (uint32_t)i] =
                (i % 36
                     ? .3F * ((float)((seed = seed * 1664525U + 1013904223U) >> 8) / 0x1p24F - .5F)
                     : 1) /
                (float)(1 + i % 36) / (float)(1 + i / 36);
    }
    params.form = form;
    params.bands = bands;
    params.store = store;
    params.cpca.clusters = clusters;
    params.cpca.vectors = 5;
    struct dph_rivals *rivals = scene->body->rivals;
    if (!rivals)
        rivals = scene->body->rivals = calloc(1, sizeof *rivals);
    assert_non_null(rivals);
    dph_response_destroy(rivals->response);
    if (!(rivals->response = dph_response_create(&t, &params, NULL, &err)))
        fail_msg("%s", err.message);
    rivals->response->noise = .05;
    rivals->response->walks = 1234.5;
    rivals->products |= DPH_PRODUCT_RESPONSE;
    dph_rivals_remember(&rivals->response_origin, dph_material_preset(1), 20, 0);
    dph_transfer_finish(&t);
}

static void assert_same(const struct dph_rivals *a, const struct dph_rivals *b)
{
    assert_true(a && b && a->response && b->response);
    const struct dph_response *x = a->response, *y = b->response;
    assert_int_equal(a->products, b->products);
    assert_int_equal(x->form, y->form);
    assert_int_equal(x->bands, y->bands);
    assert_true(x->noise == y->noise && x->walks == y->walks);
    assert_int_equal(dph_response_payload(x), dph_response_payload(y));
    assert_int_equal(dph_response_shared(x), dph_response_shared(y));
    if (x->form != DPH_RESPONSE_RGB)
        assert_memory_equal(&x->ramp, &y->ramp, sizeof x->ramp);
    assert_memory_equal(&x->view, &y->view, sizeof x->view);
    assert_string_equal(a->response_origin.material, b->response_origin.material);
    assert_memory_equal(a->response_origin.scattering, b->response_origin.scattering,
                        sizeof a->response_origin.scattering);
    assert_true(a->response_origin.mm_per_unit == b->response_origin.mm_per_unit);
    float *direction = malloc(3 * 32 * sizeof *direction);
    assert_non_null(direction);
    dph_sh_directions(32, direction);
    for (size_t v = 0; v < COUNT; v++)
        for (int d = 0; d < 32; d++) {
            double w[3], p[3], q[3];
            for (int k = 0; k < 3; k++)
                w[k] = (double)direction[3 * d + k];
            dph_response_along(x, v, w, 0, p);
            dph_response_along(y, v, w, 0, q);
            for (int c = 0; c < 3; c++)
                assert_true(p[c] == q[c]);
        }
    free(direction);
}

/* Every form, packing and number of bands comes back as it was, also from a copy of the copy, which
 * has the same bytes. */
static void test_round_trip(void **unused)
{
    static char first[1 << 20], second[1 << 20];
    (void)unused;
    for (int form = 0; form < 3; form++)
        for (int bands = 1; bands <= 6; bands++)
            for (int store = 0; store < 4; store++) {
                struct dph_scene *scene = make_scene();
                bake(scene, (enum dph_response_form)form, bands, (enum dph_store)store,
                     bands == 4 ? 300 : 3);
                if (form == DPH_RESPONSE_ROOT && store != DPH_STORE_CPCA)
                    for (int k = 0; k < DPH_VIEW_TERMS; k++)
                        scene->body->rivals->response->view.term[k] = (float)(k - 7) / 3;
                save(scene, path);
                struct dph_scene *back = load(path);
                assert_same(scene->body->rivals, back->body->rivals);
                assert_true(back->mm_per_unit == 20);
                save(back, again);
                FILE *file = fopen(path, "rb");
                assert_non_null(file);
                size_t size = fread(first, 1, sizeof first, file);
                fclose(file);
                assert_non_null(file = fopen(again, "rb"));
                assert_int_equal(fread(second, 1, sizeof second, file), size);
                fclose(file);
                assert_memory_equal(first, second, size);
                dph_scene_destroy(back);
                dph_scene_destroy(scene);
            }
}

/* Another form replaces it; what is beside it stays; nothing piles up. */
static void test_bake_over(void **unused)
{
    (void)unused;
    struct dph_scene *scene = make_scene();
    struct dph_rivals_params params = dph_rivals_defaults();
    struct dph_error err = {0};
    params.material = dph_material_preset(0);
    params.bands = 2;
    params.directions = 16;
    params.clusters = 3;
    params.vectors = 3;
    assert_true(dph_scene_bake_rivals(scene, DPH_PRODUCT_CLUSTERS | DPH_PRODUCT_NORMALS, &params,
                                      NULL, &err));
    scene->mm_per_unit = 20;
    bake(scene, DPH_RESPONSE_RGB, 6, DPH_STORE_FLOAT, 0);
    save(scene, path);
    struct dph_scene *back = load(path);
    bake(back, DPH_RESPONSE_ROOT, 3, DPH_STORE_CPCA, 3);
    save(back, again);
    struct dph_scene *third = load(again);
    assert_same(back->body->rivals, third->body->rivals);
    assert_int_equal(third->body->rivals->products,
                     DPH_PRODUCT_CLUSTERS | DPH_PRODUCT_NORMALS | DPH_PRODUCT_RESPONSE);
    bake(third, DPH_RESPONSE_LINEAR, 4, DPH_STORE_SNORM16, 0);
    save(third, path);
    long size = size_of(path);
    dph_scene_destroy(third);
    third = load(path);
    bake(third, DPH_RESPONSE_LINEAR, 4, DPH_STORE_SNORM16, 0);
    save(third, path);
    assert_int_equal(size_of(path), size);
    dph_scene_destroy(third);
    dph_scene_destroy(back);
    dph_scene_destroy(scene);
}

static void test_fit(void **unused)
{
    (void)unused;
    char why[240];
    bool found;
    struct dph_scene *scene = make_scene();
    const struct dph_material *own = dph_material_preset(1), *other = dph_material_preset(2);
    assert_false(
        dph_scene_rivals_fit(scene, DPH_PRODUCT_RESPONSE, own, 20, why, sizeof why, &found));
    assert_false(found);
    bake(scene, DPH_RESPONSE_ROOT, 2, DPH_STORE_SNORM8, 0);
    assert_true(
        dph_scene_rivals_fit(scene, DPH_PRODUCT_RESPONSE, own, 20, why, sizeof why, &found));
    assert_false(
        dph_scene_rivals_fit(scene, DPH_PRODUCT_RESPONSE, other, 20, why, sizeof why, &found));
    assert_true(found && strstr(why, "another material"));
    assert_false(
        dph_scene_rivals_fit(scene, DPH_PRODUCT_RESPONSE, own, 25, why, sizeof why, &found));
    assert_non_null(strstr(why, "another size"));
    dph_scene_destroy(scene);
}

static void test_broken(void **unused)
{
    (void)unused;
    struct dph_scene *scene = make_scene();
    bake(scene, DPH_RESPONSE_ROOT, 3, DPH_STORE_SNORM8, 0);
    save(scene, path);
    expect_broken("\"form\":\"root\"", "\"form\":\"rout\"", "form \"rout\" is not known");
    expect_broken("\"form\":\"root\"", "\"firm\":\"root\"", "form \"\" is not known");
    expect_broken("\"bands\":3", "\"bands\":7", "extras.diaphan.response: bands is 7");
    expect_broken("\"bands\":3", "\"bands\":4", "scale");
    expect_broken("\"version\":1,\"form", "\"version\":3,\"form", "version is 3");
    expect_broken("\"scale\":", "\"scole\":", "scale is missing");
    expect_broken("\"ramp\":", "\"romp\":", "ramp is missing");
    expect_broken("\"view\":[1.0,", "\"view\":[    ", "view");
    expect_broken("\"view\":[1.0,", "\"view\":[9e7,", "view[0] is 9e+07");
    expect_broken("\"view\":[1.0,", "\"view\":[\"a\",", "view");
    expect_broken("\"top\":0", "\"tap\":0", "top is 0");
    expect_broken("\"color\":", "\"colur\":", "color is missing");
    expect_broken("\"noise\":0.05", "\"noise\":-9.0", "noise is not");
    expect_broken("\"walks\":1234.5", "\"walks\":\"many\"", "walks is not");
    expect_broken("_RESPONSE_SH_2", "_RESPONSE_XX_2", "_RESPONSE_SH_2 is missing");
    expect_broken("\"mm_per_unit\":", "\"mm_per_inch\":", "mm_per_unit is 0");
    expect_broken("\"absorption\"", "\"absorptian\"", "absorption is missing");
    expect_broken("\"normalized\":true", "\"normalizid\":true", "not FLOAT or normalized");
    bake(scene, DPH_RESPONSE_RGB, 2, DPH_STORE_FLOAT, 0);
    save(scene, path);
    expect_broken("\"form\":\"rgb\"", "\"form\":\"rgg\"", "is not known");
    expect_broken("_RESPONSE_SH_2", "_RESPONSE_XX_2", "_RESPONSE_SH_2 is missing");
    expect_not_finite(scene, (float *)scene->body->rivals->response->channel[1]->data + 3,
                      "_RESPONSE_SH_");
    for (int form = 0; form < 3; form += 2) {
        bake(scene, (enum dph_response_form)form, 3, DPH_STORE_CPCA, 20);
        save(scene, path);
        expect_broken("\"clusters\":20", "\"clusters\":99", "need");
        expect_broken("\"clusters\":20", "\"clusters\":12", "there are 12 clusters");
        expect_broken("\"vectors\":5", "\"vectors\":0", "vectors is 0");
        expect_broken("\"vectors\":5", "\"vectors\":9", "need");
        expect_broken("_RESPONSE_CPCA_1", "_RESPONSE_OTHER1", "_RESPONSE_CPCA_1 is missing");
        expect_broken("_RESPONSE_CLUSTER", "_RESPONSE_CLASTER", "_RESPONSE_CLUSTER is missing");
        expect_broken("\"bands\":3", "\"bands\":6", "need");
    }
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_bake_over),
        cmocka_unit_test(test_fit),
        cmocka_unit_test(test_broken),
    };
    return run_saved_tests("response", tests);
}
