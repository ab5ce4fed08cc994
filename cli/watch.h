/* watch.h - a progress bar for every phase of a comparison or a fit, and Ctrl-C: while the truth is
 * traced it keeps the samples so far and goes on with them, in other phases it ends the work. */
#ifndef WATCH_H
#define WATCH_H

#include "cli.h"

#include <diaphan/judge.h>

struct watch {
    const struct settings *settings;
    struct progress progress;
    enum dph_judge_phase phase;
    const char *material;
    char label[96];
    bool begun;
    bool cut; /* tracing to fit was stopped */
};

/* Puts itself into `params`; there is one watch at a time. */
void watch_begin(struct watch *watch, const struct settings *settings,
                 struct dph_judge_params *params);
void watch_end(struct watch *watch);

#endif
