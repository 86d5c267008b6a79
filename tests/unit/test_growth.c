/* Radii of given flux on noisy Gaussians, against the sum of exact overlaps of every pixel. */
#include "check.h"
#include "growth.h"
#include "rng.h"

enum { NX = 61, NY = 53 };

static float pix[NX * NY];

static double flux_in(double cx, double cy, double r)
{
    double sum = 0;
    for (int y = 0; y < NY; y++)
        for (int x = 0; x < NX; x++)
            sum += (double)pix[y * NX + x] * circle_overlap(x - cx, y - cy, r);
    return sum;
}

int main(void)
{
    struct growth *g;
    if (growth_new(&g))
        return 1;
    struct check c = check_begin("flux in the circle of the radius found, in units of the flux asked for"), w = check_begin("reach when there is less");
    for (uint32_t t = 0; t < 200; t++) {
        struct rng s = rng_stream(31, t, RNG_TEST);
        double sigma = 0.4 + 6 * rng_uniform(&s, 0, 0), cx = 20 + 20 * rng_uniform(&s, 0, 1), cy = 5 + 40 * rng_uniform(&s, 0, 2);
        double noise = t % 2 ? 0.02 : 0, total = 0, reach = 4 * sigma, r;
        for (int y = 0; y < NY; y++)
            for (int x = 0; x < NX; x++) {
                double v = 10 * exp(-0.5 * ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (sigma * sigma));
                pix[y * NX + x] = (float)(v + noise * rng_normal(&s, (uint64_t)(1 + y * NX + x), 0));
            }
        total = flux_in(cx, cy, reach);
        if (growth_open(g, pix, NX, NY, cx, cy, reach))
            return 1;
        for (int k = 1; k < 10; k += 2) {
            double f = 0.1 * k * total;
            if (growth_radius(g, f, &r))
                return 1;
            check_close(&c, flux_in(cx, cy, r) / f, 1, 1e-5);
        }
        if (growth_radius(g, 1.5 * total, &r))
            return 1;
        check_close(&w, r, reach, 0);
    }
    check_end(&c);
    check_end(&w);
    growth_free(g);
    return check_status();
}
