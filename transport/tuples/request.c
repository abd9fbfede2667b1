/* A place's side: requests of all places, what is held for them, and the line
 * of those that wait, in the order in which they came.  No request in the line
 * matches a tuple that nobody holds. */
#include "space.h"

#include <string.h>

#include "transport/check.h"

static struct tuples_request *row_at(struct tuples *space, uint32_t row) {
    LINK_ASSERT(row < space->rows);
    return &space->requests[row];
}

static bool asks(const struct tuples_request *r) {
    return r->wish == TUPLES_TAKE || r->wish == TUPLES_READ;
}

/* --- the line ------------------------------------------------------------- */

static void join(struct tuples *space, uint32_t row) {
    struct tuples_request *r = row_at(space, row);
    r->waits = true;
    r->next = TUPLES_NOBODY;
    r->previous = space->last;
    if (space->last == TUPLES_NOBODY)
        space->first = row;
    else
        space->requests[space->last].next = row;
    space->last = row;
    space->waiting++;
    if (space->waiting > space->statistics.longest_wait)
        space->statistics.longest_wait = space->waiting;
}

static void leave(struct tuples *space, uint32_t row) {
    struct tuples_request *r = row_at(space, row);
    if (r->previous == TUPLES_NOBODY)
        space->first = r->next;
    else
        space->requests[r->previous].next = r->next;
    if (r->next == TUPLES_NOBODY)
        space->last = r->previous;
    else
        space->requests[r->next].previous = r->previous;
    space->asking_last -= r->last;
    space->waiting--;
    r->waits = r->last = false;
}

/* --- replies -------------------------------------------------------------- */

static void reply(struct tuples *space, uint32_t row, enum tuples_kind kind) {
    struct tuples_request *r = row_at(space, row);
    r->reply = (uint8_t)kind;
    if (!r->queued) {
        uint32_t at = (space->reply_first + space->reply_count) % space->rows;
        LINK_ASSERT(space->reply_count < space->rows);
        r->queued = true;
        space->replies[at] = row;
        space->reply_count++;
    }
}

static void set_free(struct tuples_request *r) {
    r->wish = TUPLES_NO_WISH;
    r->reply = 0;
    r->promised = false;
}

/* The record is this request's, until it says whether it takes it; a copy's,
 * until it is sent. */
static void hold(struct tuples *space, uint32_t row, uint32_t at) {
    tuples_store_at(&space->store, at)->holder = row;
    if (row_at(space, row)->waits)
        leave(space, row);
    reply(space, row, TUPLES_OFFER);
}

/* Gives a record that nobody holds to the first in line that it matches. */
static void pass(struct tuples *space, uint32_t at) {
    const uint8_t *tuple = tuples_store_tuple(&space->store, at);
    tuples_store_at(&space->store, at)->holder = TUPLES_UNHELD;
    for (uint32_t row = space->first; row != TUPLES_NOBODY;
         row = space->requests[row].next) {
        if (asks(&space->requests[row]) &&
            tuple_matches(space->requests[row].pattern, tuple)) {
            hold(space, row, at);
            return;
        }
    }
}

/* Tells a request in the line that there is nothing: not while something that
 * it matches is held, which may come back. */
static void tell_none(struct tuples *space, uint32_t row) {
    struct tuples_request *r = row_at(space, row);
    if (!tuples_store_is_held(&space->store, r->pattern)) {
        leave(space, row);
        reply(space, row, TUPLES_NONE);
    }
}

static void tell_all_none(struct tuples *space) {
    uint32_t row = space->asking_last == 0 ? TUPLES_NOBODY : space->first;
    while (row != TUPLES_NOBODY) {
        uint32_t next = space->requests[row].next;
        if (space->requests[row].last)
            tell_none(space, row);
        row = next;
    }
}

/* --- room ----------------------------------------------------------------- */

static bool may_promise(const struct tuples *space,
                        const struct tuples_request *r) {
    if (r->wish == TUPLES_RUN)
        return tuples_processes_free(space) > space->promised_processes;
    return tuples_store_needed(r->size) <=
           space->store.room - space->store.used - space->promised_bytes;
}

