/* How the values of options are read: numbers with their ranges, names of a set, lights, cameras. Each
 * parser says in a clause what is wrong with a value. */
#include "options.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *field(const struct option *option, struct settings *settings)
{
    return (char *)settings + option->offset;
}

/* Up to `room` numbers with commas between and nothing else; their count, -1 where that is not
 * what stands there. */
static int numbers(const char *text, double *value, int room)
{
    for (int n = 0;; n++) {
        char *end;
        if (n == room || isspace((unsigned char)*text))
            return -1;
        value[n] = strtod(text, &end);
        if (end == text || !isfinite(value[n]))
            return -1;
        if (!*end)
            return n + 1;
        if (*end != ',')
            return -1;
        text = end + 1;
    }
}

bool parse_flag(const struct option *option, struct settings *settings, const char *value,
                       char *why)
{
    (void)value;
    (void)why;
    *(bool *)field(option, settings) = true;
    return true;
}

static bool in_range(const struct option *option, double number, const char *value, char *why)
{
    if (number >= option->low && number <= option->high)
        return true;
    if (option->high >= 1e30)
        snprintf(why, WHY, "%s is too small, %g is the least", value, option->low);
    else
        snprintf(why, WHY, "%s is out of range, %g to %g", value, option->low, option->high);
    return false;
}

bool parse_int(const struct option *option, struct settings *settings, const char *value,
                      char *why)
{
    char *end;
    errno = 0;
    long number = strtol(value, &end, 10);
    if (end == value || *end || isspace((unsigned char)*value)) {
        snprintf(why, WHY, "'%.64s' is no whole number", value);
        return false;
    }
    if (errno || !in_range(option, (double)number, value, why)) {
        in_range(option, number > 0 ? INFINITY : -INFINITY, value, why);
        return false;
    }
    *(int *)field(option, settings) = (int)number;
    return true;
}

bool parse_real(const struct option *option, struct settings *settings, const char *value,
                       char *why)
{
    double number;
    if (numbers(value, &number, 1) != 1) {
        snprintf(why, WHY, "'%.64s' is no number", value);
        return false;
    }
    if (!in_range(option, number, value, why))
        return false;
    *(double *)field(option, settings) = number;
    return true;
}

bool parse_text(const struct option *option, struct settings *settings, const char *value,
                       char *why)
{
    if (!*value) {
        snprintf(why, WHY, "is empty");
        return false;
    }
    *(const char **)field(option, settings) = value;
    return true;
}

/* The number of a name among an option's choices, -1 where it is none of them. */
static int choice_of(const struct option *option, const char *value, char *why)
{
    const char *name;
    int length = snprintf(why, WHY, "'%.32s' is none of", value);
    for (int i = 0; (name = option->choice((size_t)i)); i++) {
        if (strcmp(name, value) == 0)
            return i;
        if (length > 0 && length < WHY)
            length += snprintf(why + length, (size_t)(WHY - length), "%s %s", i ? "," : "", name);
    }
    return -1;
}

bool parse_choice(const struct option *option, struct settings *settings, const char *value,
                         char *why)
{
    int number = choice_of(option, value, why);
    if (number >= 0)
        *(int *)field(option, settings) = number; /* the enums' values count from 0 */
    return number >= 0;
}

/* The methods that are drawn, and the one that is traced. */
const char *method_name(size_t i)
{
    const struct dph_method *method = dph_method_at(i);
    if (method)
        return method->name;
    return i == 0 || dph_method_at(i - 1) ? "reference" : NULL;
}

const char *boundary_name(size_t i)
{
    static const char *const name[] = {"matched", "dielectric"};
    return i < 2 ? name[i] : NULL;
}

bool parse_method(const struct option *option, struct settings *settings, const char *value,
                         char *why)
{
    int number = choice_of(option, value, why);
    const struct dph_method *method = number >= 0 ? dph_method_at((size_t)number) : NULL;
    settings->reference = number >= 0 && !method;
    if (method)
        settings->method = method;
    return number >= 0;
}

/* Choices with commas between, as a set. */
static bool set_of(const struct option *option, const char *value, unsigned *set, char *why)
{
    *set = 0;
    for (const char *at = value;; at++) {
        char name[40];
        size_t length = strcspn(at, ",");
        snprintf(name, sizeof name, "%.*s", (int)(length < 39 ? length : 39), at);
        int number = choice_of(option, name, why);
        if (number < 0)
            return false;
        *set |= 1U << number;
        at += length;
        if (!*at)
            return true;
    }
}

