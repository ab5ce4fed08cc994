/* diaphan/thickness.h - what a bake stores: SH coefficients of thickness, a row a vertex, packed.
 * Tier 1.
 *
 * Coefficient i = l(l+1)+m of a vertex is component i of its row, times scale[l]; the unit is
 * that of the mesh's positions. The thickness along a unit direction w of object space (towards
 * the light) is the sum of coefficient times y_lm(w). */
#ifndef DIAPHAN_THICKNESS_H
#define DIAPHAN_THICKNESS_H

#include <diaphan/sh.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Which length is the thickness of the body along a ray that starts at a vertex. */
enum dph_definition {
    DPH_THICKNESS_INSIDE = 0, /* all matter that the ray crosses, gaps not counted             */
    DPH_THICKNESS_FIRST,      /* to the first exit; 0 where the nearest crossing is an entry   */
    DPH_THICKNESS_FARTHEST,   /* to the last exit, gaps counted: what a depth map measures     */
};

/* How samples become coefficients. */
enum dph_fit {
    DPH_FIT_SPHERE = 0, /* projection over the whole sphere, the paper's                      */
    DPH_FIT_WEIGHTED,   /* least squares that cares for directions light comes through        */
};

/* How coefficients are stored: as IEEE floats; as signed normalized integers with one scale per
 * band; as clustered principal components, a cluster and a few signed normalized bytes that
 * weigh vectors of that cluster (cpca.h). */
enum dph_store { DPH_STORE_FLOAT = 0, DPH_STORE_SNORM16, DPH_STORE_SNORM8, DPH_STORE_CPCA };

/* The most vectors of a cluster that thickness is stored with. */
#define DPH_THICKNESS_MAX_VECTORS 36

/* The baked data of one body. Owns `data`. Safe to read from several threads. */
struct dph_thickness {
    size_t nvert;
    int bands;                       /* 1 to DPH_MAX_BANDS                                       */
    int components;                  /* per row: bands * bands, or vectors, rounded up to a multiple of 4, the rest are 0 */
    enum dph_store store;
    enum dph_definition definition;
    enum dph_fit fit;
    int directions;                  /* samples a vertex, 0 where the file does not say          */
    float scale[DPH_MAX_BANDS];      /* by band; 1 for DPH_STORE_FLOAT and DPH_STORE_CPCA        */
    void *data;                      /* (nvert x components) float, int16_t or int8_t; DPH_STORE_CPCA: weights, int8_t */
    /* DPH_STORE_CPCA, else 0 and NULL. The coefficients of vertex v are row 0 of the table of
     * its cluster plus the sum over j of weight j, after normalization, times row 1 + j. */
    int clusters, vectors;
    uint16_t *cluster;               /* (nvert), each < clusters                                 */
    float *table;                    /* (clusters x (1 + vectors) x bands * bands)               */
};

/* The names that files and the command line use ("inside", "weighted", "snorm8"); NULL beyond
 * the last. */
const char *dph_definition_name(enum dph_definition definition);
const char *dph_fit_name(enum dph_fit fit);
const char *dph_store_name(enum dph_store store);

/* Bytes of one component. */
size_t dph_store_size(enum dph_store store);

/* What it takes: bytes of one vertex without padding; the same as a vertex stage fetches them,
 * in attributes of a multiple of 4 bytes; bytes that all vertices share. */
size_t dph_thickness_payload(const struct dph_thickness *thickness);
size_t dph_thickness_fetched(const struct dph_thickness *thickness);
size_t dph_thickness_shared(const struct dph_thickness *thickness);

/* Packs rows of float coefficients. `coefficient` is (npos x bands * bands); row v of the result
 * is row row_of[v] of it (NULL: row v). The scale of a band is the largest magnitude in it over
 * all rows that are used, so that stored values span [-1, 1]. `directions`, `definition` and
 * `fit` are left for the caller to set. DPH_STORE_CPCA is made by dph_cpca_thickness instead.
 * NULL: DPH_ERROR_MEMORY. */
struct dph_thickness *dph_thickness_create(const float *coefficient, size_t npos, int bands,
                                           const uint32_t *row_of, size_t nvert,
                                           enum dph_store store, struct dph_error *err);

/* Frees it; accepts NULL. */
void dph_thickness_destroy(struct dph_thickness *thickness);

/* The bands * bands coefficients of one vertex, unpacked and scaled. */
void dph_thickness_row(const struct dph_thickness *thickness, size_t vertex,
                       float *coefficient /* (bands * bands) */);

/* The thickness of one vertex along a unit direction of object space, in the unit of the
 * positions, not clamped. */
double dph_thickness_along(const struct dph_thickness *thickness, size_t vertex,
                           const double direction[3]);

#ifdef __cplusplus
}
#endif
#endif
