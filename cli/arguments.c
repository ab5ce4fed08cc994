/* The command line: words become settings, by the table of options, and the table becomes help. */
#include "options.h"

#include <math.h>
#include <string.h>

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
    if (i >= (size_t)noption)
        return NULL;
    return takes(user, &options[i]) ? options[i].name : "";
}

static bool unknown(const struct settings *settings, const char *name)
{
    for (int i = 0; i < noption; i++)
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
        for (int k = 0; k < noption && !option; k++)
            if (strcmp(options[k].name, name) == 0 && takes(settings->command, &options[k]))
                option = &options[k];
        if (!option)
            return unknown(settings, name);
        if (value)
            value++;
    } else {
        snprintf(name, sizeof name, "%c", word[1]);
        for (int k = 0; k < noption && !option; k++)
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
    for (int i = 0; i < noption; i++)
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
    for (int i = 0; i < noption; i++)
        if (listed(command->options, options[i].name))
            print_option(&options[i]);
    printf("\nEverywhere:\n");
    for (int i = 0; i < noption; i++)
        if (listed(common, options[i].name))
            print_option(&options[i]);
    if (command->notes)
        printf("\n%s", command->notes);
    printf("\nExit codes: 0 done, 1 usage, 2 bad input, 3 missing capability (no GL context),\n"
           "4 output could not be written, 5 a comparison is over its tolerance.\n");
}
