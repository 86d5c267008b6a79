/* Scene lists and shapelet catalogues: what they mean, and rows that are refused by name. */
#include "check.h"
#include "scene.h"
#include <stdlib.h>
#include <string.h>

static int add_model(struct table *t, int64_t id, double beta, int64_t nmax, size_t n, double first)
{
    size_t i = t->nrow;
    double c[100] = {first};
    for (size_t k = 1; k < 100; k++)
        c[k] = (double)(10 * id) + (double)k;
    if (table_resize(t, i + 1) || table_ragged(t, &t->col[4], i, c, n))
        return 1;
    t->col[0].v.i[i] = id;
    t->col[1].v.r[i] = beta;
    t->col[2].v.i[i] = nmax;
    t->col[3].v.r[i] = 25;
    return 0;
}

static int new_catalogue(struct table *t)
{
    *t = (struct table){0};
    return table_add(t, "ID", COL_INT, "", "Model number") || table_add(t, "BETA", COL_REAL, "arcsec", "Scale length")
        || table_add(t, "NMAX", COL_INT, "", "Highest order") || table_add(t, "MAG", COL_REAL, "mag", "AB magnitude")
        || table_add(t, "COEFFS", COL_RAGGED, "1/arcsec", "The coefficients");
}

static void refuse_model(const char *want, int64_t id, double beta, int64_t nmax, size_t n, double first)
{
    struct table t;
    struct models m;
    struct err e = {""};
    int st = new_catalogue(&t) || add_model(&t, 7, 0.1, 1, 3, 1) || add_model(&t, id, beta, nmax, n, first);
    check_that(!st && models_open(&m, &t, "m", &e) == E_DATA && !strcmp(e.text, want), "refused: %s", e.text);
    table_free(&t);
}

static void test_models(void)
{
    struct table t;
    struct models m = {0};
    struct err e = {""};
    int st = new_catalogue(&t);
    for (int64_t i = 0; i < 1000 && !st; i++)
        st = add_model(&t, (i * 7919) % 1000 - 300, 0.1 + 0.001 * (double)i, i % 5, (size_t)((i % 5 + 1) * (i % 5 + 2) / 2), 1);
    if (!check_that(!st && models_open(&m, &t, "m", &e) == OK && m.n == 1000, "1000 models (%s)", e.text))
        return;
    int good = models_find(&m, -301) == m.n && models_find(&m, 700) == m.n;
    for (int64_t i = 0; i < 1000; i++) {
        size_t k = models_find(&m, (i * 7919) % 1000 - 300);
        good &= k == (size_t)i && m.nmax[k] == (int)(i % 5) && m.beta[k] == 0.1 + 0.001 * (double)i
             && (i % 5 == 0 || m.coef[m.offset[k] + 1] == (double)(10 * m.id[k] + 1));
    }
    check_that(good, "every ID is found with its numbers");
    models_free(&m);
    table_free(&t);
    refuse_model("m: row 2 (ID 8): BETA 0 must be > 0", 8, 0, 1, 3, 1);
    refuse_model("m: row 2 (ID 8): BETA nan must be > 0", 8, (double)NAN, 1, 3, 1);
    refuse_model("m: row 2 (ID 8): NMAX -1 must be in 0..60", 8, 0.1, -1, 1, 1);
    refuse_model("m: row 2 (ID 8): NMAX 61 must be in 0..60", 8, 0.1, 61, 3, 1);
    refuse_model("m: row 2 (ID 8): 2 COEFFS where NMAX 1 needs 3", 8, 0.1, 1, 2, 1);
    refuse_model("m: row 2 (ID 8): 4 COEFFS where NMAX 1 needs 3", 8, 0.1, 1, 4, 1);
    refuse_model("m: row 2 (ID 8): coefficient 1 is not finite", 8, 0.1, 1, 3, (double)NAN);
    refuse_model("m: rows 1 and 2 both have ID 7", 7, 0.1, 1, 3, 1);
    struct table none = {0};
    check_that(models_open(&m, &none, "m", &e) == E_MISSING, "a table without the columns: %s", e.text);
}

enum { DX, DY, MAG, TYPE, MODEL, PARITY, ROT, DILATION, G1, G2, RE, N, Q, PA, COLUMNS };

