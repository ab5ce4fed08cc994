/* The two loops of CPCA in which the time goes: which cluster suits a signal best, and covariances
 * (see bake/cpca.c).
 *
 * The squared error of signal x in a cluster is |x - m|^2 - sum_j ((x - m).e_j)^2 = |x|^2 - 2 x.m
 * + |m|^2 - sum_j (x.e_j - m.e_j)^2: one matrix product of signals by all means and vectors, the
 * same inner loop as that of projection. Signals are centred as a whole and scaled before, so that
 * float suffices: near ties alone are decided by rounding, the same way everywhere. */
#include "bake/cpca_kernel.h"
#include "sh/accumulate.h"

#include <math.h>

/* Means and vectors of one cluster against a tile. More columns than fit go in pieces. */
enum { MOST_COLUMNS = 24 };

static inline void cluster_error(const struct dph_cpca_model *model, int cluster, const float *tile,
                                 dph_f8 error[2])
{
    int columns = 1 + model->vectors;
    const float *table = model->column + (size_t)cluster * (size_t)model->n * (size_t)columns;
    const float *offset = model->offset + (size_t)cluster * (size_t)columns;
    float sum[2][8 * MOST_COLUMNS];
    for (int done = 0; done < columns; done += MOST_COLUMNS) {
        int part = columns - done < MOST_COLUMNS ? columns - done : MOST_COLUMNS;
        memset(sum[0], 0, 8 * sizeof(float) * (size_t)part);
        memset(sum[1], 0, 8 * sizeof(float) * (size_t)part);
        accumulate(part, model->n, tile, table + done, columns, sum[0], sum[1]);
        for (int half = 0; half < 2; half++)
            for (int j = 0; j < part; j++) {
                dph_f8 dot = dph_f8_load(sum[half] + 8 * j), o = dph_f8_set(offset[done + j]);
                if (done + j == 0)
                    error[half] += o - (dot + dot);
                else
                    error[half] -= (dot - o) * (dot - o);
            }
    }
}

void DPH_KERNEL(dph_cpca_assign)(const struct dph_cpca_model *model, const float *tile, size_t ntile,
                                 int32_t *cluster, float *error)
{
    const size_t size = (size_t)model->n * CPCA_TILE;
    dph_f8 square[CPCA_GROUP][2], best[CPCA_GROUP][2];
    dph_i8 id[CPCA_GROUP][2];
    for (size_t first = 0; first < ntile; first += CPCA_GROUP) {
        size_t tiles = ntile - first < CPCA_GROUP ? ntile - first : CPCA_GROUP;
        const float *group = tile + first * size;
        for (size_t t = 0; t < tiles; t++)
            for (int half = 0; half < 2; half++) {
                dph_f8 sum = dph_f8_set(0);
                for (int i = 0; i < model->n; i++) {
                    dph_f8 x = dph_f8_load(group + t * size + (size_t)i * CPCA_TILE + 8 * half);
                    sum += x * x;
                }
                square[t][half] = sum;
                best[t][half] = dph_f8_set(INFINITY);
                id[t][half] = dph_i8_set(0);
            }
        for (int c = 0; c < model->clusters; c++)
            for (size_t t = 0; t < tiles; t++) {
                dph_f8 e[2] = {square[t][0], square[t][1]};
                cluster_error(model, c, group + t * size, e);
                for (int half = 0; half < 2; half++) {
                    dph_i8 less = e[half] < best[t][half];
                    best[t][half] = dph_f8_select(less, e[half], best[t][half]);
                    id[t][half] = (dph_i8)dph_f8_select(less, (dph_f8)dph_i8_set(c), (dph_f8)id[t][half]);
                }
            }
        for (size_t t = 0; t < tiles; t++)
            for (int half = 0; half < 2; half++) {
                size_t at = (first + t) * CPCA_TILE + 8 * (size_t)half;
                dph_f8_store(error + at, dph_f8_max(best[t][half], dph_f8_set(0)));
                memcpy(cluster + at, &id[t][half], sizeof id[t][half]);
            }
    }
}

/* Four signals at once, so that the matrix is read and written once for four products. */
static void add_products(int n, const double *restrict row, double *restrict covariance)
{
    const double *restrict a = row, *restrict b = row + n, *restrict c = row + 2 * n, *restrict d = row + 3 * n;
    for (int i = 0; i < n; i++) {
        double *restrict target = covariance + (size_t)i * (size_t)n;
        double ai = a[i], bi = b[i], ci = c[i], di = d[i];
        for (int j = 0; j <= i; j++)
            target[j] += ai * a[j] + bi * b[j] + ci * c[j] + di * d[j];
    }
}

void DPH_KERNEL(dph_cpca_covariance)(int n, const float *tile, const uint32_t *member, size_t count,
                                     const float *importance, const double *mean,
                                     double *covariance, double *scratch)
{
    for (size_t first = 0; first < count; first += 4) {
        for (size_t k = 0; k < 4; k++) {
            double *row = scratch + k * (size_t)n;
            if (first + k >= count) {
                memset(row, 0, (size_t)n * sizeof *row);
                continue;
            }
            size_t s = member[first + k];
            const float *from = tile + s / CPCA_TILE * CPCA_TILE * (size_t)n + s % CPCA_TILE;
            double root = importance ? sqrt((double)importance[s]) : 1;
            for (int i = 0; i < n; i++)
                row[i] = root * ((double)from[(size_t)i * CPCA_TILE] - mean[i]);
        }
        add_products(n, scratch, covariance);
    }
}
