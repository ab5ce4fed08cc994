/* bench draw: milliseconds a frame of every method, beside plain shading.
 *
 * The experiment is that of Tomaszewska and Stefanowski, figures 4 and 5: the candle with
 * unshared vertices, two cameras, a frame of 1280 x 800 and one of 5 x 5, which leaves the
 * vertex stage alone. Added are shared vertices with indices, every storage, and the ratio to
 * plain shading. All variants of a cell are measured in turns with lambert (dph_renderer_measure),
 * or in a few groups where the model is so large that buffers for all would not fit; lambert is in
 * each group, so ratios do not depend on when a group's turn is. */
#include "bench_draw.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { NEAR_TO_FAR = 8, CELLS = 64 };

/* Variants are measured in groups that are as large as memory allows: so the base line is drawn the
 * fewest times, and a variant's turns are spread the farthest over the drift of the machine. */
enum { GROUP_LEAST = 9, CORNER_BYTES = 64 + 4 * 36 };
static const size_t GROUP_BYTES = (size_t)2 << 30;

/* What -o adds to the matrix: how the methods grow that differ in kind. */
static const int growth_counts[] = {1, 2, 4, 8, 16};
static const char *const growth_methods[] = {"shsss", "green", "prt-cpca"};

void variant_label(const struct variant *variant, char label[48])
{
    const char *name = variant->method->name;
    if (variant->chosen)
        snprintf(label, 48, "%s, auto %s", name, dph_store_name((enum dph_store)variant->store));
    else if (variant->method->needs_thickness)
        snprintf(label, 48, "%s, %d %s", name, variant->bands * variant->bands,
                 dph_store_name((enum dph_store)variant->store));
    else if (variant->method->needs & DPH_PRODUCT_RESPONSE)
        snprintf(label, 48, "%s, %s %d %s", name,
                 dph_response_form_name((enum dph_response_form)variant->form),
                 variant->bands * variant->bands, dph_store_name((enum dph_store)variant->store));
    else if (variant->clusters)
        snprintf(label, 48, "%s, %d x %d", name, variant->clusters, variant->vectors);
    else
        snprintf(label, 48, "%s", name);
}

const char *camera_label(const struct cell *cell)
{
    return cell->given ? "given" : cell->far ? "far" : "near";
}

void cell_label(const struct cell *cell, char label[64])
{
    char lights[24] = "";
    if (cell->lights > 1)
        snprintf(lights, sizeof lights, ", %d lights", cell->lights);
    snprintf(label, 64, "%dx%d, %s, %s%s", cell->width, cell->height, camera_label(cell),
             cell->indexed ? "indexed" : "unshared", lights);
}

/* Everything there is to measure of the chosen methods, lambert first. `growth`: shsss in one type
 * and three sizes. */
static int list_variants(const struct settings *settings, unsigned methods, bool growth,
                         struct variant *variant)
{
    static const enum dph_store stores[] = {DPH_STORE_FLOAT, DPH_STORE_SNORM16, DPH_STORE_SNORM8};
    const struct dph_method *method;
    int count = 0;
    variant[count++] = (struct variant){.method = dph_method_find("lambert"), .store = -1};
    for (size_t i = 0; (method = dph_method_at(i)); i++) {
        if (!(methods >> i & 1) || method == variant[0].method)
            continue;
        if (method->needs_thickness) {
            for (int bands = 1; bands <= DPH_DRAW_BANDS; bands++)
                for (size_t s = 0; s < sizeof stores / sizeof *stores; s++) {
                    bool wanted = settings->use_bands ? settings->use_bands == bands
                                                      : !growth || bands % 2 == 0;
                    if (wanted && (!growth || stores[s] == DPH_STORE_SNORM8))
                        variant[count++] =
                            (struct variant){.method = method, .bands = bands, .store = stores[s]};
                }
            if (!settings->use_bands || settings->use_bands == DPH_BANDS_AUTO)
                variant[count++] = (struct variant){.method = method,
                                                    .bands = DPH_DRAW_BANDS,
                                                    .chosen = true,
                                                    .store = DPH_STORE_SNORM8};
        } else if (method->needs & DPH_PRODUCT_RESPONSE) {
            static const int sizes[] = {2, 3, 4, 6};
            for (int form = DPH_RESPONSE_ROOT; form <= DPH_RESPONSE_LINEAR; form++)
                for (int s = form == DPH_RESPONSE_ROOT ? 0 : 3; s < 4; s++)
                    if (settings->use_bands > 0 ? settings->use_bands == sizes[s]
                                                : !growth || s == 3)
                        variant[count++] = (struct variant){.method = method,
                                                            .bands = sizes[s],
                                                            .store = DPH_STORE_SNORM8,
                                                            .form = form};
        } else if (method->needs & DPH_PRODUCT_CLUSTERS) {
            for (int s = 0; s < CPCA_SETTINGS; s++)
                variant[count++] = (struct variant){.method = method,
                                                    .bands = DPH_DRAW_BANDS,
                                                    .store = DPH_STORE_SNORM8,
                                                    .setting = s,
                                                    .clusters = cpca_setting[s][0],
                                                    .vectors = cpca_setting[s][1]};
        } else {
            bool transfer = method->needs & DPH_PRODUCT_TRANSFER;
            bool stored = method->needs;
            variant[count++] = (struct variant){.method = method,
                                                .bands = transfer ? DPH_DRAW_BANDS : 0,
                                                .store = stored ? DPH_STORE_FLOAT : -1};
        }
    }
    return count;
}

