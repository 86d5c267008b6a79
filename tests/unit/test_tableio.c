/* Catalogues through files: what must work, and that faults are named with file and line. */
#include "check.h"
#include "tableio.h"
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double memory = 1e9;

static int put_file(const char *name, const char *text, size_t n)
{
    FILE *f = fopen(name, "wb");
    int good = f && fwrite(text, 1, n, f) == n;
    return f ? fclose(f) == 0 && good : 0;
}

/* Read `text` as a file; the cause of failure is in e. */
static int read_text(struct table *t, const char *text, struct err *e)
{
    *t = (struct table){0};
    e->text[0] = '\0';
    return put_file("in.txt", text, strlen(text)) ? table_read(t, "in.txt", memory, e) : E_IO;
}

/* The text must be refused and the message be `want`. */
static void refuse(const char *text, const char *want)
{
    struct table t;
    struct err e;
    int st = read_text(&t, text, &e);
    check_that(st != OK && strcmp(e.text, want) == 0 && t.ncol == 0, "refused: %s", e.text);
    if (st == OK)
        table_free(&t);
    if (strcmp(e.text, want) != 0)
        printf("# wanted: %s\n", want);
}

static void test_refused(void)
{
    refuse("", "in.txt: the file is empty");
    refuse("# ID NAME\n1 a\x0c""b\n", "in.txt: line 2: column NAME: 'a\x0c""b' is not one plain word");
    refuse("# ID NAME\n1 a\n2 #b\n", "in.txt: line 3: column NAME: '#b' is not one plain word");
    refuse("1 2\n", "in.txt: no column names: the header needs a line '# NAME NAME ...' in capital letters");
    refuse("# this has no names\n1 2\n", "in.txt: no column names: the header needs a line '# NAME NAME ...' in capital letters");
    refuse("# X FLUX\n1 2\n1 1.5abc\n", "in.txt: line 3: column FLUX: '1.5abc' is not a number");
    refuse("# X FLUX\n1 2\n1 1,5\n", "in.txt: line 3: column FLUX: '1,5' is not a number");
    refuse("# X FLUX\n1 2\n1 0x1F\n", "in.txt: line 3: column FLUX: '0x1F' is not a number");
    refuse("# X FLUX\n1 2\n1 inf\n", "in.txt: line 3: column FLUX: 'inf' is not a number");
    refuse("# X FLUX\n1 2\n1 1e400\n", "in.txt: line 3: column FLUX: '1e400' is too large");
    refuse("# X N\n1 2\n1 99999999999999999999\n", "in.txt: line 3: column N: '99999999999999999999' is too large");
    refuse("# X FLUX\n1 2\n\n1\n", "in.txt: line 4: 1 cells where the header names 2 columns");
    refuse("# X FLUX\n1 2\n1 2 3\n", "in.txt: line 3: 3 cells where the header names 2 columns");
    refuse("# X X\n1 2\n", "in.txt: the header names column X twice");
    /* a text of ours would begin "# HISTORY B", and the names were gone on reading it */
    refuse("#   1 HISTORY  one thing\n#   2 B  another thing\n1 2\n", "in.txt: a column HISTORY: such a line of names would be one of history: call it otherwise");
    refuse("# B HISTORY\n1 2\n", "in.txt: a column HISTORY: such a line of names would be one of history: call it otherwise");
    refuse("# X Y\n# Column 2: Z [pixel,f64] a column\n1 2\n", "in.txt: the header calls column 2 both Z and Y");
    refuse("# X Y\n# Column 2: Y [pixel,f77] a column\n1 2\n", "in.txt: line 2: type 'f77' is unknown (i64, f64, f32, str16)");
    refuse("# X Y\n# Column 2: Y [pixel,f64 a column\n1 2\n", "in.txt: line 2: a bracket is not closed");
    refuse("# X Y\n# Column two: Y\n1 2\n", "in.txt: line 2: '# Column' must be followed by a number and a colon");
    refuse("# X Y\n# Column 3: Z [,f64] a column\n1 2\n", "in.txt: the header describes 3 columns and names 2");
    refuse("# X Y\n# Column 99999: Z [,f64] a column\n1 2\n", "in.txt: line 2: column number 99999 is not in 1..4096");
    refuse("# X Y\n# Column 2: Y [,i64] a number\n1 nan\n", "in.txt: line 3: column Y: 'nan' is not a whole number");
    refuse("# X Y\n# Column 2: Y [,i64] a number\n1 1.0\n", "in.txt: line 3: column Y: '1.0' is not a whole number");
    refuse("# X\n# Keyword: A = 1\n# Keyword: A = 2\n1\n", "in.txt: line 3: keyword A is given twice");
    refuse("# X\n# Keyword: A 1\n1\n", "in.txt: line 2: a Keyword line must be '# Keyword: NAME = VALUE'");
    refuse("# X\n# Keyword: a = 1\n1\n", "in.txt: line 2: keyword 'a' is not in capital letters, digits and _");
    refuse("# ID COEFFS\n1 2 3\n2\n", "in.txt: line 3: 1 cells where the header names 2 columns");
    refuse("# ID COEFFS\n1 2 3\n2 1 x\n", "in.txt: line 3: column COEFFS: 'x' is not a number");
    refuse("# X Y\n1 2\n# Y X\n2 1\n", "in.txt: line 3: a second header with other columns");
    refuse("# 2 Y second\n1 2\n", "in.txt: the header does not name column 1");
    refuse("# 1 x first\n1\n", "in.txt: column 1: the name 'x' is not in capital letters, digits and _");
    struct table t = {0};
    struct err e;
    check_that(put_file("in.txt", "# X\n1\0\n", 7) && table_read(&t, "in.txt", memory, &e) == E_DATA
               && strcmp(e.text, "in.txt: line 2: a NUL byte: this is not a text catalogue") == 0, "NUL bytes: %s", e.text);
    char *big = malloc(200000);
    if (!big)
        return;
    memset(big, '1', 200000);
    memcpy(big, "# X\n", 4);
    check_that(put_file("in.txt", big, 4 + 65537) && table_read(&t, "in.txt", memory, &e) == E_DATA
               && strcmp(e.text, "in.txt: line 2: longer than 65536 bytes") == 0, "long lines: %s", e.text);
    memset(big + 4, ' ', 65536);
    big[5] = '7';
    check_that(put_file("in.txt", big, 4 + 65536) && table_read(&t, "in.txt", memory, &e) == OK && t.nrow == 1
               && table_ints(&t, "X")[0] == 7, "a line of 65536 bytes is read");
    table_free(&t);
    free(big);
    check_that(table_read(&t, "none.txt", memory, &e) == E_IO && strcmp(e.text, "none.txt: No such file or directory") == 0,
               "a missing file: %s", e.text);
    check_that(table_read(&t, "/", memory, &e) == E_IO, "a folder: %s", e.text);
}

