/* judge/protocol.h - the steps of a comparison, each a file of its own.      Tier 4, private.
 *
 * compare.c calls the others: variants.c bakes, truth.c, views.c and held.c trace, fit.c fits with
 * solve.c, shots.c draws and score.c scores. sight.c looks before all that whether it can succeed. */
#ifndef DPH_JUDGE_PROTOCOL_H
#define DPH_JUDGE_PROTOCOL_H

#include <diaphan/judge.h>

#define DPH_TRAINING_LIGHTS 12

/* Passes a phase's progress on to the caller of the comparison. */
struct dph_judge_step {
    dph_judge_progress *progress; /* Nullable */
    void *user;
    enum dph_judge_phase phase;
    const char *material;
};
bool dph_judge_step(void *step, double fraction); /* a dph_progress */
/* False: cancelled, and *err says so. */
bool dph_judge_step_checked(struct dph_judge_step *step, double fraction, struct dph_error *err);

/* compare.c */

/* Whether parameters are in range. */
bool dph_judge_check(const struct dph_judge_params *params, struct dph_error *err);
/* Whether a method is drawn by the formula of material.h. */
bool dph_takes_thickness(const struct dph_method *method);

/* sight.c: what is asked before the work */

/* Whether the camera sees anything of the object: in pictures of the scored size, the training's. */
bool dph_judge_look(struct dph_scene *scene, const struct dph_judge_params *params, bool scored,
                    bool training, struct dph_error *err);
/* Whether the pictures of a comparison fit into params->most_bytes. */
bool dph_judge_room(const struct dph_scene *scene, const struct dph_judge_params *params,
                    struct dph_error *err);

/* truth.c */

/* The lights that the free numbers are fitted on, in the world, each with irradiance pi. */
void dph_training_lights(const struct dph_camera *camera, double angle,
                         struct dph_light light[DPH_TRAINING_LIGHTS]);
/* `count` points of a spherical Fibonacci set that begins at an azimuth in degrees, likewise. */
void dph_fibonacci_lights(double start, double angle, int count, struct dph_light *light);
/* A scored light, likewise. */
struct dph_light dph_judge_light_make(const struct dph_judge_light *light, double angle);
/* The half-angle of the lights' discs for all methods. */
double dph_judge_angle(const struct dph_judge_params *params);
/* A material without highlight, rim and ambient light. */
struct dph_material dph_judge_bare(const struct dph_material *material);

/* What a trace has of its own. Each set of pictures has random numbers of its own, so that the noise
 * of what is fitted on is not that of what is scored. */
enum dph_tracing_set {
    DPH_TRACING_TRUTH = 0,
    DPH_TRACING_TRAINING,
    DPH_TRACING_VIEWS,
    DPH_TRACING_HELD,
    DPH_TRACING_HELD_VIEWS,
};
struct dph_tracing_job {
    enum dph_tracing_set set;
    const struct dph_light *light; /* (nlight) a picture each */
    int nlight, width, height, samples;
    bool view_averaged;
};
bool dph_judge_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                     double mm_per_unit, const struct dph_material *material,
                     const struct dph_tracing_job *job, struct dph_judge_step *step,
                     struct dph_reference *reference, struct dph_error *err);
/* The object of a traced picture; its number of pixels. */
size_t dph_judge_mark(const float *pixel, size_t pixels, uint8_t *mask);
/* The share of the samples that is in `half`: the first, the third, ... */
double dph_judge_share(const struct dph_reference *reference);

/* The truth under every scored light: fills judged->truth (allocated, nlight zeros) and what else
 * is known of the reference. */
bool dph_truth_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                     double mm_per_unit, struct dph_judged *judged, struct dph_error *err);
void dph_truth_finish(struct dph_truth *truth);

/* What a fit needs: small pictures of the truth under the training lights. Owns its arrays. */
struct dph_training {
    int nlight, width, height;
    struct dph_light light[DPH_TRAINING_LIGHTS];
    struct dph_image image[DPH_TRAINING_LIGHTS];
    uint8_t *mask;
    double weight[DPH_TRAINING_LIGHTS][3]; /* 1 / sum of squares over the object; 0: black      */
    double noise[DPH_TRAINING_LIGHTS];     /* mean variance of luminance over the object        */
    size_t pixels;
    double seconds;
};
bool dph_training_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                        double mm_per_unit, const struct dph_material *material,
                        struct dph_training *training, struct dph_error *err);
void dph_training_finish(struct dph_training *training);

/* views.c */

/* Whether a comparison also has the truth averaged over views. */
bool dph_judge_has_views(const struct dph_judge_params *params);
/* Whether a method draws an average over views, too (dph_frame.view_averaged): that is then what is
 * held against this truth. */
bool dph_judge_averages(const struct dph_entry *entry);
/* That truth under every scored light, into judged->truth, which has the pictures. */
bool dph_views_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                     double mm_per_unit, struct dph_judged *judged, struct dph_error *err);

/* held.c */