/* The numbers of --lights. False: complained. */
static bool parse_counts(const struct settings *settings, int count[MAX_COUNTS], int *ncount)
{
    *ncount = 0;
    for (const char *at = settings->lights; *at;) {
        char *end;
        long number = strtol(at, &end, 10);
        if (end == at || (*end && *end != ',') || (*end && !end[1]) || number < 1 ||
            number > DPH_MAX_LIGHTS || *ncount == MAX_COUNTS) {
            complain(settings, "--lights: wants up to %d numbers of lights, each 1 to %d, with "
                               "commas, not '%.64s'",
                     (int)MAX_COUNTS, (int)DPH_MAX_LIGHTS, settings->lights);
            return false;
        }
        count[(*ncount)++] = (int)number;
        at = *end ? end + 1 : end;
    }
    return true;
}

/* What the camera sees, and so many lights around the model. The near camera makes the model's
 * largest side as high as the frame. */
static struct dph_frame frame_of(const struct settings *settings, const struct bench_run *run,
                                 const struct bench_model *model, const struct dph_scene *scene,
                                 const struct variant *variant, const struct cell *cell)
{
    const double pi = 3.14159265358979323846;
    struct dph_frame frame = dph_frame_defaults();
    double sum = 0.0, side = dph_scene_size(scene);
    for (int k = 0; k < 3; k++) {
        double edge = scene->bounds[1][k] - scene->bounds[0][k];
        sum += edge * edge;
    }
    if (sum > 0.0)
        frame.camera.distance = side / sqrt(sum) / tan(frame.camera.fov * pi / 360.0);
    if (cell->far)
        frame.camera.distance *= NEAR_TO_FAR;
    if (cell->given)
        frame.camera = settings->camera;
    frame.method = variant->method;
    frame.bands = variant->chosen ? DPH_BANDS_AUTO : 0;
    frame.material = model->material;
    frame.mm_per_unit = model->mm_per_unit;
    frame.width = cell->width;
    frame.height = cell->height;
    frame.samples = run->samples;
    frame.map_size = settings->map_size;
    frame.nlight = cell->lights;
    for (int i = 0; i < cell->lights; i++) {
        frame.light[i] = frame.light[0];
        dph_light_direction(150.0 + 360.0 * i / cell->lights, 30.0, frame.light[i].to_light);
        for (int c = 0; c < 3; c++)
            frame.light[i].irradiance[c] = pi / cell->lights;
    }
    return frame;
}

/* Maps the progress of one call to that of the whole run. */
struct part {
    struct progress *progress;
    double done, share;
};

static bool part_step(void *user, double fraction)
{
    const struct part *part = user;
    return progress_step(part->progress, part->done + part->share * fraction);
}

/* What is measured together: variants that are drawn from one arrangement of the vertices. */
struct group {
    int count, first; /* of the plan's variants; lambert comes on top */
    int jobs;         /* 1 + count, and with indices unshared lambert as the last */
    struct bench_view view[MAX_VARIANTS + 1];
    struct dph_renderer *renderer[MAX_VARIANTS + 1];
};

