/* sheet.h - a comparison as one picture that a paper could print: the reference and the methods in
 * columns, lights in rows, under each picture the map of its FLIP error and its figures, a section
 * for each material. */
#ifndef SHEET_H
#define SHEET_H

#include "figure.h"

/* Writes the sheet to `path`, a .png, whole or not at all. All pictures are cut to the same box
 * around the object. Where a sheet of everything would be too large to be read by programs, the
 * first materials are shown, and its foot says how many more there are. False: DPH_ERROR_OUTPUT,
 * _MEMORY. */
bool sheet_save(const struct dph_comparison *comparison, const struct figure_run *run,
                const char *path, struct dph_error *err);

#endif
