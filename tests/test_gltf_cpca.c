/* Thickness as clustered principal components in glTF: written, read back, baked over, and broken
 * on purpose. */
#include "fabricate.h"
#include "saved_scene.h"

static struct dph_scene *make_scene(void)
{
    return wavy_sheet(60, 1);
}

static void assert_same(const struct dph_thickness *a, const struct dph_thickness *b)
{
    assert_non_null(b);
    assert_int_equal(a->store, b->store);
    assert_int_equal(a->nvert, b->nvert);
    assert_int_equal(a->bands, b->bands);
    assert_int_equal(a->components, b->components);
    assert_int_equal(a->clusters, b->clusters);
    assert_int_equal(a->vectors, b->vectors);
    assert_int_equal(a->directions, b->directions);
    assert_int_equal(a->fit, b->fit);
    assert_int_equal(a->definition, b->definition);
    assert_memory_equal(a->data, b->data, a->nvert * (size_t)a->components);
    assert_memory_equal(a->cluster, b->cluster, a->nvert * sizeof *a->cluster);
    assert_memory_equal(a->table, b->table, dph_thickness_shared(a));
}

static void test_round_trip(void **unused)
{
    (void)unused;
    for (int bands = 1; bands <= 8; bands++) { /* 5: more than 256 clusters */
        struct dph_scene *scene = make_scene();
        assert_true(fabricate_thickness(scene, bands, DPH_STORE_CPCA));
        if (bands == 5)
            assert_true(scene->body->thickness->clusters > 256);
        save(scene, path);
        struct dph_scene *back = load(path);
        assert_same(scene->body->thickness, back->body->thickness);
        assert_true(fabs(back->mm_per_unit - scene->mm_per_unit) < 1e-9);
        save(back, again); /* and through a document */
        struct dph_scene *third = load(again);
        assert_same(scene->body->thickness, third->body->thickness);
        dph_scene_destroy(third);
        dph_scene_destroy(back);
        dph_scene_destroy(scene);
    }
}

/* One store over the other takes its place: nothing of the old one is read, and the file does not
 * grow from bake to bake. */
static void test_bake_over(void **unused)
{
    (void)unused;
    static const enum dph_store stores[] = {DPH_STORE_CPCA, DPH_STORE_SNORM8, DPH_STORE_CPCA,
                                            DPH_STORE_CPCA, DPH_STORE_FLOAT, DPH_STORE_CPCA};
    struct dph_scene *scene = make_scene();
    long first = 0;
    save(scene, path);
    dph_scene_destroy(scene);
    for (size_t i = 0; i < sizeof stores / sizeof *stores; i++) {
        scene = load(path);
        assert_true(fabricate_thickness(scene, 6, stores[i]));
        save(scene, path);
        struct dph_scene *back = load(path);
        assert_int_equal(back->body->thickness->store, stores[i]);
        if (stores[i] == DPH_STORE_CPCA)
            assert_same(scene->body->thickness, back->body->thickness);
        if (!i)
            first = size_of(path);
        else if (stores[i] == DPH_STORE_CPCA)
            assert_true(size_of(path) <= first + 2048);
        dph_scene_destroy(back);
        dph_scene_destroy(scene);
    }
}

static void test_broken(void **unused)
{
    (void)unused;
    struct dph_scene *scene = make_scene();
    assert_true(fabricate_thickness(scene, 6, DPH_STORE_CPCA));
    assert_int_equal(scene->body->thickness->clusters, 20);
    save(scene, path);
    expect_broken("\"clusters\":20", "\"clusters\":99", "need");
    expect_broken("\"clusters\":20", "\"clusters\":01", "");
    expect_broken("\"clusters\":20", "\"clusters\":-1", "clusters");
    expect_broken("\"clusters\":20", "\"clusters\":12", "there are 12 clusters");
    expect_broken("\"vectors\":5", "\"vectors\":0", "vectors is 0");
    expect_broken("\"vectors\":5", "\"vectors\":9", "need");
    expect_broken("\"vectors\":5", "\"victors\":5", "vectors");
    expect_broken("\"bands\":6", "\"bands\":7", "need");
    expect_broken("_THICKNESS_CPCA_1", "_THICKNESS_OTHER1", "_THICKNESS_CPCA_1 is missing");
    expect_broken("_THICKNESS_CLUSTER", "_THICKNESS_CLASTER", "_THICKNESS_CLUSTER is missing");
    /* a number of the table that is none */
    expect_not_finite(scene, &scene->body->thickness->table[77], "number 77 of bufferView");
    dph_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_bake_over),
        cmocka_unit_test(test_broken),
    };
    return run_saved_tests("cpca", tests);
}