static void test_forms(void)
{
    struct table t;
    struct err e;
    check_that(read_text(&t, "# NUMBER X TYPE\r\n1 2 star\r\n\r\n2\t2.5   gauss  ", &e) == OK && t.nrow == 2 && t.ncol == 3
               && table_ints(&t, "NUMBER") && table_ints(&t, "NUMBER")[1] == 2 && table_reals(&t, "X") && table_reals(&t, "X")[0] == 2
               && t.col[2].type == COL_TEXT && strcmp(t.col[2].v.s[1], "gauss") == 0,
               "CRLF, tabs, empty lines, no newline at the end; types from cells (%s)", e.text);
    table_free(&t);
    check_that(read_text(&t, "#   1 NUMBER          Running object number\n#   2 FLUX_APER   Flux vector  [count]\n"
                             "#   4 MAG             Magnitude [mag]\n1 2 nan 4\n", &e) == OK && t.ncol == 4
               && strcmp(t.col[2].name, "FLUX_APER_1") == 0 && strcmp(t.col[3].unit, "mag") == 0 && table_reals(&t, "FLUX_APER_1")
               && strcmp(t.col[1].what, "Flux vector") == 0, "Source Extractor's header, with a vector (%s)", e.text);
    table_free(&t);
    check_that(read_text(&t, "# free words before\n# X Y\n", &e) == OK && t.nrow == 0 && t.ncol == 2, "a header without rows (%s)", e.text);
    table_free(&t);
    check_that(read_text(&t, "# A B\n# Column 1: A [mag,f32] a real\n# Column 2: B [,str4] a word\n1 2\n# a comment\n# A B\n3 4\n", &e) == OK
               && t.nrow == 2 && t.col[0].type == COL_REAL32 && strcmp(t.col[0].unit, "mag") == 0 && t.col[1].type == COL_TEXT
               && strcmp(t.col[1].v.s[1], "4") == 0, "types from the header; comments and the same header among rows (%s)", e.text);
    table_free(&t);
}

