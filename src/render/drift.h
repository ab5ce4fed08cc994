/* render/drift.h - ratios of times that were taken in turns on a machine whose speed drifts.
 *                                                                             Tier 3, private. */
#ifndef DPH_RENDER_DRIFT_H
#define DPH_RENDER_DRIFT_H

#include <diaphan/error.h>
#include <stddef.h>

/* A time, above 0, of one of several series. */
struct dph_turn {
    size_t series;
    double ms;
};

/* What the times of each series are to those of series 0: `turn` (nturn) in the order in which they
 * were taken; `ratio`, `error` (nseries): the ratio, 1 for series 0, and its standard error, 0 for
 * series 0; both NAN for a series without a turn, and for all where series 0 has none. False:
 * DPH_ERROR_MEMORY. */
bool dph_drift_ratios(const struct dph_turn *turn, size_t nturn, size_t nseries, double *ratio,
                      double *error, struct dph_error *err);

/* Ascending. */
void dph_sort(double *value, size_t count);
/* The quantile q, 0 to 1, of one sorted value or more, between neighbours where it falls there. */
double dph_quantile(const double *sorted, size_t count, double q);

#endif
