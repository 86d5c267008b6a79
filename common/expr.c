/* expr.c - conditions on the columns of a catalogue: a recursive parser to a list of nodes, and their values row by row. */
#include "expr.h"
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum op { NUMBER, COLUMN, WORD, MINUS, ADD, SUB, MUL, DIV, POWER, BITS, CALL, LT, LE, GT, GE, EQ, NE, NOT, AND, OR };

static const struct {
    const char *name;
    int arguments;
} function[] = {{"abs", 1}, {"sqrt", 1}, {"exp", 1}, {"log", 1}, {"log10", 1}, {"floor", 1}, {"hypot", 2}, {"min", 2}, {"max", 2}};
enum { FUNCTIONS = sizeof function / sizeof *function, DEEPEST = 64 };

/* ---- parser: functions return a node or -1, with e set ---- */

struct parser {
    const char *p, *all;
    struct expr *x;
    struct err *e;
    int depth;
};

static int condition(struct parser *s);

static void blanks(struct parser *s)
{
    while (isspace((unsigned char)*s->p))
        s->p++;
}

/* Takes the token when it is next. */
static int next(struct parser *s, const char *token)
{
    blanks(s);
    const size_t n = strlen(token);
    if (strncmp(s->p, token, n) != 0)
        return 0;
    s->p += n;
    return 1;
}

static int wrong(struct parser *s, const char *what)
{
    if (*s->p)
        err_set(s->e, E_DATA, "'%.200s': %s, before '%.60s'", s->all, what, s->p);
    else
        err_set(s->e, E_DATA, "'%.200s': %s, at its end", s->all, what);
    return -1;
}

static int add(struct parser *s, enum op op, int a, int b)
{
    if (s->x->n == EXPR_NODES)
        return wrong(s, "too long");
    s->x->node[s->x->n] = (struct expr_node){.op = (int)op, .a = a, .b = b};
    return (int)s->x->n++;
}

static int is_condition(const struct parser *s, int k)
{
    return s->x->node[k].op >= (int)LT;
}

/* A node of a leaf with its text. */
static int leaf(struct parser *s, enum op op, const char *text, size_t n)
{
    int k = n > 0 && n < sizeof s->x->node[0].text ? add(s, op, -1, -1) : wrong(s, "a name of 1 to 63 characters is needed");
    if (k >= 0)
        memcpy(s->x->node[k].text, text, n);
    return k;
}

static int number(struct parser *s)
{
    char *end;
    const double v = strtod(s->p, &end);
    const size_t n = (size_t)(end - s->p);
    if (n == 0 || !isfinite(v) || strcspn(s->p, "xX") < n)
        return wrong(s, "a number is needed");
    int k = leaf(s, NUMBER, s->p, n);
    if (k < 0)
        return -1;
    s->x->node[k].v = v;
    s->p = end;
    return k;
}

static size_t name_length(const char *p)
{
    size_t n = 0;
    if (isalpha((unsigned char)*p) || *p == '_')
        while (isalnum((unsigned char)p[n]) || p[n] == '_')
            n++;
    return n;
}

static int call(struct parser *s, size_t which)
{
    int arg[2] = {-1, -1};
    for (int i = 0; i < function[which].arguments; i++) {
        if (i > 0 && !next(s, ","))
            return wrong(s, "a comma and a second argument are needed");
        arg[i] = condition(s);
        if (arg[i] < 0)
            return -1;
        if (is_condition(s, arg[i]))
            return wrong(s, "a number is needed, not a comparison");
    }
    if (!next(s, ")"))
        return wrong(s, "a ) is needed");
    int k = add(s, CALL, arg[0], arg[1]);
    if (k >= 0)
        s->x->node[k].v = (double)which;
    return k;
}

static int quoted(struct parser *s)
{
    const char *from = s->p + 1, *to = strchr(from, *s->p);
    if (!to)
        return wrong(s, "a quote is not closed");
    int k = leaf(s, WORD, from, (size_t)(to - from));
    s->p = to + 1;
    return k;
}

