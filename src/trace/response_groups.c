/* Groups of neighbouring positions.
 *
 * A kd-tree over six numbers a position: its place along three random axes, over the reach, and its
 * normal along them, which decides only between sides of thin parts. The widest of the six is
 * halved, not in the middle but between .4 and .6 of the positions, until a group is small enough.
 * Axes and cuts are new in each pass, so that no border of groups shows in the sum. */
#include "trace/response.h"

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>

enum { KEYS = 6, DEEPEST = 128 };

bool dph_groups_init(struct dph_groups *groups, size_t npos, struct dph_error *err)
{
    *groups = (struct dph_groups){
        .order = dph_alloc(npos, sizeof *groups->order),
        .start = dph_alloc(npos + 1, sizeof *groups->start),
        .key = dph_alloc(npos, KEYS * sizeof *groups->key),
    };
    if (groups->order && groups->start && groups->key)
        return true;
    dph_groups_finish(groups);
    return dph_fail_memory(err);
}

void dph_groups_finish(struct dph_groups *groups)
{
    free(groups->order);
    free(groups->start);
    free(groups->key);
    *groups = (struct dph_groups){0};
}

/* Three axes, evenly over all rotations: a random unit quaternion (Shoemake 1992). */
static void rotate_axes(struct dph_random *random, double axis[3][3])
{
    const double tau = 6.28318530717958647692;
    double u = dph_random_next(random), a = tau * dph_random_next(random),
           b = tau * dph_random_next(random);
    double x = sqrt(1 - u) * sin(a), y = sqrt(1 - u) * cos(a), z = sqrt(u) * sin(b),
           w = sqrt(u) * cos(b);
    const double rows[3][3] = {
        {1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
        {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
        {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)},
    };
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            axis[i][k] = rows[i][k];
}

static bool before(const float *key, int axis, uint32_t a, uint32_t b)
{
    float x = key[KEYS * (size_t)a + (size_t)axis], y = key[KEYS * (size_t)b + (size_t)axis];
    return x < y || (x == y && a < b);
}

/* Hoare's selection (1961): moves the `middle` first of order[0 .. count) along an axis to the
 * front. */
static void part(uint32_t *order, size_t count, size_t middle, const float *key, int axis)
{
    ptrdiff_t low = 0, high = (ptrdiff_t)count - 1, wanted = (ptrdiff_t)middle;
    while (low < high) {
        uint32_t pivot = order[low + (high - low) / 2];
        ptrdiff_t i = low, j = high;
        while (i <= j) {
            while (before(key, axis, order[i], pivot))
                i++;
            while (before(key, axis, pivot, order[j]))
                j--;
            if (i <= j) {
                uint32_t swap = order[i];
                order[i++] = order[j];
                order[j--] = swap;
            }
        }
        if (wanted <= j)
            high = j;
        else if (wanted >= i)
            low = i;
        else
            return;
    }
}

void dph_groups_make(struct dph_groups *groups, const float *position, const float *normal,
                     size_t npos, double reach, size_t most, struct dph_random random)
{
    double axis[3][3];
    rotate_axes(&random, axis);
    for (size_t p = 0; p < npos; p++) {
        groups->order[p] = (uint32_t)p;
        for (size_t i = 0; i < 3; i++) {
            double x = 0, n = 0;
            for (size_t k = 0; k < 3; k++) {
                x += axis[i][k] * (double)position[3 * p + k];
                n += axis[i][k] * (double)normal[3 * p + k];
            }
            groups->key[KEYS * p + i] = (float)(x / reach);
            groups->key[KEYS * p + 3 + i] = (float)(.5 * n);
        }
    }

    uint32_t end[DEEPEST];
    size_t begin = 0;
    int depth = 0;
    groups->count = 0;
    end[depth++] = (uint32_t)npos;
    while (depth && begin < npos) {
        size_t count = end[depth - 1] - begin;
        float low[KEYS], high[KEYS];
        for (int i = 0; i < KEYS; i++)
            low[i] = INFINITY, high[i] = -INFINITY;
        for (size_t k = begin; k < begin + count; k++)
            for (int i = 0; i < KEYS; i++) {
                float x = groups->key[KEYS * (size_t)groups->order[k] + (size_t)i];
                low[i] = fminf(low[i], x);
                high[i] = fmaxf(high[i], x);
            }
        int widest = 0;
        bool wide = false;
        for (int i = 0; i < KEYS; i++) {
            wide = wide || (i < 3 && high[i] - low[i] > 1);
            if (high[i] - low[i] > high[widest] - low[widest])
                widest = i;
        }
        if (count == 1 || depth == DEEPEST || (count <= most && !wide)) {
            groups->start[groups->count++] = (uint32_t)begin;
            begin = end[--depth];
            continue;
        }
        double share = .4 + .2 * dph_random_next(&random);
        size_t left = (size_t)(share * (double)count + dph_random_next(&random));
        left = left < 1 ? 1 : left > count - 1 ? count - 1 : left;
        part(groups->order + begin, count, left, groups->key, widest);
        end[depth++] = (uint32_t)(begin + left);
    }
    groups->start[groups->count] = (uint32_t)npos;
}
