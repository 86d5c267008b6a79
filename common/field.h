/*
 * field.h - a whole scene at once: objects blurred by a narrow Gaussian are summed on
 * a fine grid, transformed together, multiplied by T / Gaussian, folded onto the
 * output pixels' grid and transformed back.
 *
 * Wings of the PSF are those of the transfer function everywhere in the field; no stamp
 * ends and nothing but the field, padded by its margin, repeats.  The margin is as wide as the PSF's wings are above the request;
 * objects that reach farther (too large, or so faint at their peak that the wings count) would fold back and are drawn by
 * themselves, as in scene_plan.  The objects' frequencies
 * beyond the fine grid are held below 1e-9 by the Gaussian, which is divided out again.  Memory
 * 16 bytes per fine pixel, of which there are 1.5 to 3 per telescope's Nyquist interval and axis.
 */
#ifndef PIXSHEAR_FIELD_H
#define PIXSHEAR_FIELD_H

#include "accuracy.h"
#include "err.h"
#include "image.h"
#include "plan.h"
#include "progress.h"
#include "reach.h"

struct field {
    int split;             /* fine pixels per output pixel and axis */
    int nx, ny;            /* output pixels of the padded field */
    int x0, y0;            /* where the image begins in it */
    double sigma;          /* of the Gaussian, arcsec */
    double margin;         /* arcsec, on each side */
    double bytes;
    double cost;           /* predicted CPU seconds without the objects: transforms of the fine pixels */
    struct wings wings;
};

/* Choose margin and grid. v needs a psf. E_RANGE: fine sides above 32768; E_NOMEM. */
MUST_CHECK int field_plan(struct field *f, const struct view *v, const struct accuracy *a);
void field_free(struct field *f);

/* Objects that were not drawn as they should be. */
struct field_losses {
    size_t bad;            /* not drawn: n_bad of the plan */
    size_t cut;            /* n_short of the plan */
    size_t large;          /* no loss: drawn by themselves */
};

/*
 * The fine grid, to which objects are added as often as there are some.  Objects outside the margin are left out; those that
 * reach beyond it go to im (of the view's size) at once, the others with field_end().
 * Error: eps of an object's peak or floor as with stamps, and
 * 2e-7 of the peak from float32. E_NOMEM, E_RANGE.
 */
struct field_sum {
    const struct field *f;
    const struct view *v;
    struct image fine;
    struct field_losses lost;
};

MUST_CHECK int field_begin(struct field_sum *s, const struct field *f, const struct view *v);
MUST_CHECK int field_add(struct field_sum *s, const struct accuracy *a, size_t n, const struct emitter *e, struct image *im,
                         int threads, struct progress *bar);
/* Convolve, add to im and free s, whatever happens. */
MUST_CHECK int field_end(struct field_sum *s, struct image *im);

#endif
