/* glTF: checked access to JSON, and writing it back. */
#include "mesh/gltf.h"

#include "core/fail.h"

#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool dph_gltf_fail(const struct dph_document *doc, const char *place, enum dph_code code,
                   struct dph_error *err, const char *format, ...)
{
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return dph_fail(err, code, "%s: %s%s%s", doc->path, place, *place ? ": " : "", text);
}

/* What a value is, for messages. */
static const char *kind_of(const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT: return "an object";
    case JSON_ARRAY: return "an array";
    case JSON_STRING: return "a string";
    case JSON_INTEGER:
    case JSON_REAL: return "a number";
    case JSON_NULL: return "null";
    default: return "a boolean";
    }
}

bool dph_gltf_size(const struct dph_document *doc, const json_t *object, const char *key,
                   const char *place, size_t fallback, size_t limit, size_t *value,
                   struct dph_error *err)
{
    const json_t *member = json_object_get(object, key);
    const char *dot = *place ? "." : "";
    if (!member) {
        if (fallback == DPH_GLTF_REQUIRED)
            return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err, "%s is missing", key);
        *value = fallback;
        return true;
    }
    if (!json_is_number(member))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s%s%s: is %s, not a number", doc->path, place,
                        dot, key, kind_of(member));
    /* JSON makes no difference between 5 and 5.0 */
    double real = json_number_value(member);
    if (real < 0 || real != floor(real))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s%s%s: %.17g is not a count or an index",
                        doc->path, place, dot, key, real);
    if (real > 9007199254740992. || (size_t)real > limit)
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s%s%s: %.17g is more than %zu", doc->path,
                        place, dot, key, real, limit);
    *value = (size_t)real;
    return true;
}

size_t dph_gltf_unchecked(const json_t *object, const char *key)
{
    const json_t *member = json_object_get(object, key);
    double real = json_number_value(member);
    if (!member)
        return 0;
    return json_is_number(member) && real >= 0 && real <= 4294967296. ? (size_t)real : SIZE_MAX;
}

bool dph_gltf_array(const struct dph_document *doc, const json_t *object, const char *key,
                    const char *place, json_t **array, struct dph_error *err)
{
    *array = json_object_get(object, key);
    if (*array && !json_is_array(*array))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s%s%s: is %s, not an array", doc->path, place,
                        *place ? "." : "", key, kind_of(*array));
    return true;
}

bool dph_gltf_object(const struct dph_document *doc, const json_t *object, const char *key,
                     const char *place, json_t **value, struct dph_error *err)
{
    *value = json_object_get(object, key);
    if (*value && !json_is_object(*value))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s%s%s: is %s, not an object", doc->path, place,
                        *place ? "." : "", key, kind_of(*value));
    return true;
}

bool dph_gltf_numbers(const struct dph_document *doc, const json_t *object, const char *key,
                      const char *place, size_t count, double *value, bool *found,
                      struct dph_error *err)
{
    json_t *array;
    if (!dph_gltf_array(doc, object, key, place, &array, err))
        return false;
    if (found)
        *found = array != NULL;
    if (!array)
        return true;
    if (json_array_size(array) != count)
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s.%s: has %zu elements instead of %zu",
                        doc->path, place, key, json_array_size(array), count);
    for (size_t i = 0; i < count; i++) {
        const json_t *element = json_array_get(array, i);
        if (!json_is_number(element))
            return dph_fail(err, DPH_ERROR_INPUT, "%s: %s.%s[%zu]: is %s, not a number", doc->path,
                            place, key, i, kind_of(element));
        value[i] = json_number_value(element);
    }
    return true;
}

