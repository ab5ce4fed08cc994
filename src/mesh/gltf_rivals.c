/* glTF: reading what the methods beside SHSSS store: changed normals, transfer vectors and their
 * compressed form. All primitives of a mesh have them with the same description, or none has.
 * Format: docs/file-format.md. */
#include "mesh/gltf.h"

#include "core/fail.h"
#include "core/memory.h"

#include <diaphan/rivals.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Accessors without bytes behind them could ask for any memory: what is beyond this must be in
 * proportion to the bytes there are (compressed views may be that much smaller). */
#define FREE_BYTES ((size_t)1 << 28)
#define BYTES_PER_BYTE 64

/* The description `key` that all parts of a body have; *d is NULL where none has it. `place` names
 * the first. */
static bool find(const struct dph_document *doc, size_t first, size_t last, const char *key,
                 const json_t **d, char place[120], struct dph_error *err)
{
    size_t found = 0;
    *d = NULL;
    for (size_t p = first; p < last; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        const json_t *extras = json_object_get(dph_gltf_primitive(doc, part), "extras");
        json_t *own = json_object_get(json_object_get(extras, "diaphan"), key);
        snprintf(place, 120, "meshes[%zu].primitives[%zu].extras.diaphan.%s", part->mesh,
                 part->primitive, key);
        if (!own)
            continue;
        if (!json_is_object(own))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "is not an object");
        if (*d && !json_equal(own, *d))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                                 "differs from that of meshes[%zu].primitives[%zu]; bake the model again",
                                 doc->part[first].mesh, doc->part[first].primitive);
        *d = own;
        found++;
    }
    snprintf(place, 120, "meshes[%zu].primitives[%zu].extras.diaphan.%s", doc->part[first].mesh,
             doc->part[first].primitive, key);
    if (found && found != last - first)
        return dph_gltf_fail(doc, "", DPH_ERROR_INPUT, err,
                             "meshes[%zu]: only %zu of its %zu triangle primitives have %s; bake "
                             "the model again", doc->part[first].mesh, found, last - first, key);
    return true;
}

static bool parse_coefficients(const struct dph_document *doc, const json_t *material,
                               const char *key, const char *place, double value[3],
                               struct dph_error *err)
{
    bool found;
    if (!dph_gltf_numbers(doc, material, key, place, 3, value, &found, err))
        return false;
    if (!found)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s is missing", key);
    for (int c = 0; c < 3; c++)
        if (!(value[c] >= 0 && value[c] <= 1e6))
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s[%d] is %g, not 0 to 1e6",
                                 key, c, value[c]);
    return true;
}

bool dph_gltf_read_origin(const struct dph_document *doc, const json_t *d, const char *place,
                          struct dph_rivals_origin *origin, struct dph_error *err)
{
    json_t *material;
    char at[140];
    size_t directions;
    *origin = (struct dph_rivals_origin){0};
    if (!dph_gltf_object(doc, d, "material", place, &material, err))
        return false;
    if (!material)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "material is missing");
    snprintf(at, sizeof at, "%s.material", place);
    const char *name = json_string_value(json_object_get(material, "name"));
    snprintf(origin->material, sizeof origin->material, "%s", name ? name : "");
    if (!parse_coefficients(doc, material, "scattering", at, origin->scattering, err) ||
        !parse_coefficients(doc, material, "absorption", at, origin->absorption, err))
        return false;
    const json_t *anisotropy = json_object_get(material, "anisotropy");
    origin->anisotropy = json_number_value(anisotropy);
    if (anisotropy && (!json_is_number(anisotropy) ||
                       !(origin->anisotropy > -1 && origin->anisotropy < 1)))
        return dph_gltf_fail(doc, at, DPH_ERROR_INPUT, err,
                             "anisotropy is not a number between -1 and 1");
    if (!dph_gltf_size(doc, d, "directions", place, 0, 1 << 30, &directions, err))
        return false;
    origin->directions = (int)directions;
    origin->mm_per_unit = json_number_value(json_object_get(d, "mm_per_unit"));
    if (!(origin->mm_per_unit > 0))
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "mm_per_unit is %g, not a number above 0", origin->mm_per_unit);
    return true;
}

