/* diaphan bench: speed, measured in one run on one machine.
 *
 * bench bake times the sweep beside rays, the same positions of the same mesh along the same
 * directions. There are TURNS turns; in each every measurement gets its slice of the time, so that
 * a machine whose speed drifts slows all of them alike, and the median of the turns is taken, so that
 * a machine that stalls for a moment does not matter. The sweep's figure is what dph_bake reports
 * for all directions; rays, many times slower, run along a part of the directions, spread evenly
 * over the list, a different part every time. Pairs are (position, direction). */
#define _POSIX_C_SOURCE 200809L
#include "cli.h"
#include "commit.h"

#include <diaphan/trace.h>

#include <errno.h>
#include <stdlib.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <string.h>
#include <unistd.h>

static const char *const takes[] = {"output", "directions", "fit", "seconds", "scale",
                                    /* draw */
                                    "methods", "camera", "resolution", "use-bands", "lights",
                                    "repeat-mesh", "material", "size-mm", "map-size", "samples",
                                    /* response */
                                    "noise", "seed", "check", NULL};

const char *const bench_bunny = "/usr/share/glmark2/models/bunny.obj";

enum { ENGINES = 2, SWEEP = 0, EMBREE = 1, RAY_DIRECTIONS = 8, MAX_ROWS = 8, TURNS = 5 };
static const char *const engine_name[ENGINES] = {"sweep", "embree"};

/* One measurement: an engine, a definition, a number of threads. */
struct row {
    int engine, threads;
    enum dph_definition definition;
    double pairs, seconds; /* of the slice under way                    */
    double total;          /* seconds of all slices                     */
    double rate[TURNS];    /* pairs a second, by turn                   */
};

/* The median of the turns. */
static double row_rate(const struct row *row)
{
    double sorted[TURNS];
    memcpy(sorted, row->rate, sizeof sorted);
    for (int i = 1; i < TURNS; i++)
        for (int k = i; k > 0 && sorted[k] < sorted[k - 1]; k--) {
            double swap = sorted[k];
            sorted[k] = sorted[k - 1];
            sorted[k - 1] = swap;
        }
    return sorted[TURNS / 2];
}

/* What is measured on: the distinct positions of a model. */
struct model {
    const char *name;
    size_t triangles, positions;
    float *position; /* (positions x 3) */
    uint32_t *index; /* (triangles x 3) */
};

static int processors(void)
{
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count < 1 ? 1 : count > 256 ? 256 : (int)count;
}

void cpu_name(char *name, size_t size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    snprintf(name, size, "unknown");
    while (file && fgets(line, sizeof line, file)) {
        char *colon = strchr(line, ':');
        if (colon && strncmp(line, "model name", 10) == 0) {
            line[strcspn(line, "\n")] = 0;
            snprintf(name, size, "%s", colon + 2);
            break;
        }
    }
    if (file)
        fclose(file);
}

static void model_finish(struct model *model)
{
    free(model->position);
    free(model->index);
    *model = (struct model){0};
}

/* Takes a mesh down to its distinct positions. */
static bool model_init(struct model *model, const char *name, const struct dph_mesh *mesh,
                       struct dph_error *err)
{
    uint32_t *position_of = malloc((mesh->nvert + 1) * sizeof *position_of);
    *model = (struct model){.name = name, .triangles = mesh->ntri};
    if (!position_of)
        goto memory;
    model->positions =
        dph_mesh_weld(mesh->position, 3 * sizeof(float), mesh->nvert, position_of, err);
    if (model->positions == SIZE_MAX) {
        free(position_of);
        return false;
    }
    model->position = malloc((model->positions + 1) * 3 * sizeof *model->position);
    model->index = malloc((mesh->ntri + 1) * 3 * sizeof *model->index);
    if (!model->position || !model->index)
        goto memory;
    for (size_t v = 0; v < mesh->nvert; v++)
        memcpy(model->position + 3 * (size_t)position_of[v], mesh->position + 3 * v,
               3 * sizeof(float));
    for (size_t i = 0; i < 3 * mesh->ntri; i++)
        model->index[i] = position_of[mesh->index[i]];
    free(position_of);
    return true;

memory:
    free(position_of);
    model_finish(model);
    *err = (struct dph_error){DPH_ERROR_MEMORY, "out of memory"};
    return false;
}