bool dph_gltf_element(const struct dph_document *doc, const char *array, size_t i,
                      const char *place, json_t **element, struct dph_error *err)
{
    json_t *list;
    if (!dph_gltf_array(doc, doc->root, array, "", &list, err))
        return false;
    size_t count = json_array_size(list);
    if (i >= count)
        return dph_gltf_fail(doc, place, DPH_ERROR_INPUT, err,
                             "refers to %s[%zu], the file has %zu", array, i, count);
    *element = json_array_get(list, i);
    if (!json_is_object(*element))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s[%zu]: is %s, not an object", doc->path, array,
                        i, kind_of(*element));
    return true;
}

json_t *dph_gltf_extension(const json_t *object, const char *name, const char *other)
{
    const json_t *extensions = json_object_get(object, "extensions");
    json_t *found = json_object_get(extensions, name);
    if (!found && other)
        found = json_object_get(extensions, other);
    return json_is_object(found) ? found : NULL;
}

/* ---- writing ---- */

double dph_gltf_shortest(float value)
{
    char text[32];
    for (int digits = 6; digits <= 9; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, (double)value);
        if (strtof(text, NULL) == value)
            return strtod(text, NULL);
    }
    return value;
}

/* A double with the fewest digits that read back as it, always with a point or an exponent, so that
 * it stays a real number. */
static bool dump_real(double value, dph_gltf_sink *sink, void *user)
{
    char text[40];
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    /* the decimal point of the caller's locale */
    const char *point = localeconv()->decimal_point;
    char *at = strcmp(point, ".") ? strstr(text, point) : NULL;
    if (at) {
        *at = '.';
        memmove(at + 1, at + strlen(point), strlen(at + strlen(point)) + 1);
    }
    if (!strpbrk(text, ".e"))
        memcpy(text + strlen(text), ".0", 3);
    return sink(user, text, strlen(text));
}

static bool dump_string(const char *text, size_t size, dph_gltf_sink *sink, void *user)
{
    if (!sink(user, "\"", 1))
        return false;
    size_t done = 0; /* bytes that have been written */
    for (size_t i = 0; i < size; i++) {
        unsigned char c = (unsigned char)text[i];
        if (c >= 32 && c != '"' && c != '\\')
            continue;
        char escape[8];
        if (c >= 32)
            snprintf(escape, sizeof escape, "\\%c", c);
        else
            snprintf(escape, sizeof escape, "\\u%04x", c);
        if (!sink(user, text + done, i - done) || !sink(user, escape, strlen(escape)))
            return false;
        done = i + 1;
    }
    return sink(user, text + done, size - done) && sink(user, "\"", 1);
}

bool dph_gltf_dump(json_t *json, dph_gltf_sink *sink, void *user)
{
    char text[32];
    switch (json_typeof(json)) {
    case JSON_OBJECT: {
        if (!sink(user, "{", 1))
            return false;
        bool first = true;
        bool ok = true;
        for (void *at = json_object_iter(json); at && ok;
             at = json_object_iter_next(json, at), first = false) {
            const char *key = json_object_iter_key(at);
            ok = (first || sink(user, ",", 1)) && dump_string(key, strlen(key), sink, user) &&
                 sink(user, ":", 1) && dph_gltf_dump(json_object_iter_value(at), sink, user);
        }
        return ok && sink(user, "}", 1);
    }
    case JSON_ARRAY:
        if (!sink(user, "[", 1))
            return false;
        for (size_t i = 0; i < json_array_size(json); i++)
            if ((i && !sink(user, ",", 1)) || !dph_gltf_dump(json_array_get(json, i), sink, user))
                return false;
        return sink(user, "]", 1);
    case JSON_STRING:
        return dump_string(json_string_value(json), json_string_length(json), sink, user);
    case JSON_INTEGER:
        snprintf(text, sizeof text, "%lld", (long long)json_integer_value(json));
        return sink(user, text, strlen(text));
    case JSON_REAL: return dump_real(json_real_value(json), sink, user);
    case JSON_TRUE: return sink(user, "true", 4);
    case JSON_FALSE: return sink(user, "false", 5);
    default: return sink(user, "null", 4);
    }
}
