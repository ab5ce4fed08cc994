/* Light that was scattered: one pass of walks over all groups of positions.
 *
 * What becomes of a walk after its first scattering, at a point y, does not depend on where it came
 * from if the medium scatters evenly (g = 0). With f_xc(y) the density of the first scattering of a
 * walk from x in channel c,
 *
 *     f_xc(y) = max(0, -n.w) / pi  st_c exp(-st_c S(x, y)) / r^2,     y = x + r w,
 *
 * S being the part of r inside the body, and G_c(y, .) the distribution of directions in which a
 * walk that is scattered at y leaves,
 *
 *     p_c(x, .) = U_c(x, .) + integral of f_xc(y) albedo_c G_c(y, .) dy.
 *
 * So the points of one position serve its neighbours too. The m positions of a group send out m
 * points, one each, and every position takes all of them with the balance heuristic (Veach and
 * Guibas 1995): with q_x the density of the points of x (the mean of f_xc over the channels, mixed
 * with points near to x),
 *
 *     p_c(x, .) ~ U_c + sum over j of  f_xc(y_j) albedo_c G_c(y_j, .) / (sum over x' of q_x'(y_j)),
 *
 * without bias whatever the groups are. Nothing is assumed of what lies between x and y: S is
 * measured. From each point several walks go on (splitting), in stratified directions and with
 * distances drawn for each channel in turn. Starts and first flights of a group are points of a
 * low-discrepancy sequence (the additive recurrence of Roberts 2018, with powers of the root of
 * x^4 = x + 1), shifted at random.
 *
 * For g != 0 the directions after a scattering depend on those before it: every position is then a
 * group of its own. */
#include "trace/response.h"

#include "core/memory.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { CHECKED_BANDS = 6 };

struct scratch {
    float *sum;      /* (most x 3 x ncoef) */
    double *density; /* (most x 3) f of a point */
    struct dph_response_count count;
};

void *dph_response_scratch_create(const struct dph_response_body *body, size_t most)
{
    struct scratch *scratch = dph_alloc_zero((size_t)body->threads, sizeof *scratch);
    for (int i = 0; scratch && i < body->threads; i++) {
        scratch[i].sum = dph_alloc_aligned(most, body->length * sizeof(float));
        scratch[i].density = dph_alloc(most, 3 * sizeof(double));
        if (!scratch[i].sum || !scratch[i].density) {
            dph_response_scratch_destroy(scratch, body->threads);
            return NULL;
        }
    }
    return scratch;
}

void dph_response_scratch_destroy(void *scratch, int threads)
{
    struct scratch *s = scratch;
    for (int i = 0; s && i < threads; i++) {
        free(s[i].sum);
        free(s[i].density);
    }
    free(s);
}

struct dph_response_count dph_response_counted(const void *scratch, int threads)
{
    const struct scratch *s = scratch;
    struct dph_response_count sum = {0, 0, 0, 0};
    for (int i = 0; i < threads; i++) {
        sum.walks += s[i].count.walks;
        sum.scatterings += s[i].count.scatterings;
        sum.lost += s[i].count.lost;
        sum.capped += s[i].count.capped;
    }
    return sum;
}

/* A point and how a walk came there. */
struct scattering {
    double point[3], flight[3];
};

void dph_response_flight(const float n[3], double u, double v, double direction[3])
{
    double z = 1 - 2 * u, r = sqrt(fmax(0, 1 - z * z)), length = 0;
    const double unit[3] = {r * cos(2 * PI * v), r * sin(2 * PI * v), z};
    for (int k = 0; k < 3; k++) {
        direction[k] = unit[k] - (double)n[k];
        length += direction[k] * direction[k];
    }
    length = sqrt(length);
    for (int k = 0; k < 3; k++)
        direction[k] = length > 1e-9 ? direction[k] / length : -(double)n[k];
}

/* What is nearer to a position than its neighbours are is known from its own points alone: half of
 * these are spent there, evenly along the flight, which has the least variance. Nothing is gained
 * where positions are farther apart than a part of a mean free path. */