bool dph_gltf_check_rows(const struct dph_document *doc, size_t nvert, size_t row,
                         const char *place, struct dph_error *err)
{
    if (nvert > FREE_BYTES / row && nvert / BYTES_PER_BYTE > doc->total / row)
        return dph_gltf_fail(doc, place, DPH_ERROR_LIMIT, err,
                             "%zu vertices of %zu bytes each out of %zu bytes", nvert, row,
                             doc->total);
    return true;
}

/* Opens an attribute that must be FLOAT. */
static bool open_floats(struct dph_document *doc, const struct dph_gltf_part *part,
                        const char *name, int components, struct dph_gltf_accessor *a,
                        char place[120], struct dph_error *err)
{
    if (!dph_gltf_open_attribute(doc, part, name, components, a, place, err))
        return false;
    return a->type == DPH_GLTF_FLOAT ||
           dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s, not FLOAT",
                         dph_gltf_component_name(a->type));
}

static bool read_normals(struct dph_document *doc, struct dph_body *body, const json_t *d,
                         const char *where, size_t first, size_t last, struct dph_error *err)
{
    struct dph_rivals *rivals = body->rivals;
    struct dph_gltf_accessor a;
    char place[120];
    if (!dph_gltf_read_version(doc, d, where, err) ||
        !dph_gltf_read_origin(doc, d, where, &rivals->normal_origin, err))
        return false;
    if (!(rivals->normal = dph_alloc(body->mesh.nvert, 3 * sizeof *rivals->normal)))
        return dph_fail_memory(err);
    for (size_t p = first; p < last; p++)
        if (!open_floats(doc, &doc->part[p], "_PATRO_NORMAL", 3, &a, place, err) ||
            !dph_gltf_floats(doc, &a, place, rivals->normal + 3 * doc->part[p].first, err))
            return false;
    rivals->products |= DPH_PRODUCT_NORMALS;
    return true;
}

/* What both forms of transfer vectors say; rows are those of the vertices. The second that is read
 * must agree with the first. */
static bool parse_transfer(const struct dph_document *doc, struct dph_body *body, const json_t *d,
                           const char *where, struct dph_error *err)
{
    struct dph_transfer *t = &body->rivals->transfer;
    struct dph_rivals_origin origin, *had = &body->rivals->transfer_origin;
    int bands;
    if (!dph_gltf_read_version(doc, d, where, err) ||
        !dph_gltf_read_basis(doc, d, where, DPH_DRAW_BANDS, &bands, err) ||
        !dph_gltf_read_origin(doc, d, where, &origin, err))
        return false;
    if (t->npos) {
        bool same = bands == t->bands && origin.anisotropy == had->anisotropy &&
                    !memcmp(origin.scattering, had->scattering, sizeof had->scattering) &&
                    !memcmp(origin.absorption, had->absorption, sizeof had->absorption) &&
                    origin.mm_per_unit == had->mm_per_unit && origin.directions == had->directions;
        return same || dph_gltf_fail(doc, where, DPH_ERROR_INPUT, err,
                                     "was baked otherwise than prt beside it; bake the model again");
    }
    *had = origin;
    *t = (struct dph_transfer){.nvert = body->mesh.nvert,
                               .bands = bands,
                               .channels = 3,
                               .length = 3 * (size_t)(bands * bands)};
    if (!(t->position_of = dph_alloc(t->nvert, sizeof *t->position_of)))
        return dph_fail_memory(err);
    for (size_t v = 0; v < t->nvert; v++)
        t->position_of[v] = (uint32_t)v;
    t->npos = t->nvert;
    return true;
}

static bool read_transfer(struct dph_document *doc, struct dph_body *body, const json_t *d,
                          const char *where, size_t first, size_t last, struct dph_error *err)
{
    struct dph_transfer *t = &body->rivals->transfer;
    struct dph_gltf_accessor a;
    char place[120], name[32];
    float *four = NULL;
    if (!parse_transfer(doc, body, d, where, err) ||
        !dph_gltf_check_rows(doc, t->npos, t->length * sizeof(float), where, err))
        return false;
    if (!(t->vector = dph_alloc(t->npos, t->length * sizeof *t->vector)))
        return dph_fail_memory(err);
    bool ok = true;
    for (size_t p = first; p < last && ok; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        if (!(four = dph_alloc(part->count, 4 * sizeof *four)))
            return dph_fail_memory(err);
        for (size_t i = 0; 4 * i < t->length && ok; i++) {
            size_t used = t->length - 4 * i < 4 ? t->length - 4 * i : 4;
            snprintf(name, sizeof name, "_PRT_SH_%d", (int)i);
            ok = open_floats(doc, part, name, 4, &a, place, err) &&
                 dph_gltf_floats(doc, &a, place, four, err);
            for (size_t v = 0; v < part->count && ok; v++)
                memcpy(t->vector + (part->first + v) * t->length + 4 * i, four + 4 * v,
                       used * sizeof *four);
        }
        free(four);
    }
    if (ok)
        body->rivals->products |= DPH_PRODUCT_TRANSFER;
    return ok;
}

