/* diaphan info --compression: what every way of storing the coefficients takes, and what it loses.
 * Errors are relative: the root of the sum over all positions of squared differences of
 * coefficients, over that of squares. */
#include "cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct storage cpca_storage(const struct dph_cpca *cpca)
{
    size_t vectors = (size_t)cpca->vectors;
    return (struct storage){
        .payload = vectors + (cpca->clusters <= 256 ? 1 : 2),
        .fetched = (vectors + 3) / 4 * 4 + 4,
        .shared = (size_t)cpca->clusters * (1 + vectors) * (size_t)cpca->n * sizeof *cpca->table};
}

struct storage measure_storage(const struct dph_scene *scene)
{
    struct storage storage = {0};
    for (size_t b = 0; b < scene->nbody; b++) {
        const struct dph_thickness *t = scene->body[b].thickness;
        if (!t)
            continue;
        size_t payload = dph_thickness_payload(t), fetched = dph_thickness_fetched(t);
        storage.payload = payload > storage.payload ? payload : storage.payload;
        storage.fetched = fetched > storage.fetched ? fetched : storage.fetched;
        storage.shared += dph_thickness_shared(t);
    }
    return storage;
}

const char *product_name(enum dph_product product)
{
    return product == DPH_PRODUCT_NORMALS    ? "patro"
           : product == DPH_PRODUCT_TRANSFER ? "prt"
           : product == DPH_PRODUCT_CLUSTERS ? "prt_cpca"
           : product == DPH_PRODUCT_RESPONSE ? "response" : "thickness";
}

struct storage measure_product(const struct dph_scene *scene, enum dph_product product)
{
    struct storage storage = {0};
    for (size_t b = 0; b < scene->nbody; b++) {
        const struct dph_rivals *rivals = scene->body[b].rivals;
        struct storage own = {0};
        if (!rivals || !(rivals->products & (unsigned)product))
            continue;
        if (product == DPH_PRODUCT_NORMALS) {
            own.payload = own.fetched = 12;
        } else if (product == DPH_PRODUCT_TRANSFER) {
            own.payload = 4 * rivals->transfer.length;
            own.fetched = (own.payload + 15) / 16 * 16;
        } else if (product == DPH_PRODUCT_CLUSTERS) {
            own = cpca_storage(rivals->clusters);
        } else if (product == DPH_PRODUCT_RESPONSE) {
            own.payload = dph_response_payload(rivals->response);
            own.fetched = dph_response_fetched(rivals->response);
            own.shared = dph_response_shared(rivals->response);
        }
        storage.payload = own.payload > storage.payload ? own.payload : storage.payload;
        storage.fetched = own.fetched > storage.fetched ? own.fetched : storage.fetched;
        storage.shared += own.shared;
    }
    return storage;
}

/* One way to store: clusters and vectors for DPH_STORE_CPCA only. */
struct way {
    enum dph_store store;
    int clusters, vectors;
    struct storage storage;
    double square[2]; /* by fit: of differences */
    double seconds[2];
};

enum { MOST_WAYS = 8 };

/* Coefficients of a body's distinct positions; frees nothing on failure but what it made itself. */
static float *unpack(const struct dph_body *body, size_t *npos, struct dph_error *err)
{
    const struct dph_thickness *t = body->thickness;
    size_t n = (size_t)(t->bands * t->bands);
    uint32_t *position_of = malloc((t->nvert + 1) * sizeof *position_of);
    float *row = NULL;
    *npos = position_of ? dph_mesh_weld(body->mesh.position, 12, t->nvert, position_of, err) : SIZE_MAX;
    if (*npos != SIZE_MAX && (row = malloc((*npos + 1) * n * sizeof *row)))
        for (size_t v = 0; v < t->nvert; v++)
            dph_thickness_row(t, v, row + position_of[v] * n);
    free(position_of);
    if (!row && *npos != SIZE_MAX)
        *err = (struct dph_error){.code = DPH_ERROR_MEMORY, .message = "out of memory"};
    return row;
}

static struct dph_thickness *store(const struct settings *settings, const struct way *way,
                                   const float *row, size_t npos, int bands, struct dph_error *err)
{
    if (way->store != DPH_STORE_CPCA)
        return dph_thickness_create(row, npos, bands, NULL, npos, way->store, err);
    struct dph_cpca_params params = dph_cpca_defaults();
    params.clusters = way->clusters;
    params.vectors = way->vectors;
    params.threads = settings->threads;
    struct dph_cpca *cpca = dph_cpca_create(row, npos, bands * bands, NULL, &params, err);
    struct dph_thickness *thickness = cpca ? dph_cpca_thickness(cpca, bands, NULL, npos, err) : NULL;
    dph_cpca_destroy(cpca);
    return thickness;
}