/* Two tables the same, cell by cell, bit by bit. */
static int same(const struct table *a, const struct table *b)
{
    int good = a->nrow == b->nrow && a->ncol == b->ncol && a->nkey == b->nkey && a->nhistory == b->nhistory;
    for (size_t i = 0; i < a->ncol && good; i++) {
        const struct column *x = &a->col[i], *y = &b->col[i];
        good = x->type == y->type && !strcmp(x->name, y->name) && !strcmp(x->unit, y->unit) && !strcmp(x->what, y->what);
        size_t n = x->type == COL_RAGGED ? x->start[a->nrow] : a->nrow;
        if (good && x->type == COL_RAGGED)
            good = memcmp(x->start, y->start, (a->nrow + 1) * sizeof *x->start) == 0;
        for (size_t j = 0; j < n && good; j++)
            good = x->type == COL_TEXT ? !strcmp(x->v.s[j], y->v.s[j])
                 : x->type == COL_INT ? x->v.i[j] == y->v.i[j] : !memcmp(&x->v.r[j], &y->v.r[j], sizeof(double));
    }
    for (size_t i = 0; i < a->nkey && good; i++)
        good = !strcmp(a->key[i].name, b->key[i].name) && !strcmp(a->key[i].value, b->key[i].value);
    for (size_t i = 0; i < a->nhistory && good; i++)
        good = !strcmp(a->history[i], b->history[i]);
    return good;
}

static int build(struct table *t, size_t nrow)
{
    *t = (struct table){0};
    int st = table_add(t, "ID", COL_INT, "", "Running object number") || table_add(t, "X_IMAGE", COL_REAL, "pixel", "Centroid, first pixel centre is 1")
        || table_add(t, "MAG", COL_REAL32, "mag", "Magnitude of it") || table_add(t, "TYPE", COL_TEXT, "", "Kind of object")
        || table_add(t, "COEFFS", COL_RAGGED, "1/arcsec", "Coefficients to the end") || table_set_text(t, "SETNAME", "Sim 1")
        || table_set_number(t, "PIXSCALE", 0.1) || table_history(t, "made 1.0: made --by 'a test'") || table_resize(t, nrow);
    double v[5];
    for (size_t i = 0; i < nrow && !st; i++) {
        t->col[0].v.i[i] = (int64_t)(i * i) * (i % 2 ? -1 : 1);
        t->col[1].v.r[i] = i % 10 == 3 ? (double)NAN : sqrt((double)i) * 1e3;
        t->col[2].v.r[i] = (double)(float)(20 + log1p((double)i));
        for (size_t j = 0; j < 5; j++)
            v[j] = sin((double)(i + j)) * pow(10, -(double)(i % 12));
        st = table_set_word(&t->col[3], i, i % 3 ? "star" : "shapelet") || table_ragged(t, &t->col[4], i, v, 1 + i % 5);
    }
    return st;
}

static void test_round_trip(void)
{
    struct table t, back;
    struct err e = {""};
    if (!check_that(build(&t, 5000) == 0, "a catalogue of 5000 rows"))
        return;
    check_that(table_write(&t, "out.txt", NULL, NULL, 0, &e) == OK, "written (%s)", e.text);
    check_that(table_read(&back, "out.txt", memory, &e) == OK, "read (%s)", e.text);
    check_that(same(&t, &back), "a catalogue comes back bit by bit");
    table_free(&back);
    check_that(table_write(&t, "out.txt", "prog 1: prog\n-x", NULL, 0, &e) == OK && table_read(&back, "out.txt", memory, &e) == OK
               && back.nhistory == 2 && strcmp(back.history[1], "prog 1: prog?-x") == 0, "the record is HISTORY, its control characters shown as ?");
    table_free(&back);
    check_that(table_set_word(&t.col[3], 4321, "two words") == OK && table_write(&t, "bad.txt", NULL, NULL, 0, &e) == E_DATA,
               "a cell with a blank is refused: %s", e.text);
    FILE *f = fopen("bad.txt", "r");
    check_that(!f, "and leaves no file");
    if (f)
        fclose(f);
    check_that(table_read(&back, "out.txt", 100000, &e) == E_NOMEM, "memory is bounded: %s", e.text);
    table_free(&t);
}

