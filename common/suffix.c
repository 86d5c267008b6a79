/* suffix.c - what the name of an output promises. */
#include "suffix.h"
#include <stddef.h>
#include <string.h>
#include <strings.h>

enum suffix suffix_of(const char *name)
{
    static const struct { const char *text; enum suffix kind; } known[] = {
        {"fits", SUFFIX_FITS}, {"fit", SUFFIX_FITS}, {"fts", SUFFIX_FITS},
        {"txt", SUFFIX_TEXT}, {"dat", SUFFIX_TEXT}, {"asc", SUFFIX_TEXT},
        {"gz", SUFFIX_FOREIGN}, {"fz", SUFFIX_FOREIGN}, {"bz2", SUFFIX_FOREIGN}, {"xz", SUFFIX_FOREIGN},
        {"zst", SUFFIX_FOREIGN}, {"zip", SUFFIX_FOREIGN}, {"png", SUFFIX_FOREIGN}, {"jpg", SUFFIX_FOREIGN},
        {"jpeg", SUFFIX_FOREIGN}, {"gif", SUFFIX_FOREIGN}, {"tif", SUFFIX_FOREIGN}, {"tiff", SUFFIX_FOREIGN},
        {"pdf", SUFFIX_FOREIGN}, {"svg", SUFFIX_FOREIGN}, {"eps", SUFFIX_FOREIGN}, {"csv", SUFFIX_FOREIGN},
        {"tsv", SUFFIX_FOREIGN}, {"ecsv", SUFFIX_FOREIGN}, {"vot", SUFFIX_FOREIGN}, {"xml", SUFFIX_FOREIGN},
        {"html", SUFFIX_FOREIGN}, {"json", SUFFIX_FOREIGN}, {"h5", SUFFIX_FOREIGN}, {"hdf5", SUFFIX_FOREIGN}};
    const char *slash = strrchr(name, '/'), *point = strrchr(slash ? slash : name, '.');
    for (size_t i = 0; point && i < sizeof known / sizeof *known; i++)
        if (strcasecmp(point + 1, known[i].text) == 0)
            return known[i].kind;
    return SUFFIX_ANY;
}
