/* Printing JSON: one object, commas and quotes where they belong. */
#include "cli.h"
#include "text.h"

#include <assert.h>
#include <math.h>

static void quoted(struct json *json, const char *text)
{
    putc('"', json->stream);
    for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
        if (*c == '"' || *c == '\\')
            fprintf(json->stream, "\\%c", *c);
        else if (*c < 32)
            fprintf(json->stream, "\\u%04x", *c);
        else
            putc(*c, json->stream);
    }
    putc('"', json->stream);
}

static void next(struct json *json, const char *key)
{
    if (!json->first[json->depth])
        putc(',', json->stream);
    if (json->depth && !(json->first[json->depth]))
        putc(' ', json->stream);
    json->first[json->depth] = false;
    if (key) {
        quoted(json, key);
        fputs(": ", json->stream);
    }
}

static void open_bracket(struct json *json, const char *key, char bracket)
{
    next(json, key);
    putc(bracket, json->stream);
    assert(json->depth + 1 < (int)(sizeof json->first / sizeof json->first[0]));
    json->first[++json->depth] = true;
}

void emit_begin(struct json *json, FILE *stream)
{
    *json = (struct json){.stream = stream, .first = {true}};
    open_bracket(json, NULL, '{');
}

void emit_end(struct json *json)
{
    emit_close(json, '}');
    putc('\n', json->stream);
}

void emit_object(struct json *json, const char *key)
{
    open_bracket(json, key, '{');
}

void emit_array(struct json *json, const char *key)
{
    open_bracket(json, key, '[');
}

void emit_close(struct json *json, char bracket)
{
    json->depth--;
    putc(bracket, json->stream);
}

/* Bytes that are no UTF-8 (paths may hold any) become '?', so that the object stays valid. */
void emit_text(struct json *json, const char *key, const char *value)
{
    next(json, key);
    if (!value) {
        fputs("null", json->stream);
        return;
    }
    char clean[1024];
    size_t n = 0;
    for (const unsigned char *c = (const unsigned char *)value; *c && n + 5 < sizeof clean;) {
        int length = text_sequence(c);
        if (!length) {
            clean[n++] = '?';
            c++;
        }
        for (int i = 0; i < length; i++)
            clean[n++] = (char)*c++;
    }
    clean[n] = 0;
    quoted(json, clean);
}

void emit_count(struct json *json, const char *key, size_t value)
{
    next(json, key);
    fprintf(json->stream, "%zu", value);
}

void emit_number(struct json *json, const char *key, double value)
{
    next(json, key);
    if (isfinite(value))
        fprintf(json->stream, "%.9g", value);
    else
        fputs("null", json->stream);
}

void emit_bool(struct json *json, const char *key, bool value)
{
    next(json, key);
    fputs(value ? "true" : "false", json->stream);
}

void emit_triple(struct json *json, const char *key, const double value[3])
{
    emit_array(json, key);
    for (int c = 0; c < 3; c++)
        emit_number(json, NULL, value[c]);
    emit_close(json, ']');
}
