/* Baking a whole scene. Each body is reduced to its distinct positions first, so that memory goes
 * with them and not with the vertices (the paper's candle has six vertices a position), baked, and
 * packed with one row a vertex. */
#include <diaphan/prepare.h>

#include "bake/prepare.h"
#include "bake/welded.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double DEFAULT_SIZE_MM = 25.0;

/* Shares of untrusted pairs from which the user is told, and told loudly. Closed meshes have none;
 * a scan with a few small holes stays below the first. */
static const double WARN_SHARE = 0.01, ALARM_SHARE = 0.2;
enum { MAX_EXPLAINED = 4 };

struct dph_scene_bake_params dph_scene_bake_defaults(void)
{
    return (struct dph_scene_bake_params){
        .bake = dph_bake_defaults(), .store = DPH_STORE_SNORM8, .cpca = dph_cpca_defaults()};
}

double dph_scene_millimetres(const struct dph_scene *scene, double size_mm)
{
    double size = dph_scene_size(scene);
    if (!(size_mm > 0.0)) {
        if (scene->mm_per_unit > 0.0)
            return scene->mm_per_unit;
        size_mm = DEFAULT_SIZE_MM;
    }
    double ratio = size_mm / size;
    return size > 0.0 && isfinite(ratio) && ratio > 0.0 ? ratio : 1.0;
}

double dph_scene_body_scale(const struct dph_scene *scene, size_t body)
{
    double largest = 0.0;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const float *m = scene->instance[i].matrix;
        if (scene->instance[i].body != body)
            continue;
        double a[3][3];
        for (int column = 0; column < 3; column++)
            for (int row = 0; row < 3; row++)
                a[column][row] = (double)m[4 * column + row];
        double determinant = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                             a[1][0] * (a[0][1] * a[2][2] - a[0][2] * a[2][1]) +
                             a[2][0] * (a[0][1] * a[1][2] - a[0][2] * a[1][1]);
        largest = fmax(largest, cbrt(fabs(determinant)));
    }
    return largest > 0.0 && isfinite(largest) ? largest : 1.0;
}

/* One bar over all bodies: each counts by its triangles and vertices. */
struct share {
    dph_progress *progress;
    void *user;
    double before, width;
};

static bool report_share(void *user, double fraction)
{
    const struct share *share = user;
    return share->progress(share->user, fmin(1.0, share->before + share->width * fraction));
}

/* Says why a body's thickness is not to be trusted. What is wrong with its edges is the cause
 * where there is something; a closed mesh must overlap itself. */
static bool explain(struct dph_scene *scene, size_t body, const struct dph_mesh_stats *stats,
                    double untrusted, struct dph_error *err)
{
    char cause[320], name[96] = "";
    const char *mend;
    if (scene->nbody > 1)
        snprintf(name, sizeof name, "body %zu (%.64s): ", body, scene->body[body].name);
    if (stats->boundary_edges) {
        snprintf(cause, sizeof cause, "its surface is open (%zu boundary edges%s)",
                 stats->boundary_edges,
                 stats->flipped_edges ? ", and some faces are turned against their neighbours"
                                      : "");
        mend = "close the holes or give thin sheets two sides";
    } else if (stats->flipped_edges) {
        snprintf(cause, sizeof cause, "faces are turned against their neighbours (%zu edges)",
                 stats->flipped_edges);
        mend = "make the faces' orientation consistent";
    } else if (stats->nonmanifold_edges) {
        snprintf(cause, sizeof cause, "more than two faces meet at %zu edges",
                 stats->nonmanifold_edges);
        mend = "remove doubled and inner faces";
    } else if (stats->volume < 0.0) {
        snprintf(cause, sizeof cause, "its faces look inward");
        mend = "reverse them";
    } else {
        snprintf(cause, sizeof cause, "its surface passes through itself (%zu shell%s)",
                 stats->components, stats->components == 1 ? "" : "s");
        mend = "unite what overlaps to one surface";
    }
    if (dph_scene_warn(
            scene,
            "%s%.1f %% of the thickness samples cannot be trusted%s, because %s; there the "
            "distance to the first exit stands in; to mend it, %s",
            name, 100.0 * untrusted, untrusted > ALARM_SHARE ? ", EXPECT A WRONG PICTURE" : "",
            cause, mend))
        return true;
    return dph_fail_memory(err);
}

/* What the user is told once for many bodies: those with an open border whose samples add up all the
 * same, and those beyond the first few that cannot be trusted. */
struct open_bodies {
    size_t count, boundary_edges;
    size_t explained; /* bodies with a warning of their own, or that would have had one */
};

static bool explain_open(struct dph_scene *scene, const struct open_bodies *open,
                         struct dph_error *err)
{
    char who[64] = "the surface is";
    if (open->explained > MAX_EXPLAINED &&
        !dph_scene_warn(scene, "and %zu more bodies that cannot be trusted",
                        open->explained - MAX_EXPLAINED))
        return dph_fail_memory(err);
    if (!open->count)
        return true;
    if (scene->nbody > 1)
        snprintf(who, sizeof who, "%zu of %zu bodies are", open->count, scene->nbody);
    if (dph_scene_warn(scene,
                       "%s open (%zu boundary edges); where a ray leaves through a hole the "
                       "thickness is too small, and a single sheet has none; to mend it, close the "
                       "holes or give thin sheets two sides",
                       who, open->boundary_edges))
        return true;
    return dph_fail_memory(err);
}

