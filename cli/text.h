/* text.h - texts from outside, made fit for what they are put into. */
#ifndef TEXT_H
#define TEXT_H

#include <diaphan/error.h>

#include <stdio.h>

/* Fills `err` (Nullable) and returns false, as the library does. */
bool text_fail(struct dph_error *err, enum dph_code code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Bytes of the UTF-8 sequence that starts at `c`, 0 where it is none (RFC 3629: no overlong forms,
 * no surrogates). */
int text_sequence(const unsigned char *c);

/* A copy that is valid UTF-8 without control characters: what is not becomes '?'. free() it; NULL:
 * out of memory. */
char *text_clean(const char *text);

/* The text within HTML or XML, in an element or in an attribute between quotes of either kind.
 * What is no UTF-8, and control characters, become '?'. */
void text_escape(FILE *stream, const char *text);

#endif
