/* figure.h - what the contact sheet and the report of a comparison share: which entries stand
 * beside each other, the part of the pictures that is shown and how bright, figures as text. */
#ifndef FIGURE_H
#define FIGURE_H

#include <diaphan/judge.h>

/* What the comparison itself does not know. Texts are shown as they are; Nullable both. */
struct figure_run {
    const char *model;   /* the file's name, or what people call it */
    const char *command; /* that makes the figure again             */
};

/* A method in one variant, as it is and fitted: one of them may be missing, not both. */
struct figure_column {
    const struct dph_entry *plain, *fitted;
};
/* The one whose picture is shown: the fitted one, where it is there. */
const struct dph_entry *figure_shown(const struct figure_column *column);

/* The columns of a material, of entries that have pictures (`shown`) or of the others. *column is
 * (the result), the caller's to free(); NULL with a result of 0: none, or out of memory. */
size_t figure_columns(const struct dph_judged *judged, bool shown, struct figure_column **column);

/* A part of the pictures, in pixels. */
struct figure_crop {
    int x, y, width, height;
};
/* The box around the object in all pictures of the comparison, and a little air. */
struct figure_crop figure_crop(const struct dph_comparison *comparison);

/* Stops by which the pictures of a light are shown brighter so that their shape is seen: whole
 * ones, 0 for a truth that is bright enough by itself. The figures are always of exposure 0. */
int figure_stops(const struct dph_truth *truth);

/* The part of a picture or of an error map (height x width of the comparison, in the colours
 * magma), made `width` x `height`: larger by repeating pixels, smaller by averaging light. */
bool figure_picture(const struct dph_image *image, const struct figure_crop *crop, int width,
                    int height, struct dph_image *out, struct dph_error *err);
bool figure_map(const float *map, const struct dph_comparison *comparison,
                const struct figure_crop *crop, int width, int height, struct dph_image *out,
                struct dph_error *err);

/* The four figures, in the order in which they are shown. */
enum { FIGURE_RMSE, FIGURE_PSNR, FIGURE_SSIM, FIGURE_FLIP, FIGURES };
extern const char *const figure_name[FIGURES];
double figure_of(const struct dph_scores *scores, int which);
double figure_of_noise(const struct dph_noise *noise, int which);
/* Whether a is the better one, where both are numbers. */
bool figure_better(int which, double a, double b);
/* Whether they look the same as printed. */
bool figure_same(int which, double a, double b);
/* "0.213", "31.2"; a dash for what is no number. */
const char *figure_print(int which, double value, char out[24]);

/* "azimuth 30, elevation 20" and the like, with units. */
void figure_print_light(const struct dph_judge_light *light, char out[96]);
/* "36 B a vertex", "6 bands, snorm8"; empty where there is nothing to say. */
void figure_print_bytes(const struct dph_entry *entry, char out[64]);
/* Seconds or milliseconds with three digits. */
void figure_print_time(double seconds, char out[32]);
/* One paragraph: model, size, camera, samples, noise, light, renderer. free() it; NULL: out of
 * memory. */
char *figure_caption(const struct dph_comparison *comparison, const struct figure_run *run);

#endif
