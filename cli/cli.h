/* cli.h - what the commands of the tool share. The tool is an ordinary consumer of the public
 * headers.
 *
 * A command is a row of the table in main.c: its texts, the names of the options it takes, and a
 * function. Options are rows of the table in options.c, which drives both parsing and help; a new
 * option is a row and a field of struct settings. */
#ifndef CLI_H
#define CLI_H

#include <diaphan/diaphan.h>
#include <diaphan/render.h>
#include <diaphan/response_scene.h>
#include <diaphan/rivals.h>

#include <stdio.h>

/* Exit codes; scripts rely on them. */
enum {
    EXIT_DONE = 0,
    EXIT_USAGE = 1,
    EXIT_INPUT = 2,
    EXIT_CAPABILITY = 3,
    EXIT_OUTPUT = 4,
    EXIT_TOLERANCE = 5,
    EXIT_CANCELLED = 130, /* by Ctrl-C, as shells number it */
};

enum { MAX_INPUTS = 256, MAX_SIZES = 16, MAX_MATERIALS = 16 };

/* Everything that options set, with their defaults from settings_init. */
struct settings {
    const struct command *command;
    int nword;
    char **word; /* (nword) of the command line, for the record */
    int ninput;
    const char *input[MAX_INPUTS];
    const char *output;
    bool help, version, quiet, verbose, json;
    int threads; /* 0: all */

    struct dph_bake_params bake;
    enum dph_store store;
    struct dph_cpca_params cpca; /* clusters and vectors */
    bool compression;            /* info */
    unsigned products;           /* --for, of enum dph_product: what those methods need */
    enum dph_response_form response_form;
    int response_bytes;          /* preset; 0: not given */
    double noise;                /* of the response's bake */
    double size_mm; /* 0: not given */

    const char *material;             /* the last one; NULL: not given */
    int nmaterial;
    const char *materials[MAX_MATERIALS]; /* where several are taken */
    double specular, rim, ambient;    /* NaN: the material's */
    int formula;                      /* -1: the material's */
    const struct dph_method *method;
    unsigned methods;   /* of several: a bit for each number in the table; 0: all */
    const char *lights; /* what --lights says; NULL: not given */
    bool reference; /* the path tracer instead of a method of the table */
    int boundary, spp, seed; /* of the reference; the first is enum dph_boundary */
    struct dph_camera camera;
    int nlight; /* 0: none given */
    struct dph_light light[DPH_MAX_LIGHTS];
    const char *environment; /* NULL: none */
    double light_angle; /* degrees, of the distant ones */
    int map_size;
    double blur_mm; /* negative: the material's */
    double exposure;
    double background[3];
    int width, height;
    int use_bands; /* 0: all; DPH_BANDS_AUTO */
    enum dph_window window;
    int samples;

    double max_flip, min_psnr; /* compare; infinite: not given */
    bool study;
    bool view_averaged;

    double seconds; /* bench: a measurement at least */
    int repeat;     /* bench draw: copies of the mesh */
    int check;      /* bench response: times the walks of the bake to check by; 0: none */
    int nsize;
    int size[MAX_SIZES]; /* bench bake: triangles of made-up meshes */

    uint64_t given[2]; /* a bit an option that was given, see is_given */
};

struct command {
    const char *name;
    const char *summary;          /* one line */
    const char *usage;            /* what follows "diaphan NAME" */
    const char *examples;         /* whole lines */
    const char *notes;            /* whole lines, Nullable */
    const char *const *options;   /* names, NULL at the end; the common ones come on top */
    int min_inputs, max_inputs;
    bool wants_output;
    int (*run)(struct settings *settings); /* returns an exit code */
};

extern const struct command command_bake, command_bench, command_candle, command_compare,
    command_fit, command_info, command_render;

/* arguments.c */
void settings_init(struct settings *settings, const struct command *command);
/* Parses argv[first..argc - 1]; complains and returns false. */
bool settings_parse(struct settings *settings, int argc, char **argv, int first);
/* Whether the user gave the option, for those whose default depends on the rest. */
bool is_given(const struct settings *settings, const char *name);
void print_command_help(const struct command *command);
/* The nearest of names to a misspelt one, NULL where none is near. `name_at` gives NULL beyond the
 * last. */
const char *nearest_name(const char *word, const char *(*name_at)(size_t i, const void *user),
                         const void *user);

