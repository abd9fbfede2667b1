/* What went wrong, as a value: an exit status and one line of text for the
 * user.  Nothing in host/ but main.c ends the program. */
#ifndef HOST_ERROR_H
#define HOST_ERROR_H

#include <stdint.h>

/* Exit statuses of the program. */
enum host_code {
    HOST_DONE = 0,
    HOST_BROKEN = 1,    /* the program itself failed */
    HOST_USAGE = 2,     /* wrong usage */
    HOST_INPUT = 3,     /* a wrong file or point; an output not writable */
    HOST_CUBE = 4,      /* cube, link or node failure */
    HOST_UNVERIFIED = 5 /* a verification failed */
};

struct host_error {
    int code;       /* enum host_code */
    char text[640]; /* "WHERE: WHAT; WHAT TO DO NEXT", one printable line */
};

/* Fills *error (the first one stands; later ones are dropped) and returns its
 * code, so that `return host_fail(...)` reads well. */
int host_fail(struct host_error *error, int code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The memory of this machine does not suffice for `what`: HOST_BROKEN; or where
 * this thread's call puts arrays aside (scratch.h), the disk: HOST_INPUT. */
int host_fail_memory(struct host_error *error, const char *what);

/* The clock by which the host measures and waits. */

/* Microseconds since any fixed time, never going back. */
uint64_t host_now_us(void);

#endif
