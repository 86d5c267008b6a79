/* pages.c - large blocks of memory in large pages: the whole 2 MiB pages inside a block, its ragged ends stay small. */
#include "pages.h"
#include <stdint.h>
#include <sys/mman.h>

enum { LARGE = 2 << 20 };

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
