/* What the methods beside SHSSS store in glTF: written, read back, baked over, and broken on
 * purpose. */
#include "saved_scene.h"

#include <diaphan/rivals.h>

#include <stdlib.h>

enum { ALL = DPH_PRODUCT_NORMALS | DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS };

static struct dph_scene *make_scene(void)
{
    return wavy_sheet(14, .2F);
}

static void bake(struct dph_scene *scene, unsigned products, int bands, int clusters, int vectors)
{
    struct dph_error err = {0};
    struct dph_rivals_params params = dph_rivals_defaults();
    params.material = dph_material_preset(0);
    params.bands = bands;
    params.directions = 16;
    params.clusters = clusters;
    params.vectors = vectors;
    if (!dph_scene_bake_rivals(scene, products, &params, NULL, &err))
        fail_msg("%s", err.message);
}

static void assert_same_origin(const struct dph_rivals_origin *a, const struct dph_rivals_origin *b)
{
    assert_string_equal(a->material, b->material);
    assert_memory_equal(a->scattering, b->scattering, sizeof a->scattering);
    assert_memory_equal(a->absorption, b->absorption, sizeof a->absorption);
    assert_true(a->anisotropy == b->anisotropy && a->mm_per_unit == b->mm_per_unit);
    assert_int_equal(a->directions, b->directions);
}

/* Vertex by vertex: rows may have another order. */
static void assert_same(const struct dph_body *a, const struct dph_body *b)
{
    const struct dph_rivals *x = a->rivals, *y = b->rivals;
    assert_non_null(y);
    assert_int_equal(x->products, y->products);
    if (x->products & DPH_PRODUCT_NORMALS) {
        assert_memory_equal(x->normal, y->normal, a->mesh.nvert * 3 * sizeof(float));
        assert_same_origin(&x->normal_origin, &y->normal_origin);
    }
    if (x->products & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS)) {
        assert_int_equal(x->transfer.bands, y->transfer.bands);
        assert_int_equal(x->transfer.length, y->transfer.length);
        assert_same_origin(&x->transfer_origin, &y->transfer_origin);
    }
    for (size_t v = 0; x->products & DPH_PRODUCT_TRANSFER && v < a->mesh.nvert; v++)
        assert_memory_equal(x->transfer.vector + x->transfer.position_of[v] * x->transfer.length,
                            y->transfer.vector + y->transfer.position_of[v] * x->transfer.length,
                            x->transfer.length * sizeof(float));
    if (!(x->products & DPH_PRODUCT_CLUSTERS))
        return;
    const struct dph_cpca *c = x->clusters, *d = y->clusters;
    assert_non_null(d);
    assert_int_equal(c->clusters, d->clusters);
    assert_int_equal(c->vectors, d->vectors);
    assert_int_equal(c->n, d->n);
    assert_memory_equal(c->table, d->table,
                        (size_t)c->clusters * (size_t)(1 + c->vectors) * (size_t)c->n * 4);
    for (size_t v = 0; v < a->mesh.nvert; v++) {
        size_t p = x->transfer.position_of[v], q = y->transfer.position_of[v];
        assert_int_equal(c->cluster[p], d->cluster[q]);
        for (size_t j = 0; j < (size_t)c->vectors; j++)
            assert_int_equal(dph_cpca_snorm8(c->weight[p * (size_t)c->vectors + j]),
                             dph_cpca_snorm8(d->weight[q * (size_t)c->vectors + j]));
    }
}

static void test_round_trip(void **unused)
{
    (void)unused;
    for (int bands = 1; bands <= 6; bands++)
        for (unsigned products = 2; products <= ALL; products += 2) {
            struct dph_scene *scene = make_scene(); /* bands 5: rows of 75 numbers; 300: shorts */
            bake(scene, products, bands, bands == 4 ? 300 : 3, bands == 1 ? 1 : 5);
            save(scene, path);
            struct dph_scene *back = load(path);
            assert_same(scene->body, back->body);
            assert_true(back->mm_per_unit == scene->mm_per_unit);
            save(back, again); /* and through a document */
            struct dph_scene *third = load(again);
            assert_same(scene->body, third->body);
            dph_scene_destroy(third);
            dph_scene_destroy(back);
            dph_scene_destroy(scene);
        }
}

