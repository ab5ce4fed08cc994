/* The path tracer against a second one that shares nothing with it but the scene: no Embree, every
 * triangle is tried; double precision; one channel at a time; no weights, a scattering absorbs by
 * chance.
 *
 * Matched boundary: light itself is followed, from the light to the camera, the other way than the
 * tracer goes. Particles start evenly over a disc that faces the light and covers the body, each of
 * flux E pi R^2 / N, and at every scattering point x the camera at c sees, by reciprocity,
 *
 *     flux a p(cos) exp(-st S(x, c)) / |x - c|^2   of importance  1 / (A cos^3)
 *
 * where A is the area of the picture's window one unit before the camera and cos the angle to its
 * axis: the mean of the window's pixels is the integral of radiance times that over directions. The
 * two agree only if phase function, camera, irradiance and attenuation are right in absolute terms.
 *
 * Dielectric boundary: no particle meets a point through a refracting surface, so paths go from the
 * camera here as well, and end in a wide disc of the sky. */
#include <diaphan/reference.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "shapes.h"

enum { MOST = 64 };

/* The scene as the peer has it: triangles in mm around the middle of their box. */
struct peer {
    int ntri;
    double (*corner)[3][3];
    double radius; /* half the box's diagonal */
};

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross3(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double unit(double v[3])
{
    double length = sqrt(dot3(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
    return length;
}

/* Crossings beyond `least`, nearest first; `which` their triangles. Signed volumes, no tolerance. */
static int crossings(const struct peer *peer, const double from[3], const double to[3],
                     double least, double t[MOST], int which[MOST])
{
    int count = 0;
    for (int i = 0; i < peer->ntri; i++) {
        double p[3][3], n[3], a[3], b[3], volume[3];
        for (int v = 0; v < 3; v++)
            for (int k = 0; k < 3; k++)
                p[v][k] = peer->corner[i][v][k] - from[k];
        int v = 0;
        for (; v < 3 && (!v || volume[v - 1] * volume[0] > 0); v++) {
            cross3(p[(v + 1) % 3], p[(v + 2) % 3], n);
            volume[v] = dot3(n, to);
        }
        if (v < 3 || !(volume[2] * volume[0] > 0)) /* the ray does not turn one way about all edges */
            continue;
        for (int k = 0; k < 3; k++)
            a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k];
        cross3(a, b, n);
        double at = dot3(n, p[0]) / dot3(n, to);
        if (at <= least)
            continue;
        assert_true(count < MOST);
        int j = count++;
        for (; j > 0 && t[j - 1] > at; j--)
            t[j] = t[j - 1], which[j] = which[j - 1];
        t[j] = at, which[j] = i;
    }
    return count;
}

/* The inside length along a ray; where `wanted` lies along it, the distance at which so much of it
 * is inside (INFINITY: there is not so much). An odd number of crossings: it starts inside. */
static double inside_length(const struct peer *peer, const double from[3], const double to[3],
                            double wanted, double *at)
{
    double t[MOST], sum = 0;
    int which[MOST], count = crossings(peer, from, to, 0, t, which);
    *at = INFINITY;
    for (int i = count & 1 ? -1 : 0; i + 1 < count; i += 2) {
        double begin = i < 0 ? 0 : t[i], part = t[i + 1] - begin;
        if (wanted >= sum && wanted < sum + part)
            *at = begin + wanted - sum;
        sum += part;
    }
    return sum;
}

static double henyey_greenstein(double g, double cosine)
{
    return (1 - g * g) / (4 * PI * pow(1 + g * g - 2 * g * cosine, 1.5));
}

/* By rejection from its own maximum: slow, and nothing to get wrong. */
static void scatter(uint64_t *seed, double g, double to[3])
{
    double most = henyey_greenstein(g, g > 0 ? 1 : -1), next[3];
    do
        random_direction(seed, next);
    while (next_random(seed) * most > henyey_greenstein(g, dot3(to, next)));
    memcpy(to, next, sizeof next);
}

struct window {
    double eye[3], forward[3], area, half, aspect;
};

static struct window look(const struct dph_reference_options *o, const struct peer *peer)
{
    struct window w;
    double a = o->camera.azimuth * PI / 180, e = o->camera.elevation * PI / 180;
    const double back[3] = {cos(e) * sin(a), sin(e), cos(e) * cos(a)};
    for (int k = 0; k < 3; k++) {
        w.eye[k] = back[k] * o->camera.distance * peer->radius;
        w.forward[k] = -back[k];
    }
    w.half = tan(o->camera.fov * PI / 360);
    w.aspect = (double)o->width / o->height;
    w.area = 4 * w.half * w.half * w.aspect;
    return w;
}

struct estimate {
    double mean, error;
};

static struct estimate estimate_of(double sum, double square, double n)
{
    double mean = sum / n;
    return (struct estimate){mean, sqrt(fmax(0, square / n - mean * mean) / n)};
}

/* The mean of the picture in one channel, by particles from one light. */
static struct estimate by_particles(const struct peer *peer, const struct dph_reference_options *o,
                                    const struct dph_light *light, int channel, int count)
{
    const struct window w = look(o, peer);
    double ss = o->material.scattering[channel], sa = o->material.absorption[channel];
    double st = ss + sa, g = o->material.anisotropy, sum = 0, square = 0;
    double flux = light->irradiance[channel] * PI * peer->radius * peer->radius;
    uint64_t seed = (uint64_t)channel * 7919 + 3;
    for (int i = 0; i < count; i++) {
        double to[3], x[3], u[3], v[3], axis[3] = {.6, 0, .8}, seen = 0;
        double r = peer->radius * sqrt(next_random(&seed)), a = 2 * PI * next_random(&seed);
        for (int k = 0; k < 3; k++)
            to[k] = -light->to_light[k];
        unit(to);
        cross3(to, axis, u);
        unit(u);
        cross3(to, u, v);
        for (int k = 0; k < 3; k++)
            x[k] = r * cos(a) * u[k] + r * sin(a) * v[k] - 2 * peer->radius * to[k];
        for (;;) {
            double at, other, view[3], length;
            inside_length(peer, x, to, -log1p(-next_random(&seed)) / st, &at);
            if (at == INFINITY)
                break;
            for (int k = 0; k < 3; k++) {
                x[k] += at * to[k];
                view[k] = w.eye[k] - x[k];
            }
            if (next_random(&seed) * st >= ss)
                break;
            length = unit(view);
            double cosine = -dot3(view, w.forward);
            double through = exp(-st * inside_length(peer, x, view, 0, &other));
            seen += flux * henyey_greenstein(g, dot3(to, view)) * through / (length * length) /
                    (w.area * cosine * cosine * cosine);
            scatter(&seed, g, to);
        }
        sum += seen;
        square += seen * seen;
    }
    return estimate_of(sum, square, count);
}

/* Unpolarised reflectance from the angles themselves (Fresnel's sine and tangent laws). */
static double reflectance(double incident, double refracted)
{
    if (incident < 1e-6)
        incident = 1e-6, refracted = incident * refracted / incident;
    double s = sin(incident - refracted) / sin(incident + refracted);
    double p = tan(incident - refracted) / tan(incident + refracted);
    return (s * s + p * p) / 2;
}

/* The same by paths from the camera, the boundary being a smooth dielectric and the light a disc. */
static struct estimate by_paths(const struct peer *peer, const struct dph_reference_options *o,
                                const struct dph_light *light, int channel, int count)
{
    const struct window w = look(o, peer);
    double ss = o->material.scattering[channel], st = ss + o->material.absorption[channel];
    double disc = light->angle * PI / 180, sum = 0, square = 0;
    double radiance = light->irradiance[channel] / (PI * sin(disc) * sin(disc));
    double right[3], up[3], zenith[3] = {0, 1, 0};
    uint64_t seed = (uint64_t)channel * 7919 + 11;
    cross3(w.forward, zenith, right);
    unit(right);
    cross3(right, w.forward, up);
    for (int i = 0; i < count; i++) {
        double x[3], to[3], seen = 0;
        double a = (2 * next_random(&seed) - 1) * w.half * w.aspect;
        double b = (2 * next_random(&seed) - 1) * w.half;
        for (int k = 0; k < 3; k++) {
            x[k] = w.eye[k];
            to[k] = w.forward[k] + a * right[k] + b * up[k];
        }
        unit(to);
        bool inside = false, met = false;
        for (;;) {
            double t[MOST], flight = inside ? -log1p(-next_random(&seed)) / st : INFINITY;
            int which[MOST], n = crossings(peer, x, to, 1e-9 * peer->radius, t, which);
            if (!n) {
                assert_false(inside);
                if (met && dot3(to, light->to_light) >= cos(disc))
                    seen = radiance;
                break;
            }
            if (flight < t[0]) {
                for (int k = 0; k < 3; k++)
                    x[k] += flight * to[k];
                if (next_random(&seed) * st >= ss)
                    break;
                scatter(&seed, o->material.anisotropy, to);
                continue;
            }
            double e[3], f[3], normal[3];
            const double (*corner)[3] = (const double (*)[3])peer->corner[which[0]];
            for (int k = 0; k < 3; k++) {
                x[k] += t[0] * to[k];
                e[k] = corner[1][k] - corner[0][k], f[k] = corner[2][k] - corner[0][k];
            }
            met = true;
            cross3(e, f, normal);
            unit(normal);
            double along = dot3(normal, to), across[3], sine = 0;
            assert_true((along > 0) == inside);
            for (int k = 0; k < 3; k++)
                across[k] = to[k] - along * normal[k];
            sine = unit(across);
            double eta = inside ? o->material.ior : 1 / o->material.ior, beyond = sine * eta;
            if (beyond >= 1 ||
                next_random(&seed) < reflectance(asin(fmin(sine, 1)), asin(beyond))) {
                for (int k = 0; k < 3; k++)
                    to[k] -= 2 * along * normal[k];
            } else {
                double depth = copysign(sqrt(1 - beyond * beyond), along);
                for (int k = 0; k < 3; k++)
                    to[k] = beyond * across[k] + depth * normal[k];
                inside = !inside;
            }
            unit(to);
        }
        sum += seen;
        square += seen * seen;
    }
    return estimate_of(sum, square, count);
}

static struct peer peer_of(const struct dph_mesh *mesh, double mm)
{
    struct peer peer = {.ntri = (int)mesh->ntri};
    double low[3], high[3], square = 0;
    peer.corner = malloc(mesh->ntri * sizeof *peer.corner);
    assert_non_null(peer.corner);
    for (int k = 0; k < 3; k++) {
        low[k] = INFINITY, high[k] = -INFINITY;
        for (size_t v = 0; v < mesh->nvert; v++) {
            low[k] = fmin(low[k], (double)mesh->position[3 * v + (size_t)k]);
            high[k] = fmax(high[k], (double)mesh->position[3 * v + (size_t)k]);
        }
        square += (high[k] - low[k]) * (high[k] - low[k]);
    }
    peer.radius = mm * sqrt(square) / 2;
    for (size_t i = 0; i < 3 * mesh->ntri; i++)
        for (int k = 0; k < 3; k++)
            peer.corner[i / 3][i % 3][k] =
                mm * ((double)mesh->position[3 * (size_t)mesh->index[i] + (size_t)k] -
                      (low[k] + high[k]) / 2);
    return peer;
}

/* A ring of square section with corners that stand out: concave, and light that leaves may enter
 * again. */
static struct dph_mesh make_ring(void)
{
    enum { N = 7 };
    struct dph_mesh mesh = make_room(4 * N, 8 * N);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < 4; j++) {
            double a = 2 * PI * i / N, r = j == 1 || j == 2 ? 1 : .45;
            add_vertex(&mesh, r * cos(a), r * sin(a), (j < 2 ? -.3 : .3) * (i & 1 ? 1.5 : 1));
        }
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t j = 0; j < 4; j++) {
            uint32_t a = 4 * i + j, b = 4 * i + (j + 1) % 4, n = 4 * ((i + 1) % N);
            uint32_t c = n + j, d = n + (j + 1) % 4;
            add_triangle(&mesh, a, c, d), add_triangle(&mesh, a, d, b);
        }
    double turn[3][3];
    some_rotation(turn);
    rotate_mesh(&mesh, turn);
    return mesh;
}

