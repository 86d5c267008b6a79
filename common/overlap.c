/*
 * overlap.c - polygon and pixel.
 */
#include "overlap.h"

double overlap_area(const double x[4], const double y[4])
{
    return 0.5 * ((x[2] - x[0]) * (y[3] - y[1]) - (x[3] - x[1]) * (y[2] - y[0]));
}

/*
 * A piece of an edge inside one row, from xa to xb (cells counted from 0 at the
 * left of the window of n), rising by -h: to its right lies area h times width.
 */
static void add_piece(double xa, double xb, double h, long n, double *sum)
{
    if (xa > xb) {
        double t = xa;
        xa = xb;
        xb = t;
    }
    const double right = (double)n;
    if (xa >= right)
        return;
    if (xb <= 0) {
        sum[0] += h;
        return;
    }
    const double slope = xb > xa ? h / (xb - xa) : 0;
    if (xa < 0) {                          /* what is left of the window covers all of it */
        sum[0] += slope * -xa;
        h -= slope * -xa;
        xa = 0;
    }
    if (xb > right) {
        h -= slope * (xb - right);
        xb = right;
    }
    long ia = (long)xa, ib = (long)xb;
    if (ia == ib) {
        double m = 0.5 * (xa + xb) - (double)ia;
        sum[ia] += h * (1 - m);
        sum[ia + 1] += h * m;
        return;
    }
    double step = (double)(ia + 1) - xa, part = slope * step;
    sum[ia] += 0.5 * part * step;
    sum[ia + 1] += part * (1 - 0.5 * step);
    for (long i = ia + 1; i < ib; i++) {
        sum[i] += 0.5 * slope;
        sum[i + 1] += 0.5 * slope;
    }
    step = xb - (double)ib;
    part = slope * step;
    sum[ib] += part * (1 - 0.5 * step);
    sum[ib + 1] += 0.5 * part * step;
}

static double clamp(double v, double lo, double hi)
{
    return v < lo ? lo : v > hi ? hi : v;
}

void overlap_row(const double x[4], const double y[4], long row, long first, long n, double *area)
{
    const double bottom = (double)row, top = bottom + 1, left = (double)first;
    for (long i = 0; i < n + 2; i++)
        area[i] = 0;
    for (int k = 0; k < 4; k++) {
        const int l = (k + 1) & 3;
        const double ya = clamp(y[k], bottom, top), yb = clamp(y[l], bottom, top);
        if (!(ya < yb || yb < ya))
            continue;
        const double slope = (x[l] - x[k]) / (y[l] - y[k]);
        const double xa = ya < y[k] || ya > y[k] ? x[k] + (ya - y[k]) * slope : x[k];
        const double xb = yb < y[l] || yb > y[l] ? x[k] + (yb - y[k]) * slope : x[l];
        add_piece(xa - left, xb - left, ya - yb, n, area);
    }
    double sum = 0;
    for (long i = 0; i < n; i++) {
        sum += area[i];
        area[i] = sum;
    }
}