void tuples_request_promise(struct tuples *space) {
    bool full[TUPLES_RUN + 1] = {false};
    uint32_t row = space->first;
    while (row != TUPLES_NOBODY && !(full[TUPLES_STORE] && full[TUPLES_RUN])) {
        struct tuples_request *r = row_at(space, row);
        uint32_t next = r->next;
        if (!asks(r) && !full[r->wish]) {
            full[r->wish] = !may_promise(space, r);
            if (!full[r->wish]) {
                leave(space, row);
                r->promised = true;
                if (r->wish == TUPLES_RUN)
                    space->promised_processes++;
                else
                    space->promised_bytes += tuples_store_needed(r->size);
                reply(space, row, TUPLES_ROOM);
            }
        }
        row = next;
    }
}

/* A request is over that held a record: taken, or given back. */
static void decide(struct tuples *space, uint32_t row, bool taken) {
    uint32_t at = tuples_store_held_by(&space->store, row);
    LINK_ASSERT(at != TUPLES_NOWHERE);
#ifdef INCODE_PLANT_TAKEN_BY_TWO /* a fault that the tests have to find */
    if (taken) {
        pass(space, at);
        if (tuples_store_at(&space->store, at)->holder != TUPLES_UNHELD)
            return;
    }
#endif
    if (!taken) {
        pass(space, at);
        return;
    }
    tuples_store_drop(&space->store, at);
    space->statistics.taken++;
    space->accounts[row / space->each].taken++;
    tuples_request_promise(space);
    tell_all_none(space);
}

/* --- messages ------------------------------------------------------------- */

static bool take_ask(struct tuples *space, uint32_t row,
                     const struct tuples_header *header, const uint8_t *data,
                     size_t size) {
    struct tuples_request *r = row_at(space, row);
    struct tuple pattern;
    if (r->wish != TUPLES_NO_WISH || size > TUPLES_PATTERN_MAX ||
        !tuple_read(&pattern, data, size))
        return false;
    r->wish = header->flags & TUPLES_TAKES ? TUPLES_TAKE : TUPLES_READ;
    r->serial = header->serial;
    memcpy(r->pattern, data, size);
    uint32_t at = tuples_store_find(&space->store, r->pattern);
    if (at != TUPLES_NOWHERE) {
        hold(space, row, at);
        return true;
    }
    join(space, row);
    if (header->flags & TUPLES_AT_ONCE) {
        r->last = true;
        space->asking_last++;
        tell_none(space, row);
    } else {
        reply(space, row, TUPLES_NONE_YET);
    }
    return true;
}

static bool take_last(struct tuples *space, uint32_t row) {
    struct tuples_request *r = row_at(space, row);
    if (r->last)
        return false;
    if (r->waits) { /* and else an offer is on its way */
        r->last = true;
        space->asking_last++;
        tell_none(space, row);
    }
    return true;
}

static bool take_release(struct tuples *space, uint32_t row, bool accepted) {
    struct tuples_request *r = row_at(space, row);
    bool offered = !r->waits && r->reply == 0;
    bool holds = !r->waits && (r->reply == 0 || r->reply == TUPLES_OFFER);
    if (accepted && !(offered && r->wish == TUPLES_TAKE))
        return false;
    if (r->waits)
        leave(space, row);
    set_free(r);
    if (holds)
        decide(space, row, accepted);
    return true;
}

/* Stores or starts what there is a promise for. */
static void keep_promise(struct tuples *space, uint32_t row,
                         const struct tuples_header *header,
                         const uint8_t *data) {
    struct tuples_request *r = row_at(space, row);
    r->promised = false;
    reply(space, row, TUPLES_STORED);
    if (r->wish == TUPLES_RUN) {
        space->promised_processes--;
        tuples_process_start(space, header->number, data, r->size);
        return;
    }
    space->promised_bytes -= tuples_store_needed(r->size);
    uint32_t at =
        tuples_store_add(&space->store, header->number, data, r->size);
    space->statistics.stored++;
    space->accounts[row / space->each].put++;
    if (space->store.used > space->statistics.store_high_water)
        space->statistics.store_high_water = space->store.used;
    pass(space, at);
}

