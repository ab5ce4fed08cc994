/* The frame's target: multisampled linear floats, resolved by averaging and read back.
 *
 * Samples are averaged before any tone curve, as light adds up. Nothing is blended while drawing;
 * the background is cleared to zero with alpha 0, so alpha comes out as coverage and colours
 * premultiplied by it. */
#include "render/draw.h"

#include "core/fail.h"

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

bool dph_target_fit(struct dph_target *target, int width, int height, int samples,
                    struct dph_error *err)
{
    if (target->frame && target->width == width && target->height == height &&
        target->asked == samples)
        return true;
    dph_target_finish(target);
    GLint largest = 0, most = 1;
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &largest);
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    if (width > largest || height > largest)
        return dph_fail(err, DPH_ERROR_CAPABILITY,
                        "a picture of %d x %d pixels: GL has at most %d a side", width, height,
                        (int)largest);
    dph_gl_drain();
    GLenum status = 0;
    for (int n = samples < most ? samples : most; n >= 1; n /= 2) {
        target->color = make_buffer(GL_RGBA32F, width, height, n);
        target->depth = make_buffer(GL_DEPTH_COMPONENT24, width, height, n);
        target->frame = make_frame(target->color, target->depth);
        status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
        target->resolved_color = make_buffer(GL_RGBA32F, width, height, 1);
        target->resolved = make_frame(target->resolved_color, 0);
        if (status == GL_FRAMEBUFFER_COMPLETE)
            status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        glBindRenderbuffer(GL_RENDERBUFFER, 0);
        if (dph_gl_check("target", err) && status == GL_FRAMEBUFFER_COMPLETE) {
            target->width = width;
            target->height = height;
            target->asked = samples;
            target->samples = n;
            return true;
        }
        dph_target_finish(target);
    }
    return dph_fail(err, DPH_ERROR_CAPABILITY, "no float target of %d x %d pixels (status 0x%04x)",
                    width, height, (unsigned)status);
}

void dph_target_resolve(const struct dph_target *target, int width, int height)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, target->frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target->resolved);
    glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

bool dph_target_read(struct dph_target *target, int width, int height, float *pixel, int row_length,
                     struct dph_error *err)
{
    dph_target_resolve(target, width, height);
    glBindFramebuffer(GL_FRAMEBUFFER, target->resolved);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glPixelStorei(GL_PACK_ROW_LENGTH, row_length);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, pixel);
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return dph_gl_check("read back", err);
}
