/* A tuple space (Gelernter, 1985) distributed over numbered places, one in each
 * node: out, in, rd, inp, rdp and eval.  TUPLES.md defines the calls and the
 * messages between places.
 *
 * Nothing here waits.  A call begins an operation, whose number is polled until
 * it is no longer TUPLES_PENDING; messages are written in tuples_step only, and
 * tuples_take always accepts a message.  The space uses no clock and no random
 * numbers.
 *
 * Memory: one arena of tuples_arena_bytes(): `store_bytes` of tuples, a buffer
 * for each operation and process of this place, and a request for each of every
 * place.  Work: a call or message compares each tuple of this place's store
 * with each request that waits here once at most; a step writes
 * TUPLES_STEP_MESSAGES.
 *
 * No deadlock, no loss: each message between two places belongs to one
 * operation, and has a slot at the other end before it is sent.  A request has
 * a row in a table with one row for each operation of each place.  An answer
 * has a slot in the operation that asked, which counts its outstanding answers.
 * So a message is always accepted at once, no link is held back, and an answer
 * that waits for a full link waits in its request's row.  A tuple for which a
 * store has no room stays in the buffer of the operation that writes it.  The
 * store promises room to these operations in the order of their requests,
 * before their tuples come again.  A program must bound what it puts into the
 * space, and give the space a store for that.
 *
 *     int job = tuples_in(space, &pattern);
 *     while (tuples_poll(space, job, &tuple) == TUPLES_PENDING)
 *         tuples_step(space); // and tuples_take what comes */
#ifndef TRANSPORT_TUPLES_TUPLES_H
#define TRANSPORT_TUPLES_TUPLES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Tuples and templates: fields of a type each, with a value (an actual) or, in
 * a template, without one (a formal).  Their form as bytes is that of the store
 * and of messages: number of fields, whether keyed, the types, and the values
 * one behind the other; TUPLES.md has the layout.
 *
 * A template matches a tuple that has as many fields, of the same types one by
 * one, and the values of its actuals.  Values are compared as bytes: a double
 * that is not a number matches itself, and -0 does not match 0.
 *
 *     struct tuple job = {.count = 2, .field = {TUPLE_UINT32(7)}};
 *     job.field[1] = TUPLE_BYTES(faces, 360);
 *     size_t size = tuple_write(&job, bytes, sizeof bytes); // 0: it is unfit
 */

enum { TUPLE_FIELDS_MAX = 8 };

enum tuple_type {
    TUPLE_TYPE_INT32 = 1,
    TUPLE_TYPE_UINT32,
    TUPLE_TYPE_INT64,
    TUPLE_TYPE_DOUBLE,
    TUPLE_TYPE_BYTES, /* any number of them: the length is part of the value */
    TUPLE_TYPE_LAST = TUPLE_TYPE_BYTES
};

struct tuple_field {
    uint8_t type;  /* enum tuple_type */
    bool formal;   /* without a value: in templates alone */
    uint16_t size; /* of bytes */
    union {
        int32_t int32;
        uint32_t uint32;
        int64_t int64;
        double real;
        const void *bytes; /* of any alignment; NULL where size is 0 */
    } as;
};

struct tuple {
    uint8_t count; /* fields, 1 .. TUPLE_FIELDS_MAX */
    bool keyed;    /* of a tuple: the first field's value says too where it
                      lives; of a template it means nothing */
    struct tuple_field field[TUPLE_FIELDS_MAX];
};

/* Fields, as initialisers within braces or behind (struct tuple_field). */
#define TUPLE_FIELD(kind, name, value)                                         \
    (struct tuple_field) {                                                     \
        .type = (kind), .as.name = (value)                                     \
    }
#define TUPLE_INT32(value) TUPLE_FIELD(TUPLE_TYPE_INT32, int32, value)
#define TUPLE_UINT32(value) TUPLE_FIELD(TUPLE_TYPE_UINT32, uint32, value)
#define TUPLE_INT64(value) TUPLE_FIELD(TUPLE_TYPE_INT64, int64, value)
#define TUPLE_DOUBLE(value) TUPLE_FIELD(TUPLE_TYPE_DOUBLE, real, value)
#define TUPLE_BYTES(at, length)                                                \
    (struct tuple_field) {                                                     \
        .type = TUPLE_TYPE_BYTES, .size = (uint16_t)(length), .as.bytes = (at) \
    }
#define TUPLE_FORMAL(kind)                                                     \
    (struct tuple_field) {                                                     \
        .type = (kind), .formal = true                                         \
    }

/* Writes it in at most `room` bytes, and returns how many; 0: it does not fit
 * them, has no field or too many, or one of an unknown type. */
size_t tuple_write(const struct tuple *tuple, uint8_t *bytes, size_t room);

/* Reads what tuple_write wrote; false for anything else.  Fields of type bytes
 * point into `bytes`. */
bool tuple_read(struct tuple *tuple, const uint8_t *bytes, size_t size);

/* Of what tuple_read takes: whether a field is formal, or the first; whether
 * it is keyed. */
bool tuple_has_formal(const uint8_t *bytes);
bool tuple_begins_formal(const uint8_t *bytes);
bool tuple_is_keyed(const uint8_t *bytes);

/* Whether the template matches the tuple, both of what tuple_read takes. */
bool tuple_matches(const uint8_t *pattern, const uint8_t *tuple);

/* Number and types of its fields as a number that is spread evenly; and the
 * first field's value with them, which must be an actual. */
uint32_t tuple_signature(const uint8_t *bytes);
uint32_t tuple_key(const uint8_t *bytes);

