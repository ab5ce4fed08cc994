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

/* Rows of one buffer, and the vertex array that reads them: attribute 0 the position, 1 the normal,
 * and from DPH_EXTRA on what a method adds. All of a vertex lies together: fetching from a second
 * buffer costs a software rasteriser more than nine attributes of the same. */
struct dph_gpu_rows {
    GLuint array, buffer; /* 0: not made yet                                                     */
};
#define DPH_EXTRA 2

/* A body's buffers. Positions are relative to `origin`, so that bodies far from their own origin
 * keep their precision. */
struct dph_gpu_body {
    GLuint indices;
    struct dph_gpu_rows plain; /* nothing added; made when it is first needed                    */
    struct dph_gpu_rows baked; /* with what is stored of thickness                               */
    GLuint outward;    /* one direction a position, for methods that ask; 0: not asked for yet   */
    GLsizei count;     /* indices, or vertices where there are none                              */
    size_t nvert;      /* rows in the buffers                                                    */
    bool indexed;      /* else row r is corner r of the triangles                                */
    uint32_t *vertex;  /* (nvert) the mesh's vertex behind a row. Nullable: not indexed          */
    uint32_t *row_of;  /* (vertices of the mesh) the row of a vertex, UINT32_MAX: no triangle uses it. Nullable */
    int vectors;       /* vec4 of coefficients (or weights) in a baked row, 0: not baked         */
    int bytes;         /* of one of them: 4 float, 2 and 1 integers                              */
    GLuint table;      /* DPH_STORE_CPCA: texture of what lights make of means and vectors; else 0 */
    float *lit;        /* (clusters x lights x (1 + vectors) x 4) what goes into it, room for
                        * DPH_MAX_LIGHTS lights                                                 */
    double origin[3];
};

/* `unshared`: every corner gets a row of its own; otherwise so do those of bodies without normals,
 * and others are put in order. False: DPH_ERROR_LIMIT, _MEMORY or _CAPABILITY, and nothing is left
 * behind. A body without triangles gets count 0. */
bool dph_gpu_body_init(struct dph_gpu_body *gpu, const struct dph_body *body, bool unshared,
                       struct dph_error *err);
void dph_gpu_body_finish(struct dph_gpu_body *gpu);

/* order.c: fills `index` (3 x triangles), nvert, vertex and row_of. False: DPH_ERROR_MEMORY. */
bool dph_gpu_body_order(struct dph_gpu_body *gpu, const struct dph_body *body, uint32_t *index,
                        struct dph_error *err);

/* The mesh's vertex behind row r. */
size_t dph_gpu_vertex(const struct dph_gpu_body *gpu, const struct dph_mesh *mesh, size_t r);

/* Rows of DPH_ROW + `extra` bytes (a multiple of 4) with positions and normals in place and zeros
 * behind; malloc'ed. NULL: DPH_ERROR_MEMORY. */
#define DPH_ROW (6 * sizeof(float))
unsigned char *dph_gpu_rows_fill(const struct dph_gpu_body *gpu, const struct dph_mesh *mesh,
                                 size_t extra, struct dph_error *err);
/* Uploads and frees them; the array stays bound for attributes to be added. */
void dph_gpu_rows_upload(struct dph_gpu_rows *rows, const struct dph_gpu_body *gpu,
                         unsigned char *data, size_t extra);
/* Attributes from DPH_EXTRA on that hold `words` words of the extra bytes without the `first` ones,
 * four each: floats, or bits that the vertex stage takes apart. */
void dph_gpu_rows_words(size_t words, size_t first, GLenum type, size_t extra);
void dph_gpu_rows_finish(struct dph_gpu_rows *rows);

/* Makes the plain rows, if they are not there. False: DPH_ERROR_MEMORY, _CAPABILITY. */
bool dph_gpu_body_plain(struct dph_gpu_body *gpu, const struct dph_body *body, struct dph_error *err);

/* Makes the plain rows and binds attribute DPH_OUTWARD to them: the angle-weighted normal of the
 * vertex's position, the same for all vertices there, so that a body that is pushed out along it
 * does not come apart at its edges. Does nothing the second time. False: DPH_ERROR_MEMORY,
 * _CAPABILITY. */
#define DPH_OUTWARD 15
bool dph_gpu_body_outward(struct dph_gpu_body *gpu, const struct dph_body *body, struct dph_error *err);

