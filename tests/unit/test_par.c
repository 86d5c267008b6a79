/* test_par.c - loops on threads: every item once, failures end them, turns are kept whoever works, and crews meet. */
#include "check.h"
#include "par.h"
#include <sched.h>
#include <stdlib.h>
#include <string.h>

enum { N = 1000, PLACES = 3, HELD = 4 };

static int count(void *ctx, long begin, long end, int worker)
{
    int *times = ctx;
    (void)worker;
    for (long i = begin; i < end; i++)
        times[i]++;
    return OK;
}

static int fail_at(void *ctx, long begin, long end, int worker)
{
    const long *bad = ctx;
    (void)worker;
    return *bad >= begin && *bad < end ? E_NOCONV : OK;
}

struct chain {
    struct par_turns *turns;
    long order[PLACES][N], n[PLACES];
    long fail;                     /* item that fails, or -1 */
};

/* Takes items, works for a time that differs from one to the next, holds up to HELD, and enters each at every place in its turn. */
static int chained(void *ctx, long begin, long end, int worker)
{
    struct chain *c = ctx;
    long held[HELD];
    int n = 0;
    (void)begin;
    (void)end;
    (void)worker;
    for (;;) {
        const long item = par_turn_take(c->turns);
        for (volatile long k = 0; item >= 0 && k < (item * 7919) % 2000; k++)
            continue;
        if (item >= 0 && item == c->fail) {
            par_turns_fail(c->turns, E_NOCONV);
            return E_NOCONV;
        }
        if (item >= 0)
            held[n++] = item;
        while (n && (item < 0 || n == HELD || par_turn_ready(c->turns, PLACES - 1, held[0]))) {
            for (int place = 0; place < PLACES; place++) {
                int st = par_turn_wait(c->turns, place, held[0]);
                if (st)
                    return st;
                c->order[place][c->n[place]++] = held[0];
                par_turn_give(c->turns, place, held[0] + 1);
            }
            memmove(held, held + 1, (size_t)--n * sizeof *held);
        }
        if (item < 0)
            return OK;
    }
}

static int in_order(const struct chain *c, long n)
{
    int good = 1;
    for (int place = 0; place < PLACES; place++) {
        good &= c->n[place] == n;
        for (long i = 0; i < c->n[place]; i++)
            good &= c->order[place][i] == i;
    }
    return good;
}

#ifdef CPU_COUNT
struct masks {
    cpu_set_t mask[2];
    int met[2];                    /* worker's were here */
};

/* Waits until both workers have come, and notes where this one may run. */
static int note_mask(void *ctx, long begin, long end, int worker)
{
    struct masks *m = ctx;
    (void)begin;
    (void)end;
    int st = sched_getaffinity(0, sizeof m->mask[0], &m->mask[worker]) ? E_IO : OK;
    __atomic_store_n(&m->met[worker], 1, __ATOMIC_RELEASE);
    while (!st && !__atomic_load_n(&m->met[1 - worker], __ATOMIC_ACQUIRE))
        sched_yield();
    return st;
}

/* A thread is sent to another processor when it starts, but not kept from any: it may run where its maker may. */
static void masks_stay(void)
{
    cpu_set_t mine;
    struct par_team *team = par_team_new(2);
    int good = sched_getaffinity(0, sizeof mine, &mine) == 0, kept = 1;
    for (int k = 0; k < 40 && good; k++) {
        struct masks m;
        memset(&m, 0, sizeof m);
        good = (k % 2 ? par_team_for(team, 2, 1, note_mask, &m) : par_for(2, 1, 2, note_mask, &m)) == OK;
        kept &= CPU_EQUAL(&mine, &m.mask[0]) && CPU_EQUAL(&mine, &m.mask[1]);
    }
    par_team_free(team);
    check_that(good && kept, "threads may run wherever their maker may, in 20 loops of new ones and 20 of those that stay");
}
#endif

enum { STAGES = 40 };

struct crewed {
    struct par_crew *crew;
    int done[STAGES];              /* items of each stage */
    int early;                     /* threads that found the stage before unfinished */
    int fail;                      /* stage in which somebody fails, or -1 */
    int left[STAGES];              /* threads that left after that stage with the failure */
};

static int items_of(int stage)
{
    return (stage * 7) % 23;
}

