/* diaphan/diaphan.h - the whole of the core library: meshes, spherical harmonics, baking, files, shading constants.
 *
 * Pictures (image.h, metrics.h), rays (trace.h, response_bake.h) and drawing (render.h) are libraries of their own and included apart. */
#ifndef DIAPHAN_DIAPHAN_H
#define DIAPHAN_DIAPHAN_H

#include <diaphan/bake.h>
#include <diaphan/cpca.h>
#include <diaphan/environment.h>
#include <diaphan/error.h>
#include <diaphan/file.h>
#include <diaphan/light.h>
#include <diaphan/material.h>
#include <diaphan/mesh.h>
#include <diaphan/patro.h>
#include <diaphan/prepare.h>
#include <diaphan/response.h>
#include <diaphan/response_scene.h>
#include <diaphan/rivals.h>
#include <diaphan/scene.h>
#include <diaphan/sh.h>
#include <diaphan/thickness.h>
#include <diaphan/transfer.h>

#endif