static int atom(struct parser *s)
{
    blanks(s);
    if (*s->p == '\'' || *s->p == '"')
        return quoted(s);
    if (isdigit((unsigned char)*s->p) || *s->p == '.')
        return number(s);
    if (next(s, "(")) {
        int k = condition(s);
        return k < 0 || next(s, ")") ? k : wrong(s, "a ) is needed");
    }
    const char *from = s->p;
    const size_t n = name_length(from);
    if (n == 0 || (n == 3 && (strncasecmp(from, "nan", n) == 0 || strncasecmp(from, "inf", n) == 0)))
        return wrong(s, "a column or a number is needed");
    s->p += n;
    for (size_t k = 0; k < FUNCTIONS; k++)
        if (strlen(function[k].name) == n && strncmp(from, function[k].name, n) == 0 && next(s, "("))
            return call(s, k);
    return leaf(s, COLUMN, from, n);
}

/* op of two numbers */
static int numbers(struct parser *s, enum op op, int a, int b)
{
    if (a < 0 || b < 0)
        return -1;
    return is_condition(s, a) || is_condition(s, b) ? wrong(s, "a number is needed, not a comparison") : add(s, op, a, b);
}

static int signed_one(struct parser *s)
{
    if (++s->depth > DEEPEST)
        return wrong(s, "too deep");
    int k;
    if (next(s, "-")) {
        k = signed_one(s);
        k = numbers(s, MINUS, k, k);
    } else if (next(s, "+")) {
        k = signed_one(s);
    } else {
        k = atom(s);
        if (k >= 0 && next(s, "^"))
            k = numbers(s, POWER, k, signed_one(s));
    }
    s->depth--;
    return k;
}

static int product(struct parser *s)
{
    int k = signed_one(s);
    while (k >= 0) {
        blanks(s);
        if (next(s, "*"))
            k = numbers(s, MUL, k, signed_one(s));
        else if (next(s, "/"))
            k = numbers(s, DIV, k, signed_one(s));
        else if (s->p[0] == '&' && s->p[1] != '&' && next(s, "&"))
            k = numbers(s, BITS, k, signed_one(s));
        else
            break;
    }
    return k;
}

static int sum(struct parser *s)
{
    int k = product(s);
    while (k >= 0) {
        if (next(s, "+"))
            k = numbers(s, ADD, k, product(s));
        else if (next(s, "-"))
            k = numbers(s, SUB, k, product(s));
        else
            break;
    }
    return k;
}

static int comparison(struct parser *s)
{
    static const struct { const char *token; enum op op; } what[] = {{"<=", LE}, {"<", LT}, {">=", GE}, {">", GT}, {"==", EQ}, {"=", EQ}, {"!=", NE}};
    int k = sum(s);
    for (size_t i = 0; k >= 0 && i < sizeof what / sizeof *what; i++)
        if (next(s, what[i].token))
            return numbers(s, what[i].op, k, sum(s));
    return k;
}

/* op of two conditions, or of one twice */
static int conditions(struct parser *s, enum op op, int a, int b)
{
    if (a < 0 || b < 0)
        return -1;
    return is_condition(s, a) && is_condition(s, b) ? add(s, op, a, b) : wrong(s, "a comparison (< <= > >= = !=) is needed");
}

static int negation(struct parser *s)
{
    if (++s->depth > DEEPEST)
        return wrong(s, "too deep");
    blanks(s);
    int k;
    if (s->p[0] == '!' && s->p[1] != '=' && next(s, "!")) {
        k = negation(s);
        k = conditions(s, NOT, k, k);
    } else {
        k = comparison(s);
    }
    s->depth--;
    return k;
}

static int conjunction(struct parser *s)
{
    int k = negation(s);
    while (k >= 0 && next(s, "&&"))
        k = conditions(s, AND, k, negation(s));
    return k;
}

static int condition(struct parser *s)
{
    int k = conjunction(s);
    while (k >= 0 && next(s, "||"))
        k = conditions(s, OR, k, conjunction(s));
    return k;
}

int expr_parse(struct expr *x, const char *text, struct err *e)
{
    struct parser s = {.p = text, .all = text, .x = x, .e = e};
    x->n = 0;
    int k = condition(&s);
    blanks(&s);
    if (k >= 0 && *s.p)
        k = wrong(&s, "a comparison or && or || is needed");
    else if (k >= 0 && !is_condition(&s, k))
        k = wrong(&s, "a comparison (< <= > >= = !=) is needed");
    return k < 0 ? E_DATA : OK;
}

/* ---- columns and values ---- */

