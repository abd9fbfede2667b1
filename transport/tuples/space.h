/* A place's tuples: records one after the other in the order of their arrival.
 * So a search finds the oldest first, and free memory is in one piece.  A
 * record may be held for a request, and no other request gets it until that one
 * is decided.
 *
 * Memory: the caller's bytes; a record is named by its offset, until one before
 * it is dropped. */
#ifndef TRANSPORT_TUPLES_SPACE_H
#define TRANSPORT_TUPLES_SPACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tuples.h"

#define TUPLES_NOWHERE UINT32_MAX
#define TUPLES_UNHELD UINT32_MAX

struct tuples_record {
    uint32_t age;
    uint32_t holder; /* a request, or TUPLES_UNHELD */
    uint32_t size;   /* of the bytes that follow, and are filled up to 4 */
};

struct tuples_store {
    uint8_t *bytes; /* aligned to 4 */
    uint32_t room, used, count;
};

/* Bytes of a store that such a tuple takes. */
uint32_t tuples_store_needed(size_t size);

/* Adds one for which there is room; its offset. */
uint32_t tuples_store_add(struct tuples_store *store, uint32_t age,
                          const uint8_t *tuple, size_t size);

struct tuples_record *tuples_store_at(const struct tuples_store *store,
                                      uint32_t at);
const uint8_t *tuples_store_tuple(const struct tuples_store *store,
                                  uint32_t at);

/* The first matching record that is not held. */
uint32_t tuples_store_find(const struct tuples_store *store,
                           const uint8_t *pattern);

/* Whether a matching record is held. */
bool tuples_store_is_held(const struct tuples_store *store,
                          const uint8_t *pattern);

/* The record that a request holds. */
uint32_t tuples_store_held_by(const struct tuples_store *store, uint32_t row);

void tuples_store_drop(struct tuples_store *store, uint32_t at);

/* What the files of the tuple space share: a message's header, an operation
 * of this place (operation.c), a request of any (request.c), and the store. */

/* TUPLES.md defines these. */
enum tuples_kind {
    /* Of an operation, to a place. */
    TUPLES_ASK = 1,
    TUPLES_LAST,
    TUPLES_RELEASE,
    TUPLES_PUT,
    TUPLES_START,
    /* Of a place, to the operation. */
    TUPLES_OFFER,
    TUPLES_NONE_YET,
    TUPLES_NONE,
    TUPLES_ROOM,
    TUPLES_STORED,
    TUPLES_KIND_LAST = TUPLES_STORED
};

enum tuples_flags {
    TUPLES_TAKES = 1,    /* ASK: in or inp, not rd or rdp */
    TUPLES_AT_ONCE = 2,  /* ASK: and LAST in one */
    TUPLES_ACCEPTED = 4, /* RELEASE: what was offered is taken */
    TUPLES_PROMISED = 8  /* PUT, START: there is room, by a ROOM */
};

struct tuples_header {
    uint8_t kind, flags;
    uint16_t operation;
    uint32_t serial; /* of the operation, at its place */
    uint32_t generation;
    uint32_t clock;  /* Lamport's, of the sender */
    uint32_t number; /* PUT, OFFER: the tuple's age; START: the function */
};

enum tuples_verb {
    TUPLES_VERB_OUT,
    TUPLES_VERB_EVAL,
    TUPLES_VERB_IN,
    TUPLES_VERB_RD,
    TUPLES_VERB_INP,
    TUPLES_VERB_RDP
};

/* What an operation has with a place. */
enum tuples_tie {
    TUPLES_UNTIED,
    TUPLES_ASKED, /* its first answer is due */
    TUPLES_WAITS, /* it had nothing yet */
    TUPLES_HOLDS, /* its tuple is the best so far */
    TUPLES_ASKED_LAST,
    TUPLES_PUT_SENT,
    TUPLES_OWES, /* and from here on: a message is owed */
    TUPLES_OWES_ASK = TUPLES_OWES,
    TUPLES_OWES_LAST,
    TUPLES_OWES_TAKEN,
    TUPLES_OWES_RELEASE,
    TUPLES_OWES_PUT,
    TUPLES_OWES_PROMISED
};

