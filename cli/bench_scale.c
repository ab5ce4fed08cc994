/* How the bake's cost grows: closed meshes of chosen size, each baked in a process of its own, so
 * that the kernel's peak of its memory is that of this bake alone. The mesh is a sphere with waves
 * on it: a cube of n x n cells a face blown up, 12 n^2 triangles of similar size. */
#define _DEFAULT_SOURCE
#include "cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* What the child sends back through the pipe. */
struct outcome {
    struct dph_scene_bake_report report;
    double seconds;
    int code;
};

/* The point of the wavy sphere over a point of the cube's surface. */
static void blow_up(const double cube[3], float position[3])
{
    double length = sqrt(cube[0] * cube[0] + cube[1] * cube[1] + cube[2] * cube[2]);
    double x = cube[0] / length, y = cube[1] / length, z = cube[2] / length;
    double r = 1.0 + 0.08 * sin(7.0 * x + 1.0) * sin(6.0 * y) * sin(8.0 * z + 2.0) +
               0.03 * sin(19.0 * x) * sin(23.0 * y + z);
    position[0] = (float)(r * x);
    position[1] = (float)(r * y);
    position[2] = (float)(r * z);
}

/* Vertices on the cube's edges are repeated by each face with the same coordinates, so that
 * welding closes the mesh. */
static bool make_mesh(struct dph_mesh *mesh, int triangles, struct dph_error *err)
{
    size_t n = (size_t)lround(sqrt(triangles / 12.0));
    n = n < 1 ? 1 : n;
    size_t row = n + 1, face = row * row;
    if (!dph_mesh_init(mesh, 6 * face, 12 * n * n, false, false, err))
        return false;
    uint32_t *index = mesh->index;
    for (size_t f = 0; f < 6; f++) {
        size_t axis = f / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        double side = f % 2 ? 1.0 : -1.0;
        for (size_t j = 0; j <= n; j++)
            for (size_t i = 0; i <= n; i++) {
                double cube[3];
                cube[axis] = side;
                cube[u] = (2.0 * (double)i - (double)n) / (double)n;
                cube[v] = (2.0 * (double)j - (double)n) / (double)n;
                blow_up(cube, mesh->position + 3 * (f * face + j * row + i));
            }
        for (size_t j = 0; j < n; j++)
            for (size_t i = 0; i < n; i++) {
                uint32_t a = (uint32_t)(f * face + j * row + i), b = a + 1,
                         c = a + (uint32_t)row + 1, d = c - 1;
                const uint32_t out[6] = {a, b, c, a, c, d}, in[6] = {a, c, b, a, d, c};
                memcpy(index, f % 2 ? out : in, sizeof out);
                index += 6;
            }
    }
    return true;
}

static void bake_in_child(const struct settings *settings, int triangles, struct outcome *outcome)
{
    struct dph_error err;
    struct dph_mesh mesh = {0};
    struct dph_scene *scene = NULL;
    struct dph_scene_bake_params params = dph_scene_bake_defaults();
    params.bake = settings->bake;
    params.bake.threads = settings->threads;
    if (!make_mesh(&mesh, triangles, &err) ||
        !(scene = dph_scene_from_mesh(&mesh, "made up", &err)))
        goto error;
    double start = seconds_now();
    if (!dph_scene_bake(scene, &params, &outcome->report, &err))
        goto error;
    outcome->seconds = seconds_now() - start;
    dph_scene_destroy(scene);
    return;

error:
    outcome->code = report_error(settings, &err);
    dph_mesh_finish(&mesh);
    dph_scene_destroy(scene);
}

/* Bakes in a child and waits for it; `peak` receives its largest memory in bytes. Returns an exit
 * code. */
static int bake_apart(const struct settings *settings, int triangles, struct outcome *outcome,
                      double *peak)
{
    int ends[2], status;
    struct rusage usage;
    *outcome = (struct outcome){.code = EXIT_CAPABILITY};
    fflush(stdout);
    if (pipe(ends)) {
        complain(settings, "no pipe to be had");
        return EXIT_CAPABILITY;
    }
    pid_t child = fork();
    if (child < 0) {
        complain(settings, "no process to be had");
        close(ends[0]);
        close(ends[1]);
        return EXIT_CAPABILITY;
    }
    if (child == 0) {
        close(ends[0]);
        outcome->code = EXIT_DONE;
        bake_in_child(settings, triangles, outcome);
        bool sent = write(ends[1], outcome, sizeof *outcome) == (ssize_t)sizeof *outcome;
        _exit(sent ? 0 : 1);
    }
    close(ends[1]);
    bool got = read(ends[0], outcome, sizeof *outcome) == (ssize_t)sizeof *outcome;
    close(ends[0]);
    if (wait4(child, &status, 0, &usage) < 0 || !got || status) {
        complain(settings, "the bake of %d triangles died, likely for want of memory", triangles);
        return EXIT_INPUT;
    }
    *peak = 1024.0 * (double)usage.ru_maxrss; /* Linux counts in KiB */
    return outcome->code;
}

int bench_scale(const struct settings *settings, struct json *json)
{
    if (!json)
        printf("\nmade-up closed meshes, whole bake, fit %s\n"
               "  triangles  positions  threads  seconds    sweep  project  sweep M pairs/s  us a "
               "triangle  peak MiB\n",
               dph_fit_name(settings->bake.fit));
    for (int i = 0; i < settings->nsize; i++) {
        struct outcome outcome;
        double peak = 0.0;
        int code = bake_apart(settings, settings->size[i], &outcome, &peak);
        if (code != EXIT_DONE)
            return code;
        const struct dph_scene_bake_report *report = &outcome.report;
        double pairs = (double)report->positions * report->directions / report->seconds_sweep;
        if (!json) {
            printf("  %9zu  %9zu  %7d  %7.2f  %7.2f  %7.2f  %15.2f  %13.2f  %8.0f\n",
                   report->triangles, report->positions, report->threads, outcome.seconds,
                   report->seconds_sweep, report->seconds_project, 1e-6 * pairs,
                   1e6 * outcome.seconds / (double)report->triangles, peak / 1048576.0);
            continue;
        }
        emit_object(json, NULL);
        emit_text(json, "model", "made up");
        emit_count(json, "triangles", report->triangles);
        emit_count(json, "positions", report->positions);
        emit_count(json, "directions", (size_t)report->directions);
        emit_count(json, "threads", (size_t)report->threads);
        emit_text(json, "engine", "sweep");
        emit_text(json, "thickness", dph_definition_name(settings->bake.definition));
        emit_text(json, "fit", dph_fit_name(settings->bake.fit));
        emit_number(json, "pairs_per_second", pairs);
        emit_number(json, "seconds", outcome.seconds);
        emit_number(json, "peak_bytes", peak);
        emit_close(json, '}');
    }
    return EXIT_DONE;
}
