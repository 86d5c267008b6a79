/* opt.c - option tables: parsing, --help, the HISTORY record. */
#include "opt.h"
#include "err.h"
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef PIXSHEAR_VERSION
#define PIXSHEAR_VERSION "unknown"
#endif

/* The options of every program; take_shared() knows where they go. */
static const struct opt shared_options[] = {
    {"output", 'o', OPT_STR, 0, 0, 0, "FILE", "output file, - is standard output [-]", 0, 1},
    {"seed", 's', OPT_LONG, 0, 0, 0, "N", "seed of all random numbers [1]", 0, 0},
    {"threads", 'j', OPT_LONG, 0, 1, 256, "N", "threads; the result does not depend on it [1]", 0, 0},
    {"max-memory", 0, OPT_REAL, 0, 1, 1e18, "BYTES", "refuse to use more (K, M, G understood)", 0, 0},
    {"check", 0, OPT_FLAG, 0, 0, 0, 0, "validate, print plan and cost, do nothing", 0, 0},
    {"verbose", 'v', OPT_FLAG, 0, 0, 0, 0, "say what is done", 0, 0},
    {"quiet", 'q', OPT_FLAG, 0, 0, 0, 0, "no warnings, no progress", 0, 0},
    {"help", 'h', OPT_FLAG, 0, 0, 0, 0, "print this", 0, 0},
    {"version", 'V', OPT_FLAG, 0, 0, 0, 0, "print the version", 0, 0},
    {0}
};

struct parser {
    const struct program *prog;
    const struct opt *own;
    struct common *c;
    int argc;
    char **argv;
};

int opt_number(const char *text, double *value)
{
    /* only what a decimal number is made of: no hexadecimal, nan, inf, blanks */
    if (!*text || text[strspn(text, "0123456789+-.eE")])
        return -1;
    char *end;
    errno = 0;
    double v = strtod(text, &end);
    if (*end || end == text || !isfinite(v))
        return -1;
    *value = v;
    return 0;
}

/* Whole decimal number of 64 bits. */
static int whole(const char *text, int64_t *value)
{
    const char *digits = text + (*text == '-');
    if (!*digits || digits[strspn(digits, "0123456789")])
        return -1;
    errno = 0;
    *value = strtoll(text, NULL, 10);
    return errno ? -1 : 0;
}

static int unsigned_whole(const char *text, uint64_t *value)
{
    if (!*text || text[strspn(text, "0123456789")])
        return -1;
    errno = 0;
    *value = strtoull(text, NULL, 10);
    return errno ? -1 : 0;
}

/* Edits (insert, delete, replace, swap neighbours) between short words, for "did you mean". */
static int distance(const char *a, const char *b)
{
    enum { LONGEST = 40 };
    int d[LONGEST + 1][LONGEST + 1];
    const int na = (int)strlen(a), nb = (int)strlen(b);
    if (na > LONGEST || nb > LONGEST)
        return 99;
    for (int i = 0; i <= na; i++)
        d[i][0] = i;
    for (int j = 0; j <= nb; j++)
        d[0][j] = j;
    for (int i = 1; i <= na; i++)
        for (int j = 1; j <= nb; j++) {
            int best = d[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            if (d[i - 1][j] + 1 < best)
                best = d[i - 1][j] + 1;
            if (d[i][j - 1] + 1 < best)
                best = d[i][j - 1] + 1;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && d[i - 2][j - 2] + 1 < best)
                best = d[i - 2][j - 2] + 1;
            d[i][j] = best;
        }
    return d[na][nb];
}

static const char *nearest(const struct opt *own, const char *name)
{
    const char *best = NULL;
    int least = 4;
    const struct opt *tables[2] = {own, shared_options};
    for (int t = 0; t < 2; t++)
        for (const struct opt *o = tables[t]; o->name; o++) {
            int d = distance(name, o->name);
            if (strncmp(name, o->name, strlen(name)) == 0 && d > 2)
                d = 2;
            if (d < least) {
                least = d;
                best = o->name;
            }
        }
    return best;
}

_Noreturn static void bad_value(const struct opt *o, const char *text, const char *want)
{
    die(EXIT_USAGE, "option --%s: '%s': %s (--help shows all options)", o->name, text, want);
}

