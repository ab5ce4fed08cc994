/* Changed normals: S. Patro, "Real-time approximation of subsurface scattering", 2007, as A.
 * Tomaszewska and K. Stefanowski describe it: a local lighting model that changes the model's
 * normals and costs nothing when drawing. Scattering blurs irradiance,
 *
 *   M(x) = sum over j of  w_xj max(0, n_j.L),   w_xj = A_j K(|x - x_j|) / sum of A_j K
 *
 * and without the clamp the sum is linear in the normals: M = N_x.L with N_x = sum of w_xj n_j.
 * So N_x in the place of n makes plain Lambert shading a blurred one. Neighbours count within
 * three scattering distances.
 *
 * The sums run over the octree of the dipole: within a distance of several percent of a large
 * mesh are more neighbours than can be visited one by one. Groups are taken whole within a solid
 * angle of .01 (for same_side only where their normals nearly agree), and a position's own disc,
 * where exp(-r)/r is infinite and the others steep, is integrated as that of the dipole is, so
 * that the result does not depend on how densely a surface is sampled. */
#include <diaphan/patro.h>

#include "bake/octree.h"
#include "bake/welded.h"
#include "core/clock.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <diaphan/mesh.h>

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { TASK_POSITIONS = 256, ROW = 8 };

static const double floor_length = 0.05;

struct dph_patro_params dph_patro_defaults(void)
{
    return (struct dph_patro_params){.most_distance = .1, .scattering = 1, .keep_length = true};
}

void dph_patro_set_medium(struct dph_patro_params *params, double scattering, double absorption,
                          double mm_per_unit)
{
    params->scattering = scattering * mm_per_unit;
    params->absorption = absorption * mm_per_unit;
    double transport = sqrt(3 * params->absorption * (params->absorption + params->scattering));
    params->distance = transport > 1e-30 ? 1 / transport : 1e30;
}

struct blur {
    const struct dph_patro_params *params;
    const struct dph_octree *tree;
    struct dph_gather gather;
    size_t npos;
    float *point, *row, *area; /* (npos x 3) scaled, (npos x ROW) normal and 1, (npos)             */
    float *out;                /* (npos x 3)                                                       */
    float *length;             /* (npos) before the floor                                          */
    atomic_bool cancelled;
};

static void blur_range(void *context, size_t task, int worker)
{
    struct blur *b = context;
    size_t begin = task * TASK_POSITIONS, end = begin + TASK_POSITIONS;
    if (atomic_load(&b->cancelled))
        return;
    for (size_t p = begin; p < end && p < b->npos; p++) {
        const float *own = b->row + ROW * p;
        float sum[ROW];
        dph_octree_gather(b->tree, &b->gather, b->point + 3 * p, own, sum);
        double mean[3], square = 0;
        for (int k = 0; k < 3; k++) {
            mean[k] = sum[3] > 0 ? (double)sum[k] / (double)sum[3] : (double)own[k];
            square += mean[k] * mean[k];
        }
        double length = sqrt(square);
        b->length[p] = (float)length;
        double scale = !b->params->keep_length ? 1 / length : length < floor_length ? floor_length / length : 1;
        for (int k = 0; k < 3; k++)
            b->out[3 * p + (size_t)k] = (float)(length > 1e-6 ? scale * mean[k]
                                                : (b->params->keep_length ? floor_length : 1) * (double)own[k]);
    }
    const struct dph_patro_params *params = b->params;
    if (worker == 0 && params->progress &&
        !params->progress(params->progress_user, (double)begin / (double)b->npos))
        atomic_store(&b->cancelled, true);
}

static bool check_params(const struct dph_patro_params *p, struct dph_error *err)
{
    if (p->kernel < DPH_PATRO_DIPOLE || p->kernel > DPH_PATRO_GAUSS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "unknown kernel of changed normals");
    if (!(p->distance >= 0 && p->distance < INFINITY && p->most_distance >= 0 && p->most_distance < INFINITY))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "scattering distances are finite and not negative");
    if (!(p->scattering >= 0 && p->scattering < 1e30 && p->absorption >= 0 && p->absorption < 1e30))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "scattering and absorption are finite and not negative");
    return true;
}

/* One unit normal a position: of the given ones their normalised sum, where that has a
 * direction. */
static bool position_normals(const struct dph_bake_input *input, const float *normal,
                             const struct dph_welded *w, float *out, struct dph_error *err)
{
    dph_mesh_position_normals(w->position, w->npos, w->index, w->ntri, out);
    if (!normal)
        return true;
    double *sum = dph_alloc_zero(w->npos, 3 * sizeof *sum);
    if (!sum)
        return dph_fail_memory(err);
    for (size_t v = 0; v < input->nvert; v++)
        for (size_t k = 0; k < 3; k++)
            sum[3 * (size_t)w->position_of[v] + k] += (double)normal[3 * v + k];
    for (size_t p = 0; p < w->npos; p++) {
        const double *s = sum + 3 * p;
        double length = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
        for (size_t k = 0; k < 3 && length > 1e-6 && length < INFINITY; k++)
            out[3 * p + k] = (float)(s[k] / length);
    }
    free(sum);
    return true;
}

