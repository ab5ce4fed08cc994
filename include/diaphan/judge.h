/* diaphan/judge.h - every method beside the path-traced truth, with figures.      Tier 4.
 *
 * Only where pictures, drawing and the reference were built.
 *
 * A comparison draws one scene from one camera by every method, in some materials, under one light
 * at a time, traces the same pictures, and scores the drawn ones over the object's pixels. Free
 * numbers of a method are fitted on training lights that are not scored; the method is scored with
 * and without the fit. The noise of the truth stands beside every figure. Many more lights, in
 * small pictures, give one figure for all directions. Where a method is a response, which no view
 * changes, all is scored against the truth averaged over views as well. docs/theory.md has the
 * protocol. */
#ifndef DIAPHAN_JUDGE_H
#define DIAPHAN_JUDGE_H

#include <diaphan/image.h>
#include <diaphan/prepare.h>
#include <diaphan/reference.h>
#include <diaphan/render.h>
#include <diaphan/response_scene.h>
#include <diaphan/rivals.h>

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How far a picture is from the reference, over the object's pixels (coverage of the reference at
 * least a half). */
struct dph_scores {
    double psnr;     /* dB, sRGB values in 0 to 1; INFINITY for equal pictures */
    double ssim;     /* -1 to 1, of sRGB luma; the outermost 5 pixels of the object are left out */
    double flip;     /* 0 to 1, mean LDR-FLIP at 67 pixels per degree */
    double rmse;     /* RMS error / RMS truth of linear luminance, the reference's noise taken out
                      * of both; 0 where the error, NAN where the truth is below the noise        */
    double rmse_raw; /* the same with the noise left in */
    double rmse_view_averaged; /* rmse from the truth averaged over views, of the average that a
                                * response draws, else of the picture; NAN where there is none      */
};

/* What noise alone does to the scores: a perfect picture would get about these. All are NAN where
 * the reference has one sample. */
struct dph_noise {
    double psnr; /* dB: that between the two halves of the samples + 6.02 (see docs/theory.md) */
    double ssim; /* between the halves, noisier than the reference: a bound from below */
    double flip; /* between the halves: a bound from above */
    double rmse; /* RMS of the noise / RMS truth of linear luminance */
    double variance; /* of linear luminance, mean over the object */
};

/* One light and its truth in one material. */
struct dph_truth {
    struct dph_image image;  /* linear radiance over black, alpha is coverage */
    uint8_t *mask;           /* (height x width) 1: the object */
    size_t pixels;           /* of the object */
    double mean;             /* linear luminance over the object */
    struct dph_noise noise;
    struct dph_image views;  /* averaged over views (reference.h), of walks of its own; `pixel` is
                              * NULL where that is not asked for */
    struct dph_noise views_noise;
    double views_rmse;       /* of `views` as a picture: what a method without views is bound to get
                              * if it is right. Noise of both is taken out; NAN without `views`  */
};

/* The truth under DPH_JUDGE_HELD_LIGHTS lights that cover the sphere evenly and that nothing is
 * fitted on, in pictures of the training's size. */
#define DPH_JUDGE_HELD_LIGHTS 24
struct dph_held_truth {
    int nlight;              /* 0: there is none; then all figures of these lights are NAN */
    int samples;             /* a pixel */
    size_t pixels;           /* of the object */
    double noise_rmse;       /* RMS of the noise / RMS truth of linear luminance, all lights together */
    double views_rmse;       /* as in struct dph_truth, all lights together; likewise the next */
    double views_noise_rmse;
};

/* One method's picture under one light. */
struct dph_shot {
    struct dph_scores scores;
    struct dph_image image; /* linear; `pixel` is NULL for entries that are not shown */
    float *flip;            /* (height x width) FLIP at every pixel, 0 to 1, 0 outside the object;
                             * NULL likewise. dph_image_init_magma (metrics.h) colours it */
    bool noisy;             /* a figure is not to be trusted: see `warning` */
    char warning[160];      /* a clause that says why; empty where nothing is wrong */
};

/* A method in one of its variants, fitted or not, in one material. Entries come in the order in
 * which a report shows them: by method, then by variant; the fitted one follows the one that is
 * not. */
