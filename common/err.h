/*
 * err.h - status values, messages and exit.
 *
 * A kernel returns one of the statuses below and leaves its outputs alone when
 * it is not OK.  Only programs (cmd/) call die() and warn(), which write one
 * line "program: message" to stderr with control characters shown as '?'.
 */
#ifndef PIXSHEAR_ERR_H
#define PIXSHEAR_ERR_H

#define MUST_CHECK __attribute__((warn_unused_result))
#define PRINTF_LIKE(fmt, args) __attribute__((format(printf, fmt, args)))

enum status {
    OK = 0,
    E_RANGE,      /* an argument outside the documented domain */
    E_NOMEM,      /* out of memory, or more than --max-memory */
    E_DATA,       /* input that is not what it claims to be */
    E_IO,         /* the operating system refused; errno tells why */
    E_MISSING,    /* something asked for by name is not there */
    E_NOCONV,     /* an iteration did not converge */
    E_SINGULAR    /* a matrix or a fit without a unique solution */
};

enum exit_status { EXIT_DONE = 0, EXIT_RUN = 1, EXIT_USAGE = 2, EXIT_SKIPPED = 77 };

/* Sentence fragment for a status, "out of memory"; never NULL. */
const char *err_text(int status);

/* Print "program: message" and exit with `status` (EXIT_RUN or EXIT_USAGE). */
_Noreturn void die(int status, const char *fmt, ...) PRINTF_LIKE(2, 3);

/* Print "program: message" and go on. */
void warn(const char *fmt, ...) PRINTF_LIKE(1, 2);

/*
 * A message to hand up from a function that knows the cause better than a
 * status can say: reader functions fill one, programs print it.
 */
struct err {
    char text[512];
};

/* Format into e->text (cut at its length) and return `status`; e may be NULL. */
int err_set(struct err *e, int status, const char *fmt, ...) PRINTF_LIKE(3, 4);

#endif
