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
