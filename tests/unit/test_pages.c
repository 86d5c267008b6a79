/* test_pages.c - a large image comes in large pages where the system has them, and small blocks are left alone. */
#include "check.h"
#include "image.h"
#include "pages.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

static long faults(void)
{
    struct rusage u;
    getrusage(RUSAGE_SELF, &u);
    return u.ru_minflt;
}

static int system_has_them(void)
{
    char line[80] = "";
    FILE *f = fopen("/sys/kernel/mm/transparent_hugepage/enabled", "r");
    if (f && !fgets(line, sizeof line, f))
        line[0] = '\0';
    if (f)
        fclose(f);
    return strstr(line, "[madvise]") || strstr(line, "[always]");
}

int main(void)
{
    struct image im;
    if (CHECK_SANITIZED) {
        check_skip("large pages: faults are those of the sanitizer");
        return check_status();
    }
    if (!check_that(image_new(&im, 4096, 4096) == OK, "an image of 4096 x 4096"))
        return check_status();
    long before = faults();
    double sum = 0;
    for (size_t i = 0; i < image_count(&im); i += 1024) {
        sum += (double)im.pix[i];
        im.pix[i] = 1.0f;
    }
    long taken = faults() - before;
    check_that(sum == 0, "it begins with zeros");
    if (system_has_them())
        check_that(taken < 8192, "16384 small pages cost fewer than 8192 faults");
    else
        check_skip("large pages: this system has none");
    image_free(&im);

    if (check_that(image_room(&im, 2048, 1030) == OK, "room for an image of 2048 x 1030")) {
        check_that((size_t)(void *)im.pix % ((size_t)2 << 20) == 0, "it begins where a large page can");
        before = faults();
        for (size_t i = 0; i < image_count(&im); i += 1024)
            im.pix[i] = 1.0f;
        if (system_has_them())
            check_that(faults() - before < 1030, "2060 small pages cost fewer than 1030 faults");
        image_free(&im);
    }

    pages_keep((size_t)8 << 20);
    long again = 0;
    for (int k = 0; k < 20; k++) {         /* what was freed is there for the next */
        before = faults();
        char *block = malloc(1900000);
        if (!check_that(block != NULL, "a block of 1.9 MB"))
            break;
        for (size_t i = 0; i < 1900000; i += 1024)
            block[i] = 1;
        free(block);
        again = faults() - before;
    }
    check_that(again < 100, "a block that takes the place of one of its size costs no new pages");

    pages_large(NULL, 0);
    pages_large(NULL, (size_t)1 << 30);
    char *p = malloc(5000000);
    check_that(p != NULL, "a block of 5 MB");
    if (p) {
        memset(p, 7, 5000000);
        pages_large(p + 1, 4999999);
        int same = 1;
        for (size_t i = 0; i < 5000000; i++)
            same &= p[i] == 7;
        check_that(same, "advice changes no byte");
    }
    free(p);
    return check_status();
}
