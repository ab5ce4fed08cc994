/* Thickness stored as clustered principal components: bytes for the weights, the cluster's number,
 * and the table. */
#include <diaphan/cpca.h>

#include "core/fail.h"
#include "core/memory.h"

#include <assert.h>
#include <string.h>

struct dph_thickness *dph_cpca_thickness(const struct dph_cpca *cpca, int bands,
                                         const uint32_t *row_of, size_t nvert,
                                         struct dph_error *err)
{
    assert(bands >= 1 && bands <= DPH_MAX_BANDS && cpca->n == bands * bands);
    assert(row_of || nvert <= cpca->count);
    size_t vectors = (size_t)cpca->vectors, table = (size_t)cpca->clusters * (1 + vectors) * (size_t)cpca->n;
    if (vectors > DPH_THICKNESS_MAX_VECTORS) {
        dph_fail(err, DPH_ERROR_ARGUMENT, "%zu vectors a cluster, thickness is stored with at most %d", vectors,
                 DPH_THICKNESS_MAX_VECTORS);
        return NULL;
    }
    struct dph_thickness *t = dph_alloc_zero(1, sizeof *t);
    if (!t)
        goto error;
    t->nvert = nvert;
    t->bands = bands;
    t->components = (cpca->vectors + 3) & ~3;
    t->store = DPH_STORE_CPCA;
    t->clusters = cpca->clusters;
    t->vectors = cpca->vectors;
    for (int l = 0; l < DPH_MAX_BANDS; l++)
        t->scale[l] = 1;
    t->data = dph_alloc_zero(nvert, (size_t)t->components);
    t->cluster = dph_alloc(nvert, sizeof *t->cluster);
    t->table = dph_alloc(table, sizeof *t->table);
    if (!t->data || !t->cluster || !t->table)
        goto error;
    if (table)
        memcpy(t->table, cpca->table, table * sizeof *t->table);
    for (size_t v = 0; v < nvert; v++) {
        size_t row = row_of ? row_of[v] : v;
        int8_t *out = (int8_t *)t->data + v * (size_t)t->components;
        assert(row < cpca->count);
        t->cluster[v] = cpca->cluster[row];
        for (size_t j = 0; j < vectors; j++)
            out[j] = dph_cpca_snorm8(cpca->weight[row * vectors + j]);
    }
    return t;

error:
    dph_thickness_destroy(t);
    dph_fail_memory(err);
    return NULL;
}