/* Forty stages of 0 to 22 items of unequal length; nobody may see a stage before all items of the last are done. */
static int stages(void *ctx, long begin, long end, int worker)
{
    struct crewed *c = ctx;
    int st = OK;
    (void)begin;
    (void)end;
    (void)worker;
    for (int stage = 0; stage < STAGES; stage++) {
        if (stage && __atomic_load_n(&c->done[stage - 1], __ATOMIC_RELAXED) != items_of(stage - 1))
            __atomic_add_fetch(&c->early, 1, __ATOMIC_RELAXED);
        for (long item; st == OK && (item = par_crew_take(c->crew)) < items_of(stage);) {
            for (volatile long k = 0; k < (item * 7919) % 2000; k++)
                continue;
            __atomic_add_fetch(&c->done[stage], 1, __ATOMIC_RELAXED);
            if (stage == c->fail && item == 0)
                st = E_NOCONV;
        }
        st = par_crew_meet(c->crew, st);
        if (st) {
            __atomic_add_fetch(&c->left[stage], 1, __ATOMIC_RELAXED);
            return st;
        }
    }
    return OK;
}

static void crews(void)
{
    static struct crewed c;
    for (int threads = 1; threads <= 5; threads += 2) {
        struct par_team *team = par_team_new(threads);
        const int size = par_team_size(team);
        int good = 1, left = 1;
        for (int k = 0; k < 20; k++) {
            memset(&c, 0, sizeof c);
            c.fail = -1;
            c.crew = par_crew_new(size);
            good &= c.crew && par_team_for(team, size, 1, stages, &c) == OK && c.early == 0;
            for (int stage = 0; stage < STAGES; stage++)
                good &= c.done[stage] == items_of(stage);
            par_crew_free(c.crew);
            memset(&c, 0, sizeof c);
            c.fail = 1 + k;
            c.crew = par_crew_new(size);
            left &= c.crew && par_team_for(team, size, 1, stages, &c) == E_NOCONV && c.left[c.fail] == size && c.done[c.fail + 1] == 0;
            par_crew_free(c.crew);
        }
        check_that(good, "a crew of %d: no item twice, none of a stage before the last is ended, 20 times 40 stages", size);
        check_that(left, "a crew of %d: one failure, and all leave with it at the end of its stage", size);
        par_team_free(team);
    }
    check_that(par_crew_new(0) == NULL, "no threads, no crew");
}

int main(void)
{
#ifdef CPU_COUNT
    masks_stay();
#endif
    crews();
    static int times[N];
    for (int threads = 1; threads <= 5; threads += 2) {
        memset(times, 0, sizeof times);
        int once = par_for(N, 7, threads, count, times) == OK;
        for (int i = 0; i < N; i++)
            once &= times[i] == 1;
        check_that(once, "%d threads: every item once", threads);
        long bad = 500;
        check_that(par_for(N, 7, threads, fail_at, &bad) == E_NOCONV, "%d threads: a failure is told", threads);
    }
    for (int threads = 2; threads <= 5; threads++) {
        struct par_team *team = par_team_new(threads);
        int once = 1;
        for (int n = 1; n < N; n += 37) {
            memset(times, 0, sizeof times);
            once &= par_team_for(team, n, 7, count, times) == OK;
            for (int i = 0; i < N; i++)
                once &= times[i] == (i < n);
        }
        long bad = 500;
        once &= par_team_for(team, N, 7, fail_at, &bad) == E_NOCONV;
        par_team_free(team);
        check_that(once, "a team of %d: every item of 28 loops once, a failure is told", threads);
    }
    check_that(par_for(-1, 1, 1, count, times) == E_RANGE && par_for(1, 0, 1, count, times) == E_RANGE && par_for(1, 1, 0, count, times) == E_RANGE,
               "sizes that make no sense");

    static struct chain c;
    for (int threads = 1; threads <= 5; threads += 2) {
        int good = 1;
        for (int k = 0; k < 20; k++) {
            memset(&c, 0, sizeof c);
            c.fail = -1;
            c.turns = par_turns_new(PLACES, N);
            good &= c.turns && par_for(threads, 1, threads, chained, &c) == OK && in_order(&c, N);
            par_turns_free(c.turns);
        }
        check_that(good, "%d threads: 1000 items come to three places in their order, 20 times", threads);
        good = 1;
        for (int k = 0; k < 20; k++) {
            memset(&c, 0, sizeof c);
            c.fail = 300 + 7 * k;
            c.turns = par_turns_new(PLACES, N);
            good &= c.turns && par_for(threads, 1, threads, chained, &c) == E_NOCONV && c.n[0] <= c.fail;
            par_turns_free(c.turns);
        }
        check_that(good, "%d threads: an item that fails ends the others, and none passes it, 20 times", threads);
    }
    check_that(par_turns_new(0, 5) == NULL, "no places, no turns");
    return check_status();
}
