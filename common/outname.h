/*
 * outname.h - what the name of an output promises.
 *
 * The last suffix of a name, in any case, stands for a format (.png, .csv,
 * .gz); a file of another format under it would deceive people and programs.
 * A name without a suffix, or with one that stands for nothing, may have any.
 */
#ifndef PIXSHEAR_OUTNAME_H
#define PIXSHEAR_OUTNAME_H

/* What a program writes to a file. */
enum out_format {
    OUT_ANY,               /* nothing, or told elsewhere */
    OUT_FITS,              /* images */
    OUT_TABLE,             /* a catalogue: text, or FITS by its name */
    OUT_LDAC,              /* the same, or FITS_LDAC by its name */
    OUT_LINES,             /* text that is no catalogue */
    OUT_REGION             /* for DS9 */
};

/* 1 when the name asks for FITS: .fits, .fit, .fts. */
int outname_is_fits(const char *name);

/* What else the name promises ("a PNG picture"); NULL when such a file may have it. */
const char *outname_promises(const char *name, enum out_format format);

#endif
