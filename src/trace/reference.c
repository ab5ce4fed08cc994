/* The path-traced reference: the scene made ready, the camera, and the sums of its pixels.
 *
 * All instances become one mesh in mm around the scene's centre, those that a matrix mirrors turned
 * right again. Every sample of every pixel has random numbers of its own, so the picture is the
 * same for any number of threads. The picture is drawn one sample of every pixel at a time; between
 * two of these the caller may stop it and keeps what there is. */
#include <diaphan/reference.h>

#include "core/fail.h"
#include "core/memory.h"
#include "core/threads.h"
#include "trace/reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define DEGREE (PI / 180)

enum { MAX_SIDE = 32768, MAX_SAMPLES = 1 << 24, MAX_LIGHTS = DPH_MAX_SUNS };

struct dph_reference_options dph_reference_defaults(void)
{
    return (struct dph_reference_options){
        .material = *dph_material_preset(0),
        .camera = {.azimuth = 0, .elevation = 15, .distance = 3.5, .fov = 35},
        .width = 1280,
        .height = 800,
        .nlight = 1,
        .samples = 256,
        .seed = 1,
        .straight = true,
    };
}

static bool check_medium(const struct dph_material *m, struct dph_error *err)
{
    for (int c = 0; c < 3; c++)
        if (!(m->scattering[c] >= 0 && m->scattering[c] <= 1e6) ||
            !(m->absorption[c] >= 0 && m->absorption[c] <= 1e6))
            return dph_fail(err, DPH_ERROR_ARGUMENT,
                            "scattering %g, absorption %g: 0 to 1e6 per mm", m->scattering[c],
                            m->absorption[c]);
    if (!(fabs(m->anisotropy) < 1))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "anisotropy %g: between -1 and 1", m->anisotropy);
    if (!(m->ior >= 1 && m->ior <= 4))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "index of refraction %g: 1 to 4", m->ior);
    return true;
}

static bool check(const struct dph_reference_options *o, struct dph_error *err)
{
    if (o->width < 1 || o->width > MAX_SIDE || o->height < 1 || o->height > MAX_SIDE)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "a picture of %d x %d: sides are 1 to %d",
                        o->width, o->height, (int)MAX_SIDE);
    if (o->samples < 1 || o->samples > MAX_SAMPLES)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d samples a pixel: 1 to %d", o->samples,
                        (int)MAX_SAMPLES);
    if (!(o->camera.distance > 0 && o->camera.distance <= 1e6) || !isfinite(o->camera.azimuth) ||
        !isfinite(o->camera.elevation))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "camera at azimuth %g, elevation %g, distance %g",
                        o->camera.azimuth, o->camera.elevation, o->camera.distance);
    if (!(o->camera.fov >= 0.01 && o->camera.fov <= 175))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "field of view of %g degrees: 0.01 to 175",
                        o->camera.fov);
    if (!(o->mm_per_unit >= 0 && o->mm_per_unit < INFINITY))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%g mm per unit", o->mm_per_unit);
    if (o->nlight < 0 || o->nlight > MAX_LIGHTS)
        return dph_fail(err, DPH_ERROR_ARGUMENT, "%d lights: 0 to %d", o->nlight, (int)MAX_LIGHTS);
    for (int i = 0; i < o->nlight && o->light; i++) {
        const struct dph_light *light = &o->light[i];
        if (light->kind != DPH_LIGHT_DISTANT)
            return dph_fail(err, DPH_ERROR_ARGUMENT,
                            "light %d is near: the reference takes distant lights", i + 1);
        if (!(light->angle >= 0 && light->angle <= 90))
            return dph_fail(err, DPH_ERROR_ARGUMENT, "light %d: half-angle of %g degrees", i + 1,
                            light->angle);
    }
    if (o->view_averaged && o->boundary != DPH_BOUNDARY_MATCHED)
        return dph_fail(err, DPH_ERROR_ARGUMENT,
                        "views are averaged for a matched boundary only");
    return check_medium(&o->material, err);
}