static double near_share(const struct dph_response_body *body, size_t p)
{
    return body->near[p] > 0 ? .5 : 0;
}

/* First scattering of a walk from a position: false where there is none. */
static bool first_scattering(const struct dph_response_body *body, size_t p, int hero,
                             const double u[3], struct scattering *s,
                             struct dph_response_count *count)
{
    double extinction = body->space.volume.extinction[hero];
    struct dph_spans spans;
    dph_response_flight(body->normal + 3 * p, u[0], u[1], s->flight);
    for (size_t k = 0; k < 3; k++)
        s->point[k] =
            (double)body->mesh->position[3 * p + k] + 2 * body->space.margin * s->flight[k];
    dph_rays_spans(body->space.rays, s->point, s->flight, &spans);
    if (spans.overflow) {
        count->lost++;
        return false;
    }
    double length = INFINITY, share = near_share(body, p);
    if (u[2] < share)
        length = u[2] / share * (double)body->near[p];
    else if (extinction > 0)
        length = -log1p(-(u[2] - share) / (1 - share)) / extinction;
    if (!(length < spans.length))
        return false;
    dph_space_place(&body->space, &spans, length, s->flight, s->point);
    return true;
}

/* f of a point for one position, all channels. Returns the density of the position's points. */
static double density_of(const struct dph_response_body *body, size_t p, const double point[3],
                         double f[3])
{
    const float *x = body->mesh->position + 3 * p, *n = body->normal + 3 * p;
    double margin = 2 * body->space.margin, to[3], square = 0, cosine = 0;
    for (int k = 0; k < 3; k++) {
        to[k] = (double)x[k] - point[k];
        square += to[k] * to[k];
        cosine += to[k] * (double)n[k];
    }
    f[0] = f[1] = f[2] = 0;
    double r = sqrt(square), inside = r;
    if (!(cosine > 0 && r > 0))
        return 0;
    for (int k = 0; k < 3; k++)
        to[k] /= r;
    cosine /= r;
    if (dph_rays_blocked(body->space.rays, point, to, r - margin)) {
        struct dph_spans spans;
        dph_rays_spans(body->space.rays, point, to, &spans);
        inside = 0;
        for (int i = 0; i < spans.count; i++)
            inside += fmax(0, fmin(spans.span[i][1], r) - spans.span[i][0]);
    }
    double scale = cosine / (PI * square), sum = 0;
    for (int c = 0; c < 3; c++) {
        double extinction = body->space.volume.extinction[c];
        f[c] = scale * extinction * exp(-extinction * inside);
        sum += f[c];
    }
    double share = near_share(body, p), density = (1 - share) / 3 * sum;
    return inside < (double)body->near[p] ? density + share * scale / (double)body->near[p]
                                          : density;
}

/* Directions and weights in which walks from a point leave: G, (3 x ncoef). */
static void leave(const struct dph_response_pass *pass, const struct scattering *from,
                  struct dph_random *random, float *response, struct dph_response_count *count)
{
    const struct dph_response_body *body = pass->body;
    const double golden = .61803398874989484820;
    int splits = pass->splits, hero = (int)(3 * dph_random_next(random));
    double shift = dph_random_next(random), turn = dph_random_next(random);
    memset(response, 0, body->length * sizeof *response);
    for (int i = 0; i < splits; i++) {
        struct scattering s = *from;
        struct dph_walk walk;
        dph_walk_begin(&walk, random);
        walk.hero = (hero + i) % 3;
        if (body->space.volume.anisotropy == 0) {
            double z = 1 - 2 * (i + shift) / splits, r = sqrt(fmax(0, 1 - z * z));
            double angle = 2 * PI * (i * golden + turn);
            s.flight[0] = r * cos(angle), s.flight[1] = r * sin(angle), s.flight[2] = z;
        } else {
            dph_phase_sample(random, body->space.volume.anisotropy, s.flight);
        }
        enum dph_ending ending = dph_walk_run(&body->space, &walk, random, false, s.point, s.flight,
                                              NULL, NULL);
        count->walks++;
        count->scatterings += (uint64_t)walk.scatterings + 1;
        count->lost += ending == DPH_ENDING_LOST;
        count->capped += ending == DPH_ENDING_CAPPED;
        if (ending != DPH_ENDING_LEFT)
            continue;
        double y[DPH_MAX_BANDS * DPH_MAX_BANDS], weight[3];
        dph_sh_eval(body->params->bands, s.flight, y);
        dph_walk_weight(&walk, &body->space.volume, weight);
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < body->ncoef; k++)
                response[c * body->ncoef + k] += (float)(weight[c] / splits * y[k]);
    }
}

