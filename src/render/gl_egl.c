/* A headless GL context through EGL. The only file that knows EGL.
 *
 * In this order: a graphics card through the device platform (a vendor's driver has nothing else
 * without a display), Mesa's surfaceless platform, and any device that is left. eglGetDisplay is of
 * no use without a display server. The platform functions are taken with their EXT names: libepoxy
 * ends the process where an entry point of EGL 1.5 without them is not resolved, and likewise where
 * libEGL or libOpenGL are missing, so both are looked for first. */
#include <diaphan/render.h>

#include "core/fail.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef EGL_PLATFORM_SURFACELESS_MESA
#define EGL_PLATFORM_SURFACELESS_MESA 0x31DD
#endif

struct dph_gl {
    EGLDisplay display;
    EGLContext context;
    char name[256];
};

static bool has_word(const char *list, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = list; at && (at = strstr(at, word)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || !at[length]))
            return true;
    return false;
}

static bool can_open(const char *library)
{
    void *handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
    if (handle)
        dlclose(handle);
    return handle;
}

/* Makes a 3.3 core context on a display and makes it current. `why` gets the reason of a failure. */
static bool start(struct dph_gl *gl, EGLDisplay display, const char **why)
{
    static const EGLint config_wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                           EGL_NONE};
    static const EGLint context_wanted[] = {EGL_CONTEXT_MAJOR_VERSION_KHR,
                                            3,
                                            EGL_CONTEXT_MINOR_VERSION_KHR,
                                            3,
                                            EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR,
                                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR,
                                            EGL_NONE};
    EGLint major, minor, count = 0;
    EGLConfig config = NULL;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor)) {
        *why = "no display";
        return false;
    }
    const char *extensions = eglQueryString(display, EGL_EXTENSIONS);
    if (!has_word(extensions, "EGL_KHR_surfaceless_context"))
        *why = "no surfaceless contexts";
    else if ((major == 1 && minor < 5) && !has_word(extensions, "EGL_KHR_create_context"))
        *why = "no core contexts";
    else if (!eglBindAPI(EGL_OPENGL_API))
        *why = "no desktop GL";
    else if (!eglChooseConfig(display, config_wanted, &config, 1, &count))
        *why = "no configuration";
    else {
        EGLContext context =
            eglCreateContext(display, count ? config : NULL, EGL_NO_CONTEXT, context_wanted);
        if (context != EGL_NO_CONTEXT) {
            if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
                gl->display = display;
                gl->context = context;
                const char *renderer = (const char *)glGetString(GL_RENDERER);
                const char *version = (const char *)glGetString(GL_VERSION);
                snprintf(gl->name, sizeof gl->name, "%s, GL %s", renderer ? renderer : "unknown",
                         version ? version : "unknown");
                return true;
            }
            eglDestroyContext(display, context);
        }
        *why = "no GL 3.3 core context";
    }
    eglTerminate(display);
    return false;
}

struct dph_gl *dph_gl_create_headless(struct dph_error *err)
{
    if (!can_open("libEGL.so.1")) {
        dph_fail(err, DPH_ERROR_CAPABILITY, "no GL context: libEGL.so.1 is not installed");
        return NULL;
    }
    if (!can_open("libOpenGL.so.0") && !can_open("libGL.so.1")) {
        dph_fail(err, DPH_ERROR_CAPABILITY,
                 "no GL context: neither libOpenGL.so.0 nor libGL.so.1 is installed");
        return NULL;
    }
    struct dph_gl *gl = calloc(1, sizeof *gl);
    if (!gl) {
        dph_fail_memory(err);
        return NULL;
    }
    const char *client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    const char *why = "not offered", *why_device = "none";
    bool platforms = has_word(client, "EGL_EXT_platform_base");
    EGLDeviceEXT device[32];
    EGLint devices = 0;
    if (platforms && has_word(client, "EGL_EXT_platform_device") &&
        (has_word(client, "EGL_EXT_device_base") || has_word(client, "EGL_EXT_device_enumeration")))
        if (!eglQueryDevicesEXT(32, device, &devices))
            devices = 0;
    for (int round = 0; round < 3; round++) {
        if (round == 1 && platforms && has_word(client, "EGL_MESA_platform_surfaceless") &&
            start(
                gl,
                eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL),
                &why))
            return gl;
        for (int i = 0; i < devices && round != 1; i++) {
            bool software = has_word(eglQueryDeviceStringEXT(device[i], EGL_EXTENSIONS),
                                     "EGL_MESA_device_software");
            if (software == (round == 2) &&
                start(gl, eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device[i], NULL),
                      &why_device))
                return gl;
        }
    }
    free(gl);
    dph_fail(err, DPH_ERROR_CAPABILITY,
             "no GL context: EGL's surfaceless platform: %s; its device platform, %d devices: %s",
             why, (int)devices, why_device);
    return NULL;
}

void dph_gl_destroy(struct dph_gl *gl)
{
    if (!gl)
        return;
    eglMakeCurrent(gl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(gl->display, gl->context);
    eglTerminate(gl->display);
    free(gl);
}

const char *dph_gl_name(const struct dph_gl *gl)
{
    return gl->name;
}
