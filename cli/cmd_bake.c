/* diaphan bake: load, bake, save, and say what it took. */
#include "cli.h"

static const char *const takes[] = {"output", "bands",   "directions", "thickness", "fit",
                                    "store",  "clusters", "vectors", "size-mm",   "material", NULL};

struct timing {
    double load, save, total;
};

static void print_json(const struct settings *settings, const struct dph_scene_bake_report *report,
                       const struct timing *timing, const struct storage *storage)
{
    struct json json;
    emit_begin(&json, stdout);
    emit_text(&json, "input", settings->input[0]);
    emit_text(&json, "output", settings->output);
    emit_count(&json, "bodies", report->bodies);
    emit_count(&json, "triangles", report->triangles);
    emit_count(&json, "vertices", report->vertices);
    emit_count(&json, "positions", report->positions);
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
    emit_count(&json, "threads", (size_t)report->threads);
    emit_object(&json, "seconds");
    emit_number(&json, "load", timing->load);
    emit_number(&json, "sweep", report->seconds_sweep);
    emit_number(&json, "project", report->seconds_project);
    emit_number(&json, "store", report->seconds_store);
    emit_number(&json, "save", timing->save);
    emit_number(&json, "total", timing->total);
    emit_close(&json, '}');
    emit_end(&json);
}

static void print_text(const struct settings *settings, const struct dph_scene_bake_report *report,
                       const struct timing *timing, const struct storage *storage)
{
    char triangles[32], vertices[32], positions[32];
    int bands = settings->bake.bands;
    printf("%s: %s triangles, %s vertices at %s positions", settings->input[0],
           with_commas(report->triangles, triangles), with_commas(report->vertices, vertices),
           with_commas(report->positions, positions));
    if (report->bodies != 1)
        printf(", %zu bodies", report->bodies);
    printf("\nbaked %d bands from %d directions (%s, %s) in %.2f s: load %.2f, sweep %.2f, "
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
    struct dph_material material; /* a misspelt one is told of before anything is loaded */
    if (settings->material && !load_material(settings, NULL, &material, &code))
        return code;
    if (!output_possible(settings, settings->output))
        return EXIT_OUTPUT;

    double start = seconds_now();
    struct dph_scene *scene = load_scene(settings, settings->input[0], &code);
    if (!scene)
        return code;
    timing.load = seconds_now() - start;
    if (!bake_scene(settings, scene, false, &report, &code))
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
        print_json(settings, &report, &timing, &storage);
    else if (!settings->quiet)
        print_text(settings, &report, &timing, &storage);

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
                "  diaphan bake bunny.obj -o bunny.glb --store cpca --clusters 128 --vectors 8\n",
    .notes = "The output is a glTF file that any loader opens; the coefficients are vertex "
             "attributes. From a glTF\n"
             "input everything else is kept. With --material the weighted fit cares most for what "
             "light comes through\n"
             "that material; --size-mm says how large the object is.\n",
    .options = takes,
    .min_inputs = 1,
    .max_inputs = 1,
    .wants_output = true,
    .run = run,
};
