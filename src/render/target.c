/* The frame's target: multisampled linear floats, resolved by averaging and read back.
 *
 * Samples are averaged before any tone curve, as light adds up. Nothing is blended while drawing;
 * the background is cleared to zero with alpha 0, so alpha comes out as coverage and colours
 * premultiplied by it.
 *
 * GL may have fewer samples a pixel than are asked for (Mesa's llvmpipe has 4). Then the target is
 * `finer` times as wide and as high as what is drawn, with the samples in each of its pixels that
 * are still missing, and squares of finer x finer of them are averaged after reading back. Pixels
 * of the picture have the same borders as before, so nothing shifts. `finer` is the smallest that
 * will do: 16 samples are 2 x 2 x 4 where GL has 4 to 15, and 4 x 4 x 1 where it has one. */
#include "render/draw.h"

#include "core/fail.h"
#include "core/memory.h"

#include <stdlib.h>

#define TILE 2048 /* pixels a side of the largest target: it stays within some hundred megabytes */

void dph_target_finish(struct dph_target *target)
{
    GLuint buffers[3] = {target->color, target->depth, target->resolved_color};
    GLuint frames[2] = {target->frame, target->resolved};
    glDeleteFramebuffers(2, frames);
    glDeleteRenderbuffers(3, buffers);
    *target = (struct dph_target){0};
}

static GLuint make_buffer(GLenum format, int width, int height, int samples)
{
    GLuint name;
    glGenRenderbuffers(1, &name);
    glBindRenderbuffer(GL_RENDERBUFFER, name);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples > 1 ? samples : 0, format, width,
                                     height);
    return name;
}

static GLuint make_frame(GLuint color, GLuint depth)
{
    GLuint name;
    glGenFramebuffers(1, &name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
    if (depth)
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    return name;
}

/* As much of a side of a picture as a target takes. */
static int tile(int side, int finer)
{
    return side < TILE / finer ? side : TILE / finer;
}

/* Fills an empty target; leaves it empty where GL cannot have it. */
static bool make_target(struct dph_target *target, int width, int height, int samples,
                        GLenum *status, struct dph_error *err)
{
    dph_gl_drain();
    target->color = make_buffer(GL_RGBA32F, width, height, samples);
    target->depth = make_buffer(GL_DEPTH_COMPONENT24, width, height, samples);
    target->frame = make_frame(target->color, target->depth);
    *status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    target->resolved_color = make_buffer(GL_RGBA32F, width, height, 1);
    target->resolved = make_frame(target->resolved_color, 0);
    if (*status == GL_FRAMEBUFFER_COMPLETE)
        *status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glBindRenderbuffer(GL_RENDERBUFFER, 0);
    if (dph_gl_check("target", err) && *status == GL_FRAMEBUFFER_COMPLETE)
        return true;
    dph_target_finish(target);
    return false;
}

bool dph_target_fit(struct dph_target *target, int width, int height, int samples,
                    struct dph_error *err)
{
    if (target->frame && target->width == tile(width, target->finer) &&
        target->height == tile(height, target->finer) && target->asked == samples)
        return true;
    dph_target_finish(target);
    GLint most = 1;
    GLenum status = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    /* until a pixel of the target needs but one; floats may have fewer samples than `most` */
    for (int finer = 1; (finer - 1) * (finer - 1) < samples; finer++) {
        const int square = finer * finer, each = (samples + square - 1) / square;
        const int w = tile(width, finer), h = tile(height, finer);
        if (each > 1 && each > most)
            continue;
        if (make_target(target, w * finer, h * finer, each, &status, err)) {
            target->width = w;
            target->height = h;
            target->asked = samples;
            target->samples = each;
            target->finer = finer;
            return true;
        }
    }
    return dph_fail(err, DPH_ERROR_CAPABILITY,
                    "no float target for %d x %d pixels (status 0x%04x)", width, height,
                    (unsigned)status);
}

void dph_target_resolve(const struct dph_target *target, int width, int height)
{
    const int w = width * target->finer, h = height * target->finer;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, target->frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target->resolved);
    glBlitFramebuffer(0, 0, w, h, 0, 0, w, h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

/* Rows of `width` pixels, `row_length` apart, from `fine` with finer x finer for each of them. */
static void average(const float *fine, size_t finer, size_t width, size_t height, float *pixel,
                    size_t row_length)
{
    const float share = 1 / (float)(finer * finer);
    for (size_t y = 0; y < height; y++)
        for (size_t i = 0; i < 4 * width; i++) {
            const float *corner = fine + 4 * finer * (y * finer * width + i / 4) + i % 4;
            float sum = 0;
            for (size_t v = 0; v < finer; v++)
                for (size_t u = 0; u < finer; u++)
                    sum += corner[4 * (v * finer * width + u)];
            pixel[4 * y * row_length + i] = share * sum;
        }
}

bool dph_target_read(struct dph_target *target, int width, int height, float *pixel, int row_length,
                     struct dph_error *err)
{
    const int w = width * target->finer, h = height * target->finer;
    float *fine = NULL;
    if (target->finer > 1 && !(fine = dph_alloc((size_t)w * (size_t)h, 4 * sizeof *fine)))
        return dph_fail_memory(err);
    dph_target_resolve(target, width, height);
    glBindFramebuffer(GL_FRAMEBUFFER, target->resolved);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glPixelStorei(GL_PACK_ROW_LENGTH, fine ? 0 : row_length);
    glReadPixels(0, 0, w, h, GL_RGBA, GL_FLOAT, fine ? fine : pixel);
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    bool ok = dph_gl_check("read back", err);
    if (ok && fine)
        average(fine, (size_t)target->finer, (size_t)width, (size_t)height, pixel,
                (size_t)row_length);
    free(fine);
    return ok;
}
