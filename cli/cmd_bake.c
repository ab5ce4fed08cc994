/* diaphan bake: load, bake, save, and say what it took. */
#include "cli.h"

static const char *const takes[] = {"output", "bands",   "directions", "thickness", "fit",
                                    "store",  "clusters", "vectors", "size-mm",   "material", "for",
                                    "response-form", "bytes", "noise", NULL};

struct timing {
    double load, save, total;
};

/* Figures of what was written for the other methods. */
static void emit_products(struct json *json, const struct settings *settings,
                          const struct dph_scene *scene, const struct dph_rivals_report *rivals,
                          const struct dph_scene_response_report *response)
{
    for (unsigned bit = DPH_PRODUCT_NORMALS; bit <= DPH_PRODUCT_RESPONSE; bit *= 2) {
        if (!(settings->products & bit))
            continue;
        struct storage storage = measure_product(scene, (enum dph_product)bit);
        emit_object(json, product_name((enum dph_product)bit));
        emit_count(json, "bytes_per_vertex", storage.payload);
        emit_count(json, "bytes_per_vertex_gpu", storage.fetched);
        emit_count(json, "table_bytes", storage.shared);
        if (bit == DPH_PRODUCT_CLUSTERS) {
            emit_count(json, "clusters", (size_t)settings->cpca.clusters);
            emit_count(json, "vectors", (size_t)settings->cpca.vectors);
            emit_number(json, "relative_error", rivals->error);
        }
        if (bit == DPH_PRODUCT_RESPONSE) {
            struct dph_response_params form = response_form(settings);
            emit_text(json, "form", dph_response_form_name(form.form));
            emit_count(json, "bands", (size_t)form.bands);
            emit_text(json, "store", dph_store_name(form.store));
            emit_number(json, "noise", response->noise);
            emit_bool(json, "noise_reached", response->reached);
            emit_number(json, "walks", response->walks);
            emit_number(json, "walks_lost", response->lost);
            emit_number(json, "relative_error", response->error);
            emit_number(json, "relative_error_rgb", response->error_rgb);
        }
        emit_close(json, '}');
    }
}

static void print_json(const struct settings *settings, const struct dph_scene *scene,
                       const struct dph_scene_bake_report *report,
                       const struct dph_rivals_report *rivals,
                       const struct dph_scene_response_report *response,
                       const struct timing *timing, const struct storage *storage)
{
    bool thickness = settings->products & DPH_PRODUCT_THICKNESS;
    struct json json;
    emit_begin(&json, stdout);
    emit_text(&json, "input", settings->input[0]);
    emit_text(&json, "output", settings->output);
    emit_count(&json, "bodies", report->bodies);
    emit_count(&json, "triangles", report->triangles);
    emit_count(&json, "vertices", report->vertices);
    emit_count(&json, "positions", report->positions);
    if (thickness) {
        emit_count(&json, "bands", (size_t)settings->bake.bands);
        emit_count(&json, "directions", (size_t)report->directions);
        emit_text(&json, "thickness", dph_definition_name(settings->bake.definition));
        emit_text(&json, "fit", dph_fit_name(settings->bake.fit));
        emit_text(&json, "store", dph_store_name(settings->store));
        emit_count(&json, "bytes_per_vertex", storage->payload);
        emit_count(&json, "bytes_per_vertex_gpu", storage->fetched);
        emit_count(&json, "table_bytes", storage->shared);
        if (settings->store == DPH_STORE_CPCA) {
            emit_count(&json, "clusters", (size_t)settings->cpca.clusters);
            emit_count(&json, "vectors", (size_t)settings->cpca.vectors);
            emit_number(&json, "relative_error", report->error);
        }
        emit_number(&json, "untrusted", report->untrusted);
    }
    emit_products(&json, settings, scene, rivals, response);
    if (thickness)
        emit_count(&json, "threads", (size_t)report->threads);
    emit_object(&json, "seconds");
    emit_number(&json, "load", timing->load);
    if (thickness) {
        emit_number(&json, "sweep", report->seconds_sweep);
        emit_number(&json, "project", report->seconds_project);
        emit_number(&json, "store", report->seconds_store);
    }
    if (settings->products & DPH_PRODUCT_NORMALS)
        emit_number(&json, "normals", rivals->seconds_normals);
    if (settings->products & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS))
        emit_number(&json, "transfer", rivals->seconds_transfer);
    if (settings->products & DPH_PRODUCT_CLUSTERS)
        emit_number(&json, "clusters", rivals->seconds_clusters);
    if (settings->products & DPH_PRODUCT_RESPONSE) {
        emit_number(&json, "walks", response->seconds_bake);
        emit_number(&json, "form", response->seconds_form);
        emit_number(&json, "view", response->seconds_view);
    }
    emit_number(&json, "save", timing->save);
    emit_number(&json, "total", timing->total);
    emit_close(&json, '}');
    emit_end(&json);
}

