/*
 * galgen - draw a field of galaxies (or stars).
 *
 * Synthetic galaxies follow population.h: scene list to --output, coefficients
 * to --models.  With --library they are drawn from a shapelet catalogue of
 * real ones.  Galaxy number i depends on the seed and on i alone.
 */
#include "err.h"
#include "models.h"
#include "opt.h"
#include "outfile.h"
#include "par.h"
#include "population.h"
#include "progress.h"
#include "table.h"
#include "tableio.h"
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct params {
    long n;                  /* objects; -1: from the counts */
    double field;            /* side, arcsec */
    double mag[2];
    const char *library, *models;
    int library_mags;        /* enum library_mags */
    int stars;
    double star_mag;
    long nmax;               /* -1: by magnitude */
    int turn;                /* quarter turns of the finished field, anticlockwise */
    struct population recipe;
};

enum library_mags { MAGS_COUNTS, MAGS_OWN };
enum { DEFAULT_STARS = 400, CHUNK = 32, NEAREST = 8 };
static const double default_density = 805;       /* galaxies per arcmin^2 at magnitudes 20..30.8 */

static const double degree = 57.295779513082321;

static double area(const struct params *p)
{
    return p->field * p->field / 3600;           /* arcmin^2 */
}

static void check(int st)
{
    if (st)
        die(EXIT_RUN, "%s", err_text(st));
}

/* What a file gives back: nine significant digits. */
static double nine(double x)
{
    char s[TABLE_PRINT];
    double v = 0;
    check(table_scan_real(s, table_print_real32(s, x), &v));
    return v;
}

/* ---- options ---- */

static void check_options(struct params *p, const struct opt *own, const struct common *c)
{
    if (!(p->mag[0] < p->mag[1]))
        die(EXIT_USAGE, "--mag-range %g,%g: the first magnitude must be the smaller one", p->mag[0], p->mag[1]);
    static const char *const field[] = {"library", "models", NULL}, *const counts[] = {"mag-range", NULL},
                      *const recipe[] = {"nmax", "size", "size-scatter", "smoothing", NULL};
    if (p->stars) {
        opt_idle(own, c, field, "with --stars");
        opt_idle(own, c, counts, "with --stars (see --star-mag)");
    }
    if (p->stars || p->library)
        opt_idle(own, c, recipe, p->stars ? "with --stars" : "with --library, whose galaxies have their own shapes");
    if (!p->stars && opt_given(own, c, "star-mag"))
        die(EXIT_USAGE, "--star-mag needs --stars");
    if (!p->library && opt_given(own, c, "library-mags"))
        die(EXIT_USAGE, "--library-mags needs --library FILE");
    if (p->library && p->library_mags == MAGS_OWN && opt_given(own, c, "mag-range"))
        die(EXIT_USAGE, "--mag-range does not go with --library-mags own, which keeps the library's magnitudes");
    if (!p->stars && !p->library && !p->models && !c->check)
        die(EXIT_USAGE, "where do the coefficients go? Give --models FILE (simage reads it), or --stars, or --library FILE");
    if (p->models && outfile_same(p->models, c->out))
        die(EXIT_USAGE, "--models and --output cannot both be %s", strcmp(c->out, "-") ? c->out : "standard output");
    if (p->n >= 0)
        return;
    double density = default_density * counts_between(p->mag[0], p->mag[1]) / counts_between(20, 30.8);
    double n = p->stars ? DEFAULT_STARS : rint(density * area(p));
    if (n > 1e7)
        die(EXIT_USAGE, "%.4g galaxies in %.4g arcmin^2: more than 10000000: give -n or a smaller --field", n, area(p));
    p->n = (long)n;
}

static void print_plan(const struct params *p)
{
    if (p->stars)
        warn("%ld stars of magnitude %g in %.4f arcmin^2", p->n, p->star_mag, area(p));
    else if (p->library)
        warn("%ld galaxies from %s, magnitudes %s, in %.4f arcmin^2 (%.1f per arcmin^2)", p->n, p->library,
                p->library_mags == MAGS_OWN ? "their own" : "from the counts", area(p), (double)p->n / area(p));
    else
        warn("%ld synthetic galaxies, magnitudes %g to %g, in %.4f arcmin^2 (%.1f per arcmin^2); about %.2g s",
                p->n, p->mag[0], p->mag[1], area(p), (double)p->n / area(p), 1e-5 * (double)p->n + 0.01);
}

/* ---- the scene list ---- */

