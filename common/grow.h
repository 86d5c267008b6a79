/*
 * grow.h - arrays that grow: one function, so that every buffer without a
 * compiled-in limit grows the same way and checks its size the same way.
 */
#ifndef PIXSHEAR_GROW_H
#define PIXSHEAR_GROW_H

#include "err.h"
#include <stdint.h>
#include <stdlib.h>

/*
 * Make room for `need` items of `size` bytes in *p, which has room for *cap.
 * Room at least doubles.  On E_NOMEM nothing changes.
 */
MUST_CHECK static inline int grow(void *p, size_t *cap, size_t need, size_t size)
{
    void **array = p;
    if (need <= *cap)
        return OK;
    size_t want = *cap < SIZE_MAX / 2 ? 2 * *cap : need;
    if (want < need)
        want = need;
    if (want < 16)
        want = 16;
    if (want > SIZE_MAX / size)
        return E_NOMEM;
    void *q = realloc(*array, want * size);
    if (!q)
        return E_NOMEM;
    *array = q;
    *cap = want;
    return OK;
}

#endif
