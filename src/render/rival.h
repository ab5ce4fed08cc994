/* render/rival.h - what the methods share whose vertices have data of their own.      Tier 3, private. */
#ifndef DPH_RENDER_RIVAL_H
#define DPH_RENDER_RIVAL_H

#include "render/draw.h"

/* A body's buffers for one of the methods: rows as those of struct dph_gpu_body, with data of the
 * method's own. */
struct dph_rival_body {
    struct dph_gpu_rows rows;
    GLuint buffer, texture; /* samplerBuffer                                                      */
    int clusters, vectors;  /* prt-cpca: vec4 of weights                                          */
    float *table;           /* prt-cpca: (clusters x (1 + 4 vectors) x 4) as uploaded             */
};

enum { DPH_RIVAL_PRT = 0, DPH_RIVAL_CPCA, DPH_RIVAL_PATRO, DPH_RIVAL_KINDS };

struct dph_rival {
    struct dph_rival_body *body[DPH_RIVAL_KINDS]; /* (scene->nbody) each                              */
};

/* A method's pass over all instances. */
struct dph_rival_pass {
    const char *name; /* of the pass, for messages                                                */
    const char *vert, *frag;
    int kind;
    const char *product; /* what bodies must have, for the message where one does not             */
    bool (*has)(const struct dph_body *body);
    /* Makes a body's buffers when they are first needed. */
    bool (*make)(struct dph_rival_body *rival, const struct dph_gpu_body *gpu,
                 const struct dph_body *body, struct dph_error *err);
    /* Sets further uniforms for an instance. Nullable. */
    void (*uniforms)(const struct dph_draw *draw, const struct dph_instance *instance,
                     struct dph_rival_body *rival, struct dph_program *program);
};

/* False: DPH_ERROR_ARGUMENT for a body without what the pass needs, DPH_ERROR_MEMORY,
 * DPH_ERROR_CAPABILITY. */
bool dph_rival_draw(struct dph_draw *draw, const struct dph_rival_pass *pass, struct dph_error *err);

/* All light of a frame as one vector in a body's space, by channel, each (bands * bands) padded with zeros to a multiple of four;
 * `incoming` (3 x DPH_PRT_CHANNEL). */
#define DPH_PRT_CHANNEL (DPH_DRAW_BANDS * DPH_DRAW_BANDS)
void dph_prt_light(const struct dph_draw *draw, const struct dph_instance *instance, int bands,
                   float *incoming);

#endif