/* ID DX DY MAG TYPE for every object; n rows. */
static void scene_new(struct table *t, const struct params *p, const struct common *c, const char *type)
{
    check(table_resize(t, (size_t)p->n));
    check(table_add(t, "ID", COL_INT, "", "Number of the object"));
    check(table_add(t, "DX", COL_REAL, "arcsec", "Position from the field centre, rightwards"));
    check(table_add(t, "DY", COL_REAL, "arcsec", "Position from the field centre, upwards"));
    check(table_add(t, "MAG", COL_REAL, "mag", "AB magnitude of the total flux"));
    check(table_add(t, "TYPE", COL_TEXT, "", "Kind of object"));
    for (size_t i = 0; i < t->nrow; i++) {
        t->col[0].v.i[i] = (int64_t)i + 1;
        check(table_set_word(&t->col[4], i, type));
    }
    char seed[32];
    snprintf(seed, sizeof seed, "%llu", (unsigned long long)c->seed);
    check(table_set_number(t, "FIELD", p->field));
    check(table_set_number(t, "AREA", nine(area(p))));
    check(table_set_text(t, "SEED", seed));
}

static double *add_real(struct table *t, const char *name, const char *unit, const char *what)
{
    check(table_add(t, name, COL_REAL, unit, what));
    return table_reals(t, name);
}

/* Uniform in the field: the draws DRAW_X and DRAW_Y of a stream. */
static void place(struct table *t, const struct params *p, const struct rng *r)
{
    double *x = table_reals(t, "DX"), *y = table_reals(t, "DY");
    for (size_t i = 0; i < t->nrow; i++) {
        x[i] = nine(p->field * (rng_uniform(r, i + 1, DRAW_X) - 0.5));
        y[i] = nine(p->field * (rng_uniform(r, i + 1, DRAW_Y) - 0.5));
    }
}

/* Stars: one in the middle 60 % of each cell of a square grid. */
static void make_stars(struct table *t, const struct params *p, const struct common *c)
{
    struct rng r = rng_stream(c->seed, 0, RNG_STAR);
    scene_new(t, p, c, "star");
    size_t columns = (size_t)ceil(sqrt((double)p->n)), rows = columns ? ((size_t)p->n + columns - 1) / columns : 0;
    double *x = table_reals(t, "DX"), *y = table_reals(t, "DY"), *m = table_reals(t, "MAG");
    for (size_t i = 0; i < t->nrow; i++) {
        double u = 0.2 + 0.6 * rng_uniform(&r, i + 1, DRAW_X), v = 0.2 + 0.6 * rng_uniform(&r, i + 1, DRAW_Y);
        x[i] = nine(p->field * (((double)(i % columns) + u) / (double)columns - 0.5));
        y[i] = nine(p->field * (((double)(i / columns) + v) / (double)rows - 0.5));
        m[i] = p->star_mag;
    }
}

/* ---- synthetic galaxies ---- */

struct build {
    const struct params *p;
    const struct profiles *profiles;
    struct rng rng;
    struct progress *progress;
    const double *mag;
    const size_t *start;     /* of each galaxy's coefficients */
    double *coef, *beta, *power, *flux, *re, *q, *pa, *bt, *clumpy;
};

static int order_of(const struct params *p, double mag)
{
    return p->nmax >= 0 ? (int)p->nmax : galaxy_order(mag);
}

static int build_some(void *ctx, long begin, long end, int worker)
{
    const struct build *b = ctx;
    (void)worker;
    for (long i = begin; i < end; i++) {
        struct galaxy g;
        struct gaussians s;
        struct galaxy_fit fit;
        double *c = b->coef + b->start[i];
        galaxy_draw(&b->p->recipe, &b->rng, (uint64_t)i + 1, b->mag[i], &g);
        int st = galaxy_gaussians(&b->p->recipe, b->profiles, &g, &s);
        if (!st)
            st = galaxy_project(&b->p->recipe, &g, &s, order_of(b->p, b->mag[i]), c, &fit);
        if (st)
            return st;
        b->beta[i] = nine(fit.beta);
        b->power[i] = nine(fit.power);
        b->flux[i] = nine(fit.flux);
        b->re[i] = nine(g.re);
        b->q[i] = nine(g.q);
        b->pa[i] = nine(g.pa * degree);
        b->bt[i] = nine(g.bt);
        b->clumpy[i] = nine(g.clumpy);
        for (size_t k = 0; k < b->start[i + 1] - b->start[i]; k++)
            c[k] = nine(c[k]);
    }
    progress_tick(b->progress, end - begin);
    return OK;
}

