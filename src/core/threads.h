/* core/threads.h - a parallel loop.      Tier 0, private. Without DPH_THREADS it is a plain
 * loop. */
#ifndef DPH_CORE_THREADS_H
#define DPH_CORE_THREADS_H

#include <stdbool.h>
#include <stddef.h>

/* Processors that this process may use, at least 1. */
int dph_processors(void);

/* `threads` where it is positive, else dph_processors(); at most 256. */
int dph_thread_count(int threads);

/* Runs task(context, i, worker) once for every i < count, on up to `threads` threads including
 * the caller's; worker < threads says which one. Tasks are handed out in order; which worker
 * gets which is not determined, so a task must not let its result depend on it. Falls back to
 * fewer threads where they cannot be had. */
void dph_parallel(int threads, size_t count, void (*task)(void *context, size_t i, int worker),
                  void *context);

#endif
