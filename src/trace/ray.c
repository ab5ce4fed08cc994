/* Rays against a mesh, through Embree 3: the independent check of the sweep, and what it is
 * measured beside.
 *
 * The scene is built at medium quality, without spatial splits, so that a triangle sits in one
 * leaf and a filter sees it once a ray, and with the ROBUST flag: rays that start at one vertex
 * often aim at others, and without the flag a quarter of the rays aimed exactly at a vertex slip
 * through the mesh. Positions are moved to the unit cube first, so that coordinates of any size
 * give the same answers up to scale.
 *
 * The nearest hit is a plain rtcIntersect1 that starts a millionth of the mesh's size away from
 * its origin, beyond the triangles around it; the few rays that find one of those all the same are
 * shot again with a filter that rejects them. (With the filter on every ray the nearest hit takes
 * 1.6 times as long, which would flatter the sweep.) All hits are gathered by a filter that notes
 * and rejects each, so that the traversal goes on to the end. Side and sign come from the hit's
 * geometric normal: a ray that leaves matter runs along the outward normal. Embree culls no back
 * faces, so both kinds arrive. */
#include <diaphan/trace.h>

#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(__SSE2__)
#include <pmmintrin.h>
#endif

struct dph_rays {
    RTCDevice device;
    RTCScene scene;
    float *position; /* (npos x 3) in the unit cube */
    uint32_t *index; /* (ntri x 3) */
    size_t npos;
    double unit; /* length of the unit cube's side in the caller's unit */
    double centre[3]; /* of the unit cube, in the caller's space */
};

/* What a filter needs to know of its ray. Embree hands the first member back, so it must stay
 * first. */
struct query {
    struct RTCIntersectContext context;
    const uint32_t *index;
    uint32_t origin;
    enum dph_definition definition;
    float direction[3];
    double thickness;
    int balance;
};

/* Denormal operands slow Embree down many times over; its manual asks for both flags in every
 * thread that queries. Returns the former state. */
static unsigned int flush_denormals(void)
{
#if defined(__SSE2__)
    unsigned int before = _mm_getcsr();
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    return before;
#else
    return 0;
#endif
}

static void restore_denormals(unsigned int before)
{
#if defined(__SSE2__)
    _mm_setcsr(before);
#else
    (void)before;
#endif
}

static bool touches_origin(const struct query *query, unsigned int triangle)
{
    const uint32_t *corner = query->index + 3 * (size_t)triangle;
    return corner[0] == query->origin || corner[1] == query->origin || corner[2] == query->origin;
}

static int sign_of_hit(const float direction[3], float x, float y, float z)
{
    float along = direction[0] * x + direction[1] * y + direction[2] * z;
    return along > 0.0f ? 1 : along < 0.0f ? -1 : 0;
}

static void skip_own_triangles(const struct RTCFilterFunctionNArguments *args)
{
    const struct query *query = (const void *)args->context;
    const struct RTCHit *hit = (const void *)args->hit; /* N is 1: rtcIntersect1 only */
    if (args->valid[0] == -1 && touches_origin(query, hit->primID))
        args->valid[0] = 0;
}

static void gather_hit(const struct RTCFilterFunctionNArguments *args)
{
    struct query *query = (void *)args->context;
    const struct RTCHit *hit = (const void *)args->hit;
    const struct RTCRay *ray = (const void *)args->ray;
    if (args->valid[0] != -1)
        return;
    args->valid[0] = 0;
    if (touches_origin(query, hit->primID))
        return;
    int sign = sign_of_hit(query->direction, hit->Ng_x, hit->Ng_y, hit->Ng_z);
    query->balance += sign;
    if (query->definition == DPH_THICKNESS_INSIDE)
        query->thickness += sign * (double)ray->tfar;
    else if (sign > 0 && (double)ray->tfar > query->thickness)
        query->thickness = (double)ray->tfar;
}

/* Moves the positions into the unit cube around their centre. Sums and quotients in double: what
 * is lost is one rounding a coordinate. */
