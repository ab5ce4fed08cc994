/* bake/view_gain.h - fitting what a direction of sight sees over the average.      Tier 2, private. */
#ifndef DPH_BAKE_VIEW_GAIN_H
#define DPH_BAKE_VIEW_GAIN_H

#include <diaphan/response.h>

/* The equations of a fit: the lower triangle of the matrix, row after row, and the right side. */
struct dph_view_equations {
    double matrix[DPH_VIEW_TERMS * (DPH_VIEW_TERMS + 1) / 2];
    double right[DPH_VIEW_TERMS];
};

/* What the terms are multiplied by, for n.l, n.v, l.v and the value. */
void dph_view_terms(double normal_light, double normal_eye, double light_eye, double value,
                    double term[DPH_VIEW_TERMS]);

/* Adds one set of equations to another. */
void dph_view_add(struct dph_view_equations *sum, const struct dph_view_equations *more);

/* Solves them. Where they say little the gain stays near 1. */
struct dph_view_gain dph_view_solve(const struct dph_view_equations *equations);

#endif
