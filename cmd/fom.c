/* fom.c - figures of merit of surveys from their shape catalogues. */
#include "err.h"
#include "fom.h"
#include "opt.h"
#include "outfile.h"
#include "tableio.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static void check(int st, const char *what)
{
    if (st)
        die(EXIT_RUN, "%s: %s", what, err_text(st));
}

/* --bins NAME:EDGE,EDGE,...: bin k is edge[k] <= value < edge[k + 1]. */
struct bins {
    char key[64];
    size_t n;                 /* 0: no bins */
    double edge[64];
};

static void parse_bins(struct bins *b, const char *text)
{
    size_t len = strcspn(text, ":");
    if (!text[len] || len == 0 || len >= sizeof b->key)
        die(EXIT_USAGE, "--bins '%s': write NAME:EDGE,EDGE,...", text);
    memcpy(b->key, text, len);
    size_t n = 0;
    for (const char *p = text + len; *p;) {
        size_t width = strcspn(++p, ",");
        if (n == sizeof b->edge / sizeof *b->edge)
            die(EXIT_USAGE, "--bins '%s': more than 64 edges", text);
        if (table_scan_real(p, width, &b->edge[n]) != OK || (n > 0 && !(b->edge[n] > b->edge[n - 1])) || !isfinite(b->edge[n]))
            die(EXIT_USAGE, "--bins '%s': edges must be rising numbers", text);
        n++;
        p += width;
    }
    if (n < 2)
        die(EXIT_USAGE, "--bins '%s': at least two edges", text);
    b->n = n - 1;
}

/* A catalogue given twice would count twice. */
static void check_files(const struct common *c)
{
    struct stat *s = calloc((size_t)c->argc + 1, sizeof *s);
    if (!s)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (int i = 0; i < c->argc; i++) {
        if (strcmp(c->argv[i], "-") == 0 || stat(c->argv[i], &s[i]))
            continue;
        for (int k = 0; k < i && S_ISREG(s[i].st_mode); k++)
            if (s[k].st_ino == s[i].st_ino && s[k].st_dev == s[i].st_dev)
                die(EXIT_USAGE, "%s: given twice (%s): it would count twice", c->argv[i], c->argv[k]);
    }
    free(s);
}

/* Read the catalogues block by block and keep what is needed. */
static struct fom_image *read_all(const struct common *c, const char *key, int psf)
{
    struct err e;
    struct fom_image *im = calloc((size_t)c->argc + 1, sizeof *im);
    if (!im)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    double held = 0;
    for (int i = 0; i < c->argc; i++) {
        struct table t = {0};
        struct table_in *in;
        if (table_in_open(&in, &t, c->argv[i], c->max_memory, &e))
            die(EXIT_RUN, "%s", e.text);
        if (fom_image_read(&im[i], in, &t, c->argv[i], key, c->max_memory - held, &e))
            die(EXIT_RUN, "%s", e.text);
        table_in_close(in);
        held += (double)im[i].n * sizeof *im[i].object;
        if (psf && !(isfinite(im[i].epsf[0]) && isfinite(im[i].epsf[1])))
            die(EXIT_RUN, "%s: no keywords EPSF1 EPSF2: correct the shapes for a PSF with rrgshape", c->argv[i]);
        table_free(&t);
    }
    return im;
}

static int same_group(const struct fom_image *a, const struct fom_image *b)
{
    return strcmp(a->set, b->set) == 0 && fabs(a->scale - b->scale) < 1e-9;
}

static int by_set_and_scale(const void *a, const void *b)
{
    const struct fom_result *p = a, *q = b;
    int c = strcmp(p->set, q->set);
    c = c ? c : p->scale < q->scale ? -1 : p->scale > q->scale;
    return c ? c : p->lo < q->lo ? -1 : p->lo > q->lo;
}

/* One result per bin of one group. */
static void group_bins(size_t m, const struct fom_image **member, struct fom_image *im, size_t n, const struct bins *b,
                       const struct fom_options *o, struct fom_result *r)
{
    for (size_t k = 0; k < (b->n ? b->n : 1); k++) {
        for (size_t i = 0; i < n && b->n; i++)
            fom_image_bin(&im[i], b->edge[k], b->edge[k + 1]);
        check(fom_group(m, member, o, &r[k]), member[0]->set);
        r[k].lo = b->n ? b->edge[k] : NAN;
        r[k].hi = b->n ? b->edge[k + 1] : NAN;
    }
}