/* Ratios over the cases of one boundary. The tracer's channels share their paths, so their errors
 * add up; the peer's are independent, as are those of two media. */
struct tally {
    double ratio, square, ours; /* `ours`: of the medium at hand */
    int count;
};

static void compare(const char *what, struct estimate a, struct estimate b, struct tally *tally)
{
    double error = sqrt(a.error * a.error + b.error * b.error);
    printf("    %-22s %.5f, peer %.5f, ratio %.4f +- %.4f\n", what, a.mean, b.mean,
           a.mean / b.mean, error / b.mean);
    if (!UNDER_SANITIZER)
        assert_true(error < .03 * b.mean);
    assert_true(fabs(a.mean - b.mean) <= 3 * error);
    tally->ratio += a.mean / b.mean;
    tally->ours += a.error / a.mean;
    tally->square += b.error * b.error / (b.mean * b.mean);
    if (++tally->count % 3 == 0) {
        tally->square += tally->ours * tally->ours;
        tally->ours = 0;
    }
}

/* The mean of a picture, and its error, by the variances that come with it. */
static void by_tracer(const struct dph_scene *scene, const struct dph_reference_options *o,
                      struct estimate out[3])
{
    struct dph_reference picture;
    struct dph_error err = {0};
    size_t count = (size_t)o->width * (size_t)o->height;
    if (!dph_reference_render(scene, o, &picture, &err))
        fail_msg("%s", err.message);
    assert_int_equal(picture.capped, 0);
    assert_true((double)picture.lost < 1e-5 * (double)picture.paths);
    for (size_t c = 0; c < 3; c++) {
        double sum = 0, variance = 0;
        for (size_t i = 0; i < count; i++) {
            sum += (double)picture.pixel[4 * i + c];
            variance += (double)picture.variance[3 * i + c];
        }
        out[c] = (struct estimate){sum / (double)count, sqrt(variance) / (double)count};
    }
    dph_reference_finish(&picture);
}

