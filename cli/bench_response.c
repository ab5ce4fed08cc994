/* diaphan bench response: what the response bake costs for a stated noise, and whether it is right
 * about that noise; and what it costs to find what an eye sees over the average, for the root form.
 *
 * The bake adds walks until its own estimate of the noise is low enough. With --check N every bake
 * is followed by one of N times the walks, with another seed and without smoothing, so that nothing
 * that smoothing distorts is in it. Both errors are independent, so with a the first, b the second
 * bake and |.|^2 the sum over positions (by area), channels and coefficients of the first 6 bands,
 *
 *     found^2 = |a - b|^2 / |b|^2 - noise(b)^2
 *
 * is to be what the first bake told of itself. noise(b) comes from the scatter of b's passes. */
#include "cli.h"

#include <diaphan/response_bake.h>

#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Materials without --material, each in the size without --size-mm. */
static const struct standard {
    const char *material;
    double size_mm;
} standard[] = {{"wax", 20}, {"marble", 50}};
enum { STANDARDS = sizeof standard / sizeof standard[0] };
static const double OTHER_SIZE = 20;

enum { CHECKED_BANDS = 6 }; /* of the noise that the bake reports */

/* What one bake came to. */
struct row {
    const char *model;
    const struct dph_mesh *mesh;
    struct dph_material material;
    double size_mm, mm_per_unit;
    struct dph_response_bake_report told, check;
    double seconds, check_seconds;
    double cpu_seconds; /* of all threads: threads times seconds on a quiet machine, or less */
    double view_seconds; /* of the form and the fit of views                                  */
    double found; /* NaN without --check */
};

static double walks_each(const struct dph_response_bake_report *report)
{
    return report->positions ? report->walks / (double)report->positions : 0;
}

/* |a - b|^2 / |b|^2 over the bands that are checked. */
static double distance(const struct dph_transfer *a, const struct dph_transfer *b)
{
    size_t ncoef = (size_t)(b->bands * b->bands), checked = CHECKED_BANDS * CHECKED_BANDS;
    double apart = 0, all = 0;
    checked = checked < ncoef ? checked : ncoef;
    for (size_t p = 0; p < b->npos; p++) {
        double difference = 0, square = 0;
        for (size_t c = 0; c < (size_t)b->channels; c++) {
            const float *x = a->vector + p * a->length + c * ncoef;
            const float *y = b->vector + p * b->length + c * ncoef;
            for (size_t i = 0; i < checked; i++) {
                double d = (double)x[i] - (double)y[i];
                difference += d * d;
                square += (double)y[i] * (double)y[i];
            }
        }
        apart += (double)b->area[p] * difference;
        all += (double)b->area[p] * square;
    }
    return all > 0 ? apart / all : 0;
}

static bool bake(const struct settings *settings, const struct row *row, const char *what,
                 struct dph_response_bake_params *params, struct dph_transfer *transfer,
                 struct dph_response_bake_report *report, double *seconds, struct dph_error *err)
{
    const struct dph_mesh *mesh = row->mesh;
    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct progress progress;
    char label[128];
    snprintf(label, sizeof label, "%s, %s, %g mm%s", row->model, row->material.name, row->size_mm,
             what);
    progress_begin(&progress, settings, label);
    params->progress = progress_step;
    params->progress_user = &progress;
    double start = seconds_now();
    bool ok = dph_response_bake(&input, params, transfer, report, err);
    *seconds = seconds_now() - start;
    progress_end(&progress);
    return ok;
}

/* What follows the bake in dph_scene_bake_response: the form, and what an eye sees of it. */
static bool fit_views(const struct settings *settings, struct row *row,
                      const struct dph_transfer *transfer, struct dph_response_bake_params *params,
                      struct dph_error *err)
{
    const struct dph_mesh *mesh = row->mesh;
    struct dph_bake_input input = {mesh->position, 0, mesh->nvert, mesh->index, mesh->ntri};
    struct dph_response_params form = dph_response_defaults();
    struct progress progress;
    form.threads = settings->threads;
    progress_begin(&progress, settings, "views");
    params->progress_user = &progress;
    double start = seconds_now();
    struct dph_response *response = dph_response_create(transfer, &form, NULL, err);
    bool ok = response && dph_response_view_fit(&input, params, response, &response->view, err);
    row->view_seconds = seconds_now() - start;
    progress_end(&progress);
    dph_response_destroy(response);
    return ok;
}

/* Bakes as dph_scene_bake_response does, and once more for the check. */
static bool measure(const struct settings *settings, struct row *row, struct dph_error *err)
{
    struct dph_response_bake_params params = dph_response_bake_defaults();
    struct dph_transfer rough = {0}, fine = {0};
    struct dph_medium medium;
    bool ok = false;
    dph_material_medium(&row->material, &medium);
    for (int c = 0; c < 3; c++) {
        params.scattering[c] = medium.reduced_scattering[c] * row->mm_per_unit;
        params.absorption[c] = row->material.absorption[c] * row->mm_per_unit;
    }
    params.straight = false;
    params.noise = settings->noise;
    params.seed = (uint64_t)settings->seed;
    params.threads = settings->threads;
    row->found = NAN;
    clock_t begin = clock();
    if (!bake(settings, row, "", &params, &rough, &row->told, &row->seconds, err))
        goto error;
    row->cpu_seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    if (!fit_views(settings, row, &rough, &params, err))
        goto error;
    if (settings->check) {
        params.noise = 0;
        params.smooth = false;
        params.most_walks = fmin(1e9, fmax(1, settings->check * walks_each(&row->told)));
        params.seed++;
        if (!bake(settings, row, ", check", &params, &fine, &row->check, &row->check_seconds, err))
            goto error;
        double own = row->check.noise_walks;
        row->found = sqrt(fmax(0, distance(&rough, &fine) - own * own));
    }
    ok = true;

error:
    dph_transfer_finish(&rough);
    dph_transfer_finish(&fine);
    return ok;
}

