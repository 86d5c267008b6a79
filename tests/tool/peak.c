/*
 * peak.c - run a command and write what it cost: peak FILE COMMAND...
 *
 * FILE gets "KIB MS WALL": the largest resident memory of the command or of a
 * child it waited for, KiB; their processor time, ms; the time passed, ms.  The exit status is the
 * command's, 128 + the signal that ended it.
 */
#include "err.h"
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static double ms(long seconds, long nanoseconds)
{
    return (double)seconds * 1e3 + (double)nanoseconds / 1e6;
}

int main(int argc, char **argv)
{
    struct timespec a, b;
    struct rusage r;
    int status;
    if (argc < 3)
        die(EXIT_USAGE, "usage: peak FILE COMMAND...");
    clock_gettime(CLOCK_MONOTONIC, &a);
    pid_t child = fork();
    if (child == 0) {
        execvp(argv[2], argv + 2);
        die(127, "%s: %s", argv[2], strerror(errno));
    }
    if (child < 0 || waitpid(child, &status, 0) < 0 || getrusage(RUSAGE_CHILDREN, &r))
        die(EXIT_RUN, "%s", strerror(errno));
    clock_gettime(CLOCK_MONOTONIC, &b);
    FILE *f = fopen(argv[1], "w");
    double cpu = ms(r.ru_utime.tv_sec + r.ru_stime.tv_sec, 1000 * (r.ru_utime.tv_usec + r.ru_stime.tv_usec));
    if (!f || fprintf(f, "%ld %.0f %.0f\n", r.ru_maxrss, cpu, ms(b.tv_sec - a.tv_sec, b.tv_nsec - a.tv_nsec)) < 0 || fclose(f))
        die(EXIT_RUN, "%s: cannot write", argv[1]);
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}
