/* pages.c - large blocks of memory in large pages: the whole 2 MiB pages inside a block, its ragged ends stay small. */
#include "pages.h"
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

enum { CACHE_LINE = 64, SMALL = 128 << 10, LARGE = 2 << 20, MAPPED = 4 << 20, FIRST = 16 << 20, STEP = 1 << 20, KEPT = 1 << 30 };

void pages_large(void *p, size_t bytes)
{
#ifdef MADV_HUGEPAGE
    if (!p || bytes < 2 * (size_t)LARGE)
        return;
    uintptr_t begin = ((uintptr_t)p + LARGE - 1) / LARGE * LARGE;
    uintptr_t end = ((uintptr_t)p + bytes) / LARGE * LARGE;
    (void)madvise((void *)begin, end - begin, MADV_HUGEPAGE);
#else
    (void)p;
    (void)bytes;
#endif
}

void *pages_block(size_t bytes)
{
    void *p;
    return posix_memalign(&p, bytes < 2 * (size_t)LARGE ? CACHE_LINE : LARGE, bytes) ? NULL : p;
}

void pages_give_back(void)
{
#ifdef __GLIBC__
    (void)mallopt(M_MMAP_THRESHOLD, SMALL);      /* without this the threshold follows the largest block freed */
#endif
}

void pages_return(void)
{
#ifdef __GLIBC__
    (void)malloc_trim(0);
#endif
}

void pages_keep(size_t bytes)
{
#ifdef __GLIBC__
    if (bytes > FIRST)
        bytes = FIRST;
    (void)mallopt(M_TRIM_THRESHOLD, KEPT);
    (void)mallopt(M_TOP_PAD, STEP);
    (void)mallopt(M_ARENA_MAX, 1);
    (void)mallopt(M_MMAP_THRESHOLD, FIRST + STEP);
    void *p = bytes >= 2 * (size_t)LARGE ? malloc(bytes) : NULL;
    pages_large(p, bytes);
    free(p);
    (void)mallopt(M_MMAP_THRESHOLD, MAPPED);
#else
    (void)bytes;
#endif
}
