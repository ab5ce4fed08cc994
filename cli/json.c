/* Printing JSON: one object, commas and quotes where they belong. */
#include "cli.h"

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

/* Bytes of the UTF-8 sequence that starts at `c`, 0 where it is none (RFC 3629: no overlong forms,
 * no surrogates). */
static int sequence(const unsigned char *c)
{
    if (c[0] < 0x80)
        return 1;
    int length = c[0] >= 0xc2 && c[0] <= 0xdf   ? 2
                 : (c[0] & 0xf0) == 0xe0        ? 3
                 : c[0] >= 0xf0 && c[0] <= 0xf4 ? 4
                                                : 0;
    for (int i = 1; i < length; i++)
        if ((c[i] & 0xc0) != 0x80)
            return 0;
    if ((c[0] == 0xe0 && c[1] < 0xa0) || (c[0] == 0xed && c[1] > 0x9f) ||
        (c[0] == 0xf0 && c[1] < 0x90) || (c[0] == 0xf4 && c[1] > 0x8f))
        return 0;
    return length;
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
        int length = sequence(c);
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