static void walk_group(void *context, size_t group, int worker)
{
    struct dph_response_pass *pass = context;
    const struct dph_response_body *body = pass->body;
    const struct dph_response_bake_params *params = body->params;
    const struct dph_groups *groups = pass->groups;
    struct scratch *scratch = (struct scratch *)pass->scratch + worker;
    const uint32_t *member = groups->order + groups->start[group];
    size_t count = groups->start[group + 1] - groups->start[group];
    if (atomic_load(&pass->cancelled))
        return;
    /* 1 / root, 1 / root^2 and so on */
    static const double STEP[3] = {.81917251339616443970, .67104360670378920842,
                                   .54970047790197026530};
    struct dph_random random = dph_random_seed(params->seed, (uint64_t)pass->number, group);
    double shift[3];
    for (int k = 0; k < 3; k++)
        shift[k] = dph_random_next(&random);
    int hero = (int)(3 * dph_random_next(&random));
    memset(scratch->sum, 0, count * body->length * sizeof *scratch->sum);
    for (size_t j = 0; j < count; j++) {
        float response[3 * DPH_MAX_BANDS * DPH_MAX_BANDS];
        struct scattering s;
        double u[3], density = 0;
        for (int k = 0; k < 3; k++)
            u[k] = fmod(shift[k] + (double)(j + 1) * STEP[k], 1);
        if (!first_scattering(body, member[j], (hero + (int)(j % 3)) % 3, u, &s, &scratch->count))
            continue;
        for (size_t k = 0; k < count; k++) {
            double *f = scratch->density + 3 * k;
            density += density_of(body, member[k], s.point, f);
        }
        if (!(density > 0))
            continue;
        leave(pass, &s, &random, response, &scratch->count);
        for (size_t k = 0; k < count; k++)
            for (size_t c = 0; c < 3; c++) {
                const float *from = response + c * body->ncoef;
                float *to = scratch->sum + k * body->length + c * body->ncoef;
                float weight =
                    (float)(scratch->density[3 * k + c] * body->space.volume.albedo[c] / density);
                for (size_t i = 0; i < body->ncoef; i++)
                    to[i] += weight * from[i];
            }
    }
    size_t checked = body->ncoef < CHECKED_BANDS * CHECKED_BANDS ? body->ncoef
                                                                 : CHECKED_BANDS * CHECKED_BANDS;
    for (size_t k = 0; k < count; k++) {
        const float *sum = scratch->sum + k * body->length;
        float *row = pass->row + member[k] * body->length;
        double square = 0;
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < checked; i++)
                square += (double)sum[c * body->ncoef + i] * (double)sum[c * body->ncoef + i];
        for (size_t i = 0; i < body->length; i++)
            row[i] += sum[i];
        pass->square[member[k]] = square;
    }
    if (worker == 0 && params->progress &&
        !params->progress(params->progress_user,
                          pass->progress_begin +
                              pass->progress_span * (double)group / (double)groups->count))
        atomic_store(&pass->cancelled, true);
}


static void bracketed(void *context, size_t group, int worker)
{
    unsigned int before = dph_rays_enter();
    walk_group(context, group, worker);
    dph_rays_leave(before);
}

bool dph_response_pass_run(struct dph_response_pass *pass)
{
    dph_parallel(pass->body->threads, pass->groups->count, bracketed, pass);
    return !atomic_load(&pass->cancelled);
}