static void print_products(const struct settings *settings, const struct dph_scene *scene,
                           const struct dph_rivals_report *rivals,
                           const struct dph_scene_response_report *response)
{
    if (settings->products & DPH_PRODUCT_NORMALS)
        printf("baked changed normals in %.2f s, %zu bytes a vertex\n", rivals->seconds_normals,
               measure_product(scene, DPH_PRODUCT_NORMALS).payload);
    if (settings->products & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS))
        printf("baked transfer vectors in %.2f s", rivals->seconds_transfer);
    if (settings->products & DPH_PRODUCT_TRANSFER)
        printf(", %zu bytes a vertex", measure_product(scene, DPH_PRODUCT_TRANSFER).payload);
    if (settings->products & (DPH_PRODUCT_TRANSFER | DPH_PRODUCT_CLUSTERS))
        putchar('\n');
    if (settings->products & DPH_PRODUCT_CLUSTERS) {
        char number[32];
        struct storage storage = measure_product(scene, DPH_PRODUCT_CLUSTERS);
        printf("compressed them in %.2f s, %zu bytes a vertex and %s of tables, %.2f %% lost\n",
               rivals->seconds_clusters, storage.payload, with_commas(storage.shared, number),
               100.0 * rivals->error);
    }
    if (settings->products & DPH_PRODUCT_RESPONSE) {
        struct dph_response_params form = response_form(settings);
        printf("baked the response in %.1f s, %.0f walks a position, noise %.1f %%\n"
               "stored as %s, %d bands, %s in %.2f s: %zu bytes a vertex, %.1f %% lost\n",
               response->seconds_bake,
               response->positions ? response->walks / (double)response->positions : 0,
               100.0 * response->noise, dph_response_form_name(form.form), form.bands,
               dph_store_name(form.store), response->seconds_form,
               measure_product(scene, DPH_PRODUCT_RESPONSE).payload, 100.0 * response->error_rgb);
    }
}

static void print_text(const struct settings *settings, const struct dph_scene *scene,
                       const struct dph_scene_bake_report *report,
                       const struct dph_rivals_report *rivals,
                       const struct dph_scene_response_report *response,
                       const struct timing *timing, const struct storage *storage)
{
    char triangles[32], vertices[32], positions[32];
    int bands = settings->bake.bands;
    printf("%s: %s triangles, %s vertices at %s positions", settings->input[0],
           with_commas(report->triangles, triangles), with_commas(report->vertices, vertices),
           with_commas(report->positions, positions));
    if (report->bodies != 1)
        printf(", %zu bodies", report->bodies);
    putchar('\n');
    print_products(settings, scene, rivals, response);
    if (!(settings->products & DPH_PRODUCT_THICKNESS)) {
        printf("wrote %s in %.2f s\n", settings->output, timing->total);
        return;
    }
    printf("baked %d bands from %d directions (%s, %s) in %.2f s: load %.2f, sweep %.2f, "
           "projection %.2f, store %.2f, "
           "save %.2f; %d threads\n",
           bands, report->directions, dph_definition_name(settings->bake.definition),
           dph_fit_name(settings->bake.fit), timing->total, timing->load, report->seconds_sweep,
           report->seconds_project, report->seconds_store, timing->save, report->threads);
    if (report->untrusted > 0.0)
        printf("%.2g %% of the samples cannot be trusted\n", 100.0 * report->untrusted);
    printf("wrote %s: %s, %zu bytes a vertex", settings->output, dph_store_name(settings->store),
           storage->payload);
    if (settings->store == DPH_STORE_CPCA)
        printf(" and %s of tables, %.2f %% of the coefficients lost",
               with_commas(storage->shared, triangles), 100.0 * report->error);
    putchar('\n');
}

