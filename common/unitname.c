/* unitname.c - units of columns by name. */
#include "unitname.h"
#include <stddef.h>
#include <string.h>
#include <strings.h>

int unitname_is(const char *unit, const char *wanted)
{
    static const char *const spelling[][14] = {
        {"arcsec", "arcsecond", "asec", "\"", NULL},
        {"deg", "degree", NULL},
        {"pixel", "pix", "px", NULL},
        {"mag", "magnitude", "mag(AB)", "ABmag", "AB mag", "mag_AB", NULL},
        {"electron/s", "electrons/s", "electron s-1", "electrons s-1", "electron s^-1", "electron.s-1", "electron/sec", "electrons/sec",
         "electron/second", "electrons/second", "e-/s", "e/s", "e-/sec", NULL},
    };
    static const char *const none[] = {"", "-", "---", "none"};
    const size_t n = strlen(unit);
    for (size_t i = 0; i < sizeof none / sizeof *none; i++)
        if (strcasecmp(unit, none[i]) == 0)
            return 1;
    for (size_t k = 0; k < sizeof spelling / sizeof *spelling; k++)
        for (size_t i = 0; !strcmp(wanted, spelling[k][0]) && spelling[k][i]; i++) {
            const size_t m = strlen(spelling[k][i]);
            if (strncasecmp(unit, spelling[k][i], m) == 0 && (n == m || (n == m + 1 && (unit[m] == 's' || unit[m] == 'S'))))
                return 1;
        }
    return 0;
}
