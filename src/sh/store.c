/* Packed storage of coefficients: one scale a band, signed normalized integers.
 *
 * Coefficients shrink from band to band, so each band gets the range of its own: with s_l the
 * largest magnitude of band l over the whole body, c / s_l lies in [-1, 1] and is stored as
 * round(127 c / s_l) (or 32767), which is how glTF reads normalized integers back (glTF 2.0,
 * 3.6.2.2). The error of a coefficient is at most s_l / 254 (s_l / 65534). The scales are common to
 * all vertices: drawing multiplies them into the values of the light, and the shader never sees
 * them.
 *
 * A band without any content gets the scale 1, so that nothing that reads the file has to guard a
 * division. */
#include <diaphan/thickness.h>

#include "core/fail.h"
#include "core/memory.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const definition_names[] = {"inside", "first", "farthest"};
static const char *const fit_names[] = {"sphere", "weighted"};
static const struct {
    const char *name;
    size_t size;
    float steps; /* of [0, 1] */
} stores[] = {
    [DPH_STORE_FLOAT] = {"float", sizeof(float), 0},
    [DPH_STORE_SNORM16] = {"snorm16", sizeof(int16_t), 32767},
    [DPH_STORE_SNORM8] = {"snorm8", sizeof(int8_t), 127},
    [DPH_STORE_CPCA] = {"cpca", sizeof(int8_t), 127},
};

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

const char *dph_definition_name(enum dph_definition definition)
{
    return (size_t)definition < COUNT(definition_names) ? definition_names[definition] : NULL;
}

const char *dph_fit_name(enum dph_fit fit)
{
    return (size_t)fit < COUNT(fit_names) ? fit_names[fit] : NULL;
}

const char *dph_store_name(enum dph_store store)
{
    return (size_t)store < COUNT(stores) ? stores[store].name : NULL;
}

size_t dph_store_size(enum dph_store store)
{
    return (size_t)store < COUNT(stores) ? stores[store].size : 0;
}

size_t dph_thickness_payload(const struct dph_thickness *thickness)
{
    if (thickness->store == DPH_STORE_CPCA)
        return (size_t)thickness->vectors + (thickness->clusters <= 256 ? 1 : 2);
    return (size_t)(thickness->bands * thickness->bands) * dph_store_size(thickness->store);
}

size_t dph_thickness_fetched(const struct dph_thickness *thickness)
{
    size_t row = (size_t)thickness->components * dph_store_size(thickness->store);
    return thickness->store == DPH_STORE_CPCA ? row + 4 : row;
}

size_t dph_thickness_shared(const struct dph_thickness *thickness)
{
    return (size_t)thickness->clusters * (1 + (size_t)thickness->vectors) *
           (size_t)(thickness->bands * thickness->bands) * sizeof *thickness->table;
}

/* Which of the rows some vertex uses: padding and welded leftovers must not widen a scale. */
static unsigned char *mark_used(const uint32_t *row_of, size_t nvert, size_t npos)
{
    unsigned char *used = dph_alloc_zero(npos, 1);
    if (!used)
        return NULL;
    for (size_t v = 0; v < nvert; v++) {
        assert(row_of[v] < npos);
        used[row_of[v]] = 1;
    }
    return used;
}

/* Largest magnitude of each coefficient over the used rows, then of each band. NaN never wins a
 * comparison. */
static void find_scales(const float *coefficient, const unsigned char *used, size_t rows,
                        int bands, float *scale)
{
    int n = bands * bands;
    float largest[DPH_MAX_BANDS * DPH_MAX_BANDS] = {0};
    for (size_t r = 0; r < rows; r++) {
        if (used && !used[r])
            continue;
        const float *row = coefficient + r * (size_t)n;
        for (int i = 0; i < n; i++) {
            float magnitude = fabsf(row[i]);
            largest[i] = magnitude > largest[i] ? magnitude : largest[i];
        }
    }
    for (int l = 0; l < bands; l++) {
        float most = 0;
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            most = largest[i] > most ? largest[i] : most;
        scale[l] = most > 0 ? most : 1;
    }
}

/* Stored integer of a coefficient: to nearest, halves away from zero, never outside -steps .. steps
 * (nor for NaN). */
static inline int quantize(float c, float scale, float steps)
{
    float q = c / scale * steps;
    q = q > -steps ? q : -steps;
    q = q < steps ? q : steps;
    return (int)(q + (q < 0 ? -.5f : .5f));
}

