/* test_distort.c - maps of a scene through a WCS: split, composed, anywhere on the sky. */
#include "check.h"
#include "distort.h"
#include "plan.h"
#include "scenes.h"
#include "shear.h"
#include <string.h>

/* scale S(g) R(turn) P against the matrix that was split. */
static void split(void)
{
    struct check k = check_begin("any matrix = scale, shear, rotation, mirror");
    for (int i = 0; i < 2000; i++) {
        double a[4], s[4];
        struct map_parts p;
        for (int j = 0; j < 4; j++)
            a[j] = 2 * uniform(i, j) - 1;
        if (map_split(a, &p) || shear_matrix(p.g[0], p.g[1], s)) {
            check_that(0, "matrix %d is refused", i);
            continue;
        }
        const double c = cos(p.turn), d = sin(p.turn), way = p.mirror ? -1 : 1;
        const double r[4] = {c, -d * way, d, c * way};
        for (int j = 0; j < 4; j++)
            check_close(&k, p.scale * (s[j / 2 * 2] * r[j % 2] + s[j / 2 * 2 + 1] * r[2 + j % 2]), a[j], 1e-14 / (1 - p.g[0] * p.g[0] - p.g[1] * p.g[1]));   /* as S(g) amplifies */
    }
    check_end(&k);
    struct map_parts p;
    const double singular[4] = {1, 2, 2, 4}, none[4] = {0}, bad[4] = {NAN, 0, 0, 1}, unit[4] = {1, 0, 0, 1};
    check_that(map_split(singular, &p) == E_RANGE && map_split(none, &p) == E_RANGE && map_split(bad, &p) == E_RANGE, "singular ones are refused");
    check_that(map_split(unit, &p) == OK && p.scale == 1 && p.turn == 0 && p.g[0] == 0 && p.g[1] == 0 && !p.mirror, "the unit matrix is nothing, exactly");
}

/* A plain TAN maps shapes by the unit matrix wherever it points, also next to the pole. */
static void plain(void)
{
    static const double centre[][2] = {{150, 2.2}, {0, 0}, {359.999, -45}, {10, 89.9}, {200, -90}};
    struct check k = check_begin("plain TAN at five places: the unit matrix"), q = check_begin("and the positions of the plane, pixels");
    for (int i = 0; i < 5; i++) {
        struct header h = {0};
        struct sky *s;
        struct err e;
        double x[3] = {0, 40, -33}, y[3] = {0, -25, 60}, map[3][4];
        if (sky_set_tan(&h, 0.1, 501, 401, centre[i][0], centre[i][1]) || sky_open(&s, &h, &e)
            || distort(s, centre[i], SCENE_FIELD, 0.1, 3, x, y, map))
            exit(1);
        const double wx[3] = {500, 900, 170}, wy[3] = {400, 150, 1000};
        for (int j = 0; j < 3; j++) {
            check_close(&q, x[j], wx[j], 1e-8);
            check_close(&q, y[j], wy[j], 1e-8);
            for (int m = 0; m < 4; m++)
                check_close(&k, map[j][m], m % 3 == 0, 1e-7);
        }
        sky_close(s);
        header_free(&h);
    }
    check_end(&k);
    check_end(&q);
}

/* S(g) S(-g) map S(g) = map S(g): the conjugate acts before a shear as the map after it. */
static void before(void)
{
    struct check k = check_begin("a map before a shear = the same after it");
    const double g[2] = {0.2, -0.3}, map[4] = {1.1, 0.2, -0.1, 0.9};
    double c[4], s[4];
    memcpy(c, map, sizeof c);
    if (distort_before(g, c) || shear_matrix(g[0], g[1], s))
        exit(1);
    for (int i = 0; i < 4; i++)
        check_close(&k, s[i / 2 * 2] * c[i % 2] + s[i / 2 * 2 + 1] * c[2 + i % 2], map[i / 2 * 2] * s[i % 2] + map[i / 2 * 2 + 1] * s[2 + i % 2], 1e-14);
    check_end(&k);
    const double far[2] = {1, 0};
    check_that(distort_before(far, c) == E_RANGE, "a shear of 1 is refused");
}

/* What is on the other side of the sky is outside, and the others are right. */
static void nowhere(void)
{
    struct header h = {0};
    struct sky *s;
    struct err e;
    const double centre[2] = {150, 2.2};
    double x[3] = {150, 330, 150.001}, y[3] = {2.2, -2.2, 2.2}, map[3][4];
    if (sky_set_tan(&h, 0.1, 501, 401, 150, 2.2) || sky_open(&s, &h, &e) || distort(s, centre, SCENE_SKY, 0.1, 3, x, y, map))
        exit(1);
    check_that(fabs(x[0] - 500) < 1e-7 && isinf(x[1]) && map[1][0] == 1 && map[1][1] == 0 && fabs(x[2] - 500 + 36 * cos(2.2 * PI / 180)) < 1e-4,
               "the other side of the sky is infinitely far (%.4f %.4f %.4f)", x[0], x[1], x[2]);
    sky_close(s);
    header_free(&h);
}

int main(void)
{
    struct otf t = {0};
    telescope(&t);                         /* scenes.h */
    otf_free(&t);
    split();
    plain();
    before();
    nowhere();
    return check_status();
}
