/*
 * par.c - parallel for over chunks of items.
 *
 * A thread that is made or woken often waits on its maker's processor until the system balances its load, ticks of 4 ms
 * later, while another processor has nothing to do.  So it is sent away at once: for a moment it may run everywhere but there.
 */
#include "par.h"
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>

#define LOOKS 200         /* of who waits in a crew, giving way to others between them, before it sleeps */

/* ---- processors ---- */

#ifdef CPU_COUNT
struct places {
    cpu_set_t all, others;    /* of this program; without the caller's */
    int here, known;          /* the caller's; 0: there is no other one */
};

static void places_find(struct places *p)
{
    p->here = sched_getcpu();
    p->known = p->here >= 0 && p->here < CPU_SETSIZE && sched_getaffinity(0, sizeof p->all, &p->all) == 0
            && CPU_ISSET((size_t)p->here, &p->all) && CPU_COUNT(&p->all) > 1;
    if (!p->known)
        return;
    p->others = p->all;
    CPU_CLR((size_t)p->here, &p->others);
}

/* Send a thread that last ran on processor `last` (-1: not yet) away from the caller's; 1: it has to call places_free. */
static int places_send(const struct places *p, pthread_t thread, int last)
{
    return p->known && (last < 0 || last == p->here) && pthread_setaffinity_np(thread, sizeof p->others, &p->others) == 0;
}

static void places_free(const struct places *p)
{
    (void)pthread_setaffinity_np(pthread_self(), sizeof p->all, &p->all);
}

static int this_place(void)
{
    return sched_getcpu();
}
#else
struct places {
    int known;
};

static void places_find(struct places *p)
{
    p->known = 0;
}

static int places_send(const struct places *p, pthread_t thread, int last)
{
    (void)p;
    (void)thread;
    (void)last;
    return 0;
}

static void places_free(const struct places *p)
{
    (void)p;
}

static int this_place(void)
{
    return -1;
}
#endif

/* ---- the work ---- */

enum { MOST = 256 };

struct share {
    long next, end;           /* items not handed out */
};

struct pool {
    pthread_mutex_t lock;
    long chunk;
    int shares;               /* one for all, or one for each worker */
    struct share share[MOST];
    int status;               /* status of the failure with the lowest item */
    long failed_at;
    par_body *body;
    void *ctx;
    struct places places;
};

struct worker {
    struct pool *pool;
    int id;
    int begun, sent;          /* runs; was sent to another processor before */
};

static void share_out(struct pool *p, long n, int shares)
{
    const long chunks = n / p->chunk + (n % p->chunk > 0);
    p->shares = shares;
    for (int k = 0; k < shares; k++) {
        const long end = chunks * (k + 1) / shares;
        p->share[k] = (struct share){chunks * k / shares * p->chunk, end == chunks ? n : end * p->chunk};
    }
}

/* The next chunk of the worker's own share, or the last one of the largest share left. */
static int take(struct pool *p, int worker, long *begin, long *end)
{
    pthread_mutex_lock(&p->lock);
    struct share *mine = &p->share[p->shares > 1 ? worker : 0], *from = mine;
    for (int k = 0; k < p->shares && mine->next >= mine->end; k++)
        if (p->share[k].end - p->share[k].next > from->end - from->next)
            from = &p->share[k];
    int more = from->next < from->end && p->status == OK;
    if (more && from == mine) {
        *begin = from->next;
        *end = from->end - from->next > p->chunk ? from->next + p->chunk : from->end;
        from->next = *end;
    } else if (more) {
        *begin = from->next + (from->end - from->next - 1) / p->chunk * p->chunk;
        *end = from->end;
        from->end = *begin;
    }
    pthread_mutex_unlock(&p->lock);
    return more;
}

