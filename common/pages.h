/*
 * pages.h - large blocks of memory in large pages, where the system has them.
 *
 * The kernel hands out memory in pages of 4 KiB, each at its first touch: a field of 4096 x 4096 costs 16384 faults,
 * a quarter of the time detect spends on it.  A block advised before it is touched costs one fault for 2 MiB.
 */
#ifndef PIXSHEAR_PAGES_H
#define PIXSHEAR_PAGES_H

#include <stddef.h>

/* Advise large pages for `bytes` at p, not touched yet; a hint that never fails.  Blocks below 4 MiB are left alone. */
void pages_large(void *p, size_t bytes);

#endif
