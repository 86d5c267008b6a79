/* par.c - parallel for over chunks of items. */
#include "par.h"
#include <pthread.h>
#include <stdlib.h>

struct pool {
    pthread_mutex_t lock;
    long n, chunk, next;      /* next: first item not handed out */
    int status;               /* status of the failure with the lowest item */
    long failed_at;
    par_body *body;
    void *ctx;
};

struct worker {
    struct pool *pool;
    int id;
};

static int take(struct pool *p, long *begin, long *end)
{
    pthread_mutex_lock(&p->lock);
    int more = p->next < p->n && p->status == OK;
    if (more) {
        *begin = p->next;
        *end = p->n - p->next > p->chunk ? p->next + p->chunk : p->n;
        p->next = *end;
    }
    pthread_mutex_unlock(&p->lock);
    return more;
}

static void *work(void *arg)
{
    struct worker *w = arg;
    struct pool *p = w->pool;
    long begin, end;
    while (take(p, &begin, &end)) {
        int st = p->body(p->ctx, begin, end, w->id);
        if (st == OK)
            continue;
        pthread_mutex_lock(&p->lock);
        if (p->status == OK || begin < p->failed_at) {
            p->status = st;
            p->failed_at = begin;
        }
        pthread_mutex_unlock(&p->lock);
    }
    return NULL;
}

/* ---- threads that stay ---- */

struct member {
    struct par_team *team;
    int id;
    pthread_t thread;
};

struct par_team {
    int made;                 /* threads besides the caller's */
    struct member member[255];
    pthread_mutex_t lock;
    pthread_cond_t start, done;
    struct pool *pool;        /* what to work on */
    unsigned long turn;       /* counts loops */
    int busy, stop;
};

static void *serve(void *arg)
{
    struct member *me = arg;
    struct par_team *t = me->team;
    struct worker self = {NULL, me->id};
    unsigned long seen = 0;
    pthread_mutex_lock(&t->lock);
    for (;;) {
        while (t->turn == seen && !t->stop)
            pthread_cond_wait(&t->start, &t->lock);
        if (t->stop)
            break;
        seen = t->turn;
        self.pool = t->pool;
        pthread_mutex_unlock(&t->lock);
        work(&self);
        pthread_mutex_lock(&t->lock);
        if (--t->busy == 0)
            pthread_cond_signal(&t->done);
    }
    pthread_mutex_unlock(&t->lock);
    return NULL;
}

int par_for(long n, long chunk, int threads, par_body *body, void *ctx)
{
    if (n < 0 || chunk < 1 || threads < 1 || threads > 256)
        return E_RANGE;

    struct pool p = {.n = n, .chunk = chunk, .body = body, .ctx = ctx};
    struct worker self[256];
    pthread_t id[256];
    if (pthread_mutex_init(&p.lock, NULL))
        return E_NOMEM;
    if ((n + chunk - 1) / chunk < threads)
        threads = n > 0 ? (int)((n + chunk - 1) / chunk) : 1;

    int made = 0;
    for (int t = 1; t < threads; t++) {
        self[made + 1] = (struct worker){&p, made + 1};
        if (pthread_create(&id[made], NULL, work, &self[made + 1]) == 0)
            made++;
    }
    self[0] = (struct worker){&p, 0};
    work(&self[0]);
    for (int t = 0; t < made; t++)
        pthread_join(id[t], NULL);
    pthread_mutex_destroy(&p.lock);
    return p.status;
}

struct par_team *par_team_new(int threads)
{
    struct par_team *t = threads > 1 && threads <= 256 ? calloc(1, sizeof *t) : NULL;
    if (!t)
        return NULL;
    if (pthread_mutex_init(&t->lock, NULL) || pthread_cond_init(&t->start, NULL) || pthread_cond_init(&t->done, NULL)) {
        free(t);
        return NULL;
    }
    for (int k = 0; k < threads - 1; k++) {
        t->member[k] = (struct member){.team = t, .id = k + 1};
        if (pthread_create(&t->member[k].thread, NULL, serve, &t->member[k]))
            break;
        t->made++;
    }
    return t;
}