static void normalise(struct dph_rays *rays, const float *position, size_t npos)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < npos; i++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], (double)position[3 * i + k]);
            high[k] = fmax(high[k], (double)position[3 * i + k]);
        }
    rays->unit = 0.0;
    for (int k = 0; k < 3 && npos; k++)
        rays->unit = fmax(rays->unit, high[k] - low[k]);
    if (!(rays->unit > 0.0))
        rays->unit = 1.0;
    for (int k = 0; k < 3 && npos; k++)
        rays->centre[k] = 0.5 * (low[k] + high[k]);
    for (size_t i = 0; i < npos; i++)
        for (int k = 0; k < 3; k++)
            rays->position[3 * i + k] =
                (float)(((double)position[3 * i + k] - rays->centre[k]) / rays->unit);
}

static bool fail_embree(RTCDevice device, struct dph_error *err)
{
    enum RTCError code = rtcGetDeviceError(device);
    if (code == RTC_ERROR_OUT_OF_MEMORY)
        return dph_fail_memory(err);
    return dph_fail(err, DPH_ERROR_CAPABILITY, "Embree failed with error %d", (int)code);
}

static bool build(struct dph_rays *rays, size_t npos, size_t ntri, struct dph_error *err)
{
    rays->device = rtcNewDevice(NULL);
    if (!rays->device)
        return fail_embree(NULL, err);
    rays->scene = rtcNewScene(rays->device);
    RTCGeometry geometry = rtcNewGeometry(rays->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!rays->scene || !geometry)
        goto error;
    rtcSetSceneBuildQuality(rays->scene, RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(rays->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    float *position = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                              RTC_FORMAT_FLOAT3, 3 * sizeof *position, npos);
    uint32_t *index = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof *index, ntri);
    if ((npos && !position) || (ntri && !index))
        goto error;
    if (npos)
        memcpy(position, rays->position, 3 * npos * sizeof *position);
    if (ntri)
        memcpy(index, rays->index, 3 * ntri * sizeof *index);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(rays->scene, geometry);
    rtcReleaseGeometry(geometry); /* the scene keeps it */
    rtcCommitScene(rays->scene);
    if (rtcGetDeviceError(rays->device) != RTC_ERROR_NONE)
        return dph_fail(err, DPH_ERROR_CAPABILITY,
                        "Embree could not build a scene of %zu triangles", ntri);
    return true;

error:
    if (geometry)
        rtcReleaseGeometry(geometry);
    return fail_embree(rays->device, err);
}

struct dph_rays *dph_rays_create(const float *position, size_t npos, const uint32_t *index,
                                 size_t ntri, struct dph_error *err)
{
    struct dph_rays *rays = calloc(1, sizeof *rays);
    if (!rays || !(rays->position = dph_alloc(npos, 3 * sizeof *position)) ||
        !(rays->index = dph_alloc(ntri, 3 * sizeof *index))) {
        dph_fail_memory(err);
        goto error;
    }
    rays->npos = npos;
    normalise(rays, position, npos);
    if (ntri)
        memcpy(rays->index, index, 3 * ntri * sizeof *index);
    if (!build(rays, npos, ntri, err))
        goto error;
    return rays;

error:
    dph_rays_destroy(rays);
    return NULL;
}

void dph_rays_destroy(struct dph_rays *rays)
{
    if (!rays)
        return;
    if (rays->scene)
        rtcReleaseScene(rays->scene);
    if (rays->device)
        rtcReleaseDevice(rays->device);
    free(rays->position);
    free(rays->index);
    free(rays);
}

static void intersect(const struct dph_rays *rays, struct query *query, float start,
                      struct RTCRayHit *ray)
{
    const float *from = rays->position + 3 * (size_t)query->origin;
    ray->ray = (struct RTCRay){
        .org_x = from[0],
        .org_y = from[1],
        .org_z = from[2],
        .tnear = start,
        .dir_x = query->direction[0],
        .dir_y = query->direction[1],
        .dir_z = query->direction[2],
        .tfar = INFINITY,
        .mask = ~0u,
    };
    ray->hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(rays->scene, &query->context, ray);
}