static bool prepare_suns(struct dph_stage *stage, const struct dph_reference_options *o,
                         struct dph_error *err)
{
    struct dph_light usual = {.irradiance = {PI, PI, PI}};
    const struct dph_light *light = o->light ? o->light : &usual;
    int count = o->light ? o->nlight : 1;
    dph_light_direction(150, 30, usual.to_light);
    stage->surroundings = o->separate ? count : 0;
    stage->npicture = o->separate ? count + (o->environment != NULL) : 1;
    stage->npicture = stage->npicture ? stage->npicture : 1;
    if (!(stage->sun = dph_alloc_zero((size_t)count, sizeof *stage->sun)))
        return dph_fail_memory(err);
    for (int i = 0; i < count; i++) {
        struct dph_sun *sun = &stage->sun[stage->nsun];
        double length = 0, angle = light[i].angle;
        for (int k = 0; k < 3; k++)
            length = hypot(length, light[i].to_light[k]);
        if (!(length > 0 && isfinite(length)))
            continue; /* shines from nowhere, as in the renderer */
        stage->nsun++;
        if (angle <= 0 && stage->boundary == DPH_BOUNDARY_DIELECTRIC)
            angle = 5;
        sun->picture = o->separate ? i : 0;
        sun->cosine = angle > 0 ? cos(angle * DEGREE) : 1;
        sun->even = 2 / (1 + sun->cosine);
        for (int k = 0; k < 3; k++) {
            double sine = sin(angle * DEGREE);
            sun->to_light[k] = light[i].to_light[k] / length;
            sun->irradiance[k] = light[i].irradiance[k];
            sun->radiance[k] = angle > 0 ? light[i].irradiance[k] / (PI * sine * sine) : 0;
        }
    }
    return true;
}

/* Appends an instance's triangles. */
static void place_body(const struct dph_mesh *mesh, const float m[16], const double centre[3],
                       double scale, uint32_t first, float *position, uint32_t *index)
{
    double determinant = 0;
    for (int r = 0; r < 3; r++) {
        int s = (r + 1) % 3, t = (r + 2) % 3;
        determinant += (double)m[r] * ((double)m[4 + s] * (double)m[8 + t] -
                                       (double)m[4 + t] * (double)m[8 + s]);
    }
    for (size_t v = 0; v < mesh->nvert; v++)
        for (int r = 0; r < 3; r++) {
            double sum = (double)m[12 + r] - centre[r];
            for (int c = 0; c < 3; c++)
                sum += (double)m[4 * c + r] * (double)mesh->position[3 * v + (size_t)c];
            position[3 * v + (size_t)r] = (float)(sum * scale);
        }
    for (size_t t = 0; t < mesh->ntri; t++)
        for (int k = 0; k < 3; k++)
            index[3 * t + (size_t)k] =
                first + mesh->index[3 * t + (size_t)(determinant < 0 ? 2 - k : k)];
}

static bool prepare_rays(struct dph_stage *stage, const struct dph_scene *scene,
                         const double centre[3], double scale, int threads,
                         struct dph_error *err)
{
    size_t npos = 0, ntri = 0;
    bool ok = false;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_mesh *mesh = &scene->body[scene->instance[i].body].mesh;
        npos += mesh->nvert;
        ntri += mesh->ntri;
        if (npos > UINT32_MAX || ntri > UINT32_MAX)
            return dph_fail(err, DPH_ERROR_LIMIT, "more than 2^32 triangles in all instances");
    }
    float *position = dph_alloc(npos, 3 * sizeof *position);
    uint32_t *index = dph_alloc(ntri, 3 * sizeof *index);
    if (!position || !index) {
        dph_fail_memory(err);
        goto error;
    }
    npos = ntri = 0;
    for (size_t i = 0; i < scene->ninstance; i++) {
        const struct dph_instance *instance = &scene->instance[i];
        const struct dph_mesh *mesh = &scene->body[instance->body].mesh;
        place_body(mesh, instance->matrix, centre, scale, (uint32_t)npos, position + 3 * npos,
                   index + 3 * ntri);
        npos += mesh->nvert;
        ntri += mesh->ntri;
    }
    ok = dph_space_init(&stage->space, position, npos, index, ntri, threads, err);