struct dph_thickness *dph_thickness_create(const float *coefficient, size_t npos, int bands,
                                           const uint32_t *row_of, size_t nvert,
                                           enum dph_store store, struct dph_error *err)
{
    assert(bands >= 1 && bands <= DPH_MAX_BANDS && (row_of || nvert <= npos));
    assert((size_t)store < COUNT(stores) && store != DPH_STORE_CPCA);
    int n = bands * bands;
    float scale[DPH_MAX_BANDS * DPH_MAX_BANDS]; /* by coefficient */
    unsigned char *used = NULL;
    struct dph_thickness *t = dph_alloc_zero(1, sizeof *t);
    if (!t)
        goto error;
    t->nvert = nvert;
    t->bands = bands;
    t->components = (n + 3) & ~3;
    t->store = store;
    t->data = dph_alloc_zero(nvert, (size_t)t->components * stores[store].size);
    if (!t->data)
        goto error;
    for (int l = 0; l < DPH_MAX_BANDS; l++)
        t->scale[l] = 1;
    if (store != DPH_STORE_FLOAT) {
        if (row_of && !(used = mark_used(row_of, nvert, npos)))
            goto error;
        find_scales(coefficient, used, row_of ? npos : nvert, bands, t->scale);
        free(used);
    }
    for (int l = 0; l < bands; l++)
        for (int i = l * l; i < (l + 1) * (l + 1); i++)
            scale[i] = t->scale[l];

    const float steps = stores[store].steps;
    for (size_t v = 0; v < nvert; v++) {
        const float *row = coefficient + (row_of ? row_of[v] : v) * (size_t)n;
        size_t first = v * (size_t)t->components;
        if (store == DPH_STORE_FLOAT) {
            memcpy((float *)t->data + first, row, (size_t)n * sizeof *row);
        } else if (store == DPH_STORE_SNORM16) {
            int16_t *out = (int16_t *)t->data + first;
            for (int i = 0; i < n; i++)
                out[i] = (int16_t)quantize(row[i], scale[i], steps);
        } else {
            int8_t *out = (int8_t *)t->data + first;
            for (int i = 0; i < n; i++)
                out[i] = (int8_t)quantize(row[i], scale[i], steps);
        }
    }
    return t;

error:
    dph_thickness_destroy(t);
    dph_fail_memory(err);
    return NULL;
}

void dph_thickness_destroy(struct dph_thickness *thickness)
{
    if (!thickness)
        return;
    free(thickness->data);
    free(thickness->cluster);
    free(thickness->table);
    free(thickness);
}

/* glTF lets the integer below -steps stand for -1 too; files of others may hold it. */
static inline float normalized(int stored, float steps)
{
    float value = (float)stored / steps;
    return value > -1 ? value : -1;
}

static void row_of_cluster(const struct dph_thickness *thickness, size_t vertex, float *coefficient)
{
    size_t n = (size_t)(thickness->bands * thickness->bands), vectors = (size_t)thickness->vectors;
    const int8_t *weight = (const int8_t *)thickness->data + vertex * (size_t)thickness->components;
    const float *row = thickness->table + thickness->cluster[vertex] * (1 + vectors) * n;
    memcpy(coefficient, row, n * sizeof *row);
    for (size_t j = 0; j < vectors; j++) {
        row += n;
        for (size_t i = 0; i < n; i++)
            coefficient[i] += normalized(weight[j], stores[DPH_STORE_CPCA].steps) * row[i];
    }
}

void dph_thickness_row(const struct dph_thickness *thickness, size_t vertex, float *coefficient)
{
    assert(vertex < thickness->nvert);
    if (thickness->store == DPH_STORE_CPCA) {
        row_of_cluster(thickness, vertex, coefficient);
        return;
    }
    size_t first = vertex * (size_t)thickness->components;
    float steps = stores[thickness->store].steps;
    for (int l = 0; l < thickness->bands; l++) {
        float scale = thickness->scale[l];
        for (int i = l * l; i < (l + 1) * (l + 1); i++) {
            size_t at = first + (size_t)i;
            switch (thickness->store) {
            case DPH_STORE_FLOAT:
                coefficient[i] = ((const float *)thickness->data)[at] * scale;
                break;
            case DPH_STORE_SNORM16:
                coefficient[i] = normalized(((const int16_t *)thickness->data)[at], steps) * scale;
                break;
            case DPH_STORE_SNORM8:
                coefficient[i] = normalized(((const int8_t *)thickness->data)[at], steps) * scale;
                break;
            case DPH_STORE_CPCA:
                break;
            }
        }
    }
}

double dph_thickness_along(const struct dph_thickness *thickness, size_t vertex,
                           const double direction[3])
{
    float coefficient[DPH_MAX_BANDS * DPH_MAX_BANDS];
    double value[DPH_MAX_BANDS * DPH_MAX_BANDS], sum = 0;
    dph_thickness_row(thickness, vertex, coefficient);
    dph_sh_eval(thickness->bands, direction, value);
    for (int i = 0; i < thickness->bands * thickness->bands; i++)
        sum += coefficient[i] * value[i];
    return sum;
}