static double ranged(const struct opt *o, const char *whole_text, const char *text)
{
    char want[120];
    double v;
    if (opt_number(text, &v))
        bad_value(o, whole_text, "not a number");
    if (!(v >= o->lo && v <= o->hi)) {
        snprintf(want, sizeof want, "allowed are %g to %g", o->lo, o->hi);
        bad_value(o, whole_text, want);
    }
    return v;
}

/* "A,B,..." into at most max numbers; returns their count. */
static size_t list(const struct opt *o, const char *text, double *v, size_t max)
{
    char *copy = strdup(text), *rest = copy;
    if (!copy)
        die(EXIT_RUN, "option --%s: %s", o->name, err_text(E_NOMEM));
    size_t n = 0;
    for (char *item; (item = strsep(&rest, ",")); n++) {
        if (n == max)
            bad_value(o, text, "too many numbers");
        v[n] = ranged(o, text, item);
    }
    free(copy);
    return n;
}

static int choice(const struct opt *o, const char *text)
{
    char want[160];
    size_t n = strlen(text);
    int k = 0;
    for (const char *p = o->choices; p; k++) {
        const char *bar = strchr(p, '|');
        size_t len = bar ? (size_t)(bar - p) : strlen(p);
        if (n == len && strncmp(p, text, n) == 0)
            return k;
        p = bar ? bar + 1 : NULL;
    }
    snprintf(want, sizeof want, "use one of %s", o->choices);
    bad_value(o, text, want);
}

static void append_string(const struct opt *o, const char *text)
{
    struct opt_strs *s = o->value;
    const char **v = realloc(s->v, (s->n + 1) * sizeof *v);
    if (!v)
        die(EXIT_RUN, "option --%s: %s", o->name, err_text(E_NOMEM));
    s->v = v;
    v[s->n++] = text;
}

static void take_reals(const struct opt *o, const char *text)
{
    struct opt_reals *r = o->value;
    size_t max = 1;
    for (const char *p = text; *p; p++)
        max += *p == ',';
    double *v = malloc(max * sizeof *v);
    if (!v)
        die(EXIT_RUN, "option --%s: %s", o->name, err_text(E_NOMEM));
    r->n = list(o, text, v, max);
    free(r->v);
    r->v = v;
}

void opt_free(const struct opt *own)
{
    for (const struct opt *o = own; o->name; o++)
        if (o->type == OPT_REALS) {
            struct opt_reals *r = o->value;
            free(r->v);
            *r = (struct opt_reals){0};
        } else if (o->type == OPT_STRS) {
            struct opt_strs *s = o->value;
            free(s->v);
            *s = (struct opt_strs){0};
        }
}

static void take_long(const struct opt *o, const char *text)
{
    char want[120];
    int64_t v;
    if (whole(text, &v))
        bad_value(o, text, "not a whole number");
    if (!((double)v >= o->lo && (double)v <= o->hi)) {
        snprintf(want, sizeof want, "allowed are %.0f to %.0f", o->lo, o->hi);
        bad_value(o, text, want);
    }
    *(long *)o->value = (long)v;
}

static void take(const struct opt *o, const char *text)
{
    if (o->type != OPT_FLAG && !*text)
        bad_value(o, text, "the value is empty");
    switch (o->type) {
    case OPT_FLAG: *(int *)o->value = 1; break;
    case OPT_LONG: take_long(o, text); break;
    case OPT_REAL: *(double *)o->value = ranged(o, text, text); break;
    case OPT_STR: *(const char **)o->value = text; break;
    case OPT_CHOICE: *(int *)o->value = choice(o, text); break;
    case OPT_REALS: take_reals(o, text); break;
    case OPT_STRS: append_string(o, text); break;
    case OPT_PAIR: {
        double v[2];
        if (list(o, text, v, 2) != 2)
            bad_value(o, text, "two numbers with a comma between are needed");
        memcpy(o->value, v, sizeof v);
        break;
    }
    }
}

