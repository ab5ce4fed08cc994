/* Ctrl-C, for work that ends in order: it is noted, and the work asks. */
#include "cli.h"

#include <signal.h>

static volatile sig_atomic_t noted;
static void (*before)(int);

static void note(int number)
{
    (void)number;
    noted = 1;
}

void interrupt_begin(void)
{
    noted = 0;
    before = signal(SIGINT, note);
}

bool interrupt_noted(void)
{
    bool was = noted;
    noted = 0;
    return was;
}

void interrupt_end(void)
{
    if (before != SIG_ERR)
        signal(SIGINT, before);
}
