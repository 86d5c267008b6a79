/*
 * psfio.c - PSF files in and out: extension OTF, or an image of samples.
 *
 * OTF: image of 2 planes (real, imaginary) of doubles, axes u_x and u_y in cycles/arcsec with
 * u = 0 at CRPIX, n odd, CDELT equal on both axes; 0 beyond |u_x|,|u_y| = UCUT.
 */
#include "psfio.h"
#include "imageio.h"
#include "psf.h"
#include "sky.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SAME_SCALE 1e-3        /* two that tell the scale agree, and the sides of a pixel */

static void base_name(const char *name, char *base, size_t size)
{
    const char *slash = strrchr(name, '/');
    name = slash ? slash + 1 : name;
    size_t n = strlen(name) < size - 1 ? strlen(name) : size - 1;
    memcpy(base, name, n);
    base[n] = 0;
}

/* The user chose an HDU: "file[1]" where no such file is. */
static int has_suffix(const char *name)
{
    size_t n = strlen(name);
    return n > 0 && name[n - 1] == ']' && access(name, F_OK) != 0;
}

/* CHDIFF, PIXRESP and PIXSIZE of a header into t. */
static int inside(const char *name, const struct header *h, const struct psf_options *o, double scale, struct otf *t,
                  struct err *e)
{
    int response = 0;
    double size = scale;
    int status = header_double(h, "CHDIFF", &t->chdiff);
    if (status == E_MISSING)
        t->chdiff = 0;
    else if (status || !(t->chdiff >= 0))
        return err_set(e, E_DATA, "%s: CHDIFF is not a size: correct the keyword", name);
    status = header_bool(h, "PIXRESP", &response);
    if (status && status != E_MISSING)
        return err_set(e, E_DATA, "%s: PIXRESP is neither T nor F: correct the keyword", name);
    if (response || o->has_pixel) {
        status = header_double(h, "PIXSIZE", &size);
        if ((status && status != E_MISSING) || !(size > 0))
            return err_set(e, E_DATA, "%s: PIXRESP says that a pixel is inside, PIXSIZE is not its size: correct the keyword",
                           name);
        t->pixel = size;
    }
    return OK;
}

/* All rows of all planes of an HDU, in doubles. */
static int all_rows(struct fits_in *f, const char *name, int index, double max_memory, double **pix, struct err *e)
{
    const struct hdu *d = fits_in_hdu(f, index);
    double count = (double)d->nx * (double)d->ny * (double)d->nz;
    if (d->nx > 16385 || d->ny > 16385 || d->nz > 2)
        return err_set(e, E_DATA, "%s: %ld x %ld x %ld values are too many for a PSF", name, d->nx, d->ny, d->nz);
    if (max_memory > 0 && count * 32 > max_memory)
        return err_set(e, E_NOMEM, "%s: PSF of %ld x %ld values needs %.0f MB: raise --max-memory", name, d->nx, d->ny,
                       count * 32e-6);
    double *v = malloc((size_t)count * sizeof *v);
    if (!v)
        return err_set(e, E_NOMEM, "%s: %s", name, err_text(E_NOMEM));
    int status = OK;
    for (long z = 0; z < d->nz && status == OK; z++)
        status = fits_in_rows_double(f, index, z, 0, d->ny, v + (size_t)z * (size_t)d->nx * (size_t)d->ny, e);
    if (status)
        free(v);
    else
        *pix = v;
    return status;
}

static int check_sum(const char *name, double sum, struct err *e)
{
    if (!isfinite(sum))
        return err_set(e, E_DATA, "%s: PSF with blank or infinite samples: repair them first", name);
    if (!(sum > 0))
        return err_set(e, E_DATA, "%s: the PSF's flux %g is not positive: subtract its background first", name, sum);
    return OK;
}

/* Divide by the flux when asked, tell the flux. */
static void scale_flux(size_t n, double *v, double flux, const struct psf_options *o, struct psf_info *info)
{
    info->flux = flux;
    for (size_t i = 0; o->normalise && i < n; i++)
        v[i] /= flux;
}