static void print_head(const struct settings *settings)
{
    printf("\nmodel            positions  material  size mm  threads  seconds  CPU seconds  "
           "views: seconds  walks/position  noise of walks  noise told  reached");
    if (settings->check)
        printf("  noise found  found/told  check: walks/position   noise  seconds");
    printf("\n");
    fflush(stdout);
}

static void print_row(const struct settings *settings, const struct row *row)
{
    const struct dph_response_bake_report *told = &row->told;
    printf("%-15s  %9zu  %-8s  %7g  %7d  %7.1f  %11.1f  %14.1f  %14.0f  %14.4f  %10.4f  %7s",
           row->model, told->positions, row->material.name, row->size_mm, told->threads,
           row->seconds, row->cpu_seconds, row->view_seconds, walks_each(told), told->noise_walks, told->noise,
           told->reached ? "yes" : "no");
    if (settings->check)
        printf("  %11.4f  %10.2f  %21.0f  %6.4f  %7.1f", row->found, row->found / told->noise,
               walks_each(&row->check), row->check.noise_walks, row->check_seconds);
    printf("\n");
    fflush(stdout);
}

static void emit_row(struct json *json, const struct settings *settings, const struct row *row)
{
    const struct dph_response_bake_report *told = &row->told;
    emit_object(json, NULL);
    emit_text(json, "model", row->model);
    emit_count(json, "triangles", row->mesh->ntri);
    emit_count(json, "positions", told->positions);
    emit_text(json, "material", row->material.name);
    emit_number(json, "size_mm", row->size_mm);
    emit_number(json, "mm_per_unit", row->mm_per_unit);
    emit_count(json, "threads", (size_t)told->threads);
    emit_number(json, "seconds", row->seconds);
    emit_number(json, "cpu_seconds", row->cpu_seconds);
    emit_number(json, "view_seconds", row->view_seconds);
    emit_number(json, "walks_per_position", walks_each(told));
    emit_number(json, "noise_walks", told->noise_walks);
    emit_number(json, "noise", told->noise);
    emit_bool(json, "noise_reached", told->reached);
    if (settings->check) {
        emit_number(json, "noise_found", row->found);
        emit_number(json, "check_walks_per_position", walks_each(&row->check));
        emit_number(json, "check_noise", row->check.noise_walks);
        emit_number(json, "check_seconds", row->check_seconds);
    }
    emit_close(json, '}');
}

/* All materials in one body, the largest, which is taken by itself: its own largest side is what
 * --size-mm says. */
static int bench_model(const struct settings *settings, const char *name, struct dph_mesh *mesh,
                       struct json *json)
{
    struct dph_error err;
    struct dph_scene *scene = dph_scene_from_mesh(mesh, name, &err);
    int code = EXIT_DONE, cases = settings->nmaterial ? settings->nmaterial : (int)STANDARDS;
    if (!scene)
        return report_error(settings, &err);
    for (int i = 0; i < cases && code == EXIT_DONE; i++) {
        struct settings one = *settings;
        struct row row = {.model = name, .mesh = &scene->body[0].mesh};
        one.material = settings->nmaterial ? settings->materials[i] : standard[i].material;
        if (!load_material(&one, NULL, &row.material, &code))
            break;
        row.size_mm = OTHER_SIZE;
        for (int k = 0; k < STANDARDS; k++)
            if (strcmp(one.material, standard[k].material) == 0)
                row.size_mm = standard[k].size_mm;
        if (settings->size_mm > 0)
            row.size_mm = settings->size_mm;
        row.mm_per_unit = dph_scene_millimetres(scene, row.size_mm);
        if (!measure(settings, &row, &err))
            code = report_error(settings, &err);
        else if (json)
            emit_row(json, settings, &row);
        else
            print_row(settings, &row);
    }
    dph_scene_destroy(scene);
    return code;
}

int bench_response(const struct settings *settings, struct json *json)
{
    int code = EXIT_DONE;
    for (int i = 0; i < settings->nmaterial; i++) { /* a bad name shows before the first bake */
        struct dph_material material;
        struct settings one = *settings;
        one.material = settings->materials[i];
        if (!load_material(&one, NULL, &material, &code))
            return code;
    }
    if (!json)
        print_head(settings);
    for (int i = 1; i < settings->ninput && code == EXIT_DONE; i++)
        code = bench_file(settings, settings->input[i], bench_model, json);
    if (settings->ninput > 1)
        return code;
    if (access(bench_bunny, R_OK) == 0)
        return bench_file(settings, bench_bunny, bench_model, json);
    return bench_candle(settings, bench_model, json);
}
