/* trace/response.h - what the parts of the response bake share.      Tier 2, private. */
#ifndef DPH_TRACE_RESPONSE_H
#define DPH_TRACE_RESPONSE_H

#include <diaphan/response_bake.h>

#include "bake/welded.h"
#include "trace/walk.h"

#include <stdatomic.h>

/* A body in its medium. Read-only for the parts. */
struct dph_response_body {
    const struct dph_response_bake_params *params;
    const struct dph_welded *mesh;
    float *normal;  /* (npos x 3) unit length */
    size_t ncoef;   /* bands * bands */
    size_t length;  /* of a row: 3 * ncoef */
    int threads;
    struct dph_space space;
    float *near;    /* (npos) reach of the points that a position spends near to itself, 0: none */
};

/* Light that comes through without being scattered: fills rows (npos x length). `*cancelled` is
 * set where the progress callback says so. False: DPH_ERROR_MEMORY, _CANCELLED. */
bool dph_response_unscattered(const struct dph_response_body *body, double progress_span,
                              float *row, struct dph_error *err);

/* Adds thirds of the triangles' areas to those of their positions (npos). */
void dph_response_areas(const struct dph_welded *mesh, double *area);

/* A direction distributed as the cosine about -n, from two numbers in [0, 1): a unit vector evenly
 * over the sphere, added to -n. */
void dph_response_flight(const float n[3], double u, double v, double direction[3]);

/* Positions in groups that share their walks: group g holds order[start[g]] to
 * order[start[g + 1] - 1]. */
struct dph_groups {
    size_t count;
    uint32_t *order; /* (npos) */
    uint32_t *start; /* (npos + 1) */
    float *key;      /* (npos x 6) while groups are made */
};
bool dph_groups_init(struct dph_groups *groups, size_t npos, struct dph_error *err);
void dph_groups_finish(struct dph_groups *groups);

/* Makes groups not larger than `reach` along any of three random axes and of at most `most`
 * positions, by halving at random places. The same for the same random numbers. */
void dph_groups_make(struct dph_groups *groups, const float *position, const float *normal,
                     size_t npos, double reach, size_t most, struct dph_random random);

/* One pass of walks. */
struct dph_response_pass {
    const struct dph_response_body *body;
    const struct dph_groups *groups;
    int number;           /* of the pass: other numbers are independent */
    int splits;           /* walks from a point */
    float *row;           /* (npos x length) light that was scattered is added to it */
    double *square;       /* (npos) squares of what this pass adds to the first 6 bands */
    void *scratch;        /* (threads) */
    double progress_begin, progress_span;
    atomic_bool cancelled;
};
struct dph_response_count {
    uint64_t walks, scatterings, lost, capped;
};

/* Memory of all workers for groups of at most `most`. NULL: out of memory. */
void *dph_response_scratch_create(const struct dph_response_body *body, size_t most);
void dph_response_scratch_destroy(void *scratch, int threads);

/* Runs it. False: cancelled. */
bool dph_response_pass_run(struct dph_response_pass *pass);

/* Adds up what all workers counted so far. */
struct dph_response_count dph_response_counted(const void *scratch, int threads);

#endif
