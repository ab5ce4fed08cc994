/* The GL layer: shaders become programs, uniforms are checked, errors are drained.
 *
 * GL itself ignores a uniform's misspelt name and reports errors only when asked. Here a name that
 * no shader declares is an error of the pass that set it, and a compiler's message names the file
 * in shaders/ and the line in it. */
#include "render/gl.h"

#include "core/fail.h"
#include "core/memory.h"
#include "render/shaders.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct dph_uniform {
    char name[64];
    GLint location; /* -1: declared, not used */
};

/* A growing text. */
struct text {
    char *data;
    size_t size, capacity;
    bool failed;
};

static void append(struct text *text, const char *data, size_t size)
{
    if (text->failed)
        return;
    if (text->size + size + 1 > text->capacity) {
        size_t capacity = (text->size + size + 1) * 2;
        char *bigger = realloc(text->data, capacity);
        if (!bigger) {
            text->failed = true;
            return;
        }
        text->data = bigger;
        text->capacity = capacity;
    }
    memcpy(text->data + text->size, data, size);
    text->size += size;
    text->data[text->size] = 0;
}

__attribute__((format(printf, 2, 3))) static void appendf(struct text *text, const char *format,
                                                          ...)
{
    char line[256];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    append(text, line, strlen(line));
}

static int find_file(const char *name, size_t length)
{
    for (int i = 0; dph_shader_files[i].name; i++)
        if (strlen(dph_shader_files[i].name) == length &&
            !strncmp(dph_shader_files[i].name, name, length))
            return i;
    return -1;
}

/* Lines are numbered file * LINES + line: the number of the source string that #line may set as
 * well is lost in Mesa's messages. */
#define LINES 10000

/* Appends file number `file`, its includes in their places, each at most once (`seen`, a bit a
 * file). */
static bool expand(struct text *text, int file, unsigned *seen, struct dph_error *err)
{
    *seen |= 1u << file;
    appendf(text, "#line %d\n", file * LINES + 1);
    int number = 1;
    for (const char *line = dph_shader_files[file].text; *line; number++) {
        size_t length = strcspn(line, "\n");
        const char *quote = strncmp(line, "#include \"", 10) ? NULL : line + 10;
        if (quote) {
            size_t name = strcspn(quote, "\"\n");
            int other = find_file(quote, name);
            if (other < 0)
                return dph_fail(err, DPH_ERROR_ARGUMENT, "%s:%d: includes %.*s, which is not there",
                                dph_shader_files[file].name, number, (int)name, quote);
            if (!(*seen & 1u << other) && !expand(text, other, seen, err))
                return false;
            appendf(text, "#line %d\n", file * LINES + number + 1);
        } else {
            append(text, line, length);
            append(text, "\n", 1);
        }
        line += length + (line[length] == '\n');
    }
    return true;
}

char *dph_shader_text(const char *name, const char *defines, struct dph_error *err)
{
    struct text text = {0};
    unsigned seen = 0;
    int file = find_file(name, strlen(name));
    if (file < 0) {
        dph_fail(err, DPH_ERROR_ARGUMENT, "there is no shader called %s", name);
        return NULL;
    }
    appendf(&text, "#version 330 core\n");
    append(&text, defines, strlen(defines));
    if (!expand(&text, file, &seen, err)) {
        free(text.data);
        return NULL;
    }
    if (text.failed) {
        free(text.data);
        dph_fail_memory(err);
        return NULL;
    }
    return text.data;
}

/* Describes a compiler's log: Mesa begins lines with "FILE:LINE(COLUMN): ", NVIDIA with "FILE(LINE)
 * : ". */