static void nearest(const struct dph_rays *rays, struct query *query)
{
    struct RTCRayHit ray;
    query->context.filter = NULL;
    intersect(rays, query, 1e-6f,
              &ray); /* the mesh fills the unit cube, float resolves 6e-8 there */
    if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID && touches_origin(query, ray.hit.primID)) {
        query->context.filter = skip_own_triangles;
        intersect(rays, query, 0.0f, &ray);
    }
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return;
    query->balance = sign_of_hit(query->direction, ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z);
    if (query->balance > 0)
        query->thickness = (double)ray.ray.tfar;
}

static void gather(const struct dph_rays *rays, struct query *query)
{
    struct RTCRayHit ray;
    query->context.filter = gather_hit;
    intersect(rays, query, 0.0f, &ray);
}

void dph_rays_thickness(const struct dph_rays *rays, enum dph_definition definition,
                        const uint32_t *origin, size_t norigin, const float direction[3],
                        float *thickness, int *balance)
{
    struct query query = {.index = rays->index, .definition = definition};
    rtcInitIntersectContext(&query.context);
    memcpy(query.direction, direction, sizeof query.direction);

    unsigned int before = flush_denormals();
    for (size_t i = 0; i < norigin; i++) {
        query.origin = origin ? origin[i] : (uint32_t)i;
        query.thickness = 0.0;
        query.balance = 0;
        if (definition == DPH_THICKNESS_FIRST)
            nearest(rays, &query);
        else
            gather(rays, &query);
        thickness[i] = (float)(query.thickness * rays->unit);
        if (balance)
            balance[i] = query.balance;
    }
    restore_denormals(before);
}

struct batch {
    const struct dph_rays *rays;
    enum dph_definition definition;
    const float *direction;
    float *thickness;
};

static void one_direction(void *context, size_t i, int worker)
{
    const struct batch *batch = context;
    (void)worker;
    dph_rays_thickness(batch->rays, batch->definition, NULL, batch->rays->npos,
                       batch->direction + 3 * i, batch->thickness + batch->rays->npos * i, NULL);
}

void dph_rays_thickness_all(const struct dph_rays *rays, enum dph_definition definition,
                            const float *direction, size_t count, int threads, float *thickness)
{
    struct batch batch = {rays, definition, direction, thickness};
    dph_parallel(dph_thread_count(threads), count, one_direction, &batch);
}

unsigned int dph_rays_enter(void)
{
    return flush_denormals();
}

void dph_rays_leave(unsigned int before)
{
    restore_denormals(before);
}

double dph_rays_margin(const struct dph_rays *rays)
{
    return 1e-6 * rays->unit;
}

/* A ray of the caller's space in the unit cube. */
static void aim(const struct dph_rays *rays, const double origin[3], const double direction[3],
                double limit, struct RTCRayHit *ray)
{
    *ray = (struct RTCRayHit){
        .ray = {.org_x = (float)((origin[0] - rays->centre[0]) / rays->unit),
                .org_y = (float)((origin[1] - rays->centre[1]) / rays->unit),
                .org_z = (float)((origin[2] - rays->centre[2]) / rays->unit),
                .dir_x = (float)direction[0],
                .dir_y = (float)direction[1],
                .dir_z = (float)direction[2],
                .tfar = (float)(limit / rays->unit),
                .mask = ~0u},
        .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}},
    };
}

