/*
 * opt.h - option tables.  One table per program makes parsing, range checks,
 * --help, defaults, the HISTORY record, the man page check and completion.
 */
#ifndef PIXSHEAR_OPT_H
#define PIXSHEAR_OPT_H

#include "outname.h"
#include <stddef.h>
#include <stdint.h>

enum opt_type {
    OPT_FLAG,      /* int *: set to 1; no value */
    OPT_LONG,      /* long *: lo..hi */
    OPT_REAL,      /* double *: finite, lo..hi */
    OPT_PAIR,      /* double[2]: "A,B", each lo..hi */
    OPT_STR,       /* const char **: any text, not empty */
    OPT_CHOICE,    /* int *: index into `choices` */
    OPT_REALS,     /* struct opt_reals *: "A,B,...", each lo..hi */
    OPT_STRS       /* struct opt_strs *: may be given several times */
};

struct opt_reals {
    size_t n;
    double *v;             /* freed by opt_free */
};

struct opt_strs {
    size_t n;
    const char **v;
};

#define OPT_OUT(format) (1 + (int)(format))

struct opt {
    const char *name;      /* long name without dashes */
    int letter;            /* short name or 0 */
    enum opt_type type;
    void *value;           /* holds the default when opt_parse is called */
    double lo, hi;         /* allowed range of numbers, inclusive */
    const char *arg;       /* name of the value in --help, with its unit */
    const char *help;      /* one line; unit in it */
    const char *choices;   /* OPT_CHOICE: "a|b|c" */
    int in_file;           /* value is a file name (HISTORY keeps the base name): 1 of an input, OPT_OUT(format) of an output */
};

struct program {
    const char *name;
    const char *what;      /* one line, for --help and the man page */
    const char *operands;  /* "[IMAGE]" */
    int min_operands, max_operands;   /* max < 0: any number */
    const char *examples;  /* two lines for --help */
    enum out_format writes;           /* to --output */
};

/* What every program understands with the same meaning. */
struct common {
    const char *out;       /* -o --output, "-" is standard output */
    uint64_t seed;         /* -s --seed */
    int threads;           /* -j --threads */
    int verbose, quiet;    /* -v, -q */
    int check;             /* --check: validate, print plan and cost, do nothing */
    double max_memory;     /* --max-memory, bytes; default physical memory */
    int argc;              /* operands, in order */
    const char **argv;
    unsigned char given[96];   /* per entry of the program's own table: typed by the user */
};

#define COMMON_DEFAULTS {.out = "-", .seed = 1, .threads = 1}

/*
 * Parse; --help and --version print and exit 0; mistakes exit 2 with one line
 * that names the nearest option.  Options and operands may be mixed; "--" ends
 * options.  Without an operand, a program whose min_operands is 0 gets "-".
 * Reading from a terminal is refused with the usage line, standard input for two
 * inputs (operands or options that name an input) as well.
 * `own` ends with a zero entry.
 */
void opt_parse(const struct program *prog, const struct opt *own, struct common *c,
               int argc, char **argv);

/* Exit 2 when the name of an output promises another format; opt_parse does it for all that the tables tell. */
void opt_output(const char *name, enum out_format format);

/* 1 if the program's own option `name` was typed on the command line. */
int opt_given(const struct opt *own, const struct common *c, const char *name);

/* Exit 2 when one of the options of a list that ends with NULL was typed: it would do nothing, as `why` tells. */
void opt_idle(const struct opt *own, const struct common *c, const char *const *names, const char *why);

/*
 * The text for HISTORY: "name version: name --option value ... operands", all
 * options that differ from their defaults or were typed, without -j -v -q -o
 * --max-memory, file names reduced to base names, shell-quoted.  Allocated.
 */
char *opt_record(const struct program *prog, const struct opt *own, const struct common *c);

/* Frees the lists that opt_parse made for OPT_REALS and OPT_STRS, and empties them. */
void opt_free(const struct opt *own);

/* A whole argument as a number; 0 on success.  No trailing characters, no nan, no inf. */
int opt_number(const char *text, double *value);

#endif
