/* Texts from outside: names of files and materials, which may hold any byte. */
#include "text.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

bool text_fail(struct dph_error *err, enum dph_code code, const char *format, ...)
{
    if (err) {
        va_list args;
        va_start(args, format);
        err->code = code;
        vsnprintf(err->message, sizeof err->message, format, args);
        va_end(args);
    }
    return false;
}

int text_sequence(const unsigned char *c)
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

/* The bytes of `*c` that may be passed on, and *c moved beyond them; 0: write '?' instead.
 * U+0080 to U+009F, U+FFFE and U+FFFF are no characters for XML and HTML either. */
static int accepted(const unsigned char **c)
{
    const unsigned char *at = *c;
    int length = text_sequence(at);
    *c += length ? length : 1;
    bool control = at[0] < 32 || at[0] == 127 || (at[0] == 0xc2 && at[1] < 0xa0) ||
                   (at[0] == 0xef && at[1] == 0xbf && at[2] >= 0xbe);
    return control ? 0 : length;
}

char *text_clean(const char *text)
{
    char *clean = malloc(strlen(text) + 1);
    size_t n = 0;
    for (const unsigned char *c = (const unsigned char *)text; clean && *c;) {
        const unsigned char *from = c;
        int length = accepted(&c);
        if (!length)
            clean[n++] = '?';
        memcpy(clean + n, from, (size_t)length);
        n += (size_t)length;
    }
    if (clean)
        clean[n] = 0;
    return clean;
}

void text_escape(FILE *stream, const char *text)
{
    for (const unsigned char *c = (const unsigned char *)text; *c;) {
        const unsigned char *from = c;
        int length = accepted(&c);
        switch (length ? *from : '?') {
        case '&': fputs("&amp;", stream); break;
        case '<': fputs("&lt;", stream); break;
        case '>': fputs("&gt;", stream); break;
        case '"': fputs("&quot;", stream); break;
        case '\'': fputs("&#39;", stream); break;
        default:
            if (length)
                fwrite(from, 1, (size_t)length, stream);
            else
                putc('?', stream);
        }
    }
}
