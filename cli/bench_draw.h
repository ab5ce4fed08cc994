/* bench_draw.h - what measuring and reporting of bench draw share. */
#ifndef BENCH_DRAW_H
#define BENCH_DRAW_H

#include "cli.h"

enum { CPCA_SETTINGS = 2, MAX_COUNTS = 8, MAX_VARIANTS = 64 };

/* What is drawn: a method with its parameters. */
struct variant {
    const struct dph_method *method;
    int bands;     /* shsss, response: stored and drawn; prt: of transfer vectors; else 0        */
    bool chosen;   /* shsss: bands are chosen by camera and light (--use-bands auto)   */
    int store;     /* enum dph_store; -1: nothing is stored a vertex                   */
    int form;      /* response: enum dph_response_form; else 0                         */
    int setting;   /* prt-cpca: number of the setting; else 0                          */
    int clusters, vectors; /* prt-cpca: as asked for; else 0                           */
};

/* Where it is drawn. */
struct cell {
    bool indexed, far, given; /* the camera: near, far, or that of --camera */
    int width, height, lights;
};

/* One measurement. */
struct bench_row {
    struct variant variant;
    struct cell cell;
    size_t vertices; /* in the buffers, all copies */
    struct dph_timing timing; /* its ratio is to lambert in the same cell; times are scaled by `drift` */
    double lambert_ms;        /* of the group's own lambert, as measured */
    double drift;             /* what brings the group's times to the cell's fastest lambert, <= 1 */
    double unshared_ratio;    /* to lambert with unshared vertices, else in the same cell */
    struct dph_cost cost;
};

/* Cells with the same variants: rows first + cell * nvariant + variant, lambert is variant 0. */
struct bench_table {
    int first, ncell, nvariant;
    bool growth; /* with the number of lights, not the matrix */
};

/* All measurements of a model. */
struct bench_result {
    char model[128];
    size_t triangles, vertices, shared; /* vertices of the file, and those that differ */
    double seconds_bake, seconds;
    struct bench_row *row; /* (nrow) */
    int nrow;
    struct bench_table table[2];
    int ntable;
};

/* What a run says once. */
struct bench_run {
    const char *gl;  /* driver */
    char cpu[128];
    int samples, rounds, growth_rounds;
    double seconds_each;
    const char *material;
    int map_size, repeat;
    int nresult;
    struct bench_result result[MAX_INPUTS];
};

/* A name for people: "shsss, 36 snorm8". */
void variant_label(const struct variant *variant, char label[48]);
/* "1280x800, near, unshared". */
void cell_label(const struct cell *cell, char label[64]);
/* "near", "far" or "given". */
const char *camera_label(const struct cell *cell);

/* bench_model.c */
/* The settings of prt-cpca: that of the DirectX sample, and a clustered one. */
extern const int cpca_setting[CPCA_SETTINGS][2]; /* clusters, vectors */

/* A model with everything that drawing it by `methods` needs, baked once. */
struct bench_model {
    struct dph_scene *scene;  /* equal vertices are shared; nothing is baked into its bodies but
                               * rivals without clusters                                        */
    struct dph_material material;
    double mm_per_unit;
    size_t triangles, vertices, shared; /* as in struct bench_result                           */
    int bands;                          /* of the coefficients                                 */
    float **coefficient;                /* (nbody) each (nvert x bands * bands)                */
    struct dph_cpca **cpca[CPCA_SETTINGS]; /* (nbody) each                                     */
};
/* `path` NULL: the candle. False: complained, *code is the exit code. */
bool bench_model_init(struct bench_model *model, struct settings *settings, const char *path,
                      unsigned methods, int *code);
void bench_model_finish(struct bench_model *model);

/* A model as one variant draws it: with coefficients of its bands and type, or its clusters, and so
 * many copies side by side. Points into the model. */
struct bench_view {
    struct dph_scene scene;
    struct dph_rivals *rivals; /* (nbody) */
};
bool bench_view_init(struct bench_view *view, const struct bench_model *model,
                     const struct variant *variant, int copies, struct dph_error *err);
void bench_view_finish(struct bench_view *view);

/* bench_report.c */
void print_draw_tables(const struct bench_run *run, const struct bench_result *result);
void print_draw_json(const struct bench_run *run, FILE *stream);

/* bench_markdown.c */
/* Writes charts, report.md and results.json into settings->output, a folder. Returns an exit
 * code. */
int save_draw_report(const struct settings *settings, const struct bench_run *run);
/* Whether a variant stands in the charts: of shsss, 4 and 36 coefficients in the type of fewest
 * bytes. */
bool in_chart(const struct variant *variant);

/* bench_findings.c */
/* Writes what the matrix of a model says as sentences, as Markdown. */
void write_findings(FILE *stream, const struct bench_result *result,
                    const struct bench_table *table);

#endif
