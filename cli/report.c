/* Talking to the user: one-line messages on stderr, and what becomes of failures. */
#define _POSIX_C_SOURCE 200809L
#include "cli.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Bold and a colour for the word that matters; not in files, not where the user declines
 * (no-color.org). */
static bool colours(void)
{
    const char *declined = getenv("NO_COLOR"), *terminal = getenv("TERM");
    return !(declined && *declined) && isatty(STDERR_FILENO) && terminal &&
           strcmp(terminal, "dumb") != 0;
}

__attribute__((format(printf, 3, 0))) static void say(const struct settings *settings,
                                                      const char *kind, const char *format,
                                                      va_list args)
{
    char text[1024];
    vsnprintf(text, sizeof text, format, args);
    for (char *c = text; *c; c++) /* one line, whatever a file's name holds */
        if ((unsigned char)*c < 32 || *c == 127)
            *c = '?';
    fflush(stdout);
    fprintf(stderr, "diaphan");
    if (settings && settings->command)
        fprintf(stderr, " %s", settings->command->name);
    if (*kind)
        fprintf(stderr, colours() ? ": \033[1;33m%s:\033[0m %s\n" : ": %s: %s\n", kind, text);
    else
        fprintf(stderr, ": %s\n", text);
}

void complain(const struct settings *settings, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    say(settings, "", format, args);
    va_end(args);
}

void warn(const struct settings *settings, const char *format, ...)
{
    if (settings->quiet)
        return;
    va_list args;
    va_start(args, format);
    say(settings, "warning", format, args);
    va_end(args);
}

void talk(const struct settings *settings, const char *format, ...)
{
    if (settings->quiet || !settings->verbose)
        return;
    va_list args;
    va_start(args, format);
    say(settings, "", format, args);
    va_end(args);
}

int report_error(const struct settings *settings, const struct dph_error *err)
{
    complain(settings, "%s", err->message);
    switch (err->code) {
    case DPH_ERROR_ARGUMENT: return EXIT_USAGE;
    case DPH_ERROR_OUTPUT: return EXIT_OUTPUT;
    case DPH_ERROR_CAPABILITY: return EXIT_CAPABILITY;
    case DPH_ERROR_CANCELLED: return EXIT_CANCELLED;
    default: return EXIT_INPUT; /* what the file holds, or is too large for this machine's memory */
    }
}

void report_warnings(const struct settings *settings, const struct dph_scene *scene, size_t first)
{
    for (size_t i = first; i < scene->nwarning; i++)
        warn(settings, "%s", scene->warning[i]);
}

int finish_stdout(const struct settings *settings, int code)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return code;
    complain(settings, "standard output: %s", strerror(errno));
    return EXIT_OUTPUT;
}

double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

const char *with_commas(size_t number, char buffer[32])
{
    char digits[24];
    int length = snprintf(digits, sizeof digits, "%zu", number), out = 0;
    for (int i = 0; i < length; i++) {
        if (i && (length - i) % 3 == 0)
            buffer[out++] = ',';
        buffer[out++] = digits[i];
    }
    buffer[out] = 0;
    return buffer;
}

bool has_ending(const char *path, const char *ending)
{
    size_t length = strlen(path), tail = strlen(ending);
    return length > tail && strcasecmp(path + length - tail, ending) == 0;
}

/* Whether a new file or folder can be made at `path`. */
static bool parent_possible(const struct settings *settings, const char *path)
{
    struct stat info;
    char folder[4096];
    const char *slash = strrchr(path, '/');
    int length = !slash ? snprintf(folder, sizeof folder, ".")
                        : snprintf(folder, sizeof folder, "%.*s", (int)(slash - path) + 1, path);
    if (length < (int)sizeof folder && (stat(folder, &info) || !S_ISDIR(info.st_mode))) {
        complain(settings, "%s: the folder %s does not exist", path, folder);
        return false;
    }
    if (access(folder, W_OK)) {
        complain(settings, "%s: %s", path, strerror(errno));
        return false;
    }
    return true;
}

bool output_possible(const struct settings *settings, const char *path)
{
    struct stat info;
    if (stat(path, &info) == 0) {
        if (!S_ISDIR(info.st_mode))
            return true;
        complain(settings, "%s: is a folder", path);
        return false;
    }
    return parent_possible(settings, path);
}

bool folder_possible(const struct settings *settings, const char *path, const char *const *file)
{
    struct stat info;
    const char *why = NULL;
    char inside[4096];
    if (stat(path, &info)) {
        snprintf(inside, sizeof inside, "%s", path);
        for (size_t n = strlen(inside); n > 1 && inside[n - 1] == '/'; n--)
            inside[n - 1] = 0;
        return parent_possible(settings, inside);
    }
    if (!S_ISDIR(info.st_mode))
        why = "is no folder";
    else if (access(path, W_OK | X_OK))
        why = strerror(errno);
    if (why) {
        complain(settings, "%s: %s", path, why);
        return false;
    }
    for (; *file; file++) {
        snprintf(inside, sizeof inside, "%s/%s", path, *file);
        if (!output_possible(settings, inside))
            return false;
    }
    return true;
}

bool make_folder(const struct settings *settings, const char *path)
{
    if (mkdir(path, 0777) == 0 || errno == EEXIST)
        return true;
    complain(settings, "%s: %s", path, strerror(errno));
    return false;
}