/* One result per (SETNAME, CCDSCALE) and bin, sorted; returns how many. */
static size_t group_all(size_t n, struct fom_image *im, const struct bins *b, const struct fom_options *o, struct fom_result *r)
{
    const struct fom_image **member = calloc(n + 1, sizeof *member);
    size_t groups = 0;
    if (!member)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    for (size_t i = 0; i < n; i++) {
        size_t j = 0, m = 0;
        while (j < i && !same_group(&im[j], &im[i]))
            j++;
        if (j < i)
            continue;
        for (j = i; j < n; j++)
            if (same_group(&im[j], &im[i]))
                member[m++] = &im[j];
        group_bins(m, member, im, n, b, o, &r[groups]);
        groups += b->n ? b->n : 1;
    }
    free(member);
    qsort(r, groups, sizeof *r, by_set_and_scale);
    return groups;
}

/* Empty catalogues, and what could not be had, in one line a group. */
static void tell_undefined(const struct common *c, const struct fom_image *im, size_t n, const struct fom_result *r)
{
    for (int i = 0; i < c->argc; i++)
        if (fom_image_used(&im[i]) == 0)
            warn("%s: no galaxy is left in this catalogue", c->argv[i]);
    static const int asked[] = {FOM_N_GAL, FOM_G, FOM_B1, FOM_B2, FOM_BP1, FOM_BP2, FOM_SIGMA, FOM_LOGDC};
    for (size_t i = 0; i < n; i++) {
        char list[256] = "";
        for (size_t k = 0; k < sizeof asked / sizeof *asked; k++)
            if (!isfinite(r[i].v[asked[k]]))
                snprintf(list + strlen(list), sizeof list - strlen(list), " %s", fom_column[asked[k]].name);
        if (*list && !isnan(r[i].lo))
            warn("%s %g, bin %g to %g: undefined (too few objects, shears or keywords):%s", r[i].set, r[i].scale, r[i].lo, r[i].hi, list);
        else if (*list)
            warn("%s %g: undefined (too few objects, shears or keywords):%s", r[i].set, r[i].scale, list);
    }
}

/* "1.234 +- 0.056", or the word. */
static const char *number(char to[32], double v, double err, int digits)
{
    if (!isfinite(v))
        snprintf(to, 32, "undefined");
    else if (err != err || err < 0)
        snprintf(to, 32, "%.*f", digits, v);
    else
        snprintf(to, 32, "%.*f +- %.*f", digits, v, digits, err);
    return to;
}

/* The aligned table for people. */
static void write_text(const struct common *c, size_t n, const struct fom_result *r)
{
    static const struct { const char *head; int value, err, digits; } col[] = {
        {"n_gal /arcmin2", FOM_N_GAL, FOM_N_GALERR, 1}, {"n_eff", FOM_N_EFF, -1, 1}, {"G", FOM_G, -1, 3},
        {"slope 1 (fit)", FOM_B1, FOM_B1SE, 3}, {"slope 2 (fit)", FOM_B2, FOM_B2SE, 3},
        {"slope 1 (pairs)", FOM_BP1, FOM_BP1SE, 4}, {"slope 2 (pairs)", FOM_BP2, FOM_BP2SE, 4},
        {"selection 1", FOM_SEL1, FOM_SEL1SE, 3}, {"total m 1", FOM_TOT1, FOM_TOT1SE, 3},
        {"sigma_gamma", FOM_SIGMA, FOM_SIGMAERR, 4}, {"error arcmin", FOM_STDERR, FOM_STDERRERR, 4},
        {"kurtosis 1", FOM_KURT1, FOM_KURT1ERR, 2}, {"log10 dC_l", FOM_LOGDC, FOM_LOGDCERR, 3}, {"best scale", FOM_OPT, FOM_OPTERR, 4}};
    enum { COLS = sizeof col / sizeof *col };
    struct err e;
    struct outfile *f;
    char line[1024], cell[32];
    if (outfile_open(&f, c->out, c->argv, (size_t)c->argc, &e))
        die(EXIT_RUN, "%s", e.text);
    int binned = n > 0 && !isnan(r[0].lo), len = snprintf(line, sizeof line, "%-10s %6s", "set", "scale");
    if (binned)
        len += snprintf(line + len, sizeof line - (size_t)len, "  %17s", "bin");
    for (int k = 0; k < COLS; k++)
        len += snprintf(line + len, sizeof line - (size_t)len, "  %17s", col[k].head);
    check(outfile_write(f, line, (size_t)len), c->out);
    for (size_t i = 0; i < n; i++) {
        len = snprintf(line, sizeof line, "\n%-10.32s %6.3f", r[i].set, r[i].scale);
        if (binned)
            len += snprintf(line + len, sizeof line - (size_t)len, "  %8g %8g", r[i].lo, r[i].hi);
        for (int k = 0; k < COLS; k++)
            len += snprintf(line + len, sizeof line - (size_t)len, "  %17s",
                            number(cell, r[i].v[col[k].value], col[k].err < 0 ? NAN : r[i].v[col[k].err], col[k].digits));
        check(outfile_write(f, line, (size_t)len), c->out);
    }
    check(outfile_write(f, "\n", 1), c->out);
    if (outfile_commit(f, &e))
        die(EXIT_RUN, "%s", e.text);
}

