/* progress.c - a bar for long work. */
#include "progress.h"
#include <stdio.h>
#include <unistd.h>

static long elapsed_ms(const struct progress *p)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (now.tv_sec - p->start.tv_sec) * 1000 + (now.tv_nsec - p->start.tv_nsec) / 1000000;
}

double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void progress_begin(struct progress *p, const char *what, long total, int quiet)
{
    *p = (struct progress){.what = what, .total = total, .on = !quiet && total && isatty(STDERR_FILENO)};
    atomic_init(&p->drawn, 300);
    clock_gettime(CLOCK_MONOTONIC, &p->start);
}

void progress_tick(struct progress *p, long n)
{
    if (!p || !p->on)
        return;
    const long done = atomic_fetch_add(&p->done, n) + n, now = elapsed_ms(p);
    long last = atomic_load(&p->drawn);
    if (now < last + 200 || !atomic_compare_exchange_strong(&p->drawn, &last, now))
        return;
    if (p->total < 0) {
        fprintf(stderr, "\r%s %ld ", p->what, done);
        fflush(stderr);
        return;
    }
    const double part = (double)done / (double)p->total;
    const int width = (int)(30 * (part < 1 ? part : 1));
    fprintf(stderr, "\r%s [%.*s%*s] %3.0f%%  %.0f s left ", p->what, width, "##############################",
            30 - width, "", 100 * part, part > 0 ? (double)now / 1000 * (1 - part) / part : 0.0);
    fflush(stderr);
}

void progress_part(struct progress *p, double part)
{
    const double done = (double)atomic_load(&p->done);
    if (part > 0 && done > 0)
        p->total = (long)(done / (part < 1 ? part : 1));
}

void progress_end(struct progress *p)
{
    if (p->on && elapsed_ms(p) > 500)
        fprintf(stderr, "\r\033[K");
}
