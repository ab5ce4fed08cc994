/* Wall-clock time, and what else the machine does: the processors' times in Linux's /proc/stat (user,
 * nice, system, idle, waiting, two kinds of interrupts, stolen by other virtual machines) without
 * those that were idle and without this process's own. */
#define _POSIX_C_SOURCE 200809L
#include "core/clock.h"

#include <stdio.h>
#include <time.h>
#include <unistd.h>

double dph_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double dph_seconds_others(void)
{
    unsigned long long t[8] = {0};
    struct timespec own;
    FILE *file = fopen("/proc/stat", "r");
    if (!file)
        return 0;
    int got = fscanf(file, "cpu %llu %llu %llu %llu %llu %llu %llu %llu", &t[0], &t[1], &t[2],
                     &t[3], &t[4], &t[5], &t[6], &t[7]);
    fclose(file);
    if (got != 8 || clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &own))
        return 0;
    double busy = (double)(t[0] + t[1] + t[2] + t[5] + t[6] + t[7]) / (double)sysconf(_SC_CLK_TCK);
    return busy - (double)own.tv_sec - 1e-9 * (double)own.tv_nsec;
}