static void group_finish(struct group *group)
{
    for (int i = 0; i < group->jobs; i++) {
        dph_renderer_destroy(group->renderer[i]);
        bench_view_finish(&group->view[i]);
    }
}

/* The variant behind job i of a group. */
static const struct variant *drawn_by(const struct group *group, const struct variant *variant,
                                      int i)
{
    return i && i <= group->count ? &variant[group->first + i - 1] : &variant[0];
}

static bool group_init(struct group *group, const struct bench_model *model,
                       const struct variant *variant, int first, int count, bool indexed,
                       int copies, struct dph_error *err)
{
    *group = (struct group){.count = count, .first = first, .jobs = 1 + count + indexed};
    for (int i = 0; i < group->jobs; i++) {
        const struct dph_renderer_params params = {.unshared = !indexed || i > count};
        if (!bench_view_init(&group->view[i], model, drawn_by(group, variant, i), copies, err) ||
            !(group->renderer[i] =
                  dph_renderer_create_with(&group->view[i].scene, &params, err))) {
            group_finish(group);
            return false;
        }
    }
    return true;
}

/* Vertices in the buffers: corners where nothing is shared, and where a body is flat. */
static size_t count_vertices(const struct dph_scene *scene, bool indexed)
{
    size_t sum = 0;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_mesh *mesh = &scene->body[scene->instance[i].body].mesh;
        sum += indexed && mesh->normal ? mesh->nvert : 3 * mesh->ntri;
    }
    return sum;
}

/* Measures a group in one cell; rows go where the cell's rows begin. */
static bool measure_cell(const struct settings *settings, const struct bench_run *run,
                         const struct bench_model *model, const struct group *group,
                         const struct variant *variant, const struct cell *cell, int rounds,
                         struct part *part, struct bench_row *row, struct dph_error *err)
{
    struct dph_timing_job job[MAX_VARIANTS + 1];
    struct dph_timing timing[MAX_VARIANTS + 1];
    struct dph_timing_params params = dph_timing_defaults();
    params.seconds = run->seconds_each;
    params.rounds = rounds;
    params.progress = part_step;
    params.progress_user = part;
    for (int i = 0; i < group->jobs; i++) {
        const struct variant *drawn = drawn_by(group, variant, i);
        job[i].renderer = group->renderer[i];
        job[i].frame = frame_of(settings, run, model, &group->view[i].scene, drawn, cell);
    }
    if (!dph_renderer_measure(job, (size_t)group->jobs, &params, timing, err))
        return false;
    const double unshared = timing[cell->indexed ? group->jobs - 1 : 0].ratio;
    for (int i = 0; i <= group->count; i++) {
        int at = i ? group->first + i - 1 : 0;
        if (!i && row->timing.frames)
            continue; /* lambert of the first group stands in the tables */
        row[at] = (struct bench_row){
            .variant = variant[at],
            .cell = *cell,
            .vertices = count_vertices(&group->view[i].scene, cell->indexed),
            .timing = timing[i],
            .lambert_ms = timing[0].ms_median,
            .drift = 1.0,
            .unshared_ratio = timing[i].ratio / unshared,
        };
        if (!dph_renderer_cost(group->renderer[i], &job[i].frame, &row[at].cost, err))
            return false;
    }
    return true;
}

/* Groups are measured one after the other, and a machine that does other things is slower in one
 * than in the next. Their lamberts tell by how much: all times of a cell are brought to the fastest
 * of them, so that bars side by side say what the ratios say. */
static void level(struct bench_row *row, int count)
{
    double fastest = INFINITY;
    for (int i = 0; i < count; i++)
        fastest = fmin(fastest, row[i].lambert_ms);
    for (int i = 0; i < count; i++) {
        struct dph_timing *timing = &row[i].timing;
        double drift = row[i].drift = fastest / row[i].lambert_ms;
        timing->ms_median *= drift;
        timing->ms_p05 *= drift;
        timing->ms_p95 *= drift;
        timing->cpu_ms *= drift;
    }
}

