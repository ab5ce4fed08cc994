/* diaphan/rivals.h - what the methods that stand beside SHSSS precompute, a scene at a time.      Tier 2.
 *
 * Each is baked in memory for one material and one size: transfer vectors and their compression, and changed normals.
 * Drawing (render.h) takes them from the scene's bodies. */
#ifndef DIAPHAN_RIVALS_H
#define DIAPHAN_RIVALS_H

#include <diaphan/cpca.h>
#include <diaphan/material.h>
#include <diaphan/response.h>
#include <diaphan/scene.h>
#include <diaphan/transfer.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a method needs of every body, to be combined. */
enum dph_product {
    DPH_PRODUCT_THICKNESS = 1, /* dph_scene_bake (prepare.h)                                      */
    DPH_PRODUCT_NORMALS = 2,   /* changed normals                                                 */
    DPH_PRODUCT_TRANSFER = 4,  /* transfer vectors                                                */
    DPH_PRODUCT_CLUSTERS = 8,  /* these, compressed                                               */
    DPH_PRODUCT_RESPONSE = 16, /* the response, baked by dph_scene_bake_response (response_scene.h) */
};

/* What a product was baked for. */
struct dph_rivals_origin {
    char material[64];       /* its name                                                          */
    double scattering[3], absorption[3], anisotropy; /* as in material.h                          */
    double mm_per_unit;      /* of the scene                                                      */
    int directions;          /* transfer vectors                                                  */
};

/* The data of one body. Owns its arrays. From a file transfer vectors come a row a vertex, without
 * `area`; where the file has only their compressed form, `vector` is NULL. */
struct dph_rivals {
    unsigned products;            /* of enum dph_product: those that dph_scene_save writes        */
    float *normal;                /* (nvert x 3), not of unit length. Nullable                    */
    struct dph_transfer transfer; /* of radiance, 3 channels; npos 0: none                        */
    struct dph_cpca *clusters;    /* of the rows of `transfer`. Nullable; its errors are 0 from a file */
    struct dph_response *response; /* Nullable                                                    */
    struct dph_transfer response_rows; /* what it was made of, where a bake kept it; npos 0: none  */
    struct dph_rivals_origin normal_origin, transfer_origin; /* the latter also of `clusters`     */
    struct dph_rivals_origin response_origin;
};

/* struct dph_rivals_params p = dph_rivals_defaults(); `material` has to be set. */
struct dph_rivals_params {
    const struct dph_material *material;
    double size_mm;  /* largest side of the scene in mm; 0: as dph_scene_millimetres says; 0       */
    int bands;       /* of transfer vectors, 1 to DPH_DRAW_BANDS; 6                                */
    int directions;  /* 1024                                                                      */
    int clusters;    /* 1 to DPH_CPCA_MAX_CLUSTERS; 128                                           */
    int vectors;     /* a cluster, 1 to 36; 8                                                     */
    int threads;     /* 0: as many as there are processors; 0                                      */
    dph_progress *progress; /* Nullable; NULL                                                      */
    void *progress_user;
};

struct dph_rivals_params dph_rivals_defaults(void);

/* What happened, summed over the bodies. */
struct dph_rivals_report {
    double seconds_normals, seconds_transfer, seconds_clusters;
    double error;    /* of the compression, relative, with weights of 8 bits; mean over the positions */
};

/* Bakes what is asked for, thickness and response left out, and replaces what there was: compressed transfer
 * vectors go when the vectors are baked anew. What was asked for is added to the bodies'
 * `products`. Sets the scene's mm_per_unit. A body without triangles is passed over. `report` is
 * Nullable. False: errors as dph_transfer_bake and dph_cpca_create; bodies baked until then keep
 * what they have. */
bool dph_scene_bake_rivals(struct dph_scene *scene, unsigned products,
                           const struct dph_rivals_params *params, struct dph_rivals_report *report,
                           struct dph_error *err);

/* Sets where a product comes from, for callers that bake it themselves. */
void dph_rivals_remember(struct dph_rivals_origin *origin, const struct dph_material *material,
                         double mm_per_unit, int directions);

/* Whether all bodies have `products` (thickness left out) for this material and for so many
 * millimetres per unit of the scene. If not, `why` (of `size` bytes, Nullable) becomes a clause
 * that says why: "is not baked", "was baked for ...". *found is false where no body has any of
 * them. */
bool dph_scene_rivals_fit(const struct dph_scene *scene, unsigned products,
                          const struct dph_material *material, double mm_per_unit, char *why,
                          size_t size, bool *found);

#ifdef __cplusplus
}
#endif
#endif
