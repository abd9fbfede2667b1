/* The check of a result before success is reported, and what follows where it
 * fails.  Part of service.h.
 *
 * When every brick is committed, host_check (host/verify/check.h) checks the
 * whole result on threads of its own, while the service goes on answering
 * links.  If the check fails, the judge finds which tetrahedra at the faults
 * are wrong, which came twice and which are missing.  The ledger knows which
 * node committed their bricks.  A node that worked alone is at fault: it is
 * excluded, and other nodes do every brick again that it committed.  Where
 * nodes worked together, a wrong brick proves nothing against any one of them.
 * Then the strategy host_redo does the bricks concerned again, each range of
 * bricks by one node alone, so that the next check can name the node.
 *
 * A node is named by the source of its messages.  If a node on the path alters
 * the frames of another node, and renews the link's checksum, the other node is
 * blamed; the result is right all the same.
 *
 * A run gives up, with HOST_UNVERIFIED, when no other node is left, or when
 * more than nodes + 4 checks have failed.
 *
 * Memory: that of the check, a byte a brick and 300 KB; while faults are
 * analysed, 48 bytes a brick as well.  The analysis of a failure adds the
 * judge's work for at most 512 tetrahedra, their facets and the tetrahedra
 * beyond these, and a pass over the result. */
#ifndef HOST_AUDIT_H
#define HOST_AUDIT_H

#include <stdbool.h>
#include <stdint.h>

#include "host/base/parallel.h"
#include "host/verify/check.h"

struct host_service;

/* When the exact check is made besides the cheap one. */
enum host_verifying {
    HOST_VERIFY_WHERE_DUE, /* of a cube file or ranks; after a loss */
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
    uint64_t secret; /* given by the caller: random, nodes do not know it */
    enum { HOST_AUDIT_DUE, HOST_AUDIT_RUNS, HOST_AUDIT_PASSED } state;
    bool ended;       /* the check's thread has; atomic */
    bool exact;       /* this check covers the Delaunay property, too */
    bool lost_work;   /* a generation began while there was work */
    unsigned failed;  /* checks in this run */
    unsigned unclear; /* failed checks after which no node was named */
    struct host_fork fork;
    struct host_check_report report;
    struct host_error error;
    uint64_t begun_us, spent_us;
    /* Of a check that has failed. */
    struct host_audit_place place[HOST_AUDIT_PLACES];
    unsigned places;
    uint32_t bricks;
    uint8_t *redo;                  /* [bricks] 1: to be done again */
    uint8_t *guilty;                /* [nodes] 1: at fault */
    unsigned first;                 /* a node at fault, */
    char why[HOST_AUDIT_WHY_BYTES]; /* and the proof against it */
    char suspects[40]; /* of nodes that worked together; empty: not known */
};

/* Begins the check, or polls whether it has ended; *passed: the result is
 * right.  If the check has failed, the service goes on with a new generation,
 * or the run is over with HOST_UNVERIFIED. */
int host_audit_step(struct host_service *service, bool *passed,
                    struct host_error *error);

/* From now on each brick is the work of one node alone. */
void host_audit_alone(struct host_service *service);

/* Excludes a node for the rest of the run; the bricks that it committed are not
 * trusted.  what: "its result was wrong: ...". */
void host_audit_exclude(struct host_service *service, unsigned node,
                        const char *what);

/* Whether any node besides `node` is left that can work. */
bool host_audit_is_other(const struct host_service *service, unsigned node);

/* Ends a check that still runs. */
void host_audit_free(struct host_audit *audit);

#endif
