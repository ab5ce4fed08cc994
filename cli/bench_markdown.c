/* The folder of bench draw -o: charts in the manner of the paper's figure 4, a report, and the
 * figures as they go to --json. */
#define _POSIX_C_SOURCE 200809L
#include "bench_draw.h"
#include "chart.h"
#include "commit.h"
#include "text.h"

#include <diaphan/file.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool in_chart(const struct variant *variant)
{
    return !variant->method->needs_thickness || variant->chosen ||
           (variant->store == DPH_STORE_SNORM8 &&
            (variant->bands == 2 || variant->bands == DPH_DRAW_BANDS));
}

/* Text from outside in a line of Markdown. */
static void write_text(FILE *stream, const char *text)
{
    char *clean = text_clean(text);
    for (const char *c = clean ? clean : "?"; *c; c++) {
        if (strchr("\\`*_{}[]<>#|", *c))
            putc('\\', stream);
        putc(*c, stream);
    }
    free(clean);
}

/* "chart.svg", of the second model and those that follow "2-chart.svg". */
static void file_name(const struct bench_run *run, const struct bench_result *result,
                      const char *name, char path[64])
{
    int number = (int)(result - run->result);
    if (number)
        snprintf(path, 64, "%d-%s", number + 1, name);
    else
        snprintf(path, 64, "%s", name);
}

/* Frames a second of a table's cells, a panel each without and with indices. */
static bool save_chart(const struct settings *settings, const struct bench_run *run,
                       const struct bench_result *result, const struct bench_table *table,
                       const char *ending, struct dph_error *err)
{
    enum { MOST_GROUPS = 16 };
    struct chart_series series[MAX_VARIANTS];
    const struct bench_row *rows = result->row + table->first;
    char labels[MAX_VARIANTS][48], groups[MOST_GROUPS][48], subtitle[320], foot[512], file[32],
        name[64], path[4096], a[32];
    const char *group[MOST_GROUPS], *panel[2];
    int number[MAX_VARIANTS];
    struct chart chart = {.title = table->growth ? "Drawing with more lights" : "Speed of drawing",
                          .subtitle = subtitle,
                          .axis = "frames a second",
                          .ratio = "1.25×: milliseconds over those of lambert",
                          .foot = foot,
                          .panel = panel,
                          .group = group,
                          .series = series};
    for (int i = 0; i < table->nvariant; i++)
        if (in_chart(&rows[i].variant)) {
            variant_label(&rows[i].variant, labels[i]);
            number[chart.nseries] = i;
            series[chart.nseries++] =
                (struct chart_series){rows[i].variant.method->name, labels[i]};
        }
    for (int c = 0; c < table->ncell; c++) {
        const struct cell *cell = &rows[c * table->nvariant].cell;
        if (!c || cell->indexed != rows[(c - 1) * table->nvariant].cell.indexed)
            panel[chart.npanel++] =
                cell->indexed ? "shared vertices, indexed" : "unshared vertices";
        if (chart.npanel > 1 || chart.ngroup == MOST_GROUPS)
            continue;
        if (table->growth)
            snprintf(groups[chart.ngroup], 48, "%d light%s", cell->lights,
                     cell->lights > 1 ? "s" : "");
        else
            snprintf(groups[chart.ngroup], 48, "%d x %d, %s", cell->width, cell->height,
                     camera_label(cell));
        group[chart.ngroup] = groups[chart.ngroup];
        chart.ngroup++;
    }
    struct chart_value *value =
        calloc((size_t)(chart.npanel * chart.ngroup * chart.nseries), sizeof *value);
    if (!value) {
        *err = (struct dph_error){DPH_ERROR_MEMORY, "out of memory"};
        return false;
    }
    for (int c = 0; c < chart.npanel * chart.ngroup; c++)
        for (int s = 0; s < chart.nseries; s++) {
            const struct bench_row *row = &rows[c * table->nvariant + number[s]];
            value[c * chart.nseries + s] =
                (struct chart_value){.value = 1e3 / row->timing.ms_median,
                                     .low = 1e3 / row->timing.ms_p95,
                                     .high = 1e3 / row->timing.ms_p05,
                                     .ratio = row->timing.ratio};
        }
    chart.value = value;
    snprintf(subtitle, sizeof subtitle,
             "%s, %s triangles, in %s; %d sample%s a pixel; whiskers: 5th and 95th percentile",
             result->model, with_commas(result->triangles, a), run->material, run->samples,
             run->samples > 1 ? "s" : "");
    snprintf(foot, sizeof foot, "%s; %s; diaphan %s, commit %s", run->cpu, run->gl, dph_version(),
             DPH_COMMIT);
    snprintf(file, sizeof file, "%s%s", table->growth ? "lights" : "chart", ending);
    file_name(run, result, file, name);
    snprintf(path, sizeof path, "%s/%s", settings->output, name);
    bool ok = chart_save(&chart, path, err);
    free(value);
    return ok;
}

