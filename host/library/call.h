/* What a call of the library has around its work: the options, threads and
 * memory that it may use, progress, and the floating-point environment. */
#ifndef HOST_LIBRARY_CALL_H
#define HOST_LIBRARY_CALL_H

#include "delaunay.h"
#include "host/base/parallel.h"
#include "host/mesh/order.h"

#pragma GCC visibility push(default)
#include "incode.h"
#pragma GCC visibility pop

/* The head of what the functions below are given. */
struct library_call {
    /* Returns the status of the work, which owns no result unless it is
     * INCODE_OK.  host_call() is this call's. */
    enum incode_status (*work)(struct library_call *call);
    /* Of the work, as a part of 1, never going back: from another thread. */
    double (*done)(struct library_call *call);
    /* Frees the result that was made, as the last progress has cancelled.
     * NULL: the call owns none. */
    void (*drop)(struct library_call *call);
    struct host_call host;
    enum incode_status status;
};

/* Turns NULL into the defaults.  False: a flag that is not known, or reserved
 * that is not NULL. */
bool library_options(const struct incode_options **options,
                     unsigned known_flags);

/* Does the work.  useful: the threads that gain time, at least 1, where the
 * caller has given no number. */
enum incode_status library_call(struct library_call *call,
                                const struct incode_options *options,
                                uint64_t useful);

/* Orders points for host_direct_run.  What a failure means; the call may be
 * cancelled as well. */
enum incode_status library_order(struct host_order *order, const double *xyz,
                                 uint64_t rows, struct host_error *error);

/* What an outcome of host_direct_run means. */
enum incode_status library_direct(enum host_direct outcome);

#endif
