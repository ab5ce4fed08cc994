/* The progress bar: percent and time left, drawn once work has taken a moment, wiped when it is
 * done. */
#define _POSIX_C_SOURCE 200809L
#include "cli.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double FIRST = 0.5, EVERY = 0.1; /* seconds */
enum { WIDTH = 30 };

void progress_begin(struct progress *progress, const struct settings *settings, const char *label)
{
    const char *terminal = getenv("TERM");
    *progress = (struct progress){
        .shown = !settings->quiet && !settings->json && isatty(STDERR_FILENO) &&
                 !(terminal && strcmp(terminal, "dumb") == 0),
        .label = label,
        .start = seconds_now(),
        .last = 0.0,
    };
}

bool progress_step(void *user, double fraction)
{
    struct progress *progress = user;
    double now = seconds_now();
    if (!progress->shown || now - progress->start < FIRST || now - progress->last < EVERY)
        return true;
    progress->last = now;
    double left = fraction > 0.0 ? (now - progress->start) * (1.0 - fraction) / fraction : 0.0;
    char bar[WIDTH + 1];
    for (int i = 0; i < WIDTH; i++)
        bar[i] = i < (int)(fraction * WIDTH) ? '#' : '.';
    bar[WIDTH] = 0;
    fprintf(stderr, "\r%s [%s] %3.0f %%", progress->label, bar, 100.0 * fraction);
    if (left >= 3600.0)
        fprintf(stderr, ", %d h %02d min left ", (int)(left / 3600.0), (int)(left / 60.0) % 60);
    else if (left >= 60.0)
        fprintf(stderr, ", %d min %02d s left ", (int)(left / 60.0), (int)left % 60);
    else
        fprintf(stderr, ", %.0f s left ", left);
    fputs("\033[K", stderr);
    fflush(stderr);
    return true;
}

void progress_end(struct progress *progress)
{
    if (progress->shown && progress->last > 0.0)
        fputs("\r\033[K", stderr);
    progress->shown = false;
}
