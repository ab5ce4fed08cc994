/* diaphan/response.h - how a body of one material and one size answers to light, small enough for
 * the vertices of a mesh.      Tier 2.
 *
 * The response p(x, w) of position x is the radiance that leaves it, averaged over the directions of
 * sight, when light of irradiance 1 (perpendicular to it) comes from direction w: everything that
 * scatters below the surface, light that falls on the front included. A bake gives it as RGB rows of
 * SH coefficients (struct dph_transfer); here such rows become one of three forms:
 *
 *   root     one channel; the square of the sum of coefficients is the luminance of p
 *   linear   one channel; the sum itself, cut off at 0, is the luminance of p
 *   rgb      three channels, linear
 *
 * Forms of one channel get their colour from a ramp: colour as a function of the value, one for a
 * body. Linear forms may sum several lights, and surroundings, before the vertices are met; the root
 * form needs a sum a light, but errs least for its bytes. From plain arrays; no files, no GL, no
 * rays. Coefficients lie in the body's space, as thickness does, and are packed like it. */
#ifndef DIAPHAN_RESPONSE_H
#define DIAPHAN_RESPONSE_H

#include <diaphan/cpca.h>
#include <diaphan/transfer.h>

#ifdef __cplusplus
extern "C" {
#endif

enum dph_response_form { DPH_RESPONSE_ROOT = 0, DPH_RESPONSE_LINEAR, DPH_RESPONSE_RGB };

/* "root", "linear", "rgb"; NULL beyond the last. */
const char *dph_response_form_name(enum dph_response_form form);

/* Luminance as it is meant here: .2126 R + .7152 G + .0722 B (ITU-R BT.709, the primaries of sRGB). */
double dph_response_luminance(const double color[3]);

/* Colour as a function of a value, the luminance of p. Entry k stands at the value top (k / (entries
 * - 1))^2, so that dim values get as many entries as their roots have room. Between entries colours
 * are interpolated along the root of the value; beyond the last one they stay. */
#define DPH_RAMP_ENTRIES 24
struct dph_ramp {
    float top;                         /* > 0                                                     */
    float color[DPH_RAMP_ENTRIES][3];  /* linear RGB, >= 0                                        */
};

/* The colour of a value; what is below 0 counts as 0. */
void dph_ramp_color(const struct dph_ramp *ramp, double value, double color[3]);

/* What a direction of sight sees, over the average of all of them. With l and v the unit vectors to
 * the light and to the eye in the object's space, c_i the coefficients of a vertex's root, of which
 * the first four are its mean and the direction it gets most light from, p the value towards l, and
 *
 *     q = sqrt(pi) (c_0 y_0,  sum_i=1..3 c_i y_i(v),  sum_i=1..3 c_i y_i(l),  sqrt(p)),
 *     gain = sum_k (l.v)^k (t_k + sum_i t_ki q_i + sum_i<=j t_kij q_i q_j),   k = 0, 1, 2,
 *
 * the 15 terms of a k being 1, q_0 .. q_3, q_0 q_0, q_0 q_1 .. q_3 q_3; cut off below 0 and above 4.
 * dph_response_view_fit (response_bake.h) finds the terms of a body by random walks. */
#define DPH_VIEW_TERMS 45
struct dph_view_gain {
    float term[DPH_VIEW_TERMS];
};

/* The gain that is 1 everywhere. */
struct dph_view_gain dph_view_even(void);

/* struct dph_response_params p = dph_response_defaults(); */
struct dph_response_params {
    enum dph_response_form form; /* DPH_RESPONSE_ROOT                                             */
    int bands;                   /* 1 to DPH_DRAW_BANDS; 6                                        */
    enum dph_store store;        /* DPH_STORE_SNORM8                                              */
    struct dph_cpca_params cpca; /* DPH_STORE_CPCA; its threads, portable and progress are not read */
    int threads;                 /* 0: as many as there are processors; 0                         */
    bool portable;               /* use no processor-specific code (the bytes are the same); false */
    dph_progress *progress;      /* Nullable; NULL                                                */
    void *progress_user;
};

struct dph_response_params dph_response_defaults(void);

/* The presets, by the bytes of a vertex: 4, 9, 16 and 36 (root, 2, 3, 4 and 6 bands, snorm8). Sets
 * form, bands and store. False: there is none of so many bytes, nothing is set. */
bool dph_response_preset(int bytes, struct dph_response_params *params);

/* The response of one body as it is drawn and stored. Owns what it points to. Safe to read from
 * several threads. */
struct dph_response {
    enum dph_response_form form;
    int bands;
    /* Packed rows, one a vertex: [0] for one channel, of p's root or of p; R, G and B for
     * DPH_RESPONSE_RGB. All of one store. NULL for RGB that is stored as DPH_STORE_CPCA. */
    struct dph_thickness *channel[3];
    /* RGB as DPH_STORE_CPCA: all three channels of a position (3 x bands * bands) are one signal.
     * Else NULL. */
    struct dph_cpca *clusters;
    uint32_t *position_of; /* (nvert) the signal of a vertex; NULL without clusters               */
    struct dph_ramp ramp;  /* forms of one channel                                                */
    struct dph_view_gain view; /* root form; the others, whose lights may be summed, and
                                * DPH_STORE_CPCA stay averages: even                              */
    size_t nvert;
    double noise;          /* of the bake, relative, as it estimated it; 0: not known             */
    double walks;          /* of the bake, mean of a position; 0: not known                       */
};

/* What happened. Errors are relative to the rows that it was made of: root of the mean square over
 * positions (by area) and directions of the difference, over that of the rows. They hold what form,
 * bands and packing lose, and no noise. */
struct dph_response_report {
    size_t positions;
    double error;            /* of the luminance                                                  */
    double error_rgb;        /* of the three channels together                                    */
    int iterations;          /* root: of the position that took most                              */
    double seconds_fit, seconds_store, seconds_ramp;
};

/* Makes a form of `full`, RGB rows with areas. `report` is Nullable. The same input and parameters
 * give the same bytes for any number of threads and on any processor. `noise`, `walks` and `view`
 * (until then even) are left for the caller to set.
 * NULL: DPH_ERROR_ARGUMENT (a parameter out of range, rows that are not RGB), DPH_ERROR_INPUT (a
 * number that is not finite), DPH_ERROR_MEMORY, DPH_ERROR_CANCELLED. */
struct dph_response *dph_response_create(const struct dph_transfer *full,
                                         const struct dph_response_params *params,
                                         struct dph_response_report *report,
                                         struct dph_error *err);

/* Frees it; accepts NULL. */
void dph_response_destroy(struct dph_response *response);

/* p of one vertex towards a unit direction of object space, in colour, with the first `bands` bands
 * of a linear form (0: all): what is drawn for light of irradiance 1 from there. */
void dph_response_along(const struct dph_response *response, size_t vertex,
                        const double direction[3], int bands, double color[3]);

/* The value of one vertex towards a unit direction of object space, which the ramp has a colour for.
 * Forms of one channel only. */
double dph_response_value(const struct dph_response *response, size_t vertex,
                          const double direction[3]);

/* The gain of one vertex for unit directions of object space to a light and to an eye: what
 * dph_response_along gives is multiplied by it where `view` is not even. Root form, not stored as
 * DPH_STORE_CPCA. */
double dph_response_view(const struct dph_response *response, size_t vertex,
                         const double to_light[3], const double to_eye[3]);

/* The gain for one light and one eye as a shader takes it (DphView of shaders/diaphan.glsl), f_i
 * being the first four coefficients as they are stored, normalised, and u the root of the value over
 * that of the ramp's end:
 *
 *     q = (mean f_0, eye . f, light . f, u),
 *     gain = even + linear . q + square . q^2 + mixed . (q_0 q_1, q_0 q_2, q_0 q_3)
 *            + cross . (q_1 q_2, q_1 q_3, q_2 q_3). */
struct dph_view_constants {
    float mean, eye[3], light[3]; /* eye and light: of f_1 to f_3                                  */
    float even, linear[4], square[4], mixed[3], cross[3];
};

/* Unit directions of object space; of a response as for dph_response_view. */
void dph_view_constants(const struct dph_response *response, const double to_light[3],
                        const double to_eye[3], struct dph_view_constants *constants);

/* What it takes, as the functions of the same names in thickness.h; the ramp counts as shared. */
size_t dph_response_payload(const struct dph_response *response);
size_t dph_response_fetched(const struct dph_response *response);
size_t dph_response_shared(const struct dph_response *response);

#ifdef __cplusplus
}
#endif
#endif
