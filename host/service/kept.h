/* What the host of a cube keeps in a journal while it runs (`--resume`), and
 * takes from there when it is started again.
 *
 * A record has the tetrahedra that have come since the one before, and the
 * bricks that were committed since then, each with the number of its
 * tetrahedra; or that are to be done again.  A brick that was committed counts
 * if all its tetrahedra are there.  After a loss the next generation of records
 * begins, and what was not committed is dropped, when the journal is read as
 * when it was written.
 *
 * A commit is in the file 20 ms after it is here, or sooner.
 *
 * Memory: 4 bytes a brick, 8 bytes a commit that is not written yet.  Work: the
 * owner of each tetrahedron. */
#ifndef HOST_SERVICE_KEPT_H
#define HOST_SERVICE_KEPT_H

#include "host/base/journal.h"
#include "ledger.h"

struct host_kept_event {
    uint32_t brick;
    uint32_t rows; /* all bits set: it is to be done again */
};

struct host_kept {
    /* Given by the caller, who clears the rest. */
    struct host_journal *journal;
    uint64_t key;          /* of the order */
    const char *directory; /* for a note of what is there; NULL: none */
    /* Results. */
    uint32_t resumed; /* bricks */
    unsigned unsound; /* records that are damaged */
    /* Private. */
    uint32_t *rows;   /* [bricks] tetrahedra of each that are here */
    uint64_t written; /* of the list of all; the rest is not in the file yet */
    uint64_t written_us;
    struct host_kept_event *event; /* likewise */
    size_t events, events_max;
    uint32_t generation;
};

/* What an earlier run of the host has kept counts as the work of a node of this
 * number, which no node has. */
static inline uint32_t host_kept_by(const struct host_ledger *ledger) {
    return ledger->nodes;
}

/* For all: kept is NULL where nothing is to be kept. */

/* Fills a ledger and a list that are empty with what is kept; then what is not
 * committed has to be dropped, and host_kept_lost be called.  0, or the error
 * is set. */
int host_kept_load(struct host_kept *kept, struct host_ledger *ledger,
                   const struct host_order *order, struct host_tetrahedra *tets,
                   struct host_error *error);

/* Tetrahedra have come, and are at the end of the list. */
void host_kept_rows(struct host_kept *kept, const struct host_ledger *ledger,
                    const struct host_order *order, const uint32_t (*rows)[4],
                    uint64_t count);

/* A brick was committed, or is to be done again, as the ledger has it. */
int host_kept_brick(struct host_kept *kept, const struct host_ledger *ledger,
                    uint32_t brick, struct host_error *error);

/* Appends what is not in the file, if it is time. */
int host_kept_write(struct host_kept *kept, const struct host_tetrahedra *tets,
                    uint64_t now_us, struct host_error *error);

/* What is not committed is about to be dropped; was dropped. */
int host_kept_lose(struct host_kept *kept, const struct host_tetrahedra *tets,
                   struct host_error *error);
void host_kept_lost(struct host_kept *kept, const struct host_ledger *ledger,
                    const struct host_tetrahedra *tets);

void host_kept_free(struct host_kept *kept);

#endif