/* Milliseconds and ratio, a row a variant and a column a cell, for cells with or without indices.
 */
static void write_table(FILE *stream, const struct bench_result *result,
                        const struct bench_table *table, bool indexed)
{
    const struct bench_row *rows = result->row + table->first;
    char label[64];
    int columns = 0;
    for (int c = 0; c < table->ncell; c++)
        columns += rows[c * table->nvariant].cell.indexed == indexed;
    if (!columns)
        return;
    fprintf(stream, "%s vertices:\n\n| method | bytes a vertex | tables | passes |",
            indexed ? "Shared and indexed" : "Unshared");
    for (int c = 0; c < table->ncell; c++) {
        const struct cell *cell = &rows[c * table->nvariant].cell;
        if (cell->indexed != indexed)
            continue;
        if (table->growth)
            fprintf(stream, " %d light%s |", cell->lights, cell->lights > 1 ? "s" : "");
        else
            fprintf(stream, " %dx%d %s |", cell->width, cell->height, camera_label(cell));
    }
    fprintf(stream, "\n| --- | --- | --- | --- |");
    for (int c = 0; c < columns; c++)
        fprintf(stream, " --- |");
    for (int v = 0; v < table->nvariant; v++) {
        const struct bench_row *first = NULL, *last = NULL;
        char bytes[32];
        for (int c = 0; c < table->ncell; c++) {
            const struct bench_row *row = &rows[c * table->nvariant + v];
            if (row->cell.indexed != indexed)
                continue;
            first = first ? first : row;
            last = row;
        }
        variant_label(&first->variant, label);
        fprintf(stream, "\n| %s | %.4g | %s | %d", label, first->cost.bytes_per_vertex,
                with_commas(first->cost.table_bytes, bytes), first->cost.passes);
        if (last->cost.passes != first->cost.passes)
            fprintf(stream, " to %d", last->cost.passes);
        fprintf(stream, " |");
        for (int c = 0; c < table->ncell; c++) {
            const struct bench_row *row = &rows[c * table->nvariant + v];
            if (row->cell.indexed == indexed)
                fprintf(stream, " %.2f (%.2f) |", row->timing.ms_median, row->timing.ratio);
        }
    }
    fprintf(stream, "\n\n");
}

/* How sure the ratios are, and what the machine did beside. */
static void write_certainty(FILE *stream, const struct bench_run *run)
{
    double others = 0.0, worst = 0.0, sum = 0.0;
    int count = 0;
    for (int i = 0; i < run->nresult; i++)
        for (int r = 0; r < run->result[i].nrow; r++) {
            const struct dph_timing *timing = &run->result[i].row[r].timing;
            others += timing->others;
            worst = fmax(worst, timing->ratio_error / timing->ratio);
            sum += timing->ratio_error / timing->ratio;
            count++;
        }
    fprintf(stream,
            "* Standard error of a ratio: %.1f %% in the mean, %.1f %% at most; other processes "
            "kept %.2f processors busy meanwhile\n",
            100.0 * sum / count, 100.0 * worst, others / count);
}

