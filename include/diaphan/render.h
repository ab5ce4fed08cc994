/* diaphan/render.h - drawing translucent scenes with OpenGL 3.3 core, with or without a window.      Tier 3.
 *
 * The caller makes a context (dph_gl_create_headless, or its own window's) and keeps it current on
 * the calling thread. Nothing here bakes: a body without thickness cannot be drawn by a method that
 * needs it. */
#ifndef DIAPHAN_RENDER_H
#define DIAPHAN_RENDER_H

#include <diaphan/camera.h>
#include <diaphan/image.h>
#include <diaphan/light.h>
#include <diaphan/material.h>
#include <diaphan/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A headless context through EGL: a graphics card by the device platform, else Mesa's surfaceless
 * platform. */
struct dph_gl;

/* Makes the context and makes it current. NULL: DPH_ERROR_CAPABILITY, the message says what was
 * tried. */
struct dph_gl *dph_gl_create_headless(struct dph_error *err);
void dph_gl_destroy(struct dph_gl *gl);

/* GL_RENDERER and GL_VERSION of the current context in one line. */
const char *dph_gl_name(const struct dph_gl *gl);

/* A row of the table of methods. */
struct dph_method {
    const char *name;       /* as on the command line                                             */
    const char *title;      /* for people                                                         */
    const char *paper;      /* where it comes from                                                */
    bool needs_thickness;   /* bodies must be baked                                               */
    bool quantity;          /* the picture is a measured quantity, not light: save it without tone */
    bool local_lights;      /* takes point and spot lights beside distant ones                    */
    bool environment;       /* takes surroundings                                                 */
    unsigned needs;         /* what else bodies must have, of enum dph_product (rivals.h)         */
    const struct dph_method_draw *draw; /* private                                                */
};

/* Methods in the order of the table; NULL beyond the last. */
const struct dph_method *dph_method_at(size_t i);
/* NULL: not known. */
const struct dph_method *dph_method_find(const char *name);

/* Everything that a picture depends on besides the scene. struct dph_frame f =
 * dph_frame_defaults(); */
#define DPH_MAX_LIGHTS 16
/* As many bands as each light needs where it stands (dph_light_detail, light.h). */
#define DPH_BANDS_AUTO (-1)
struct dph_frame {
    const struct dph_method *method;      /* shsss                                                 */
    struct dph_material material;         /* wax                                                   */
    struct dph_camera camera;             /* 0, 15, 3.5, 35                                        */
    int nlight;                           /* 1 to DPH_MAX_LIGHTS                                   */
    struct dph_light light[DPH_MAX_LIGHTS]; /* azimuth 150, elevation 30, irradiance pi            */
    int width, height;                    /* 1280 x 800                                            */
    double background[3];                 /* linear, 0                                             */
    double mm_per_unit;                   /* 0: the scene's, else 25 mm for the largest side       */
    int bands;                            /* 0: all that are stored; DPH_BANDS_AUTO                */
    enum dph_window window;               /* DPH_WINDOW_NONE                                       */
    bool live_material;                   /* the material changes from frame to frame: its numbers are
                                           * uniforms of the programs, where drawing is slower and a
                                           * change costs nothing, and not constants; false */
    int samples;                          /* at least so many a pixel, 1 to 16. Where GL has fewer, a
                                           * picture is drawn k times as wide and as high, with the
                                           * smallest k that will do, and averaged; 4              */
    int map_size;                         /* depth maps: texels a side, a power of two, 16 to 8192; 1024 */
    double blur_mm;                       /* green-gauss: sigma; negative: a mean free path of the
                                           * material's green channel; -1                          */
    bool view_averaged;                   /* response: the average over views that it stores, in the
                                           * place of what an eye sees; false                      */
    bool has_environment;                 /* surroundings; false                                   */
    /* their coefficients in the world (environment.h), by channel */
    double environment[3][DPH_DRAW_BANDS * DPH_DRAW_BANDS];
};
struct dph_frame dph_frame_defaults(void);

/* Whether the frame's method takes the frame's lights and surroundings. False: DPH_ERROR_ARGUMENT,
 * the message names the methods that do. */
bool dph_frame_check_lights(const struct dph_frame *frame, struct dph_error *err);

/* A scene's data on the GPU. The scene must outlive it and not change. */
struct dph_renderer;
struct dph_renderer *dph_renderer_create(const struct dph_scene *scene, struct dph_error *err);