/* One slice of a sweep: the bake of all directions, of which only the sweep counts. */
static bool slice_sweep(const struct model *model, const struct settings *settings, struct row *row,
                        float *coefficient, struct dph_error *err)
{
    struct dph_bake_input input = {model->position, 0, model->positions, model->index,
                                   model->triangles};
    struct dph_bake_params params = settings->bake;
    struct dph_bake_report report;
    params.bands = 1; /* the projection is not measured here */
    params.fit = DPH_FIT_SPHERE;
    params.definition = row->definition;
    params.threads = row->threads;
    if (!dph_bake(&input, &params, coefficient, &report, err))
        return false;
    row->pairs += (double)model->positions * report.directions;
    row->seconds += report.seconds_sweep;
    return true;
}

/* One slice of rays, along RAY_DIRECTIONS directions a thread. */
static void slice_rays(const struct model *model, const struct dph_rays *rays,
                       const float *direction, int count, int turn, struct row *row,
                       float *thickness)
{
    float chosen[3 * RAY_DIRECTIONS * 256];
    int slice = RAY_DIRECTIONS * row->threads;
    for (int i = 0; i < slice; i++) {
        int from = (int)(((long)i * count / slice + 37L * turn) % count);
        memcpy(chosen + 3 * i, direction + 3 * from, 3 * sizeof *chosen);
    }
    double start = seconds_now();
    dph_rays_thickness_all(rays, row->definition, chosen, (size_t)slice, row->threads, thickness);
    row->seconds += seconds_now() - start;
    row->pairs += (double)model->positions * slice;
}

static bool measure(const struct settings *settings, const struct model *model, struct row *rows,
                    int nrow, struct progress *progress, struct dph_error *err)
{
    int count = (settings->bake.directions + 1) & ~1, most = 1;
    for (int r = 0; r < nrow; r++)
        most = rows[r].threads > most ? rows[r].threads : most;
    float *direction = malloc((size_t)count * 3 * sizeof *direction);
    float *coefficient = malloc((model->positions + 1) * sizeof *coefficient);
    float *thickness =
        malloc((model->positions + 1) * (size_t)(RAY_DIRECTIONS * most) * sizeof *thickness);
    struct dph_rays *rays = NULL;
    bool ok = false;
    if (!direction || !coefficient || !thickness) {
        *err = (struct dph_error){DPH_ERROR_MEMORY, "out of memory"};
        goto error;
    }
    if (!(rays = dph_rays_create(model->position, model->positions, model->index, model->triangles,
                                 err)))
        goto error;
    dph_sh_directions(count, direction);
    for (int turn = 0, batch = 0; turn < TURNS; turn++)
        for (int r = 0; r < nrow; r++) {
            struct row *row = &rows[r];
            row->pairs = row->seconds = 0.0;
            while (row->seconds < settings->seconds / TURNS) {
                if (row->engine == EMBREE)
                    slice_rays(model, rays, direction, count, batch++, row, thickness);
                else if (!slice_sweep(model, settings, row, coefficient, err))
                    goto error;
            }
            row->rate[turn] = row->pairs / row->seconds;
            row->total += row->seconds;
            progress_step(progress, (double)(turn * nrow + r + 1) / (TURNS * nrow));
        }
    ok = true;

error:
    dph_rays_destroy(rays);
    free(direction);
    free(coefficient);
    free(thickness);
    return ok;
}

static void print_table(const struct model *model, const struct row *rows, int nrow)
{
    char a[32], b[32];
    printf("\n%s: %s triangles, %s positions\n", model->name, with_commas(model->triangles, a),
           with_commas(model->positions, b));
    printf("  thickness  threads   sweep M pairs/s   rays M pairs/s   ratio\n");
    for (int r = 0; r + 1 < nrow; r += 2) {
        double sweep = row_rate(&rows[r]), rays = row_rate(&rows[r + 1]);
        printf("  %-9s  %7d   %15.2f   %14.2f   %5.1f\n", dph_definition_name(rows[r].definition),
               rows[r].threads, 1e-6 * sweep, 1e-6 * rays, sweep / rays);
    }
    printf("  inside costs %.2f times first (sweep, %d thread)\n",
           row_rate(&rows[0]) / row_rate(&rows[2]), rows[0].threads);
}