/* Variants and cells of one part of the run: the matrix, or growth with the number of lights. */
struct plan {
    struct variant variant[MAX_VARIANTS];
    int nvariant;
    struct cell cell[CELLS]; /* those of one arrangement and number of lights are neighbours */
    int ncell;
    bool growth;
};

static int group_count(const struct plan *plan, const struct bench_model *model)
{
    const size_t each = CORNER_BYTES * 3 * model->triangles, fit = GROUP_BYTES / each;
    const int most = fit > MAX_VARIANTS ? MAX_VARIANTS : fit > GROUP_LEAST ? (int)fit : GROUP_LEAST;
    return plan->nvariant > 1 ? (plan->nvariant - 1 + most - 1) / most : 1;
}

static bool run_plan(const struct settings *settings, const struct bench_run *run,
                     const struct bench_model *model, const struct plan *plan, struct part *part,
                     struct bench_row *row, struct dph_error *err)
{
    const int groups = group_count(plan, model), rest = plan->nvariant - 1;
    for (int c = 0, next; c < plan->ncell; c = next) {
        for (next = c; next < plan->ncell && plan->cell[next].indexed == plan->cell[c].indexed;)
            next++;
        for (int g = 0; g < groups; g++) {
            /* even shares, so that no group is left with one or two */
            int first = 1 + g * rest / groups, last = 1 + (g + 1) * rest / groups;
            struct group group;
            if (!group_init(&group, model, plan->variant, first, last - first,
                            plan->cell[c].indexed, run->repeat, err))
                return false;
            bool ok = true;
            for (int i = c; i < next && ok; i++) {
                ok = measure_cell(settings, run, model, &group, plan->variant, &plan->cell[i],
                                  plan->growth ? run->growth_rounds : run->rounds, part,
                                  row + i * plan->nvariant, err);
                part->done += part->share;
            }
            group_finish(&group);
            if (!ok)
                return false;
        }
        for (int i = c; i < next; i++)
            level(row + i * plan->nvariant, plan->nvariant);
    }
    return true;
}

static void plan_matrix(struct plan *plan, const struct settings *settings, unsigned methods)
{
    static const int sizes[2][2] = {{1280, 800}, {5, 5}};
    const bool one = is_given(settings, "resolution"), given = is_given(settings, "camera");
    *plan = (struct plan){0};
    plan->nvariant = list_variants(settings, methods, false, plan->variant);
    for (int indexed = 0; indexed < 2; indexed++)
        for (int s = 0; s < (one ? 1 : 2); s++)
            for (int far = 0; far < (given ? 1 : 2); far++)
                plan->cell[plan->ncell++] =
                    (struct cell){.indexed = indexed,
                                  .far = far,
                                  .given = given,
                                  .width = one ? settings->width : sizes[s][0],
                                  .height = one ? settings->height : sizes[s][1],
                                  .lights = 1};
}

/* `brief`: with indices only. */
static void plan_growth(struct plan *plan, const struct settings *settings, unsigned methods,
                        const int *count, int ncount, bool brief)
{
    *plan = (struct plan){.growth = true};
    plan->nvariant = list_variants(settings, methods, true, plan->variant);
    for (int indexed = brief; indexed < 2; indexed++)
        for (int i = 0; i < ncount; i++)
            plan->cell[plan->ncell++] = (struct cell){.indexed = indexed,
                                                      .given = is_given(settings, "camera"),
                                                      .width = settings->width,
                                                      .height = settings->height,
                                                      .lights = count[i]};
}

