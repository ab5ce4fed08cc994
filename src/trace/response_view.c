/* What a direction of sight sees of a body, over the average: walks from every position, whose first
 * direction is known.
 *
 * The fit (bake/view_gain.c) needs integrals over positions x (by area), views v (by cosine), and
 * lights l, with p the average's luminance and L that in direction v. A walk that starts at x
 * against v and leaves for good in direction w with weight a is a sample of L(x, v, .): the integral
 * over l of any function f times L has the expectation a f(w), as for the rows of the bake. So
 *
 *     integral t_i p L    ~ mean of a p(x, w) t_i(x, v, w)
 *     integral t_i t_j p^2 ~ 4 pi mean of p(x, l)^2 t_i t_j for l evenly over the sphere,
 *
 * and one walk serves all lights. A walk that leaves without having been scattered counts
 * nothing: an eye would have to look into the light. Sums of blocks are added in order. */
#include <diaphan/response_bake.h>

#include "bake/view_gain.h"
#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"
#include "trace/response.h"

#include <diaphan/mesh.h>

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { BLOCKS = 512, BLOCKS_LEAST = 32, WALKS = 512, LIGHTS = 4 };

/* The noise of a bake from which on fewer blocks will do: their number goes with its inverse square,
 * as that of the bake's own walks does. */
static const double COARSE = .05;

struct job {
    const struct dph_response_bake_params *params;
    const struct dph_response *response;
    struct dph_welded mesh;
    struct dph_space space;
    float *normal;    /* (npos x 3) unit length                                        */
    double *area;     /* (npos) of the positions up to this one, a third of each triangle */
    uint32_t *vertex; /* (npos) one that stands there                                  */
    int blocks;
    struct dph_view_equations block[BLOCKS];
    atomic_bool cancelled;
};

