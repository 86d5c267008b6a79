/*
 * segment.h - pixels above the threshold as runs, joined into components.
 *
 * One pass over the image: subtract the background, filter, compare with the
 * threshold, keep the runs.  Runs that touch (also by a corner) belong to one
 * component, found by union-find; components below the minimum area are
 * dropped.  Time is linear in pixels plus runs; memory beyond the image is
 * that of the detected pixels.
 */
#ifndef PIXSHEAR_SEGMENT_H
#define PIXSHEAR_SEGMENT_H

#include "background.h"
#include "err.h"
#include "par.h"
#include "pixels.h"
#include "smooth.h"
#include <stdint.h>

/* Pixels x0 <= x < x1 of row y; sides of images are below 2^16. */
struct run {
    uint16_t y, x0, x1;
};

struct segments {
    size_t nrun, npix;
    struct run *run;       /* grouped by component; inside one row by row, x rising */
    float *smooth;         /* npix filtered values above background, in the order of the runs */
    float *value;          /* npix unfiltered values above background */
    size_t ncomponent;
    size_t *first;         /* runs of component c: first[c] .. first[c+1]-1 */
    size_t *at;            /* its pixels, fewer than 2^32 in all: at[c] .. at[c+1]-1 */
};

struct segment_params {
    double threshold;      /* filtered value must exceed threshold * noise */
    double noise;          /* rms per pixel where rms_map is NULL */
    const float *rms_map;  /* rms per pixel, infinite = bad; or NULL */
    long min_area;         /* pixels, >= 1 */
    int negative;          /* look for minima of the image instead */
    struct par_team *team; /* threads; NULL: the calling one alone */
};

/*
 * Find.  Bad pixels (b->bad says whether there are any) are bridged as mend.h says; those that stay bad
 * count as 0 in the filter and are never detected; the minimum area is one of good pixels; outside the image is 0.
 */
MUST_CHECK int segment_find(struct segments *s, const struct pixels *im, const struct background *b,
                            const struct smooth *filter, const struct segment_params *p);
void segment_free(struct segments *s);

/*
 * Filtered rows y0 .. y0+n-1 above background, for check images and noise
 * estimates: out has n * nx values.
 */
MUST_CHECK int segment_filtered(const struct pixels *im, const struct background *b,
                                const float *rms_map, const struct smooth *filter, int negative,
                                long y0, long n, float *out);

#endif