/* A reference that is asked for must be there. */
static void check_reference(const struct fom_options *o, size_t n, const struct fom_result *r)
{
    size_t i = 0;
    while (i < n && o->ref_set && strcmp(r[i].set, o->ref_set) != 0)
        i++;
    if (n > 0 && o->ref_set && i == n)
        die(EXIT_RUN, "--reference-set %s: no catalogue has this SETNAME (the first has %s)", o->ref_set, r[0].set);
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct fom_options o = {.radius = 0.15, .draws = 200, .ref_scale = 0.10};
    struct bins bins = {0};
    const char *bin_text = NULL;
    int text = 0, against = 0;
    const struct program prog = {
        "fom", "figures of merit: number density, bias of the shear, its spread, error of the power spectrum",
        "[CATALOGUE...]", 0, -1,
        "  fom sim1-*.use --reference-set sim1 --reference-scale 0.10 -o fom.cat\n"
        "  fom --table sim1-0.10-*.use", OUT_TABLE};
    const struct opt own[] = {
        {"reference-scale", 0, OPT_REAL, &o.ref_scale, 1e-6, 1e4, "ARCSEC", "power spectrum errors are divided by that of this scale", NULL, 0},
        {"reference-set", 0, OPT_STR, &o.ref_set, 0, 0, "NAME", "and of this set (default: the first that has the scale)", NULL, 0},
        {"match-radius", 'r', OPT_REAL, &o.radius, 1e-6, 1e4, "ARCSEC", "largest distance of common objects", NULL, 0},
        {"median", 0, OPT_FLAG, &o.median, 0, 0, NULL, "median instead of mean response", NULL, 0},
        {"fit-line", 0, OPT_FLAG, &o.fit_line, 0, 0, NULL, "correct sigma with the slopes of the fits, not of the pairs", NULL, 0},
        {"bins", 'b', OPT_STR, &bin_text, 0, 0, "NAME:LIST", "a row for each bin of a column, SNR, SIZE or DISTANCE between the edges of the list", NULL, 0},
        {"bins-everywhere", 0, OPT_FLAG, &o.everywhere, 0, 0, NULL, "common objects must be in the bin in every image, not only the unsheared one", NULL, 0},
        {"against", 0, OPT_CHOICE, &against, 0, 0, "WHAT", "slopes against the shear, or the ellipticity of the PSF (leakage)", "shear|psf", 0},
        {"draws", 0, OPT_LONG, &o.draws, 0, 100000, "N", "bootstrap resamplings", NULL, 0},
        {"table", 't', OPT_FLAG, &text, 0, 0, NULL, "write a short aligned table for people, not a catalogue", NULL, 0},
        {0}};
    opt_parse(&prog, own, &c, argc, argv);
    o.seed = c.seed;

    size_t n = (size_t)c.argc;
    if (o.everywhere && !bin_text)
        die(EXIT_USAGE, "--bins-everywhere needs --bins");
    if (text)
        opt_output(c.out, OUT_LINES);
    if (bin_text)
        parse_bins(&bins, bin_text);
    o.psf = against == 1;
    check_files(&c);
    struct fom_image *im = read_all(&c, bin_text ? bins.key : NULL, o.psf);
    struct fom_result *r = calloc(n * (bins.n + 1) + 1, sizeof *r);
    if (!r)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    size_t groups = group_all(n, im, &bins, &o, r);
    check_reference(&o, groups, r);
    check(fom_compare(groups, r, &o), "lines over scales");
    check(fom_contrast(groups, r, &o), "errors against the reference");
    check(fom_optimum(groups, r, &o), "best scale");
    if (c.check) {
        warn("%zu catalogues in %zu groups", n, groups);
    } else if (text) {
        write_text(&c, groups, r);
    } else {
        struct err e;
        struct table t = {0};
        check(fom_to_table(groups, r, &t), c.out);
        char *record = opt_record(&prog, own, &c);
        if (table_write(&t, c.out, record, c.argv, n, &e))
            die(EXIT_RUN, "%s", e.text);
        free(record);
        table_free(&t);
    }
    if (!c.quiet)
        tell_undefined(&c, im, groups, r);
    for (size_t i = 0; i < groups; i++)
        fom_result_free(&r[i]);
    for (size_t i = 0; i < n; i++)
        fom_image_free(&im[i]);
    free(im);
    free(r);
    return EXIT_DONE;
}