/* Bytes with an optional K, M or G. */
static double bytes(const struct opt *o, const char *text)
{
    char number[64];
    size_t n = strlen(text);
    if (n == 0 || n >= sizeof number)
        bad_value(o, text, "not a number of bytes");
    const char last = text[n - 1];
    const double unit = last == 'K' ? 0x1p10 : last == 'M' ? 0x1p20 : last == 'G' ? 0x1p30 : 1;
    memcpy(number, text, n + 1);
    if (unit > 1)
        number[n - 1] = 0;
    return ranged(o, text, number) * unit;
}

static void help(const struct parser *p);

static void take_shared(const struct parser *p, const struct opt *o, const char *text)
{
    struct common *c = p->c;
    uint64_t v;
    switch (o->letter ? o->letter : o->name[0]) {
    case 'o':
        if (!*text)
            bad_value(o, text, "the value is empty");
        c->out = text;
        break;
    case 's':
        if (unsigned_whole(text, &c->seed))
            bad_value(o, text, "a whole number from 0 to 2^64 - 1 is needed");
        break;
    case 'j':
        if (unsigned_whole(text, &v) || v < 1 || v > 256)
            bad_value(o, text, "allowed are 1 to 256");
        c->threads = (int)v;
        break;
    case 'm': c->max_memory = bytes(o, text); break;
    case 'c': c->check = 1; break;
    case 'v': c->verbose = 1; break;
    case 'q': c->quiet = 1; break;
    case 'h': help(p); break;
    case 'V':
        printf("%s (pixshear) %s\n", p->prog->name, PIXSHEAR_VERSION);
        if (fflush(stdout) || ferror(stdout))
            die(EXIT_RUN, "standard output: %s", strerror(errno));
        exit(EXIT_DONE);
    }
}

static const struct opt *by_name(const struct opt *table, const char *name, size_t n)
{
    for (const struct opt *o = table; o->name; o++)
        if (strlen(o->name) == n && strncmp(o->name, name, n) == 0)
            return o;
    return NULL;
}

static const struct opt *by_letter(const struct opt *table, int letter)
{
    for (const struct opt *o = table; o->name; o++)
        if (o->letter == letter)
            return o;
    return NULL;
}

static void apply(const struct parser *p, const struct opt *o, const char *text)
{
    if (o >= shared_options && o < shared_options + sizeof shared_options / sizeof *shared_options) {
        take_shared(p, o, text);
        return;
    }
    take(o, text);
    size_t at = (size_t)(o - p->own);
    if (at < sizeof p->c->given)
        p->c->given[at] = 1;
}

/* argv[i] is "--name" or "--name=value"; returns the index of the last word used. */
static int long_option(const struct parser *p, int i)
{
    const char *name = p->argv[i] + 2, *equals = strchr(name, '=');
    size_t n = equals ? (size_t)(equals - name) : strlen(name);
    const struct opt *o = by_name(p->own, name, n);
    if (!o)
        o = by_name(shared_options, name, n);
    if (!o) {
        char word[64];
        snprintf(word, sizeof word, "%.*s", (int)n, name);
        const char *near = nearest(p->own, word);
        if (near)
            die(EXIT_USAGE, "unknown option --%s: did you mean --%s?", word, near);
        die(EXIT_USAGE, "unknown option --%s: --help shows all options", word);
    }
    if (o->type == OPT_FLAG) {
        if (equals)
            bad_value(o, equals + 1, "this option takes no value");
        apply(p, o, "");
        return i;
    }
    if (equals) {
        apply(p, o, equals + 1);
        return i;
    }
    if (i + 1 >= p->argc)
        die(EXIT_USAGE, "option --%s: a value is missing: %s", o->name, o->arg);
    apply(p, o, p->argv[i + 1]);
    return i + 1;
}

/* argv[i] is "-abc" or "-avalue"; returns the index of the last word used. */
static int short_options(const struct parser *p, int i)
{
    for (const char *s = p->argv[i] + 1; *s; s++) {
        const struct opt *o = by_letter(p->own, *s);
        if (!o)
            o = by_letter(shared_options, *s);
        if (!o)
            die(EXIT_USAGE, "unknown option -%c: --help shows all options", *s);
        if (o->type == OPT_FLAG) {
            apply(p, o, "");
            continue;
        }
        if (s[1]) {
            apply(p, o, s + 1);
            return i;
        }
        if (i + 1 >= p->argc)
            die(EXIT_USAGE, "option -%c: a value is missing: %s", *s, o->arg);
        apply(p, o, p->argv[i + 1]);
        return i + 1;
    }
    return i;
}