/* T(-u) is the conjugate of T(u), to 1e-9 of T(0): the PSF is real. */
static int hermitian(size_t count, const double *re, const double *im)
{
    double worst = 0, tol = 1e-9 * re[count / 2];
    for (size_t i = 0; i <= count / 2; i++)
        worst = fmax(worst, fmax(fabs(re[i] - re[count - 1 - i]), im ? fabs(im[i] + im[count - 1 - i]) : 0));
    return worst <= tol;
}

/* Numbers that may be missing; a card that holds something else is an error. */
static int optional(const char *name, const struct header *h, const char *key, double *value, struct err *e)
{
    return header_double(h, key, value) == E_DATA ? err_set(e, E_DATA, "%s: %s is not a number: correct the keyword", name, key) : OK;
}

static int read_otf(struct fits_in *f, const char *name, int index, const struct psf_options *o, struct otf *t,
                    struct psf_info *info, const struct header *h, struct err *e)
{
    const struct hdu *d = fits_in_hdu(f, index);
    double cx, cy, dx, dy, *v = NULL;
    if (o->scale > 0)
        return err_set(e, E_DATA, "%s: --psf-scale is of an image of a PSF, but the extension OTF is read: leave it out or name the image, %s[0]",
                       name, name);
    if (d->nx != d->ny || d->nx % 2 == 0 || d->nz > 2)
        return err_set(e, E_DATA, "%s: extension OTF is %ld x %ld x %ld, not n x n x 2 with odd n", name, d->nx, d->ny, d->nz);
    if (header_double(h, "CDELT1", &dx) || header_double(h, "CDELT2", &dy) || header_double(h, "CRPIX1", &cx) ||
        header_double(h, "CRPIX2", &cy))
        return err_set(e, E_DATA, "%s: extension OTF has no CRPIX or CDELT: write it again with psfgen", name);
    double middle = (double)(d->nx + 1) / 2;
    if (cx != middle || cy != middle || !(dx > 0) || fabs(dx - dy) > 1e-12 * dx)
        return err_set(e, E_DATA, "%s: extension OTF: u = 0 is not in the middle or CDELT not square: write it again with psfgen",
                       name);
    double ucut = dx * (middle - 1);
    int status = optional(name, h, "UCUT", &ucut, e);
    if (status == OK)
        status = all_rows(f, name, index, o->max_memory, &v, e);
    if (status)
        return status;
    size_t count = (size_t)d->nx * (size_t)d->nx;
    if (o->cutoff > 0)
        ucut = fmin(ucut, o->cutoff);
    status = check_sum(name, v[count / 2], e);
    int complex = 0;
    for (size_t i = count; d->nz == 2 && i < 2 * count; i++)
        complex |= v[i] != 0;
    if (status == OK && !hermitian(count, v, complex ? v + count : NULL))
        status = err_set(e, E_DATA, "%s: extension OTF: T(-u) is not the conjugate of T(u): write it again with psfgen", name);
    if (status == OK) {
        scale_flux((size_t)d->nz * count, v, v[count / 2], o, info);
        status = otf_tabulate(t, (int)d->nx, dx, ucut, v, complex ? v + count : NULL);
        if (status)
            err_set(e, status == E_RANGE ? E_DATA : status, "%s: extension OTF: %s", name,
                    status == E_RANGE ? "blank or infinite values, or a bad UCUT: write it again with psfgen" : err_text(status));
        if (status == E_RANGE)
            status = E_DATA;
    }
    free(v);
    info->from_otf = 1;
    info->scale = header_double_or(h, "PIXELSCL", 0);
    return status;
}

