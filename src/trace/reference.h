/* trace/reference.h - what the parts of the path tracer share.      Tier 2, private. */
#ifndef DPH_TRACE_REFERENCE_H
#define DPH_TRACE_REFERENCE_H

#include <diaphan/reference.h>
#include <diaphan/trace.h>

#include "trace/outlook.h"
#include "trace/walk.h"

#define DPH_MAX_SUNS 256

/* A distant light as paths see it. */
struct dph_sun {
    int picture;          /* that it lights */
    double to_light[3];   /* unit length */
    double irradiance[3]; /* of a plane perpendicular to it */
    double cosine;        /* of the disc's half-angle; 1: a point */
    double radiance[3];   /* of the disc */
    double even;          /* irradiance of a sample of the disc over that of the axis, see path.c */
};

/* A prepared scene. Lengths are in mm, from the centre of the scene. Read-only while tracing. */
struct dph_stage {
    struct dph_space space;
    struct dph_outlook outlook; /* of the suns, in their order */
    enum dph_boundary boundary;
    bool view_averaged; /* matched boundary only */
    bool straight;      /* view_averaged: with light that is not scattered */
    double eta;
    double radius; /* of the scene's bounding sphere */
    int npicture;
    int nsun;
    struct dph_sun *sun; /* (nsun) */
    double background[3];
    dph_radiance *environment;
    void *environment_user;
    int surroundings; /* the picture that the environment lights */
};

/* Adds the radiance against a camera ray, by one path, to (npicture x 3). `covered`: the ray met a
 * body. */
enum dph_ending dph_path_trace(const struct dph_stage *stage, struct dph_random *random,
                               const double origin[3], const double direction[3],
                               double *radiance, bool *covered);

#endif
