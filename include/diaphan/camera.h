/* diaphan/camera.h - where a picture is taken from.      Tier 1. */
#ifndef DIAPHAN_CAMERA_H
#define DIAPHAN_CAMERA_H

#ifdef __cplusplus
extern "C" {
#endif

/* Looks at the centre of the scene's bounding box. */
struct dph_camera {
    double azimuth, elevation; /* degrees, of the place the camera stands                          */
    double distance;           /* in bounding-sphere radii (half the box's diagonal)               */
    double fov;                /* vertical, degrees                                                */
};

#ifdef __cplusplus
}
#endif
#endif
