/* report_html.h - a comparison as one HTML file for people: tables of error and cost, all pictures
 * and error maps, a slider between any two of them, the parameters of the run. The file needs
 * nothing beside it and fetches nothing; without script only the slider and the sorting are missing. */
#ifndef REPORT_HTML_H
#define REPORT_HTML_H

#include "figure.h"

/* Writes the report to `path`, whole or not at all. False: DPH_ERROR_OUTPUT, _MEMORY. */
bool report_html_save(const struct dph_comparison *comparison, const struct figure_run *run,
                      const char *path, struct dph_error *err);

#endif