/* Packs a body's coefficients, a row a distinct position. */
static struct dph_thickness *pack(const struct dph_scene_bake_params *params,
                                  const float *coefficient, const struct dph_welded *welded,
                                  size_t nvert,
                                  struct dph_scene_bake_report *total, struct dph_error *err)
{
    int bands = params->bake.bands;
    if (params->store != DPH_STORE_CPCA)
        return dph_thickness_create(coefficient, welded->npos, bands, welded->position_of, nvert,
                                    params->store, err);
    struct dph_cpca_params settings = params->cpca;
    settings.threads = params->bake.threads;
    settings.portable = params->bake.portable;
    settings.progress = NULL;
    struct dph_cpca *cpca =
        dph_cpca_create(coefficient, welded->npos, bands * bands, NULL, &settings, err);
    struct dph_thickness *thickness =
        cpca ? dph_cpca_thickness(cpca, bands, welded->position_of, nvert, err) : NULL;
    if (thickness)
        total->error += cpca->error_snorm8 * (double)welded->npos;
    dph_cpca_destroy(cpca);
    return thickness;
}

/* Bakes one body and adds what happened to `total`. */
static bool bake_body(struct dph_scene *scene, size_t number,
                      const struct dph_scene_bake_params *params, double mm_per_unit,
                      struct share *share, struct dph_scene_bake_report *total,
                      struct open_bodies *open, struct dph_error *err)
{
    struct dph_body *body = &scene->body[number];
    struct dph_bake_params bake = params->bake;
    struct dph_bake_report report;
    struct dph_mesh_stats stats;
    struct dph_welded welded;
    float *coefficient = NULL;
    struct dph_thickness *thickness = NULL;

    double start = dph_seconds();
    if (!dph_welded_init(&welded,
                         &(struct dph_bake_input){.position = body->mesh.position,
                                                  .nvert = body->mesh.nvert,
                                                  .index = body->mesh.index,
                                                  .ntri = body->mesh.ntri},
                         err))
        return false;
    total->seconds_store += dph_seconds() - start;

    double scale = dph_scene_body_scale(scene, number);
    bake.largest_side = dph_scene_size(scene) / scale;
    bake.extinction = 0.0;
    if (params->material) {
        struct dph_medium medium;
        dph_material_medium(params->material, &medium);
        bake.extinction = medium.transport[1] * mm_per_unit * scale;
    }
    if (bake.progress) {
        share->progress = params->bake.progress;
        share->user = params->bake.progress_user;
        bake.progress = report_share;
        bake.progress_user = share;
    }
    struct dph_bake_input input = {
        .position = welded.position,
        .nvert = welded.npos,
        .index = welded.index,
        .ntri = welded.ntri,
    };
    coefficient = dph_alloc(dph_bake_size(&input, &bake), sizeof *coefficient);
    if (!coefficient) {
        dph_fail_memory(err);
        goto error;
    }
    if (!dph_bake(&input, &bake, coefficient, &report, err))
        goto error;

    start = dph_seconds();
    thickness = pack(params, coefficient, &welded, body->mesh.nvert, total, err);
    if (!thickness)
        goto error;
    thickness->definition = bake.definition;
    thickness->fit = bake.fit;
    thickness->directions = report.directions;
    total->seconds_store += dph_seconds() - start;
    if (!dph_mesh_measure(&body->mesh, &stats, err))
        goto error;
    if (report.untrusted > WARN_SHARE) {
        if (open->explained++ < MAX_EXPLAINED &&
            !explain(scene, number, &stats, report.untrusted, err))
            goto error;
    } else if (stats.boundary_edges) {
        open->count++;
        open->boundary_edges += stats.boundary_edges;
    }

    dph_thickness_destroy(body->thickness);
    body->thickness = thickness;
    total->bodies++;
    total->triangles += body->mesh.ntri;
    total->vertices += body->mesh.nvert;
    total->positions += report.positions;
    total->directions = report.directions;
    total->threads = report.threads;
    total->untrusted += report.untrusted * (double)report.positions;
    total->seconds_sweep += report.seconds_sweep;
    total->seconds_project += report.seconds_project;
    dph_welded_finish(&welded);
    free(coefficient);
    return true;

error:
    dph_thickness_destroy(thickness);
    dph_welded_finish(&welded);
    free(coefficient);
    return false;
}

bool dph_scene_bake(struct dph_scene *scene, const struct dph_scene_bake_params *params,
                    struct dph_scene_bake_report *report, struct dph_error *err)
{
    struct dph_scene_bake_report total = {0};
    struct open_bodies open = {0};
    double mm_per_unit = dph_scene_millimetres(scene, params->size_mm), work = 0.0, done = 0.0;
    for (int pass = 0; pass < 2; pass++) /* first the sum of the work, then the work */
        for (size_t i = 0; i < scene->nbody; i++) {
            const struct dph_body *body = &scene->body[i];
            if (!body->mesh.nvert || (params->missing_only && body->thickness))
                continue;
            double part = (double)body->mesh.nvert + (double)body->mesh.ntri;
            if (pass == 0) {
                work += part;
                continue;
            }
            struct share share = {.before = done / work, .width = part / work};
            if (!bake_body(scene, i, params, mm_per_unit, &share, &total, &open, err))
                return false;
            done += part;
        }
    if (!explain_open(scene, &open, err))
        return false;
    if (total.positions) {
        total.untrusted /= (double)total.positions;
        total.error /= (double)total.positions;
    }
    scene->mm_per_unit = mm_per_unit;
    if (report)
        *report = total;
    return true;
}