error:
    free(position);
    free(index);
    return ok;
}

static bool prepare_outlook(struct dph_stage *stage, int threads, struct dph_error *err)
{
    double direction[3 * MAX_LIGHTS];
    int count = stage->boundary == DPH_BOUNDARY_MATCHED ? stage->nsun : 0;
    for (int i = 0; i < 3 * count; i++)
        direction[i] = stage->sun[i / 3].to_light[i % 3];
    return dph_outlook_init(&stage->outlook, &stage->space, direction, count, threads, err);
}

/* What a call works on. */
struct picture {
    struct dph_stage stage;
    const struct dph_reference_options *options;
    double eye[3], back[3], right[3], up[3]; /* mm; the latter two over half a picture's height */
    int sample;
    double *sum;     /* (height x width x npicture x 9) RGB, their squares, RGB of even samples */
    double *covered; /* (height x width) */
    uint8_t *shown;  /* (height x width) 0: no ray of the pixel meets a body */
    uint64_t *bad;   /* (height x 2) paths lost and capped, by row */
};

static void place_camera(struct picture *picture)
{
    const struct dph_camera *camera = &picture->options->camera;
    double a = camera->azimuth * DEGREE, e = camera->elevation * DEGREE;
    double half = tan(camera->fov * DEGREE / 2);
    const double right[3] = {cos(a), 0, -sin(a)},
                 up[3] = {-sin(e) * sin(a), cos(e), -sin(e) * cos(a)};
    dph_light_direction(camera->azimuth, camera->elevation, picture->back);
    for (int k = 0; k < 3; k++) {
        picture->eye[k] = camera->distance * picture->stage.radius * picture->back[k];
        picture->right[k] = half * right[k];
        picture->up[k] = half * up[k];
    }
}

static bool prepare(struct picture *picture, const struct dph_scene *scene, struct dph_error *err)
{
    const struct dph_reference_options *o = picture->options;
    struct dph_stage *stage = &picture->stage;
    double centre[3], square = 0, largest = 0, mm = o->mm_per_unit;
    for (int k = 0; k < 3; k++) {
        double side = scene->bounds[1][k] - scene->bounds[0][k];
        centre[k] = scene->bounds[0][k] + side / 2;
        square += side * side;
        largest = fmax(largest, side);
    }
    if (!(square > 0) || !isfinite(square))
        return dph_fail(err, DPH_ERROR_ARGUMENT, "the scene has no extent");
    if (!(mm > 0))
        mm = scene->mm_per_unit > 0 ? scene->mm_per_unit : 25 / largest;
    stage->boundary = o->boundary;
    stage->view_averaged = o->view_averaged;
    stage->straight = o->straight;
    stage->eta = o->material.ior;
    stage->radius = sqrt(square) / 2 * mm;
    stage->environment = o->environment;
    stage->environment_user = o->environment_user;
    memcpy(stage->background, o->background, sizeof stage->background);
    dph_volume_init(&stage->space.volume, o->material.scattering, o->material.absorption,
                    o->material.anisotropy);
    place_camera(picture);
    return prepare_suns(stage, o, err) && prepare_rays(stage, scene, centre, mm, o->threads, err) &&
           prepare_outlook(stage, o->threads, err);
}

static void camera_ray(const struct picture *picture, double x, double y, double origin[3],
                       double direction[3])
{
    const struct dph_reference_options *o = picture->options;
    double u = (2 * x - o->width) / o->height, v = 1 - 2 * y / o->height, length = 0, along = 0;
    for (int k = 0; k < 3; k++) {
        direction[k] = u * picture->right[k] + v * picture->up[k] - picture->back[k];
        length += direction[k] * direction[k];
    }
    for (int k = 0; k < 3; k++) {
        direction[k] /= sqrt(length);
        along -= direction[k] * picture->eye[k];
    }
    /* rays are single precision: they start at the scene's bounding sphere, however far the eye */
    double skip = fmax(0, along - 1.01 * picture->stage.radius);
    for (int k = 0; k < 3; k++)
        origin[k] = picture->eye[k] + skip * direction[k];
}

