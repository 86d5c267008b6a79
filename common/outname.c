/* outname.c - what the name of an output promises. */
#include "outname.h"
#include <stddef.h>
#include <string.h>
#include <strings.h>

enum { FITS = 1 << OUT_FITS, TABLE = 1 << OUT_TABLE, LDAC = 1 << OUT_LDAC, LINES = 1 << OUT_LINES, REGION = 1 << OUT_REGION };

/* Each suffix, and the formats that may have it. */
static const struct { const char *suffix, *what; int may; } known[] = {
    {"fits", "FITS", FITS | TABLE | LDAC}, {"fit", "FITS", FITS | TABLE | LDAC}, {"fts", "FITS", FITS | TABLE | LDAC},
    {"ldac", "FITS_LDAC", LDAC},
    {"txt", "text", TABLE | LDAC | LINES | REGION}, {"cat", "a catalogue", TABLE | LDAC}, {"reg", "regions of DS9", REGION},
    {"png", "a PNG picture", 0}, {"jpg", "a JPEG picture", 0}, {"jpeg", "a JPEG picture", 0}, {"gif", "a GIF picture", 0},
    {"tif", "a TIFF picture", 0}, {"tiff", "a TIFF picture", 0}, {"bmp", "a BMP picture", 0}, {"webp", "a WebP picture", 0},
    {"pgm", "a PGM picture", 0}, {"ppm", "a PPM picture", 0}, {"pdf", "PDF", 0}, {"ps", "PostScript", 0}, {"eps", "PostScript", 0},
    {"svg", "SVG", 0}, {"gz", "a compressed file", 0}, {"bz2", "a compressed file", 0}, {"xz", "a compressed file", 0},
    {"zst", "a compressed file", 0}, {"z", "a compressed file", 0}, {"zip", "an archive", 0}, {"tar", "an archive", 0},
    {"fz", "a tile-compressed image", 0}, {"csv", "comma-separated values", 0}, {"tsv", "tab-separated values", 0},
    {"ecsv", "ECSV", 0}, {"xml", "XML", 0}, {"vot", "VOTable", 0}, {"votable", "VOTable", 0}, {"json", "JSON", 0},
    {"yaml", "YAML", 0}, {"yml", "YAML", 0}, {"html", "HTML", 0}, {"tex", "TeX", 0}, {"h5", "HDF5", 0}, {"hdf5", "HDF5", 0},
    {"hdf", "HDF", 0}, {"asdf", "ASDF", 0}, {"npy", "a NumPy array", 0}, {"npz", "NumPy arrays", 0}, {"parquet", "Parquet", 0},
    {"mat", "MATLAB", 0}, {"sqlite", "SQLite", 0}, {"xls", "a spreadsheet", 0}, {"xlsx", "a spreadsheet", 0},
};

/* Behind the last point of the last part; NULL when there is none (".png" is a hidden file). */
static const char *suffix_of(const char *name)
{
    const char *slash = strrchr(name, '/'), *base = slash ? slash + 1 : name, *point = strrchr(base, '.');
    return point && point > base ? point + 1 : NULL;
}

int outname_is_fits(const char *name)
{
    const char *s = suffix_of(name);
    return s && (!strcasecmp(s, "fits") || !strcasecmp(s, "fit") || !strcasecmp(s, "fts"));
}

const char *outname_promises(const char *name, enum out_format format)
{
    const char *s = suffix_of(name);
    for (size_t i = 0; s && format != OUT_ANY && i < sizeof known / sizeof *known; i++)
        if (!strcasecmp(s, known[i].suffix))
            return known[i].may & 1 << format ? NULL : known[i].what;
    return NULL;
}
