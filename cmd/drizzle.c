/*
 * drizzle.c - combine exposures on one grid.
 */
#include "err.h"
#include "opt.h"
#include "outfile.h"
#include "stack.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* CPU seconds, good to a factor 2: input pixels by the kernel and the map, output pixels by what is written. */
static double predict(const struct stack *s)
{
    static const double drop[] = {[DRIZZLE_SQUARE] = 18e-9, [DRIZZLE_POINT] = 3e-9, [DRIZZLE_TURBO] = 20e-9,
                                  [DRIZZLE_GAUSSIAN] = 60e-9, [DRIZZLE_LANCZOS2] = 165e-9, [DRIZZLE_LANCZOS3] = 370e-9};
    double t = (s->choice.flat ? 2e-9 : 6e-9) * (double)s->nx * (double)s->ny;
    for (size_t i = 0; i < s->n; i++) {
        const struct shot *x = &s->shot[i];
        const struct drizzle_map *m = &x->map;
        const int bent = m->node_x != NULL, turned = bent || m->xy != 0 || m->yx != 0;
        double pixel = drop[s->choice.kernel] + (turned ? 8e-9 : 3e-9) * m->scale * m->scale + (turned ? 8e-9 : 0) + (bent ? 40e-9 : 0);
        if (!turned && s->choice.kernel <= DRIZZLE_POINT && !drizzle_splits(s->choice.kernel, s->choice.pixfrac, m, x->x.nx, x->x.ny))
            pixel = 3e-9;
        t += pixel * (double)x->x.nx * (double)x->x.ny;
    }
    return t;
}

static void plan(const struct stack *s)
{
    double pixels = 0;
    long grids = 0;
    for (size_t i = 0; i < s->n; i++) {
        pixels += (double)s->shot[i].x.nx * (double)s->shot[i].x.ny;
        grids += s->shot[i].map.node_x != NULL;
    }
    fprintf(stderr, "drizzle: %zu exposures, %.4g Mpixel, %ld of them through a grid; output %ld x %ld of ", s->n, pixels * 1e-6,
            grids, s->nx, s->ny);
    if (isnan(s->scale))
        fprintf(stderr, "unknown scale");
    else
        fprintf(stderr, "%.6g arcsec", s->scale);
    fprintf(stderr, ", %s, pixfrac %g, noise factor %.4f, about %.2g s\n", stack_kernel_name[s->choice.kernel], s->choice.pixfrac,
            header_double_or(&s->hdr, "NOISECOR", 1), predict(s));
}

/* Lists become the names in them; a list is an input, too. */
static void expand(struct names *to, size_t n, const char *const *from, const struct common *c)
{
    struct err e;
    for (size_t i = 0; i < n; i++) {
        const char *list = from[i] + 1;
        if (from[i][0] == '@' && access(from[i], F_OK) && !c->check && outfile_ready(c->out, &list, 1, &e))
            die(EXIT_RUN, "%s", e.text);
    }
    if (names_expand(to, n, from, &e))
        die(EXIT_RUN, "%s", e.text);
}

/* Lists of names become names. */
static void expand_lists(struct stack_choice *q, const struct common *c, const struct opt_strs maps[STACK_MAPS])
{
    expand(&q->files, (size_t)c->argc, c->argv, c);
    for (int kind = 0; kind < STACK_MAPS; kind++) {
        expand(&q->maps[kind], maps[kind].n, maps[kind].v, c);
        if (q->maps[kind].n && q->maps[kind].n != q->files.n)
            die(EXIT_USAGE, "--%s was given %zu times for %zu operands", stack_map_name[kind], q->maps[kind].n, q->files.n);
    }
}

/* The command line as the record has it: names in the order of the exposures. */
static char *make_record(const struct program *prog, const struct opt *own, struct common *c, const struct stack_choice *q,
                         struct opt_strs maps[STACK_MAPS])
{
    const struct names *list[1 + STACK_MAPS] = {&q->files, &q->maps[0], &q->maps[1], &q->maps[2]};
    const char **argv[1 + STACK_MAPS];
    for (int l = 0; l < 1 + STACK_MAPS; l++) {
        argv[l] = malloc((list[l]->n + 1) * sizeof *argv[l]);
        if (!argv[l])
            die(EXIT_RUN, "%s", err_text(E_NOMEM));
        for (size_t i = 0; i < list[l]->n; i++)
            argv[l][i] = list[l]->v[i];
    }
    c->argv = argv[0];
    c->argc = (int)list[0]->n;
    for (int kind = 0; kind < STACK_MAPS; kind++) {
        free(maps[kind].v);
        maps[kind] = (struct opt_strs){list[1 + kind]->n, argv[1 + kind]};
    }
    char *record = opt_record(prog, own, c);
    free(argv[0]);
    return record;
}

static void check_grid(struct stack_choice *q, const struct opt *own, const struct common *c)
{
    q->turned = opt_given(own, c, "rotation");
    q->sized = opt_given(own, c, "size");
    q->centred = opt_given(own, c, "center");
    if (q->like && (!isnan(q->scale) || q->turned || q->sized || q->centred))
        die(EXIT_USAGE, "--like and --pixscale, --rotation, --size, --center both set the grid: give one");
    if (q->shifts && (q->like || q->turned || q->sized || q->centred))
        die(EXIT_USAGE, "--shift places exposures in pixels: --like, --rotation, --size and --center need a WCS");
    if (q->sized && (q->size[0] != floor(q->size[0]) || q->size[1] != floor(q->size[1])))
        die(EXIT_USAGE, "--size takes whole numbers");
    if (q->centred && !(fabs(q->center[1]) <= 90))
        die(EXIT_USAGE, "--center: declination is -90 to 90 degrees");
}

