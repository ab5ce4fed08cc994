/* Small scenes with known answers for the tests that draw.
 *
 * On a sphere of radius R the thickness from the point with normal n along w is 2R max(0, -n . w):
 * a clamped cosine, whose coefficients are 2R A_l y_lm(-n) with A_l = pi, 2 pi / 3, pi / 4, 0, -pi
 * / 24, 0, pi / 64, 0. */
#ifndef DPH_TESTS_RENDER_SHAPES_H
#define DPH_TESTS_RENDER_SHAPES_H

#include <diaphan/cpca.h>
#include <diaphan/render.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

/* A sphere around `centre` with `rings` x 2 * rings quads; poles along y. */
static inline struct dph_mesh make_sphere(size_t rings, double radius, const double centre[3])
{
    struct dph_mesh mesh;
    size_t columns = 2 * rings;
    assert_true(
        dph_mesh_init(&mesh, (rings + 1) * (columns + 1), rings * columns * 2, true, false, NULL));
    size_t v = 0, t = 0;
    for (size_t i = 0; i <= rings; i++)
        for (size_t j = 0; j <= columns; j++, v++) {
            double theta = PI * (double)i / (double)rings,
                   phi = 2 * PI * (double)(j % columns) / (double)columns;
            double s = i % rings ? sin(theta) : 0;
            double n[3] = {s * sin(phi), cos(theta), s * cos(phi)};
            for (size_t k = 0; k < 3; k++) {
                mesh.normal[3 * v + k] = (float)n[k];
                mesh.position[3 * v + k] = (float)(centre[k] + radius * n[k]);
            }
        }
    for (size_t i = 0; i < rings; i++)
        for (size_t j = 0; j < columns; j++) {
            uint32_t a = (uint32_t)(i * (columns + 1) + j), b = a + 1,
                     c = a + (uint32_t)columns + 1, d = c + 1;
            const uint32_t faces[6] = {a, c, b, b, c, d};
            memcpy(mesh.index + 3 * t, faces, sizeof faces);
            t += 2;
        }
    return mesh;
}

/* A square of side 2 in the plane z = 0, facing +z. */
static inline struct dph_mesh make_square(bool normals)
{
    struct dph_mesh mesh;
    assert_true(dph_mesh_init(&mesh, 4, 2, normals, false, NULL));
    static const float corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static const uint32_t index[6] = {0, 1, 2, 0, 2, 3};
    memcpy(mesh.index, index, sizeof index);
    for (size_t v = 0; v < 4; v++) {
        const float position[3] = {corner[v][0], corner[v][1], 0}, normal[3] = {0, 0, 1};
        memcpy(mesh.position + 3 * v, position, sizeof position);
        if (normals)
            memcpy(mesh.normal + 3 * v, normal, sizeof normal);
    }
    return mesh;
}

/* The same mesh with three vertices of its own for each triangle. */
static inline struct dph_mesh unshare(const struct dph_mesh *mesh)
{
    struct dph_mesh out;
    assert_true(dph_mesh_init(&out, 3 * mesh->ntri, mesh->ntri, mesh->normal, false, NULL));
    for (size_t i = 0; i < 3 * mesh->ntri; i++) {
        out.index[i] = (uint32_t)i;
        memcpy(out.position + 3 * i, mesh->position + 3 * (size_t)mesh->index[i],
               3 * sizeof(float));
        if (mesh->normal)
            memcpy(out.normal + 3 * i, mesh->normal + 3 * (size_t)mesh->index[i],
                   3 * sizeof(float));
    }
    return out;
}