/* Loads, bakes and measures one model by the plans. Returns an exit code. */
static int bench_one(struct settings *settings, const struct bench_run *run, const char *path,
                     unsigned methods, const struct plan *plan, int nplan,
                     struct bench_result *result)
{
    int code = EXIT_DONE, calls = 0;
    struct dph_error err;
    struct bench_model model;
    struct progress progress;
    const char *slash = path ? strrchr(path, '/') : NULL;
    double start = seconds_now();
    *result = (struct bench_result){0};
    snprintf(result->model, sizeof result->model, "%s",
             !path ? "candle" : slash ? slash + 1 : path);
    if (!bench_model_init(&model, settings, path, methods, &code))
        return code;
    result->triangles = model.triangles;
    result->vertices = model.vertices;
    result->shared = model.shared;
    result->seconds_bake = seconds_now() - start;
    talk(settings, "%s: baked in %.1f s", result->model, result->seconds_bake);
    for (int p = 0; p < nplan; p++) {
        result->table[result->ntable++] = (struct bench_table){
            result->nrow, plan[p].ncell, plan[p].nvariant, plan[p].growth};
        result->nrow += plan[p].ncell * plan[p].nvariant;
        calls += plan[p].ncell * group_count(&plan[p], &model);
    }
    result->row = calloc((size_t)result->nrow + 1, sizeof *result->row);
    if (!result->row) {
        complain(settings, "out of memory");
        code = EXIT_INPUT;
        goto done;
    }
    progress_begin(&progress, settings, "measuring");
    struct part part = {&progress, 0.0, 1.0 / calls};
    for (int p = 0; p < nplan; p++)
        if (!run_plan(settings, run, &model, &plan[p], &part,
                      result->row + result->table[p].first, &err)) {
            progress_end(&progress);
            code = report_error(settings, &err);
            goto done;
        }
    progress_end(&progress);
    result->seconds = seconds_now() - start;

done:
    bench_model_finish(&model);
    return code;
}

int bench_draw(struct settings *settings)
{
    static const char *const files[] = {"chart.svg", "chart.png", "lights.svg", "lights.png",
                                        "report.md", "results.json", NULL};
    int code = EXIT_DONE, count[MAX_COUNTS], ncount = 0, nplan = 0;
    unsigned methods = 0, brief = 0;
    struct dph_error err;
    const struct dph_method *method;
    struct plan plan[2];
    struct bench_run *run = calloc(1, sizeof *run);
    if (!run) {
        complain(settings, "out of memory");
        return EXIT_INPUT;
    }
    for (size_t i = 0; (method = dph_method_at(i)); i++)
        if (!method->quantity && (!settings->methods || settings->methods >> i & 1)) {
            methods |= 1U << i;
            for (size_t k = 0; k < sizeof growth_methods / sizeof *growth_methods; k++)
                brief |= strcmp(method->name, growth_methods[k]) == 0 ? 1U << i : 0U;
        }
    if (settings->lights) {
        if (!parse_counts(settings, count, &ncount)) {
            free(run);
            return EXIT_USAGE;
        }
        plan_growth(&plan[nplan++], settings, methods, count, ncount, false);
    } else {
        plan_matrix(&plan[nplan++], settings, methods);
        if (settings->output)
            plan_growth(&plan[nplan++], settings, methods & brief, growth_counts,
                        sizeof growth_counts / sizeof *growth_counts, true);
    }
    if (settings->output && !folder_possible(settings, settings->output, files)) {
        free(run);
        return EXIT_OUTPUT;
    }
    struct dph_gl *gl = dph_gl_create_headless(&err); /* before the bake */
    if (!gl) {
        free(run);
        return report_error(settings, &err);
    }
    run->gl = dph_gl_name(gl);
    cpu_name(run->cpu, sizeof run->cpu);
    run->samples = is_given(settings, "samples") ? settings->samples : 1;
    run->rounds = dph_timing_defaults().rounds;
    run->growth_rounds = run->rounds / 2; /* frames with many lights are long */
    run->seconds_each = settings->seconds;
    run->material = settings->material ? settings->material : "wax";
    run->map_size = settings->map_size;
    run->repeat = settings->repeat;
    for (int i = 1; (i < settings->ninput || i == 1) && code == EXIT_DONE; i++) {
        struct bench_result *result = &run->result[run->nresult++];
        code = bench_one(settings, run, i < settings->ninput ? settings->input[i] : NULL, methods,
                         plan, nplan, result);
        if (code == EXIT_DONE && !settings->json) {
            print_draw_tables(run, result);
            fflush(stdout);
        }
    }
    if (code == EXIT_DONE && settings->json)
        print_draw_json(run, stdout);
    if (code == EXIT_DONE && settings->output)
        code = make_folder(settings, settings->output) ? save_draw_report(settings, run)
                                                       : EXIT_OUTPUT;
    for (int i = 0; i < run->nresult; i++)
        free(run->result[i].row);
    dph_gl_destroy(gl);
    free(run);
    return code;
}