static void test_header_text(void)
{
    static const char want[] =
        "# ID MAG\n#   1 ID       Running object number\n#   2 MAG      AB magnitude [mag]\n"
        "# Column 1: ID       [,i64] Running object number\n# Column 2: MAG      [mag,f64] AB magnitude\n"
        "# Keyword: PIXSCALE = 0.1\n# HISTORY first\n# ID MAG\n7 nan\n";
    struct table t = {0};
    struct err e = {""};
    char got[1000] = "";
    int st = table_add(&t, "ID", COL_INT, "", "Running object number") || table_add(&t, "MAG", COL_REAL, "mag", "AB magnitude")
        || table_set_number(&t, "PIXSCALE", 0.1) || table_resize(&t, 1);
    if (!st)
        t.col[0].v.i[0] = 7;
    check_that(!st && table_write(&t, "out.txt", "first", NULL, 0, &e) == OK, "a small catalogue (%s)", e.text);
    FILE *f = fopen("out.txt", "r");
    if (f) {
        got[fread(got, 1, sizeof got - 1, f)] = '\0';
        fclose(f);
    }
    check_that(strcmp(got, want) == 0, "the four header parts, keywords before history");
    table_free(&t);
}

/* A comma in a unit or a bracket in a description must not end them in the file that we write. */
static void test_unit_text(void)
{
    struct table t, back = {0};
    struct err e = {""};
    int st = read_text(&t, "# ID X\n#   1 ID first number\n#   2 X Centroid [of light] along x [pix,el]\n7 1.5\n", &e);
    check_that(st == OK && strcmp(t.col[1].unit, "pix,el") == 0, "unit '%s' (%s)", st ? "" : t.col[1].unit, e.text);
    st = st ? st : table_write(&t, "unit.txt", NULL, NULL, 0, &e);
    st = st ? st : table_read(&back, "unit.txt", memory, &e);
    check_that(st == OK && back.ncol == 2 && table_number(&back.col[1], 0) == 1.5, "it is written so that it can be read (%s)", e.text);
    check_that(st == OK && strcmp(back.col[1].unit, "pix;el") == 0 && strcmp(back.col[1].what, "Centroid (of light) along x") == 0,
               "as unit '%s' and description '%s'", st ? "" : back.col[1].unit, st ? "" : back.col[1].what);
    table_free(&t);
    table_free(&back);
}

static void test_real_catalogue(void)
{
    char name[1000];
    const char *shared = getenv("SHARED");
    struct table t = {0};
    struct err e = {""};
    snprintf(name, sizeof name, "%s/data/hdf/hdfn_shapelets.txt", shared ? shared : "");
    FILE *f = shared ? fopen(name, "r") : NULL;
    if (!f) {
        check_skip("hdfn_shapelets.txt is not here");
        return;
    }
    fclose(f);
    check_that(table_read(&t, name, memory, &e) == OK && t.nrow == 28 && t.ncol == 7 && t.col[6].type == COL_RAGGED
               && t.col[6].start[1] == 136 && t.col[6].v.r[0] == 0.546650963 && table_reals(&t, "BETA")[27] > 0
               && strcmp(t.col[1].unit, "arcsec") == 0, "the HDF shapelet catalogue is read (%s)", e.text);
    table_free(&t);
}

static void test_speed(void)
{
    struct table t, back;
    struct err e = {""};
    if (build(&t, 100000))
        return;
    struct timespec a, b, c;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    int st = table_write(&t, "big.txt", NULL, NULL, 0, &e);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    st = st ? st : table_read(&back, "big.txt", memory, &e);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &c);
    FILE *f = fopen("big.txt", "r");
    long size = 0;
    if (f && fseek(f, 0, SEEK_END) == 0)
        size = ftell(f);
    if (f)
        fclose(f);
    double w = (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec);
    double r = (double)(c.tv_sec - b.tv_sec) + 1e-9 * (double)(c.tv_nsec - b.tv_nsec);
    printf("# written at %.1f MB/s, read at %.1f MB/s\n", 1e-6 * (double)size / w, 1e-6 * (double)size / r);
    check_that(!st && same(&t, &back), "100000 rows come back bit by bit (%s)", e.text);
    table_free(&t);
    if (!st)
        table_free(&back);
}

int main(void)
{
    test_refused();
    test_forms();
    test_round_trip();
    test_header_text();
    test_unit_text();
    test_real_catalogue();
    test_speed();
    return check_status();
}