int par_team_for(struct par_team *team, long n, long chunk, par_body *body, void *ctx)
{
    if (n < 0 || chunk < 1)
        return E_RANGE;
    struct pool p = {.n = n, .chunk = chunk, .body = body, .ctx = ctx};
    struct worker self = {&p, 0};
    if (pthread_mutex_init(&p.lock, NULL))
        return E_NOMEM;
    const int others = team && n > chunk ? team->made : 0;
    if (others) {
        pthread_mutex_lock(&team->lock);
        team->pool = &p;
        team->busy = others;
        team->turn++;
        pthread_cond_broadcast(&team->start);
        pthread_mutex_unlock(&team->lock);
    }
    work(&self);
    if (others) {
        pthread_mutex_lock(&team->lock);
        while (team->busy)
            pthread_cond_wait(&team->done, &team->lock);
        pthread_mutex_unlock(&team->lock);
    }
    pthread_mutex_destroy(&p.lock);
    return p.status;
}

int par_team_size(const struct par_team *team)
{
    return team ? team->made + 1 : 1;
}

void par_team_free(struct par_team *team)
{
    if (!team)
        return;
    pthread_mutex_lock(&team->lock);
    team->stop = 1;
    pthread_cond_broadcast(&team->start);
    pthread_mutex_unlock(&team->lock);
    for (int k = 0; k < team->made; k++)
        pthread_join(team->member[k].thread, NULL);
    pthread_cond_destroy(&team->start);
    pthread_cond_destroy(&team->done);
    pthread_mutex_destroy(&team->lock);
    free(team);
}

/* ---- turns ---- */

struct par_turns {
    pthread_mutex_t lock;
    pthread_cond_t moved;
    int status;
    long items, next;         /* next: not taken */
    long turn[];              /* item whose turn it is, of each place */
};

struct par_turns *par_turns_new(int places, long items)
{
    struct par_turns *t = places > 0 ? calloc(1, sizeof *t + (size_t)places * sizeof t->turn[0]) : NULL;
    if (!t)
        return NULL;
    t->items = items;
    if (pthread_mutex_init(&t->lock, NULL) || pthread_cond_init(&t->moved, NULL)) {
        free(t);
        return NULL;
    }
    return t;
}

long par_turn_take(struct par_turns *t)
{
    pthread_mutex_lock(&t->lock);
    const long item = t->next < t->items && t->status == OK ? t->next++ : -1;
    pthread_mutex_unlock(&t->lock);
    return item;
}

int par_turn_ready(struct par_turns *t, int place, long item)
{
    pthread_mutex_lock(&t->lock);
    const int ready = t->turn[place] == item || t->status != OK;
    pthread_mutex_unlock(&t->lock);
    return ready;
}

int par_turn_wait(struct par_turns *t, int place, long item)
{
    pthread_mutex_lock(&t->lock);
    while (t->turn[place] != item && t->status == OK)
        pthread_cond_wait(&t->moved, &t->lock);
    const int st = t->status;
    pthread_mutex_unlock(&t->lock);
    return st;
}

void par_turn_end(struct par_turns *t, int place)
{
    pthread_mutex_lock(&t->lock);
    t->turn[place]++;
    pthread_cond_broadcast(&t->moved);
    pthread_mutex_unlock(&t->lock);
}

void par_turns_fail(struct par_turns *t, int status)
{
    pthread_mutex_lock(&t->lock);
    if (t->status == OK)
        t->status = status;
    pthread_cond_broadcast(&t->moved);
    pthread_mutex_unlock(&t->lock);
}

void par_turns_free(struct par_turns *t)
{
    if (!t)
        return;
    pthread_cond_destroy(&t->moved);
    pthread_mutex_destroy(&t->lock);
    free(t);
}
