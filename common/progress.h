/*
 * progress.h - a bar for long work, on stderr and only when it is a terminal.
 *
 * Kernels get a pointer (NULL: no bar) and call progress_tick(); threads may
 * call it together.  Nothing is drawn in the first half second.
 */
#ifndef PIXSHEAR_PROGRESS_H
#define PIXSHEAR_PROGRESS_H

#include <stdatomic.h>
#include <time.h>

struct progress {
    const char *what;
    long total;
    int on;                  /* stderr is a terminal and not --quiet */
    atomic_long done;
    atomic_long drawn;       /* milliseconds after the start of the last drawing */
    struct timespec start;
};

void progress_begin(struct progress *p, const char *what, long total, int quiet);   /* total < 0: not known, their count is shown */
void progress_tick(struct progress *p, long n);   /* n more items are done */
/* So many of the items, 0..1, were done at the last tick (0: not known): the total becomes an estimate. Not beside other threads' ticks. */
void progress_part(struct progress *p, double part);
void progress_end(struct progress *p);            /* wipe the bar */

double seconds_now(void);                         /* of a clock that only moves forward */

#endif
