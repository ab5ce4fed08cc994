/* Thickness from a formula instead of a bake, for tests of files. */
#ifndef DPH_TESTS_FABRICATE_H
#define DPH_TESTS_FABRICATE_H

#include <diaphan/cpca.h>
#include <diaphan/scene.h>

#include <math.h>
#include <stdlib.h>

/* Gives every body thickness that depends on its positions alone. False: out of memory. */
static inline bool fabricate_thickness(struct dph_scene *scene, int bands, enum dph_store store)
{
    size_t n = (size_t)bands * (size_t)bands;
    for (size_t b = 0; b < scene->nbody; b++) {
        struct dph_body *body = &scene->body[b];
        float *row = malloc((body->mesh.nvert * n + 1) * sizeof *row);
        if (!row)
            return false;
        for (size_t v = 0; v < body->mesh.nvert; v++)
            for (size_t i = 0; i < n; i++) {
                const float *p = body->mesh.position + 3 * v;
                row[v * n + i] = (float)(sin(p[0] * 3.7 + 5 * (double)i) +
                                         .5 * cos(p[1] * 11.3 - p[2] * 7.1 + (double)i));
            }
        dph_thickness_destroy(body->thickness);
        body->thickness = NULL;
        if (store == DPH_STORE_CPCA) {
            struct dph_cpca_params params = dph_cpca_defaults();
            params.clusters = bands == 5 ? 300 : 20; /* numbers of a short, of a byte */
            params.vectors = bands == 5 ? 1 : 5;
            params.iterations = 1;
            struct dph_cpca *cpca =
                dph_cpca_create(row, body->mesh.nvert, (int)n, NULL, &params, NULL);
            if (cpca)
                body->thickness = dph_cpca_thickness(cpca, bands, NULL, body->mesh.nvert, NULL);
            dph_cpca_destroy(cpca);
        } else {
            body->thickness = dph_thickness_create(row, body->mesh.nvert, bands, NULL,
                                                   body->mesh.nvert, store, NULL);
        }
        free(row);
        if (!body->thickness)
            return false;
        body->thickness->directions = 64;
        body->thickness->definition = DPH_THICKNESS_FIRST;
        body->thickness->fit = DPH_FIT_WEIGHTED;
    }
    scene->mm_per_unit = 25 / (dph_scene_size(scene) > 0 ? dph_scene_size(scene) : 1);
    return true;
}

#endif
