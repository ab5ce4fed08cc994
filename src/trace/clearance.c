/* A grid of conservative distances to the surface, so that a short flight through the inside needs
 * no ray.
 *
 * Cells that a triangle touches are marked: a triangle and a box are apart exactly where one of 13
 * axes separates them (Akenine-Moller, "Fast 3D triangle-box overlap testing", 2001); the three
 * axes of the box itself are the range of cells that is looked at. Boxes are a little larger than
 * cells, by more than single precision moves a vertex, a ray or a hit. Two points of cells that lie
 * (i, j, k) cells apart have at least the distance
 *
 *     cell * sqrt(max(|i| - 1, 0)^2 + max(|j| - 1, 0)^2 + max(|k| - 1, 0)^2),
 *
 * which is the distance of the cells' centres after marks have spread to all 26 neighbours. Its
 * least value over all marks is found axis by axis, as squares of whole numbers (Saito and
 * Toriwaki 1994). It is stored in quarters of a cell, rounded down. */
#include "trace/clearance.h"

#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>

enum { MAX_SIDE = 64, FAR = 3 * MAX_SIDE * MAX_SIDE, FINENESS = 4 };

/* Separating axes of a triangle and a box of the grid, with the interval of centres of boxes that
 * are not separated by them. */
struct axes {
    int count;
    double axis[10][3], from[10], to[10];
};

static void add_axis(struct axes *axes, const double axis[3], const double corner[3][3],
                     double half)
{
    double from = INFINITY, to = -INFINITY;
    double reach = half * (fabs(axis[0]) + fabs(axis[1]) + fabs(axis[2]));
    for (int i = 0; i < 3; i++) {
        double along =
            axis[0] * corner[i][0] + axis[1] * corner[i][1] + axis[2] * corner[i][2];
        from = fmin(from, along);
        to = fmax(to, along);
    }
    axes->axis[axes->count][0] = axis[0];
    axes->axis[axes->count][1] = axis[1];
    axes->axis[axes->count][2] = axis[2];
    axes->from[axes->count] = from - reach;
    axes->to[axes->count++] = to + reach;
}

static void find_axes(struct axes *axes, const double corner[3][3], double half)
{
    double edge[3][3], normal[3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            edge[i][k] = corner[(i + 1) % 3][k] - corner[i][k];
    for (int k = 0; k < 3; k++)
        normal[k] = edge[0][(k + 1) % 3] * edge[1][(k + 2) % 3] -
                    edge[0][(k + 2) % 3] * edge[1][(k + 1) % 3];
    axes->count = 0;
    add_axis(axes, normal, corner, half);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double axis[3] = {0, 0, 0}; /* of the k-th axis and an edge */
            axis[(k + 1) % 3] = -edge[i][(k + 2) % 3];
            axis[(k + 2) % 3] = edge[i][(k + 1) % 3];
            add_axis(axes, axis, corner, half);
        }
}

static bool apart(const struct axes *axes, const double centre[3])
{
    for (int i = 0; i < axes->count; i++) {
        const double *a = axes->axis[i];
        double along = a[0] * centre[0] + a[1] * centre[1] + a[2] * centre[2];
        if (along < axes->from[i] || along > axes->to[i])
            return true;
    }
    return false;
}

/* A triangle in units of cells, and the cells that its bounding box touches. */
static void measure(const struct dph_clearance *grid, const float *position,
                    const uint32_t *triangle, double slack, double corner[3][3], int range[3][2])
{
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int i = 0; i < 3; i++) {
            double x = (double)position[3 * (size_t)triangle[i] + (size_t)k];
            corner[i][k] = (x - grid->low[k]) * grid->cells;
            low = fmin(low, corner[i][k]);
            high = fmax(high, corner[i][k]);
        }
        range[k][0] = (int)fmax(0, floor(low - slack));
        range[k][1] = (int)fmin(grid->size[k] - 1, floor(high + slack));
    }
}

/* How many cells are looked at to mark those that are touched. */
static double effort(const struct dph_clearance *grid, const float *position,
                     const uint32_t *index, size_t ntri, double slack)
{
    double sum = 0;
    for (size_t t = 0; t < ntri; t++) {
        double corner[3][3], cells = 1;
        int range[3][2];
        measure(grid, position, index + 3 * t, slack, corner, range);
        for (int k = 0; k < 3; k++)
            cells *= fmax(0, range[k][1] - range[k][0] + 1);
        sum += cells;
    }
    return sum;
}

