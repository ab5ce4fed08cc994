/* diaphan/cpca.h - clustered principal component analysis: many long signals in a few bytes each.      Tier 2.
 *
 * A signal x of cluster k is m_k + sum over j of w_j e_kj: the cluster's mean and a few vectors,
 * common to all of its members, and weights of its own (Sloan, Hall, Hart, Snyder 2003). What
 * depends on a signal linearly - thickness towards a light, radiance under a lighting - is
 * computed for means and vectors once, and costs a signal as many products as there are vectors. */
#ifndef DIAPHAN_CPCA_H
#define DIAPHAN_CPCA_H

#include <diaphan/thickness.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DPH_CPCA_MAX_CLUSTERS 4096
#define DPH_CPCA_MAX_ITERATIONS 64

/* struct dph_cpca_params p = dph_cpca_defaults(); */
struct dph_cpca_params {
    int clusters;    /* 1 to DPH_CPCA_MAX_CLUSTERS; 128                                            */
    int vectors;     /* a cluster, from 1 on, never more are made than signals have numbers; 8      */
    int iterations;  /* with all vectors, 1 to DPH_CPCA_MAX_ITERATIONS, fewer where the error stands still; 20 */
    uint64_t seed;   /* of the choice of first clusters; 1                                         */
    int threads;     /* 0: as many as there are processors; 0                                      */
    bool portable;   /* use no processor-specific code (the bytes are the same); false             */
    dph_progress *progress; /* Nullable; NULL                                                      */
    void *progress_user;
};

struct dph_cpca_params dph_cpca_defaults(void);

/* Compressed signals. Owns its arrays. Safe to read from several threads. Errors are relative:
 * root of the sum of squared differences over the sum of squares, by weight, 0 where all signals
 * are 0. */
struct dph_cpca {
    size_t count;
    int n;              /* numbers of a signal                                                     */
    int clusters;       /* as many as were asked for, fewer where signals are few or alike; 0: no signals */
    int vectors;
    uint16_t *cluster;  /* (count)                                                                 */
    float *weight;      /* (count x vectors) -1 to 1; in each cluster the largest magnitude of each weight is 1, or all are 0 */
    float *table;       /* (clusters x (1 + vectors) x n) mean, then vectors by falling share, orthogonal, each as long as
                         * its largest weight before that became 1                                 */
    double error;        /* with the weights as they are                                           */
    double error_snorm8; /* with the weights rounded by dph_cpca_snorm8                            */
    int iterations;      /* that were made with all vectors                                        */
    double history[DPH_CPCA_MAX_ITERATIONS]; /* (iterations) error after each                      */
};

/* Compresses `count` signals of `n` numbers, 1 to 1024. `importance` (count), Nullable: what a
 * signal's error counts for, finite and not negative, the area around a vertex for instance; NULL:
 * all count the same. Signals are the rows of a mesh's distinct positions, not of its vertices.
 * The same input and parameters give the same bytes for any number of threads and on any
 * processor.
 * NULL: DPH_ERROR_ARGUMENT (a parameter out of range), DPH_ERROR_INPUT (a number that is not
 * finite), DPH_ERROR_MEMORY, DPH_ERROR_CANCELLED. */
struct dph_cpca *dph_cpca_create(const float *signal /* (count x n) */, size_t count, int n,
                                 const float *importance, const struct dph_cpca_params *params,
                                 struct dph_error *err);

/* Frees it; accepts NULL. */
void dph_cpca_destroy(struct dph_cpca *cpca);

/* Signal `i` from its weights. */
void dph_cpca_row(const struct dph_cpca *cpca, size_t i, float *signal /* (n) */);

/* A weight as a signed normalized byte, to nearest, halves away from zero: -127 to 127. */
int8_t dph_cpca_snorm8(float weight);

/* Packs rows of float coefficients as DPH_STORE_CPCA; arguments as dph_thickness_create, `cpca` is
 * made of the same `coefficient` (npos x bands * bands). NULL: DPH_ERROR_ARGUMENT (more than
 * DPH_THICKNESS_MAX_VECTORS vectors), DPH_ERROR_MEMORY. */
struct dph_thickness *dph_cpca_thickness(const struct dph_cpca *cpca, int bands,
                                         const uint32_t *row_of, size_t nvert,
                                         struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
