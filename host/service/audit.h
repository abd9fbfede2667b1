/* The check of a result before success is reported, and what follows where it
 * fails.  Part of service.h.
 *
 * When every brick is committed, host_check (host/check/check.h) judges the
 * whole result on threads of its own, while the service goes on answering
 * links.  If the check fails, the judge says of the tetrahedra at the faults
 * which ones are wrong and which ones are missing.  A tetrahedron that is not
 * Delaunay was found by a node that the ledger knows; a missing one, or one
 * that came twice, belongs to a brick that a node committed.  That node is at
 * fault if it worked alone, or if it found the tetrahedron itself; it is
 * excluded, and every brick that it committed or has a hand in is done again by
 * others.  What nodes did together and proves nothing against one of them is
 * done again as well.  All of this goes by the strategy host_redo: each range
 * of bricks by one node alone, so that the next check can name the node.
 *
 * A run gives up, with HOST_UNVERIFIED, when no other node is left, or when a
 * check fails although everything has been done again and no node is at fault.
 *
 * Memory: that of the check, a byte a brick and a few KB; while faults are
 * analysed 48 bytes a brick.  Work: that of the check; to analyse a failure,
 * one pass over the boxes of bricks for each of at most 768 tetrahedra and
 * facets.
 *
 *     bool passed = false;
 *     if (host_audit_step(&service, &passed, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_AUDIT_H
#define HOST_AUDIT_H

#include <stdbool.h>
#include <stdint.h>

#include "host/base/parallel.h"
#include "host/check/check.h"

struct host_service;

/* When the exact check is made besides the cheap one. */
enum host_verifying {
    HOST_VERIFY_WHERE_DUE, /* on foreign nodes, and after a loss */
    HOST_VERIFY_ALWAYS,
    HOST_VERIFY_NEVER
};

enum {
    HOST_AUDIT_PLACES = 256, /* faults that are analysed */
    HOST_AUDIT_WHY_BYTES = 200
};

/* A fault, as the check has named it. */
struct host_audit_place {
    uint64_t tet[2];
    uint32_t vertex[5];
    uint8_t tets, vertices;
};

struct host_audit {
    enum { HOST_AUDIT_DUE, HOST_AUDIT_RUNS, HOST_AUDIT_PASSED } state;
    bool ended;       /* the thread has: atomic */
    bool exact;       /* this one checks the Delaunay property, too */
    bool lost_work;   /* a generation began while there was work */
    unsigned failed;  /* checks in this run */
    unsigned unclear; /* of these, those that no node was named for */
    struct host_fork fork;
    struct host_check_report report;
    struct host_error error;
    uint64_t begun_us, spent_us;
    /* Of a check that has failed. */
    struct host_audit_place place[HOST_AUDIT_PLACES];
    unsigned places;
    uint8_t *redo;                  /* [bricks] 1: to be done again */
    uint8_t *guilty;                /* [nodes] 1: at fault */
    unsigned first;                 /* one of them, */
    char why[HOST_AUDIT_WHY_BYTES]; /* and the proof */
};

/* Begins the check, or looks whether it has ended; *passed: the result is
 * right.  Where it has failed, the service goes on with a new generation, or
 * the run is over with HOST_UNVERIFIED. */
int host_audit_step(struct host_service *service, bool *passed,
                    struct host_error *error);

/* From now on each brick is the work of one node alone. */
void host_audit_alone(struct host_service *service);

/* A node is excluded for the rest of the run, and what it committed is not
 * trusted; what: "its result was wrong: ...". */
void host_audit_exclude(struct host_service *service, unsigned node,
                        const char *what);

/* Whether a node is left that can work, besides that one. */
bool host_audit_is_other(const struct host_service *service, unsigned node);

/* Ends a check that still runs. */
void host_audit_free(struct host_audit *audit);

#endif