/* Marks the pixels that a sphere may be seen in. False: it is too near to the eye to say. */
static bool show_sphere(struct picture *picture, const double centre[3], double radius)
{
    const struct dph_reference_options *o = picture->options;
    double half = tan(o->camera.fov * DEGREE / 2), depth = 0, across[2] = {0, 0};
    double from[2], to[2];
    for (int k = 0; k < 3; k++) {
        double offset = centre[k] - picture->eye[k];
        depth -= offset * picture->back[k];
        across[0] += offset * picture->right[k];
        across[1] -= offset * picture->up[k];
    }
    if (!(depth > 2 * radius))
        return false;
    for (int k = 0; k < 2; k++) {
        double side = k ? o->height : o->width, slope = across[k] / (half * half * depth);
        double blur = radius * (1 + fabs(slope) * half) / (half * (depth - radius));
        from[k] = fmax(0, floor((side + o->height * (slope - blur)) / 2 - 1e-3));
        to[k] = fmin(side - 1, floor((side + o->height * (slope + blur)) / 2 + 1e-3));
    }
    for (double y = from[1]; y <= to[1]; y++)
        for (double x = from[0]; x <= to[0]; x++)
            picture->shown[(size_t)y * (size_t)o->width + (size_t)x] = 1;
    return true;
}

/* Finds the pixels that no body can be seen in, so that no ray is cast there: cells of clearance 0
 * cover every surface. */
static void find_shown(struct picture *picture)
{
    const struct dph_clearance *grid = &picture->stage.space.clearance;
    size_t count = (size_t)picture->options->width * (size_t)picture->options->height, i = 0;
    bool sure = grid->bound != NULL;
    for (int z = 0; z < grid->size[2] && sure; z++)
        for (int y = 0; y < grid->size[1] && sure; y++)
            for (int x = 0; x < grid->size[0] && sure; x++, i++) {
                const double centre[3] = {grid->low[0] + (x + .5) * grid->cell,
                                          grid->low[1] + (y + .5) * grid->cell,
                                          grid->low[2] + (z + .5) * grid->cell};
                if (!grid->bound[i])
                    sure = show_sphere(picture, centre, .87 * grid->cell);
            }
    if (!sure)
        memset(picture->shown, 1, count);
}

static void draw_row(void *context, size_t y, int worker)
{
    struct picture *picture = context;
    size_t width = (size_t)picture->options->width, values = 3 * (size_t)picture->stage.npicture;
    double radiance[3 * (MAX_LIGHTS + 1)];
    bool even = picture->sample % 2 == 0;
    (void)worker;
    unsigned int before = dph_rays_enter();
    for (size_t x = 0; x < width; x++) {
        size_t pixel = y * width + x;
        double origin[3], direction[3], *sum = picture->sum + 3 * values * pixel;
        bool covered = false;
        struct dph_random random =
            dph_random_seed(picture->options->seed, pixel, (uint64_t)picture->sample);
        double across = (double)x + dph_random_next(&random);
        double down = (double)y + dph_random_next(&random);
        enum dph_ending ending = DPH_ENDING_PLAIN;
        if (picture->shown[pixel]) {
            camera_ray(picture, across, down, origin, direction);
            memset(radiance, 0, values * sizeof *radiance);
            ending = dph_path_trace(&picture->stage, &random, origin, direction, radiance,
                                    &covered);
        } else {
            for (size_t i = 0; i < values; i++)
                radiance[i] = picture->stage.background[i % 3];
        }
        for (size_t i = 0; i < values; i++, sum += i % 3 ? 1 : 7) {
            sum[0] += radiance[i];
            sum[3] += radiance[i] * radiance[i];
            sum[6] += even ? radiance[i] : 0;
        }
        picture->covered[pixel] += covered;
        picture->bad[2 * y] += ending == DPH_ENDING_LOST;
        picture->bad[2 * y + 1] += ending == DPH_ENDING_CAPPED;
    }
    dph_rays_leave(before);
}