/* clusters.c: the texture of a body stored as clustered principal components. Its rows hold weights
 * and the cluster's number. False: DPH_ERROR_MEMORY or DPH_ERROR_CAPABILITY. */
bool dph_clusters_init(struct dph_gpu_body *gpu, const struct dph_thickness *thickness,
                       struct dph_error *err);
/* What light i of `lights` makes of means and vectors; once all are done, for the program in use. */
void dph_clusters_light(struct dph_gpu_body *gpu, const struct dph_thickness *thickness, int i,
                        int lights, const struct dph_light_constants *light);
void dph_clusters_bind(const struct dph_gpu_body *gpu, const struct dph_thickness *thickness,
                       int lights, struct dph_program *program);

/* A multisampled linear float target and the one it is resolved to. */
struct dph_target {
    GLuint frame, color, depth;     /* multisampled (or not, with one sample)                 */
    GLuint resolved, resolved_color;
    int width, height;  /* of the largest part of a picture that is drawn at once            */
    int finer;          /* it has finer x finer pixels for each of the picture's              */
    int samples, asked; /* in each of its pixels; in each of the picture's, as was asked for */
};

/* Makes the target fit a picture of width x height with at least so many samples a pixel, or its
 * tiles of target->width x target->height; keeps it where it does already. False:
 * DPH_ERROR_CAPABILITY. */
bool dph_target_fit(struct dph_target *target, int width, int height, int samples, struct dph_error *err);
void dph_target_finish(struct dph_target *target);
/* Averages the samples of the lower left width x height pixels of the picture. */
void dph_target_resolve(const struct dph_target *target, int width, int height);
/* Resolves the lower left width x height pixels and reads them back, rows from the bottom,
 * `row_length` pixels apart: premultiplied by coverage, with coverage in alpha. False:
 * DPH_ERROR_CAPABILITY, DPH_ERROR_MEMORY. */
bool dph_target_read(struct dph_target *target, int width, int height, float *pixel, int row_length,
                     struct dph_error *err);

/* What a program is compiled of. Names are told apart by their addresses. */
struct dph_stages {
    const char *vert, *frag; /* frag Nullable: none                                           */
    const char *feedback;    /* Nullable: name of a varying to capture                        */
    int vectors;             /* of coefficients that the vertex stage takes; 0: no thickness  */
    int bytes;               /* of a coefficient as it is stored                              */
    int weights;             /* prt-cpca: vec4 of weights                                     */
    bool view;               /* the vertex stage knows the eye (dph_response_seen)            */
};

/* A compiled program: for its stages, a number of lights, and what the material makes of formulas
 * and of terms that it does not have. */
struct dph_variant {
    struct dph_variant *next;
    struct dph_stages stages;
    int lights;
    bool local; /* some are point or spot lights                                              */
    bool compiled; /* the material is a constant of the program                               */
    struct dph_material_constants material; /* else what decides on the code: formula, curve, and
                                             * 1 where specular, rim and ambient are on       */
    struct dph_program program;
};

struct dph_green; /* the depth maps of method_green.c */
struct dph_rival; /* buffers of rival.c */
struct dph_stand_in; /* the response in place of thickness, method_response.c */

struct dph_renderer {
    const struct dph_scene *scene;
    struct dph_gpu_body *body; /* (scene->nbody)                                              */
    struct dph_target target;
    struct dph_variant *variants;
    struct dph_green *green;   /* Nullable: not drawn yet                                     */
    struct dph_rival *rival;   /* Nullable: not drawn yet                                     */
    struct dph_stand_in *stand_in; /* Nullable: not drawn yet                                 */
    bool unshared;             /* every corner is a row of its own                            */
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
    /* Changes what light i is for an instance, called once it is worked out and before it is set
     * and met with clusters, for lights in their order. Nullable. */
    void (*light)(const struct dph_draw *draw, const struct dph_instance *instance, int i,
                  struct dph_light_constants *light);
    void *light_user;
};

/* renderer.c: checks a frame and fills what methods need of it. `frame` has to stay while `draw` is
 * used. False: errors as dph_renderer_draw. */
bool dph_draw_begin(struct dph_draw *draw, struct dph_renderer *renderer,
                    const struct dph_frame *frame, struct dph_error *err);