static void copy_column(struct table *to, const char *name, const double *from, const char *unit, const char *what)
{
    double *v = add_real(to, name, unit, what);
    if (to->nrow)
        memcpy(v, from, to->nrow * sizeof *v);
}

/* Magnitudes, then where each galaxy's coefficients begin. */
static size_t *draw_magnitudes(const struct params *p, const struct common *c, const struct rng *r, double *mag)
{
    size_t n = (size_t)p->n, *start = malloc((n + 1) * sizeof *start);
    if (!start)
        check(E_NOMEM);
    start[0] = 0;
    for (size_t i = 0; i < n; i++) {
        mag[i] = nine(counts_magnitude(p->mag[0], p->mag[1], rng_uniform(r, i + 1, DRAW_MAG)));
        size_t k = (size_t)order_of(p, mag[i]);
        start[i + 1] = start[i] + (k + 1) * (k + 2) / 2;
    }
    if (16.0 * (double)start[n] + 300.0 * (double)n > c->max_memory)
        die(EXIT_RUN, "%ld galaxies need %.0f MB: more than --max-memory", p->n, 1e-6 * (16.0 * (double)start[n] + 300.0 * (double)n));
    return start;
}

static void make_galaxies(struct table *t, struct table *models, const struct params *p, const struct common *c)
{
    struct profiles profiles = population_profiles();
    struct progress bar;
    struct build b = {.p = p, .profiles = &profiles, .rng = rng_stream(c->seed, 0, RNG_GALAXY), .progress = &bar};
    scene_new(t, p, c, "shapelet");
    place(t, p, &b.rng);
    double *mag = table_reals(t, "MAG");
    size_t *start = draw_magnitudes(p, c, &b.rng, mag), n = t->nrow;
    b.mag = mag;
    b.start = start;
    check(table_add(t, "MODEL", COL_INT, "", "ID in the shapelet catalogue"));
    if (n)
        memcpy(table_ints(t, "MODEL"), table_ints(t, "ID"), n * sizeof(int64_t));
    b.re = add_real(t, "RE", "arcsec", "Half-light radius before smoothing, circularised");
    b.q = add_real(t, "Q", "", "Axis ratio of the disc");
    b.pa = add_real(t, "PA", "deg", "Position angle anticlockwise from the x axis");
    b.bt = add_real(t, "BT", "", "Bulge to total flux");

    check(table_resize(models, n));
    check(table_add(models, "ID", COL_INT, "", "Number of the galaxy"));
    b.beta = add_real(models, "BETA", "arcsec", "Shapelet scale length");
    check(table_add(models, "NMAX", COL_INT, "", "Highest order n1+n2"));
    copy_column(models, "MAG", mag, "mag", "AB magnitude of the total flux");
    b.clumpy = add_real(models, "CLUMPY", "", "Fraction of the disc in knots and arms");
    b.power = add_real(models, "POWER", "", "Fraction of the power the series captures");
    b.flux = add_real(models, "FLUXPART", "", "Fraction of the flux captured before scaling to 1");
    b.coef = malloc((start[n] + 1) * sizeof *b.coef);
    if (!b.coef)
        check(E_NOMEM);
    progress_begin(&bar, "galaxies", p->n, c->quiet);
    const double begin = seconds_now();
    check(par_for(p->n, CHUNK, c->threads, build_some, &b));
    const double seconds = seconds_now() - begin;
    progress_end(&bar);
    if (c->verbose)
        fprintf(stderr, "galgen: coefficients made in %.4f s\n", seconds);
    copy_column(models, "RE", b.re, "arcsec", "Half-light radius before smoothing, circularised");
    copy_column(models, "Q", b.q, "", "Axis ratio of the disc");
    copy_column(models, "BT", b.bt, "", "Bulge to total flux");
    check(table_add(models, "COEFFS", COL_RAGGED, "1/arcsec", "Coefficients for unit flux, order n rising, then n1 rising, to the end of the row"));
    for (size_t i = 0; i < n; i++) {
        table_ints(models, "ID")[i] = (int64_t)i + 1;
        table_ints(models, "NMAX")[i] = order_of(p, mag[i]);
        check(table_ragged(models, table_find(models, "COEFFS"), i, b.coef + start[i], start[i + 1] - start[i]));
    }
    free(b.coef);
    free(start);
}

/* ---- galaxies of a library ---- */

struct shelf {
    double mag;
    size_t at;               /* index in the catalogue */
};

static int shelf_order(const void *a, const void *b)
{
    const struct shelf *x = a, *y = b;
    if (x->mag != y->mag)
        return x->mag < y->mag ? -1 : 1;
    return (x->at > y->at) - (x->at < y->at);
}