/* NAME = WORD, NAME != WORD with a column of words: its column, and the node that is the word. */
static int of_words(const struct expr *x, const struct expr_node *at, const struct table *t, const struct column **col, struct err *e)
{
    const struct expr_node *a = &x->node[at->a], *b = &x->node[at->b];
    const struct column *c = a->op == COLUMN ? table_find(t, a->text) : NULL;
    if (!c || c->type != COL_TEXT)
        return OK;
    if ((at->op != EQ && at->op != NE) || b->op > (int)WORD)
        return err_set(e, E_DATA, "column %s holds words: write = or != and one word, or '...'", a->text);
    col[at->a] = col[at->b] = c;
    return OK;
}

int expr_bind(const struct expr *x, const struct table *t, const struct column **col, struct err *e)
{
    for (size_t i = 0; i < x->n; i++)
        col[i] = NULL;
    for (size_t i = 0; i < x->n; i++) {
        const struct expr_node *at = &x->node[i];
        int st = at->op >= (int)LT && at->op <= (int)NE ? of_words(x, at, t, col, e) : OK;
        if (st)
            return st;
    }
    for (size_t i = 0; i < x->n; i++) {
        const struct expr_node *at = &x->node[i];
        if (col[i] || (at->op != COLUMN && at->op != WORD))
            continue;
        if (at->op == WORD)
            return err_set(e, E_DATA, "'%s' is compared with something that is no column of words", at->text);
        col[i] = table_find(t, at->text);
        if (!col[i] || col[i]->type == COL_RAGGED)
            return err_set(e, E_MISSING, "no column %s", at->text);
        if (col[i]->type == COL_TEXT)
            return err_set(e, E_DATA, "column %s holds words, no numbers", at->text);
    }
    return OK;
}

static double called(int which, double a, double b)
{
    switch (which) {
    case 0: return fabs(a);
    case 1: return sqrt(a);
    case 2: return exp(a);
    case 3: return log(a);
    case 4: return log10(a);
    case 5: return floor(a);
    case 6: return hypot(a, b);
    case 7: return isnan(a) || isnan(b) ? NAN : fmin(a, b);
    default: return isnan(a) || isnan(b) ? NAN : fmax(a, b);
    }
}

static double shared_bits(double a, double b)
{
    const double most = 9007199254740992.0;
    if (!(a >= 0 && a <= most && b >= 0 && b <= most) || a != floor(a) || b != floor(b))
        return NAN;
    return (double)((long long)a & (long long)b);
}

/* 1, 0, or nan with a missing value. */
static double compared(int op, double a, double b)
{
    if (isnan(a) || isnan(b))
        return NAN;
    switch (op) {
    case LT: return a < b;
    case LE: return a <= b;
    case GT: return a > b;
    case GE: return a >= b;
    case EQ: return a == b;
    default: return a != b;
    }
}

static double combined(const struct expr_node *at, double a, double b)
{
    switch (at->op) {
    case MINUS: return -a;
    case ADD: return a + b;
    case SUB: return a - b;
    case MUL: return a * b;
    case DIV: return a / b;
    case POWER: return pow(a, b);
    case BITS: return shared_bits(a, b);
    case CALL: return called((int)at->v, a, b);
    case NOT: return 1 - a;
    case AND: return a == 0 || b == 0 ? 0 : a * b;
    case OR: return a == 1 || b == 1 ? 1 : a + b;
    default: return compared(at->op, a, b);
    }
}

int expr_holds(const struct expr *x, const struct column *const *col, size_t row)
{
    double v[EXPR_NODES];
    for (size_t i = 0; i < x->n; i++) {
        const struct expr_node *at = &x->node[i];
        if (at->op == NUMBER || at->op == WORD) {
            v[i] = at->v;
        } else if (at->op == COLUMN) {
            v[i] = col[i]->type == COL_TEXT ? 0 : table_number(col[i], row);
        } else if (at->op >= (int)LT && at->op <= (int)NE && col[at->a] && col[at->a]->type == COL_TEXT) {
            const int same = strcmp(col[at->a]->v.s[row], x->node[at->b].text) == 0;
            v[i] = at->op == EQ ? same : !same;
        } else {
            v[i] = combined(at, v[at->a], at->b >= 0 ? v[at->b] : 0);
        }
    }
    return x->n > 0 && v[x->n - 1] == 1;
}
