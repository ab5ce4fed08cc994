/* The nearest positions along a mesh: a search over its edges, nearest first (Dijkstra 1959, with
 * distances as the crow flies). So another body close by, or the other side of a gap, is no
 * neighbour, and dense places cost no more than others. A position with very many edges, the middle
 * of a fan, passes on to the first of them only. */
#include "bake/neighbours.h"

#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <stdlib.h>

enum {
    HUB = 128, /* edges that are followed from a position, each twice */
    TASK = 64,
};

struct edges {
    uint32_t *start; /* (npos + 1) */
    uint32_t *to;    /* (6 x ntri) each edge of each triangle, both ways */
};

static bool edges_init(struct edges *edges, size_t npos, const uint32_t *index, size_t ntri)
{
    edges->start = dph_alloc_zero(npos + 2, sizeof *edges->start);
    edges->to = dph_alloc(6 * ntri, sizeof *edges->to);
    if (!edges->start || !edges->to)
        return false;
    uint32_t *end = edges->start + 1;
    for (size_t i = 0; i < 3 * ntri; i++)
        end[index[i] + 1] += 2;
    for (size_t p = 0; p < npos; p++)
        end[p + 1] += end[p];
    for (size_t t = 0; t < ntri; t++)
        for (size_t i = 0; i < 3; i++)
            for (size_t j = 1; j < 3; j++)
                edges->to[end[index[3 * t + i]]++] = index[3 * t + (i + j) % 3];
    return true;
}

/* Positions met but not yet taken, a binary heap: nearest first, of equals the first. */
struct front {
    double square;
    uint32_t position;
};

static bool nearer(const struct front *a, const struct front *b)
{
    return a->square < b->square || (a->square == b->square && a->position < b->position);
}

static void push(struct front *heap, size_t *count, struct front item)
{
    size_t i = (*count)++;
    for (; i && nearer(&item, &heap[(i - 1) / 2]); i = (i - 1) / 2)
        heap[i] = heap[(i - 1) / 2];
    heap[i] = item;
}

static struct front pop(struct front *heap, size_t *count)
{
    struct front first = heap[0], last = heap[--*count];
    size_t i = 0;
    for (size_t child; (child = 2 * i + 1) < *count; i = child) {
        child += child + 1 < *count && nearer(&heap[child + 1], &heap[child]);
        if (!nearer(&heap[child], &last))
            break;
        heap[i] = heap[child];
    }
    heap[i] = last;
    return first;
}

struct search {
    struct dph_neighbours *found;
    const float *position;
    size_t npos;
    const struct edges *edges;
    uint32_t *seen;     /* (threads x npos) the last position + 1 that met it */
    struct front *heap; /* (threads x (DPH_NEIGHBOURS + 1) x HUB) */
};

static void search_range(void *context, size_t task, int worker)
{
    const struct search *search = context;
    const struct edges *edges = search->edges;
    uint32_t *seen = search->seen + (size_t)worker * search->npos;
    struct front *heap = search->heap + (size_t)worker * (DPH_NEIGHBOURS + 1) * HUB;
    for (size_t p = task * TASK; p < search->npos && p < (task + 1) * TASK; p++) {
        size_t waiting = 0, count = 0;
        uint32_t at = (uint32_t)p;
        seen[p] = (uint32_t)p + 1;
        for (;;) {
            size_t begin = edges->start[at], end = edges->start[at + 1];
            for (size_t e = begin; e < end && e < begin + HUB; e++) {
                uint32_t q = edges->to[e];
                if (seen[q] == (uint32_t)p + 1)
                    continue;
                seen[q] = (uint32_t)p + 1;
                push(heap, &waiting,
                     (struct front){dph_square_between(search->position + 3 * p,
                                                   search->position + 3 * (size_t)q), q});
            }
            if (!waiting || count == DPH_NEIGHBOURS)
                break;
            at = pop(heap, &waiting).position;
            search->found->list[p * DPH_NEIGHBOURS + count++] = at;
        }
        search->found->count[p] = (uint8_t)count;
    }
}

bool dph_neighbours_init(struct dph_neighbours *neighbours, const float *position, size_t npos,
                         const uint32_t *index, size_t ntri, int threads, struct dph_error *err)
{
    struct edges edges = {NULL, NULL};
    struct search search = {
        .found = neighbours, .position = position, .npos = npos, .edges = &edges};
    size_t workers = (size_t)dph_thread_count(threads);
    bool ok = false;
    neighbours->list = dph_alloc(npos, DPH_NEIGHBOURS * sizeof *neighbours->list);
    neighbours->count = dph_alloc(npos, sizeof *neighbours->count);
    search.seen = dph_alloc_zero(workers, npos * sizeof *search.seen);
    search.heap = dph_alloc(workers, (DPH_NEIGHBOURS + 1) * HUB * sizeof *search.heap);
    if (neighbours->list && neighbours->count && search.seen && search.heap &&
        edges_init(&edges, npos, index, ntri)) {
        dph_parallel((int)workers, (npos + TASK - 1) / TASK, search_range, &search);
        ok = true;
    } else {
        dph_fail_memory(err);
    }
    free(edges.start);
    free(edges.to);
    free(search.seen);
    free(search.heap);
    return ok;
}

void dph_neighbours_finish(struct dph_neighbours *neighbours)
{
    free(neighbours->list);
    free(neighbours->count);
    *neighbours = (struct dph_neighbours){NULL, NULL};
}
