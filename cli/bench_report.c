/* What bench draw shows: a table a cell, and the same as one JSON object. */
#include "bench_draw.h"
#include "commit.h"

#include <string.h>

void print_draw_tables(const struct bench_run *run, const struct bench_result *result)
{
    char a[32], b[32], label[64];
    printf("%s: %s triangles, %s vertices, %s of them different; %d sample%s a pixel, timed by "
           "%s\n",
           result->model, with_commas(result->triangles, a), with_commas(result->vertices, b),
           with_commas(result->shared, label), run->samples, run->samples == 1 ? "" : "s",
           result->row[0].timing.gpu ? "the GPU's timer" : "glFinish and a clock");
    for (int r = 0; r < result->nrow; r++) {
        const struct bench_row *row = &result->row[r];
        if (!r || memcmp(&row->cell, &row[-1].cell, sizeof row->cell)) {
            cell_label(&row->cell, label);
            printf("\n%s: %s vertices\n", label, with_commas(row->vertices, a));
            printf("  %-26s %8s %8s %8s %8s %8s  %9s  %7s %7s %6s\n", "method", "ms", "p05", "p95",
                   "fps", "cpu ms", "x lambert", "B/vert", "passes", "frames");
        }
        variant_label(&row->variant, label);
        printf("  %-26s %8.3f %8.3f %8.3f %8.1f %8.3f  %9.2f  %7.4g %7d %6zu\n", label,
               row->timing.ms_median, row->timing.ms_p05, row->timing.ms_p95,
               1e3 / row->timing.ms_median, row->timing.cpu_ms, row->timing.ratio,
               row->cost.bytes_per_vertex, row->cost.passes, row->timing.frames);
    }
    printf("\n%s: %.1f s to bake, %.0f s in all\n", result->model, result->seconds_bake,
           result->seconds);
}

static void print_row(struct json *json, const struct bench_result *result,
                      const struct bench_row *row)
{
    const struct variant *variant = &row->variant;
    emit_object(json, NULL);
    emit_text(json, "model", result->model);
    emit_text(json, "method", variant->method->name);
    emit_count(json, "bands", (size_t)variant->bands);
    if (variant->method->needs_thickness) {
        if (variant->chosen)
            emit_text(json, "use_bands", "auto");
        else
            emit_count(json, "use_bands", (size_t)variant->bands);
    }
    emit_text(json, "store",
              variant->store < 0 ? NULL : dph_store_name((enum dph_store)variant->store));
    if (variant->method->needs & DPH_PRODUCT_RESPONSE)
        emit_text(json, "form", dph_response_form_name((enum dph_response_form)variant->form));
    emit_count(json, "clusters", (size_t)variant->clusters);
    emit_count(json, "vectors", (size_t)variant->vectors);
    emit_count(json, "lights", (size_t)row->cell.lights);
    emit_count(json, "passes", (size_t)row->cost.passes);
    emit_bool(json, "indexed", row->cell.indexed);
    emit_text(json, "camera", camera_label(&row->cell));
    emit_count(json, "width", (size_t)row->cell.width);
    emit_count(json, "height", (size_t)row->cell.height);
    emit_count(json, "vertices", row->vertices);
    emit_count(json, "frames", row->timing.frames);
    emit_number(json, "ms_median", row->timing.ms_median);
    emit_number(json, "ms_p05", row->timing.ms_p05);
    emit_number(json, "ms_p95", row->timing.ms_p95);
    emit_number(json, "fps", 1e3 / row->timing.ms_median);
    emit_number(json, "cpu_ms", row->timing.cpu_ms);
    emit_number(json, "drift", row->drift);
    emit_number(json, "ratio_to_lambert", row->timing.ratio);
    emit_number(json, "ratio_error", row->timing.ratio_error);
    emit_number(json, "ratio_to_unshared_lambert", row->unshared_ratio);
    emit_number(json, "others", row->timing.others);
    emit_number(json, "bytes_per_vertex", row->cost.bytes_per_vertex);
    emit_count(json, "table_bytes", row->cost.table_bytes);
    emit_text(json, "clock", row->timing.gpu ? "gpu" : "finish");
    emit_close(json, '}');
}

void print_draw_json(const struct bench_run *run, FILE *stream)
{
    struct json json;
    emit_begin(&json, stream);
    emit_text(&json, "renderer", run->gl);
    emit_text(&json, "cpu", run->cpu);
    emit_text(&json, "commit", DPH_COMMIT);
    emit_text(&json, "model", run->result[0].model);
    emit_count(&json, "vertices", run->result[0].vertices);
    emit_text(&json, "material", run->material);
    emit_count(&json, "samples", (size_t)run->samples);
    emit_number(&json, "seconds", run->seconds_each);
    emit_count(&json, "rounds", (size_t)run->rounds);
    emit_count(&json, "copies", (size_t)run->repeat);
    emit_array(&json, "results");
    for (int i = 0; i < run->nresult; i++)
        for (int r = 0; r < run->result[i].nrow; r++)
            print_row(&json, &run->result[i], &run->result[i].row[r]);
    emit_close(&json, ']');
    emit_end(&json);
}
