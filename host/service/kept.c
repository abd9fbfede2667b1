#include "kept.h"

#include <stdlib.h>
#include <string.h>

#include "host/base/parallel.h"
#include "host/base/progress.h"

enum {
    ROWS = 2,            /* of records: host/run/state.c has others */
    WRITE_US = 20000,    /* between two records, */
    WRITE_ROWS = 1 << 14 /* unless there are so many tetrahedra */
};

#define AGAIN UINT32_MAX

/* What is left are tetrahedra of committed bricks. */
static void count_committed(struct host_kept *k,
                            const struct host_ledger *ledger) {
    for (uint32_t b = 0; b < ledger->bricks; b++)
        if (!host_ledger_committed(ledger, b))
            k->rows[b] = 0;
}

/* --- writing -------------------------------------------------------------- */

void host_kept_rows(struct host_kept *kept, const struct host_ledger *ledger,
                    const struct host_order *order, const uint32_t (*rows)[4],
                    uint64_t count) {
    for (uint64_t i = 0; kept != NULL && i < count; i++)
        kept->rows[host_ledger_owner(ledger, order, rows[i])]++;
}

int host_kept_brick(struct host_kept *kept, const struct host_ledger *ledger,
                    uint32_t brick, struct host_error *error) {
    if (kept == NULL)
        return 0;
    if (kept->events == kept->events_max) {
        size_t more = kept->events_max == 0 ? 256 : 2 * kept->events_max;
        void *moved = realloc(kept->event, more * sizeof *kept->event);
        if (moved == NULL)
            return host_fail_memory(error, "the list of commits");
        kept->event = moved;
        kept->events_max = more;
    }
    bool is_committed = host_ledger_committed(ledger, brick);
    kept->event[kept->events++] = (struct host_kept_event){
        brick, is_committed ? kept->rows[brick] : AGAIN};
    return 0;
}

static int write_now(struct host_kept *k, const struct host_tetrahedra *tets,
                     struct host_error *error) {
    uint64_t rows = tets->count - k->written;
    struct host_journal_head head = {.kind = ROWS,
                                     .key = k->key,
                                     .number = k->generation,
                                     .rows = {rows, k->events}};
    const struct host_bytes part[] = {
        {k->event, k->events * sizeof *k->event},
        {tets->v + k->written, rows * sizeof *tets->v}};
    k->written = tets->count;
    k->events = 0;
    return host_journal_append(k->journal, &head, part, 2, error);
}

int host_kept_write(struct host_kept *kept, const struct host_tetrahedra *tets,
                    uint64_t now_us, struct host_error *error) {
    struct host_kept *k = kept;
    if (k == NULL || k->events == 0 ||
        (now_us - k->written_us < WRITE_US &&
         tets->count - k->written < WRITE_ROWS))
        return 0;
    k->written_us = now_us;
    return write_now(k, tets, error);
}

int host_kept_lose(struct host_kept *kept, const struct host_tetrahedra *tets,
                   struct host_error *error) {
    return kept == NULL || kept->events == 0 ? 0 : write_now(kept, tets, error);
}

void host_kept_lost(struct host_kept *kept, const struct host_ledger *ledger,
                    const struct host_tetrahedra *tets) {
    if (kept == NULL)
        return;
    count_committed(kept, ledger);
    kept->written = tets->count;
    kept->generation++;
}

/* --- reading -------------------------------------------------------------- */

/* What host_kept_load works on. */
struct reading {
    struct host_kept *kept;
    struct host_ledger *ledger;
    const struct host_order *order;
    struct host_tetrahedra *tets;
};

/* The next generation drops what the last one has not committed. */
static void begin_generation(const struct reading *r, uint32_t generation) {
    if (r->tets->count > 0)
        (void)host_ledger_abandon(r->ledger, 1, r->order, r->tets);
    count_committed(r->kept, r->ledger);
    r->kept->generation = generation;
}

static void take_event(const struct reading *r, struct host_kept_event event) {
    struct host_ledger *ledger = r->ledger;
    if (event.brick >= ledger->bricks)
        return;
    bool is_committed = host_ledger_committed(ledger, event.brick);
    if (event.rows == AGAIN && is_committed)
        host_ledger_reopen(ledger, event.brick);
    else if (event.rows == r->kept->rows[event.brick] && !is_committed)
        host_ledger_restore(ledger, event.brick, host_kept_by(ledger));
}

/* Rows and events of a record, which counts if all of it is sound. */
static int take_record(const struct reading *r,
                       const struct host_journal_record *record,
                       struct host_error *error) {
    struct host_kept *k = r->kept;
    uint64_t rows = record->head.rows[0], events = record->head.rows[1];
    struct host_journal_reader reader;
    host_journal_read(&reader, k->journal, record);
    if (reader.left != rows * sizeof *r->tets->v + events * sizeof *k->event) {
        k->unsound++;
        return 0;
    }
    struct host_kept_event *event = malloc(events * sizeof *event + 1);
    uint32_t(*v)[4] = host_tetrahedra_room(r->tets, rows, error);
    if (event == NULL)
        host_fail_memory(error, "the list of commits");
    if (event != NULL && v != NULL &&
        host_journal_take(&reader, event, events * sizeof *event) &&
        host_journal_take(&reader, v, rows * sizeof *v) &&
        host_journal_sound(&reader)) {
        host_tetrahedra_keep(r->tets, rows);
        host_kept_rows(k, r->ledger, r->order, (const uint32_t(*)[4])v, rows);
        if (host_ledger_found(r->ledger, host_kept_by(r->ledger), rows,
                              error) == 0)
            for (uint64_t i = 0; i < events; i++)
                take_event(r, event[i]);
    } else if (error->code == 0) {
        k->unsound++;
    }
    free(event);
    return error->code;
}

int host_kept_load(struct host_kept *kept, struct host_ledger *ledger,
                   const struct host_order *order, struct host_tetrahedra *tets,
                   struct host_error *error) {
    struct host_kept *k = kept;
    if (k == NULL)
        return 0;
    const struct reading r = {k, ledger, order, tets};
    k->rows = calloc((size_t)ledger->bricks + 1, sizeof *k->rows);
    if (k->rows == NULL)
        return host_fail_memory(error, "the list of bricks");
    for (size_t i = 0; i < k->journal->records; i++) {
        const struct host_journal_record *record = &k->journal->record[i];
        if (record->head.kind != ROWS || record->head.key != k->key)
            continue;
        if (record->head.number != k->generation)
            begin_generation(&r, record->head.number);
        if (take_record(&r, record, error) != 0)
            return error->code;
    }
    if (ledger->committed == 0)
        begin_generation(&r, k->generation);
    k->resumed = ledger->committed;
    if (k->directory != NULL)
        host_note("%s: resuming: %.0f %% of the bricks are there", k->directory,
                  100.0 * k->resumed / ledger->bricks);
    return 0;
}

void host_kept_free(struct host_kept *kept) {
    if (kept == NULL)
        return;
    free(kept->rows);
    free(kept->event);
    kept->rows = NULL;
    kept->event = NULL;
}