/* Thirds of the triangles' areas, in the scaled coordinates. */
static void set_areas(const struct dph_welded *w, const float *point, float *area)
{
    memset(area, 0, w->npos * sizeof *area);
    for (size_t t = 0; t < w->ntri; t++) {
        const uint32_t *i = w->index + 3 * t;
        double e[2][3], square = 0;
        for (size_t k = 0; k < 3; k++) {
            e[0][k] = (double)point[3 * (size_t)i[1] + k] - (double)point[3 * (size_t)i[0] + k];
            e[1][k] = (double)point[3 * (size_t)i[2] + k] - (double)point[3 * (size_t)i[0] + k];
        }
        for (size_t k = 0; k < 3; k++) {
            double n = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
            square += n * n;
        }
        for (size_t k = 0; k < 3; k++)
            area[i[k]] += (float)(sqrt(square) / 6);
    }
}

bool dph_patro_normals(const struct dph_bake_input *input, const float *normal,
                       const struct dph_patro_params *params, float *out, struct dph_patro_report *report,
                       struct dph_error *err)
{
    if (!check_params(params, err))
        return false;
    struct dph_patro_report local = {.threads = dph_thread_count(params->threads)};
    struct dph_welded w = {0};
    struct blur b = {.params = params};
    struct dph_octree *tree = NULL;
    float *own = NULL;
    bool ok = false;
    double start = dph_seconds();
    if (!dph_welded_init(&w, input, err))
        goto end;
    b.npos = w.npos;
    b.point = dph_alloc(w.npos, 3 * sizeof *b.point);
    b.row = dph_alloc_zero(w.npos, ROW * sizeof *b.row);
    b.area = dph_alloc(w.npos, sizeof *b.area);
    b.out = dph_alloc(w.npos, 3 * sizeof *b.out);
    b.length = dph_alloc(w.npos, sizeof *b.length);
    own = dph_alloc(w.npos, 3 * sizeof *own);
    if (!b.point || !b.row || !b.area || !b.out || !b.length || !own) {
        dph_fail_memory(err);
        goto end;
    }
    if (!position_normals(input, normal, &w, own, err))
        goto end;
    double centre[3], square = 0;
    for (size_t k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t p = 0; p < w.npos; p++) {
            low = fmin(low, w.position[3 * p + k]);
            high = fmax(high, w.position[3 * p + k]);
        }
        centre[k] = (low + high) / 2;
        square += w.npos ? (high - low) * (high - low) : 0;
    }
    double diagonal = square > 0 ? sqrt(square) : 1, distance = params->distance;
    if (params->most_distance > 0)
        distance = fmin(distance, params->most_distance * diagonal);
    local.positions = w.npos;
    local.distance = distance;
    distance /= diagonal;
    for (size_t p = 0; p < w.npos; p++) {
        for (size_t k = 0; k < 3; k++)
            b.point[3 * p + k] = (float)((w.position[3 * p + k] - centre[k]) / diagonal);
        memcpy(b.row + ROW * p, own + 3 * p, 3 * sizeof *own);
        b.row[ROW * p + 3] = 1;
    }
    set_areas(&w, b.point, b.area);

    /* Below a millionth of the body nothing but the position's own normal is in reach. */
    if (distance > 1e-6) {
        b.gather = (struct dph_gather){.kind = (enum dph_kernel_kind)params->kernel, .channels = 1,
                                       .length = {distance}, .solid_angle = .01, .reach = 3 * distance,
                                       .same_side = params->same_side, .portable = params->portable};
        double reduced = params->scattering * diagonal, absorbed = params->absorption * diagonal;
        double scale = fmin(1, 1e9 / (reduced + absorbed));
        dph_dipole_init(&b.gather.dipole[0], reduced < 1e-9 ? 0 : reduced * scale, absorbed * scale, 1);
        const struct dph_octree_input samples = {.count = w.npos, .stride = ROW, .position = b.point,
                                                 .area = b.area, .row = b.row, .weight = 3,
                                                 .normals = params->same_side};
        if (!(tree = dph_octree_create(&samples, err)))
            goto end;
        b.tree = tree;
        dph_parallel(local.threads, (w.npos + TASK_POSITIONS - 1) / TASK_POSITIONS, blur_range, &b);
        if (atomic_load(&b.cancelled)) {
            dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
            goto end;
        }
    } else {
        for (size_t p = 0; p < w.npos; p++)
            b.length[p] = 1;
        if (w.npos)
            memcpy(b.out, own, w.npos * 3 * sizeof *own);
    }
    local.shortest = INFINITY;
    for (size_t p = 0; p < w.npos; p++)
        local.shortest = fmin(local.shortest, b.length[p]);
    for (size_t v = 0; v < input->nvert; v++)
        memcpy(out + 3 * v, distance == 0 && normal ? normal + 3 * v : b.out + 3 * (size_t)w.position_of[v],
               3 * sizeof *out);
    if (params->progress && !params->progress(params->progress_user, 1)) {
        dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
        goto end;
    }
    local.seconds = dph_seconds() - start;
    if (report)
        *report = local;
    ok = true;
end:
    dph_octree_destroy(tree);
    free(b.point);
    free(b.row);
    free(b.area);
    free(b.out);
    free(b.length);
    free(own);
    dph_welded_finish(&w);
    return ok;
}