/* The scale of the WCS, where there is one, against that of a keyword (NaN: none); pixels must be square. */
static int sampling_by_wcs(const char *name, const struct header *h, const char *key, double *scale, struct err *e)
{
    double found, ratio;
    const int st = sky_pixels(h, &found, &ratio, NULL);
    if (st == E_NOMEM)
        return err_set(e, st, "%s: %s", name, err_text(st));
    if (st)
        return OK;
    if (!(ratio <= 1 + SAME_SCALE))
        return err_set(e, E_DATA, "%s: pixels are not square by the WCS (sides as 1 : %.4g): resample it, or give --psf-scale", name, ratio);
    if (isnan(*scale))
        *scale = found;
    else if (!(fabs(found / *scale - 1) <= SAME_SCALE))
        return err_set(e, E_DATA, "%s: %s %g and the WCS's %g arcsec differ: give --psf-scale", name, key, *scale, found);
    return OK;
}

int psf_sampling(const char *name, const struct header *h, double option, double *scale, struct err *e)
{
    static const char *const keys[] = {"PIXELSCL", "PIXSCALE", "GS_SCALE"};
    const char *first = NULL;
    double known = NAN, v;
    if (option > 0) {
        *scale = option;
        return OK;
    }
    for (int k = 0; k < 3; k++) {
        const int status = header_double(h, keys[k], &v);
        if (status == E_MISSING)
            continue;
        if (status || !(v > 0))
            return err_set(e, E_DATA, "%s: %s is not a positive number: give --psf-scale", name, keys[k]);
        if (first && !(fabs(v / known - 1) <= SAME_SCALE))
            return err_set(e, E_DATA, "%s: %s %g and %s %g differ: give --psf-scale", name, first, known, keys[k], v);
        known = first ? known : v;
        first = first ? first : keys[k];
    }
    const int status = sampling_by_wcs(name, h, first, &known, e);
    if (status)
        return status;
    if (!(known > 0) || !isfinite(known))
        return err_set(e, E_DATA, "%s: no PIXELSCL, PIXSCALE, GS_SCALE or WCS tells the PSF's sampling: give --psf-scale", name);
    *scale = known;
    return OK;
}

static int read_samples(struct fits_in *f, const char *name, int index, const struct psf_options *o, struct otf *t,
                        struct psf_info *info, const struct header *h, struct err *e)
{
    const struct hdu *d = fits_in_hdu(f, index);
    double scale, *v = NULL;
    if (d->nz != 1)
        return err_set(e, E_DATA, "%s: a cube of %ld planes: choose one PSF and write it as an image", name, d->nz);
    int status = psf_sampling(name, h, o->scale, &scale, e);
    double cx = (double)(d->nx + 1) / 2, cy = (double)(d->ny + 1) / 2, unused, nyquist = 0.5 / scale, ucut = nyquist;
    if (status == OK)
        status = optional(name, h, "UCUT", &ucut, e);
    if (status == OK && header_double(h, "GS_SCALE", &unused)) {     /* GalSim draws at the middle; its CRPIX is that of its coordinates */
        status = optional(name, h, "CRPIX1", &cx, e);
        if (status == OK)
            status = optional(name, h, "CRPIX2", &cy, e);
    }
    if (status == OK)
        status = all_rows(f, name, index, o->max_memory, &v, e);
    if (status)
        return status;
    size_t count = (size_t)d->nx * (size_t)d->ny;
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += v[i];
    ucut = o->cutoff > 0 ? o->cutoff : ucut > 0 ? ucut : nyquist;
    status = check_sum(name, sum, e);
    if (status == OK && !(cx >= 0.5 && cx <= (double)d->nx + 0.5 && cy >= 0.5 && cy <= (double)d->ny + 0.5))
        status = err_set(e, E_DATA, "%s: CRPIX (%g, %g) puts the PSF's centre outside its image: correct or remove it", name, cx, cy);
    if (status == OK && ucut > nyquist * (1 + 1e-9))
        status = err_set(e, E_DATA, "%s: cut-off %g is beyond half the sampling frequency, %g cycles/arcsec", name, ucut, nyquist);
    if (status == OK) {
        scale_flux(count, v, sum, o, info);
        status = otf_sample(t, (int)d->nx, (int)d->ny, v, scale, cx - 1, cy - 1, ucut);
        if (status)
            err_set(e, status, "%s: %s", name, err_text(status));
    }
    free(v);
    info->scale = scale;
    return status;
}