/* renderer.c: draws the whole frame into `target`, which is made to fit, tile by tile. `image`, of
 * the frame's size, gets it without background, rows from the bottom; NULL: nothing is read back,
 * and samples are averaged where there are several. False: errors as dph_renderer_draw. */
bool dph_draw_frame(struct dph_draw *draw, struct dph_target *target, struct dph_image *image,
                    struct dph_error *err);

/* One pass over all instances. */
struct dph_pass {
    const char *name; /* for messages                                                         */
    const char *vert, *frag;
    bool thickness;   /* bind coefficients and set the lights' values                         */
    bool view;        /* lights have a view, which `instance` sets; not for clusters          */
    /* Sets further uniforms for a program. Nullable. */
    void (*uniforms)(const struct dph_draw *draw, struct dph_program *program);
    /* Sets what differs from body to body, once an instance. Nullable. */
    void (*instance)(const struct dph_draw *draw, struct dph_program *program,
                     const struct dph_instance *instance);
};

/* Draws all instances into the current framebuffer. False: DPH_ERROR_ARGUMENT for a body that is
 * not baked, DPH_ERROR_CAPABILITY. */
bool dph_draw_pass(struct dph_draw *draw, const struct dph_pass *pass, struct dph_error *err);

/* Matrices of an instance, column-major. Positions are relative to `from` (world space) and in units of the scene's
 * radius; `clip` is the product of the placement and `view`. Returns the sign of the placement's determinant. */
double dph_draw_matrices(const struct dph_renderer *renderer, const struct dph_instance *instance,
                         const double from[3], const float view[16], float place[16], float clip[16],
                         float normal[9]);
/* The centre of a body, in the world. */
void dph_draw_centre(const struct dph_draw *draw, const struct dph_instance *instance,
                     double centre[3]);
/* One draw call, with the program in use. */
void dph_draw_rows(const struct dph_gpu_body *gpu, const struct dph_gpu_rows *rows);

/* The program of a pass, compiled at its first use and kept by the renderer. NULL: as
 * dph_program_init. */
struct dph_program *dph_draw_program(const struct dph_draw *draw, const struct dph_stages *stages,
                                     struct dph_error *err);

/* body.vert, or its variant where the body is stored as clustered principal components. */
const char *dph_draw_vert(const struct dph_gpu_body *gpu, const char *vert);

/* The lights and the placement of one instance; `vectors` 0: no thickness. */
void dph_draw_place(const struct dph_draw *draw, struct dph_program *program,
                    const struct dph_instance *instance, int vectors);
/* All members of uniform DphMaterial u_material, where it is one. */
void dph_draw_material(const struct dph_draw *draw, struct dph_program *program);

/* The private half of struct dph_method. */
struct dph_method_draw {
    /* Once a frame, before its target is bound: passes of other sizes. Nullable. */
    bool (*prepare)(struct dph_draw *draw, struct dph_error *err);
    /* Puts other data in the place of the scene's thickness: replaces members of `draw`. For
     * dph_renderer_thickness, which then reads back what the vertex stage makes of these. Nullable. */
    bool (*stand_in)(struct dph_draw *draw, struct dph_error *err);
    /* Once a tile of the picture. */
    bool (*draw)(struct dph_draw *draw, struct dph_error *err);
    /* A vertex stage with the varying v_thickness, for dph_renderer_thickness, and its uniforms.
     * Nullable: body.vert. */
    const char *probe;
    void (*probe_uniforms)(const struct dph_draw *draw, struct dph_program *program);
    /* Adds what a frame costs beyond one pass over the bodies and their thickness. Nullable. */
    void (*cost)(const struct dph_draw *draw, struct dph_cost *cost);
};

/* Frees the depth maps; accepts NULL. */
void dph_green_destroy(struct dph_green *green);
/* Frees what the rivals have of `nbody` bodies; accepts NULL. */
void dph_rival_destroy(struct dph_rival *rival, size_t nbody);
/* Frees what method_response.c has of `nbody` bodies; accepts NULL. */
void dph_stand_in_destroy(struct dph_stand_in *stand_in, size_t nbody);

/* The rows of the table, each in its own file. */
extern const struct dph_method dph_method_lambert, dph_method_shsss, dph_method_thickness,
    dph_method_green, dph_method_green_gauss, dph_method_prt, dph_method_prt_cpca,
    dph_method_patro, dph_method_response;

#endif