/* Counts of what is baked, where there is no bake of thickness to count. */
static bool count_scene(const struct settings *settings, const struct dph_scene *scene,
                        struct dph_scene_bake_report *report, int *code)
{
    for (size_t b = 0; b < scene->nbody; b++) {
        const struct dph_mesh *mesh = &scene->body[b].mesh;
        struct dph_mesh_stats stats;
        struct dph_error err;
        if (!mesh->nvert)
            continue;
        if (!dph_mesh_measure(mesh, &stats, &err)) {
            *code = report_error(settings, &err);
            return false;
        }
        report->bodies++;
        report->triangles += mesh->ntri;
        report->vertices += mesh->nvert;
        report->positions += stats.positions;
    }
    return true;
}

static int run(struct settings *settings)
{
    int code = EXIT_DONE;
    struct dph_error err;
    struct dph_scene_bake_report report = {0};
    struct timing timing;
    if (!has_ending(settings->output, ".glb")) {
        complain(settings, "%s: a baked file is a .glb", settings->output);
        return EXIT_USAGE;
    }
    struct dph_rivals_report rivals;
    struct dph_scene_response_report response;
    struct dph_material material; /* a misspelt one is told of before anything is loaded */
    if (!load_material(settings, "wax", &material, &code))
        return code;
    if (!output_possible(settings, settings->output))
        return EXIT_OUTPUT;

    double start = seconds_now();
    struct dph_scene *scene = load_scene(settings, settings->input[0], &code);
    if (!scene)
        return code;
    timing.load = seconds_now() - start;
    if (settings->products & DPH_PRODUCT_THICKNESS
            ? !bake_scene(settings, scene, false, &report, &code)
            : !count_scene(settings, scene, &report, &code))
        goto error;
    if (!bake_rivals(settings, scene, &material, settings->products, &rivals, &code) ||
        !bake_response(settings, scene, &material, settings->products, &response, &code))
        goto error;
    double saving = seconds_now();
    if (!dph_scene_save(scene, settings->output, &err)) {
        code = report_error(settings, &err);
        goto error;
    }
    timing.save = seconds_now() - saving;
    timing.total = seconds_now() - start;
    struct storage storage = measure_storage(scene);
    if (settings->json)
        print_json(settings, scene, &report, &rivals, &response, &timing, &storage);
    else if (!settings->quiet)
        print_text(settings, scene, &report, &rivals, &response, &timing, &storage);

error:
    dph_scene_destroy(scene);
    return code;
}

const struct command command_bake = {
    .name = "bake",
    .summary = "precompute directional thickness",
    .usage = "INPUT -o OUTPUT.glb [options]",
    .examples = "  diaphan bake bunny.obj -o bunny.glb\n"
                "  diaphan bake head.ply -o head.glb --material skin1 --size-mm 200\n"
                "  diaphan bake toy.gltf -o toy.glb --bands 4 --store snorm16 --json\n"
                "  diaphan bake bunny.obj -o bunny.glb --store cpca --clusters 128 --vectors 8\n"
                "  diaphan bake bunny.obj -o bunny.glb --for shsss,prt-cpca,patro --material wax\n"
                "  diaphan bake bunny.obj -o bunny.glb --for response --material wax --size-mm 20 "
                "--bytes 16\n",
    .notes = "The output is a glTF file that any loader opens; the coefficients are vertex "
             "attributes. From a glTF\n"
             "input everything else is kept. With --material the weighted fit cares most for what "
             "light comes through\n"
             "that material; --size-mm says how large the object is. --for writes what other methods "
             "need; what prt, prt-cpca,\n"
             "patro and response need holds for one material and size only. The response is baked by random walks, which\n"
             "takes seconds to minutes.\n",
    .options = takes,
    .min_inputs = 1,
    .max_inputs = 1,
    .wants_output = true,
    .run = run,
};