static void *work(void *arg)
{
    struct worker *w = arg;
    struct pool *p = w->pool;
    long begin, end;
    while (take(p, w->id, &begin, &end)) {
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

/* A thread made for one loop. */
static void *begin(void *arg)
{
    struct worker *w = arg;
    pthread_mutex_lock(&w->pool->lock);
    w->begun = 1;
    const int sent = w->sent;
    pthread_mutex_unlock(&w->pool->lock);
    if (sent)
        places_free(&w->pool->places);
    return work(w);
}

static int make_thread(struct worker *w, pthread_t *id)
{
    struct pool *p = w->pool;
    if (pthread_create(id, NULL, begin, w))
        return 0;
    pthread_mutex_lock(&p->lock);
    if (!w->begun)
        w->sent = places_send(&p->places, *id, -1);
    pthread_mutex_unlock(&p->lock);
    return 1;
}

/* ---- threads that stay ---- */

struct member {
    struct par_team *team;
    int id;
    pthread_t thread;
    int last, sent;           /* the processor it waits on, -1: not there yet; was sent to another one */
};

struct par_team {
    int made;                 /* threads besides the caller's */
    struct member member[MOST - 1];
    pthread_mutex_t lock;
    pthread_cond_t start, done;
    struct pool *pool;        /* what to work on */
    struct places places;
    unsigned long turn;       /* counts loops */
    int busy, stop;
};

static void *serve(void *arg)
{
    struct member *me = arg;
    struct par_team *t = me->team;
    struct worker self = {.id = me->id};
    unsigned long seen = 0;
    pthread_mutex_lock(&t->lock);
    for (;;) {
        me->last = this_place();
        while (t->turn == seen && !t->stop)
            pthread_cond_wait(&t->start, &t->lock);
        if (t->stop)
            break;
        seen = t->turn;
        self.pool = t->pool;
        const int sent = me->sent;
        const struct places places = t->places;
        me->sent = 0;
        pthread_mutex_unlock(&t->lock);
        if (sent)
            places_free(&places);
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
    if (n < 0 || chunk < 1 || threads < 1 || threads > MOST)
        return E_RANGE;

    struct pool p = {.chunk = chunk, .body = body, .ctx = ctx};
    struct worker self[MOST];
    pthread_t id[MOST];
    if (pthread_mutex_init(&p.lock, NULL))
        return E_NOMEM;
    share_out(&p, n, 1);
    if ((n + chunk - 1) / chunk < threads)
        threads = n > 0 ? (int)((n + chunk - 1) / chunk) : 1;

    int made = 0;
    if (threads > 1)
        places_find(&p.places);
    for (int t = 1; t < threads; t++) {
        self[made + 1] = (struct worker){.pool = &p, .id = made + 1};
        made += make_thread(&self[made + 1], &id[made]);
    }
    self[0] = (struct worker){.pool = &p};
    work(&self[0]);
    for (int t = 0; t < made; t++)
        pthread_join(id[t], NULL);
    pthread_mutex_destroy(&p.lock);
    return p.status;
}

struct par_team *par_team_new(int threads)
{
    struct par_team *t = threads > 1 && threads <= MOST ? calloc(1, sizeof *t) : NULL;
    if (!t)
        return NULL;
    if (pthread_mutex_init(&t->lock, NULL) || pthread_cond_init(&t->start, NULL) || pthread_cond_init(&t->done, NULL)) {
        free(t);
        return NULL;
    }
    for (int k = 0; k < threads - 1; k++) {
        t->member[k] = (struct member){.team = t, .id = k + 1, .last = -1};
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
    struct pool p = {.chunk = chunk, .body = body, .ctx = ctx};
    struct worker self = {.pool = &p};
    if (pthread_mutex_init(&p.lock, NULL))
        return E_NOMEM;
    const int others = team && n > chunk ? team->made : 0;
    share_out(&p, n, others + 1);
    if (others) {
        pthread_mutex_lock(&team->lock);
        team->pool = &p;
        team->busy = others;
        team->turn++;
        places_find(&team->places);
        for (int k = 0; k < others; k++)
            team->member[k].sent |= places_send(&team->places, team->member[k].thread, team->member[k].last);
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

void par_turn_give(struct par_turns *t, int place, long item)
{
    pthread_mutex_lock(&t->lock);
    t->turn[place] = item;
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

/* ---- crews ---- */

struct par_crew {
    int threads;
    atomic_long next;         /* item of this stage */
    atomic_int here;          /* have come to the meeting */
    atomic_uint stage;        /* meetings that are over */
    atomic_int failure;       /* of this stage, so far */
    int status;               /* of the last meeting; written before `stage` moves */
    pthread_mutex_t lock;
    pthread_cond_t over;
};

struct par_crew *par_crew_new(int threads)
{
    struct par_crew *c = threads > 0 ? calloc(1, sizeof *c) : NULL;
    if (!c)
        return NULL;
    c->threads = threads;
    if (pthread_mutex_init(&c->lock, NULL) || pthread_cond_init(&c->over, NULL)) {
        free(c);
        return NULL;
    }
    return c;
}

long par_crew_take(struct par_crew *c)
{
    return atomic_fetch_add_explicit(&c->next, 1, memory_order_relaxed);
}

/* Until meeting number `stage` is over. */
static void crew_wait(struct par_crew *c, unsigned stage)
{
    for (int look = 0; look < LOOKS; look++) {
        if (atomic_load_explicit(&c->stage, memory_order_acquire) != stage)
            return;
        sched_yield();
    }
    pthread_mutex_lock(&c->lock);
    while (atomic_load_explicit(&c->stage, memory_order_acquire) == stage)
        pthread_cond_wait(&c->over, &c->lock);
    pthread_mutex_unlock(&c->lock);
}

int par_crew_meet(struct par_crew *c, int status)
{
    const unsigned stage = atomic_load(&c->stage);
    if (status)
        atomic_store(&c->failure, status);
    if (atomic_fetch_add(&c->here, 1) + 1 < c->threads) {
        crew_wait(c, stage);
        return c->status;
    }
    c->status = atomic_load(&c->failure);      /* the last to come: nobody else moves */
    atomic_store(&c->here, 0);
    atomic_store(&c->next, 0);
    pthread_mutex_lock(&c->lock);
    atomic_store(&c->stage, stage + 1);
    pthread_cond_broadcast(&c->over);
    pthread_mutex_unlock(&c->lock);
    return c->status;
}

void par_crew_free(struct par_crew *c)
{
    if (!c)
        return;
    pthread_cond_destroy(&c->over);
    pthread_mutex_destroy(&c->lock);
    free(c);
}
