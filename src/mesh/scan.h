/* mesh/scan.h - numbers in text files: exact, fast, and the same in every locale.      Tier 1,
 * private. */
#ifndef DPH_MESH_SCAN_H
#define DPH_MESH_SCAN_H

#include <stdint.h>

/* Reads a decimal number such as 1, -.5 or 1.25e-3 at `text`, which ends with a 0 byte somewhere.
 * The value is the float nearest to it; infinite where it is too large. Returns what follows it,
 * or NULL where there is no number ("nan" and "inf" are none). */
const char *dph_scan_float(const char *text, float *value);

/* The same for a whole number, with a sign or without; a huge one comes out as some number beyond
 * +-2^58. */
const char *dph_scan_integer(const char *text, int64_t *value);

/* Writes the shortest of "%.6g" ... "%.9g" that dph_scan_float reads back as `value` (finite),
 * with a '.' in every locale. Returns its length. */
int dph_print_float(char text[24], float value);

/* Copies the word at `text` for a message: up to a blank, at most 31 characters, "nothing" where
 * there is none. */
struct dph_word {
    char text[36];
};
struct dph_word dph_scan_word(const char *text, const char *end);

#endif