static int allowed(const struct opt *o, double v)
{
    return v >= o->lo && v <= o->hi;
}

/* A value that could not be typed stands for "not given"; a line that tells the default itself needs no other. */
static void print_default(const struct opt *o)
{
    if (strstr(o->help, "default"))
        return;
    switch (o->type) {
    case OPT_LONG:
        if (allowed(o, (double)*(const long *)o->value))
            printf(" [%ld]", *(const long *)o->value);
        break;
    case OPT_REAL:
        if (allowed(o, *(const double *)o->value))
            printf(" [%.10g]", *(const double *)o->value);
        break;
    case OPT_PAIR: {
        const double *v = o->value;
        if (allowed(o, v[0]) && allowed(o, v[1]))
            printf(" [%.10g,%.10g]", v[0], v[1]);
        break;
    }
    case OPT_STR:
        if (*(const char *const *)o->value)
            printf(" [%s]", *(const char *const *)o->value);
        break;
    case OPT_CHOICE: {
        const char *p = o->choices;
        for (int k = *(const int *)o->value; k > 0 && p; k--) {
            p = strchr(p, '|');
            p += p != NULL;
        }
        if (p && *(const int *)o->value >= 0)
            printf(" [%.*s]", (int)strcspn(p, "|"), p);
        break;
    }
    case OPT_FLAG: case OPT_REALS: case OPT_STRS: break;
    }
}

static void help_line(const struct opt *o)
{
    char left[80];
    const char *arg = o->type == OPT_CHOICE ? o->choices : o->arg;
    if (o->letter)
        snprintf(left, sizeof left, "-%c --%s%s%s", o->letter, o->name, arg ? " " : "", arg ? arg : "");
    else
        snprintf(left, sizeof left, "   --%s%s%s", o->name, arg ? " " : "", arg ? arg : "");
    if (strlen(left) > 30)
        printf("  %s\n  %30s %s", left, "", o->help);
    else
        printf("  %-30s %s", left, o->help);
    if (o->value)
        print_default(o);
    putchar('\n');
}

static void help(const struct parser *p)
{
    printf("usage: %s [OPTION]...%s%s\n%s\n\n", p->prog->name, *p->prog->operands ? " " : "", p->prog->operands, p->prog->what);
    for (const struct opt *o = p->own; o->name; o++)
        help_line(o);
    printf("\n");
    for (const struct opt *o = shared_options; o->name; o++)
        help_line(o);
    if (p->prog->examples)
        printf("\nexamples:\n%s%s", p->prog->examples, p->prog->examples[strlen(p->prog->examples) - 1] == '\n' ? "" : "\n");
    if (fflush(stdout) || ferror(stdout))
        die(EXIT_RUN, "standard output: %s", strerror(errno));
    exit(EXIT_DONE);
}

/* --completion: one option a line, for the shells' completion and for the man page test. */
static void completion(const struct parser *p)
{
    const struct opt *tables[2] = {p->own, shared_options};
    for (int t = 0; t < 2; t++)
        for (const struct opt *o = tables[t]; o->name; o++)
            printf("--%s%s\t%c\t%s\t%s\n", o->name, o->type == OPT_FLAG ? "" : "=", o->letter ? o->letter : '-',
                   o->choices ? o->choices : o->in_file ? "FILE" : o->arg ? o->arg : "", t ? "common" : "own");
    if (fflush(stdout) || ferror(stdout))
        die(EXIT_RUN, "standard output: %s", strerror(errno));
    exit(EXIT_DONE);
}

static double physical_memory(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGESIZE);
    return pages > 0 && size > 0 ? (double)pages * (double)size : 4e9;
}

