/* diaphan info: what a mesh or a baked file holds. Counts are those of the scene as it is drawn: a
 * body counts once for each of its instances. */
#include "cli.h"

#include <string.h>

static const char *const takes[] = {"compression", "for", "bands", "directions", "thickness", "clusters",
                                    "vectors", "size-mm", "material", NULL};

/* Sums over the instances. */
struct totals {
    size_t triangles, vertices, positions, degenerate, boundary, nonmanifold, flipped, components;
    bool closed;
};

static bool measure(const struct dph_scene *scene, struct totals *totals, struct dph_error *err)
{
    *totals = (struct totals){.closed = true};
    for (size_t b = 0; b < scene->nbody; b++) {
        struct dph_mesh_stats stats;
        size_t times = 0;
        for (size_t i = 0; i < scene->ninstance; i++)
            times += scene->instance[i].body == b;
        if (!times)
            continue;
        if (!dph_mesh_measure(&scene->body[b].mesh, &stats, err))
            return false;
        totals->triangles += times * scene->body[b].mesh.ntri;
        totals->vertices += times * scene->body[b].mesh.nvert;
        totals->positions += times * stats.positions;
        totals->degenerate += times * stats.degenerate;
        totals->boundary += times * stats.boundary_edges;
        totals->nonmanifold += times * stats.nonmanifold_edges;
        totals->flipped += times * stats.flipped_edges;
        totals->components += times * stats.components;
        totals->closed = totals->closed && stats.closed;
    }
    totals->closed = totals->closed && totals->triangles > 0;
    return true;
}

/* The first baked body, and how many there are. NULL: none. */
static const struct dph_thickness *baked(const struct dph_scene *scene, size_t *count)
{
    const struct dph_thickness *first = NULL;
    *count = 0;
    for (size_t b = 0; b < scene->nbody; b++)
        if (scene->body[b].thickness) {
            first = first ? first : scene->body[b].thickness;
            ++*count;
        }
    return first;
}

static void print_baked(struct json *json, const struct dph_scene *scene)
{
    size_t count;
    const struct dph_thickness *thickness = baked(scene, &count);
    if (!thickness) {
        emit_text(json, "baked", NULL);
        return;
    }
    struct storage storage = measure_storage(scene);
    emit_object(json, "baked");
    emit_count(json, "bodies", count);
    emit_count(json, "bands", (size_t)thickness->bands);
    emit_text(json, "store", dph_store_name(thickness->store));
    emit_text(json, "definition", dph_definition_name(thickness->definition));
    emit_text(json, "fit", dph_fit_name(thickness->fit));
    emit_count(json, "directions", (size_t)thickness->directions);
    emit_number(json, "mm_per_unit", scene->mm_per_unit);
    emit_count(json, "bytes_per_vertex", storage.payload);
    emit_count(json, "bytes_per_vertex_gpu", storage.fetched);
    emit_count(json, "table_bytes", storage.shared);
    if (thickness->store == DPH_STORE_CPCA) {
        emit_count(json, "clusters", (size_t)thickness->clusters);
        emit_count(json, "vectors", (size_t)thickness->vectors);
    }
    emit_array(json, "scale");
    for (int l = 0; l < thickness->bands; l++)
        emit_number(json, NULL, (double)thickness->scale[l]);
    emit_close(json, ']');
    emit_close(json, '}');
}

/* The table or tables of --compression, for the methods of --for. */
static void show_tables(const struct settings *settings, struct dph_scene *scene, struct json *json,
                        int *code)
{
    if (settings->products & DPH_PRODUCT_THICKNESS &&
        !show_compression(settings, scene, json, code))
        return;
    if (settings->products & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS))
        show_transfer_compression(settings, scene, json, code);
}

/* What the other methods have in the file: an object a method. */
static void print_rivals(struct json *json, const struct dph_scene *scene)
{
    for (unsigned bit = DPH_PRODUCT_NORMALS; bit <= DPH_PRODUCT_RESPONSE; bit *= 2) {
        enum dph_product product = (enum dph_product)bit;
        const struct dph_rivals *rivals = NULL;
        for (size_t b = 0; b < scene->nbody && !rivals; b++)
            if (scene->body[b].rivals && scene->body[b].rivals->products & bit)
                rivals = scene->body[b].rivals;
        if (!rivals)
            continue;
        const struct dph_rivals_origin *origin =
            product == DPH_PRODUCT_NORMALS    ? &rivals->normal_origin
            : product == DPH_PRODUCT_RESPONSE ? &rivals->response_origin
                                              : &rivals->transfer_origin;
        struct storage storage = measure_product(scene, product);
        if (!json) {
            char number[32];
            printf("  %-9s %s, %g mm a unit, %zu bytes a vertex", product_name(product),
                   origin->material, origin->mm_per_unit, storage.payload);
            if (product == DPH_PRODUCT_CLUSTERS)
                printf(" and %s of tables", with_commas(storage.shared, number));
            putchar('\n');
            continue;
        }
        emit_object(json, product_name(product));
        emit_text(json, "material", origin->material);
        emit_number(json, "mm_per_unit", origin->mm_per_unit);
        if (product == DPH_PRODUCT_RESPONSE) {
            emit_text(json, "form", dph_response_form_name(rivals->response->form));
            emit_count(json, "bands", (size_t)rivals->response->bands);
            emit_number(json, "noise", rivals->response->noise);
            emit_number(json, "walks", rivals->response->walks);
        } else if (product != DPH_PRODUCT_NORMALS) {
            emit_count(json, "bands", (size_t)rivals->transfer.bands);
            emit_count(json, "directions", (size_t)origin->directions);
        }
        if (product == DPH_PRODUCT_CLUSTERS) {
            emit_count(json, "clusters", (size_t)rivals->clusters->clusters);
            emit_count(json, "vectors", (size_t)rivals->clusters->vectors);
        }
        emit_count(json, "bytes_per_vertex", storage.payload);
        emit_count(json, "bytes_per_vertex_gpu", storage.fetched);
        emit_count(json, "table_bytes", storage.shared);
        emit_close(json, '}');
    }
}

