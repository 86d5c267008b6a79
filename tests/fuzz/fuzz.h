/*
 * fuzz.h - what a fuzz target provides; fuzz.c calls it, once for every input, with the name of a file.
 */
#ifndef PIXSHEAR_FUZZ_H
#define PIXSHEAR_FUZZ_H

void fuzz_file(const char *name);

#endif