struct dph_entry {
    const struct dph_method *method;
    char variant[48];  /* "6 bands"; empty where a method has one variant only */
    bool fitted;
    bool shown;        /* has pictures; false for the rows of a study */
    int bands;         /* of spherical harmonics, 0: the method has none */
    bool stores;       /* coefficients: `store` and `fit` mean something */
    enum dph_store store;
    enum dph_fit fit;  /* of the coefficients to thickness */
    struct dph_material material; /* as drawn with: the fitted numbers are in it. `formula` and
                                   * `curve` mean something where `takes_thickness` */
    bool takes_thickness; /* is drawn by the formula of material.h */
    double gain[3];    /* the picture times this, per channel; 1 where nothing was fitted or what
                        * was is in `material` */
    double training_before, training_after; /* mean over the training lights of (RMS error / RMS
                        * truth), over channels and object; NAN where nothing was fitted */
    double rmse_all_lights;  /* rmse over all pixels of all lights of struct dph_held_truth together:
                        * root of (sum of squared errors / sum of squared truth); NAN: none */
    double rmse_all_lights_view_averaged; /* from the truth averaged over views; likewise */
    double bytes_per_vertex; /* as the vertex stage fetches them, beyond position and normal */
    double payload_bytes;    /* a vertex, without padding */
    size_t table_bytes;      /* beside the vertices */
    int passes;              /* a frame */
    double seconds;          /* of precomputation; 0 where it came from the file */
    double milliseconds;     /* a frame: median of drawing one light at the comparison's size, with
                              * the samples of dph_frame_defaults */
    struct dph_shot *shot;   /* (nlight) */
};

/* Everything in one material. */
struct dph_judged {
    struct dph_material material;
    struct dph_truth *truth;   /* (nlight) */
    struct dph_held_truth held;
    int samples;               /* a pixel that the truth has */
    uint64_t paths, lost, capped; /* of the reference, see reference.h */
    double seconds_truth, seconds_training, seconds;
    double seconds_views, seconds_held; /* tracing views of the scored lights; all of the held ones */
    size_t nentry;
    struct dph_entry *entry;   /* (nentry) */
};

/* A light that is scored. */
#define DPH_JUDGE_LIGHTS 8
struct dph_judge_light {
    char name[16];
    double azimuth, elevation; /* degrees, in the world */
};

/* Light "front", "side" or "back" of a camera: its azimuth + 30, + 90, + 180 degrees, elevation 20.
 * False: another name. */
bool dph_judge_light_find(const char *name, const struct dph_camera *camera,
                          struct dph_judge_light *light);
/* "front", "side", "back"; NULL beyond the last. */
const char *dph_judge_light_name(size_t i);

enum dph_judge_phase {
    DPH_JUDGE_BAKE = 0,  /* thickness and what rivals need */
    DPH_JUDGE_TRUTH,     /* the reference. Cancelling ends it with the samples that it has */
    DPH_JUDGE_TRAINING,  /* the reference under the training lights; likewise */
    DPH_JUDGE_VIEWS,     /* the reference averaged over views; likewise */
    DPH_JUDGE_HELD,      /* the reference under the lights that cover the sphere; likewise, but then
                          * it is not averaged over views if it was not yet */
    DPH_JUDGE_FIT,
    DPH_JUDGE_DRAW,      /* and score */
};
/* "baking", "tracing", "tracing to fit", "tracing views", "tracing all lights", "fitting",
 * "drawing". */
const char *dph_judge_phase_name(enum dph_judge_phase phase);

/* Called during the work; `fraction` is that of the phase in this material, 0 to 1. False cancels
 * the phase. */
typedef bool dph_judge_progress(void *user, enum dph_judge_phase phase, const char *material,
                                double fraction);

