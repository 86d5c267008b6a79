/*
 * peaks.h - can a component be more than one object?  A short look that spares most components the flood of deblend.h.
 */
#ifndef PIXSHEAR_PEAKS_H
#define PIXSHEAR_PEAKS_H

#include "err.h"
#include "segment.h"

/* Scratch of one thread; begin with {0}. */
struct peaks {
    float *line;
    size_t cap_line;
};

void peaks_free(struct peaks *w);

/*
 * *several = 0 when the component's filtered values, all positive, surely have no two branches with at least `area` pixels
 * and more than `contrast` of the component's flux above the level at which they join; else 1.
 */
MUST_CHECK int peaks_several(const struct segments *s, size_t c, long area, double contrast, struct peaks *w, int *several);

#endif
