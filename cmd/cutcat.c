/* cutcat.c - keep the objects that are used, and count what each cut removes. */
#include "catkeys.h"
#include "cuts.h"
#include "err.h"
#include "opt.h"
#include "shapecat.h"
#include "tableio.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct params {
    const char *stars, *columns;
    double locus[2];
    int which, mark;
    struct opt_strs where;
};

static void check(int st, const char *what)
{
    if (st)
        die(EXIT_RUN, "%s: %s", what, err_text(st));
}

static double key_or_nan(const struct table *t, const char *file, const char *key)
{
    double v;
    struct err e;
    if (catkeys_number(t, key, &v, &e))
        die(EXIT_RUN, "%s: %s", file, e.text);
    return v;
}

/* Sizes are in pixels: both files must mean the same ones (or neither say what they are). */
static void check_scale(const char *name, const struct table *stars, const char *cat_name, const struct table *cat)
{
    const double ours = key_or_nan(cat, cat_name, "PIXSCALE"), theirs = key_or_nan(stars, name, "PIXSCALE");
    if (isnan(ours) && isnan(theirs))
        return;
    if (isnan(ours) || isnan(theirs))
        die(EXIT_RUN, "%s: no keyword PIXSCALE in the %s to compare with the other file's %g", name, isnan(ours) ? "catalogue" : "star file",
            isnan(ours) ? theirs : ours);
    if (!(fabs(theirs / ours - 1) <= 1e-6))
        die(EXIT_RUN, "%s: stars for pixels of %g arcsec, but the catalogue has %g", name, theirs, ours);
}

