/*
 * imageio.h - FITS images and tables, in and out, by our own reader
 * (imageio.c, fitswalk.c, fitstable.c) and writer (fitsout.c).  cfitsio is
 * needed for tile-compressed images only, which a child process decodes
 * (unpack.c, which alone may include fitsio.h).  Such an image has the index of
 * its binary table and the header, size and pixels of what was compressed.
 *
 * Names are literal.  When no file has the literal name, one suffix is
 * understood: [n] (0 = primary), [EXTNAME] or [EXTNAME,ver]; "-" is standard
 * input.  Without a suffix the first HDU with an image is read.  gzip input is
 * recognised by its first bytes.  Headers are checked against the length of
 * the file before anything is allocated; broken files give E_DATA and a cause.
 */
#ifndef PIXSHEAR_IMAGEIO_H
#define PIXSHEAR_IMAGEIO_H

#include "err.h"
#include "image.h"
#include <stdint.h>

/* ---- reading ---- */

struct fits_in;            /* an open FITS file, validated as a whole */

struct hdu {
    int index;             /* 0 = primary */
    int is_image;          /* has pixels: NAXIS >= 2, or deeper with sides of 1 */
    int bitpix;
    long nx, ny, nz;       /* nz = 1 for a plain image */
    char extname[72];
    long extver;
};

/*
 * Open and validate every HDU.  max_memory bounds what may be held (stdin,
 * gzip).  An empty name is an error.
 */
MUST_CHECK int fits_in_open(struct fits_in **f, const char *name, double max_memory, struct err *e);
/* The same of an input that is open already, at its beginning; takes src over whatever happens. */
struct source;
MUST_CHECK int fits_in_from(struct fits_in **f, struct source *src, double max_memory, struct err *e);
void fits_in_close(struct fits_in *f);

int fits_in_count(const struct fits_in *f);                 /* number of HDUs */
const struct hdu *fits_in_hdu(const struct fits_in *f, int index);

/* Index of the HDU that the name's suffix selects, else the first image; -1 when there is none. */
int fits_in_selected(const struct fits_in *f);

/* The same for who can use one image only: E_DATA when the file has several named SCI and no suffix says which. */
MUST_CHECK int fits_in_single(const struct fits_in *f, int *index, struct err *e);

/* Index of the image HDU with this EXTNAME (case-insensitive) and EXTVER (0: any), or -1. */
int fits_in_find(const struct fits_in *f, const char *extname, long extver);

/* Cards of an HDU without the structural ones, appended to an empty header. */
MUST_CHECK int fits_in_header(struct fits_in *f, int index, struct header *h, struct err *e);

/* The keyword DATASUM of an HDU (of the image within, when tile-compressed), where it has data: the
 * decimal number as text, and 1; else 0.  fits_in_provenance appends it as a HISTORY line, so that a
 * product names the very pixels that it came from. */
enum { SUM_TEXT = 12 };
int fits_in_datasum(const struct fits_in *f, int index, char sum[SUM_TEXT]);
MUST_CHECK int fits_in_provenance(const struct fits_in *f, int index, struct header *h, struct err *e);

/*
 * nrow rows from row y0 of plane z as float32 (BSCALE, BZERO applied; BLANK
 * becomes NaN), nx * nrow values.  Unsigned and 64-bit integers are converted
 * with the nearest float.
 */
MUST_CHECK int fits_in_rows(struct fits_in *f, int index, long z, long y0, long nrow, float *out,
                            struct err *e);
/* The same in double (PSFs, transfer functions, weights of double precision). */
MUST_CHECK int fits_in_rows_double(struct fits_in *f, int index, long z, long y0, long nrow,
                                   double *out, struct err *e);

/*
 * The selected image without its pixels: im gets its size and its header, *at the pixels where the input has them, and *f,
 * which holds them, stays open.  What must be decoded is read into im, and *f is NULL.  fits_in_unchanged tells at the end
 * whether the file is still the one that was opened; see filemap.h on what happens when it is cut.
 */
