/* bake/view_gain.h - fitting what a direction of sight sees over the average.      Tier 2, private. */
#ifndef DPH_BAKE_VIEW_GAIN_H
#define DPH_BAKE_VIEW_GAIN_H

#include <diaphan/response.h>

/* The equations of a fit: the lower triangle of the matrix, row after row, and the right side. */
struct dph_view_equations {
    double matrix[DPH_VIEW_TERMS * (DPH_VIEW_TERMS + 1) / 2];
    double right[DPH_VIEW_TERMS];
};

/* Whether a response has what the gain is a function of. */
bool dph_view_applies(const struct dph_response *response);

/* What the terms are multiplied by, for l.v and q. */
void dph_view_terms(double light_eye, const double q[4], double term[DPH_VIEW_TERMS]);

/* q of a vertex's first four coefficients and a value. */
void dph_view_arguments(const double first[4], const double to_light[3], const double to_eye[3],
                        double value, double q[4]);

/* Adds one set of equations to another. */
void dph_view_add(struct dph_view_equations *sum, const struct dph_view_equations *more);

/* Solves them. Where they say little the gain stays near 1. */
struct dph_view_gain dph_view_solve(const struct dph_view_equations *equations);

#endif
