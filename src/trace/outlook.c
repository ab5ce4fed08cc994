/* Chances for next-event estimation.
 *
 * A ray to a light costs as much as ten scatterings, and from most points of a dense body it
 * brings next to nothing. So it is cast by chance, and what it brings is divided by the chance. The variance
 * at a given effort is least where chances follow the expected contribution. That is guessed from a
 * grid of the inside length towards each light: one ray from the centre of each cell, and then the
 * least length among a cell and its 26 neighbours, since too small a chance does more harm than
 * one too large. How wrong the guess may be is limited by path.c. */
#include "trace/outlook.h"

#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SIDE = 64, MAX_CELLS = 1 << 19 };

static double cells_of(const struct dph_clearance *grid, int coarser)
{
    double count = 1;
    for (int k = 0; k < 3; k++)
        count *= (grid->size[k] + coarser - 1) / coarser;
    return count;
}

struct survey {
    const struct dph_space *space;
    const struct dph_outlook *outlook;
    const double *direction;
    const uint8_t *from;
    uint8_t *to;
};

static void look(void *context, size_t z, int worker)
{
    const struct survey *survey = context;
    const struct dph_outlook *outlook = survey->outlook;
    const int *n = outlook->size;
    uint8_t *depth =
        survey->to + z * (size_t)n[1] * (size_t)n[0] * (size_t)outlook->nlight;
    (void)worker;
    unsigned int before = dph_rays_enter();
    for (int y = 0; y < n[1]; y++)
        for (int x = 0; x < n[0]; x++)
            for (int i = 0; i < outlook->nlight; i++, depth++) {
                struct dph_spans spans;
                const double point[3] = {outlook->low[0] + (x + .5) / outlook->cells,
                                         outlook->low[1] + (y + .5) / outlook->cells,
                                         outlook->low[2] + ((double)z + .5) / outlook->cells};
                dph_rays_spans(survey->space->rays, point, survey->direction + 3 * i, &spans);
                *depth = (uint8_t)fmin(spans.length / outlook->unit, UINT8_MAX);
            }
    dph_rays_leave(before);
}

static void spread(void *context, size_t z, int worker)
{
    const struct survey *survey = context;
    const struct dph_outlook *outlook = survey->outlook;
    const int *n = outlook->size, count = outlook->nlight;
    (void)worker;
    for (int y = 0; y < n[1]; y++)
        for (int x = 0; x < n[0]; x++)
            for (int i = 0; i < count; i++) {
                uint8_t least = UINT8_MAX;
                for (int w = (int)z - (z > 0); w <= (int)z + ((int)z + 1 < n[2]); w++)
                    for (int v = y - (y > 0); v <= y + (y + 1 < n[1]); v++)
                        for (int u = x - (x > 0); u <= x + (x + 1 < n[0]); u++) {
                            size_t cell = ((size_t)w * (size_t)n[1] + (size_t)v) * (size_t)n[0] +
                                          (size_t)u;
                            uint8_t depth = survey->from[cell * (size_t)count + (size_t)i];
                            least = depth < least ? depth : least;
                        }
                size_t cell = (z * (size_t)n[1] + (size_t)y) * (size_t)n[0] + (size_t)x;
                survey->to[cell * (size_t)count + (size_t)i] = least;
            }
}

bool dph_outlook_init(struct dph_outlook *outlook, const struct dph_space *space,
                      const double *direction, int nlight, int threads, struct dph_error *err)
{
    const struct dph_clearance *grid = &space->clearance;
    double extinction = space->volume.thinnest;
    size_t count = (size_t)nlight;
    int coarser = 1;
    *outlook = (struct dph_outlook){.nlight = nlight};
    for (int i = 0; i < 256; i++)
        outlook->cleared[i] = exp(-extinction * grid->unit * i);
    if (!nlight || !grid->bound)
        return true;
    for (int k = 0; k < 3; k++)
        while (grid->size[k] > MAX_SIDE * coarser)
            coarser++;
    while (cells_of(grid, coarser) * (double)nlight > MAX_CELLS)
        coarser++;
    outlook->cells = grid->cells / coarser;
    outlook->unit = extinction > 0 ? 8 / extinction / UINT8_MAX : INFINITY; /* up to exp(-8) */
    for (int k = 0; k < 3; k++) {
        outlook->low[k] = grid->low[k];
        outlook->size[k] = (grid->size[k] + coarser - 1) / coarser;
        count *= (size_t)outlook->size[k];
    }
    for (int i = 0; i < 256; i++)
        outlook->passed[i] = extinction > 0 ? exp(-8. * i / UINT8_MAX) : 1;
    uint8_t *depth = dph_alloc(count, 1);
    outlook->depth = dph_alloc(count, 1);
    if (!depth || !outlook->depth) {
        free(depth);
        dph_outlook_finish(outlook);
        return dph_fail_memory(err);
    }
    struct survey survey = {space, outlook, direction, depth, depth};
    dph_parallel(dph_thread_count(threads), (size_t)outlook->size[2], look, &survey);
    survey.to = outlook->depth;
    dph_parallel(dph_thread_count(threads), (size_t)outlook->size[2], spread, &survey);
    free(depth);
    return true;
}

void dph_outlook_finish(struct dph_outlook *outlook)
{
    free(outlook->depth);
    *outlook = (struct dph_outlook){0};
}
