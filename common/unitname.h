/*
 * unitname.h - units of columns by name: spellings of one unit are one, others are another.
 */
#ifndef PIXSHEAR_UNITNAME_H
#define PIXSHEAR_UNITNAME_H

/*
 * 1 when `unit` is a spelling of `wanted` (arcsec, deg, pixel, mag, electron/s), without regard to case and plural, or is none
 * ("", "-", "---", "none"); 0 when it is another.
 */
int unitname_is(const char *unit, const char *wanted);

#endif