/* How the data lies on the GPU; the pictures are the same. struct dph_renderer_params p = {0}; */
struct dph_renderer_params {
    bool unshared; /* every corner of a triangle is a vertex of its own and there are no indices, as
                    * in the measurements of Tomaszewska and Stefanowski; false                     */
};
/* `params` Nullable: all as dph_renderer_create has it. */
struct dph_renderer *dph_renderer_create_with(const struct dph_scene *scene,
                                              const struct dph_renderer_params *params,
                                              struct dph_error *err);
void dph_renderer_destroy(struct dph_renderer *renderer);

/* Draws one frame into `image` (initialised by the caller to the frame's size): linear radiance,
 * alpha is coverage; the background is composited. False: DPH_ERROR_ARGUMENT (sizes, no light, a
 * body that is not baked), DPH_ERROR_CAPABILITY (GL errors, with the pass's name). */
bool dph_renderer_draw(struct dph_renderer *renderer, const struct dph_frame *frame,
                       struct dph_image *image, struct dph_error *err);

/* What a frame costs by its method. */
struct dph_cost {
    int passes;              /* a frame, over the bodies or over a map                              */
    double bytes_per_vertex; /* as the vertex stage fetches them, beyond position and normal; mean over the vertices */
    size_t table_bytes;      /* beside the vertices: maps and tables                                */
};
/* False: as dph_renderer_draw, for a frame that cannot be drawn. Draws nothing. */
bool dph_renderer_cost(struct dph_renderer *renderer, const struct dph_frame *frame, struct dph_cost *cost,
                       struct dph_error *err);

/* Speed: milliseconds a frame of several descriptions, which take turns within one run, so that a
 * machine's drift slows all alike and can be taken out. Frames are drawn off-screen as
 * dph_renderer_draw does, as finely, too, where GL has too few samples; GL's samples are averaged,
 * and nothing is read back. The lights turn about the vertical before every frame, so that what is
 * computed once a light counts. */
struct dph_timing_job {
    struct dph_renderer *renderer; /* may be the same for several                             */
    struct dph_frame frame;        /* all of one size, if the first frame of a turn is to be short */
};

/* struct dph_timing_params p = dph_timing_defaults(); */
struct dph_timing_params {
    double seconds;         /* of counted frames a description, at least; above 0, to 3600; 1  */
    int rounds;             /* in so many turns at least, 1 to 1000; 30. A turn is one frame, and there
                             * are as many as fill the seconds; with the GPU's timer it is a block of
                             * two frames or more, and long frames get fewer turns, 12 at least. Then up
                             * to 3 tenths of the time go to the least certain ratios         */
    dph_progress *progress; /* Nullable; NULL                                                 */
    void *progress_user;
};
struct dph_timing_params dph_timing_defaults(void);

struct dph_timing {
    size_t frames;                    /* that were counted                                    */
    double ms_median, ms_p05, ms_p95; /* of a frame: median, 5th and 95th percentile          */
    double cpu_ms; /* median time until all calls of a frame are made; with a software rasteriser
                    * the vertex stage is part of it                                          */
    double ratio;  /* to description 0: of turns during which the machine did little else, without the
                    * drift that neighbouring turns share                                     */
    double ratio_error; /* its standard error                                                 */
    double others; /* processors that other processes kept busy meanwhile, mean; 0 where the system
                    * does not say                                                            */
    bool gpu;      /* the clock: true, the GPU's timer (GL_TIME_ELAPSED); false, from a frame's first
                    * call to the end of its glFinish                                         */
};

/* Whether the driver's timers count what a frame costs: not those of software rasterisers. */
bool dph_gl_timers(void);

/* Measures `count` descriptions, after some frames of each that do not count; `timing` (count). False:
 * errors as dph_renderer_draw, DPH_ERROR_ARGUMENT (a parameter out of range), DPH_ERROR_MEMORY,
 * DPH_ERROR_CANCELLED. */
bool dph_renderer_measure(const struct dph_timing_job *job, size_t count,
                          const struct dph_timing_params *params, struct dph_timing *timing,
                          struct dph_error *err);

/* Reads back what the frame's method takes for the thickness towards light 0 at every vertex of one
 * instance, in mm, for tests: what the vertex stage computes of coefficients, not clamped, or what
 * the depth maps say. `thickness` (body.mesh.nvert). */
bool dph_renderer_thickness(struct dph_renderer *renderer, const struct dph_frame *frame,
                            size_t instance, float *thickness, struct dph_error *err);

/* The GLSL include with every formula that an engine's own shader has to call. */
extern const char dph_shader_include[];

#ifdef __cplusplus
}
#endif
#endif