enum tuples_phase {
    TUPLES_FREE,
    TUPLES_FIRST,   /* first answers are due */
    TUPLES_WAITING, /* in and rd: until something comes */
    TUPLES_FINAL,   /* inp and rdp: last answers are due */
    TUPLES_PUTTING, /* out and eval */
    TUPLES_OVER     /* but it may owe a word to some */
};

struct tuples_operation {
    uint8_t verb, phase, status;
    bool closed; /* by its caller */
    bool alone;  /* inp or rdp of one place: it answers at once */
    bool has_tuple;
    uint16_t due;    /* answers */
    uint16_t owed;   /* messages */
    uint16_t cursor; /* where the search for the next one begins */
    uint16_t best;   /* the place whose tuple it holds */
    uint16_t size, pattern_size;
    uint32_t serial;
    uint32_t number; /* the tuple's age, or the function */
    uint8_t *ties;   /* enum tuples_tie, one a place */
    uint8_t *tuple;  /* tuple_bytes: what is put, or was got */
    uint8_t pattern[TUPLES_PATTERN_MAX];
};

enum tuples_wish {
    TUPLES_NO_WISH, /* the row is free */
    TUPLES_TAKE,
    TUPLES_READ,
    TUPLES_STORE,
    TUPLES_RUN
};

/* A row of the table: operation `row % each` of place `row / each`. */
struct tuples_request {
    uint8_t wish;
    uint8_t reply; /* the kind that is owed, or 0 */
    bool queued;   /* among the replies */
    bool waits;    /* in the line */
    bool last;     /* wants to hear if there is none */
    bool promised; /* room */
    uint16_t size; /* of the tuple that wants room */
    uint32_t serial;
    uint32_t next, previous; /* in the line */
    uint8_t pattern[TUPLES_PATTERN_MAX];
};

enum tuples_state { TUPLES_IDLE, TUPLES_RUNNING, TUPLES_LEAVING };

struct tuples_process {
    uint8_t state; /* enum tuples_state */
    uint16_t size;
    uint32_t function;
    uint8_t *bytes; /* its tuple, tuple_bytes */
    struct tuple tuple;
};

#define TUPLES_NOBODY UINT32_MAX

struct tuples {
    struct tuples_config config;
    uint32_t generation, clock, serial, evals;
    uint32_t each, rows; /* operations a place; of all */
    struct tuples_store store;
    struct tuples_operation *operations; /* [each]: then those of processes */
    struct tuples_process *processes;
    struct tuples_request *requests; /* [rows] */
    struct tuples_account *accounts; /* [places] */
    uint32_t first, last, waiting;   /* the line of those that wait */
    uint32_t *replies;               /* [rows]: a ring of rows */
    uint32_t reply_first, reply_count;
    uint32_t asking_last; /* requests with `last` in the line */
    uint32_t promised_bytes, promised_processes;
    uint32_t cursor; /* of operations, in a step */
    struct tuples_statistics statistics;
    uint8_t message[TUPLES_HEADER_BYTES + TUPLES_TUPLE_MAX];
};

/* --- space.c: writes or delivers; false: not now -------------------------- */

bool tuples_send(struct tuples *space, uint16_t place,
                 const struct tuples_header *header, const uint8_t *data,
                 size_t size);

/* --- operation.c ---------------------------------------------------------- */

/* The process's own out. */
bool tuples_operation_take(struct tuples *space, uint16_t source,
                           const struct tuples_header *header,
                           const uint8_t *data, size_t size);

/* Writes what an operation owes, with so many tries for all; the number of
 * messages. */
unsigned tuples_operation_send(struct tuples *space,
                               struct tuples_operation *op, unsigned *tries);
void tuples_operations_end(struct tuples *space);

/* --- request.c ------------------------------------------------------------ */

bool tuples_request_take(struct tuples *space, uint16_t source,
                         const struct tuples_header *header,
                         const uint8_t *data, size_t size);
unsigned tuples_request_send(struct tuples *space, unsigned tries);

/* A process has ended: another may start. */
void tuples_request_promise(struct tuples *space);

/* --- process.c ------------------------------------------------------------ */

unsigned tuples_processes_free(const struct tuples *space);
void tuples_process_start(struct tuples *space, uint32_t function,
                          const uint8_t *data, size_t size);
unsigned tuples_processes_run(struct tuples *space);

#endif