static void write_report(FILE *stream, const struct settings *settings, const struct bench_run *run)
{
    char a[32], b[32], c[32], name[64];
    char *command = command_text(settings), *clean = command ? text_clean(command) : NULL;
    fprintf(stream, "# Speed of drawing\n\n    %s\n\n* Machine: ", clean ? clean : "?");
    free(command);
    free(clean);
    write_text(stream, run->cpu);
    fprintf(stream, "\n* Driver: ");
    write_text(stream, run->gl);
    fprintf(stream, "\n* diaphan %s, commit %s\n* Material ", dph_version(), DPH_COMMIT);
    write_text(stream, run->material);
    fprintf(stream,
            "; %d sample%s a pixel; depth maps of %d x %d texels; %d cop%s of the model; thickness "
            "and transfer vectors from %d directions, 6 bands\n",
            run->samples, run->samples > 1 ? "s" : "", run->map_size, run->map_size, run->repeat,
            run->repeat > 1 ? "ies" : "y", (settings->bake.directions + 1) & ~1);
    fprintf(stream,
            "* Every measurement: %g s and %d turns at least (lights: %d), shuffled with the others, "
            "timed by %s; the lights turn before every frame; nothing is read back; "
            "times of a cell are scaled to the fastest of its lamberts\n",
            run->seconds_each, run->rounds, run->growth_rounds,
            run->result[0].row[0].timing.gpu ? "the GPU's timer"
                                             : "glFinish and a clock (the driver's timers do not "
                                               "count what a software rasteriser does)");
    write_certainty(stream, run);
    if (is_given(settings, "camera"))
        fprintf(stream, "* Camera at azimuth %g, elevation %g, %g bounding-sphere radii away\n\n",
                settings->camera.azimuth, settings->camera.elevation, settings->camera.distance);
    else
        fprintf(stream, "* near: the model's largest side is as high as the frame; far: an eighth "
                        "of that (100 of 800 pixels)\n\n");
    for (int i = 0; i < run->nresult; i++) {
        const struct bench_result *result = &run->result[i];
        fprintf(stream, "## ");
        write_text(stream, result->model);
        fprintf(stream, "\n\n%s triangles, %s vertices, %s of them different; %.0f s with bakes.\n",
                with_commas(result->triangles, a), with_commas(result->vertices, b),
                with_commas(result->shared, c), result->seconds);
        for (int t = 0; t < result->ntable; t++) {
            const struct bench_table *table = &result->table[t];
            file_name(run, result, table->growth ? "lights.svg" : "chart.svg", name);
            fprintf(stream, "\n![Frames a second](%s)\n\n", name);
            if (!table->growth)
                write_findings(stream, result, table);
            fprintf(stream,
                    "Milliseconds a frame, median, and in brackets the ratio to lambert%s.\n\n",
                    table->growth ? " with as many lights" : "");
            write_table(stream, result, table, false);
            write_table(stream, result, table, true);
        }
    }
    fprintf(stream, "Percentiles, times of the CPU and numbers of frames are in results.json.\n");
}

/* What a function writes becomes a file of the folder. */
static bool save_text(const struct settings *settings, const struct bench_run *run,
                      const char *name, struct dph_error *err)
{
    char path[4096], *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (stream && strcmp(name, "report.md") == 0)
        write_report(stream, settings, run);
    else if (stream)
        print_draw_json(run, stream);
    bool ok = stream && !ferror(stream);
    ok = stream && !fclose(stream) && ok;
    snprintf(path, sizeof path, "%s/%s", settings->output, name);
    if (!ok)
        *err = (struct dph_error){DPH_ERROR_MEMORY, "out of memory"};
    else
        ok = dph_file_save(path, text, size, err);
    free(text);
    return ok;
}

int save_draw_report(const struct settings *settings, const struct bench_run *run)
{
    struct dph_error err;
    if (strlen(settings->output) > 3900) {
        complain(settings, "%.60s...: a path that is too long", settings->output);
        return EXIT_OUTPUT;
    }
    for (int i = 0; i < run->nresult; i++)
        for (int t = 0; t < run->result[i].ntable; t++)
            if (!save_chart(settings, run, &run->result[i], &run->result[i].table[t], ".svg",
                            &err) ||
                !save_chart(settings, run, &run->result[i], &run->result[i].table[t], ".png", &err))
                return report_error(settings, &err);
    if (!save_text(settings, run, "results.json", &err) ||
        !save_text(settings, run, "report.md", &err))
        return report_error(settings, &err);
    return EXIT_DONE;
}
