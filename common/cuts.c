/* cuts.c - which objects of a shape catalogue are used. */
#include "cuts.h"
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

int cut_parse(struct cut_where *w, const char *text, struct err *e)
{
    size_t n = strcspn(text, "<>=!");
    size_t name = n;
    while (name > 0 && isspace((unsigned char)text[name - 1]))
        name--;
    if (name == 0 || name >= sizeof w->name || strcspn(text, " \t") < name)
        return err_set(e, E_DATA, "'%s': no column name: write NAME<VALUE", text);
    if (!text[n])
        return err_set(e, E_DATA, "'%s': no comparison: one of < <= > >= = !=", text);
    int op = text[n++];
    if (text[n] == '=') {
        op = op == '<' ? 'l' : op == '>' ? 'g' : op;
        n++;
    } else if (op == '!') {
        return err_set(e, E_DATA, "'%s': write != for not equal", text);
    }
    while (isspace((unsigned char)text[n]))
        n++;
    const char *value = text + n;
    size_t len = strlen(value);
    if (len == 0 || len >= sizeof w->text || strpbrk(value, " \t<>=!"))
        return err_set(e, E_DATA, "'%s': no value after the comparison", text);
    char *end;
    double v = strtod(value, &end);
    int number = *end == '\0' && isfinite(v) && !strpbrk(value, "xXpP");
    if (!number && op != '=' && op != '!')
        return err_set(e, E_DATA, "'%s': '%s' is not a number", text, value);
    memset(w, 0, sizeof *w);
    memcpy(w->name, text, name);
    memcpy(w->text, value, len);
    w->op = op;
    w->value = number ? v : NAN;
    return OK;
}

double cuts_size(const struct cuts *c, double dstar)
{
    return c->factor * sqrt(dstar * dstar + c->floor);
}

static int compare(double v, int op, double with)
{
    switch (op) {
    case '<': return v < with;
    case '>': return v > with;
    case 'l': return v <= with;
    case 'g': return v >= with;
    case '=': return v == with;
    default: return v < with || v > with;      /* != : a missing value fails too */
    }
}

static int where_holds(const struct cut_where *w, const struct column *c, size_t row)
{
    if (c->type == COL_TEXT) {
        int equal = strcmp(c->v.s[row], w->text) == 0;
        return w->op == '=' ? equal : !equal;
    }
    return compare(table_number(c, row), w->op, w->value);
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

int cuts_apply(const struct table *t, const struct cuts *c, size_t n_where, const struct cut_where *where,
               int64_t *bits, struct cut_count *count, struct err *e)
{
    struct used u = {0};
    int st = c->only_where ? OK : find_columns(t, c, &u, e);
    if (st)
        return st;
    if (!c->only_where && c->which != DSTAR_EACH && !(c->dstar >= 0))
        return err_set(e, E_MISSING, "no size of the stars: give --stars FILE");
    for (size_t k = 0; k < n_where; k++) {
        const struct column *col = table_find(t, where[k].name);
        if (!col || col->type == COL_RAGGED)
            return err_set(e, E_MISSING, "no column %s", where[k].name);
        if (col->type == COL_TEXT ? where[k].op != '=' && where[k].op != '!' : isnan(where[k].value))
            return err_set(e, E_DATA, "column %s cannot be compared with '%s'", where[k].name, where[k].text);
    }
    struct cut_count n = {.all = t->nrow};
    for (size_t i = 0; i < t->nrow; i++) {
        int64_t b = c->only_where ? 0 : row_bits(c, &u, i);
        for (size_t k = 0; k < n_where; k++)
            if (!where_holds(&where[k], table_find(t, where[k].name), i))
                b |= CUT_WHERE;
        bits[i] = b;
        n.stars += !(b & CUT_STAR);
        n.ellipticity += !(b & (CUT_STAR | CUT_ELLIPTICITY));
        n.size += !(b & (CUT_STAR | CUT_ELLIPTICITY | CUT_SIZE));
        n.snr += !(b & (CUT_STAR | CUT_ELLIPTICITY | CUT_SIZE | CUT_SNR));
        n.where += b == 0;
    }
    *count = n;
    return OK;
}
