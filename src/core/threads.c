/* A parallel loop over POSIX threads: workers take the next index from a shared counter. */
#define _GNU_SOURCE
#include "core/threads.h"

#ifdef DPH_THREADS
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <unistd.h>
#endif

enum { MAX_THREADS = 256 };

int dph_processors(void)
{
#ifdef DPH_THREADS
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0 && CPU_COUNT(&set) > 0)
        return CPU_COUNT(&set);
    long online = sysconf(_SC_NPROCESSORS_ONLN);
    return online > 0 ? (int)online : 1;
#else
    return 1;
#endif
}

int dph_thread_count(int threads)
{
    if (threads <= 0)
        threads = dph_processors();
    return threads < MAX_THREADS ? threads : MAX_THREADS;
}

#ifdef DPH_THREADS

struct loop {
    void (*task)(void *context, size_t i, int worker);
    void *context;
    size_t count;
    atomic_size_t next;
};

struct worker {
    struct loop *loop;
    int number;
    pthread_t thread;
};

static void *work(void *argument)
{
    struct worker *worker = argument;
    struct loop *loop = worker->loop;
    for (;;) {
        size_t i = atomic_fetch_add_explicit(&loop->next, 1, memory_order_relaxed);
        if (i >= loop->count)
            return NULL;
        loop->task(loop->context, i, worker->number);
    }
}

void dph_parallel(int threads, size_t count, void (*task)(void *context, size_t i, int worker),
                  void *context)
{
    struct loop loop = {task, context, count, 0};
    struct worker workers[MAX_THREADS];
    if (threads > MAX_THREADS)
        threads = MAX_THREADS;
    if ((size_t)threads > count)
        threads = (int)count;
    int started = 1;
    for (; started < threads; started++) {
        workers[started] = (struct worker){.loop = &loop, .number = started};
        if (pthread_create(&workers[started].thread, NULL, work, &workers[started]))
            break;
    }
    workers[0] = (struct worker){.loop = &loop, .number = 0};
    work(&workers[0]);
    for (int i = 1; i < started; i++)
        pthread_join(workers[i].thread, NULL);
}

#else

void dph_parallel(int threads, size_t count, void (*task)(void *context, size_t i, int worker),
                  void *context)
{
    (void)threads;
    for (size_t i = 0; i < count; i++)
        task(context, i, 0);
}

#endif