void opt_output(const char *name, enum out_format format)
{
    const char *promise = outname_promises(name, format);
    static const char *const what[] = {[OUT_FITS] = "FITS", [OUT_TABLE] = "a catalogue (text, or FITS under .fits)",
                                       [OUT_LDAC] = "a catalogue (text, or FITS under .fits and .ldac)", [OUT_LINES] = "text", [OUT_REGION] = "a region file"};
    if (promise)
        die(EXIT_USAGE, "%s: the name promises %s, but %s is written: give another name", name, promise, what[format]);
}

/* Names of outputs promise no other format than they get. */
static void check_names(const struct program *prog, const struct opt *own, const struct common *c)
{
    opt_output(c->out, prog->writes);
    for (const struct opt *o = own; o->name; o++) {
        const struct opt_strs *s = o->value;
        const enum out_format format = o->in_file > 1 ? (enum out_format)(o->in_file - 1) : OUT_ANY;
        if (o->type == OPT_STR && format && *(const char *const *)o->value)
            opt_output(*(const char *const *)o->value, format);
        for (size_t i = 0; o->type == OPT_STRS && format && i < s->n; i++)
            opt_output(s->v[i], format);
    }
}

/* Files of a value that are "-"; IMAGE,CATALOGUE is two, unless one file has that name. */
static int standard_in(const char *value)
{
    const char *comma = strchr(value, ',') && access(value, F_OK) ? strrchr(value, ',') : NULL;
    if (!comma)
        return strcmp(value, "-") == 0;
    return (comma == value + 1 && *value == '-') + (strcmp(comma + 1, "-") == 0);
}

/* Standard input has only one file to give, be it an operand or the value of an option. */
static void check_standard_input(const struct program *prog, const struct opt *own, const struct common *c)
{
    int inputs = 0;
    for (int i = 0; i < c->argc; i++)
        inputs += strcmp(c->argv[i], "-") == 0;
    for (const struct opt *o = own; o->name; o++) {
        const struct opt_strs *s = o->value;
        if (o->in_file == 1 && o->type == OPT_STR && *(const char *const *)o->value)
            inputs += standard_in(*(const char *const *)o->value);
        for (size_t i = 0; o->in_file == 1 && o->type == OPT_STRS && i < s->n; i++)
            inputs += standard_in(s->v[i]);
    }
    if (inputs > 1)
        die(EXIT_USAGE, "standard input can be read once only, not as %d inputs: give files", inputs);
    if (inputs == 1 && isatty(STDIN_FILENO))
        die(EXIT_USAGE, "standard input is a terminal: usage: %s [OPTION]... %s", prog->name, prog->operands);
}

void opt_parse(const struct program *prog, const struct opt *own, struct common *c, int argc, char **argv)
{
    struct parser p = {prog, own, c, argc, argv};
    c->max_memory = physical_memory();
    c->argv = (const char **)argv + 1;    /* operands move to the front of the array */
    int options = 1;
    for (int i = 1; i < argc; i++) {
        const char *word = argv[i];
        if (!options || word[0] != '-' || !word[1])
            c->argv[c->argc++] = word;
        else if (strcmp(word, "--") == 0)
            options = 0;
        else if (strcmp(word, "--completion") == 0)
            completion(&p);
        else
            i = word[1] == '-' ? long_option(&p, i) : short_options(&p, i);
    }
    if (prog->max_operands >= 0 && c->argc > prog->max_operands)
        die(EXIT_USAGE, "%s: one operand too many: usage: %s [OPTION]... %s", c->argv[prog->max_operands],
            prog->name, prog->operands);
    if (c->argc < prog->min_operands)
        die(EXIT_USAGE, "an operand is missing: usage: %s [OPTION]... %s", prog->name, prog->operands);
    if (c->argc == 0 && prog->max_operands != 0)
        c->argv[c->argc++] = "-";
    for (int i = 0; i < c->argc; i++)
        if (!*c->argv[i])
            die(EXIT_USAGE, "operand %d is an empty name", i + 1);
    check_standard_input(prog, own, c);
    check_names(prog, own, c);
}

int opt_given(const struct opt *own, const struct common *c, const char *name)
{
    const struct opt *o = by_name(own, name, strlen(name));
    return o && (size_t)(o - own) < sizeof c->given && c->given[o - own];
}

