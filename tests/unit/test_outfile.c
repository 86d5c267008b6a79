/* test_outfile.c - output that appears whole or not at all. */
#include "check.h"
#include <stdio.h>
#include "outfile.h"
#include <dirent.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

static unsigned char pattern(uint64_t i)
{
    return (unsigned char)(i * 2654435761u >> 13);
}

/* Write n bytes in steps, patch the first 100 and some in the middle, commit. */
static int make(const char *name, size_t n, size_t step, struct err *e)
{
    struct outfile *o;
    unsigned char *b = malloc(n + 1), mark[100];
    int st = outfile_open(&o, name, NULL, 0, e);
    if (st)
        return free(b), st;
    for (size_t i = 0; i < n; i++)
        b[i] = pattern(i);
    memset(mark, 'M', sizeof mark);
    for (size_t at = 0; at < n && !st; at += step)
        st = outfile_write(o, b + at, n - at < step ? n - at : step);
    if (!st && n >= 100)
        st = outfile_patch(o, 0, mark, 100);
    if (!st && n >= 100)
        st = outfile_patch(o, n - 100, mark, 100);
    if (!st && n > 300000)
        st = outfile_patch(o, n - n % (256 << 10) - 150, mark, 100);
    if (!st && outfile_size(o) != n)
        st = E_DATA;
    if (st)
        outfile_abandon(o);
    else
        st = outfile_commit(o, e);
    free(b);
    return st;
}

/* Does the file hold what make() wrote? */
static int holds(const char *name, size_t n)
{
    FILE *f = fopen(name, "rb");
    size_t i = 0;
    int c, good = f != NULL;
    while (good && (c = getc(f)) != EOF) {
        size_t mid = n - n % (256 << 10) - 150;
        int marked = n >= 100 && (i < 100 || i >= n - 100 || (n > 300000 && i >= mid && i < mid + 100));
        good = c == (marked ? 'M' : pattern(i));
        i++;
    }
    if (f)
        fclose(f);
    return good && i == n;
}

/* Entries of the folder, without . and .. */
static int entries(const char *folder)
{
    int n = -2;
    DIR *d = opendir(folder);
    while (d && readdir(d))
        n++;
    if (d)
        closedir(d);
    return n;
}

static void test_sizes(void)
{
    static const size_t size[] = {0, 1, 99, 100, 65536, 262143, 262144, 262145, 1000000, 9000000, 20000000};
    static const size_t step[] = {1000, 262144, 300000, 100000000};
    int good = 1;
    struct err e = {""};
    for (size_t i = 0; i < sizeof size / sizeof *size; i++)
        for (size_t k = 0; k < sizeof step / sizeof *step; k++)
            if (make("size", size[i], step[k], &e) || !holds("size", size[i])) {
                good = 0;
                check_that(0, "%zu bytes in steps of %zu: %s", size[i], step[k], e.text);
            }
    check_that(good, "sizes 0 to 20 MB in steps of 1 kB to 100 MB, patched, arrive");
    check_that(entries(".") == 1, "nothing else is left (%d entries)", entries("."));
    unlink("size");
}

/* The same through standard output, spooled in memory and on disk. */
static void test_standard(void)
{
    static const size_t size[] = {0, 1000, 8 << 20, (8 << 20) + 1, 20000000};
    struct err e = {""};
    int keep = dup(1), good = 1;
    fflush(stdout);
    for (size_t i = 0; i < sizeof size / sizeof *size; i++)
        for (size_t step = 1000; step < 100000000; step *= 1000) {
            int fd = open("out", O_WRONLY | O_CREAT | O_TRUNC, 0666);
            dup2(fd, 1);
            close(fd);
            int st = make("-", size[i], step, &e);
            dup2(keep, 1);
            good &= st == OK && holds("out", size[i]);
        }
    close(keep);
    check_that(good, "standard output gets the same bytes, 0 to 20 MB: %s", e.text);
    unlink("out");
}

static void write_file(const char *name, const char *text)
{
    FILE *f = fopen(name, "w");
    if (!f || fputs(text, f) < 0 || fclose(f))
        abort();
}

static int says(const char *name, const char *text)
{
    char b[100] = "";
    FILE *f = fopen(name, "r");
    size_t n = f ? fread(b, 1, sizeof b - 1, f) : 0;
    if (f)
        fclose(f);
    return f && n == strlen(text) && !memcmp(b, text, n);
}

static void refused(const char *what, const char *name, const char *const *inputs, size_t n)
{
    struct outfile *o = (struct outfile *)&o;
    struct err e = {""};
    int before = entries("."), st = outfile_open(&o, name, inputs, n, &e);
    check_that(st == E_IO && !o && e.text[0] && entries(".") == before, "%s: %s", what, e.text);
}