/* Models by magnitude; those without one are an error. */
static struct shelf *library_sort(const struct models *m, const char *name)
{
    if (m->n == 0)
        die(EXIT_RUN, "%s: the catalogue is empty", name);
    struct shelf *s = malloc(m->n * sizeof *s);
    if (!s)
        check(E_NOMEM);
    for (size_t i = 0; i < m->n; i++) {
        if (!isfinite(m->mag[i]))
            die(EXIT_RUN, "%s: row %zu: MAG is not a number: a library needs the magnitude of each model", name, i + 1);
        s[i] = (struct shelf){m->mag[i], i};
    }
    qsort(s, m->n, sizeof *s, shelf_order);
    return s;
}

/*
 * One of the NEAREST models by magnitude, with probability in proportion to
 * 1 / (1/4 + d^2), d the difference in magnitudes.
 */
static size_t library_choose(const struct shelf *s, size_t n, double mag, double u)
{
    size_t lo = 0, hi = n;
    while (lo < hi) {
        size_t mid = lo + (hi - lo) / 2;
        if (s[mid].mag < mag)
            lo = mid + 1;
        else
            hi = mid;
    }
    hi = lo;
    while (hi - lo < NEAREST && hi - lo < n) {
        if (lo == 0 || (hi < n && s[hi].mag - mag < mag - s[lo - 1].mag))
            hi++;
        else
            lo--;
    }
    double sum = 0, below = 0;
    for (size_t i = lo; i < hi; i++)
        sum += 1 / (0.25 + (s[i].mag - mag) * (s[i].mag - mag));
    for (size_t i = lo; i < hi; i++) {
        below += 1 / (0.25 + (s[i].mag - mag) * (s[i].mag - mag));
        if (u * sum < below)
            return s[i].at;
    }
    return s[hi - 1].at;
}

enum library_draws { DRAW_MODEL = 3, DRAW_TURN, DRAW_MIRROR };

static void make_from_library(struct table *t, const struct models *m, const struct params *p, const struct common *c)
{
    struct rng r = rng_stream(c->seed, 0, RNG_LIBRARY);
    struct shelf *shelf = library_sort(m, p->library);
    scene_new(t, p, c, "shapelet");
    place(t, p, &r);
    check(table_add(t, "MODEL", COL_INT, "", "ID in the shapelet catalogue"));
    double *rot = add_real(t, "ROT", "deg", "Rotation anticlockwise, after parity");
    check(table_add(t, "PARITY", COL_INT, "", "Minus one mirrors y first"));
    double *dilation = add_real(t, "DILATION", "", "Factor on all lengths");
    double *mag = table_reals(t, "MAG");
    for (size_t i = 0; i < t->nrow; i++) {
        double u = rng_uniform(&r, i + 1, DRAW_MODEL);
        size_t k;
        if (p->library_mags == MAGS_OWN) {
            k = (size_t)(u * (double)m->n);
            k = k < m->n ? k : m->n - 1;
            mag[i] = m->mag[k];
            dilation[i] = 1;
        } else {
            mag[i] = nine(counts_magnitude(p->mag[0], p->mag[1], rng_uniform(&r, i + 1, DRAW_MAG)));
            k = library_choose(shelf, m->n, mag[i], u);
            dilation[i] = nine(population_size(&p->recipe, mag[i]) / population_size(&p->recipe, m->mag[k]));
        }
        table_ints(t, "MODEL")[i] = m->id[k];
        rot[i] = nine(360 * rng_uniform(&r, i + 1, DRAW_TURN));
        table_ints(t, "PARITY")[i] = rng_uniform(&r, i + 1, DRAW_MIRROR) < 0.5 ? -1 : 1;
    }
    free(shelf);
}

/* ---- the field as a whole ---- */

/* Turn positions and galaxies about the field centre by quarter turns. */
static void turn_field(struct table *t, int quarters)
{
    static const int cosine[4] = {1, 0, -1, 0}, sine[4] = {0, 1, 0, -1};
    double *x = table_reals(t, "DX"), *y = table_reals(t, "DY"), *rot = table_reals(t, "ROT"), *pa = table_reals(t, "PA");
    if (quarters == 0)
        return;
    if (!rot && table_find(t, "MODEL")) {
        rot = add_real(t, "ROT", "deg", "Rotation anticlockwise, after parity");
        memset(rot, 0, t->nrow * sizeof *rot);
    }
    for (size_t i = 0; i < t->nrow; i++) {
        double u = x[i], v = y[i];
        x[i] = cosine[quarters] * u - sine[quarters] * v;
        y[i] = sine[quarters] * u + cosine[quarters] * v;
        if (rot)
            rot[i] = nine(fmod(rot[i] + 90 * quarters, 360));
        if (pa)
            pa[i] = nine(fmod(pa[i] + 90 * quarters, 180));
    }
}

