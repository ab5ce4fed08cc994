/* render/gl.h - the GL layer: programs from embedded shaders, checked uniforms, drained errors.      Tier 3, private. */
#ifndef DPH_RENDER_GL_H
#define DPH_RENDER_GL_H

#include <diaphan/error.h>
#include <epoxy/gl.h>

/* A linked program. Uniforms are set by name through the functions below, which remember the first
 * name that the shaders do not declare; dph_program_check reports it. */
struct dph_program {
    GLuint id;
    char *label;              /* "body.vert + shsss.frag"                                  */
    char *source;             /* both stages, to tell a misspelt name from one that the compiler dropped */
    struct dph_uniform *uniform; /* (nuniform) names met so far                            */
    size_t nuniform, capacity;
    char unknown[64];         /* first name that is not declared, else empty               */
};

/* Compiles and links two embedded shaders, frag NULL: none. Before the text come #version,
 * `defines` ("#define A 1\n...") and #line; #include "name" of other embedded files is expanded.
 * `feedback`: Nullable, name of a varying to capture. False: DPH_ERROR_CAPABILITY with the
 * compiler's first message as "file:line: text", or DPH_ERROR_MEMORY. */
bool dph_program_init(struct dph_program *program, const char *vert, const char *frag,
                      const char *defines, const char *feedback, struct dph_error *err);
void dph_program_finish(struct dph_program *program);

/* Set uniforms of the program in use. A name that is declared but was optimised away is passed
 * over. */
void dph_set_int(struct dph_program *program, const char *name, int value);
void dph_set_float(struct dph_program *program, const char *name, float value);
/* `components` 2 to 4 */
void dph_set_vec(struct dph_program *program, const char *name, int components, int count,
                 const float *value);
/* `side` 3 or 4, column-major */
void dph_set_mat(struct dph_program *program, const char *name, int side, const float *value);

/* False, naming the pass: a uniform of an unknown name was set (DPH_ERROR_ARGUMENT: a programmer's
 * mistake), or GL has an error (DPH_ERROR_CAPABILITY). Drains all errors of GL. */
bool dph_program_check(struct dph_program *program, const char *pass, struct dph_error *err);
bool dph_gl_check(const char *pass, struct dph_error *err);

/* Forgets errors that were there before us. */
void dph_gl_drain(void);

/* The text of an embedded shader with its includes, as it goes to the compiler. malloc'ed; NULL:
 * DPH_ERROR_MEMORY, or DPH_ERROR_ARGUMENT for a file that is not there. */
char *dph_shader_text(const char *name, const char *defines, struct dph_error *err);

#endif
