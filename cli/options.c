/* The one table of options: parsing, range checks and help all walk it. A command names those it
 * takes. */
#include "cli.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

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

static bool parse_flag(const struct option *option, struct settings *settings, const char *value,
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

static bool parse_int(const struct option *option, struct settings *settings, const char *value,
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

static bool parse_real(const struct option *option, struct settings *settings, const char *value,
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

static bool parse_text(const struct option *option, struct settings *settings, const char *value,
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

static bool parse_choice(const struct option *option, struct settings *settings, const char *value,
                         char *why)
{
    int number = choice_of(option, value, why);
    if (number >= 0)
        *(int *)field(option, settings) = number; /* the enums' values count from 0 */
    return number >= 0;
}

/* The methods that are drawn, and the one that is traced. */
static const char *method_name(size_t i)
{
    const struct dph_method *method = dph_method_at(i);
    if (method)
        return method->name;
    return i == 0 || dph_method_at(i - 1) ? "reference" : NULL;
}

static const char *boundary_name(size_t i)
{
    static const char *const name[] = {"matched", "dielectric"};
    return i < 2 ? name[i] : NULL;
}

static bool parse_method(const struct option *option, struct settings *settings, const char *value,
                         char *why)
{
    int number = choice_of(option, value, why);
    const struct dph_method *method = number >= 0 ? dph_method_at((size_t)number) : NULL;
    settings->reference = number >= 0 && !method;
    if (method)
        settings->method = method;
    return number >= 0;
}

/* Names of methods with commas between. */
static bool parse_for(const struct option *option, struct settings *settings, const char *value,
                      char *why)
{
    unsigned products = 0;
    for (const char *at = value;; at++) {
        char name[40];
        size_t length = strcspn(at, ",");
        snprintf(name, sizeof name, "%.*s", (int)(length < 39 ? length : 39), at);
        int number = choice_of(option, name, why);
        if (number < 0)
            return false;
        const struct dph_method *method = dph_method_at((size_t)number);
        products |= method->needs | (method->needs_thickness ? DPH_PRODUCT_THICKNESS : 0U);
        at += length;
        if (!*at)
            break;
    }
    settings->products = products;
    return true;
}

/* The methods that are drawn. */
static const char *drawn_name(size_t i)
{
    const struct dph_method *method = dph_method_at(i);
    return method ? method->name : NULL;
}

/* The same, as a set. */
static bool parse_methods(const struct option *option, struct settings *settings, const char *value,
                          char *why)
{
    unsigned set = 0;
    for (const char *at = value;; at++) {
        char name[40];
        size_t length = strcspn(at, ",");
        snprintf(name, sizeof name, "%.*s", (int)(length < 39 ? length : 39), at);
        int number = choice_of(option, name, why);
        if (number < 0)
            return false;
        set |= 1U << number;
        at += length;
        if (!*at)
            break;
    }
    *(unsigned *)field(option, settings) = set;
    return true;
}

static bool parse_material(const struct option *option, struct settings *settings,
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

static bool parse_light(const struct option *option, struct settings *settings, const char *value,
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
static bool parse_point_light(const struct option *option, struct settings *settings,
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

static bool parse_spot_light(const struct option *option, struct settings *settings,
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

static bool parse_bands(const struct option *option, struct settings *settings, const char *value,
                        char *why)
{
    if (strcmp(value, "auto"))
        return parse_int(option, settings, value, why);
    settings->use_bands = DPH_BANDS_AUTO;
    return true;
}

static bool parse_map_size(const struct option *option, struct settings *settings,
                           const char *value, char *why)
{
    if (!parse_int(option, settings, value, why))
        return false;
    if (!(settings->map_size & (settings->map_size - 1)))
        return true;
    snprintf(why, WHY, "%s is no power of two", value);
    return false;
}

static bool parse_camera(const struct option *option, struct settings *settings, const char *value,
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

static bool parse_colour(const struct option *option, struct settings *settings, const char *value,
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

static bool parse_resolution(const struct option *option, struct settings *settings,
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

static bool parse_sizes(const struct option *option, struct settings *settings, const char *value,
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

static const char *definition_name(size_t i)
{
    return i <= DPH_THICKNESS_FARTHEST ? dph_definition_name((enum dph_definition)i) : NULL;
}

static const char *fit_name(size_t i)
{
    return i <= DPH_FIT_WEIGHTED ? dph_fit_name((enum dph_fit)i) : NULL;
}

static const char *store_name(size_t i)
{
    return i <= DPH_STORE_CPCA ? dph_store_name((enum dph_store)i) : NULL;
}

static const char *response_form_name(size_t i)
{
    return dph_response_form_name((enum dph_response_form)i);
}

static bool parse_bytes(const struct option *option, struct settings *settings, const char *value,
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

static const char *window_name(size_t i)
{
    static const char *const names[] = {"none", "hann", "lanczos", NULL};
    return names[i]; /* in the order of enum dph_window */
}

static const char *formula_name(size_t i)
{
    static const char *const names[] = {"g", "paper", NULL};
    return names[i]; /* in the order of enum dph_formula */
}

#define AT(member) offsetof(struct settings, member)

static const struct option options[] = {
    /* every command */
    {"help", 'h', NULL, NULL, "this text", AT(help), 0, 0, NULL, parse_flag},
    {"version", 0, NULL, NULL, "the version", AT(version), 0, 0, NULL, parse_flag},
    {"quiet", 'q', NULL, NULL, "errors only", AT(quiet), 0, 0, NULL, parse_flag},
    {"verbose", 'v', NULL, NULL, "say more about what is done", AT(verbose), 0, 0, NULL,
     parse_flag},
    {"threads", 0, "N", "all processors", "threads to use, 1 to 256", AT(threads), 1, 256, NULL,
     parse_int},
    {"json", 0, NULL, NULL, "one JSON object on stdout and nothing else there", AT(json), 0, 0,
     NULL, parse_flag},
    /* files */
    {"output", 'o', "FILE", NULL, "where the result goes; appears whole or not at all", AT(output),
     0, 0, NULL, parse_text},
    /* the bake */
    {"bands", 0, "N", "6", "SH bands, 1 to 8: N*N coefficients; drawing uses at most 6",
     AT(bake.bands), 1, DPH_MAX_BANDS, NULL, parse_int},
    {"directions", 0, "N", "1024", "directions on the sphere, even, 16 to 65536",
     AT(bake.directions), 16, 65536, NULL, parse_int},
    {"thickness", 0, "WHICH", "inside",
     "all matter along the ray, to the first exit, or to the farthest", AT(bake.definition), 0, 0,
     definition_name, parse_choice},
    {"fit", 0, "HOW", "weighted",
     "plain projection over the sphere, or least squares weighted by what light comes through",
     AT(bake.fit), 0, 0, fit_name, parse_choice},
    {"store", 0, "TYPE", "snorm8",
     "component type of the coefficients; cpca: clustered principal components", AT(store), 0, 0,
     store_name, parse_choice},
    {"clusters", 0, "N", "128", "with --store cpca and for prt-cpca: clusters of a body, 1 to 4096",
     AT(cpca.clusters), 1, DPH_CPCA_MAX_CLUSTERS, NULL, parse_int},
    {"vectors", 0, "N", "8", "the same: vectors of a cluster, 1 to 36, a byte a vertex each",
     AT(cpca.vectors), 1, DPH_THICKNESS_MAX_VECTORS, NULL, parse_int},
    {"for", 0, "METHOD[,METHOD...]", "shsss", "write what these methods need, in --material",
     AT(products), 0, 0, method_name, parse_for},
    {"response-form", 0, "FORM", "root; with --env linear",
     "response: one channel's square root, one channel, or three (root, linear, rgb)",
     AT(response_form), 0, 0, response_form_name, parse_choice},
    {"bytes", 0, "N", NULL, "response: 4, 9, 16 or 36 a vertex, for 2, 3, 4 or 6 bands of snorm8",
     AT(response_bytes), 4, 36, NULL, parse_bytes},
    {"noise", 0, "X", "0.05", "response: walks are added until this is the bake's relative noise",
     AT(noise), 1e-3, 1, NULL, parse_real},
    {"compression", 0, NULL, NULL,
     "bake in memory and show the error of every way to store the coefficients", AT(compression), 0,
     0, NULL, parse_flag},
    {"size-mm", 0, "X", "the baked file's, else 25", "largest side of the whole scene in mm",
     AT(size_mm), 1e-9, 1e12, NULL, parse_real},
    /* the picture */
    {"method", 0, "NAME", "shsss", "how to shade", AT(method), 0, 0, method_name, parse_method},
    {"methods", 0, "A,B,...", "all", "which methods", AT(methods), 0, 0, drawn_name, parse_methods},
    {"material", 0, "NAME", "wax; for thickness none",
     "a preset or a JSON file with coefficients in 1/mm; compare takes several", AT(material), 0,
     0, NULL, parse_material},
    {"light", 0, "AZ,EL[,R,G,B]", "150,30 with pi each",
     "a distant light: where it stands in degrees, y up, and its irradiance; repeatable", AT(light),
     0, 0, NULL, parse_light},
    {"light-angle", 0, "DEG", "0", "half-angle of the distant lights' discs, 0 to 90",
     AT(light_angle), 0, 90, NULL, parse_real},
    {"env", 0, "FILE", NULL,
     "surroundings, a latitude-longitude picture (.hdr, .exr); for prt, prt-cpca, response",
     AT(environment), 0, 0, NULL, parse_text},
    {"point-light", 0, "X,Y,Z[,R,G,B]", NULL,
     "a light at a point of the scene, R,G,B at a distance of one unit; repeatable", AT(light), 0,
     0, NULL, parse_point_light},
    {"spot-light", 0, "X,Y,Z,TX,TY,TZ,ANGLE[,R,G,B]", NULL,
     "the same, aimed at TX,TY,TZ with a cone of half-angle ANGLE in degrees; repeatable",
     AT(light), 0, 0, NULL, parse_spot_light},
    {"camera", 0, "AZ,EL[,DIST]", "0,15,3.5",
     "where the camera stands, in degrees and bounding-sphere radii", AT(camera), 0, 0, NULL,
     parse_camera},
    {"fov", 0, "DEG", "35", "vertical field of view in degrees, 1 to 170", AT(camera.fov), 1, 170,
     NULL, parse_real},
    {"exposure", 0, "STOPS", "0", "the picture times 2^STOPS, for .png", AT(exposure), -64, 64,
     NULL, parse_real},
    {"background", 0, "R,G,B", "0,0,0", "colour behind the object, linear", AT(background), 0, 0,
     NULL, parse_colour},
    {"resolution", 0, "WxH", "1280x800", "pixels", AT(width), 1, 32768, NULL, parse_resolution},
    {"use-bands", 0, "N", "all",
     "draw with the first N of the stored bands, 1 to 6; auto: 2 with light from the front, all with "
     "light from behind", AT(use_bands), 1, DPH_DRAW_BANDS, NULL, parse_bands},
    {"window", 0, "NAME", "none", "damps ringing, at the price of detail", AT(window), 0, 0,
     window_name, parse_choice},
    {"formula", 0, "NAME", "g", "how thickness becomes light: ours, or the paper's sum",
     AT(formula), 0, 0, formula_name, parse_choice},
    {"specular", 0, "X", "the material's, else 0", "scale of the highlight", AT(specular), 0, 1e6,
     NULL, parse_real},
    {"rim", 0, "X", "the material's, else 0", "scale of the rim light", AT(rim), 0, 1e6, NULL,
     parse_real},
    {"ambient", 0, "X", "the material's, else 0", "light from everywhere, as radiance", AT(ambient),
     0, 1e6, NULL, parse_real},
    {"map-size", 0, "N", "1024",
     "green, green-gauss: texels a side of the depth maps, a power of two", AT(map_size), 16, 8192,
     NULL, parse_map_size},
    {"blur-mm", 0, "X", "a mean free path", "green-gauss: sigma of the blur", AT(blur_mm), 0, 1e12,
     NULL, parse_real},
    {"samples", 0, "N", "4", "multisampling, 1 to 16", AT(samples), 1, 16, NULL, parse_int},
    /* comparing */
    {"max-flip", 0, "X", NULL, "exit code 5 where FLIP is above X", AT(max_flip), 0, 1, NULL,
     parse_real},
    {"min-psnr", 0, "X", NULL, "exit code 5 where PSNR is below X dB", AT(min_psnr), -1e6, 1e6,
     NULL, parse_real},
    {"lights", 0, "LIST", "front,side,back; bench: 1",
     "compare: which, at the camera's azimuth + 30, + 90, + 180 degrees, elevation 20; bench draw: "
     "numbers of lights, each 1 to 16, to see how the cost grows", AT(lights), 0, 0, NULL,
     parse_text},
    {"study", 0, NULL, NULL,
     "also shsss with each formula, curve, fit and number of bands, in metrics.json and the table",
     AT(study), 0, 0, NULL, parse_flag},
    {"boundary", 0, "NAME", "matched",
     "reference: dielectric refracts, and points of the sky become discs of 5 degrees",
     AT(boundary), 0, 0, boundary_name, parse_choice},
    {"spp", 0, "N", "256", "reference: samples a pixel", AT(spp), 1, 1 << 24, NULL, parse_int},
    {"seed", 0, "N", "1", "reference: of its random numbers", AT(seed), 0, 2147483647, NULL,
     parse_int},
    /* measuring */
    {"seconds", 0, "S", "1", "how long each measurement runs at least", AT(seconds), 0.01, 3600,
     NULL, parse_real},
    {"repeat-mesh", 0, "N", "1", "bench draw: draw N copies, for fast GPUs", AT(repeat), 1, 4096,
     NULL, parse_int},
    {"scale", 0, "N,N,...", NULL,
     "bake made-up closed meshes of about these many triangles and show time and memory", AT(size),
     12, 2e8, NULL, parse_sizes},
};
enum { NOPTION = sizeof options / sizeof options[0] };
_Static_assert(NOPTION <= 128, "settings.given has a bit for each");

static const char *const common[] = {"help",    "version", "quiet", "verbose",
                                     "threads", "json",    NULL};

static bool listed(const char *const *names, const char *name)
{
    for (; *names; names++)
        if (strcmp(*names, name) == 0)
            return true;
    return false;
}

static bool takes(const struct command *command, const struct option *option)
{
    return listed(common, option->name) || listed(command->options, option->name);
}

void settings_init(struct settings *settings, const struct command *command)
{
    struct dph_frame frame = dph_frame_defaults();
    *settings = (struct settings){
        .command = command,
        .bake = dph_bake_defaults(),
        .products = DPH_PRODUCT_THICKNESS,
        .store = DPH_STORE_SNORM8,
        .cpca = dph_cpca_defaults(),
        .noise = dph_scene_response_defaults().noise,
        .specular = NAN,
        .rim = NAN,
        .ambient = NAN,
        .formula = -1,
        .method = frame.method,
        .camera = frame.camera,
        .width = frame.width,
        .height = frame.height,
        .samples = frame.samples,
        .spp = 256,
        .seed = 1,
        .map_size = frame.map_size,
        .blur_mm = frame.blur_mm,
        .window = frame.window,
        .max_flip = INFINITY,
        .min_psnr = -INFINITY,
        .seconds = 1.0,
        .repeat = 1,
    };
}

/* Edits that lead from one word to the other (Levenshtein), words of up to 31 letters. */
static size_t distance(const char *a, const char *b)
{
    size_t row[32], na = strlen(a), nb = strlen(b);
    if (na > 31 || nb > 31)
        return 99;
    for (size_t j = 0; j <= nb; j++)
        row[j] = j;
    for (size_t i = 1; i <= na; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= nb; j++) {
            size_t change = diagonal + (a[i - 1] != b[j - 1]), least = row[j] + 1;
            diagonal = row[j];
            if (row[j - 1] + 1 < least)
                least = row[j - 1] + 1;
            row[j] = change < least ? change : least;
        }
    }
    return row[nb];
}

const char *nearest_name(const char *word, const char *(*name_at)(size_t i, const void *user),
                         const void *user)
{
    const char *best = NULL, *name;
    size_t least = strlen(word) / 3 + 2; /* further away it is another word */
    for (size_t i = 0; (name = name_at(i, user)); i++) {
        size_t d = *name ? distance(word, name) : 99;
        if (d < least) {
            least = d;
            best = name;
        }
    }
    return best;
}

/* For suggestions: the names that a command takes; "" for those that it does not. */
static const char *taken_name(size_t i, const void *user)
{
    if (i >= NOPTION)
        return NULL;
    return takes(user, &options[i]) ? options[i].name : "";
}

static bool unknown(const struct settings *settings, const char *name)
{
    for (int i = 0; i < NOPTION; i++)
        if (strcmp(options[i].name, name) == 0) {
            complain(settings, "--%s is no option of this command", name);
            return false;
        }
    const char *near = nearest_name(name, taken_name, settings->command);
    if (near)
        complain(settings, "unknown option --%s; did you mean --%s?", name, near);
    else
        complain(settings, "unknown option --%s; see diaphan help %s", name,
                 settings->command->name);
    return false;
}

/* Handles argv[*i], an option, and moves *i to the last argument that it used. */
static bool parse_option(struct settings *settings, int argc, char **argv, int *i)
{
    const char *word = argv[*i], *value = NULL;
    const struct option *option = NULL;
    char name[64], why[WHY] = "";
    if (word[1] == '-') {
        value = strchr(word, '=');
        snprintf(name, sizeof name, "%.*s", value ? (int)(value - word) - 2 : 63, word + 2);
        for (int k = 0; k < NOPTION && !option; k++)
            if (strcmp(options[k].name, name) == 0 && takes(settings->command, &options[k]))
                option = &options[k];
        if (!option)
            return unknown(settings, name);
        if (value)
            value++;
    } else {
        snprintf(name, sizeof name, "%c", word[1]);
        for (int k = 0; k < NOPTION && !option; k++)
            if (options[k].letter == word[1] && takes(settings->command, &options[k]))
                option = &options[k];
        if (!option || (!option->argument && word[2])) {
            complain(settings, "unknown option %s; see diaphan help %s", word,
                     settings->command->name);
            return false;
        }
        if (word[2])
            value = word + 2;
    }
    if (!option->argument && value) {
        complain(settings, "--%s takes no value", option->name);
        return false;
    }
    if (option->argument && !value) {
        if (*i + 1 >= argc) {
            complain(settings, "--%s needs a value, %s", option->name, option->argument);
            return false;
        }
        value = argv[++*i];
    }
    if (option->parse(option, settings, value, why)) {
        settings->given[(option - options) / 64] |= UINT64_C(1) << ((option - options) % 64);
        return true;
    }
    complain(settings, "--%s: %s", option->name, why);
    return false;
}

bool is_given(const struct settings *settings, const char *name)
{
    for (int i = 0; i < NOPTION; i++)
        if (strcmp(options[i].name, name) == 0 &&
            settings->given[i / 64] >> (i % 64) & 1) /* rows may share a name */
            return true;
    return false;
}

bool settings_parse(struct settings *settings, int argc, char **argv, int first)
{
    const struct command *command = settings->command;
    bool plain = false; /* after "--" nothing is an option */
    settings->nword = argc;
    settings->word = argv;
    for (int i = first; i < argc; i++) {
        if (!plain && strcmp(argv[i], "--") == 0) {
            plain = true;
        } else if (!plain && argv[i][0] == '-' && argv[i][1]) {
            if (!parse_option(settings, argc, argv, &i))
                return false;
        } else if (settings->ninput < MAX_INPUTS) {
            settings->input[settings->ninput++] = argv[i];
        } else {
            complain(settings, "more than %d files", MAX_INPUTS);
            return false;
        }
    }
    if (settings->help || settings->version)
        return true;
    if (settings->ninput < command->min_inputs) {
        complain(settings, "too few arguments; usage: diaphan %s %s", command->name,
                 command->usage);
        return false;
    }
    if (settings->ninput > command->max_inputs) {
        complain(settings, "what is '%s' for? usage: diaphan %s %s",
                 settings->input[command->max_inputs], command->name, command->usage);
        return false;
    }
    if (command->wants_output && !settings->output) {
        complain(settings, "-o is missing; usage: diaphan %s %s", command->name, command->usage);
        return false;
    }
    return true;
}

static void print_option(const struct option *option)
{
    char head[64];
    snprintf(head, sizeof head, "%s%c%s--%s%s%s", option->letter ? "-" : "",
             option->letter ? option->letter : ' ', option->letter ? ", " : "   ", option->name,
             option->argument ? " " : "", option->argument ? option->argument : "");
    printf("  %-28s %s", head, option->help);
    const char *name;
    for (size_t i = 0; option->choice && (name = option->choice(i)); i++)
        printf("%s%s", i ? ", " : ": ", name);
    if (option->initial)
        printf(" [%s]", option->initial);
    putchar('\n');
}

void print_command_help(const struct command *command)
{
    printf("diaphan %s - %s\n\nExamples:\n%s\nUsage: diaphan %s %s\n", command->name,
           command->summary, command->examples, command->name, command->usage);
    if (command->options[0])
        printf("\nOptions [default]:\n");
    for (int i = 0; i < NOPTION; i++)
        if (listed(command->options, options[i].name))
            print_option(&options[i]);
    printf("\nEverywhere:\n");
    for (int i = 0; i < NOPTION; i++)
        if (listed(common, options[i].name))
            print_option(&options[i]);
    if (command->notes)
        printf("\n%s", command->notes);
    printf("\nExit codes: 0 done, 1 usage, 2 bad input, 3 missing capability (no GL context),\n"
           "4 output could not be written, 5 a comparison is over its tolerance.\n");
}