static void test_targets(void)
{
    struct err e = {""};
    struct stat sb;
    const char *inputs[] = {"other", "in", "missing[1]"};
    const char *suffixed[] = {"in[SCI,2]"};
    write_file("in", "input");
    write_file("old", "old");
    if (mkdir("folder", 0777) || symlink("in", "link") || link("in", "hard") || symlink("nowhere", "dangling") ||
        symlink("a", "b") || symlink("b", "a"))
        abort();
    refused("a folder", "folder", NULL, 0);
    refused("a folder that is not there", "none/file", NULL, 0);
    refused("a name ending in /", "new/", NULL, 0);
    refused("an empty name", "", NULL, 0);
    refused("a link to nothing", "dangling", NULL, 0);
    refused("a circle of links", "a", NULL, 0);
    refused("an input by name", "in", inputs, 3);
    refused("an input by another name", "./in", inputs, 3);
    refused("an input by link", "link", inputs, 3);
    refused("an input by hard link", "hard", inputs, 3);
    refused("an input with a suffix", "in", suffixed, 1);
    check_that(says("in", "input"), "the input is as it was");

    chmod("old", 0640);
    check_that(make("old", 5000, 100, &e) == OK && holds("old", 5000), "an earlier file is replaced");
    check_that(stat("old", &sb) == 0 && (sb.st_mode & 0777) == 0640, "and keeps its mode");
    if (symlink("../old", "folder/to"))
        abort();
    check_that(make("folder/to", 6000, 100, &e) == OK && holds("old", 6000) && lstat("folder/to", &sb) == 0 &&
               S_ISLNK(sb.st_mode) && entries("folder") == 1, "a link is followed, and stays a link");

    struct outfile *o;
    write_file("old", "old");
    int st = outfile_open(&o, "old", NULL, 0, &e);
    if (!st)
        st = outfile_write(o, "new", 3);
    check_that(!st && says("old", "old"), "before commit the earlier file is there");
    outfile_abandon(o);
    check_that(says("old", "old"), "and after giving up");
    char name[256];
    memset(name, 'n', 255);
    name[255] = 0;
    check_that(make(name, 10, 10, &e) == OK && holds(name, 10), "a name of 255 characters");
    unlink(name);
    st = outfile_open(&o, "patch", NULL, 0, &e);
    check_that(!st && outfile_patch(o, 0, "x", 1) == E_RANGE, "patching what was not written is refused");
    outfile_abandon(o);
    outfile_abandon(NULL);
    check_that(access("patch", F_OK) != 0, "nothing is left");
}

static void test_limits(void)
{
    struct err e = {""};
    struct rlimit old, now;
    getrlimit(RLIMIT_FSIZE, &old);
    now = old;
    now.rlim_cur = 500000;
    setrlimit(RLIMIT_FSIZE, &now);
    int before = entries(".");
    check_that(make("limited", 400000, 1000, &e) == OK && holds("limited", 400000), "below the file size limit");
    check_that(make("limited", 600000, 1000, &e) == E_IO && holds("limited", 400000) && entries(".") == before + 1,
               "beyond it: an error (no signal), and the earlier file stays");
    setrlimit(RLIMIT_FSIZE, &old);
    check_that(make("/dev/full", 1000, 100, &e) == E_IO, "a full device: %s", e.text);
    check_that(make("/dev/null", 1000, 100, &e) == OK, "the null device");
    int fds[2], keep = dup(1);
    fflush(stdout);
    if (pipe(fds))
        abort();
    close(fds[0]);
    dup2(fds[1], 1);
    int st = make("-", 1000, 100, &e);
    dup2(keep, 1);
    check_that(st == E_IO && strstr(e.text, "reader went away"), "a pipe without a reader: %s", e.text);
    fflush(stdout);
    close(1);
    st = make("-", 1000, 100, &e);
    dup2(keep, 1);
    check_that(st == E_IO, "closed standard output: %s", e.text);
    close(fds[1]);
    close(keep);
}

/* Two output names for one file. */
static void test_same(void)
{
    FILE *f = fopen("same.a", "w");
    check_that(f && fclose(f) == 0 && link("same.a", "same.b") == 0 && symlink("same.a", "same.c") == 0 && mkdir("same.d", 0755) == 0,
               "a file, a link, a symbolic link and a folder are made");
    check_that(outfile_same("same.a", "./same.a") && outfile_same("same.a", "same.b") && outfile_same("same.a", "same.c"),
               "one file by name, link and symbolic link");
    check_that(outfile_same("-", "-") && outfile_same("new", "./new") && outfile_same("same.d/../new", "new") &&
               outfile_same("same.d/new", "./same.d/new"), "names of a file that is not there yet");
    check_that(!outfile_same("same.a", "new") && !outfile_same("same.d/new", "new") && !outfile_same("-", "same.a") &&
               !outfile_same("/dev/null", "same.a") && !outfile_same("nowhere/new", "new"), "names of different files");
    check_that(!unlink("same.a") && !unlink("same.b") && !unlink("same.c") && !rmdir("same.d"), "they are removed again");
}

/* Two outputs appear together, or neither. */
static void test_together(void)
{
    struct err e;
    if (mkdir("pair", 0777))
        abort();
    outfile_together();
    check_that(make("pair/a", 300000, 5000, &e) == OK && make("pair/b", 99, 10, &e) == OK && access("pair/a", F_OK) && access("pair/b", F_OK)
               && entries("pair") == 2, "both are ready, under temporary names only");
    check_that(outfile_appear(&e) == OK && holds("pair/a", 300000) && holds("pair/b", 99) && entries("pair") == 2, "and appear together");
    check_that(make("pair/c", 99, 10, &e) == OK && holds("pair/c", 99), "afterwards an output appears at its commit");
    unlink("pair/a");

    outfile_together();
    check_that(make("pair/a", 99, 10, &e) == OK && make("pair/c", 100, 10, &e) == OK && make("pair/d", 99, 10, &e) == OK && mkdir("pair/d", 0777) == 0,
               "a folder takes the place of the last");
    check_that(outfile_appear(&e) == E_IO && strstr(e.text, "pair/d"), "it is told: %s", e.text);
    check_that(access("pair/a", F_OK) && holds("pair/c", 100) && entries("pair") == 3, "the new first one is gone again, a replaced one stays, no temporary names");
    check_that(outfile_appear(&e) == OK, "with none waiting nothing happens");
}

int main(void)
{
    test_same();
    test_sizes();
    test_standard();
    test_targets();
    test_limits();
    test_together();
    return check_status();
}
