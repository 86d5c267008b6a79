/*
 * stackgrid.c - the output grid of a stack, and the maps of its exposures to it.
 */
#include "stack.h"
#include <math.h>
#include <stdlib.h>

static void set(int *st, int now)
{
    if (*st == OK)
        *st = now;
}

/* ---- maps ---- */

struct pair {
    struct sky *from, *to;
    double *ra;              /* scratch, 2 * cap */
    size_t cap;
};

static int through_sky(void *ctx, size_t n, const double *x, const double *y, double *X, double *Y)
{
    struct pair *p = ctx;
    if (n > p->cap) {
        double *more = realloc(p->ra, 2 * n * sizeof *more);
        if (!more)
            return E_NOMEM;
        p->ra = more;
        p->cap = n;
    }
    int st = sky_from_pixel(p->from, n, x, y, p->ra, p->ra + n);
    return st ? st : sky_to_pixel(p->to, n, p->ra, p->ra + n, X, Y);
}

/* A displacement of a list; the output's pixel (0,0) lies at (x0, y0) of the frame, `ratio` of its pixels are one of the frame. */
struct placed {
    struct stack_shift shift;
    double cx, cy, cos, sin;
    double ratio, x0, y0;
};

static int through_list(void *ctx, size_t n, const double *x, const double *y, double *X, double *Y)
{
    const struct placed *p = ctx;
    for (size_t i = 0; i < n; i++) {
        const double u = p->shift.scale * (x[i] - p->cx), v = p->shift.scale * (y[i] - p->cy);
        X[i] = p->ratio * (p->cx + p->cos * u - p->sin * v + p->shift.dx - p->x0);
        Y[i] = p->ratio * (p->cy + p->sin * u + p->cos * v + p->shift.dy - p->y0);
    }
    return OK;
}

/* The middle of an exposure is fixed to its displacement; right angles are exact. */
static struct placed place(const struct shot *t, double ratio, const double origin[2])
{
    const double quarters = t->shift.rotation / 90, angle = t->shift.rotation * (M_PI / 180);
    struct placed p = {
        .shift = t->shift, .cx = 0.5 * (double)(t->x.nx - 1), .cy = 0.5 * (double)(t->x.ny - 1),
        .cos = cos(angle), .sin = sin(angle), .ratio = ratio, .x0 = origin[0], .y0 = origin[1],
    };
    if (quarters >= floor(quarters) && quarters <= floor(quarters)) {
        p.cos = rint(p.cos);
        p.sin = rint(p.sin);
    }
    return p;
}

static int no_map(const struct shot *t, int st, struct err *e)
{
    const char *why = st == E_SINGULAR ? "its pixels have no area there, or more than 1e18"
                    : st == E_RANGE ? "parts of it are not on the sky, or not on the output's side of it"
                    : st == E_NOCONV ? "its distortion is too steep" : err_text(st);
    return err_set(e, st, "%s: cannot be mapped to the output grid: %s", t->label, why);
}

static int maps_by_sky(struct stack *s, struct err *e)
{
    struct err why;
    sky_close(s->sky);
    s->sky = NULL;
    int st = sky_open(&s->sky, &s->hdr, &why);
    if (st)
        return err_set(e, st, "output grid: no usable WCS: %s", why.text);
    s->scale = sky_scale(s->sky);
    for (size_t i = 0; i < s->n && st == OK; i++) {
        struct shot *t = &s->shot[i];
        struct pair p = {.from = t->sky, .to = s->sky};
        drizzle_map_free(&t->map);
        st = drizzle_map_make(&t->map, t->x.nx, t->x.ny, through_sky, &p);
        free(p.ra);
        if (st)
            return no_map(t, st, e);
        const double ratio = t->map.node_x ? 1 / t->map.scale : s->scale / sky_scale(t->sky);
        t->area = ratio * ratio;
    }
    return st;
}

static int maps_by_list(struct stack *s, double ratio, const double origin[2], struct err *e)
{
    for (size_t i = 0; i < s->n; i++) {
        struct shot *t = &s->shot[i];
        struct placed p = place(t, ratio, origin);
        drizzle_map_free(&t->map);
        int st = drizzle_map_make(&t->map, t->x.nx, t->x.ny, through_list, &p);
        if (st)
            return no_map(t, st, e);
        t->area = 1 / (ratio * t->shift.scale * ratio * t->shift.scale);
    }
    return OK;
}