static void print_row(struct json *json, const struct model *model, const struct row *row,
                      int directions)
{
    emit_object(json, NULL);
    emit_text(json, "model", model->name);
    emit_count(json, "triangles", model->triangles);
    emit_count(json, "positions", model->positions);
    emit_count(json, "directions", (size_t)directions);
    emit_count(json, "threads", (size_t)row->threads);
    emit_text(json, "engine", engine_name[row->engine]);
    emit_text(json, "thickness", dph_definition_name(row->definition));
    emit_number(json, "pairs_per_second", row_rate(row));
    emit_number(json, "seconds", row->total);
    emit_close(json, '}');
}

/* All rows of one model: each definition and number of threads, the sweep and then the rays. */
static int bench_model(const struct settings *settings, const char *name,
                       struct dph_mesh *mesh, struct json *json)
{
    struct dph_error err;
    struct model model;
    struct row rows[MAX_ROWS];
    struct progress progress;
    const int all = settings->threads ? settings->threads : processors();
    const enum dph_definition definitions[2] = {DPH_THICKNESS_FIRST, DPH_THICKNESS_INSIDE};
    int nrow = 0;
    for (int t = 0; t < (all > 1 ? 2 : 1); t++)
        for (int d = 0; d < 2; d++)
            for (int engine = 0; engine < ENGINES; engine++)
                rows[nrow++] = (struct row){
                    .engine = engine, .threads = t ? all : 1, .definition = definitions[d]};
    if (!model_init(&model, name, mesh, &err))
        return report_error(settings, &err);
    progress_begin(&progress, settings, name);
    bool ok = measure(settings, &model, rows, nrow, &progress, &err);
    progress_end(&progress);
    if (!ok) {
        model_finish(&model);
        return report_error(settings, &err);
    }
    if (!settings->json)
        print_table(&model, rows, nrow);
    for (int r = 0; settings->json && r < nrow; r++)
        print_row(json, &model, &rows[r], (settings->bake.directions + 1) & ~1);
    model_finish(&model);
    fflush(stdout);
    return EXIT_DONE;
}

/* The body with most triangles stands for a file. NULL: complained, *code is the exit code. */
static struct dph_body *largest_body(const struct settings *settings, struct dph_scene *scene,
                                     const char *path, int *code)
{
    struct dph_body *largest = NULL;
    for (size_t b = 0; b < scene->nbody; b++)
        if (scene->body[b].mesh.ntri > (largest ? largest->mesh.ntri : 0))
            largest = &scene->body[b];
    if (!largest) {
        complain(settings, "%s: no triangles to measure", path);
        *code = EXIT_INPUT;
    }
    return largest;
}

int bench_file(const struct settings *settings, const char *path, bench_mesh *one,
               struct json *json)
{
    int code = EXIT_DONE;
    struct dph_scene *scene = load_scene(settings, path, &code);
    struct dph_body *body = scene ? largest_body(settings, scene, path, &code) : NULL;
    const char *slash = strrchr(path, '/');
    if (body)
        code = one(settings, slash ? slash + 1 : path, &body->mesh, json);
    dph_scene_destroy(scene);
    return code;
}

int bench_candle(const struct settings *settings, bench_mesh *one, struct json *json)
{
    struct dph_error err;
    struct dph_mesh mesh = {0};
    if (!dph_mesh_init_candle(&mesh, &err))
        return report_error(settings, &err);
    int code = one(settings, "candle", &mesh, json);
    dph_mesh_finish(&mesh);
    return code;
}

/* A software rasteriser takes memory for every draw call and gives it back. Whether the C library
 * keeps it or hands it to the system, whose page faults then cost as much as all vertices, depends
 * on the largest block that was ever freed: chance, as far as drawing is concerned. Here it is kept. */
static void keep_memory(void)
{
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 32 << 20); /* the most that it takes */
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
    mallopt(M_TOP_PAD, 64 << 20);
#endif
}

static int bench_bake(const struct settings *settings, struct json *json)
{
    int code = EXIT_DONE;
    if (settings->nsize)
        code = bench_scale(settings, settings->json ? json : NULL);
    for (int i = 1; i < settings->ninput && code == EXIT_DONE; i++)
        code = bench_file(settings, settings->input[i], bench_model, json);
    if (settings->ninput == 1 && !settings->nsize) {
        code = bench_candle(settings, bench_model, json);
        if (code == EXIT_DONE && access(bench_bunny, R_OK) == 0)
            code = bench_file(settings, bench_bunny, bench_model, json);
    }
    return code;
}

