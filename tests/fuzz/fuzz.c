/*
 * fuzz.c - hands each input to the target as a file in memory.
 *
 *   make fuzz RUNS=1000000     clang's libFuzzer, coverage-guided, from the files of tests/fuzz/seeds
 */
#include "fuzz.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char name[64];
    int fd = memfd_create("fuzz", 0);
    if (fd < 0 || write(fd, data, size) != (ssize_t)size)
        abort();
    snprintf(name, sizeof name, "/proc/self/fd/%d", fd);
    fuzz_file(name);
    close(fd);
    return 0;
}