struct pixels;
MUST_CHECK int image_open(struct image *im, struct pixels *at, struct fits_in **f, const char *name, double max_memory, struct err *e);
MUST_CHECK int fits_in_unchanged(const struct fits_in *f, struct err *e);

/* Open, read the selected image with its header, close. */
MUST_CHECK int image_read(struct image *im, const char *name, double max_memory, struct err *e);

/* ---- writing ---- */

struct fits_out;           /* a FITS file being written, HDU by HDU, row by row */

/* "-" is standard output (refused when it is a terminal). inputs: see outfile_open. */
MUST_CHECK int fits_out_open(struct fits_out **f, const char *name, const char *const *inputs,
                             size_t n_inputs, struct err *e);

/*
 * Begin an HDU; the first is the primary.  bitpix -32, -64 or 32.  nx = 0
 * means a header without data; nz = 1 a plain image.  h gives the cards
 * (structural ones are made here; NULL for none).  The previous HDU must have
 * got all its rows.  Writes CHECKSUM and DATASUM without a clock.
 */
MUST_CHECK int fits_out_hdu(struct fits_out *f, int bitpix, long nx, long ny, long nz,
                            const struct header *h, struct err *e);
/* The next nrow rows, y rising inside z rising. For bitpix -32 / -64 / 32. */
MUST_CHECK int fits_out_rows(struct fits_out *f, long nrow, const float *pix, struct err *e);
MUST_CHECK int fits_out_rows_double(struct fits_out *f, long nrow, const double *pix, struct err *e);
MUST_CHECK int fits_out_rows_int(struct fits_out *f, long nrow, const int32_t *pix, struct err *e);

/*
 * An image HDU whose rows come in any order, also while later HDUs are written: begins it and
 * leaves room for its data.  *slot is its name, 0, 1, ...  bitpix -32 or 32.
 */
MUST_CHECK int fits_out_slot(struct fits_out *f, int bitpix, long nx, long ny, long nz, const struct header *h,
                             int *slot, struct err *e);
/* nrow rows of a slot from row y0 of plane z; float or int32_t as its bitpix says.  Each row must come once. */
MUST_CHECK int fits_out_slot_rows(struct fits_out *f, int slot, long z, long y0, long nrow, const void *pix, struct err *e);

/* Finish and make the file appear; frees f whatever happens. */
MUST_CHECK int fits_out_commit(struct fits_out *f, struct err *e);
void fits_out_abandon(struct fits_out *f);

/* One image, one file: primary HDU, float32, header im->hdr with `record` added as HISTORY. */
MUST_CHECK int image_write(const struct image *im, const char *name, const char *record,
                           const char *const *inputs, size_t n_inputs, struct err *e);

/* ---- binary tables (used by tableio for names that end in .fits) ---- */

struct table;
struct table_rows;
/* First binary table of an open file (or the one the suffix selects). */
MUST_CHECK int fits_in_table(struct fits_in *f, struct table *t, struct err *e);
/* The same in blocks: the header, then the next n rows at most (none at the end) in place of those of t. */
struct fits_rows;
MUST_CHECK int fits_table_open(struct fits_rows **r, struct fits_in *f, struct table *t, struct err *e);
MUST_CHECK int fits_table_rows(struct fits_rows *r, struct table *t, size_t n, struct err *e);
double fits_table_part(const struct fits_rows *r);       /* of the rows that has been read */
void fits_table_close(struct fits_rows *r);
/* The array (of E or D) in the first row of a column of the binary table `index`; *v is allocated. */
MUST_CHECK int fits_in_cell(struct fits_in *f, int index, const char *column, double **v, size_t *count,
                            struct err *e);
MUST_CHECK int fits_out_table(struct fits_out *f, const struct table *t, const char *extname,
                              struct err *e);
/* The same with the rows of `rows`; t knows the columns, keywords and HISTORY. */
MUST_CHECK int fits_out_blocks(struct fits_out *f, const struct table *t, struct table_rows *rows, const char *extname,
                               struct err *e);

#endif