/* One shapelet, one star, one gauss, one sersic. */
static int new_scene(struct table *t)
{
    static const char *const names[COLUMNS] = {"DX", "DY", "MAG", "TYPE", "MODEL", "PARITY", "ROT", "DILATION", "G1", "G2", "RE", "N", "Q", "PA"};
    static const char *const types[] = {"shapelet", "star", "gauss", "sersic"};
    *t = (struct table){0};
    for (int i = 0; i < COLUMNS; i++)
        if (table_add(t, names[i], i == TYPE ? COL_TEXT : i == MODEL || i == PARITY ? COL_INT : COL_REAL, "", "Some column"))
            return 1;
    static const double row[COLUMNS] = {1, -2, 24, 0, 0, 0, 90, 2, 0.1, -0.2, 0.3, 4, 0.5, 45};
    if (table_resize(t, 4))
        return 1;
    for (size_t i = 0; i < 4; i++) {
        for (int j = 0; j < COLUMNS; j++)
            if (t->col[j].type == COL_REAL)
                t->col[j].v.r[i] = i == 1 && j > MAG ? (double)NAN : row[j];
        t->col[MODEL].v.i[i] = 7;
        t->col[PARITY].v.i[i] = -1;
        if (table_set_word(&t->col[TYPE], i, types[i]))
            return 1;
    }
    return 0;
}

static void refuse_scene(const struct models *m, int column, size_t row, double value, const char *want)
{
    struct table t;
    struct scene s;
    struct err e = {""};
    int st = new_scene(&t);
    if (!st && t.col[column].type == COL_INT)
        t.col[column].v.i[row] = (int64_t)value;
    else if (!st)
        t.col[column].v.r[row] = value;
    check_that(!st && scene_open(&s, &t, 0, m, 26, "s", &e) != OK && !strcmp(e.text, want), "refused: %s", e.text);
    if (strcmp(e.text, want))
        printf("# wanted %s\n", want);
    table_free(&t);
}

static void test_scene(void)
{
    struct table mt, t;
    struct models m = {0};
    struct scene s = {0};
    struct err e = {""};
    int st = new_catalogue(&mt) || add_model(&mt, 3, 0.1, 0, 1, 1) || add_model(&mt, 7, 0.2, 1, 3, 1);
    if (!check_that(!st && models_open(&m, &mt, "m", &e) == OK && new_scene(&t) == 0 && scene_open(&s, &t, 0, &m, 26.5, "s", &e) == OK,
                    "a scene of four types (%s)", e.text))
        return;
    const struct object *o = s.object;
    check_that(s.n == 4 && s.where == SCENE_FIELD && s.count[0] == 1 && s.count[1] == 1 && s.count[2] == 1 && s.count[3] == 1,
               "counted, and positions are in the field");
    check_that(o[0].type == OBJECT_SHAPELET && o[0].model == 1 && o[0].parity == -1 && fabs(o[0].rot - acos(0)) < 1e-15
               && o[0].dilation == 2 && o[0].g1 == 0.1 && o[0].g2 == -0.2 && o[0].x == 1 && o[0].y == -2 && o[0].id == 1
               && fabs(o[0].flux - 10) < 1e-12, "a shapelet with everything");
    check_that(o[1].type == OBJECT_STAR && o[1].parity == 1 && o[1].g1 == 0 && o[1].rot == 0, "a star ignores cells it has no use for");
    check_that(o[2].re == 0.3 && o[2].q == 0.5 && fabs(o[2].pa - acos(0) / 2) < 1e-15 && o[3].n == 4, "profiles");
    scene_free(&s);
    check_that(scene_open(&s, &t, 0, NULL, 26.5, "s", &e) == E_MISSING, "no catalogue: %s", e.text);
    check_that(table_set_word(&t.col[TYPE], 3, "galaxy") == OK && scene_open(&s, &t, 0, &m, 26.5, "s", &e) == E_DATA
               && !strcmp(e.text, "s: row 4: TYPE 'galaxy' is unknown (star, shapelet, gauss or sersic)"), "refused: %s", e.text);
    table_free(&t);
    refuse_scene(&m, DX, 0, (double)NAN, "s: row 1: DX nan is not in -1e+30..1e+30");
    refuse_scene(&m, MAG, 1, (double)NAN, "s: row 2: MAG nan is not in -50..100");
    refuse_scene(&m, MODEL, 0, 8, "s: row 1: MODEL 8 is not in the shapelet catalogue");
    refuse_scene(&m, PARITY, 0, 0, "s: row 1: PARITY 0 is neither 1 nor -1");
    refuse_scene(&m, ROT, 0, (double)NAN, "s: row 1: ROT nan is not in -3600..3600");
    refuse_scene(&m, DILATION, 0, 0, "s: row 1: DILATION 0 must be > 0 and <= 1e6");
    refuse_scene(&m, G1, 0, 0.98, "s: row 1: shear G1 0.98, G2 -0.2 must have |g| < 1");
    refuse_scene(&m, G1, 2, 1, "s: row 3: shear G1 1, G2 -0.2 must have |g| < 1");
    refuse_scene(&m, RE, 2, -0.1, "s: row 3: RE -0.1 must be > 0 and <= 1e6");
    refuse_scene(&m, N, 3, 10, "s: row 4: N 10 is not in 0.5..8");
    refuse_scene(&m, Q, 3, 0, "s: row 4: Q 0 is not in 0.001..1");
    models_free(&m);
    table_free(&mt);
}

int main(void)
{
    test_models();
    test_scene();
    return check_status();
}
