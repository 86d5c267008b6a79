/*
 * noise.c - photon, dark and read noise of one exposure.
 */
#include "noise.h"
#include "par.h"
#include "poisson.h"
#include <math.h>
#include <stddef.h>

enum { BLOCK = 1024, MAX_WORKERS = 256 };

#define FLOAT_WHOLE 16777216.0     /* 2^24 */

struct job {
    const struct noise *m;
    struct rng shot, read;
    uint64_t first;
    float *pix;
    struct noise_counts counts[MAX_WORKERS];
};

/* Means from pixels, in electrons, with the extraordinary ones counted. */
static void means(const struct noise *m, int n, const float *pix, double *mean, struct noise_counts *c)
{
    const double added = m->sky + m->dark;
    double least = 0, most = 0;
    int odd = 0;
    for (int i = 0; i < n; i++) {
        mean[i] = m->qe * (double)pix[i] + added;
        least = mean[i] < least ? mean[i] : least;
        most = mean[i] > most ? mean[i] : most;
        odd |= isnan(mean[i]);
    }
    if (!odd && least >= 0 && most <= FLOAT_WHOLE)
        return;
    for (int i = 0; i < n; i++) {
        if (isnan(mean[i])) {
            c->blank++;
        } else if (mean[i] < 0) {
            c->negative++;
            mean[i] = 0;
        } else if (mean[i] > POISSON_MAX_MEAN) {
            c->refused++;
            mean[i] = NAN;
        } else if (mean[i] > FLOAT_WHOLE) {
            c->large++;
        }
    }
}

/* Uniform numbers of n items; mirrored: 1 - u, as uniform as u. */
static void uniforms(const struct noise *m, const struct rng *r, uint64_t item, int n, double *u)
{
    rng_uniform_run(r, item, 0, n, u);
    for (int i = 0; i < n && m->mirror; i++)
        u[i] = 1 - u[i];
}

static void draw(const struct job *j, struct noise_counts *c, uint64_t item, int n, float *pix)
{
    const struct noise *m = j->m;
    double u[BLOCK], v[BLOCK];
    means(m, n, pix, v, c);
    uniforms(m, &j->shot, item, n, u);
    poisson_inverse_run(n, u, v, v);
    if (m->read_noise > 0) {
        uniforms(m, &j->read, item, n, u);
        for (int i = 0; i < n; i++)
            v[i] += m->read_noise * rng_normal_inverse(u[i]);
    }
    if (m->saturate < INFINITY) {
        for (int i = 0; i < n; i++) {
            if (v[i] > m->saturate) {
                v[i] = m->saturate;
                c->saturated++;
            }
        }
    }
    for (int i = 0; i < n; i++)
        pix[i] = (float)((v[i] - m->subtract) / m->gain);
}

static int body(void *ctx, long begin, long end, int worker)
{
    struct job *j = ctx;
    for (long i = begin; i < end; i += BLOCK) {
        long left = end - i;
        draw(j, &j->counts[worker], j->first + (uint64_t)i, (int)(left < BLOCK ? left : BLOCK),
             j->pix + i);
    }
    return OK;
}

int noise_add(const struct noise *m, uint64_t seed, uint32_t exposure, uint64_t first,
              long n, int threads, float *pix, struct noise_counts *counts)
{
    if (!(m->qe > 0 && m->qe < INFINITY) || !(m->sky >= 0 && m->sky < INFINITY)
        || !(m->dark >= 0 && m->dark < INFINITY) || !(m->read_noise >= 0 && m->read_noise < INFINITY)
        || !(m->saturate > 0) || !(m->gain > 0 && m->gain < INFINITY) || !isfinite(m->subtract)
        || threads < 1 || threads > MAX_WORKERS || n < 0)
        return E_RANGE;
    struct job j = {
        .m = m, .first = first, .pix = pix,
        .shot = rng_stream(seed, exposure, RNG_SHOT),
        .read = rng_stream(seed, exposure, RNG_READ),
    };
    int st = par_for(n, 16 * BLOCK, threads, body, &j);
    if (st)
        return st;
    for (int w = 0; w < threads; w++) {
        counts->blank += j.counts[w].blank;
        counts->negative += j.counts[w].negative;
        counts->large += j.counts[w].large;
        counts->saturated += j.counts[w].saturated;
        counts->refused += j.counts[w].refused;
    }
    return OK;
}

double noise_depth_sky(double rate, double time, double area, double snr)
{
    return rate * rate * time / (snr * snr * area);
}

double noise_psf_area(long n, const float *p, double scale)
{
    double sum = 0, squares = 0;
    for (long i = 0; i < n; i++) {
        sum += (double)p[i];
        squares += (double)p[i] * (double)p[i];
    }
    return scale * scale * sum * sum / squares;
}