static bool take_put(struct tuples *space, uint32_t row,
                     const struct tuples_header *header, const uint8_t *data,
                     size_t size) {
    struct tuples_request *r = row_at(space, row);
    uint8_t wish = header->kind == TUPLES_START ? TUPLES_RUN : TUPLES_STORE;
    struct tuple tuple;
    if (size > space->config.tuple_bytes || !tuple_read(&tuple, data, size) ||
        tuple_has_formal(data) ||
        (wish == TUPLES_RUN && header->number >= space->config.function_count))
        return false;
    if (header->flags & TUPLES_PROMISED) {
        if (r->wish != wish || r->serial != header->serial || !r->promised ||
            r->reply != 0 || r->size != size)
            return false;
        keep_promise(space, row, header, data);
        return true;
    }
    if (r->wish != TUPLES_NO_WISH)
        return false;
    r->wish = wish;
    r->serial = header->serial;
    r->size = (uint16_t)size;
    join(space, row);
    tuples_request_promise(space);
    if (r->promised)
        keep_promise(space, row, header, data);
    else
        space->statistics.held_up++;
    return true;
}

bool tuples_request_take(struct tuples *space, uint16_t source,
                         const struct tuples_header *header,
                         const uint8_t *data, size_t size) {
    uint32_t row = source * space->each + header->operation;
    struct tuples_request *r = row_at(space, row);
    if (header->kind == TUPLES_ASK)
        return take_ask(space, row, header, data, size);
    if (header->kind == TUPLES_PUT || header->kind == TUPLES_START)
        return take_put(space, row, header, data, size);
    if (size != 0)
        return false;
    if (!asks(r) || r->serial != header->serial)
        return true; /* it has had its answer, which was on its way */
    if (header->kind == TUPLES_LAST)
        return take_last(space, row);
    return take_release(space, row, header->flags & TUPLES_ACCEPTED);
}

/* --- sending -------------------------------------------------------------- */

/* What follows when a reply has left. */
static void has_sent(struct tuples *space, uint32_t row) {
    struct tuples_request *r = row_at(space, row);
    uint8_t kind = r->reply;
    bool copy = kind == TUPLES_OFFER && r->wish == TUPLES_READ;
    r->reply = 0;
    if (copy || kind == TUPLES_NONE || kind == TUPLES_STORED)
        set_free(r);
    if (copy) {
        space->statistics.read++;
        pass(space, tuples_store_held_by(&space->store, row));
    }
}

static bool send_reply(struct tuples *space, uint32_t row) {
    const struct tuples_request *r = row_at(space, row);
    struct tuples_header header = {.kind = r->reply,
                                   .operation = (uint16_t)(row % space->each),
                                   .serial = r->serial};
    const uint8_t *data = NULL;
    size_t size = 0;
    if (r->reply == TUPLES_OFFER) {
        uint32_t at = tuples_store_held_by(&space->store, row);
        LINK_ASSERT(at != TUPLES_NOWHERE);
        header.number = tuples_store_at(&space->store, at)->age;
        size = tuples_store_at(&space->store, at)->size;
        data = tuples_store_tuple(&space->store, at);
    }
    return tuples_send(space, (uint16_t)(row / space->each), &header, data,
                       size);
}

unsigned tuples_request_send(struct tuples *space, unsigned tries) {
    unsigned sent = 0;
    uint32_t queued = space->reply_count;
    for (uint32_t i = 0; i < queued && i < tries; i++) {
        uint32_t row = space->replies[space->reply_first];
        struct tuples_request *r = row_at(space, row);
        space->reply_first = (space->reply_first + 1) % space->rows;
        space->reply_count--;
        r->queued = false;
        if (r->reply == 0)
            continue;
        if (send_reply(space, row)) {
            has_sent(space, row);
            sent++;
        } else {
            reply(space, row, r->reply);
        }
    }
    return sent;
}