/* A PSFEx model: samples as polynomials in position, in units of flux per pixel of the image. */
struct psfex {
    long nx, ny, terms;        /* PSFAXIS1 to 3 */
    long axes, degree;         /* POLNAXIS 0..2, POLDEG1 */
    double zero[2], scale[2];  /* POLZEROi, POLSCALi */
    double samp;               /* pixels per sample */
};

static int psfex_header(const char *name, const struct header *h, struct psfex *m, struct err *e)
{
    long groups = 0, naxis = 0;
    *m = (struct psfex){.terms = 1, .scale = {1, 1}};
    int bad = header_long(h, "PSFNAXIS", &naxis) || naxis < 2 || naxis > 3 || header_long(h, "PSFAXIS1", &m->nx) ||
              header_long(h, "PSFAXIS2", &m->ny) || (naxis == 3 && header_long(h, "PSFAXIS3", &m->terms)) ||
              header_double(h, "PSF_SAMP", &m->samp) || !(m->samp > 0) || header_long(h, "POLNAXIS", &m->axes) || m->axes < 0;
    if (!bad && m->axes > 0)
        bad = header_long(h, "POLNGRP", &groups) || header_long(h, "POLDEG1", &m->degree);
    for (long i = 0; !bad && i < m->axes && i < 2; i++) {
        char key[32];
        snprintf(key, sizeof key, "POLZERO%ld", i + 1);
        bad |= header_double(h, key, &m->zero[i]) != OK;
        snprintf(key, sizeof key, "POLSCAL%ld", i + 1);
        bad |= header_double(h, key, &m->scale[i]) != OK || m->scale[i] == 0;
    }
    if (bad)
        return err_set(e, E_DATA, "%s: PSF_DATA lacks the keywords of a PSFEx model", name);
    if (m->axes > 2 || groups > 1 || m->degree < 0 || m->degree > 20)
        return err_set(e, E_DATA, "%s: PSFEx model in more than two variables, or in groups: fit it in X_IMAGE and Y_IMAGE", name);
    long d = m->degree, terms = m->axes == 2 ? (d + 1) * (d + 2) / 2 : m->axes == 1 ? d + 1 : 1;
    if (m->nx < 1 || m->ny < 1 || m->nx > 16385 || m->ny > 16385 || terms != m->terms)
        return err_set(e, E_DATA, "%s: PSFEx model of %ld x %ld x %ld does not match its degree %ld", name, m->nx, m->ny, m->terms, d);
    return OK;
}

/* v (nx ny terms) -> its first plane = sum of planes times x^i y^j, i fastest, i + j <= degree. */
static void psfex_evaluate(const struct psfex *m, const struct psf_options *o, double *v)
{
    double x = (o->x - m->zero[0]) / m->scale[0], y = (o->y - m->zero[1]) / m->scale[1];
    size_t count = (size_t)m->nx * (size_t)m->ny, plane = 0;
    for (long j = 0; j <= (m->axes == 2 ? m->degree : 0); j++)
        for (long i = 0; i <= m->degree - j; i++, plane++) {
            double w = pow(x, (double)i) * pow(y, (double)j);
            for (size_t k = 0; plane > 0 && k < count; k++)
                v[k] += w * v[plane * count + k];
        }
}

