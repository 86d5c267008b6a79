/*
 * par.h - the only place where threads are made.
 *
 * Results never depend on the number of threads: a body writes only what
 * belongs to its items, and sums that cross items are formed afterwards in
 * item order.
 */
#ifndef PIXSHEAR_PAR_H
#define PIXSHEAR_PAR_H

#include "err.h"

/*
 * Work on items begin <= i < end.  `worker` is 0..threads-1 and may index
 * scratch memory.  Returns OK or a status; after the first failure no new
 * chunk is started and par_for returns that status (of the lowest item).
 */
typedef int par_body(void *ctx, long begin, long end, int worker);

/*
 * Run body over 0 <= i < n in chunks of `chunk` items (chunk >= 1; boundaries
 * are multiples of chunk whatever the number of threads) on `threads` threads,
 * 1..256.  threads == 1 makes no thread.  When the system will not give
 * threads, the calling thread does the work alone.
 */
MUST_CHECK int par_for(long n, long chunk, int threads, par_body *body, void *ctx);

/*
 * Threads that stay, for many short loops: a thread made anew every few milliseconds starts beside its
 * maker and is moved too late (measured: 1.2 times faster on two processors where threads that stay give 1.6).
 * par_team_new never fails: what cannot be had is done by the calling thread.  par_team_for is par_for on
 * them; one caller at a time.  Each thread begins with a part of the items of its own, the same part in every loop, so that
 * it finds in its cache what it left there; who is done helps others from the end of theirs.
 */
struct par_team;
struct par_team *par_team_new(int threads);
MUST_CHECK int par_team_for(struct par_team *team, long n, long chunk, par_body *body, void *ctx);
int par_team_size(const struct par_team *team);        /* threads, the caller's with them; 1 for NULL */
void par_team_free(struct par_team *team);

/*
 * Turns: items that work side by side, but come to each of some places (strips of an image, say) in the order of their
 * numbers.  A thread takes items one by one, holds as many as it likes, and brings each through all places in the
 * order of places and items; so the lowest unfinished item never waits for another.
 */
struct par_turns;
struct par_turns *par_turns_new(int places, long items);         /* NULL: no memory */
long par_turn_take(struct par_turns *t);                         /* 0, 1, 2 ...; -1: no more, or a failure */
int par_turn_ready(struct par_turns *t, int place, long item);   /* would it not wait? */
MUST_CHECK int par_turn_wait(struct par_turns *t, int place, long item);    /* OK, or what par_turns_fail was told */
void par_turn_give(struct par_turns *t, int place, long item);   /* its turn is now */
void par_turns_fail(struct par_turns *t, int status);            /* nobody waits any longer */
void par_turns_free(struct par_turns *t);

/*
 * A crew: exactly `threads` threads that go through stages together.  They take the items of a stage one by one, in any order, and meet at
 * its end: nobody goes on before all have come.  Who waits looks for some 50 us before it sleeps, so stages may be as short as that.
 */
struct par_crew;
struct par_crew *par_crew_new(int threads);                      /* NULL: no memory */
long par_crew_take(struct par_crew *c);                          /* 0, 1, 2 ... of this stage, without end */
MUST_CHECK int par_crew_meet(struct par_crew *c, int status);    /* OK when all came with OK, else one of their failures, the same for all */
void par_crew_free(struct par_crew *c);

#endif