/* ---- sizes ---- */

/* least[k], most[k]: first and last output pixel that a drop reaches, least not above 0. */
static void reached(const struct stack *s, double least[2], double most[2])
{
    const double half = s->choice.kernel == DRIZZLE_POINT ? 0 : 0.5 * s->choice.pixfrac;
    least[0] = least[1] = most[0] = most[1] = 0;
    for (size_t i = 0; i < s->n; i++) {
        const struct shot *t = &s->shot[i];
        double lo[2], hi[2];
        const double slack = t->map.node_x ? 2e-3 : 4e-6;
        drizzle_map_bounds(&t->map, -half, -half, (double)(t->x.nx - 1) + half, (double)(t->x.ny - 1) + half, lo, hi);
        for (int k = 0; k < 2; k++) {
            least[k] = fmin(least[k], floor(lo[k] + slack + 0.5));
            most[k] = fmax(most[k], ceil(hi[k] - slack + 0.5) - 1);
        }
    }
}

/* The size that holds every drop. */
static int grow(struct stack *s, double least[2], struct err *e)
{
    double most[2];
    reached(s, least, most);
    const double side[2] = {most[0] - least[0] + 1, most[1] - least[1] + 1};
    if (!(side[0] <= 65535 && side[1] <= 65535))
        return err_set(e, E_DATA, "output grid: %.0f x %.0f pixels, more than 65535 per side: give --like or a larger --pixscale",
                       side[0], side[1]);
    s->nx = (long)side[0];
    s->ny = (long)side[1];
    return OK;
}

/* CRPIX of the output less `by`. */
static int move_reference(struct header *h, const double by[2])
{
    int st = OK;
    double v;
    for (int k = 0; k < 2 && st == OK; k++) {
        const char *key = k ? "CRPIX2" : "CRPIX1";
        if (header_double(h, key, &v) == OK)
            st = header_set_double(h, key, v - by[k], NULL);
    }
    return st;
}

/* ---- grids ---- */

/*
 * A TAN around --center, else the first exposure's middle, its y axis --rotation
 * degrees from north through east; of --size, else to be grown.
 */
static int chosen_grid(struct stack *s, double scale, struct err *e)
{
    const struct shot *first = &s->shot[0];
    const struct stack_choice *r = &s->choice;
    const double x = 0.5 * (double)(first->x.nx - 1), y = 0.5 * (double)(first->x.ny - 1);
    const double turn = (r->turned ? r->rotation : 0) * (M_PI / 180), c = scale / 3600 * cos(turn), n = scale / 3600 * sin(turn);
    double at[2] = {r->center[0], r->center[1]};
    if (!r->centred && sky_from_pixel(first->sky, 1, &x, &y, &at[0], &at[1]))
        return err_set(e, E_DATA, "%s: its middle is not on the sky: give --center", first->label);
    s->nx = r->sized ? (long)r->size[0] : 1;
    s->ny = r->sized ? (long)r->size[1] : 1;
    exposure_remove_wcs(&s->hdr);
    int st = sky_set_tan(&s->hdr, scale, 0.5 * (double)(s->nx + 1), 0.5 * (double)(s->ny + 1), at[0], at[1]);
    set(&st, header_set_double(&s->hdr, "CD1_1", -c, "deg per pixel"));
    set(&st, header_set_double(&s->hdr, "CD1_2", n, "deg per pixel"));
    set(&st, header_set_double(&s->hdr, "CD2_1", n, "deg per pixel"));
    set(&st, header_set_double(&s->hdr, "CD2_2", c, "deg per pixel"));
    return st ? err_set(e, st, "output grid: %s", err_text(st)) : OK;
}

/* Grid of the first exposure, finer by the ratio of the scales; where it is not plain, a TAN with its reference point. */
static int first_grid(struct stack *s, double factor, double scale, struct err *e)
{
    const struct shot *first = &s->shot[0];
    int st = exposure_rescale_wcs(&s->hdr, 0, 0, factor);
    if (st == OK && !sky_is_linear(first->sky)) {
        double crval[2], crpix[2];
        crpix[0] = header_double_or(&s->hdr, "CRPIX1", NAN);
        crpix[1] = header_double_or(&s->hdr, "CRPIX2", NAN);
        sky_reference(first->sky, &crval[0], &crval[1]);
        exposure_remove_wcs(&s->hdr);
        st = sky_set_tan(&s->hdr, scale, crpix[0], crpix[1], crval[0], crval[1]);
    }
    return st ? err_set(e, st, "%s: %s", first->label, err_text(st)) : OK;
}