/* Exact coefficients of a sphere, from its normals. */
static inline struct dph_thickness *sphere_thickness(const struct dph_mesh *mesh, double radius,
                                                     int bands, enum dph_store store)
{
    static const double a[8] = {PI, 2 * PI / 3, PI / 4, 0, -PI / 24, 0, PI / 64, 0};
    size_t n = (size_t)(bands * bands);
    float *coefficient = malloc(mesh->nvert * n * sizeof *coefficient);
    assert_non_null(coefficient);
    for (size_t v = 0; v < mesh->nvert; v++) {
        double in[3], value[64];
        for (size_t k = 0; k < 3; k++)
            in[k] = -(double)mesh->normal[3 * v + k];
        dph_sh_eval(bands, in, value);
        for (int l = 0; l < bands; l++)
            for (int i = l * l; i < (l + 1) * (l + 1); i++)
                coefficient[v * n + (size_t)i] = (float)(2 * radius * a[l] * value[i]);
    }
    struct dph_thickness *t = NULL;
    if (store == DPH_STORE_CPCA) {
        struct dph_cpca_params params = dph_cpca_defaults();
        params.clusters = 9;
        params.vectors = 6;
        struct dph_cpca *cpca =
            dph_cpca_create(coefficient, mesh->nvert, (int)n, NULL, &params, NULL);
        assert_non_null(cpca);
        t = dph_cpca_thickness(cpca, bands, NULL, mesh->nvert, NULL);
        dph_cpca_destroy(cpca);
    } else {
        t = dph_thickness_create(coefficient, mesh->nvert, bands, NULL, mesh->nvert, store, NULL);
    }
    free(coefficient);
    assert_non_null(t);
    return t;
}

/* The same thickness everywhere and in every direction. */
static inline struct dph_thickness *constant_thickness(size_t nvert, double length)
{
    float *coefficient = malloc(nvert * sizeof *coefficient);
    assert_non_null(coefficient);
    for (size_t v = 0; v < nvert; v++)
        coefficient[v] = (float)(length * sqrt(4 * PI));
    struct dph_thickness *t =
        dph_thickness_create(coefficient, nvert, 1, NULL, nvert, DPH_STORE_FLOAT, NULL);
    free(coefficient);
    assert_non_null(t);
    return t;
}

/* A scene of one mesh, which is moved into it. */
static inline struct dph_scene *scene_of(struct dph_mesh mesh, struct dph_thickness *thickness)
{
    struct dph_scene *scene = dph_scene_from_mesh(&mesh, "body", NULL);
    assert_non_null(scene);
    scene->body[0].thickness = thickness;
    return scene;
}

/* A picture of a scene, drawn by a renderer of its own. */
static inline struct dph_image picture(const struct dph_scene *scene, const struct dph_frame *frame)
{
    struct dph_image image = {0};
    struct dph_error err = {0};
    struct dph_renderer *renderer = dph_renderer_create(scene, &err);
    if (!renderer || !dph_image_init(&image, frame->width, frame->height, &err) ||
        !dph_renderer_draw(renderer, frame, &image, &err))
        fail_msg("%s", err.message);
    dph_renderer_destroy(renderer);
    return image;
}

/* A square frame looking along -z with one light at azimuth and elevation. */
static inline struct dph_frame small_frame(const char *method, int side, double azimuth,
                                           double elevation)
{
    struct dph_frame frame = dph_frame_defaults();
    frame.method = dph_method_find(method);
    assert_non_null(frame.method);
    frame.width = frame.height = side;
    frame.camera = (struct dph_camera){0, 0, 3, 35};
    frame.mm_per_unit = 1;
    dph_light_direction(azimuth, elevation, frame.light[0].to_light);
    return frame;
}

static inline const float *pixel_at(const struct dph_image *image, int x, int y)
{
    return image->pixel + 4 * ((size_t)y * (size_t)image->width + (size_t)x);
}

/* The cosine between a direction and the normal of the unit sphere that pixel (x, y) of a picture
 * of side `side` sees from `eye` radii; false: it sees none, or its rim. */
static inline bool cosine_at(int x, int y, int side, double eye, const double to_light[3],
                             double *mu)
{
    double scale = tan(35 * PI / 360) / (side / 2.0);
    double d[3] = {(x + .5 - side / 2.0) * scale, (side / 2.0 - y - .5) * scale, -1};
    double length = sqrt(d[0] * d[0] + d[1] * d[1] + 1), b = eye / length;
    double discriminant = b * b - eye * eye + 1;
    if (discriminant < .05)
        return false;
    double hit = b - sqrt(discriminant);
    *mu = 0;
    for (int k = 0; k < 3; k++)
        *mu += (d[k] / length * hit + (k == 2 ? eye : 0)) * to_light[k];
    return true;
}

#endif