static const struct {
    const char *name;
    double scattering[3], absorption[3], anisotropy;
} media[] = {
    {"forward", {1.2, .6, .3}, {.05, .06, .1}, .5},
    {"dense", {1.8, 1.4, .9}, {.2, .1, .1}, 0},
    {"backward", {1.5, .8, .4}, {.01, .03, .1}, -.6},
};

static void agree(bool dielectric, int count, int samples)
{
    static const char *const names[3] = {"back", "side", "front"};
    static const double azimuth[3] = {200, 120, 60};
    struct dph_mesh mesh = make_ring();
    struct peer peer = peer_of(&mesh, 6);
    struct dph_scene *scene = dph_scene_from_mesh(&mesh, "ring", NULL);
    assert_non_null(scene);
    struct dph_reference_options o = dph_reference_defaults();
    o.camera = (struct dph_camera){.azimuth = 30, .elevation = 20, .distance = 3, .fov = 42};
    o.width = 30, o.height = 26; /* wide enough for all of it */
    o.samples = UNDER_SANITIZER ? samples / 16 : samples;
    count = UNDER_SANITIZER ? count / 16 : count;
    struct tally tally = {0};
    o.mm_per_unit = 6;
    o.material.ior = 1.4;
    o.boundary = dielectric ? DPH_BOUNDARY_DIELECTRIC : DPH_BOUNDARY_MATCHED;
    for (size_t m = 0; m < sizeof media / sizeof *media; m++) {
        struct dph_light light = {.irradiance = {3, 2, 1}, .angle = dielectric ? 60 : 0};
        struct estimate ours[3];
        dph_light_direction(azimuth[m], 20, light.to_light);
        o.light = &light, o.nlight = 1;
        memcpy(o.material.scattering, media[m].scattering, sizeof media[m].scattering);
        memcpy(o.material.absorption, media[m].absorption, sizeof media[m].absorption);
        o.material.anisotropy = media[m].anisotropy;
        by_tracer(scene, &o, ours);
        for (int c = 0; c < 3; c++) {
            char what[64];
            snprintf(what, sizeof what, "%s, %s, %c", media[m].name, names[m], "RGB"[c]);
            compare(what, ours[c], dielectric ? by_paths(&peer, &o, &light, c, count)
                                              : by_particles(&peer, &o, &light, c, count),
                    &tally);
        }
    }
    double ratio = tally.ratio / tally.count, error = sqrt(tally.square) / tally.count;
    printf("    all: ratio %.4f +- %.4f\n", ratio, error);
    if (!UNDER_SANITIZER)
        assert_true(error < .01);
    assert_true(fabs(ratio - 1) <= 3 * error);
    free(peer.corner);
    dph_scene_destroy(scene);
}

static void matched_agrees(void **state)
{
    (void)state;
    agree(false, 150000, 256);
}

static void dielectric_agrees(void **state)
{
    (void)state;
    agree(true, 150000, 512);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(matched_agrees),
        cmocka_unit_test(dielectric_agrees),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
