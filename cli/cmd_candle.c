/* diaphan candle: writes the procedural candle in the format of the ending. */
#include "cli.h"

static const char *const takes[] = {"output", NULL};

static int run(struct settings *settings)
{
    struct dph_error err;
    struct dph_mesh mesh = {0};
    struct dph_scene *scene = NULL;
    int code = EXIT_DONE;
    const char *path = settings->output;
    if (!has_ending(path, ".glb") && !has_ending(path, ".obj") && !has_ending(path, ".ply") &&
        !has_ending(path, ".stl")) {
        complain(settings, "%s: the ending says the format, .glb, .obj, .ply or .stl", path);
        return EXIT_USAGE;
    }
    if (!output_possible(settings, path))
        return EXIT_OUTPUT;
    if (!dph_mesh_init_candle(&mesh, &err))
        return report_error(settings, &err);
    size_t ntri = mesh.ntri, nvert = mesh.nvert;
    if (!(scene = dph_scene_from_mesh(&mesh, "candle", &err)) ||
        !dph_scene_save(scene, path, &err)) {
        code = report_error(settings, &err);
        goto error;
    }
    if (settings->json) {
        struct json json;
        emit_begin(&json, stdout);
        emit_text(&json, "output", path);
        emit_count(&json, "triangles", ntri);
        emit_count(&json, "vertices", nvert);
        emit_end(&json);
    } else if (!settings->quiet) {
        char triangles[32], vertices[32];
        printf("wrote %s: %s triangles, %s vertices\n", path, with_commas(ntri, triangles),
               with_commas(nvert, vertices));
    }

error:
    dph_mesh_finish(&mesh);
    dph_scene_destroy(scene);
    return code;
}

const struct command command_candle = {
    .name = "candle",
    .summary = "write the candle mesh",
    .usage = "-o OUTPUT",
    .examples = "  diaphan candle -o candle.glb\n"
                "  diaphan candle -o candle.obj\n",
    .notes = "A closed body of 59,704 triangles with unshared vertices, 179,112 of them, two units "
             "tall: the shape of the\n"
             "paper's measurements. The ending says the format: .glb, .obj, .ply or .stl.\n",
    .options = takes,
    .min_inputs = 0,
    .max_inputs = 0,
    .wants_output = true,
    .run = run,
};