/* Lights that cover the sphere, and their truth over the object. Owns its arrays. */
struct dph_held {
    int nlight, width, height;
    struct dph_light light[DPH_JUDGE_HELD_LIGHTS];
    uint8_t *mask;     /* (height x width) */
    size_t pixels;     /* of the object */
    float *truth[2];   /* (nlight x pixels) luminance; the second averaged over views, or NULL */
    double square[2];  /* sum over all of them of the squared truth, without noise */
    double noise[2];   /* sum of the variances */
};
void dph_held_lights(const struct dph_camera *camera, double angle,
                     struct dph_light light[DPH_JUDGE_HELD_LIGHTS]);
/* Fills `held` and judged->held; empty where params->held_samples is 0. */
bool dph_held_trace(const struct dph_scene *scene, const struct dph_judge_params *params,
                    double mm_per_unit, struct dph_judged *judged, struct dph_held *held,
                    struct dph_error *err);
void dph_held_finish(struct dph_held *held);
/* Draws an entry and, where `twins` is 2, the fitted one after it under all these lights and fills
 * their figures. */
bool dph_held_score(const struct dph_held *held, struct dph_renderer *renderer,
                    const struct dph_judge_params *params, double mm_per_unit,
                    struct dph_entry *entry, size_t twins, int bands, struct dph_error *err);

/* score.c */

static inline double dph_luminance(const float *rgb)
{
    return 0.2126 * (double)rgb[0] + 0.7152 * (double)rgb[1] + 0.0722 * (double)rgb[2];
}
/* RMS error / RMS truth of luminance over a mask. The pictures' noise is taken out of both: each has
 * a variance, the mean over the mask, and one that is drawn has none. */
double dph_relative_error(const struct dph_image *reference, double variance,
                          const struct dph_image *image, double image_variance,
                          const uint8_t *mask);

/* solve.c */

/* The x >= 0 that makes x'Gx - 2 h'x least. `matrix` (n x n) is symmetric, n is 1 to 3. Returns
 * that least value. */
double dph_solve_nonnegative(int n, const double *matrix, const double *right, double *x);

/* fit.c */

/* A method ready to be fitted: its renderer, a frame of the training's size with its material, and
 * the truth. */
struct dph_fitting {
    struct dph_renderer *renderer;
    struct dph_frame frame;
    const struct dph_training *training;
    double size_mm;
    struct dph_judge_step *step; /* Nullable */
};
/* Base, front and back, and sigma if the material's curve is the exponential one. `material` is the
 * frame's with these numbers. */
bool dph_fit_thickness(struct dph_fitting *fitting, struct dph_material *material,
                       struct dph_error *err);
/* One factor a channel. */
bool dph_fit_gain(struct dph_fitting *fitting, double gain[3], struct dph_error *err);
/* The error that training_before and training_after of an entry mean, of pictures times `gain`. */
bool dph_fit_error(struct dph_fitting *fitting, const struct dph_material *material,
                   const double gain[3], double *error, struct dph_error *err);

/* variants.c */

/* Thickness of all bodies, baked in one way. Owns it. */
struct dph_variant_bake {
    size_t nbody;
    struct dph_thickness **thickness; /* (nbody) */
    double seconds;
};
bool dph_variant_bake(struct dph_variant_bake *variant, struct dph_scene *scene,
                      const struct dph_judge_params *params, const struct dph_material *material,
                      enum dph_fit fit, int bands, struct dph_judge_step *step,
                      struct dph_error *err);
/* Exchanges it with what the scene has; twice is as before. */
void dph_variant_swap(struct dph_variant_bake *variant, struct dph_scene *scene);
void dph_variant_finish(struct dph_variant_bake *variant);
/* Whether every body with vertices has thickness. */
bool dph_scene_is_baked(const struct dph_scene *scene);
/* Bakes what methods need besides thickness for a material, where the scene does not have it. */
bool dph_variant_rivals(struct dph_scene *scene, const struct dph_judge_params *params,
                        const struct dph_material *material, double mm_per_unit,
                        struct dph_rivals_report *report, struct dph_judge_step *step,
                        struct dph_error *err);
/* The same for the response, with the rows of its bake kept. */
bool dph_variant_response(struct dph_scene *scene, const struct dph_judge_params *params,
                          const struct dph_material *material, double mm_per_unit,
                          struct dph_scene_response_report *report, struct dph_judge_step *step,
                          struct dph_error *err);
/* Bytes a vertex without padding of what a method stores; the mean over the vertices. */
double dph_variant_payload(const struct dph_scene *scene, const struct dph_method *method);

/* shots.c */

/* A frame of the comparison for an entry; one light is set by the caller. */
struct dph_frame dph_judge_frame(const struct dph_judge_params *params, double mm_per_unit,
                                 const struct dph_entry *entry);
/* Draws and scores an entry under every light. `entry->shot` is filled. */
bool dph_shots_draw(struct dph_renderer *renderer, const struct dph_judge_params *params,
                    double mm_per_unit, const struct dph_judged *judged, struct dph_entry *entry,
                    int bands, struct dph_error *err);
void dph_shot_finish(struct dph_shot *shot);
/* Median milliseconds of a frame. */
bool dph_shots_time(struct dph_renderer *renderer, const struct dph_judge_params *params,
                    double mm_per_unit, struct dph_entry *entry, int bands, struct dph_error *err);
/* Attaches warnings to the shots of a material whose figures drown in noise. */
void dph_shots_warn(struct dph_judged *judged, size_t nlight);

#endif