bool dph_rays_nearest(const struct dph_rays *rays, const double origin[3],
                      const double direction[3], double limit, struct dph_hit *hit)
{
    struct RTCIntersectContext context;
    struct RTCRayHit ray;
    rtcInitIntersectContext(&context);
    aim(rays, origin, direction, limit, &ray);
    rtcIntersect1(rays->scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return false;
    double n[3] = {(double)ray.hit.Ng_x, (double)ray.hit.Ng_y, (double)ray.hit.Ng_z};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    hit->distance = (double)ray.ray.tfar * rays->unit;
    for (int k = 0; k < 3; k++)
        hit->normal[k] = length > 0 ? n[k] / length : -direction[k];
    return true;
}

bool dph_rays_blocked(const struct dph_rays *rays, const double origin[3],
                      const double direction[3], double limit)
{
    struct RTCIntersectContext context;
    struct RTCRayHit ray;
    rtcInitIntersectContext(&context);
    aim(rays, origin, direction, limit, &ray);
    rtcOccluded1(rays->scene, &context, &ray.ray);
    return ray.ray.tfar < 0;
}

enum { MAX_CROSSINGS = 2 * DPH_MAX_SPANS };

/* The first member is Embree's, as in struct query. */
struct crossings {
    struct RTCIntersectContext context;
    const float *direction;
    int count;
    bool overflow;
    float distance[MAX_CROSSINGS];
    int sign[MAX_CROSSINGS];
};

/* Sorts a crossing in by its distance. Of too many the nearest stay. */
static void note_crossing(const struct RTCFilterFunctionNArguments *args)
{
    struct crossings *crossings = (void *)args->context;
    const struct RTCHit *hit = (const void *)args->hit;
    const struct RTCRay *ray = (const void *)args->ray;
    if (args->valid[0] != -1)
        return;
    args->valid[0] = 0;
    int sign = sign_of_hit(crossings->direction, hit->Ng_x, hit->Ng_y, hit->Ng_z);
    int i = crossings->count;
    if (!sign)
        return;
    if (i == MAX_CROSSINGS) {
        crossings->overflow = true;
        if (crossings->distance[--i] <= ray->tfar)
            return;
    } else {
        crossings->count++;
    }
    for (; i && crossings->distance[i - 1] > ray->tfar; i--) {
        crossings->distance[i] = crossings->distance[i - 1];
        crossings->sign[i] = crossings->sign[i - 1];
    }
    crossings->distance[i] = ray->tfar;
    crossings->sign[i] = sign;
}

void dph_rays_spans(const struct dph_rays *rays, const double origin[3], const double direction[3],
                    struct dph_spans *spans)
{
    struct RTCRayHit ray;
    struct crossings crossings;
    crossings.count = 0;
    crossings.overflow = false;
    aim(rays, origin, direction, INFINITY, &ray);
    const float along[3] = {ray.ray.dir_x, ray.ray.dir_y, ray.ray.dir_z};
    crossings.direction = along;
    rtcInitIntersectContext(&crossings.context);
    crossings.context.filter = note_crossing;
    rtcIntersect1(rays->scene, &crossings.context, &ray);

    /* the triangles at an edge report the same crossing twice, a rounding apart */
    int n = 0, depth = 0;
    for (int i = 0; i < crossings.count; i++) {
        if (n && crossings.sign[n - 1] == crossings.sign[i] &&
            crossings.distance[i] - crossings.distance[n - 1] <= 2e-7f)
            continue;
        crossings.distance[n] = crossings.distance[i];
        crossings.sign[n++] = crossings.sign[i];
        depth += crossings.sign[i];
    }
    spans->count = 0;
    spans->length = 0;
    spans->inside = depth > 0;
    spans->overflow = crossings.overflow;
    double from = 0;
    for (int i = 0; i < n; i++) {
        double to = (double)crossings.distance[i] * rays->unit;
        if (depth > 0 && spans->count < DPH_MAX_SPANS) {
            if (spans->count && spans->span[spans->count - 1][1] >= from)
                spans->span[spans->count - 1][1] = to; /* goes on where another body begins */
            else {
                spans->span[spans->count][0] = from;
                spans->span[spans->count++][1] = to;
            }
            spans->length += to - from;
        }
        depth -= crossings.sign[i];
        from = to;
    }
}
