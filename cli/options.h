/* Options: what a row of the table is, and the parsers that rows name. */
#ifndef DIAPHAN_CLI_OPTIONS_H
#define DIAPHAN_CLI_OPTIONS_H

#include "cli.h"

enum { WHY = 256 };

struct option {
    const char *name;
    char letter; /* 0: none                                                                    */
    const char *argument; /* as help shows it; NULL: a flag */
    const char *initial;  /* the default as help shows it; NULL: none  */
    const char *help;     /* what it means, with the unit     */
    size_t offset; /* of the field in struct settings                                            */
    double low, high;                /* of numbers                */
    const char *(*choice)(size_t i); /* the values there are, NULL beyond the last */
    /* Sets the field from `value`; false with the reason, a clause that follows "--name: ", in
     * `why` (WHY bytes). */
    bool (*parse)(const struct option *option, struct settings *settings, const char *value,
                  char *why);
};

/* The table, `noption` rows (options.c). */
extern const struct option options[];
extern const int noption;

/* Parsers (option_values.c). */
typedef bool parse_option_value(const struct option *option, struct settings *settings,
                                const char *value, char *why);
parse_option_value parse_bands;
parse_option_value parse_bytes;
parse_option_value parse_camera;
parse_option_value parse_choice;
parse_option_value parse_colour;
parse_option_value parse_flag;
parse_option_value parse_for;
parse_option_value parse_int;
parse_option_value parse_light;
parse_option_value parse_map_size;
parse_option_value parse_material;
parse_option_value parse_method;
parse_option_value parse_methods;
parse_option_value parse_point_light;
parse_option_value parse_real;
parse_option_value parse_resolution;
parse_option_value parse_sizes;
parse_option_value parse_spot_light;
parse_option_value parse_text;

/* The values there are, NULL beyond the last. */
const char *boundary_name(size_t i);
const char *definition_name(size_t i);
const char *drawn_name(size_t i);
const char *fit_name(size_t i);
const char *formula_name(size_t i);
const char *method_name(size_t i);
const char *response_form_name(size_t i);
const char *store_name(size_t i);
const char *window_name(size_t i);

#endif
