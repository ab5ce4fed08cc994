/* render/draw.h - what the drawing methods are written with: bodies on the GPU, passes, programs.      Tier 3, private.
 *
 * Data flow of a frame: renderer.c makes a target and the camera's matrices, the method's draw
 * function runs its passes through dph_draw_pass, renderer.c reads the target back. A method is a
 * file method_NAME.c with one `const struct dph_method`, named in the table of method.c. */
#ifndef DPH_RENDER_DRAW_H
#define DPH_RENDER_DRAW_H

#include "render/gl.h"
#include <diaphan/render.h>

/* The most vec4 of coefficients that a vertex stage takes: DPH_DRAW_BANDS squared over 4. */
#define DPH_MAX_VECTORS 9

/* A body's buffers. Positions are relative to `origin`, so that bodies far from their own origin
 * keep their precision. */
struct dph_gpu_body {
    GLuint array, vertices, coefficients, indices;
    GLsizei count;     /* indices, or vertices where there are none                            */
    size_t nvert;      /* rows in the buffers                                                  */
    bool indexed;
    bool expanded;     /* row r is corner r of the triangles, not vertex r of the mesh         */
    int vectors;       /* vec4 of coefficients bound, 0: not baked                             */
    double origin[3];
};

/* False: DPH_ERROR_LIMIT, _MEMORY or _CAPABILITY, and nothing is left behind. A body without
 * triangles gets count 0. */
bool dph_gpu_body_init(struct dph_gpu_body *gpu, const struct dph_body *body, struct dph_error *err);
void dph_gpu_body_finish(struct dph_gpu_body *gpu);

/* A multisampled linear float target and the one it is resolved to. */
struct dph_target {
    GLuint frame, color, depth;     /* multisampled (or not, with one sample)                 */
    GLuint resolved, resolved_color;
    int width, height, samples, asked;
};

/* Makes the target fit; keeps it where it does already. Fewer samples where GL has fewer. False:
 * DPH_ERROR_CAPABILITY. */
bool dph_target_fit(struct dph_target *target, int width, int height, int samples, struct dph_error *err);
void dph_target_finish(struct dph_target *target);
/* Resolves the lower left width x height pixels and reads them back, rows from the bottom,
 * `row_length` pixels apart: premultiplied by coverage, with coverage in alpha. False:
 * DPH_ERROR_CAPABILITY. */
bool dph_target_read(struct dph_target *target, int width, int height, float *pixel, int row_length,
                     struct dph_error *err);

/* A program for a number of lights and of coefficient vectors. */
struct dph_variant {
    struct dph_variant *next;
    const char *vert, *frag, *feedback;
    int lights, vectors;
    struct dph_program program;
};

struct dph_renderer {
    const struct dph_scene *scene;
    struct dph_gpu_body *body; /* (scene->nbody)                                              */
    struct dph_target target;
    struct dph_variant *variants;
    double centre[3], radius;  /* of the scene's bounding box; radius > 0                     */
};

/* What a method's draw function gets. */
struct dph_draw {
    struct dph_renderer *renderer;
    const struct dph_frame *frame;
    struct dph_material_constants material;
    double mm_per_unit;
    double eye[3];
    float clip[16]; /* positions relative to the eye, in radii of the scene, to clip space     */
};

/* One pass over all instances. */
struct dph_pass {
    const char *name; /* for messages                                                         */
    const char *vert, *frag;
    bool thickness;   /* bind coefficients and set the lights' values                         */
    /* Sets further uniforms for a program. Nullable. */
    void (*uniforms)(const struct dph_draw *draw, struct dph_program *program);
};

/* Draws all instances into the current framebuffer. False: DPH_ERROR_ARGUMENT for a body that is
 * not baked, DPH_ERROR_CAPABILITY. */
bool dph_draw_pass(struct dph_draw *draw, const struct dph_pass *pass, struct dph_error *err);

/* The program of a pass, compiled at its first use and kept by the renderer. NULL: as
 * dph_program_init. */
struct dph_program *dph_draw_program(struct dph_renderer *renderer, const char *vert, const char *frag,
                                     const char *feedback, int lights, int vectors,
                                     struct dph_error *err);

/* The lights and the placement of one instance; `vectors` 0: no thickness. */
void dph_draw_place(const struct dph_draw *draw, struct dph_program *program,
                    const struct dph_instance *instance, int vectors);
/* All members of uniform DphMaterial u_material. */
void dph_draw_material(const struct dph_draw *draw, struct dph_program *program);

/* The private half of struct dph_method. */
struct dph_method_draw {
    bool (*draw)(struct dph_draw *draw, struct dph_error *err);
};

/* The rows of the table, each in its own file. */
extern const struct dph_method dph_method_lambert, dph_method_shsss, dph_method_thickness;

#endif
