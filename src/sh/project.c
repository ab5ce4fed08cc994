/* Projectors: tables for one set of directions, and the choice of a kernel (see sh/project.h). */
#include "sh/project.h"

#include "core/fail.h"
#include "core/memory.h"
#include "core/simd.h"
#include "sh/projector.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* The column of each function of `bands` bands among all, even degrees first. Returns how many are
 * even. */
static int sort_columns(int bands, int *column)
{
    int even = 0, odd = 0;
    for (int l = 0; l < bands; l += 2)
        even += 2 * l + 1;
    for (int l = 0, next = 0; l < bands; l++)
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            column[i] = l % 2 ? even + odd++ : next++;
    return even;
}

/* The functions at the first direction of each pair, as the samples are taken: at the float
 * direction, made a unit in double. */
static bool fill_tables(struct dph_projector *projector, int bands)
{
    int functions = bands * bands, column[15 * 15];
    double y[15 * 15];
    size_t pairs = (size_t)projector->pairs;
    int even = sort_columns(bands, column), odd = functions - even;
    projector->table_even = even;
    projector->table_odd = odd;
    projector->even_table = dph_alloc_aligned(pairs * (size_t)even, sizeof(float));
    projector->odd_table = dph_alloc_aligned(pairs * (size_t)odd, sizeof(float));
    projector->direction = dph_alloc_aligned(pairs * 3, sizeof(float));
    float *all = dph_alloc(pairs * 6, sizeof *all);
    bool ok = projector->even_table && projector->odd_table && projector->direction && all;
    if (ok) {
        dph_sh_directions(2 * projector->pairs, all);
        for (size_t k = 0; k < pairs; k++) {
            double d[3] = {all[6 * k], all[6 * k + 1], all[6 * k + 2]};
            double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            for (int i = 0; i < 3; i++) {
                projector->direction[3 * k + (size_t)i] = all[6 * k + (size_t)i];
                d[i] /= length;
            }
            dph_sh_eval(bands, d, y);
            float *even_row = projector->even_table + k * (size_t)even;
            float *odd_row = projector->odd_table + k * (size_t)odd;
            for (int i = 0; i < functions; i++) {
                float *value = column[i] < even ? even_row + column[i] : odd_row + column[i] - even;
                *value = (float)y[i];
            }
        }
    }
    free(all);
    return ok;
}

struct dph_projector *dph_projector_create(int bands, int directions, enum dph_fit fit,
                                           double extinction, bool portable, struct dph_error *err)
{
    assert(bands >= 1 && bands <= DPH_MAX_BANDS && directions >= 2 && directions % 2 == 0);
    struct dph_projector *projector = dph_alloc_zero(1, sizeof *projector);
    if (!projector)
        goto error;
    projector->bands = bands;
    projector->pairs = directions / 2;
    projector->fit = fit;
    projector->avx2 = !portable && dph_cpu_has_avx2();
    projector->scale = (float)(4 * 3.14159265358979323846 / directions);
    projector->rate = (float)(-2 * extinction);
    projector->limit = extinction > 0 ? (float)(4 / extinction) : INFINITY;
    projector->even = sort_columns(bands, projector->column);
    projector->odd = bands * bands - projector->even;
    if (!fill_tables(projector, fit == DPH_FIT_WEIGHTED ? 2 * bands - 1 : bands))
        goto error;
    if (fit == DPH_FIT_WEIGHTED) {
        int column[15 * 15];
        if (!dph_gaunt_init(&projector->gaunt, bands))
            goto error;
        sort_columns(2 * bands - 1, column);
        uint32_t terms = projector->gaunt.start[bands * bands * (bands * bands + 1) / 2];
        for (uint32_t t = 0; t < terms; t++)
            projector->gaunt.index[t] = (uint16_t)column[projector->gaunt.index[t]];
    }
    return projector;

error:
    dph_projector_destroy(projector);
    dph_fail_memory(err);
    return NULL;
}

void dph_projector_destroy(struct dph_projector *projector)
{
    if (!projector)
        return;
    dph_gaunt_finish(&projector->gaunt);
    free(projector->even_table);
    free(projector->odd_table);
    free(projector->direction);
    free(projector);
}

size_t dph_projector_sums(const struct dph_projector *projector)
{
    int weights = projector->fit == DPH_FIT_WEIGHTED ? projector->table_even + projector->table_odd
                                                     : 0;
    return (size_t)(weights + projector->even + projector->odd);
}

void dph_projector_add(const struct dph_projector *projector, int first, int count,
                       const float *plus, const float *minus, size_t stride, const float *normal,
                       size_t begin, size_t end, float *sums)
{
    assert(first >= 0 && count >= 0 && first + count <= projector->pairs);
    assert(begin % 8 == 0 && end % 8 == 0);
    bool weighted = projector->fit == DPH_FIT_WEIGHTED;
#ifdef DPH_HAVE_AVX2
    if (projector->avx2) {
        (weighted ? dph_fit_add_avx2 : dph_project_add_avx2)(projector, first, count, plus, minus,
                                                            stride, normal, begin, end, sums);
        return;
    }
#endif
    (weighted ? dph_fit_add_portable : dph_project_add_portable)(
        projector, first, count, plus, minus, stride, normal, begin, end, sums);
}

void dph_projector_solve(const struct dph_projector *projector, const float *sums, size_t begin,
                         size_t end, float *coefficient)
{
    assert(begin % 8 == 0 && end % 8 == 0);
    bool weighted = projector->fit == DPH_FIT_WEIGHTED;
#ifdef DPH_HAVE_AVX2
    if (projector->avx2) {
        (weighted ? dph_fit_solve_avx2 : dph_project_solve_avx2)(projector, sums, begin, end,
                                                                coefficient);
        return;
    }
#endif
    (weighted ? dph_fit_solve_portable : dph_project_solve_portable)(projector, sums, begin, end,
                                                                    coefficient);
}