/* What methods draw from. */
bool parse_for(const struct option *option, struct settings *settings, const char *value,
                      char *why)
{
    unsigned set;
    const struct dph_method *method;
    if (!set_of(option, value, &set, why))
        return false;
    settings->products = 0;
    for (size_t i = 0; (method = dph_method_at(i)); i++)
        if (set >> i & 1)
            settings->products |=
                method->needs | (method->needs_thickness ? DPH_PRODUCT_THICKNESS : 0U);
    return true;
}

/* The methods that are drawn. */
const char *drawn_name(size_t i)
{
    const struct dph_method *method = dph_method_at(i);
    return method ? method->name : NULL;
}

bool parse_methods(const struct option *option, struct settings *settings, const char *value,
                          char *why)
{
    unsigned set;
    if (!set_of(option, value, &set, why))
        return false;
    *(unsigned *)field(option, settings) = set;
    return true;
}

bool parse_material(const struct option *option, struct settings *settings,
                           const char *value, char *why)
{
    if (!parse_text(option, settings, value, why))
        return false;
    if (settings->nmaterial < MAX_MATERIALS) {
        settings->materials[settings->nmaterial++] = value;
        return true;
    }
    snprintf(why, WHY, "more than %d materials", (int)MAX_MATERIALS);
    return false;
}

/* The light that an option adds; NULL where there are too many. */
static struct dph_light *add_light(struct settings *settings, char *why)
{
    if (settings->nlight < DPH_MAX_LIGHTS)
        return &settings->light[settings->nlight++];
    snprintf(why, WHY, "more than %d lights", DPH_MAX_LIGHTS);
    return NULL;
}

bool parse_light(const struct option *option, struct settings *settings, const char *value,
                        char *why)
{
    (void)option;
    const double pi = 3.14159265358979323846;
    double v[5] = {0, 0, pi, pi, pi};
    int n = numbers(value, v, 5);
    if (n != 2 && n != 5) {
        snprintf(why, WHY, "wants AZ,EL or AZ,EL,R,G,B, not '%.64s'", value);
        return false;
    }
    if (v[1] < -90 || v[1] > 90 || v[2] < 0 || v[3] < 0 || v[4] < 0) {
        snprintf(why, WHY, "%.64s: the elevation is -90 to 90 degrees, R,G,B are not negative",
                 value);
        return false;
    }
    struct dph_light *light = add_light(settings, why);
    if (!light)
        return false;
    dph_light_direction(v[0], v[1], light->to_light);
    memcpy(light->irradiance, v + 2, sizeof light->irradiance);
    return true;
}

/* Intensity R,G,B in v[0..2]; where it is not given it is negative until the scene is known
 * (resolve_lights). */
bool parse_point_light(const struct option *option, struct settings *settings,
                              const char *value, char *why)
{
    (void)option;
    double v[6] = {0, 0, 0, -1, -1, -1};
    int n = numbers(value, v, 6);
    if ((n != 3 && n != 6) || (n == 6 && (v[3] < 0 || v[4] < 0 || v[5] < 0))) {
        snprintf(why, WHY, "wants X,Y,Z or X,Y,Z,R,G,B with R,G,B not negative, not '%.64s'",
                 value);
        return false;
    }
    struct dph_light *light = add_light(settings, why);
    if (!light)
        return false;
    light->kind = DPH_LIGHT_POINT;
    memcpy(light->position, v, sizeof light->position);
    memcpy(light->irradiance, v + 3, sizeof light->irradiance);
    return true;
}

bool parse_spot_light(const struct option *option, struct settings *settings,
                             const char *value, char *why)
{
    (void)option;
    double v[10] = {0, 0, 0, 0, 0, 0, 0, -1, -1, -1};
    int n = numbers(value, v, 10);
    if ((n != 7 && n != 10) || (n == 10 && (v[7] < 0 || v[8] < 0 || v[9] < 0))) {
        snprintf(why, WHY,
                 "wants X,Y,Z,TX,TY,TZ,ANGLE or that and R,G,B, none negative, not '%.64s'", value);
        return false;
    }
    if (v[6] < 0.1 || v[6] > 85 || (v[0] == v[3] && v[1] == v[4] && v[2] == v[5])) {
        snprintf(why, WHY,
                 "%.64s: ANGLE is 0.1 to 85 degrees, and TX,TY,TZ is another point than X,Y,Z",
                 value);
        return false;
    }
    struct dph_light *light = add_light(settings, why);
    if (!light)
        return false;
    light->kind = DPH_LIGHT_SPOT;
    light->angle = v[6];
    for (int k = 0; k < 3; k++) {
        light->position[k] = v[k];
        light->to_light[k] = v[k] - v[3 + k];
        light->irradiance[k] = v[7 + k];
    }
    return true;
}