static int read_psfex(struct fits_in *f, const char *name, int index, const struct psf_options *o, struct otf *t,
                      struct psf_info *info, struct err *e)
{
    struct header h = {0};
    struct psfex m;
    double *v = NULL, sum = 0;
    size_t n = 0;
    int status = fits_in_header(f, index, &h, e);
    if (status == OK)
        status = psfex_header(name, &h, &m, e);
    if (status == OK && m.terms > 1 && !o->at)
        status = err_set(e, E_DATA, "%s: the PSFEx model varies over its image: psfgen --from %s -X X -Y Y makes one PSF of it", name, name);
    if (status == OK && !(o->scale > 0))
        status = err_set(e, E_DATA, "%s: a PSFEx model does not tell the pixel scale of its image: give --psf-scale", name);
    if (status == OK)
        status = fits_in_cell(f, index, "PSF_MASK", &v, &n, e);
    if (status == OK && n != (size_t)m.nx * (size_t)m.ny * (size_t)m.terms)
        status = err_set(e, E_DATA, "%s: PSF_MASK has %zu values, not %ld x %ld x %ld", name, n, m.nx, m.ny, m.terms);
    if (status == OK) {
        psfex_evaluate(&m, o, v);
        for (size_t i = 0; i < (size_t)m.nx * (size_t)m.ny; i++)
            sum += v[i] *= m.samp * m.samp;
        status = check_sum(name, sum, e);
    }
    if (status == OK) {
        info->scale = o->scale * m.samp;
        scale_flux((size_t)m.nx * (size_t)m.ny, v, sum, o, info);
        double nyquist = 0.5 / info->scale, ucut = o->cutoff > 0 ? fmin(o->cutoff, nyquist) : nyquist;
        status = otf_sample(t, (int)m.nx, (int)m.ny, v, info->scale, (double)(m.nx / 2), (double)(m.ny / 2), ucut);
        if (status)
            err_set(e, status, "%s: %s", name, err_text(status));
        else
            t->pixel = o->scale;
    }
    info->fwhm = NAN;
    header_free(&h);
    free(v);
    return status;
}

/* HDU of a PSFEx model, or -1. */
static int find_psfex(const struct fits_in *f)
{
    for (int i = 0; i < fits_in_count(f); i++)
        if (!fits_in_hdu(f, i)->is_image && strcmp(fits_in_hdu(f, i)->extname, "PSF_DATA") == 0)
            return i;
    return -1;
}

/* Choose the HDU and read it. */
static int read_open(struct fits_in *f, const char *name, const struct psf_options *o, struct otf *t, struct psf_info *info,
                     struct err *e)
{
    int table = fits_in_find(f, "OTF", 0), index = fits_in_selected(f);
    int model = find_psfex(f);
    if (table >= 0 && !has_suffix(name))
        index = table;
    if (index < 0 && model >= 0)
        return read_psfex(f, name, model, o, t, info, e);
    if (index < 0)
        return err_set(e, E_DATA, "%s: no image in it: a PSF is an image", name);
    struct header h = {0};
    struct otf made = {0};
    int status = fits_in_header(f, index, &h, e);
    if (status == OK)
        status = index == table ? read_otf(f, name, index, o, &made, info, &h, e)
                                : read_samples(f, name, index, o, &made, info, &h, e);
    if (status == OK)
        status = inside(name, &h, o, info->scale, &made, e);
    info->fwhm = header_double_or(&h, "PSFFWHM", NAN);
    if (!fits_in_datasum(f, index, info->sum))
        info->sum[0] = 0;
    header_free(&h);
    if (status)
        otf_free(&made);
    else
        *t = made;
    return status;
}

int psf_read(const char *name, const struct psf_options *o, struct otf *t, struct psf_info *info, struct err *e)
{
    struct psf_info found = {0};
    struct fits_in *f = NULL;
    int status = fits_in_open(&f, name, o->max_memory > 0 ? o->max_memory : 1e15, e);
    if (status)
        return status;
    base_name(name, found.base, sizeof found.base);
    status = read_open(f, name, o, t, &found, e);
    fits_in_close(f);
    if (status == OK && info) {
        if (!(found.fwhm > 0) && psf_fwhm(t, 0, 0, &found.fwhm) != OK)
            found.fwhm = NAN;
        *info = found;
    }
    return status;
}

