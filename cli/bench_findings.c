/* What a matrix says: order of the methods, SHSSS beside its rivals, the cost of coefficients.
 *
 * Everything is said of ratios to lambert in the same cell, which do not depend on the machine's
 * drift; two methods of a cell are compared by the quotient of their ratios. A sentence whose rows
 * were not measured is left out. */
#define _POSIX_C_SOURCE 200809L
#include "bench_draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A row of a table; NULL: variant -1. */
static const struct bench_row *row_at(const struct bench_result *result,
                                      const struct bench_table *table, int cell, int variant)
{
    return variant < 0 ? NULL : &result->row[table->first + cell * table->nvariant + variant];
}

static const struct variant *variant_at(const struct bench_result *result,
                                        const struct bench_table *table, int i)
{
    return &row_at(result, table, 0, i)->variant;
}

/* The number of a variant, -1 where it was not measured. */
static int find_shsss(const struct bench_result *result, const struct bench_table *table, int bands,
                      enum dph_store store)
{
    for (int i = 0; i < table->nvariant; i++) {
        const struct variant *v = variant_at(result, table, i);
        if (v->method->needs_thickness && !v->chosen && v->bands == bands && v->store == (int)store)
            return i;
    }
    return -1;
}

static int find_method(const struct bench_result *result, const struct bench_table *table,
                       const char *name, int clusters)
{
    for (int i = 0; i < table->nvariant; i++) {
        const struct variant *v = variant_at(result, table, i);
        if (!strcmp(v->method->name, name) && (!clusters || v->clusters == clusters))
            return i;
    }
    return -1;
}

static int compare_rows(const void *a, const void *b)
{
    const struct bench_row *const *x = a, *const *y = b;
    return ((*x)->timing.ratio > (*y)->timing.ratio) - ((*x)->timing.ratio < (*y)->timing.ratio);
}

/* The methods of every cell from the fastest on. */
static void write_order(FILE *stream, const struct bench_result *result,
                        const struct bench_table *table)
{
    char label[64];
    const struct bench_row *row[MAX_VARIANTS];
    fprintf(stream, "**Order of the methods**, milliseconds over those of plain shading (lambert) "
                    "in the same cell:\n\n");
    for (int c = 0; c < table->ncell; c++) {
        int count = 0;
        for (int i = 0; i < table->nvariant; i++)
            if (in_chart(variant_at(result, table, i)))
                row[count++] = row_at(result, table, c, i);
        qsort(row, (size_t)count, sizeof *row, compare_rows);
        cell_label(&row[0]->cell, label);
        fprintf(stream, "* %s:", label);
        for (int i = 0; i < count; i++) {
            variant_label(&row[i]->variant, label);
            fprintf(stream, "%s %s %.2f", i ? ";" : "", label, row[i]->timing.ratio);
        }
        fprintf(stream, "\n");
    }
    fprintf(stream, "\n");
}

/* The least and the largest quotient of b's and a's times over the cells with or without indices;
 * false: there are none. */
static bool quotients(const struct bench_result *result, const struct bench_table *table, int a,
                      int b, bool indexed, double *low, double *high)
{
    *low = INFINITY;
    *high = 0.0;
    for (int c = 0; c < table->ncell && a >= 0 && b >= 0; c++) {
        const struct bench_row *x = row_at(result, table, c, a), *y = row_at(result, table, c, b);
        if (x->cell.indexed != indexed)
            continue;
        double quotient = y->timing.ratio / x->timing.ratio;
        *low = fmin(*low, quotient);
        *high = fmax(*high, quotient);
    }
    return *high > 0.0;
}

/* How much faster 36 coefficients are than prt-cpca in both settings. */
static void write_against_prt(FILE *stream, const struct bench_result *result,
                              const struct bench_table *table)
{
    static const enum dph_store stores[2] = {DPH_STORE_SNORM8, DPH_STORE_FLOAT};
    bool headed = false;
    for (int setting = 0; setting < CPCA_SETTINGS; setting++)
        for (int s = 0; s < 2; s++) {
            int a = find_shsss(result, table, DPH_DRAW_BANDS, stores[s]);
            int b = find_method(result, table, "prt-cpca", cpca_setting[setting][0]);
            double low, high;
            bool one = quotients(result, table, a, b, false, &low, &high);
            if (!one)
                continue;
            if (!headed)
                fprintf(stream, "**SHSSS against compressed transfer**, time of prt-cpca over that "
                                "of shsss (above 1: shsss is faster):\n\n");
            headed = true;
            fprintf(stream, "* 36 %s against %d cluster%s of %d vectors: %.2f to %.2f unshared",
                    dph_store_name(stores[s]), cpca_setting[setting][0],
                    cpca_setting[setting][0] > 1 ? "s" : "", cpca_setting[setting][1], low, high);
            if (quotients(result, table, a, b, true, &low, &high))
                fprintf(stream, ", %.2f to %.2f indexed", low, high);
            fprintf(stream, "\n");
        }
    if (headed)
        fprintf(stream, "\n");
}

