/* diaphan info --compression --for prt: what it takes to store transfer vectors, 3 channels of SH
 * coefficients, and what is lost. Errors are relative, with weights of 8 bits: the root of the sum
 * over all positions, by the area around them, of squared differences, over that of squares. */
#include "cli.h"

#include <math.h>

struct row {
    int clusters, vectors; /* 0: uncompressed */
    struct storage storage;
    double square, seconds;
};

enum { MOST_ROWS = 8 };

static int list_rows(const struct settings *settings, struct row row[MOST_ROWS])
{
    static const int usual[][2] = {{0, 0}, {1, 24}, {32, 8}, {64, 8}, {128, 8}};
    int count = sizeof usual / sizeof usual[0];
    bool listed = false;
    for (int i = 0; i < count; i++) {
        row[i] = (struct row){.clusters = usual[i][0], .vectors = usual[i][1]};
        listed = listed || (usual[i][0] == settings->cpca.clusters &&
                            usual[i][1] == settings->cpca.vectors);
    }
    if (listed)
        return count;
    row[count] = (struct row){.clusters = settings->cpca.clusters,
                              .vectors = settings->cpca.vectors};
    return count + 1;
}

/* Adds one body; `norm` is the sum of its squares. */
static bool measure(const struct settings *settings, const struct dph_transfer *transfer,
                    double norm, struct row *row, struct dph_error *err)
{
    struct storage own = {.payload = 4 * transfer->length,
                          .fetched = (4 * transfer->length + 15) / 16 * 16};
    if (row->clusters) {
        struct dph_cpca_params params = dph_cpca_defaults();
        double start = seconds_now();
        params.clusters = row->clusters;
        params.vectors = row->vectors;
        params.threads = settings->threads;
        struct dph_cpca *cpca = dph_cpca_create(transfer->vector, transfer->npos,
                                                (int)transfer->length, transfer->area, &params, err);
        if (!cpca)
            return false;
        row->seconds += seconds_now() - start;
        row->square += cpca->error_snorm8 * cpca->error_snorm8 * norm;
        own = cpca_storage(cpca);
        dph_cpca_destroy(cpca);
    }
    row->storage.payload = own.payload > row->storage.payload ? own.payload : row->storage.payload;
    row->storage.fetched = own.fetched > row->storage.fetched ? own.fetched : row->storage.fetched;
    row->storage.shared += own.shared;
    return true;
}

static void print_row(struct json *json, const struct row *row, double norm)
{
    double error = norm > 0 ? sqrt(row->square / norm) : 0;
    if (!json) {
        char shared[32], name[48] = "float";
        if (row->clusters)
            snprintf(name, sizeof name, "cpca %d x %d", row->clusters, row->vectors);
        printf("    %-14s %6zu %6zu %10s   %8.4f %9.2f\n", name, row->storage.payload,
               row->storage.fetched, with_commas(row->storage.shared, shared), 100 * error,
               row->seconds);
        return;
    }
    emit_object(json, NULL);
    emit_text(json, "store", row->clusters ? "cpca" : "float");
    if (row->clusters) {
        emit_count(json, "clusters", (size_t)row->clusters);
        emit_count(json, "vectors", (size_t)row->vectors);
    }
    emit_count(json, "bytes_per_vertex", row->storage.payload);
    emit_count(json, "bytes_per_vertex_gpu", row->storage.fetched);
    emit_count(json, "table_bytes", row->storage.shared);
    emit_number(json, "error", error);
    emit_number(json, "seconds", row->seconds);
    emit_close(json, '}');
}

bool show_transfer_compression(const struct settings *settings, struct dph_scene *scene,
                               struct json *json, int *code)
{
    struct row row[MOST_ROWS];
    struct dph_material material;
    struct dph_rivals_report report;
    struct dph_error err = {0};
    int count = list_rows(settings, row);
    size_t positions = 0;
    double norm = 0;
    if (!load_material(settings, "wax", &material, code) ||
        !bake_rivals(settings, scene, &material, DPH_PRODUCT_TRANSFER, &report, code))
        return false;
    for (size_t b = 0; b < scene->nbody; b++) {
        const struct dph_rivals *rivals = scene->body[b].rivals;
        if (!rivals || !rivals->transfer.vector)
            continue;
        const struct dph_transfer *t = &rivals->transfer;
        double own = 0;
        for (size_t p = 0; p < t->npos; p++)
            for (size_t i = 0; i < t->length; i++) {
                double x = (double)t->vector[p * t->length + i];
                own += (double)t->area[p] * x * x;
            }
        for (int i = 0; i < count; i++)
            if (!measure(settings, t, own, &row[i], &err)) {
                *code = report_error(settings, &err);
                return false;
            }
        norm += own;
        positions += t->npos;
    }
    if (json) {
        emit_object(json, "transfer");
        emit_text(json, "material", material.name);
        emit_number(json, "mm_per_unit", scene->mm_per_unit);
        emit_count(json, "positions", positions);
        emit_number(json, "seconds", report.seconds_transfer);
        emit_array(json, "compression");
    } else {
        char number[32];
        printf("  transfer  %s positions in %s, %g mm a unit, baked in %.2f s\n"
               "  storage          bytes a vertex      table  error in %%\n"
               "                      file    gpu      bytes              seconds\n",
               with_commas(positions, number), material.name, scene->mm_per_unit,
               report.seconds_transfer);
    }
    for (int i = 0; i < count; i++)
        print_row(json, &row[i], norm);
    if (json) {
        emit_close(json, ']');
        emit_close(json, '}');
    }
    return true;
}
