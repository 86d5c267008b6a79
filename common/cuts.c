/* cuts.c - which objects of a shape catalogue are used. */
#include "cuts.h"
#include <math.h>
#include <stdlib.h>

double cuts_size(const struct cuts *c, double dstar)
{
    return c->factor * sqrt(dstar * dstar + c->floor);
}

/* A column of numbers, or E_MISSING with its name. */
static int need(const struct table *t, const char *name, const char *why, const struct column **c, struct err *e)
{
    *c = table_find(t, name);
    if (!*c || (*c)->type == COL_TEXT || (*c)->type == COL_RAGGED)
        return err_set(e, E_MISSING, "no column of numbers %s%s", name, why);
    return OK;
}

struct used {
    const struct column *prob, *mag, *e1, *e2, *d, *dpsf, *width, *flags, *flux, *err;
};

static int find_columns(const struct table *t, const struct cuts *c, struct used *u, struct err *e)
{
    const char *shape = ": measure shapes with rrgshape first", *flux = ": needed for the cut in signal to noise";
    *u = (struct used){.prob = table_find(t, "STAR_PROB"), .flags = table_find(t, "FLAGS_RRG")};
    int st = need(t, "E1", shape, &u->e1, e);
    if (st == OK)
        st = need(t, "E2", shape, &u->e2, e);
    if (st == OK)
        st = need(t, "D_RRG", shape, &u->d, e);
    const int own = c->which == DSTAR_EACH || c->locus_width > 0;
    if (st == OK && c->locus_width > 0)
        st = need(t, "MAG_AUTO", ": needed for the locus of the stars", &u->mag, e);
    if (st == OK && own)
        st = c->stars ? need(t, "WIDTH", shape, &u->width, e) : need(t, "D_PSF", shape, &u->dpsf, e);
    if (st == OK && c->snr > 0)
        st = need(t, "FLUX_AUTO", flux, &u->flux, e);
    if (st == OK && c->snr > 0)
        st = need(t, "FLUXERR_AUTO", flux, &u->err, e);
    return st;
}

/* Size of a star under the weight of this object. */
static double own_size(const struct cuts *c, const struct used *u, size_t row)
{
    struct rrg_psf p;
    if (!c->stars)
        return table_number(u->dpsf, row);
    starmom_at(c->stars, table_number(u->width, row), &p);
    return sqrt(0.5 * (p.m2[0] + p.m2[2]));
}

static double star_size(const struct cuts *c, const struct used *u, size_t row)
{
    return c->which == DSTAR_EACH ? own_size(c, u, row) : c->dstar;
}

/* By its class, or by its place in the plane of size and magnitude. */
static int is_star(const struct cuts *c, const struct used *u, size_t i, double d)
{
    if (u->prob && table_number(u->prob, i) > c->star_prob)
        return 1;
    return c->locus_width > 0 && table_number(u->mag, i) < c->locus_mag &&
           fabs(d / own_size(c, u, i) - 1) < c->locus_width;
}

static int64_t row_bits(const struct cuts *c, const struct used *u, size_t i)
{
    int64_t bits = 0;
    double d = table_number(u->d, i), e = hypot(table_number(u->e1, i), table_number(u->e2, i));
    long flags = u->flags ? (long)table_number(u->flags, i) : 0;
    if (is_star(c, u, i, d))
        bits |= CUT_STAR;
    if (!(e < c->max_e))
        bits |= CUT_ELLIPTICITY;
    if (!(d >= cuts_size(c, star_size(c, u, i))) || !(d < c->sentinel) || (flags & c->flags))
        bits |= CUT_SIZE;
    if (c->snr > 0 && !(table_number(u->flux, i) / table_number(u->err, i) >= c->snr))
        bits |= CUT_SNR;
    return bits;
}

int cuts_apply(const struct table *t, const struct cuts *c, size_t n_where, const struct expr *where,
               int64_t *bits, struct cut_count *count, struct err *e)
{
    struct used u = {0};
    int st = c->only_where ? OK : find_columns(t, c, &u, e);
    if (st)
        return st;
    if (!c->only_where && c->which != DSTAR_EACH && !(c->dstar >= 0))
        return err_set(e, E_MISSING, "no size of the stars: give --stars FILE");
    const struct column **col = malloc((n_where * EXPR_NODES + 1) * sizeof *col);
    if (!col)
        return err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    for (size_t k = 0; k < n_where && st == OK; k++)
        st = expr_bind(&where[k], t, col + k * EXPR_NODES, e);
    struct cut_count n = {.all = t->nrow};
    for (size_t i = 0; i < t->nrow && st == OK; i++) {
        int64_t b = c->only_where ? 0 : row_bits(c, &u, i);
        for (size_t k = 0; k < n_where; k++)
            if (!expr_holds(&where[k], col + k * EXPR_NODES, i))
                b |= CUT_WHERE;
        bits[i] = b;
        n.stars += !(b & CUT_STAR);
        n.ellipticity += !(b & (CUT_STAR | CUT_ELLIPTICITY));
        n.size += !(b & (CUT_STAR | CUT_ELLIPTICITY | CUT_SIZE));
        n.snr += !(b & (CUT_STAR | CUT_ELLIPTICITY | CUT_SIZE | CUT_SNR));
        n.where += b == 0;
    }
    free(col);
    if (st == OK)
        *count = n;
    return st;
}