/* report.c */
/* One line on stderr, "diaphan COMMAND: ...". */
void complain(const struct settings *settings, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* The same with "warning: ", nothing with -q. */
void warn(const struct settings *settings, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* With -v only. */
void talk(const struct settings *settings, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Complains about a failure of the library and returns the exit code that fits it. */
int report_error(const struct settings *settings, const struct dph_error *err);
/* Passes on the scene's warnings from number `first` on. */
void report_warnings(const struct settings *settings, const struct dph_scene *scene, size_t first);
/* Flushes stdout; EXIT_OUTPUT where what was written there did not arrive, else `code`. */
int finish_stdout(const struct settings *settings, int code);
double seconds_now(void);
/* 12345678 as "12,345,678"; the buffer is the caller's. */
const char *with_commas(size_t number, char buffer[32]);
bool has_ending(const char *path, const char *ending);
/* False, with a complaint, where an output cannot be written at `path`: found out before hours of
 * work, not after. */
bool output_possible(const struct settings *settings, const char *path);
/* The same for a folder that is there or is to be made, and the names of its files (NULL after the
 * last). */
bool folder_possible(const struct settings *settings, const char *path, const char *const *file);
/* Makes a folder where there is none; checked by folder_possible. False: complained. */
bool make_folder(const struct settings *settings, const char *path);

/* json.c (named emit_, since jansson has taken json_): one object on stdout, valid whatever
 * happens to the numbers (what is not finite becomes null). */
struct json {
    FILE *stream;
    int depth;
    bool first[16];
};
void emit_begin(struct json *json, FILE *stream);
void emit_end(struct json *json);
/* `key` is NULL inside arrays. */
void emit_object(struct json *json, const char *key);
void emit_array(struct json *json, const char *key);
void emit_close(struct json *json, char bracket);
void emit_text(struct json *json, const char *key, const char *value); /* NULL gives null */
void emit_count(struct json *json, const char *key, size_t value);
void emit_number(struct json *json, const char *key, double value);
void emit_bool(struct json *json, const char *key, bool value);
void emit_triple(struct json *json, const char *key, const double value[3]); /* an array */

/* progress.c: a bar on stderr, on a terminal only and not with -q or --json. */
struct progress {
    bool shown;
    const char *label;
    double start, last;
};
void progress_begin(struct progress *progress, const struct settings *settings, const char *label);
bool progress_step(void *progress, double fraction); /* a dph_progress */
void progress_end(struct progress *progress);

/* interrupt.c: Ctrl-C is noted between the two instead of ending the program; no nesting */
void interrupt_begin(void);
bool interrupt_noted(void); /* since the last call */
void interrupt_end(void);

/* compression.c */
/* What a vertex and a scene's tables take, of the body that takes most; sums of tables. */
struct storage {
    size_t payload, fetched, shared; /* see thickness.h */
};
struct storage measure_storage(const struct dph_scene *scene);
struct storage cpca_storage(const struct dph_cpca *cpca);
/* Bakes with either fit and shows the error of every way to store the coefficients, as rows of
 * `json` or, where that is NULL, a table. False: complained, *code is the exit code. */
bool show_compression(const struct settings *settings, struct dph_scene *scene, struct json *json,
                      int *code);

/* What a stored product of the scene takes. */
struct storage measure_product(const struct dph_scene *scene, enum dph_product product);
/* The name under which figures and files have a product. */
const char *product_name(enum dph_product product);

/* compression_transfer.c: the same for transfer vectors (--for prt) in --material. */
bool show_transfer_compression(const struct settings *settings, struct dph_scene *scene,
                               struct json *json, int *code);

/* bench_scale.c */
/* Bakes made-up meshes of settings->size triangles; rows to `json` or, where that is NULL, a
 * table. Returns an exit code. */
int bench_scale(const struct settings *settings, struct json *json);

/* bench_response.c */
/* Measures the response bake, of settings->input[1] and on; rows to `json` or, where that is NULL,
 * a table. Returns an exit code. */
int bench_response(const struct settings *settings, struct json *json);

/* cmd_bench.c */
extern const char *const bench_bunny; /* where glmark2-data has it */
/* Measures one model, which it may empty; rows as above. Returns an exit code. */
typedef int bench_mesh(const struct settings *settings, const char *name, struct dph_mesh *mesh,
                       struct json *json);
/* Of a file the body with most triangles, or the candle. */
int bench_file(const struct settings *settings, const char *path, bench_mesh *one,
               struct json *json);
int bench_candle(const struct settings *settings, bench_mesh *one, struct json *json);

/* bench_draw.c */
/* Measures drawing, of settings->input[1] and on. Returns an exit code. */
int bench_draw(struct settings *settings);
/* The processor's name as the system has it. */
void cpu_name(char *name, size_t size);

/* prepare.c */
/* Loads the scene, passes on its warnings. NULL: complained, *code is the exit code. */
struct dph_scene *load_scene(const struct settings *settings, const char *path, int *code);
/* Loads the material of --material, or `fallback`, with what --specular and the like change. */
bool load_material(const struct settings *settings, const char *fallback,
                   struct dph_material *material, int *code);
/* Bakes with a progress bar and passes on the warnings that this brings. False: complained, *code
 * is the exit code. */
bool bake_scene(const struct settings *settings, struct dph_scene *scene, bool missing_only,
                struct dph_scene_bake_report *report, int *code);

/* Bakes products (rivals.h) besides thickness for a material, if there are any in `products`. */
bool bake_rivals(const struct settings *settings, struct dph_scene *scene,
                 const struct dph_material *material, unsigned products,
                 struct dph_rivals_report *report, int *code);
/* What the options say of each bake, without a material. */
struct dph_scene_bake_params thickness_params(const struct settings *settings);
struct dph_rivals_params rivals_params(const struct settings *settings);
struct dph_scene_response_params response_params(const struct settings *settings);
/* How --response-form, --bytes, --bands and --store want the response. */
struct dph_response_params response_form(const struct settings *settings);
/* Bakes the response, if it is in `products`, to --noise. */
bool bake_response(const struct settings *settings, struct dph_scene *scene,
                   const struct dph_material *material, unsigned products,
                   struct dph_scene_response_report *report, int *code);
/* Reads --env, where it is given, into the frame. */
bool load_environment(const struct settings *settings, struct dph_frame *frame, int *code);

/* reference.c */
/* Traces the picture of --method reference. Returns an exit code. */
int render_reference(const struct settings *settings, const struct dph_material *material);

/* compare_methods.c: diaphan compare INPUT */
struct dph_comparison;
struct dph_judge_params;
int compare_methods(const struct settings *settings);
/* compare_figures.c: comparison.png and report.html in the output's folder. An exit code. */
int compare_figures(const struct settings *settings, const struct dph_comparison *comparison);
/* The command line as a shell would read it back. free() it; NULL: out of memory. */
char *command_text(const struct settings *settings);
/* What the options say, but for methods, materials and lights. */
void judge_params(const struct settings *settings, struct dph_judge_params *params);

/* compare_json.c: the figures as one JSON object. */
void emit_comparison(FILE *stream, const struct settings *settings,
                     const struct dph_comparison *comparison);

#endif