static bool fail_log(const char *log, const char *label, struct dph_error *err)
{
    int line = 0, used = 0, count = 0;
    while (dph_shader_files[count].name)
        count++;
    if ((sscanf(log, "%*d:%d(%*d):%n", &line, &used) < 1 || !used) &&
        (sscanf(log, "%*d(%d) :%n", &line, &used) < 1 || !used))
        line = 0;
    int file = line / LINES;
    line %= LINES;
    if (line < 1 || file >= count)
        return dph_fail(err, DPH_ERROR_CAPABILITY, "%s: %.300s", label, log);
    const char *rest = log + used + strspn(log + used, " ");
    return dph_fail(err, DPH_ERROR_CAPABILITY, "shaders/%s:%d: %.*s", dph_shader_files[file].name,
                    line, (int)strcspn(rest, "\n"), rest);
}

static GLuint compile(GLenum stage, const char *name, const char *source, struct dph_error *err)
{
    GLuint shader = glCreateShader(stage);
    glShaderSource(shader, 1, &source, NULL);
    glCompileShader(shader);
    GLint ok = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok)
        return shader;
    char log[1024] = "no log";
    glGetShaderInfoLog(shader, sizeof log, NULL, log);
    glDeleteShader(shader);
    fail_log(log, name, err);
    return 0;
}

bool dph_program_init(struct dph_program *program, const char *vert, const char *frag,
                      const char *defines, const char *feedback, struct dph_error *err)
{
    *program = (struct dph_program){0};
    GLuint shader[2] = {0};
    char *source[2] = {dph_shader_text(vert, defines, err), NULL};
    if (!source[0])
        return false;
    if (frag && !(source[1] = dph_shader_text(frag, defines, err)))
        goto error;
    struct text both = {0}, label = {0};
    append(&both, source[0], strlen(source[0]));
    append(&label, vert, strlen(vert));
    if (frag) {
        append(&both, source[1], strlen(source[1]));
        append(&label, " + ", 3);
        append(&label, frag, strlen(frag));
    }
    program->source = both.data;
    program->label = label.data;
    if (both.failed || label.failed) {
        dph_fail_memory(err);
        goto error;
    }
    if (!(shader[0] = compile(GL_VERTEX_SHADER, vert, source[0], err)) ||
        (frag && !(shader[1] = compile(GL_FRAGMENT_SHADER, frag, source[1], err))))
        goto error;
    program->id = glCreateProgram();
    for (int i = 0; i < 2; i++)
        if (shader[i])
            glAttachShader(program->id, shader[i]);
    if (feedback)
        glTransformFeedbackVaryings(program->id, 1, &feedback, GL_INTERLEAVED_ATTRIBS);
    glLinkProgram(program->id);
    GLint ok = 0;
    glGetProgramiv(program->id, GL_LINK_STATUS, &ok);
    if (!ok) {
        char log[1024] = "no log";
        glGetProgramInfoLog(program->id, sizeof log, NULL, log);
        fail_log(log, program->label, err);
        goto error;
    }
    for (int i = 0; i < 2; i++) {
        if (shader[i])
            glDeleteShader(shader[i]); /* the program keeps it */
        free(source[i]);
    }
    return true;

error:
    for (int i = 0; i < 2; i++) {
        if (shader[i])
            glDeleteShader(shader[i]);
        free(source[i]);
    }
    dph_program_finish(program);
    return false;
}

void dph_program_finish(struct dph_program *program)
{
    if (program->id)
        glDeleteProgram(program->id);
    free(program->label);
    free(program->source);
    free(program->uniform);
    *program = (struct dph_program){0};
}

/* Whether `word` (of `length`) stands in the text as a whole word, after `before` where that is
 * given. */
static bool has_word(const char *text, const char *word, size_t length, bool uniform)
{
    for (const char *at = text; (at = strstr(at, uniform ? "uniform " : word)); at++) {
        const char *start = at;
        if (uniform) { /* "uniform TYPE NAME" */
            start += 8;
            start += strcspn(start, " ;\n");
            start += strspn(start, " ");
            if (strncmp(start, word, length))
                continue;
        } else if (start > text && (isalnum((unsigned char)start[-1]) || start[-1] == '_')) {
            continue;
        }
        char next = start[length];
        if (!isalnum((unsigned char)next) && next != '_')
            return true;
    }
    return false;
}