enum {
    TUPLES_PLACES_MAX = 1024,
    TUPLES_OPERATIONS_MAX = 32, /* operations and processes of a place */
    TUPLES_HEADER_BYTES = 20,
    TUPLES_TUPLE_MAX = 1580,  /* bytes of a tuple, as tuple_write writes it */
    TUPLES_PATTERN_MAX = 64,  /* and of a template */
    TUPLES_RECORD_BYTES = 12, /* that a tuple takes more in a store, which then
                                 is rounded up to a multiple of 4 */
    TUPLES_STEP_MESSAGES = 32,
    TUPLES_BUSY = -1, /* as many operations are open as there may be */
    TUPLES_UNFIT = -2 /* tuple_write cannot write it in the bytes allowed, a
                         tuple has a formal field, or no such function */
};

enum tuples_status {
    TUPLES_PENDING,
    TUPLES_DONE, /* with the tuple, if one was requested */
    TUPLES_NO,   /* of inp and rdp: there was none */
    TUPLES_ENDED /* its generation has */
};

/* A process that eval began: called once a step, with its tuple, until it
 * returns true; then the tuple, in which it may have changed anything, goes
 * into the space, and must be fit for that.  Its fields of bytes, if it has
 * new ones, need to last until it has returned. */
typedef bool tuples_function(void *context, struct tuple *tuple);

/* There are no defaults.  All places are given the same, but for `self` and
 * what context means. */
struct tuples_config {
    /* This place, and how many there are: 1 .. TUPLES_PLACES_MAX. */
    uint16_t self, places;

    /* That this place may have open at a time, 1 or more, and processes that it
     * may run; TUPLES_OPERATIONS_MAX together. */
    uint8_t operations, processes;

    /* Bytes of a tuple at most: TUPLES_PATTERN_MAX .. TUPLES_TUPLE_MAX. */
    uint16_t tuple_bytes;

    /* Bytes of tuples in this place, 12 a tuple's header included: a multiple
     * of 4, and room for one of tuple_bytes at least.  May differ. */
    uint32_t store_bytes;

    /* What eval starts, by number: functions[0 .. function_count). */
    tuples_function *const *functions;
    uint32_t function_count;

    /* Sends a message to another place: 0, or anything else: not now.  Whole,
     * in order and once, as cube_write does within a generation. */
    int (*write)(void *context, uint16_t place, const void *data, size_t size);

    /* Of `write` and the functions. */
    void *context;
};

struct tuples_statistics {
    uint64_t messages;         /* to other places */
    uint64_t stored;           /* tuples that came to this place */
    uint64_t taken, read;      /* and left it, or were copied */
    uint64_t held_up;          /* tuples and processes that had to wait */
    uint64_t outdated;         /* messages of another generation */
    uint32_t store_high_water; /* bytes */
    uint32_t longest_wait;     /* requests that waited at a time, at most */
};

struct tuples; /* opaque: lives at the start of its arena */

/* 0 (and NULL from tuples_init) if a limit is broken. */
size_t tuples_arena_bytes(const struct tuples_config *config);

/* Begins with an empty space, in an arena aligned to 8 bytes.  All places do so
 * before any operates.  generation: the same everywhere. */
struct tuples *tuples_init(void *arena, size_t bytes,
                           const struct tuples_config *config,
                           uint32_t generation);

/* Another generation: the space is empty again, processes are gone, and
 * operations that were pending end with TUPLES_ENDED; those that are not polled
 * yet keep what they have. */
void tuples_renew(struct tuples *space, uint32_t generation);

/* Each begins an operation and returns its number, 0 or more; or TUPLES_BUSY or
 * TUPLES_UNFIT.  The tuple is copied.  eval's process starts at the place that
 * TUPLES.md names, and is done when it has started. */
int tuples_out(struct tuples *space, const struct tuple *tuple);
int tuples_in(struct tuples *space, const struct tuple *pattern);
int tuples_rd(struct tuples *space, const struct tuple *pattern);
int tuples_inp(struct tuples *space, const struct tuple *pattern);
int tuples_rdp(struct tuples *space, const struct tuple *pattern);
int tuples_eval(struct tuples *space, uint32_t function,
                const struct tuple *tuple);

/* The place that stores a tuple that is fit for `out`. */
unsigned tuples_home(const struct tuples *space, const struct tuple *tuple);

/* Tuples that a place has put into the store of this one, and taken out of it;
 * they count modulo 2^32, and from 0 in each generation. */
struct tuples_account {
    uint32_t put, taken;
};
struct tuples_account tuples_account(const struct tuples *space,
                                     uint16_t place);

/* The number of operations of this place to which `place` owes an answer.  A
 * place that reads its messages answers at its next step, unless it has no
 * room. */
unsigned tuples_due(const struct tuples *space, uint16_t place);

/* Operations that may be begun now. */
unsigned tuples_room(const struct tuples *space);

/* Whether it is open: neither closed nor never begun. */
bool tuples_is_open(const struct tuples *space, int operation);

/* The state of an open operation.  With TUPLES_DONE, what it took or read is in
 * *tuple, whose fields of bytes stay until tuples_close. */
enum tuples_status tuples_poll(const struct tuples *space, int operation,
                               struct tuple *tuple);

/* Closes an operation.  A pending out or eval continues.  Any other pending
 * operation is given up, and takes nothing. */
void tuples_close(struct tuples *space, int operation);

/* Takes a message from another place.  False: it is not a message of the space.
 */
bool tuples_take(struct tuples *space, uint16_t source, const uint8_t *data,
                 size_t size);

/* Runs each process once, and writes outstanding messages.  Returns the number
 * of messages and of processes that have ended. */
unsigned tuples_step(struct tuples *space);

/* Operations that are open or have messages to send, requests, tuples and
 * processes here: 0 if all pools are empty. */
uint32_t tuples_held(const struct tuples *space);

const struct tuples_statistics *tuples_statistics(const struct tuples *space);

#endif