static void collect(const struct picture *picture, struct dph_reference *reference)
{
    size_t count = (size_t)reference->width * (size_t)reference->height;
    size_t npicture = (size_t)reference->npicture;
    double n = reference->samples, neven = (reference->samples + 1) / 2;
    for (size_t p = 0; p < npicture; p++)
        for (size_t i = 0; i < count; i++) {
            const double *sum = picture->sum + 9 * (i * npicture + p);
            float *pixel = reference->pixel + 4 * (p * count + i);
            float *variance = reference->variance + 3 * (p * count + i);
            float *half = reference->half + 3 * (p * count + i);
            for (int c = 0; c < 3; c++) {
                double mean = sum[c] / n;
                pixel[c] = (float)mean;
                variance[c] =
                    n > 1 ? (float)(fmax(0, sum[3 + c] / n - mean * mean) / (n - 1)) : 0;
                half[c] = (float)(sum[6 + c] / neven);
            }
            pixel[3] = (float)(picture->covered[i] / n);
        }
    reference->paths = count * (uint64_t)reference->samples;
    for (int y = 0; y < reference->height; y++) {
        reference->lost += picture->bad[2 * y];
        reference->capped += picture->bad[2 * y + 1];
    }
}

void dph_reference_finish(struct dph_reference *reference)
{
    free(reference->pixel);
    free(reference->variance);
    free(reference->half);
    *reference = (struct dph_reference){0};
}

bool dph_reference_render(const struct dph_scene *scene,
                          const struct dph_reference_options *options,
                          struct dph_reference *reference, struct dph_error *err)
{
    struct picture picture = {.options = options};
    bool ok = false, go = true;
    *reference = (struct dph_reference){0};
    if (!check(options, err))
        return false;
    size_t count = (size_t)options->width * (size_t)options->height;
    if (!prepare(&picture, scene, err))
        goto error;
    reference->width = options->width;
    reference->height = options->height;
    reference->npicture = picture.stage.npicture;
    size_t values = count * (size_t)reference->npicture; /* at most 2^39 */
    reference->pixel = dph_alloc_zero(values, 4 * sizeof *reference->pixel);
    reference->variance = dph_alloc_zero(values, 3 * sizeof *reference->variance);
    reference->half = dph_alloc_zero(values, 3 * sizeof *reference->half);
    picture.sum = dph_alloc_zero(values, 9 * sizeof *picture.sum);
    picture.covered = dph_alloc_zero(count, sizeof *picture.covered);
    picture.shown = dph_alloc_zero(count, 1);
    picture.bad = dph_alloc_zero((size_t)options->height, 2 * sizeof *picture.bad);
    if (!reference->pixel || !reference->variance || !reference->half || !picture.sum ||
        !picture.covered || !picture.shown || !picture.bad) {
        dph_fail_memory(err);
        goto error;
    }
    find_shown(&picture);
    for (picture.sample = 0; picture.sample < options->samples && go; picture.sample++) {
        go = !options->progress || options->progress(options->progress_user,
                                                     (double)picture.sample / options->samples);
        if (!go)
            break;
        dph_parallel(dph_thread_count(options->threads), (size_t)options->height, draw_row,
                     &picture);
    }
    if (!picture.sample) {
        dph_fail(err, DPH_ERROR_CANCELLED, "cancelled before the first sample");
        goto error;
    }
    reference->samples = picture.sample;
    collect(&picture, reference);
    if (options->progress && go)
        options->progress(options->progress_user, 1);
    ok = true;

error:
    if (!ok)
        dph_reference_finish(reference);
    free(picture.sum);
    free(picture.covered);
    free(picture.shown);
    free(picture.bad);
    free(picture.stage.sun);
    dph_outlook_finish(&picture.stage.outlook);
    dph_space_finish(&picture.stage.space);
    return ok;
}