/* struct dph_judge_params p = dph_judge_defaults(); methods and materials have to be set. */
struct dph_judge_params {
    size_t nmethod;
    const struct dph_method *const *method;  /* (nmethod) none that draws a quantity */
    size_t nmaterial;
    const struct dph_material *material;     /* (nmaterial) drawn without specular, rim, ambient */
    size_t nlight;                           /* 1 to DPH_JUDGE_LIGHTS; 3 */
    struct dph_judge_light light[DPH_JUDGE_LIGHTS]; /* front, side, back of the default camera */
    double light_angle;           /* half-angle of their discs in degrees; 0 */
    enum dph_boundary boundary;   /* of the reference. Dielectric with light_angle 0 makes discs of
                                   * 5 degrees for all methods; matched */
    struct dph_camera camera;     /* 0, 15, 3.5, 35 */
    int width, height;            /* 1280 x 800 */
    int samples;                  /* of the reference, a pixel; 256 */
    uint64_t seed;                /* 1 */
    double size_mm;               /* largest side of the scene, see dph_scene_millimetres; 0 */
    bool fit;                     /* also fitted entries; true */
    bool study;                   /* also formula x curve x fit x bands of shsss; false */
    int training_width, training_height; /* 160 x 100 */
    int training_samples;         /* 64 */
    int views_samples;            /* of the truth averaged over views, a pixel, 0: as `samples`. It is
                                   * traced where a method is a response and the boundary is matched;
                                   * 0 */
    int held_samples;             /* of the lights of struct dph_held_truth; 0: none are traced; 32 */
    struct dph_scene_bake_params bake; /* of thickness; size_mm, material, threads and progress
                                        * are not read */
    struct dph_rivals_params rivals;    /* likewise */
    struct dph_scene_response_params response; /* likewise. Its form is judged with 6, 4 and 3 bands,
                                         * up to those that it asks for */
    int map_size;                 /* of green and green-gauss, as struct dph_frame; 1024 */
    double blur_mm;               /* -1 */
    int multisamples;             /* of all pictures that are drawn, as `samples` of struct dph_frame; 16.
                                   * The truth is the mean over a pixel: what few samples make of an
                                   * outline is not the method's error */
    double most_bytes;            /* that the pictures of a comparison may take; 0: any number */
    int threads;                  /* 0: all */
    dph_judge_progress *progress; /* Nullable */
    void *progress_user;
};
struct dph_judge_params dph_judge_defaults(void);

/* A finished comparison. Owns everything in it. */
struct dph_comparison {
    size_t nlight;
    struct dph_judge_light light[DPH_JUDGE_LIGHTS];
    size_t nmaterial;
    struct dph_judged *material; /* (nmaterial) */
    struct dph_camera camera;
    int width, height;
    int samples;             /* asked for; what a material got stands there */
    int multisamples;
    uint64_t seed;
    enum dph_boundary boundary;
    double light_angle;      /* as used */
    double size_mm, mm_per_unit;
    size_t triangles, vertices;
    char renderer[160];      /* GL_RENDERER and GL_VERSION */
    double seconds;
    size_t nwarning;
    char **warning;          /* (nwarning) whole sentences */
};

/* Compares. A GL context must be current (`renderer` is its name for the record, Nullable). The
 * scene's bodies are baked anew where they lack what a method needs for a material; afterwards
 * they have what they had, and what was baked last of what they had not. NULL:
 * DPH_ERROR_ARGUMENT (nothing to compare, a parameter out of its range, no pixel of the object in
 * view), _LIMIT (more than most_bytes), both before the work; _INPUT, _MEMORY, _CAPABILITY,
 * _CANCELLED. */
struct dph_comparison *dph_comparison_create(struct dph_scene *scene,
                                             const struct dph_judge_params *params,
                                             const char *renderer, struct dph_error *err);
/* Accepts NULL. */
void dph_comparison_destroy(struct dph_comparison *comparison);

/* Fits the free numbers of one method to the reference under the training lights: of methods that
 * take thickness (shsss, green, green-gauss) sigma of the exponential curve, base, front and back.
 * Takes params->method[0], params->material[0], the bake, the training's size and samples, size_mm,
 * camera, boundary, light_angle. `fitted` is the material with these numbers; `before` and `after`
 * as training_before and training_after of an entry. False: as dph_comparison_create, and
 * DPH_ERROR_ARGUMENT for a method that has no such numbers. */
bool dph_judge_fit(struct dph_scene *scene, const struct dph_judge_params *params,
                   struct dph_material *fitted, double *before, double *after,
                   struct dph_error *err);

/* The scores of a picture beside a reference over `mask` (height x width). `noise`: that of the
 * reference (Nullable: none). `map` (height x width; Nullable) receives FLIP. False: as the
 * measures of metrics.h. */
bool dph_scores_measure(const struct dph_image *reference, const struct dph_noise *noise,
                        const struct dph_image *image, const uint8_t *mask, int threads,
                        struct dph_scores *scores, float *map, struct dph_error *err);

/* The noise of a reference, whose picture is the mean of all samples, from `half` (height x width x
 * 3), the mean of a part of them: `share` of their number, between 0 and 1, else all is NAN. */
bool dph_noise_measure(const struct dph_image *reference, const float *half, double share,
                       const uint8_t *mask, int threads, struct dph_noise *noise,
                       struct dph_error *err);

#ifdef __cplusplus
}
#endif
#endif