static void mark(const struct dph_clearance *grid, const float *position, const uint32_t *index,
                 size_t ntri, double slack, uint16_t *square)
{
    for (size_t t = 0; t < ntri; t++) {
        double corner[3][3];
        struct axes axes;
        int range[3][2];
        measure(grid, position, index + 3 * t, slack, corner, range);
        find_axes(&axes, (const double(*)[3])corner, .5 + slack);
        for (int z = range[2][0]; z <= range[2][1]; z++)
            for (int y = range[1][0]; y <= range[1][1]; y++) {
                uint16_t *row =
                    square + ((ptrdiff_t)z * grid->size[1] + (ptrdiff_t)y) * grid->size[0];
                for (int x = range[0][0]; x <= range[0][1]; x++) {
                    const double centre[3] = {x + .5, y + .5, z + .5};
                    if (row[x] && !apart(&axes, centre))
                        row[x] = 0;
                }
            }
    }
}

/* One axis of the transform: every line of cells along it is replaced by the least of its values
 * plus the square of the distance along the line. */
struct pass {
    const struct dph_clearance *grid;
    uint16_t *square;
    int axis;
    bool spread; /* to the two neighbours, instead */
};

static void transform_line(const struct pass *pass, uint16_t *line, ptrdiff_t stride, int n)
{
    uint16_t old[MAX_SIDE + 2];
    for (int i = 0; i < n; i++)
        old[i] = line[i * stride];
    for (int i = 0; i < n; i++) {
        int best = old[i];
        for (int d = 1; pass->spread ? d < 2 : d * d < best && (d <= i || i + d < n); d++) {
            int more = pass->spread ? 0 : d * d;
            if (d <= i && old[i - d] + more < best)
                best = old[i - d] + more;
            if (i + d < n && old[i + d] + more < best)
                best = old[i + d] + more;
        }
        line[i * stride] = (uint16_t)best;
    }
}

static void transform_plane(void *context, size_t plane, int worker)
{
    const struct pass *pass = context;
    const int *n = pass->grid->size;
    const ptrdiff_t stride[3] = {1, n[0], (ptrdiff_t)n[0] * n[1]};
    int outer = pass->axis == 2 ? 1 : 2, inner = pass->axis == 0 ? 1 : 0;
    (void)worker;
    for (int i = 0; i < n[inner]; i++)
        transform_line(pass, pass->square + (ptrdiff_t)plane * stride[outer] + i * stride[inner],
                       stride[pass->axis], n[pass->axis]);
}

/* Lays the grid around the positions: cells of about `cell`, and one cell of room on all sides. */
static double lay(struct dph_clearance *grid, const double low[3], const double high[3],
                  double cell)
{
    double largest = 0;
    for (int k = 0; k < 3; k++)
        largest = fmax(largest, high[k] - low[k]);
    grid->cell = fmax(fmin(cell, largest), largest / (MAX_SIDE - 3));
    grid->cells = 1 / grid->cell;
    grid->unit = grid->cell / FINENESS;
    for (int k = 0; k < 3; k++) {
        grid->size[k] = (int)((high[k] - low[k]) / grid->cell) + 3;
        grid->low[k] = low[k] - grid->cell;
    }
    return largest;
}

bool dph_clearance_init(struct dph_clearance *grid, const float *position, size_t npos,
                        const uint32_t *index, size_t ntri, double cell, int threads,
                        struct dph_error *err)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double largest, slack;
    *grid = (struct dph_clearance){0};
    for (size_t i = 0; i < 3 * npos; i++) {
        low[i % 3] = fmin(low[i % 3], (double)position[i]);
        high[i % 3] = fmax(high[i % 3], (double)position[i]);
    }
    double sides = high[0] - low[0] + high[1] - low[1] + high[2] - low[2];
    if (!npos || !(sides > 0 && sides < INFINITY))
        return true; /* nothing there, or nothing that has a size: 0 everywhere */
    for (;; cell = 2 * grid->cell) { /* large triangles by the million: coarser */
        largest = lay(grid, low, high, cell);
        slack = 4e-6 * largest * grid->cells + 1e-9 * MAX_SIDE;
        if (grid->cell >= largest ||
            effort(grid, position, index, ntri, slack) <= 3e7 + 16 * (double)ntri)
            break;
    }
    size_t count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
    uint16_t *square = dph_alloc(count, sizeof *square);
    grid->bound = dph_alloc(count, sizeof *grid->bound);
    if (!square || !grid->bound) {
        free(square);
        dph_clearance_finish(grid);
        return dph_fail_memory(err);
    }
    for (size_t i = 0; i < count; i++)
        square[i] = FAR;
    mark(grid, position, index, ntri, slack, square);
    for (int step = 0; step < 6; step++) {
        struct pass pass = {grid, square, step % 3, step < 3};
        dph_parallel(dph_thread_count(threads), (size_t)grid->size[pass.axis == 2 ? 1 : 2],
                     transform_plane, &pass);
    }
    for (size_t i = 0; i < count; i++)
        grid->bound[i] = (uint8_t)fmin(floor(FINENESS * sqrt(square[i])), UINT8_MAX);
    free(square);
    return true;
}

void dph_clearance_finish(struct dph_clearance *grid)
{
    free(grid->bound);
    *grid = (struct dph_clearance){0};
}
