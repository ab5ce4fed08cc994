/* Material files: one JSON object of scattering coefficients and drawing parameters, as material.h
 * lists them.
 *
 * The keys are a table, so that checking, reading and the message about an unknown key cannot drift
 * apart. */
#include "shade/material_json.h"

#include "core/fail.h"
#include "core/file.h"

#include <jansson.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a key holds and where its value goes in struct dph_material. Values lie in [low, high], or
 * beyond low strictly if `open`. */
struct key {
    const char *name;
    enum { NUMBER, TRIPLE, TEXT, FORMULA, CURVE } kind;
    size_t offset;
    double low, high;
    bool open, required;
};

#define AT(member) offsetof(struct dph_material, member)
static const struct key keys[] = {
    {"scattering", TRIPLE, AT(scattering), 0, 1e6, false, true},
    {"absorption", TRIPLE, AT(absorption), 0, 1e6, false, true},
    {"anisotropy", NUMBER, AT(anisotropy), -1, 1, true, false},
    {"ior", NUMBER, AT(ior), 1, 4, false, false},
    {"name", TEXT, AT(name), 0, 0, false, false},
    {"formula", FORMULA, AT(formula), 0, 0, false, false},
    {"curve", CURVE, AT(curve), 0, 0, false, false},
    {"sigma", TRIPLE, AT(sigma), 0, 1e6, false, false},
    {"base", TRIPLE, AT(base), 0, 1e6, false, false},
    {"front", TRIPLE, AT(front), 0, 1e6, false, false},
    {"back", TRIPLE, AT(back), 0, 1e6, false, false},
    {"specular", NUMBER, AT(specular), 0, 1e6, false, false},
    {"shininess", NUMBER, AT(shininess), 0, 1e6, false, false},
    {"rim", NUMBER, AT(rim), 0, 1e6, false, false},
    {"rim_power", NUMBER, AT(rim_power), 0, 1e6, false, false},
    {"ambient", NUMBER, AT(ambient), 0, 1e6, false, false},
};
#define KEYS (sizeof keys / sizeof *keys)

static const char *const formulas[2] = {"g", "paper"}, *const curves[2] = {"slab", "exp"};

/* A value for a message, short. */
static const char *show(const json_t *value, char text[32])
{
    if (json_is_number(value))
        snprintf(text, 32, "%.9g", json_number_value(value));
    else if (json_is_string(value))
        snprintf(text, 32, "\"%.24s\"", json_string_value(value));
    else
        snprintf(text, 32, "%s",
                 json_is_array(value)    ? "an array"
                 : json_is_object(value) ? "an object"
                 : json_is_null(value)   ? "null"
                                         : "a truth value");
    return text;
}

static bool read_number(const struct key *key, const char *place, const json_t *value, double *out,
                        const char *path, struct dph_error *err)
{
    char text[32];
    if (!json_is_number(value))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s: %s where a number is wanted", path, place,
                        show(value, text));
    double x = json_number_value(value);
    bool inside = key->open ? x > key->low && x < key->high : x >= key->low && x <= key->high;
    if (!isfinite(x) || !inside)
        return dph_fail(err, DPH_ERROR_INPUT, "%s: %s: %s is not %s %g and %g", path, place,
                        show(value, text), key->open ? "strictly between" : "between", key->low,
                        key->high);
    *out = x;
    return true;
}

static bool read_word(const char *place, const json_t *value, const char *const words[2], int *out,
                      const char *path, struct dph_error *err)
{
    char text[32];
    for (int i = 0; i < 2 && json_is_string(value); i++)
        if (!strcmp(json_string_value(value), words[i])) {
            *out = i;
            return true;
        }
    return dph_fail(err, DPH_ERROR_INPUT, "%s: %s: %s is neither \"%s\" nor \"%s\"", path, place,
                    show(value, text), words[0], words[1]);
}

static bool read_key(const struct key *key, const json_t *value, struct dph_material *material,
                     const char *path, struct dph_error *err)
{
    void *out = (char *)material + key->offset;
    char text[32];
    int word = 0;
    switch (key->kind) {
    case NUMBER:
        return read_number(key, key->name, value, out, path, err);
    case TRIPLE:
        if (!json_is_array(value) || json_array_size(value) != 3)
            return dph_fail(err, DPH_ERROR_INPUT, "%s: %s: %s where [r, g, b] is wanted", path,
                            key->name, show(value, text));
        for (size_t c = 0; c < 3; c++) {
            char place[32];
            snprintf(place, sizeof place, "%s[%zu]", key->name, c);
            if (!read_number(key, place, json_array_get(value, c), (double *)out + c, path, err))
                return false;
        }
        return true;
    case TEXT:
        if (!json_is_string(value))
            return dph_fail(err, DPH_ERROR_INPUT, "%s: %s: %s where text is wanted", path,
                            key->name, show(value, text));
        snprintf(out, sizeof material->name, "%.63s", json_string_value(value));
        return true;
    case FORMULA:
        if (!read_word(key->name, value, formulas, &word, path, err))
            return false;
        material->formula = word ? DPH_FORMULA_PAPER : DPH_FORMULA_G;
        return true;
    case CURVE:
        if (!read_word(key->name, value, curves, &word, path, err))
            return false;
        material->curve = word ? DPH_CURVE_EXP : DPH_CURVE_SLAB;
        return true;
    }
    return false;
}