/* What coefficients cost over plain shading. */
static void write_cost(FILE *stream, const struct bench_result *result,
                       const struct bench_table *table)
{
    char label[64];
    int number[3], count = 0;
    for (int bands = 2; bands <= DPH_DRAW_BANDS; bands += 2) {
        number[count] = find_shsss(result, table, bands, DPH_STORE_SNORM8);
        count += number[count] >= 0;
    }
    if (!count)
        return;
    fprintf(stream, "**What coefficients cost over plain shading**, snorm8, percent of a frame of "
                    "lambert, and in brackets over lambert with unshared vertices:\n\n");
    for (int c = 0; c < table->ncell; c++) {
        cell_label(&row_at(result, table, c, 0)->cell, label);
        fprintf(stream, "* %s:", label);
        for (int i = 0; i < count; i++) {
            const struct bench_row *row = row_at(result, table, c, number[i]);
            fprintf(stream, "%s %d coefficients %+.0f %%", i ? "," : "",
                    row->variant.bands * row->variant.bands, 100.0 * (row->timing.ratio - 1.0));
            if (row->cell.indexed)
                fprintf(stream, " (%+.0f %%)", 100.0 * (row->unshared_ratio - 1.0));
        }
        fprintf(stream, "\n");
    }
    fprintf(stream, "\n");
}

/* The same cell at the smallest frame, which leaves the vertex stage alone; -1: not measured. */
static int vertex_cell(const struct bench_result *result, const struct bench_table *table, int cell)
{
    const struct cell *here = &row_at(result, table, cell, 0)->cell;
    for (int c = 0; c < table->ncell; c++) {
        const struct cell *there = &row_at(result, table, c, 0)->cell;
        if (there->indexed == here->indexed && there->far == here->far &&
            there->given == here->given && there->width <= 16 && there->height <= 16 && c != cell)
            return c;
    }
    return -1;
}

/* Every cell in which one of the rivals is not behind SHSSS, and in which part of the work. */
static void write_behind(FILE *stream, const struct bench_result *result,
                         const struct bench_table *table)
{
    int rival[3], rivals = 0, pairs = 0, behind = 0, explained = 0;
    rival[rivals] = find_method(result, table, "prt-cpca", cpca_setting[0][0]);
    rivals += rival[rivals] >= 0;
    rival[rivals] = find_method(result, table, "green", 0);
    rivals += rival[rivals] >= 0;
    rival[rivals] = find_method(result, table, "green-gauss", 0);
    rivals += rival[rivals] >= 0;
    char *lines = NULL;
    size_t size = 0;
    FILE *list = open_memstream(&lines, &size);
    if (!list)
        return;
    for (int c = 0; c < table->ncell; c++)
        for (int k = 0; k < rivals; k++) {
            const struct bench_row *other = row_at(result, table, c, rival[k]);
            char label[64], name[64];
            int named = 0;
            for (int i = 0; i < table->nvariant; i++) {
                const struct bench_row *row = row_at(result, table, c, i);
                if (!row->variant.method->needs_thickness)
                    continue;
                pairs++;
                if (row->timing.ratio < other->timing.ratio)
                    continue;
                behind++;
                variant_label(&row->variant, label);
                if (!named++) {
                    cell_label(&row->cell, name);
                    fprintf(list, "* %s: ", name);
                    variant_label(&other->variant, name);
                    fprintf(list, "%s takes %.2f;", name, other->timing.ratio);
                }
                fprintf(list, "%s %s %.2f", named > 1 ? ";" : "", label, row->timing.ratio);
            }
            int alone = vertex_cell(result, table, c);
            if (!named)
                continue;
            int whole = find_shsss(result, table, DPH_DRAW_BANDS, DPH_STORE_SNORM8);
            if (alone >= 0 && whole >= 0 &&
                row_at(result, table, alone, whole)->timing.ratio <
                    row_at(result, table, alone, rival[k])->timing.ratio) {
                fprintf(list,
                        ". At %dx%d, where vertices are all the work, 36 snorm8 takes %.2f and %s "
                        "%.2f: it is the fragments that are dearer",
                        row_at(result, table, alone, 0)->cell.width,
                        row_at(result, table, alone, 0)->cell.height,
                        row_at(result, table, alone, whole)->timing.ratio, name,
                        row_at(result, table, alone, rival[k])->timing.ratio);
                explained++;
            }
            fprintf(list, "\n");
        }
    fclose(list);
    if (pairs && !behind)
        fprintf(stream,
                "**SHSSS is ahead** of prt-cpca with 24 vectors, green and green-gauss, as far as "
                "measured, in all %d comparisons: every cell, number of bands and type.\n\n",
                pairs);
    else if (pairs)
        fprintf(stream,
                "**Where SHSSS is not ahead** of prt-cpca with 24 vectors, green or green-gauss, "
                "%d of %d comparisons:\n\n%s\n",
                behind, pairs, lines);
    if (explained)
        fprintf(stream, "A fragment of prt-cpca takes over radiance that the vertices have; one of "
                        "shsss turns thickness into transmittance, a polynomial and a quotient a "
                        "channel, for every light.\n\n");
    free(lines);
}

void write_findings(FILE *stream, const struct bench_result *result,
                    const struct bench_table *table)
{
    write_order(stream, result, table);
    write_against_prt(stream, result, table);
    write_cost(stream, result, table);
    write_behind(stream, result, table);
}