/* The new data take the old ones' place, and the file does not grow from bake to bake. */
static void test_bake_over(void **unused)
{
    (void)unused;
    static const struct {
        unsigned products, left;
        int bands;
    } steps[] = {
        {ALL, ALL, 6},
        {ALL, ALL, 3},
        {DPH_PRODUCT_NORMALS, ALL, 3},
        {DPH_PRODUCT_TRANSFER, DPH_PRODUCT_NORMALS | DPH_PRODUCT_TRANSFER, 6},
        {DPH_PRODUCT_CLUSTERS, ALL, 6},
    };
    struct dph_scene *scene = make_scene();
    long first = 0;
    save(scene, path);
    dph_scene_destroy(scene);
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        scene = load(path);
        bake(scene, steps[i].products, steps[i].bands, 3, 5);
        assert_int_equal(scene->body->rivals->products, steps[i].left);
        save(scene, path);
        struct dph_scene *back = load(path);
        assert_same(scene->body, back->body);
        if (!i)
            first = size_of(path);
        assert_true(size_of(path) <= first + 1024);
        dph_scene_destroy(back);
        dph_scene_destroy(scene);
    }
    assert_true(size_of(path) >= first - 1024); /* all is in it again */
}

static void test_fit(void **unused)
{
    (void)unused;
    char why[200];
    bool found;
    struct dph_scene *scene = make_scene();
    const struct dph_material *own = dph_material_preset(0), *other = dph_material_preset(1);
    assert_false(dph_scene_rivals_fit(scene, DPH_PRODUCT_TRANSFER, own, 1, why, sizeof why, &found));
    assert_false(found);
    bake(scene, DPH_PRODUCT_CLUSTERS | DPH_PRODUCT_NORMALS, 2, 3, 2);
    save(scene, path);
    struct dph_scene *back = load(path);
    double mm = back->mm_per_unit;
    unsigned both = DPH_PRODUCT_CLUSTERS | DPH_PRODUCT_NORMALS;
    assert_true(dph_scene_rivals_fit(back, both, own, mm, why, sizeof why, &found));
    assert_true(found);
    assert_false(dph_scene_rivals_fit(back, both, other, mm, why, sizeof why, &found));
    assert_non_null(strstr(why, "material"));
    assert_false(dph_scene_rivals_fit(back, both, own, 2 * mm, why, sizeof why, &found));
    assert_non_null(strstr(why, "size"));
    assert_false(dph_scene_rivals_fit(back, DPH_PRODUCT_TRANSFER, own, mm, NULL, 0, &found));
    assert_false(found); /* the compressed form only */
    dph_scene_destroy(back);
    dph_scene_destroy(scene);
}

static void test_broken(void **unused)
{
    (void)unused;
    struct dph_scene *scene = make_scene();
    bake(scene, DPH_PRODUCT_CLUSTERS, 3, 20, 5);
    save(scene, path);
    expect_broken("\"clusters\":20", "\"clusters\":99", "need");
    expect_broken("\"clusters\":20", "\"clusters\":-1", "clusters");
    expect_broken("\"clusters\":20", "\"clusters\":12", "there are 12 clusters");
    expect_broken("\"vectors\":5", "\"vectors\":0", "vectors is 0");
    expect_broken("\"vectors\":5", "\"vectors\":9", "need");
    expect_broken("\"bands\":3", "\"bands\":7", "extras.diaphan.prt_cpca: bands is 7");
    expect_broken("\"bands\":3", "\"bands\":6", "need");
    expect_broken("\"version\":1,\"bands", "\"version\":2,\"bands", "version is 2");
    expect_broken("_PRT_CPCA_1", "_PRT_OTHER1", "_PRT_CPCA_1 is missing");
    expect_broken("_PRT_CLUSTER", "_PRT_CLASTER", "_PRT_CLUSTER is missing");
    expect_broken("\"absorption\"", "\"absorptian\"", "absorption is missing");
    expect_broken("\"anisotropy\":0.0", "\"anisotropy\":9.0", "anisotropy");
    expect_broken("\"mm_per_unit\":", "\"mm_per_inch\":", "mm_per_unit is 0");
    expect_broken("\"material\":{\"name\"", "\"mutarial\":{\"name\"", "material is missing");
    expect_not_finite(scene, &scene->body->rivals->clusters->table[77], "number 77 of bufferView");
    dph_scene_destroy(scene);

    scene = make_scene();
    bake(scene, DPH_PRODUCT_TRANSFER | DPH_PRODUCT_NORMALS, 3, 20, 5);
    save(scene, path);
    expect_broken("\"bands\":3", "\"bands\":4", "_PRT_SH_7 is missing");
    expect_broken("_PRT_SH_6", "_PRT_SX_6", "attributes: _PRT_SH_6 is missing");
    expect_broken("_PATRO_NORMAL", "_PATRO_NARMOL", "_PATRO_NORMAL is missing");
    expect_not_finite(scene, &scene->body->rivals->transfer.vector[5], "_PRT_SH_");
    expect_not_finite(scene, &scene->body->rivals->normal[7], "_PATRO_NORMAL");
    bake(scene, ALL, 3, 20, 5);
    save(scene, path);
    expect_broken("\"directions\":16", "\"directions\":18", "was baked otherwise");
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
    return run_saved_tests("rivals", tests);
}