static int run(struct settings *settings)
{
    int code = EXIT_DONE;
    struct json json = {0};
    char cpu[128], *text = NULL;
    size_t length = 0;
    FILE *stream = NULL;
    const char *what = settings->input[0];
    const bool draw = strcmp(what, "draw") == 0, response = strcmp(what, "response") == 0;
    if (!draw && !response && strcmp(what, "bake") != 0) {
        complain(settings, "'%s' is nothing to measure; there are: bake, draw, response", what);
        return EXIT_USAGE;
    }
    if (settings->check && !response) {
        complain(settings, "--check is of bench response");
        return EXIT_USAGE;
    }
    if (draw)
        keep_memory();
    if (!draw && settings->output) {
        complain(settings, "bench %s writes no files, only bench draw does", what);
        return EXIT_USAGE;
    }
    for (int i = 1; i < settings->ninput; i++) /* not after minutes of measuring */
        if (access(settings->input[i], R_OK)) {
            complain(settings, "%s: %s", settings->input[i], strerror(errno));
            return EXIT_INPUT;
        }
    if (draw)
        return bench_draw(settings);
    cpu_name(cpu, sizeof cpu);
    if (settings->json) { /* kept back until it is whole */
        if (!(stream = open_memstream(&text, &length))) {
            complain(settings, "out of memory");
            return EXIT_INPUT;
        }
        emit_begin(&json, stream);
        emit_text(&json, "cpu", cpu);
        if (response) {
            emit_text(&json, "commit", DPH_COMMIT);
            emit_number(&json, "noise", settings->noise);
            emit_count(&json, "check", (size_t)settings->check);
        }
        emit_array(&json, "results");
    } else if (response) {
        printf("diaphan %s, commit %s, on %s\n", dph_version(), DPH_COMMIT, cpu);
    } else {
        printf("diaphan %s on %s, %d directions\n", dph_version(), cpu,
               (settings->bake.directions + 1) & ~1);
    }
    if (response)
        code = bench_response(settings, settings->json ? &json : NULL);
    else
        code = bench_bake(settings, &json);
    if (settings->json) {
        emit_close(&json, ']');
        emit_end(&json);
        fclose(stream);
        if (code == EXIT_DONE)
            fwrite(text, 1, length, stdout);
        free(text);
    }
    return code;
}

const struct command command_bench = {
    .name = "bench",
    .summary = "measure speed",
    .usage = "bake|draw|response [INPUT ...] [options]",
    .examples = "  diaphan bench bake\n"
                "  diaphan bench bake bunny.obj lucy.ply --seconds 3 --json\n"
                "  diaphan bench bake --scale 250000,500000,1000000\n"
                "  diaphan bench draw -o results\n"
                "  diaphan bench draw bunny.obj --methods shsss,green --resolution 1920x1080\n"
                "  diaphan bench draw --methods shsss,prt-cpca --lights 1,2,4,8,16\n"
                "  diaphan bench response bunny.obj --material wax --size-mm 20 --check 16\n",
    .notes = "bake: pairs of position and direction a second, the sweep beside Embree's rays "
             "(rtcIntersect1 for the first\n"
             "exit, a filter for all hits), one thread and all of them, in one run. Of a file with "
             "several bodies the largest\n"
             "is measured. Without INPUT: the candle, and the bunny of the package glmark2-data "
             "where it is installed. --scale bakes made-up closed meshes of growing size,\n"
             "each in a process of its own, and shows time and peak memory.\n"
             "draw: milliseconds a frame of every method beside plain shading (lambert), with "
             "vertices unshared and indexed,\n"
             "near (the model as high as the frame) and far (an eighth of that), at 1280x800 and "
             "5x5, shsss with 1 to 6 bands\n"
             "in every component type, prt-cpca as 1 cluster of 24 vectors and 64 of 8; on the "
             "candle without INPUT. Lights turn\n"
             "before every frame. --seconds is a measurement's time. --lights measures growth "
             "instead: near, unshared and indexed.\n"
             "-o FOLDER gets chart.svg, chart.png, report.md and results.json, growth included.\n"
             "response: seconds, walks and noise of the response bake, of a file's largest body, in "
             "every --material; wax at 20 mm\n"
             "and marble at 50 where nothing else is said; without INPUT of that bunny, else of the "
             "candle. --check shows how far\n"
             "each bake is from a better one, beside the noise that it told. --size-mm is that "
             "body's largest side.\n",
    .options = takes,
    .min_inputs = 1,
    .max_inputs = MAX_INPUTS,
    .run = run,
};
