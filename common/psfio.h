/*
 * psfio.h - PSF files: ours (image and OTF) and any plain image of a PSF.
 *
 * Ours: the primary HDU is an image for people and other programs; extension OTF
 * is what pixshear reads.  Keywords, both HDUs: PIXELSCL arcsec per sample of the
 * image, PSFFWHM, CHDIFF, PIXRESP and PIXSIZE (arcsec), and the telescope's.
 */
#ifndef PIXSHEAR_PSFIO_H
#define PIXSHEAR_PSFIO_H

#include "err.h"
#include "header.h"
#include "otf.h"

/* What the user says about a PSF file; all zero means: what the file says. */
struct psf_options {
    double scale;          /* arcsec per sample, over the header's; PSFEx: per pixel of its image; refused with an OTF */
    int at;                /* x, y are given: position (FITS pixels) at which a PSFEx model is wanted */
    double x, y;
    double cutoff;         /* transform is 0 beyond |u_x|,|u_y| = cutoff, cycles/arcsec */
    int has_pixel;         /* the pixel is in, whatever PIXRESP says */
    int normalise;         /* divide by the sum */
    double max_memory;     /* bytes; 0: no limit */
};

struct psf_info {
    double flux;           /* T(0): sum of the samples as in the file */
    double scale;          /* arcsec per sample; 0 when the file has an OTF only */
    double fwhm;           /* of what is in the file, arcsec; NaN when unknown */
    int from_otf;          /* the OTF extension was used */
    char base[72];         /* file name without folder */
    char sum[12];          /* DATASUM of the HDU that was read; "" without one */
};

/*
 * Also read: PSFEx models (binary table PSF_DATA), evaluated at one position of their image; the
 * pixel is in them.
 *
 * Read a PSF as a transfer function; "-" is standard input.  The extension OTF when there is
 * one and the name selects no HDU.  Otherwise the (selected) image: scale from
 * options, PIXELSCL, PIXSCALE, WCS; centre from CRPIX, else (N+1)/2; sum kept (and in info);
 * t->chdiff and t->pixel from CHDIFF, PIXRESP, PIXSIZE: refuse to apply either twice.
 * t is 0 beyond its cut-off: options, else keyword UCUT, else half the sampling frequency.
 * info may be NULL.  E_DATA (blank or non-finite samples, sum <= 0, no scale), E_IO, E_NOMEM.
 */
MUST_CHECK int psf_read(const char *name, const struct psf_options *o, struct otf *t, struct psf_info *info,
                        struct err *e);

/*
 * Arcsec per sample of an image of a PSF: the option when positive, else PIXELSCL, PIXSCALE, GalSim's
 * GS_SCALE, the WCS.  E_DATA when there is none, when two differ by more than 1e-3, or when the pixels of the WCS are not square
 * to 1e-3.
 */
MUST_CHECK int psf_sampling(const char *name, const struct header *h, double option, double *scale, struct err *e);

/*
 * Write image (nx x ny doubles, float32 in the file) and the table t with the cards h in both:
 * PIXELSCL at least; CRPIX, CDELT, EXTNAME, UCUT are added here.  `record` becomes HISTORY.
 */
MUST_CHECK int psf_write(const char *name, int nx, int ny, const double *image, const struct otf *t,
                         const struct header *h, const char *record, const char *const *inputs,
                         size_t n_inputs, struct err *e);

#endif