static enum stack_weight weighting_of(int asked, int given, const struct opt_strs maps[STACK_MAPS])
{
    const int weighting = given ? asked : maps[MAP_WEIGHT].n ? WEIGHT_MAP : WEIGHT_EXPTIME;
    if (weighting == WEIGHT_MAP && !maps[MAP_WEIGHT].n)
        die(EXIT_USAGE, "--weight-type map needs --weight");
    if (weighting == WEIGHT_IVM && !maps[MAP_WEIGHT].n && !maps[MAP_VAR].n)
        die(EXIT_USAGE, "--weight-type ivm needs --weight or --var");
    return (enum stack_weight)weighting;
}

int main(int argc, char **argv)
{
    struct common c = COMMON_DEFAULTS;
    struct stack s = {.choice = {.scale = NAN, .pixfrac = 1, .fill = NAN, .units = -1}};
    struct stack_choice *q = &s.choice;
    struct opt_strs maps[STACK_MAPS] = {{0}};
    struct err e;
    int kernel = DRIZZLE_SQUARE, weighting = WEIGHT_EXPTIME;
    const struct program prog = {
        "drizzle", "combine exposures on one grid by variable-pixel linear reconstruction", "[EXPOSURES...]", 0, -1,
        "  drizzle four.fits -x 0.1 --pixfrac 0.5 -o deep.fits\n"
        "  drizzle a.fits b.fits --weight a.fits[WHT] --weight b.fits[WHT] --like grid.fits --flat -o deep.fits\n", OUT_FITS
    };
    const struct opt own[] = {
        {"pixscale", 'x', OPT_REAL, &q->scale, 1e-9, 1e6, "ARCSEC", "output pixel, arcsec; default the first exposure's", 0, 0},
        {"pixfrac", 0, OPT_REAL, &q->pixfrac, 0, 8, "P", "side of a drop, input pixels", 0, 0},
        {"kernel", 0, OPT_CHOICE, &kernel, 0, 0, 0, "shape of a drop", "square|point|turbo|gaussian|lanczos2|lanczos3", 0},
        {"like", 0, OPT_STR, &q->like, 0, 0, "FILE", "take size and WCS of the output from this image", 0, 1},
        {"shift", 0, OPT_STR, &q->shifts, 0, 0, "FILE", "place exposures by columns DX DY [ROT SCALE], pixels, instead of the WCS", 0, 1},
        {"rotation", 0, OPT_REAL, &q->rotation, -360, 360, "DEG", "direction of the output's y axis, from north to east", 0, 0},
        {"size", 0, OPT_PAIR, q->size, 1, 65535, "NX,NY", "output pixels; default all that holds a drop", 0, 0},
        {"center", 0, OPT_PAIR, q->center, -360, 360, "RA,DEC", "middle of the output, deg; default the first exposure's", 0, 0},
        {"weight", 'w', OPT_STRS, &maps[MAP_WEIGHT], 0, 0, "FILE", "weight map; once per operand, same order", 0, 1},
        {"var", 0, OPT_STRS, &maps[MAP_VAR], 0, 0, "FILE", "variance map, likewise: write VAR", 0, 1},
        {"mask", 0, OPT_STRS, &maps[MAP_MASK], 0, 0, "FILE", "bad pixels, not 0, likewise", 0, 1},
        {"weight-type", 0, OPT_CHOICE, &weighting, 0, 0, 0, "meaning of the weight; default map with --weight, else exptime",
         "exptime|map|ivm", 0},
        {"units", 0, OPT_CHOICE, &q->units, 0, 0, 0, "of SCI; default total when EXPTIME is known", "total|mean|rate", 0},
        {"fill", 0, OPT_REAL, &q->fill, -1e38, 1e38, "V", "value of pixels without weight; default NaN", 0, 0},
        {"flat", 0, OPT_FLAG, &q->flat, 0, 0, 0, "write SCI alone, as primary image", 0, 0},
        {0}
    };
    opt_parse(&prog, own, &c, argc, argv);
    q->kernel = (enum drizzle_kernel)kernel;
    q->max_memory = c.max_memory;
    q->threads = c.threads;
    q->quiet = c.quiet;
    q->weighting = weighting_of(weighting, opt_given(own, &c, "weight-type"), maps);
    check_grid(q, own, &c);
    expand_lists(q, &c, maps);
    if (stack_read(&s, &e) || stack_place(&s, &e) || stack_units(&s, &e))
        die(EXIT_RUN, "%s", e.text);
    if (stack_sort_names(&s))
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    char *record = make_record(&prog, own, &c, q, maps);
    if (stack_describe(&s, record, &e))
        die(EXIT_RUN, "%s", e.text);
    if (c.verbose || c.check)
        plan(&s);
    if (!c.check && stack_write(&s, c.out, &e))
        die(EXIT_RUN, "%s", e.text);
    free(record);
    stack_free(&s);
    opt_free(own);
    return EXIT_DONE;
}
