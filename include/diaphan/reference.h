/* diaphan/reference.h - the path-traced reference: what a camera would see.      Tier 2. Only where
 * the library was built with Embree.
 *
 * A homogeneous medium fills every closed body of a scene. Nothing is clamped, no path is cut
 * short. docs/theory.md says how it is computed. */
#ifndef DIAPHAN_REFERENCE_H
#define DIAPHAN_REFERENCE_H

#include <diaphan/camera.h>
#include <diaphan/light.h>
#include <diaphan/material.h>
#include <diaphan/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

enum dph_boundary {
    DPH_BOUNDARY_MATCHED = 0, /* light goes in and out straight: no reflection, no refraction      */
    DPH_BOUNDARY_DIELECTRIC,  /* smooth, of the material's ior; a point of the sky becomes a disc of
                               * 5 degrees half-angle                                              */
};

/* Radiance that comes from direction `to`, unit length, world space. Called by many threads. */
typedef void dph_radiance(void *user, const double to[3], double radiance[3]);

/* What is drawn. Of the material only the medium counts: scattering, absorption, anisotropy and
 * ior. struct dph_reference_options o = dph_reference_defaults(); */
struct dph_reference_options {
    struct dph_material material; /* wax                                                           */
    enum dph_boundary boundary;   /* matched                                                       */
    bool view_averaged;           /* a pixel is the radiance that leaves the surface seen there,
                                   * averaged over all directions in which it leaves, weighted with
                                   * their cosine: what response_bake.h bakes. Of a matched boundary
                                   * only; the camera stands outside the bodies, which hide the
                                   * background and show the environment as any view would; false  */
    bool straight;                /* view_averaged: with light of the lights that is not scattered.
                                   * Left out, it is the average of what pictures show, where such
                                   * light is never seen; true                                     */
    struct dph_camera camera;     /* 0, 15, 3.5, 35                                                */
    int width, height;            /* 1280 x 800, each up to 32768                                  */
    double mm_per_unit;           /* 0: the scene's, else 25 mm for the largest side               */
    int nlight;                   /* 1, up to 256                                                  */
    const struct dph_light *light; /* (nlight) distant ones. Nullable: azimuth 150, elevation 30,
                                    * irradiance pi                                                */
    bool separate;                /* a picture for each light, and one more for the environment where
                                   * there is one, all of the same walks; false: one of their sum  */
    double background[3];         /* what a camera ray sees that goes straight on: 0. It lights
                                   * nothing and is in every picture                               */
    dph_radiance *environment;    /* lights everything; not seen beside the bodies. Nullable       */
    void *environment_user;
    int samples;                  /* a pixel, 1 to 2^24; 256                                       */
    uint64_t seed;                /* 1                                                             */
    int threads;                  /* 0: all. The picture does not depend on it                     */
    dph_progress *progress;       /* Nullable                                                      */
    void *progress_user;
};
struct dph_reference_options dph_reference_defaults(void);

/* The pictures, rows from the top. Noise of separate pictures is correlated, since they share
 * walks. For an even number of samples `half` and 2 pixel - half are two independent pictures of
 * half the samples, and a quarter of their squared difference has the expectation `variance`. */
struct dph_reference {
    int width, height;
    int npicture;        /* 1, or one for each separate light                                      */
    int samples;         /* that every pixel has                                                   */
    float *pixel;        /* (npicture x height x width x 4) linear radiance over the background, and
                          * coverage                                                               */
    float *variance;     /* (npicture x height x width x 3) of the pixel's mean; 0 where samples is
                          * 1                                                                      */
    float *half;         /* (npicture x height x width x 3) the mean over the first, third, fifth ...
                          * sample alone                                                           */
    uint64_t paths;
    uint64_t lost;       /* paths that rounding or an open body led astray; they end there         */
    uint64_t capped;     /* paths of a million scatterings; they end there                         */
};

/* Draws a scene; the camera and the frame are the renderer's (render.h), a pixel is the mean over
 * its square. `reference` is filled by the call and freed by dph_reference_finish. Where progress
 * cancels after the first sample, the picture holds the samples so far and the call returns true.
 * False: DPH_ERROR_ARGUMENT, _MEMORY, _CAPABILITY, or _CANCELLED before the first sample;
 * `reference` is then empty. */
bool dph_reference_render(const struct dph_scene *scene,
                          const struct dph_reference_options *options,
                          struct dph_reference *reference, struct dph_error *err);
void dph_reference_finish(struct dph_reference *reference);

#ifdef __cplusplus
}
#endif
#endif
