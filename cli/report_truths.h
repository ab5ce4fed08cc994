/* report_truths.h - the part of a report about all directions of light and about both truths: the
 * picture and the average over views. */
#ifndef REPORT_TRUTHS_H
#define REPORT_TRUTHS_H

#include <diaphan/judge.h>

#include <stdio.h>

/* Whether a comparison has the truth averaged over views. */
bool report_has_views(const struct dph_judged *judged);

/* A table in HTML; nothing where there is neither. Names are those of methods and lights, which need
 * no escapes. */
void report_truths_html(FILE *out, const struct dph_comparison *comparison,
                        const struct dph_judged *judged);

/* The same for a terminal. */
void report_truths_text(FILE *out, const struct dph_comparison *comparison,
                        const struct dph_judged *judged);

#endif
