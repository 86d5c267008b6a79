/* catkeys.c - keywords of catalogues: those that come from their image, and numbers among them. */
#include "catkeys.h"
#include <math.h>
#include <string.h>

static int copy_one(struct table *t, const struct header *h, const char *key)
{
    char text[80];
    double v;
    if (header_double(h, key, &v) == OK)
        return table_set_number(t, key, v);
    if (header_str(h, key, text, sizeof text) == OK && *text && !strpbrk(text, "\r\n"))
        return table_set_text(t, key, text);
    return OK;
}

int catkeys_copy(struct table *t, const struct header *h)
{
    static const char *const keys[] = {
        "PIXSCALE", "CCDSCALE", "EXPTIME", "TOTTIME", "MAGZERO", "GAIN", "SHEAR1", "SHEAR2", "SETNAME", "SEED",
        "NOISSEED", "MIRROR", "FIELDID", "EXPNUM", "PSFFWHM", "PSFFILE", "CHDIFF", "NOISECOR", "SKYLEVEL", "SKYSUB"};
    int st = OK;
    for (size_t i = 0; i < sizeof keys / sizeof *keys && st == OK; i++)
        st = copy_one(t, h, keys[i]);
    return st;
}

int catkeys_number(const struct table *t, const char *key, double *value, struct err *e)
{
    const char *text = table_text(t, key);
    *value = NAN;
    if (!text || strcmp(text, "nan") == 0 || table_key_number(t, key, value) == OK)
        return OK;
    return err_set(e, E_DATA, "keyword %s = '%.60s' is not a number: correct it", key, text);
}

int catkeys_history(struct table *t, const struct header *h)
{
    int st = OK;
    for (size_t i = 0; i < h->n && st == OK; i++) {
        if (strncmp(h->card[i], "HISTORY ", 8) != 0)
            continue;
        char line[81] = "";
        memcpy(line, h->card[i] + 8, strlen(h->card[i] + 8));
        for (size_t k = strlen(line); k > 0 && line[k - 1] == ' '; k--)
            line[k - 1] = 0;
        if (*line)
            st = table_history(t, line);
    }
    return st;
}