bool parse_bands(const struct option *option, struct settings *settings, const char *value,
                        char *why)
{
    if (strcmp(value, "auto"))
        return parse_int(option, settings, value, why);
    settings->use_bands = DPH_BANDS_AUTO;
    return true;
}

bool parse_map_size(const struct option *option, struct settings *settings,
                           const char *value, char *why)
{
    if (!parse_int(option, settings, value, why))
        return false;
    if (!(settings->map_size & (settings->map_size - 1)))
        return true;
    snprintf(why, WHY, "%s is no power of two", value);
    return false;
}

bool parse_camera(const struct option *option, struct settings *settings, const char *value,
                         char *why)
{
    (void)option;
    double v[3] = {0, 0, settings->camera.distance};
    int n = numbers(value, v, 3);
    if ((n != 2 && n != 3) || v[1] < -90 || v[1] > 90 || v[2] <= 0 || v[2] > 1e6) {
        snprintf(why, WHY, "wants AZ,EL[,DIST] with EL -90 to 90 and DIST above 0, not '%.64s'",
                 value);
        return false;
    }
    settings->camera.azimuth = v[0];
    settings->camera.elevation = v[1];
    settings->camera.distance = v[2];
    return true;
}

bool parse_colour(const struct option *option, struct settings *settings, const char *value,
                         char *why)
{
    double v[3];
    if (numbers(value, v, 3) != 3 || v[0] < 0 || v[1] < 0 || v[2] < 0) {
        snprintf(why, WHY, "wants R,G,B, none negative, not '%.64s'", value);
        return false;
    }
    memcpy(field(option, settings), v, sizeof v);
    return true;
}

bool parse_resolution(const struct option *option, struct settings *settings,
                             const char *value, char *why)
{
    int width, height, used = 0;
    if (!isdigit((unsigned char)*value) ||
        sscanf(value, "%5dx%5d%n", &width, &height, &used) != 2 || value[used] || width < 1 ||
        height < 1 || width > option->high || height > option->high) {
        snprintf(why, WHY, "wants WIDTHxHEIGHT, each 1 to %g, not '%.64s'", option->high, value);
        return false;
    }
    settings->width = width;
    settings->height = height;
    return true;
}

bool parse_sizes(const struct option *option, struct settings *settings, const char *value,
                        char *why)
{
    double v[MAX_SIZES];
    int n = numbers(value, v, MAX_SIZES);
    for (int i = 0; i < n; i++)
        if (v[i] < option->low || v[i] > option->high || v[i] != floor(v[i]))
            n = -1;
    if (n < 1) {
        snprintf(why, WHY, "wants up to %d counts of triangles, %g to %g, with commas, not '%.64s'",
                 MAX_SIZES, option->low, option->high, value);
        return false;
    }
    for (int i = 0; i < n; i++)
        settings->size[i] = (int)v[i];
    settings->nsize = n;
    return true;
}

const char *definition_name(size_t i)
{
    return i <= DPH_THICKNESS_FARTHEST ? dph_definition_name((enum dph_definition)i) : NULL;
}

const char *fit_name(size_t i)
{
    return i <= DPH_FIT_WEIGHTED ? dph_fit_name((enum dph_fit)i) : NULL;
}

const char *store_name(size_t i)
{
    return i <= DPH_STORE_CPCA ? dph_store_name((enum dph_store)i) : NULL;
}

const char *response_form_name(size_t i)
{
    return dph_response_form_name((enum dph_response_form)i);
}

bool parse_bytes(const struct option *option, struct settings *settings, const char *value,
                        char *why)
{
    struct dph_response_params unused = dph_response_defaults();
    if (!parse_int(option, settings, value, why))
        return false;
    if (dph_response_preset(*(int *)field(option, settings), &unused))
        return true;
    snprintf(why, WHY, "%s is none of 4, 9, 16, 36", value);
    return false;
}

const char *window_name(size_t i)
{
    static const char *const names[] = {"none", "hann", "lanczos", NULL};
    return names[i]; /* in the order of enum dph_window */
}

const char *formula_name(size_t i)
{
    static const char *const names[] = {"g", "paper", NULL};
    return names[i]; /* in the order of enum dph_formula */
}