static bool read_object(json_t *root, struct dph_material *material, const char *path,
                        struct dph_error *err)
{
    if (!json_is_object(root))
        return dph_fail(err, DPH_ERROR_INPUT, "%s: line 1: a material is a JSON object", path);
    const char *name;
    json_t *value;
    json_object_foreach(root, name, value)
    {
        size_t i = 0;
        while (i < KEYS && strcmp(keys[i].name, name))
            i++;
        if (i == KEYS) {
            char list[256] = "";
            for (size_t k = 0, at = 0; k < KEYS && at < sizeof list; k++)
                at += (size_t)snprintf(list + at, sizeof list - at, "%s%s", k ? ", " : "",
                                       keys[k].name);
            return dph_fail(err, DPH_ERROR_INPUT, "%s: unknown key \"%.40s\"; known are %s", path,
                            name, list);
        }
        if (!read_key(&keys[i], value, material, path, err))
            return false;
    }
    for (size_t i = 0; i < KEYS; i++)
        if (keys[i].required && !json_object_get(root, keys[i].name))
            return dph_fail(err, DPH_ERROR_INPUT, "%s: \"%s\" is missing", path, keys[i].name);
    if (material->formula == DPH_FORMULA_PAPER && !json_object_get(root, "curve"))
        material->curve = DPH_CURVE_EXP; /* as the paper's absorption is usually read */
    return true;
}

bool dph_material_load_json(const char *path, const struct dph_material *defaults,
                            struct dph_material *material, struct dph_error *err)
{
    struct dph_file file;
    if (!dph_file_load(&file, path, 1 << 20, err))
        return false;
    json_error_t fault;
    json_t *root = json_loadb((const char *)file.data, file.size, JSON_REJECT_DUPLICATES, &fault);
    dph_file_finish(&file);
    if (!root)
        return dph_fail(err, DPH_ERROR_INPUT, "%s:%d:%d: %s", path, fault.line, fault.column,
                        fault.text);
    struct dph_material result = *defaults;
    const char *slash = strrchr(path, '/');
    snprintf(result.name, sizeof result.name, "%.63s", slash ? slash + 1 : path);
    bool ok = read_object(root, &result, path, err);
    json_decref(root);
    if (ok)
        *material = result;
    return ok;
}

/* The value of a key as JSON; NULL: out of memory. */
static json_t *value_of(const struct key *key, const struct dph_material *material)
{
    const void *in = (const char *)material + key->offset;
    switch (key->kind) {
    case NUMBER: return json_real(*(const double *)in);
    case TRIPLE: {
        const double *v = in;
        return json_pack("[fff]", v[0], v[1], v[2]);
    }
    case TEXT: return json_string_nocheck(in);
    case FORMULA: return json_string(formulas[material->formula == DPH_FORMULA_PAPER]);
    case CURVE: return json_string(curves[material->curve == DPH_CURVE_EXP]);
    }
    return NULL;
}

/* Whether a key says something: not a triple of which any number is derived. */
static bool is_said(const struct key *key, const struct dph_material *material)
{
    const double *v = (const void *)((const char *)material + key->offset);
    return key->kind != TRIPLE || (isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]));
}

bool dph_material_save(const struct dph_material *material, const char *path,
                       struct dph_error *err)
{
    json_t *root = json_object();
    struct dph_output *out = NULL;
    char *text = NULL;
    for (size_t i = 0; i < KEYS && root; i++)
        if (is_said(&keys[i], material) &&
            json_object_set_new(root, keys[i].name, value_of(&keys[i], material)))
            goto error;
    if (!root || !(text = json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(9))))
        goto error;
    json_decref(root);
    if (!(out = dph_output_open(path, err))) {
        free(text);
        return false;
    }
    dph_output_printf(out, "%s\n", text);
    free(text);
    return dph_output_close(out, err);

error:
    json_decref(root);
    free(text);
    return dph_fail_memory(err);
}