static int print_json(const struct settings *settings, struct dph_scene *scene,
                      const struct totals *totals)
{
    int code = EXIT_DONE;
    struct json json;
    emit_begin(&json, stdout);
    emit_text(&json, "file", settings->input[0]);
    emit_count(&json, "bodies", scene->nbody);
    emit_count(&json, "instances", scene->ninstance);
    emit_count(&json, "triangles", totals->triangles);
    emit_count(&json, "vertices", totals->vertices);
    emit_count(&json, "positions", totals->positions);
    emit_count(&json, "degenerate_triangles", totals->degenerate);
    emit_count(&json, "boundary_edges", totals->boundary);
    emit_count(&json, "nonmanifold_edges", totals->nonmanifold);
    emit_count(&json, "flipped_edges", totals->flipped);
    emit_count(&json, "components", totals->components);
    emit_bool(&json, "closed", totals->closed);
    emit_array(&json, "bounds");
    for (int side = 0; side < 2; side++) {
        emit_array(&json, NULL);
        for (int k = 0; k < 3; k++)
            emit_number(&json, NULL, scene->bounds[side][k]);
        emit_close(&json, ']');
    }
    emit_close(&json, ']');
    print_baked(&json, scene);
    print_rivals(&json, scene);
    if (settings->compression)
        show_tables(settings, scene, &json, &code);
    emit_end(&json);
    return code;
}

static void print_text(const struct settings *settings, const struct dph_scene *scene,
                       const struct totals *totals)
{
    char a[32], b[32], c[32];
    printf("%s\n", settings->input[0]);
    printf("  mesh      %s triangles, %s vertices at %s positions\n",
           with_commas(totals->triangles, a), with_commas(totals->vertices, b),
           with_commas(totals->positions, c));
    if (scene->nbody != 1 || scene->ninstance != 1)
        printf("  scene     %zu bodies, %zu instances\n", scene->nbody, scene->ninstance);
    printf("  surface   ");
    if (totals->closed)
        printf("closed");
    else if (!totals->triangles)
        printf("no triangles");
    else
        printf("not closed: %s boundary, %s non-manifold, %s flipped edges",
               with_commas(totals->boundary, a), with_commas(totals->nonmanifold, b),
               with_commas(totals->flipped, c));
    printf(", %zu component%s", totals->components, totals->components == 1 ? "" : "s");
    if (totals->degenerate)
        printf(", %s triangles without area", with_commas(totals->degenerate, a));
    printf("\n  bounds    %g %g %g to %g %g %g\n", scene->bounds[0][0], scene->bounds[0][1],
           scene->bounds[0][2], scene->bounds[1][0], scene->bounds[1][1], scene->bounds[1][2]);
    if (scene->mm_per_unit > 0.0)
        printf("  size      %.4g mm for the largest side, %.6g mm a unit\n",
               dph_scene_size(scene) * scene->mm_per_unit, scene->mm_per_unit);

    size_t count;
    const struct dph_thickness *thickness = baked(scene, &count);
    if (!thickness) {
        printf("  baked     no\n");
        return;
    }
    struct storage storage = measure_storage(scene);
    printf("  baked     %d bands, thickness %s, fit %s", thickness->bands,
           dph_definition_name(thickness->definition), dph_fit_name(thickness->fit));
    if (thickness->directions)
        printf(", %d directions", thickness->directions);
    printf("\n  stored    %s, %zu bytes a vertex", dph_store_name(thickness->store), storage.payload);
    if (thickness->store == DPH_STORE_CPCA)
        printf(" and %s of tables, %d clusters of %d vectors", with_commas(storage.shared, a),
               thickness->clusters, thickness->vectors);
    if (count != scene->nbody)
        printf(", %zu of the %zu bodies", count, scene->nbody);
    if (settings->verbose) {
        printf("\n  scales   ");
        for (int l = 0; l < thickness->bands; l++)
            printf(" %g", (double)thickness->scale[l]);
    }
    putchar('\n');
}

static int run(struct settings *settings)
{
    int code = EXIT_DONE;
    struct dph_error err;
    struct totals totals;
    struct dph_scene *scene = load_scene(settings, settings->input[0], &code);
    if (!scene)
        return code;
    if (!measure(scene, &totals, &err))
        code = report_error(settings, &err);
    else if (settings->json)
        code = print_json(settings, scene, &totals);
    else {
        print_text(settings, scene, &totals);
        print_rivals(NULL, scene);
    }
    if (code == EXIT_DONE && settings->compression && !settings->json)
        show_tables(settings, scene, NULL, &code);
    dph_scene_destroy(scene);
    return code;
}

const struct command command_info = {
    .name = "info",
    .summary = "what a mesh or a baked file holds",
    .usage = "FILE",
    .examples = "  diaphan info bunny.obj\n"
                "  diaphan info bunny.glb --json\n"
                "  diaphan info bunny.obj --compression\n"
                "  diaphan info bunny.obj --compression --for prt --material wax --size-mm 25\n",
    .notes = "A surface is closed where every edge has two triangles that run along it in opposite "
             "directions. Counts are\n"
             "those of the scene as it is drawn, every instance of a body counted. --compression takes "
             "as long as two bakes; with --for prt it is about transfer vectors instead.\n",
    .options = takes,
    .min_inputs = 1,
    .max_inputs = 1,
    .run = run,
};
