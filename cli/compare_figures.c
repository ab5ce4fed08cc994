/* What diaphan compare INPUT -o FOLDER leaves for people: comparison.png and report.html. */
#define _POSIX_C_SOURCE 200809L
#include "cli.h"
#include "report_html.h"
#include "sheet.h"

#include <stdlib.h>
#include <string.h>

/* One word of a command as a shell reads it back. */
static void put_word(FILE *out, const char *word)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                "_-+=.,:/@%";
    if (*word && strspn(word, plain) == strlen(word)) {
        fputs(word, out);
        return;
    }
    putc('\'', out);
    for (; *word; word++) {
        if (*word == '\'')
            fputs("'\\''", out);
        else
            putc(*word, out);
    }
    putc('\'', out);
}

char *command_text(const struct settings *settings)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    fputs("diaphan", out);
    for (int i = 1; i < settings->nword; i++) {
        putc(' ', out);
        put_word(out, settings->word[i]);
    }
    if (fclose(out)) {
        free(text);
        return NULL;
    }
    return text;
}

int compare_figures(const struct settings *settings, const struct dph_comparison *comparison)
{
    struct dph_error err;
    int code = EXIT_DONE;
    char path[4096], *command = command_text(settings);
    const char *slash = strrchr(settings->input[0], '/');
    struct figure_run run = {slash ? slash + 1 : settings->input[0], command};
    snprintf(path, sizeof path, "%s/comparison.png", settings->output);
    bool ok = sheet_save(comparison, &run, path, &err);
    if (ok) {
        snprintf(path, sizeof path, "%s/report.html", settings->output);
        ok = report_html_save(comparison, &run, path, &err);
    }
    if (!ok)
        code = report_error(settings, &err);
    free(command);
    return code;
}
