/*
 * suffix.h - what the name of an output promises.  A file called x.png or x.fits.gz that holds something else would be
 * believed by the next program: it is refused.
 */
#ifndef PIXSHEAR_SUFFIX_H
#define PIXSHEAR_SUFFIX_H

enum suffix {
    SUFFIX_ANY,            /* none, or one that promises nothing */
    SUFFIX_FITS,           /* .fits .fit .fts */
    SUFFIX_TEXT,           /* .txt .dat .asc */
    SUFFIX_FOREIGN         /* a format that no program here writes: compressed, pictures, other tables */
};

/* By the letters after the last point of the base name, upper or lower case. */
enum suffix suffix_of(const char *name);

#endif
