/* sh/projector.h - the tables of a projector and the kernels that read them.      Tier 1, private to sh. */
#ifndef DPH_SH_PROJECTOR_H
#define DPH_SH_PROJECTOR_H

#include "sh/gaunt.h"
#include "sh/project.h"

/* Sums over samples are kept a column a function. Columns are sorted by parity: the functions of
 * even degree, then those of odd degree, each group by index, so that fewer bands are a prefix of
 * more within a group.
 *
 * Fit "sphere": sums of T y for the bands * bands functions. Fit "weighted": sums of w y for the
 * functions of degrees up to 2 (bands - 1), then sums of w t y as for "sphere". */
struct dph_projector {
    int bands;
    int pairs;
    enum dph_fit fit;
    bool avx2;
    int even, odd;             /* columns of T y or w t y, by parity */
    int table_even, table_odd; /* columns of the tables; more than those with the weighted fit */
    float *even_table;         /* (pairs x table_even) y at the first direction of the pair */
    float *odd_table;          /* (pairs x table_odd) */
    float *direction;          /* (pairs x 3) the first direction */
    int column[DPH_MAX_BANDS * DPH_MAX_BANDS]; /* of a coefficient, among even + odd */
    float scale;               /* 4 pi / directions */
    float rate;                /* -2 s */
    float limit;               /* 4 / s, where targets are cut */
    struct dph_gaunt gaunt;    /* weighted: indices are columns of the sums of w y */
};

/* The two functions of project.h for one fit and one processor; see there. */
#define DPH_PROJECTOR_KERNELS(add, solve)                                                          \
    void add(const struct dph_projector *projector, int first, int count, const float *plus,       \
             const float *minus, size_t stride, const float *normal, size_t begin, size_t end,     \
             float *sums);                                                                         \
    void solve(const struct dph_projector *projector, const float *sums, size_t begin, size_t end, \
               float *coefficient);

DPH_PROJECTOR_KERNELS(dph_project_add_portable, dph_project_solve_portable)
DPH_PROJECTOR_KERNELS(dph_project_add_avx2, dph_project_solve_avx2)
DPH_PROJECTOR_KERNELS(dph_fit_add_portable, dph_fit_solve_portable)
DPH_PROJECTOR_KERNELS(dph_fit_add_avx2, dph_fit_solve_avx2)

#endif