static bool read_clusters(struct dph_document *doc, struct dph_body *body, const json_t *d,
                          const char *where, size_t first, size_t last, struct dph_error *err)
{
    size_t view, nvert = body->mesh.nvert;
    int8_t *weight = NULL;
    bool ok = false;
    if (!parse_transfer(doc, body, d, where, err))
        return false;
    struct dph_cpca *cpca = body->rivals->clusters = dph_alloc_zero(1, sizeof *cpca);
    if (!cpca)
        return dph_fail_memory(err);
    cpca->count = nvert;
    cpca->n = (int)body->rivals->transfer.length;
    if (!dph_gltf_read_counts(doc, d, where, &cpca->clusters, &cpca->vectors, &view, err))
        return false;
    if (cpca->clusters > DPH_CPCA_MAX_CLUSTERS)
        return dph_gltf_fail(doc, where, DPH_ERROR_INPUT, err, "clusters is %d, not 1 to %d",
                             cpca->clusters, DPH_CPCA_MAX_CLUSTERS);
    size_t vectors = (size_t)cpca->vectors, row = (vectors + 3) / 4 * 4;
    if (!dph_gltf_check_rows(doc, nvert, row * sizeof(float), where, err) ||
        !dph_gltf_read_table(doc, view, cpca->clusters, cpca->vectors, cpca->n, where, &cpca->table,
                             err))
        return false;
    cpca->cluster = dph_alloc(nvert, sizeof *cpca->cluster);
    cpca->weight = dph_alloc(nvert, vectors * sizeof *cpca->weight);
    weight = dph_alloc(nvert, row);
    if (!cpca->cluster || !cpca->weight || !weight) {
        dph_fail_memory(err);
        goto done;
    }
    for (size_t p = first; p < last; p++) {
        const struct dph_gltf_part *part = &doc->part[p];
        if (!dph_gltf_read_weights(doc, part, "_PRT_CPCA_", cpca->vectors,
                                   weight + part->first * row, err) ||
            !dph_gltf_read_clusters(doc, part, "_PRT_CLUSTER", cpca->clusters,
                                    cpca->cluster + part->first, err))
            goto done;
    }
    for (size_t v = 0; v < nvert; v++)
        for (size_t j = 0; j < vectors; j++)
            cpca->weight[v * vectors + j] = (float)weight[v * row + j] / 127;
    body->rivals->products |= DPH_PRODUCT_CLUSTERS;
    ok = true;
done:
    free(weight);
    return ok;
}

bool dph_gltf_read_rivals(struct dph_document *doc, struct dph_body *body, size_t first, size_t last,
                          double *mm_per_unit, struct dph_error *err)
{
    static const struct {
        const char *key;
        bool (*read)(struct dph_document *doc, struct dph_body *body, const json_t *d,
                     const char *where, size_t first, size_t last, struct dph_error *err);
    } all[] = {{"patro", read_normals}, {"prt", read_transfer}, {"prt_cpca", read_clusters},
               {"response", dph_gltf_read_response}};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        const json_t *d;
        char place[120];
        if (!find(doc, first, last, all[i].key, &d, place, err))
            return false;
        if (!d)
            continue;
        if (!body->rivals && !(body->rivals = dph_alloc_zero(1, sizeof *body->rivals)))
            return dph_fail_memory(err);
        if (!all[i].read(doc, body, d, place, first, last, err)) /* the scene frees what there is */
            return false;
        if (!*mm_per_unit)
            *mm_per_unit = i == 0   ? body->rivals->normal_origin.mm_per_unit
                           : i == 3 ? body->rivals->response_origin.mm_per_unit
                                    : body->rivals->transfer_origin.mm_per_unit;
    }
    return true;
}
