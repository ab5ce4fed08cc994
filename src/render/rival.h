/* render/rival.h - what the methods share whose vertices have data of their own.      Tier 3, private. */
#ifndef DPH_RENDER_RIVAL_H
#define DPH_RENDER_RIVAL_H

#include "render/draw.h"

/* A body's buffers for one of the methods; position and normal are those of struct dph_gpu_body. */
struct dph_rival_body {
    GLuint array, attributes;
    GLuint buffer, texture; /* samplerBuffer                                                      */
    int clusters, vectors;  /* prt-cpca: vec4 of weights                                          */
    float *table;           /* prt-cpca: (clusters x (1 + 4 vectors) x 4) as uploaded             */
};

enum { DPH_RIVAL_PRT = 0, DPH_RIVAL_CPCA, DPH_RIVAL_PATRO, DPH_RIVAL_KINDS };

struct dph_rival {
    struct dph_rival_body *body[DPH_RIVAL_KINDS]; /* (scene->nbody) each                              */
};

/* The buffers of body `i` for a kind, made by `make` when they are first needed. NULL: its errors. */
struct dph_rival_body *dph_rival_body(struct dph_renderer *renderer, int kind, size_t i,
                                  bool (*make)(struct dph_rival_body *prt, const struct dph_gpu_body *gpu,
                                               const struct dph_body *body, struct dph_error *err),
                                  struct dph_error *err);

/* Begins a vertex array with the body's position, normal and indices; leaves it and its attribute buffer bound. */
void dph_rival_array(struct dph_rival_body *prt, const struct dph_gpu_body *gpu);

/* All light of a frame as one vector in a body's space, by channel, each (bands * bands) padded with zeros to a multiple of four;
 * `incoming` (3 x DPH_PRT_CHANNEL). */
#define DPH_PRT_CHANNEL (DPH_DRAW_BANDS * DPH_DRAW_BANDS)
void dph_prt_light(const struct dph_draw *draw, const struct dph_instance *instance, int bands,
                   float *incoming);

#endif