/* Cards of an axis pair with the origin in the middle. */
static int set_axes(struct header *h, int nx, int ny, double step, const char *unit, const char *type1, const char *type2)
{
    return header_set_str(h, "CTYPE1", type1, NULL) || header_set_str(h, "CTYPE2", type2, NULL) ||
           header_set_str(h, "CUNIT1", unit, NULL) || header_set_str(h, "CUNIT2", unit, NULL) ||
           header_set_double(h, "CRPIX1", (nx + 1) / 2.0, "origin") || header_set_double(h, "CRPIX2", (ny + 1) / 2.0, "origin") ||
           header_set_double(h, "CRVAL1", 0, NULL) || header_set_double(h, "CRVAL2", 0, NULL) ||
           header_set_double(h, "CDELT1", step, NULL) || header_set_double(h, "CDELT2", step, NULL);
}

static int write_image(struct fits_out *f, int nx, int ny, const double *image, double scale, const struct header *cards,
                       const char *record, struct err *e)
{
    struct header h = {0};
    int status = header_copy(&h, cards);
    if (status == OK)
        status = set_axes(&h, nx, ny, scale, "arcsec", "X", "Y") || (record && header_history(&h, record)) ? E_NOMEM : OK;
    if (status)
        err_set(e, status, "%s", err_text(status));
    if (status == OK)
        status = fits_out_hdu(f, -32, nx, ny, 1, &h, e);
    header_free(&h);
    float *row = malloc((size_t)nx * sizeof *row);
    if (!row && status == OK)
        status = err_set(e, E_NOMEM, "%s", err_text(E_NOMEM));
    for (int y = 0; y < ny && status == OK; y++) {
        for (int x = 0; x < nx; x++)
            row[x] = (float)image[(size_t)y * (size_t)nx + (size_t)x];
        status = fits_out_rows(f, 1, row, e);
    }
    free(row);
    return status;
}

static int write_otf(struct fits_out *f, const struct otf *t, const struct header *cards, struct err *e)
{
    struct header h = {0};
    int status = header_copy(&h, cards);
    if (status == OK)
        status = header_set_str(&h, "EXTNAME", "OTF", "transfer function: plane 1 real, 2 imaginary") ||
                         set_axes(&h, t->n, t->n, t->du, "arcsec-1", "UX", "UY") ||
                         header_set_str(&h, "CTYPE3", "COMPLEX", NULL) || header_set_double(&h, "CRPIX3", 1, NULL) ||
                         header_set_double(&h, "CRVAL3", 1, NULL) || header_set_double(&h, "CDELT3", 1, NULL) ||
                         header_set_double(&h, "UCUT", t->ucut, "[1/arcsec] 0 beyond |ux|,|uy|")
                     ? E_NOMEM : OK;
    double *zero = calloc((size_t)t->n, sizeof *zero);
    if (!zero)
        status = E_NOMEM;
    if (status)
        err_set(e, status, "%s", err_text(status));
    if (status == OK)
        status = fits_out_hdu(f, -64, t->n, t->n, 2, &h, e);
    header_free(&h);
    if (status == OK)
        status = fits_out_rows_double(f, t->n, t->re, e);
    if (status == OK && t->im)
        status = fits_out_rows_double(f, t->n, t->im, e);
    for (int y = 0; y < t->n && !t->im && status == OK; y++)
        status = fits_out_rows_double(f, 1, zero, e);
    free(zero);
    return status;
}

int psf_write(const char *name, int nx, int ny, const double *image, const struct otf *t, const struct header *h,
              const char *record, const char *const *inputs, size_t n_inputs, struct err *e)
{
    double scale = header_double_or(h, "PIXELSCL", NAN);
    if (!t->n || !(scale > 0) || nx < 1 || ny < 1)
        return err_set(e, E_RANGE, "%s: a PSF file needs a table, an image and PIXELSCL", name);
    struct fits_out *f = NULL;
    int status = fits_out_open(&f, name, inputs, n_inputs, e);
    if (status)
        return status;
    status = write_image(f, nx, ny, image, scale, h, record, e);
    if (status == OK)
        status = write_otf(f, t, h, e);
    if (status == OK)
        return fits_out_commit(f, e);
    fits_out_abandon(f);
    return status;
}
