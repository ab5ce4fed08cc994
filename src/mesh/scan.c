/* Decimal to float, correctly rounded.
 *
 * Nearly every number in a mesh file has at most 15 digits and a small power of ten. Then the
 * digits and the power are both exact in double, and one operation gives the double nearest to the
 * number (W. D. Clinger, "How to read floating point numbers accurately", PLDI 1990). Rounding
 * that once more to float is right as well unless the double lies on the middle between two
 * floats, or right beside it; those cases, and long or extreme numbers, go to strtof() as an
 * integer with an exponent: text without a decimal point means the same in every locale. */
#include "mesh/scan.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* No float and no middle between two floats has more significant digits than 113; one more says
 * that something follows. */
#define MOST_DIGITS 120

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* A number taken apart: digits[0 .. ndigit-1] * 10^exponent, and whether digits that are not 0
 * were cut off. */
struct decimal {
    const char *digits, *end; /* with a '.' among them, perhaps */
    int64_t exponent;         /* of the last digit              */
    bool negative;
};

/* Rounds by strtof. */
static float round_slowly(const struct decimal *number)
{
    char text[MOST_DIGITS + 32];
    size_t n = 0;
    int64_t exponent = number->exponent;
    bool cut = false;
    for (const char *c = number->digits; c < number->end; c++) {
        if (*c == '.' || (n == 0 && *c == '0'))
            continue;
        if (n < MOST_DIGITS) {
            text[n++] = *c;
        } else {
            cut |= *c != '0';
            exponent++;
        }
    }
    if (n == 0)
        return 0;
    if (cut) { /* a digit below all others stands for the rest */
        text[n++] = '1';
        exponent--;
    }
    if (exponent > 9999 || exponent < -9999) /* with at most 121 digits this settles it */
        exponent = exponent > 0 ? 9999 : -9999;
    text[n++] = 'e';
    text[n++] = exponent < 0 ? '-' : '+';
    int rest = (int)(exponent < 0 ? -exponent : exponent);
    for (int place = 1000; place > 0; place /= 10)
        text[n++] = (char)('0' + rest / place % 10);
    text[n] = 0;
    return strtof(text, NULL);
}

const char *dph_scan_float(const char *text, float *value)
{
    static const double power[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                     1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                     1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    struct decimal number = {.negative = *text == '-'};
    const char *c = text + (*text == '-' || *text == '+');
    number.digits = c;
    uint64_t mantissa = 0;
    while (is_digit(*c))
        mantissa = mantissa * 10 + (uint64_t)(*c++ - '0');
    int64_t ndigit = c - number.digits;
    if (*c == '.') {
        const char *point = c++;
        while (is_digit(*c))
            mantissa = mantissa * 10 + (uint64_t)(*c++ - '0');
        number.exponent = point + 1 - c;
        ndigit += c - point - 1;
    }
    number.end = c;
    if (ndigit == 0)
        return NULL;
    if (*c == 'e' || *c == 'E') {
        const char *e = c + 1;
        bool down = *e == '-';
        e += *e == '-' || *e == '+';
        if (!is_digit(*e))
            return NULL;
        int64_t shift = 0;
        for (; is_digit(*e); e++)
            if (shift < INT64_C(1000000000000))
                shift = shift * 10 + (*e - '0');
        number.exponent += down ? -shift : shift;
        c = e;
    }
    double exact = -1;
    if (ndigit <= 19 && mantissa <= UINT64_C(1) << 53 && number.exponent >= -22 &&
        number.exponent <= 22)
        exact = number.exponent < 0 ? (double)mantissa / power[-number.exponent]
                                    : (double)mantissa * power[number.exponent];
    uint64_t bits;
    memcpy(&bits, &exact, sizeof bits);
    uint64_t below =
        bits & 0x1fffffff; /* the 29 bits that a float lacks; 0x10000000 is the middle */
    bool sure = exact == 0 || (exact >= (double)FLT_MIN && exact <= (double)FLT_MAX &&
                               (below < 0x0fffffff || below > 0x10000001));
    float size = sure ? (float)exact : round_slowly(&number);
    *value = number.negative ? -size : size;
    return c;
}

const char *dph_scan_integer(const char *text, int64_t *value)
{
    bool negative = *text == '-';
    const char *c = text + (*text == '-' || *text == '+');
    if (!is_digit(*c))
        return NULL;
    int64_t size = 0;
    for (; is_digit(*c); c++)
        if (size < INT64_C(1) << 58)
            size = size * 10 + (*c - '0');
    *value = negative ? -size : size;
    return c;
}

int dph_print_float(char text[24], float value)
{
    int n = 0;
    for (int digits = 6; digits <= 9; digits++) {
        n = snprintf(text, 24, "%.*g", digits, (double)value);
        int kept = 0; /* whatever a locale puts between the digits becomes one '.' */
        bool point = false;
        for (int i = 0; i < n; i++) {
            bool plain = is_digit(text[i]) || text[i] == '-' || text[i] == '+' || text[i] == 'e';
            if (plain)
                text[kept++] = text[i];
            else if (!point)
                text[kept++] = '.';
            point |= !plain;
        }
        text[n = kept] = 0;
        float back;
        if (dph_scan_float(text, &back) && back == value)
            break;
    }
    return n;
}

struct dph_word dph_scan_word(const char *text, const char *end)
{
    struct dph_word word = {"nothing"};
    size_t n = 0;
    while (text < end && *text && !strchr(" \t\r\n", *text) && n < 31)
        word.text[n++] = *text++;
    if (n == 31)
        memcpy(word.text + n, "...", 4);
    else if (n)
        word.text[n] = 0;
    return word;
}