/* A unit vector evenly over the sphere. */
static void even_direction(double u, double v, double direction[3])
{
    double z = 1 - 2 * u, r = sqrt(fmax(0, 1 - z * z));
    direction[0] = r * cos(2 * PI * v);
    direction[1] = r * sin(2 * PI * v);
    direction[2] = z;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The first position that the area up to it exceeds `area`. */
static size_t find_position(const struct job *job, double area)
{
    size_t first = 0, last = job->mesh.npos - 1;
    while (first < last) {
        size_t middle = first + (last - first) / 2;
        if (job->area[middle] > area)
            last = middle;
        else
            first = middle + 1;
    }
    return first;
}

/* What is drawn of a vertex without a gain, its first four coefficients. */
struct vertex {
    size_t number;
    double first[4];
};

/* The terms for light from a direction; returns the luminance of the average. */
static double look(const struct job *job, const struct vertex *vertex, const double eye[3],
                   const double light[3], double term[DPH_VIEW_TERMS])
{
    double value = dph_response_value(job->response, vertex->number, light), color[3], q[4];
    dph_ramp_color(&job->response->ramp, value, color);
    dph_view_arguments(vertex->first, light, eye, value, q);
    dph_view_terms(dot(light, eye), q, term);
    return dph_response_luminance(color);
}

static void add_sample(const struct job *job, size_t p, struct dph_random *random,
                       struct dph_view_equations *sum)
{
    double eye[3], light[3], term[DPH_VIEW_TERMS], point[3], flight[3], color[3];
    struct vertex vertex = {.number = job->vertex[p]};
    float row[DPH_MAX_BANDS * DPH_MAX_BANDS];
    dph_thickness_row(job->response->channel[0], vertex.number, row);
    for (int i = 0; i < 4 && i < job->response->bands * job->response->bands; i++)
        vertex.first[i] = (double)row[i];
    float inward[3];
    for (size_t c = 0; c < 3; c++)
        inward[c] = -job->normal[3 * p + c];
    double u = dph_random_next(random);
    dph_response_flight(inward, u, dph_random_next(random), eye); /* as the cosine outward */
    double shift = dph_random_next(random), turn = dph_random_next(random);
    for (int i = 0; i < LIGHTS; i++) {
        even_direction((i + shift) / LIGHTS, i * .61803398874989484820 + turn, light);
        double luminance = look(job, &vertex, eye, light, term);
        double weight = 4 * PI / LIGHTS * luminance * luminance;
        for (int a = 0, k = 0; a < DPH_VIEW_TERMS; a++)
            for (int b = 0; b <= a; b++)
                sum->matrix[k++] += weight * term[a] * term[b];
    }
    for (size_t c = 0; c < 3; c++) {
        flight[c] = -eye[c];
        point[c] = (double)job->mesh.position[3 * p + c] + 2 * job->space.margin * flight[c];
    }
    struct dph_walk walk;
    dph_walk_begin(&walk, random);
    if (dph_walk_run(&job->space, &walk, random, false, point, flight, NULL, NULL) !=
            DPH_ENDING_LEFT ||
        !walk.scatterings)
        return;
    double luminance = look(job, &vertex, eye, flight, term);
    dph_walk_weight(&walk, &job->space.volume, color);
    for (int a = 0; a < DPH_VIEW_TERMS; a++)
        sum->right[a] += dph_response_luminance(color) * luminance * term[a];
}

static void run_block(void *context, size_t block, int worker)
{
    struct job *job = context;
    if (atomic_load(&job->cancelled))
        return;
    unsigned int before = dph_rays_enter();
    struct dph_random random = dph_random_seed(job->params->seed, UINT64_MAX, block);
    double all = job->area[job->mesh.npos - 1];
    for (int i = 0; i < WALKS; i++) {
        double at = ((double)block * WALKS + i + dph_random_next(&random)) / (job->blocks * WALKS);
        add_sample(job, find_position(job, at * all), &random, &job->block[block]);
    }
    dph_rays_leave(before);
    if (worker == 0 && job->params->progress &&
        !job->params->progress(job->params->progress_user, (double)block / job->blocks))
        atomic_store(&job->cancelled, true);
}

static bool prepare(struct job *job, const struct dph_bake_input *input, struct dph_error *err)
{
    const struct dph_welded *mesh = &job->mesh;
    if (!dph_welded_init(&job->mesh, input, err))
        return false;
    job->normal = dph_alloc(mesh->npos, 3 * sizeof *job->normal);
    job->area = dph_alloc_zero(mesh->npos, sizeof *job->area);
    job->vertex = dph_alloc_zero(mesh->npos, sizeof *job->vertex);
    if (!job->normal || !job->area || !job->vertex)
        return dph_fail_memory(err);
    for (size_t v = input->nvert; v-- > 0;)
        job->vertex[mesh->position_of[v]] = (uint32_t)v;
    dph_response_areas(mesh, job->area);
    for (size_t p = 1; p < mesh->npos; p++)
        job->area[p] += job->area[p - 1];
    dph_mesh_position_normals(mesh->position, mesh->npos, mesh->index, mesh->ntri, job->normal);
    return dph_space_init(&job->space, mesh->position, mesh->npos, mesh->index, mesh->ntri,
                          dph_thread_count(job->params->threads), err);
}

bool dph_response_view_fit(const struct dph_bake_input *input,
                           const struct dph_response_bake_params *params,
                           const struct dph_response *response, struct dph_view_gain *gain,
                           struct dph_error *err)
{
    *gain = dph_view_even();
    if (!dph_view_applies(response) || response->nvert != input->nvert)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "views are fitted to roots of the mesh's vertices, not compressed");
    struct job *job = dph_alloc_zero(1, sizeof *job);
    if (!job)
        return dph_fail_memory(err);
    job->params = params;
    job->response = response;
    const double part = COARSE / fmax(params->noise, COARSE);
    job->blocks = (int)fmax(BLOCKS * part * part, BLOCKS_LEAST);
    dph_volume_init(&job->space.volume, params->scattering, params->absorption,
                    params->anisotropy);
    bool ok = prepare(job, input, err);
    if (ok && job->mesh.npos && job->area[job->mesh.npos - 1] > 0) {
        dph_parallel(dph_thread_count(params->threads), (size_t)job->blocks, run_block, job);
        for (int i = 1; i < job->blocks; i++)
            dph_view_add(&job->block[0], &job->block[i]);
        ok = !atomic_load(&job->cancelled) || dph_fail(err, DPH_ERROR_CANCELLED, "cancelled");
        if (ok)
            *gain = dph_view_solve(&job->block[0]);
    }
    dph_space_finish(&job->space);
    dph_welded_finish(&job->mesh);
    free(job->normal);
    free(job->area);
    free(job->vertex);
    free(job);
    return ok;
}