void opt_idle(const struct opt *own, const struct common *c, const char *const *names, const char *why)
{
    for (; *names; names++)
        if (opt_given(own, c, *names))
            die(EXIT_USAGE, "--%s would do nothing %s: leave it out", *names, why);
}

/* ---- the HISTORY record ---- */

/* Text that grows; open_memstream would lose text without a word when memory ends. */
struct text {
    char *s;
    size_t n;
};

PRINTF_LIKE(2, 3) static void put(struct text *t, const char *fmt, ...)
{
    va_list ap, again;
    va_start(ap, fmt);
    va_copy(again, ap);
    int more = vsnprintf(NULL, 0, fmt, ap);
    va_end(ap);
    char *s = more < 0 ? NULL : realloc(t->s, t->n + (size_t)more + 1);
    if (!s)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    vsnprintf(s + t->n, (size_t)more + 1, fmt, again);
    va_end(again);
    t->s = s;
    t->n += (size_t)more;
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash && slash[1] ? slash + 1 : path;
}

static void word_out(struct text *t, const char *text)
{
    static const char safe[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,:/@%[]";
    if (*text && !text[strspn(text, safe)]) {
        put(t, " %s", text);
        return;
    }
    put(t, " '");
    for (; *text; text++) {
        if (*text == '\'')
            put(t, "'\\''");
        else
            put(t, "%c", isprint((unsigned char)*text) ? *text : '?');
    }
    put(t, "'");
}

/* Base names: of FILE, of both files of "IMAGE,CATALOGUE", and of the file in "TYPE=FILE". */
static void file_out(struct text *t, const char *value)
{
    char *kept = strdup(value), *to = kept;
    if (!kept)
        die(EXIT_RUN, "%s", err_text(E_NOMEM));
    char *part = kept;
    for (const char *from = value; *from; from++) {
        if (*from == '/')
            to = part;
        else
            *to++ = *from;
        if (*from == ',' || *from == '=')
            part = to;
    }
    *to = 0;
    word_out(t, kept);
    free(kept);
}

static void choice_out(struct text *t, const struct opt *o)
{
    const char *p = o->choices;
    for (int k = *(const int *)o->value; k > 0; k--)
        p = strchr(p, '|') + 1;
    put(t, " %.*s", (int)strcspn(p, "|"), p);
}

static void value_out(struct text *t, const struct opt *o)
{
    const double *pair = o->value;
    const struct opt_reals *r = o->value;
    switch (o->type) {
    case OPT_FLAG: break;
    case OPT_LONG: put(t, " %ld", *(const long *)o->value); break;
    case OPT_REAL: put(t, " %.15g", *(const double *)o->value); break;
    case OPT_PAIR: put(t, " %.15g,%.15g", pair[0], pair[1]); break;
    case OPT_CHOICE: choice_out(t, o); break;
    case OPT_REALS:
        for (size_t i = 0; i < r->n; i++)
            put(t, "%c%.15g", i ? ',' : ' ', r->v[i]);
        break;
    case OPT_STR:
        if (o->in_file)
            file_out(t, *(const char *const *)o->value);
        else
            word_out(t, *(const char *const *)o->value);
        break;
    case OPT_STRS: break;
    }
}

static void own_options_out(struct text *t, const struct opt *own, const struct common *c)
{
    for (const struct opt *o = own; o->name; o++) {
        if (!opt_given(own, c, o->name))
            continue;
        if (o->type != OPT_STRS) {
            put(t, " --%s", o->name);
            value_out(t, o);
            continue;
        }
        const struct opt_strs *s = o->value;
        for (size_t i = 0; i < s->n; i++) {
            put(t, " --%s", o->name);
            if (o->in_file)
                file_out(t, s->v[i]);
            else
                word_out(t, s->v[i]);
        }
    }
}

char *opt_record(const struct program *prog, const struct opt *own, const struct common *c)
{
    struct text t = {0};
    put(&t, "%s %s: %s", prog->name, PIXSHEAR_VERSION, prog->name);
    own_options_out(&t, own, c);
    if (c->seed != 1)
        put(&t, " --seed %llu", (unsigned long long)c->seed);
    for (int i = 0; i < c->argc; i++)
        word_out(&t, base_name(c->argv[i]));
    return t.s;
}