/* d* in pixels from the star-moment file, else from the catalogue's own keywords. */
static void find_dstar(struct cuts *c, struct starmom *stars, const struct params *p, const char *name, const struct table *cat,
                       double max_memory)
{
    const char *key = p->which == DSTAR_OWN ? "DSTAROWN" : "DSTAR";
    struct err e;
    c->which = (enum dstar)p->which;
    c->dstar = key_or_nan(cat, name, key);
    if (!p->stars)
        return;
    struct table t = {0};
    if (table_read(&t, p->stars, max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    check_scale(p->stars, &t, name, cat);
    if (p->which == DSTAR_EACH || c->locus_width > 0) {
        if (starmom_from_table(stars, &t, &e))
            die(EXIT_RUN, "%s: %s", p->stars, e.text);
        c->stars = stars;
    }
    if (p->which != DSTAR_EACH) {
        c->dstar = key_or_nan(&t, p->stars, key);
        if (!(c->dstar > 0))
            die(EXIT_RUN, "%s: no keyword %s: make the file with rrgshape --stars-only", p->stars, key);
    }
    table_free(&t);
}

static struct expr *parse_where(const struct opt_strs *list)
{
    struct err e;
    struct expr *w = calloc(list->n + 1, sizeof *w);
    if (!w)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (size_t i = 0; i < list->n; i++)
        if (expr_parse(&w[i], list->v[i], &e))
            die(EXIT_USAGE, "--where %s", e.text);
    return w;
}

static void set_keywords(struct table *t, const char *file, const struct cuts *c, const struct cut_count *n)
{
    const struct { const char *name; double v; } key[] = {
        {"NDET", (double)n->all}, {"NSTARCUT", (double)n->stars}, {"NELLCUT", (double)n->ellipticity},
        {"NSIZECUT", (double)n->size}, {"NSNRCUT", (double)n->snr}, {"NUSED", (double)n->where}};
    const int again = isfinite(key_or_nan(t, file, "NUSED"));    /* NDET stays the detector's count */
    for (size_t k = again ? 1 : 0; k < sizeof key / sizeof *key; k++)
        check(table_set_number(t, key[k].name, key[k].v), key[k].name);
    if (c->which == DSTAR_EACH)
        return;
    check(table_set_number(t, "DSTAR", c->dstar), "DSTAR");
    check(table_set_number(t, "DCUT", cuts_size(c, c->dstar)), "DCUT");
}

static void tell(const char *name, const struct cut_count *n, int only_where)
{
    if (only_where) {
        warn("%s: %zu objects, %zu used", name, n->all, n->where);
        return;
    }
    warn("%s: %zu objects, %zu without stars, %zu below the ellipticity, %zu above the size, "
         "%zu above the signal to noise, %zu used", name, n->all, n->stars, n->ellipticity, n->size, n->snr, n->where);
}

/* Column CUT of all rows, or only the rows that are used. */
static void keep_rows(struct table *t, const int64_t *bits, int mark)
{
    if (mark) {
        int64_t *cut = table_ints(t, "CUT");
        if (!cut)
            die(EXIT_RUN, "column CUT is not of whole numbers");
        memcpy(cut, bits, t->nrow * sizeof *cut);
        return;
    }
    unsigned char *keep = malloc(t->nrow + 1);
    if (!keep)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (size_t i = 0; i < t->nrow; i++)
        keep[i] = bits[i] == 0;
    check(table_keep(t, keep), "rows");
    free(keep);
}

/* What is written of t: the columns of a list "NAME,NAME..." and, when marked, CUT; NULL: all.  Columns are shared. */
static void choose_columns(struct table *view, const struct table *t, const char *list, int mark)
{
    unsigned char *keep = calloc(t->ncol + 1, 1);
    struct column *col = malloc((t->ncol + 1) * sizeof *col);
    if (!keep || !col)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (const char *p = list ? list : ""; *p;) {
        size_t len = strcspn(p, ","), k = 0;
        while (k < t->ncol && !(strlen(t->col[k].name) == len && memcmp(t->col[k].name, p, len) == 0))
            k++;
        if (k == t->ncol)
            die(EXIT_RUN, "--columns: the catalogue has no column %.*s", (int)len, p);
        keep[k] = 1;
        p += len + (p[len] == ',');
    }
    free(view->col);
    *view = *t;
    view->col = col;
    view->ncol = 0;
    for (size_t k = 0; k < t->ncol; k++)
        if (!list || keep[k] || (mark && strcmp(t->col[k].name, "CUT") == 0))
            col[view->ncol++] = t->col[k];
    free(keep);
}

static void add_counts(struct cut_count *n, const struct cut_count *more)
{
    n->all += more->all;
    n->stars += more->stars;
    n->ellipticity += more->ellipticity;
    n->size += more->size;
    n->snr += more->snr;
    n->where += more->where;
}

/* Cut the catalogue block by block (out NULL: only count); t is its header. */
static void cut_all(struct table_in *in, struct table *t, const struct cuts *c, const struct expr *where, const struct params *p,
                    const char *name, struct table_out *out, struct cut_count *n)
{
    const size_t rows = table_block_rows(t);
    int64_t *bits = malloc(rows * sizeof *bits);
    struct table view = {0};
    struct cut_count more;
    struct err e;
    if (!bits)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    do {
        if (table_in_rows(in, t, rows, &e))
            die(EXIT_RUN, "%s", e.text);
        if (cuts_apply(t, c, p->where.n, where, bits, &more, &e))
            die(EXIT_RUN, "%s: %s", name, e.text);
        add_counts(n, &more);
        if (!out)
            continue;
        keep_rows(t, bits, p->mark);
        choose_columns(&view, t, p->columns, p->mark);
        if (table_out_rows(out, &view, &e))
            die(EXIT_RUN, "%s", e.text);
    } while (more.all == rows);
    free(view.col);
    free(bits);
}

/* --only-where switches every other cut off: one that was asked for must not be lost without a word. */
static void check_only_where(const struct opt *own, const struct common *c)
{
    static const char *const cut[] = {"stars", "dstar", "star-prob", "star-locus", "max-ellipticity", "size-factor", "size-floor", "snr", "flags"};
    for (size_t i = 0; i < sizeof cut / sizeof cut[0]; i++)
        if (opt_given(own, c, cut[i]))
            die(EXIT_USAGE, "--only-where and --%s: give the cut as --where, or leave --only-where out", cut[i]);
}

/* The catalogue's own stars and flags are cut where it tells them; asked for, they must be there. */
static void check_asked(const struct table *t, const char *name, const struct cuts *cuts, const struct opt *own, const struct common *c)
{
    const struct { const char *option, *column; int cuts; } need[] = {{"star-prob", "STAR_PROB", cuts->star_prob < 1},
                                                                     {"flags", "FLAGS_RRG", cuts->flags != 0}};
    for (int i = 0; i < 2; i++)
        if (need[i].cuts && opt_given(own, c, need[i].option) && !table_find(t, need[i].column))
            die(EXIT_RUN, "%s: no column %s: --%s cannot cut", name, need[i].column, need[i].option);
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct params p = {0};
    struct cuts cuts = CUTS_DEFAULTS;
    const struct program prog = {
        "cutcat", "keep the objects of a shape catalogue that are used, and count what each cut removes",
        "[CATALOGUE]", 0, 1,
        "  cutcat image.shapes --stars stars.rrg -o image.use\n"
        "  cutcat image.shapes --size-floor 0 --where 'MAG_AUTO<26 && MASKED<0.01' --mark -o image.marked", OUT_TABLE};
    const struct opt own[] = {
        {"stars", 0, OPT_STR, &p.stars, 0, 0, "FILE", "star-moment file with DSTAR (default: keywords of the catalogue)", NULL, 1},
        {"dstar", 0, OPT_CHOICE, &p.which, 0, 0, "HOW", "size of a star: smallest width, its own width, each object's width", "min|own|each", 0},
        {"star-prob", 0, OPT_REAL, &cuts.star_prob, 0, 1, "P", "an object with STAR_PROB above is a star (1: no cut)", NULL, 0},
        {"star-locus", 0, OPT_PAIR, p.locus, 0, 60, "MAG,F", "one brighter than MAG with the size of a star to the fraction F is a star too", NULL, 0},
        {"max-ellipticity", 'e', OPT_REAL, &cuts.max_e, 0, 1e9, "E", "keep |e| < E", NULL, 0},
        {"size-factor", 0, OPT_REAL, &cuts.factor, 0, 1e3, "F", "keep d >= F sqrt(d*^2 + FLOOR)", NULL, 0},
        {"size-floor", 0, OPT_REAL, &cuts.floor, 0, 1e6, "PX2", "the floor in the size cut, pixel^2", NULL, 0},
        {"snr", 0, OPT_REAL, &cuts.snr, 0, 1e9, "MIN", "keep FLUX_AUTO/FLUXERR_AUTO >= MIN (0: no cut)", NULL, 0},
        {"flags", 0, OPT_LONG, &cuts.flags, 0, 511, "MASK", "FLAGS_RRG with one of these bits fails the size cut", NULL, 0},
        {"where", 0, OPT_STRS, &p.where, 0, 0, "EXPR", "keep where EXPR holds: columns, + - * / ^ &, < <= > >= = !=, && || !; repeatable", NULL, 0},
        {"only-where", 0, OPT_FLAG, &cuts.only_where, 0, 0, NULL, "no other cut: for catalogues of any kind", NULL, 0},
        {"columns", 0, OPT_STR, &p.columns, 0, 0, "LIST", "write these columns only: NAME,NAME...", NULL, 0},
        {"mark", 0, OPT_FLAG, &p.mark, 0, 0, NULL, "keep all rows and add the column CUT", NULL, 0},
        {0}};
    opt_parse(&prog, own, &c, argc, argv);
    if (cuts.only_where)
        check_only_where(own, &c);

    struct err e;
    struct table t = {0}, head = {0};          /* what is read, and what of it is written */
    struct table_in *in;
    struct table_out *out = NULL;
    struct starmom stars;
    struct cut_count n = {0};
    struct expr *where = parse_where(&p.where);
    if (table_in_open(&in, &t, c.argv[0], c.max_memory, &e))
        die(EXIT_RUN, "%s", e.text);
    check_asked(&t, c.argv[0], &cuts, own, &c);
    cuts.locus_mag = p.locus[0];
    cuts.locus_width = p.locus[1];
    if (!cuts.only_where)
        find_dstar(&cuts, &stars, &p, c.argv[0], &t, c.max_memory);
    const char *inputs[] = {c.argv[0], p.stars};
    char *record = opt_record(&prog, own, &c);
    if (p.mark && !c.check && !table_find(&t, "CUT"))
        check(table_add(&t, "CUT", COL_INT, "", "cuts failed, see cutcat(1)"), "CUT");
    if (!c.check) {
        choose_columns(&head, &t, p.columns, p.mark);
        if (table_out_open(&out, c.out, inputs, p.stars ? 2 : 1, &e) ||
            (cuts.only_where && table_out_begin(out, &head, record, &e)))      /* else the counts come into the header */
            die(EXIT_RUN, "%s", e.text);
    }
    cut_all(in, &t, &cuts, where, &p, c.argv[0], out, &n);
    table_in_close(in);
    if (c.verbose || c.check)
        tell(c.argv[0], &n, cuts.only_where);
    if (out) {
        if (!cuts.only_where)
            set_keywords(&t, c.argv[0], &cuts, &n);
        choose_columns(&head, &t, p.columns, p.mark);
        if (table_out_end(out, &head, record, &e))
            die(EXIT_RUN, "%s", e.text);
    }
    free(record);
    free(head.col);
    free(where);
    table_free(&t);
    opt_free(own);
    return EXIT_DONE;
}
