/*
 * stackunits.c - units and weights of a stack, and the keywords of its image.
 */
#include "stack.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const char *const stack_kernel_name[] = {"square", "point", "turbo", "gaussian", "lanczos2", "lanczos3"};

static int by_area(const void *a, const void *b)
{
    const double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

/* The lower median, so that exposures of other scales do not decide; NaN without memory. */
static double median_area(const struct stack *s)
{
    double *v = malloc(s->n * sizeof *v);
    if (!v)
        return NAN;
    for (size_t i = 0; i < s->n; i++)
        v[i] = s->shot[i].area;
    qsort(v, s->n, sizeof *v, by_area);
    double m = v[(s->n - 1) / 2];
    free(v);
    return m;
}

/* AB magnitude of one unit per second; NaN when unknown. */
static double zero_point(const struct exposure *x)
{
    return x->unit == UNIT_RATE ? x->magzero : x->magzero - 2.5 * log10(x->exptime);
}

static int sky_is_off(const struct shot *t)
{
    int off;
    return header_bool(&t->x.hdr, "SKYSUB", &off) == OK && off;
}

/* 1 when every exposure tells its zero point; that of some is not that of the sum. */
static int all_have_zero_points(const struct stack *s)
{
    int all = 1;
    for (size_t i = 0; i < s->n; i++)
        all &= isfinite(s->shot[i].x.magzero) != 0;
    return all;
}

/* Exposures that are added must be in the same photometric system. */
static int check_alike(const struct stack *s, struct err *e)
{
    const struct shot *a = &s->shot[0];
    for (size_t i = 1; i < s->n; i++) {
        const struct shot *b = &s->shot[i];
        if (b->x.unit != a->x.unit)
            return err_set(e, E_DATA, "%s: BUNIT differs from that of %s", b->label, a->label);
        if (sky_is_off(b) != sky_is_off(a))
            return err_set(e, E_DATA, "%s: SKYSUB differs from that of %s: subtract the sky of both, or of none", b->label, a->label);
        if (fabs(zero_point(&b->x) - zero_point(&a->x)) > 1e-4)
            return err_set(e, E_DATA, "%s: MAGZERO less 2.5 log10(EXPTIME) is %.4f, that of %s %.4f: scale one of them",
                           b->label, zero_point(&b->x), a->label, zero_point(&a->x));
        if (fabs(b->x.gain - a->x.gain) > 1e-6 * a->x.gain)
            return err_set(e, E_DATA, "%s: GAIN %g, that of %s %g: scale one of them", b->label, b->x.gain, a->label, a->x.gain);
    }
    return OK;
}

int stack_units(struct stack *s, struct err *e)
{
    struct stack_choice *c = &s->choice;
    double times = 0, weights = 0;
    const int st = check_alike(s, e);
    if (st)
        return st;
    s->total = 0;
    for (size_t i = 0; i < s->n; i++)
        s->total += s->shot[i].x.exptime;              /* NaN when one is missing */
    if (c->units < 0)
        c->units = isnan(s->total) ? STACK_MEAN : STACK_TOTAL;
    if (isnan(s->total) && c->units != STACK_MEAN)
        return err_set(e, E_MISSING, "keyword EXPTIME is missing: --units mean needs none");
    const double area = median_area(s);
    if (isnan(area))
        return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    for (size_t i = 0; i < s->n; i++) {
        struct shot *t = &s->shot[i];
        const double time = t->x.unit == UNIT_RATE ? 1 : t->x.exptime;
        t->factor = c->units == STACK_MEAN ? area : c->units == STACK_RATE ? t->area / time : t->area * (s->total / time);
        t->w = c->weighting == WEIGHT_IVM ? 1 / (t->factor * t->factor)
             : c->weighting == WEIGHT_MAP || isnan(s->total) ? 1 : t->x.exptime;
        times += t->w * t->x.exptime;
        weights += t->w;
    }
    s->effective = times / weights;
    return OK;
}

/* ---- keywords ---- */

static void set(int *st, int now)
{
    if (*st == OK)
        *st = now;
}

/* Mean of a keyword of the exposures in units of the output; NaN when one lacks it. */
static double mean_level(const struct stack *s, const char *key)
{
    double sum = 0, weights = 0;
    for (size_t i = 0; i < s->n; i++) {
        const struct shot *t = &s->shot[i];
        sum += t->w * t->factor * header_double_or(&t->x.hdr, key, NAN);
        weights += t->w;
    }
    return sum / weights;
}

/* Pixels are independent where every drop falls on one of them alone. */
static double noise_factor(const struct stack *s)
{
    const struct stack_choice *c = &s->choice;
    int split = 0;
    for (size_t i = 0; i < s->n && !split; i++)
        split = drizzle_splits(c->kernel, c->pixfrac, &s->shot[i].map, s->shot[i].x.nx, s->shot[i].x.ny);
    return split ? drizzle_noise_factor(c->kernel, c->pixfrac, s->shot[0].map.scale) : 1;
}

const char *stack_weight_type(const struct stack *s)
{
    return s->choice.weighting == WEIGHT_IVM ? "IVM" : s->choice.weighting == WEIGHT_MAP ? "MAP"
         : isnan(s->total) ? "NUMBER" : "EXPTIME";
}

/*
 * Times, zero point and gain belong together: MAGZERO - 2.5 log10(EXPTIME) is
 * the magnitude of 1 unit per second in total and mean units, MAGZERO itself in a
 * rate; GAIN times the value is the number of electrons that make the noise.
 */
static int set_system(const struct stack *s, struct header *h)
{
    const struct exposure *x = &s->shot[0].x;
    const int rate_in = x->unit == UNIT_RATE, rate_out = s->choice.units == STACK_RATE || (rate_in && s->choice.units == STACK_MEAN);
    const double time = rate_out ? 1 : s->choice.units == STACK_MEAN ? s->effective : s->total;
    char unit[64], per_second[72];
    int st = OK;
    if (x->unit == UNIT_ELECTRON || rate_in) {
        set(&st, header_set_str(h, "BUNIT", rate_out ? "electron/s" : "electron", NULL));
    } else if (rate_out && header_str(h, "BUNIT", unit, sizeof unit) == OK && unit[0]) {
        snprintf(per_second, sizeof per_second, "%s/s", unit);
        set(&st, header_set_str(h, "BUNIT", per_second, NULL));
    }
    if (!all_have_zero_points(s))
        header_remove(h, "MAGZERO");
    if (isnan(s->total))
        return st;
    set(&st, header_set_double(h, "EXPTIME", rate_out ? s->total : time, "exposure time, s"));
    set(&st, header_set_double(h, "TOTTIME", s->total, "time of all exposures together, s"));
    set(&st, header_set_double(h, "GAIN", header_double_or(h, "GAIN", 1) * (s->total / time), "electron per BUNIT"));
    if (all_have_zero_points(s))
        set(&st, header_set_double(h, "MAGZERO", zero_point(x) + 2.5 * log10(time), "AB magnitude of 1 BUNIT"));
    return st;
}

/* Key of the noise: that of all exposures, else the sum of theirs, which no order changes; none where one is missing. */
static int set_noise_key(const struct stack *s, struct header *h)
{
    unsigned long long sum = 0, first = 0;
    char text[32];
    int same = 1;
    for (size_t i = 0; i < s->n; i++) {
        if (header_str(&s->shot[i].x.hdr, "NOISSEED", text, sizeof text)) {
            header_remove(h, "NOISSEED");
            return OK;
        }
        const unsigned long long key = strtoull(text, NULL, 10);
        first = i ? first : key;
        same &= key == first;
        sum += key;
    }
    if (same)
        return OK;
    snprintf(text, sizeof text, "%llu", sum);
    return header_set_str(h, "NOISSEED", text, "sum of the seeds of the exposures' noise");
}

int stack_describe(struct stack *s, const char *record, struct err *e)
{
    static const char *const gone[] = {"DITHERX", "DITHERY", "EXPNUM", "EXTNAME", "EXTVER", "SKYLEVEL", "SATURATE"};
    struct header *h = &s->hdr;
    const double level = mean_level(s, "SKYLEVEL"), full = mean_level(s, "SATURATE");
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++)
        header_remove(h, gone[i]);
    int st = set_system(s, h);
    set(&st, set_noise_key(s, h));
    if (!isnan(level))
        set(&st, header_set_double(h, "SKYLEVEL", level, "mean sky and dark per pixel, BUNIT"));
    if (!isnan(full))
        set(&st, header_set_double(h, "SATURATE", full, "saturation level, BUNIT"));
    if (isnan(s->scale))
        header_remove(h, "PIXSCALE");
    else
        set(&st, header_set_double(h, "PIXSCALE", s->scale, "arcsec per pixel"));
    set(&st, header_set_double(h, "PIXFRAC", s->choice.pixfrac, "side of a drop, input pixels"));
    set(&st, header_set_str(h, "KERNEL", stack_kernel_name[s->choice.kernel], "shape of a drop"));
    set(&st, header_set_str(h, "WHTTYPE", stack_weight_type(s), "unit of the weight"));
    set(&st, header_set_long(h, "NCOMBINE", (long)s->n, "exposures"));
    set(&st, header_set_double(h, "NOISECOR", noise_factor(s), "noise of large areas over that of pixels"));
    set(&st, header_history(h, record));
    return st ? err_set(e, st, "header: %s", err_text(st)) : OK;
}