/* ---- main ---- */

/* Both outputs can be opened. */
static void check_outputs(const struct params *p, const struct common *c)
{
    struct err e;
    if (outfile_ready(c->out, &p->library, p->library != NULL, &e)
        || (p->models && outfile_ready(p->models, &p->library, p->library != NULL, &e)))
        die(EXIT_RUN, "%s", e.text);
}

static void write_table(const struct table *t, const char *name, const char *record, const struct params *p)
{
    struct err e;
    if (table_write(t, name, record, &p->library, p->library != NULL, &e))
        die(EXIT_RUN, "%s", e.text);
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct params p = {.n = -1, .field = 163.84, .mag = {20, 30.8}, .star_mag = 21, .nmax = -1, .recipe = POPULATION_DEFAULTS};
    const struct program prog = {
        "galgen", "draw a field of galaxies or stars: scene list to --output, coefficients to --models", "", 0, 0,
        "  galgen --models models.txt -s 3 > scene.txt\n  galgen --stars > stars.txt\n", OUT_TABLE
    };
    const struct opt own[] = {
        {"number", 'n', OPT_LONG, &p.n, 0, 1e7, "N", "objects (default: from the counts; 400 stars)", NULL, 0},
        {"field", 0, OPT_REAL, &p.field, 1e-3, 1e6, "ARCSEC", "side of the field, arcsec", NULL, 0},
        {"mag-range", 0, OPT_PAIR, p.mag, POPULATION_MAG_MIN, POPULATION_MAG_MAX, "LO,HI", "AB magnitudes", NULL, 0},
        {"models", 0, OPT_STR, &p.models, 0, 0, "FILE", "shapelet catalogue to write", NULL, OPT_OUT(OUT_TABLE)},
        {"library", 0, OPT_STR, &p.library, 0, 0, "FILE", "draw from this shapelet catalogue", NULL, 1},
        {"library-mags", 0, OPT_CHOICE, &p.library_mags, 0, 0, NULL, "magnitudes of library galaxies", "counts|own", 0},
        {"stars", 0, OPT_FLAG, &p.stars, 0, 0, NULL, "stars instead of galaxies", NULL, 0},
        {"star-mag", 0, OPT_REAL, &p.star_mag, -10, 60, "MAG", "AB magnitude of stars", NULL, 0},
        {"turn", 0, OPT_CHOICE, &p.turn, 0, 0, NULL, "turn the finished field, deg anticlockwise", "0|90|180|270", 0},
        {"nmax", 0, OPT_LONG, &p.nmax, -1, GAUSSIANS_NMAX, "N", "order; -1: 12, 8, 4 below 26, 28 mag and beyond", NULL, 0},
        {"size", 0, OPT_REAL, &p.recipe.size, 1e-3, 100, "ARCSEC", "median half-light radius at magnitude 22.25", NULL, 0},
        {"size-scatter", 0, OPT_REAL, &p.recipe.scatter, 0, 2, "S", "scatter of its natural logarithm", NULL, 0},
        {"smoothing", 0, OPT_REAL, &p.recipe.smoothing, 0, 10, "ARCSEC", "sigma of the Gaussian galaxies carry", NULL, 0},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    check_options(&p, own, &c);

    struct table scene = {0}, models = {0};
    struct models library = {0};
    struct err e;
    if (p.library && (table_read(&models, p.library, c.max_memory, &e) || models_open(&library, &models, p.library, &e)))
        die(EXIT_RUN, "%s", e.text);
    if (c.check || c.verbose)
        print_plan(&p);

    if (c.check) {
        models_free(&library);
        table_free(&models);
        return EXIT_DONE;
    }
    check_outputs(&p, &c);
    char *record = opt_record(&prog, own, &c);
    if (p.stars)
        make_stars(&scene, &p, &c);
    else if (p.library)
        make_from_library(&scene, &library, &p, &c);
    else
        make_galaxies(&scene, &models, &p, &c);
    turn_field(&scene, p.turn);
    outfile_together();
    if (p.models)
        write_table(&models, p.models, record, &p);
    write_table(&scene, c.out, record, &p);
    if (outfile_appear(&e))
        die(EXIT_RUN, "%s", e.text);

    free(record);
    models_free(&library);
    table_free(&models);
    table_free(&scene);
    return EXIT_DONE;
}