/* Adds one body to one way. */
static bool measure(const struct settings *settings, struct way *way, enum dph_fit fit,
                    const float *row, size_t npos, int bands, struct dph_error *err)
{
    double start = seconds_now();
    struct dph_thickness *t = store(settings, way, row, npos, bands, err);
    if (!t)
        return false;
    way->seconds[fit] += seconds_now() - start;
    float decoded[DPH_MAX_BANDS * DPH_MAX_BANDS];
    int n = bands * bands;
    for (size_t p = 0; p < npos; p++) {
        dph_thickness_row(t, p, decoded);
        for (int i = 0; i < n; i++) {
            double d = (double)decoded[i] - (double)row[p * (size_t)n + (size_t)i];
            way->square[fit] += d * d;
        }
    }
    if (fit == DPH_FIT_SPHERE) {
        size_t payload = dph_thickness_payload(t), fetched = dph_thickness_fetched(t);
        way->storage.payload = payload > way->storage.payload ? payload : way->storage.payload;
        way->storage.fetched = fetched > way->storage.fetched ? fetched : way->storage.fetched;
        way->storage.shared += dph_thickness_shared(t);
    }
    dph_thickness_destroy(t);
    return true;
}

/* The usual ways, and that of --clusters and --vectors where it is another. */
static int list_ways(const struct settings *settings, struct way way[MOST_WAYS])
{
    static const struct way usual[] = {
        {.store = DPH_STORE_FLOAT},
        {.store = DPH_STORE_SNORM16},
        {.store = DPH_STORE_SNORM8},
        {.store = DPH_STORE_CPCA, .clusters = 1, .vectors = 24},
        {.store = DPH_STORE_CPCA, .clusters = 32, .vectors = 8},
        {.store = DPH_STORE_CPCA, .clusters = 128, .vectors = 8},
    };
    int count = sizeof usual / sizeof usual[0];
    memcpy(way, usual, sizeof usual);
    for (int i = 0; i < count; i++)
        if (way[i].store == DPH_STORE_CPCA && way[i].clusters == settings->cpca.clusters &&
            way[i].vectors == settings->cpca.vectors)
            return count;
    way[count] = (struct way){.store = DPH_STORE_CPCA,
                              .clusters = settings->cpca.clusters,
                              .vectors = settings->cpca.vectors};
    return count + 1;
}

static void print_way(struct json *json, const struct way *way, const double norm[2])
{
    double error[2], percent[2];
    for (int f = 0; f < 2; f++) {
        error[f] = norm[f] > 0 ? sqrt(way->square[f] / norm[f]) : 0;
        percent[f] = 100 * error[f];
    }
    if (!json) {
        char shared[32], name[48];
        if (way->store != DPH_STORE_CPCA)
            snprintf(name, sizeof name, "%s", dph_store_name(way->store));
        else
            snprintf(name, sizeof name, "cpca %d x %d", way->clusters, way->vectors);
        printf("    %-14s %6zu %6zu %10s   %8.4f %8.4f %9.2f\n", name, way->storage.payload,
               way->storage.fetched, with_commas(way->storage.shared, shared), percent[0], percent[1],
               way->seconds[0]);
        return;
    }
    emit_object(json, NULL);
    emit_text(json, "store", dph_store_name(way->store));
    if (way->store == DPH_STORE_CPCA) {
        emit_count(json, "clusters", (size_t)way->clusters);
        emit_count(json, "vectors", (size_t)way->vectors);
    }
    emit_count(json, "bytes_per_vertex", way->storage.payload);
    emit_count(json, "bytes_per_vertex_gpu", way->storage.fetched);
    emit_count(json, "table_bytes", way->storage.shared);
    emit_object(json, "error");
    for (int f = 0; f < 2; f++)
        emit_number(json, dph_fit_name((enum dph_fit)f), error[f]);
    emit_close(json, '}');
    emit_number(json, "seconds", way->seconds[0]);
    emit_close(json, '}');
}

bool show_compression(const struct settings *settings, struct dph_scene *scene, struct json *json,
                      int *code)
{
    struct way way[MOST_WAYS];
    double norm[2] = {0};
    struct dph_error err = {0};
    int count = list_ways(settings, way);
    struct settings float_settings = *settings;
    float_settings.store = DPH_STORE_FLOAT;
    for (int fit = DPH_FIT_SPHERE; fit <= DPH_FIT_WEIGHTED; fit++) {
        float_settings.bake.fit = (enum dph_fit)fit;
        if (!bake_scene(&float_settings, scene, false, NULL, code))
            return false;
        for (size_t b = 0; b < scene->nbody; b++) {
            const struct dph_thickness *t = scene->body[b].thickness;
            size_t npos;
            if (!t)
                continue;
            float *row = unpack(&scene->body[b], &npos, &err);
            bool ok = row != NULL;
            for (size_t i = 0; ok && i < npos * (size_t)(t->bands * t->bands); i++)
                norm[fit] += (double)row[i] * (double)row[i];
            for (int i = 0; ok && i < count; i++)
                ok = measure(settings, &way[i], (enum dph_fit)fit, row, npos, t->bands, &err);
            free(row);
            if (!ok) {
                *code = report_error(settings, &err);
                return false;
            }
        }
    }
    if (json)
        emit_array(json, "compression");
    else
        printf("  storage          bytes a vertex      table  error in %% of the coefficients\n"
               "                      file    gpu      bytes     sphere weighted   seconds\n");
    for (int i = 0; i < count; i++)
        print_way(json, &way[i], norm);
    if (json)
        emit_close(json, ']');
    return true;
}