static int own_grid(struct stack *s, struct err *e)
{
    const struct stack_choice *c = &s->choice;
    const double in = sky_scale(s->shot[0].sky), out = isnan(c->scale) ? in : c->scale;
    double least[2];
    int st = first_grid(s, out / in, out, e);
    if (st == OK && (c->turned || c->sized || c->centred))
        st = chosen_grid(s, out, e);
    if (st == OK)
        st = maps_by_sky(s, e);
    if (st || c->sized)
        return st;
    st = grow(s, least, e);
    if (st || !(least[0] < 0 || least[1] < 0))
        return st;
    st = move_reference(&s->hdr, least);
    return st ? err_set(e, st, "output grid: %s", err_text(st)) : maps_by_sky(s, e);
}

static int grid_like(struct stack *s, struct err *e)
{
    struct fits_in *f;
    struct header h = {0};
    const char *name = s->choice.like;
    int st = fits_in_open(&f, name, s->choice.max_memory, e);
    if (st)
        return st;
    const int index = fits_in_selected(f);
    if (index < 0)
        st = err_set(e, E_DATA, "%s: no image in it", name);
    else
        st = fits_in_header(f, index, &h, e);
    if (st == OK) {
        s->nx = fits_in_hdu(f, index)->nx;
        s->ny = fits_in_hdu(f, index)->ny;
        exposure_remove_wcs(&s->hdr);
        st = exposure_copy_wcs(&s->hdr, &h);
        if (st)
            err_set(e, st, "%s: %s", name, err_text(st));
    }
    header_free(&h);
    fits_in_close(f);
    return st ? st : maps_by_sky(s, e);
}

/* ---- the frame of a list ---- */

/* The exposure that lies in the frame as it is, or NULL. */
static const struct shot *unmoved(const struct stack *s)
{
    for (size_t i = 0; i < s->n; i++) {
        const struct stack_shift *v = &s->shot[i].shift;
        if (fabs(v->dx) + fabs(v->dy) + fabs(v->rotation) + fabs(v->scale - 1) <= 0)
            return &s->shot[i];
    }
    return NULL;
}

/*
 * Pixel (1,1) of the frame is centred on output (1,1) before it grows.  Its
 * scale, and its WCS when that is plain, are those of the exposure that lies in it.
 * Where no scale is known the frame's pixel is the unit of choice.scale.
 */
static int frame_grid(struct stack *s, struct err *e)
{
    const struct shot *own = unmoved(s);
    const double frame = own ? own->x.scale : s->shot[0].x.scale / s->shot[0].shift.scale;
    const double known = isnan(frame) ? 1 : frame, out = isnan(s->choice.scale) ? known : s->choice.scale;
    const double ratio = known / out;
    double origin[2] = {0, 0}, least[2];
    exposure_remove_wcs(&s->hdr);
    int st = own && own->sky && sky_is_linear(own->sky) ? exposure_copy_wcs(&s->hdr, &own->x.hdr) : OK;
    set(&st, exposure_rescale_wcs(&s->hdr, 0, 0, out / known));
    if (st)
        return err_set(e, st, "output grid: %s", err_text(st));
    s->scale = isnan(frame) ? NAN : out;
    st = maps_by_list(s, ratio, origin, e);
    if (st == OK)
        st = grow(s, least, e);
    if (st || !(least[0] < 0 || least[1] < 0))
        return st;
    for (int k = 0; k < 2; k++)
        origin[k] = least[k] / ratio;
    st = move_reference(&s->hdr, least);
    return st ? err_set(e, st, "output grid: %s", err_text(st)) : maps_by_list(s, ratio, origin, e);
}

int stack_place(struct stack *s, struct err *e)
{
    int st = header_copy(&s->hdr, &s->shot[0].x.hdr);
    if (st)
        return err_set(e, st, "%s", err_text(st));
    if (s->choice.shifts)
        return frame_grid(s, e);
    return s->choice.like ? grid_like(s, e) : own_grid(s, e);
}