/* Whether the shaders declare a uniform of this name: "root", "root[1]" or "root[1].member". */
static bool declared(const struct dph_program *program, const char *name)
{
    char part[64];
    bool root = true;
    while (*name) {
        size_t length = strcspn(name, ".[");
        snprintf(part, sizeof part, "%.*s", (int)length, name);
        if (!has_word(program->source, part, strlen(part), root))
            return false;
        root = false;
        name += length;
        name += strcspn(name, ".");
        name += *name == '.';
    }
    return true;
}

/* The location of a uniform, -1 for one that is not used; asked once a name. */
static GLint locate(struct dph_program *program, const char *name)
{
    for (size_t i = 0; i < program->nuniform; i++)
        if (!strcmp(program->uniform[i].name, name))
            return program->uniform[i].location;
    GLint location = glGetUniformLocation(program->id, name);
    if (location < 0 && !declared(program, name)) {
        if (!program->unknown[0])
            snprintf(program->unknown, sizeof program->unknown, "%s", name);
        return -1;
    }
    struct dph_uniform *grown =
        dph_grow(program->uniform, program->nuniform, &program->capacity, sizeof *grown);
    if (grown &&
        strlen(name) < sizeof grown->name) { /* without the memory it is asked again next time */
        program->uniform = grown;
        strcpy(grown[program->nuniform].name, name);
        grown[program->nuniform++].location = location;
    } else if (grown) {
        program->uniform = grown;
    }
    return location;
}

void dph_set_int(struct dph_program *program, const char *name, int value)
{
    GLint location = locate(program, name);
    if (location >= 0)
        glUniform1i(location, value);
}

void dph_set_float(struct dph_program *program, const char *name, float value)
{
    GLint location = locate(program, name);
    if (location >= 0)
        glUniform1f(location, value);
}

void dph_set_vec(struct dph_program *program, const char *name, int components, int count,
                 const float *value)
{
    GLint location = locate(program, name);
    if (location < 0)
        return;
    if (components == 2)
        glUniform2fv(location, count, value);
    else if (components == 3)
        glUniform3fv(location, count, value);
    else
        glUniform4fv(location, count, value);
}

void dph_set_mat(struct dph_program *program, const char *name, int side, const float *value)
{
    GLint location = locate(program, name);
    if (location < 0)
        return;
    if (side == 3)
        glUniformMatrix3fv(location, 1, GL_FALSE, value);
    else
        glUniformMatrix4fv(location, 1, GL_FALSE, value);
}

bool dph_program_check(struct dph_program *program, const char *pass, struct dph_error *err)
{
    bool known = !program->unknown[0];
    if (!known) {
        dph_fail(err, DPH_ERROR_ARGUMENT, "pass %s: %s has no uniform called %s", pass,
                 program->label, program->unknown);
        program->unknown[0] = 0;
        dph_gl_drain();
    }
    return known && dph_gl_check(pass, err);
}

bool dph_gl_check(const char *pass, struct dph_error *err)
{
    GLenum first = glGetError();
    if (first == GL_NO_ERROR)
        return true;
    dph_gl_drain();
    const char *name = first == GL_INVALID_ENUM                    ? "invalid enum"
                       : first == GL_INVALID_VALUE                 ? "invalid value"
                       : first == GL_INVALID_OPERATION             ? "invalid operation"
                       : first == GL_INVALID_FRAMEBUFFER_OPERATION ? "invalid framebuffer operation"
                       : first == GL_OUT_OF_MEMORY                 ? "out of memory"
                                                                   : "unknown error";
    return dph_fail(err, DPH_ERROR_CAPABILITY, "pass %s: GL says %s (0x%04x)", pass, name,
                    (unsigned)first);
}

void dph_gl_drain(void)
{
    for (int i = 0; i < 64 && glGetError() != GL_NO_ERROR; i++) /* a lost context never ends */
        ;
}
