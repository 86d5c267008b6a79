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

/* malloc(), at a multiple of 64 bytes; from 4 MiB on the block begins where a large page can begin. */
void *pages_block(size_t bytes);

/*
 * Memory that is freed stays with the program for its next block instead of costing the same faults again (in all
 * threads; blocks of 4 MiB and more still go back), and the next `bytes` of it (of at most 16 MiB) come in large pages.
 */
void pages_keep(size_t bytes);

/* What is free of it goes back now, for a program that needs its memory for another thing. */
void pages_return(void);

/* The other way: blocks of 128 KiB and more go back to the system as soon as they are freed, however many came before. */
void pages_give_back(void);

#endif
