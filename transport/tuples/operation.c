/* The caller's side: what an operation has with each place that it asked. */
#include <string.h>

#include "space.h"
#include "transport/check.h"

static bool takes(const struct tuples_operation *op) {
    return op->verb == TUPLES_VERB_IN || op->verb == TUPLES_VERB_INP;
}

static bool waits(const struct tuples_operation *op) {
    return op->verb == TUPLES_VERB_IN || op->verb == TUPLES_VERB_RD;
}

static bool puts_one(const struct tuples_operation *op) {
    return op->verb == TUPLES_VERB_OUT || op->verb == TUPLES_VERB_EVAL;
}

static void tie(struct tuples_operation *op, unsigned place,
                enum tuples_tie tied) {
    op->owed = (uint16_t)(op->owed + (tied >= TUPLES_OWES) -
                          (op->ties[place] >= TUPLES_OWES));
    op->ties[place] = (uint8_t)tied;
}

/* Ready for another, where nobody looks at it and it owes nothing. */
static void free_if_over(struct tuples_operation *op) {
    if (op->phase == TUPLES_OVER && op->closed && op->owed == 0)
        op->phase = TUPLES_FREE;
}

/* --- the calls ------------------------------------------------------------ */

static void begin(struct tuples *space, struct tuples_operation *op,
                  enum tuples_verb verb) {
    LINK_ASSERT(op->phase == TUPLES_FREE && op->owed == 0);
    op->verb = (uint8_t)verb;
    op->phase = puts_one(op) ? TUPLES_PUTTING : TUPLES_FIRST;
    op->status = TUPLES_PENDING;
    op->closed = op->has_tuple = false;
    op->due = op->cursor = 0;
    op->serial = ++space->serial;
}

static int find_free(const struct tuples *space) {
    for (unsigned i = 0; i < space->config.operations; i++)
        if (space->operations[i].phase == TUPLES_FREE)
            return (int)i;
    return TUPLES_BUSY;
}

unsigned tuples_room(const struct tuples *space) {
    unsigned room = 0;
    for (unsigned i = 0; i < space->config.operations; i++)
        room += space->operations[i].phase == TUPLES_FREE;
    return room;
}

static unsigned home_of(const struct tuples *space, const uint8_t *tuple) {
    uint32_t hash =
        tuple_is_keyed(tuple) ? tuple_key(tuple) : tuple_signature(tuple);
    return hash % space->config.places;
}

unsigned tuples_home(const struct tuples *space, const struct tuple *tuple) {
    uint8_t bytes[TUPLES_TUPLE_MAX];
    LINK_ASSERT(tuple_write(tuple, bytes, space->config.tuple_bytes) > 0 &&
                !tuple_has_formal(bytes));
    return home_of(space, bytes);
}

/* The places after this one in turn, as long as there are others. */
static unsigned place_of_eval(struct tuples *space) {
    unsigned others = space->config.places - 1u;
    unsigned step = others == 0 ? 0 : 1 + space->evals++ % others;
    return (space->config.self + step) % space->config.places;
}

static bool write_tuple(const struct tuples *space, struct tuples_operation *op,
                        const struct tuple *tuple) {
    size_t size = tuple_write(tuple, op->tuple, space->config.tuple_bytes);
    op->size = (uint16_t)size;
    return size > 0 && !tuple_has_formal(op->tuple);
}

static bool tuples_operation_put(struct tuples *space, unsigned number,
                                 const struct tuple *tuple) {
    struct tuples_operation *op = &space->operations[number];
    if (!write_tuple(space, op, tuple))
        return false;
    begin(space, op, TUPLES_VERB_OUT);
    op->number = ++space->clock;
    tie(op, home_of(space, op->tuple), TUPLES_OWES_PUT);
    return true;
}

int tuples_out(struct tuples *space, const struct tuple *tuple) {
    int number = find_free(space);
    if (number < 0)
        return number;
    return tuples_operation_put(space, (unsigned)number, tuple) ? number
                                                                : TUPLES_UNFIT;
}

int tuples_eval(struct tuples *space, uint32_t function,
                const struct tuple *tuple) {
    int number = find_free(space);
    if (number < 0)
        return number;
    struct tuples_operation *op = &space->operations[number];
    if (function >= space->config.function_count ||
        space->config.processes == 0 || !write_tuple(space, op, tuple))
        return TUPLES_UNFIT;
    begin(space, op, TUPLES_VERB_EVAL);
    op->number = function;
    tie(op, place_of_eval(space), TUPLES_OWES_PUT);
    return number;
}

/* The places where such a tuple may be. */
static void ask_all(const struct tuples *space, struct tuples_operation *op) {
    unsigned places = space->config.places;
    if (tuple_begins_formal(op->pattern)) {
        for (unsigned p = 0; p < places; p++)
            tie(op, p, TUPLES_OWES_ASK);
    } else {
        tie(op, tuple_signature(op->pattern) % places, TUPLES_OWES_ASK);
        tie(op, tuple_key(op->pattern) % places, TUPLES_OWES_ASK);
    }
    op->due = op->owed;
    op->alone = op->due == 1 && !waits(op);
}

static int ask(struct tuples *space, enum tuples_verb verb,
               const struct tuple *pattern) {
    int number = find_free(space);
    if (number < 0)
        return number;
    struct tuples_operation *op = &space->operations[number];
    op->pattern_size =
        (uint16_t)tuple_write(pattern, op->pattern, sizeof op->pattern);
    if (op->pattern_size == 0)
        return TUPLES_UNFIT;
    begin(space, op, verb);
    ask_all(space, op);
    return number;
}

int tuples_in(struct tuples *space, const struct tuple *pattern) {
    return ask(space, TUPLES_VERB_IN, pattern);
}

int tuples_rd(struct tuples *space, const struct tuple *pattern) {
    return ask(space, TUPLES_VERB_RD, pattern);
}

int tuples_inp(struct tuples *space, const struct tuple *pattern) {
    return ask(space, TUPLES_VERB_INP, pattern);
}

int tuples_rdp(struct tuples *space, const struct tuple *pattern) {
    return ask(space, TUPLES_VERB_RDP, pattern);
}

unsigned tuples_due(const struct tuples *space, uint16_t place) {
    unsigned due = 0;
    LINK_ASSERT(place < space->config.places);
    for (unsigned i = 0; i < space->each; i++) {
        uint8_t tied = space->operations[i].ties[place];
        due += tied == TUPLES_ASKED || tied == TUPLES_ASKED_LAST ||
               tied == TUPLES_PUT_SENT;
    }
    return due;
}

bool tuples_is_open(const struct tuples *space, int operation) {
    LINK_ASSERT(operation >= 0 && operation < space->config.operations);
    const struct tuples_operation *op = &space->operations[operation];
    return op->phase != TUPLES_FREE && !op->closed;
}

static struct tuples_operation *open_operation(const struct tuples *space,
                                               int number) {
    LINK_ASSERT(tuples_is_open(space, number));
    return &space->operations[number];
}

enum tuples_status tuples_poll(const struct tuples *space, int operation,
                               struct tuple *tuple) {
    const struct tuples_operation *op = open_operation(space, operation);
    if (op->status == TUPLES_DONE && op->has_tuple)
        LINK_ASSERT(tuple_read(tuple, op->tuple, op->size));
    return (enum tuples_status)op->status;
}

/* --- its end -------------------------------------------------------------- */

/* All places but that whose tuple is taken are told that nothing is wanted of
 * them any more. */
static void finish(struct tuples *space, struct tuples_operation *op,
                   enum tuples_status status) {
    for (unsigned p = 0; p < space->config.places; p++) {
        uint8_t tied = op->ties[p];
        if (tied == TUPLES_OWES_ASK)
            tie(op, p, TUPLES_UNTIED);
        else if (tied == TUPLES_HOLDS && status == TUPLES_DONE)
            tie(op, p, TUPLES_OWES_TAKEN);
        else if (tied != TUPLES_UNTIED)
            tie(op, p, TUPLES_OWES_RELEASE);
    }
    op->phase = TUPLES_OVER;
    op->status = (uint8_t)status;
    free_if_over(op);
}

void tuples_close(struct tuples *space, int operation) {
    struct tuples_operation *op = open_operation(space, operation);
    op->closed = true;
    if (op->status == TUPLES_PENDING && !puts_one(op))
        finish(space, op, TUPLES_NO);
    else
        free_if_over(op);
}

void tuples_operations_end(struct tuples *space) {
    for (unsigned i = 0; i < space->each; i++) {
        struct tuples_operation *op = &space->operations[i];
        memset(op->ties, TUPLES_UNTIED, space->config.places);
        op->owed = 0;
        op->closed = op->closed || i >= space->config.operations;
        if (op->phase != TUPLES_FREE && op->phase != TUPLES_OVER) {
            op->phase = TUPLES_OVER;
            op->status = TUPLES_ENDED;
        }
        free_if_over(op);
    }
}

/* --- answers -------------------------------------------------------------- */

/* The oldest by their makers' clocks, then the lowest place's. */
static bool is_better(const struct tuples_operation *op, uint32_t age,
                      uint16_t place) {
    return !op->has_tuple || age < op->number ||
           (age == op->number && place < op->best);
}

/* What is not needed goes back; a copy has no home. */
static void give_back(struct tuples_operation *op, uint16_t place) {
    tie(op, place, takes(op) ? TUPLES_OWES_RELEASE : TUPLES_UNTIED);
}

static bool take_offer(const struct tuples *space, struct tuples_operation *op,
                       uint16_t source, const struct tuples_header *header,
                       const uint8_t *data, size_t size) {
    struct tuple tuple;
    uint8_t tied = op->ties[source];
    if ((tied != TUPLES_ASKED && tied != TUPLES_WAITS &&
         tied != TUPLES_ASKED_LAST && tied != TUPLES_OWES_LAST) ||
        size > space->config.tuple_bytes || !tuple_read(&tuple, data, size) ||
        tuple_has_formal(data) || !tuple_matches(op->pattern, data))
        return false;
    op->due = (uint16_t)(op->due - (tied != TUPLES_WAITS));
    if (!is_better(op, header->number, source)) {
        give_back(op, source);
        return true;
    }
    if (op->has_tuple)
        give_back(op, op->best);
    tie(op, source, takes(op) ? TUPLES_HOLDS : TUPLES_UNTIED);
    op->has_tuple = true;
    op->best = source;
    op->number = header->number;
    op->size = (uint16_t)size;
    memcpy(op->tuple, data, size);
    return true;
}

/* A place has had nothing, so far or for good. */
static bool take_none(struct tuples_operation *op, uint16_t source,
                      enum tuples_kind kind) {
    uint8_t tied = op->ties[source];
    if (tied == TUPLES_ASKED && (kind == TUPLES_NONE) == op->alone)
        tie(op, source, kind == TUPLES_NONE ? TUPLES_UNTIED : TUPLES_WAITS);
    else if (tied == TUPLES_ASKED_LAST && kind == TUPLES_NONE)
        tie(op, source, TUPLES_UNTIED);
    else
        return false;
    op->due--;
    return true;
}

static void ask_last(const struct tuples *space, struct tuples_operation *op) {
    op->phase = TUPLES_FINAL;
    for (unsigned p = 0; p < space->config.places; p++) {
        if (op->ties[p] == TUPLES_WAITS) {
            tie(op, p, TUPLES_OWES_LAST);
            op->due++;
        }
    }
}

/* Where the answers so far lead. */
static void go_on(struct tuples *space, struct tuples_operation *op) {
    if (op->phase == TUPLES_FIRST && op->due > 0)
        return;
    if (op->has_tuple)
        finish(space, op, TUPLES_DONE);
    else if (op->phase == TUPLES_FIRST && waits(op))
        op->phase = TUPLES_WAITING;
    else if (op->phase == TUPLES_FIRST)
        ask_last(space, op);
    if (op->phase == TUPLES_FINAL && op->due == 0)
        finish(space, op, TUPLES_NO);
}

static bool take_put_answer(struct tuples *space, struct tuples_operation *op,
                            uint16_t source, enum tuples_kind kind) {
    if (op->ties[source] != TUPLES_PUT_SENT)
        return false;
    if (kind == TUPLES_ROOM) {
        tie(op, source, TUPLES_OWES_PROMISED);
    } else {
        tie(op, source, TUPLES_UNTIED);
        finish(space, op, TUPLES_DONE);
    }
    return true;
}

bool tuples_operation_take(struct tuples *space, uint16_t source,
                           const struct tuples_header *header,
                           const uint8_t *data, size_t size) {
    struct tuples_operation *op = &space->operations[header->operation];
    enum tuples_kind kind = (enum tuples_kind)header->kind;
    if (op->serial != header->serial || op->phase == TUPLES_FREE ||
        op->phase == TUPLES_OVER)
        return true; /* to an operation that is over, and has said so */
    if (puts_one(op) != (kind == TUPLES_ROOM || kind == TUPLES_STORED) ||
        (kind != TUPLES_OFFER && size != 0))
        return false;
    if (puts_one(op))
        return take_put_answer(space, op, source, kind);
    bool sound = kind == TUPLES_OFFER
                     ? take_offer(space, op, source, header, data, size)
                     : take_none(op, source, kind);
    if (sound)
        go_on(space, op);
    return sound;
}

/* --- sending -------------------------------------------------------------- */

static bool send_owed(struct tuples *space, struct tuples_operation *op,
                      uint16_t place) {
    struct tuples_header header = {.operation =
                                       (uint16_t)(op - space->operations),
                                   .serial = op->serial,
                                   .number = op->number};
    bool starts = op->verb == TUPLES_VERB_EVAL;
    enum tuples_tie next = TUPLES_UNTIED;
    const uint8_t *data = NULL;
    size_t size = 0;
    switch (op->ties[place]) {
    case TUPLES_OWES_ASK:
        header.kind = TUPLES_ASK;
        header.flags = (uint8_t)((takes(op) ? TUPLES_TAKES : 0) |
                                 (op->alone ? TUPLES_AT_ONCE : 0));
        data = op->pattern;
        size = op->pattern_size;
        next = TUPLES_ASKED;
        break;
    case TUPLES_OWES_LAST:
        header.kind = TUPLES_LAST;
        next = TUPLES_ASKED_LAST;
        break;
    case TUPLES_OWES_TAKEN:
    case TUPLES_OWES_RELEASE:
        header.kind = TUPLES_RELEASE;
        header.flags =
            op->ties[place] == TUPLES_OWES_TAKEN ? TUPLES_ACCEPTED : 0;
        break;
    default:
        header.kind = starts ? TUPLES_START : TUPLES_PUT;
        header.flags =
            op->ties[place] == TUPLES_OWES_PROMISED ? TUPLES_PROMISED : 0;
        data = op->tuple;
        size = op->size;
        next = TUPLES_PUT_SENT;
    }
    if (!tuples_send(space, place, &header, data, size))
        return false;
    tie(op, place, next);
    return true;
}

/* Whether an operation that began before owes the place a word, which must come
 * first: what it gives back, the next may ask for. */
static bool is_preceded(const struct tuples *space,
                        const struct tuples_operation *op, unsigned place) {
    for (unsigned i = 0; i < space->each; i++) {
        const struct tuples_operation *other = &space->operations[i];
        if (other->owed > 0 && other->ties[place] >= TUPLES_OWES &&
            (int32_t)(other->serial - op->serial) < 0)
            return true;
    }
    return false;
}

unsigned tuples_operation_send(struct tuples *space,
                               struct tuples_operation *op, unsigned *tries) {
    unsigned places = space->config.places, sent = 0;
    for (unsigned i = 0; i < places && op->owed > 0 && *tries > 0; i++) {
        uint16_t place = op->cursor;
        op->cursor = (uint16_t)((place + 1) % places);
        if (op->ties[place] >= TUPLES_OWES && !is_preceded(space, op, place)) {
            sent += send_owed(space, op, place);
            --*tries;
        }
    }
    free_if_over(op);
    return sent;
}

/* What eval has started here. */

unsigned tuples_processes_free(const struct tuples *space) {
    unsigned count = 0;
    for (unsigned i = 0; i < space->config.processes; i++)
        count += space->processes[i].state == TUPLES_IDLE;
    return count;
}

void tuples_process_start(struct tuples *space, uint32_t function,
                          const uint8_t *data, size_t size) {
    unsigned i = 0;
    while (space->processes[i].state != TUPLES_IDLE) {
        i++;
        LINK_ASSERT(i < space->config.processes);
    }
    struct tuples_process *process = &space->processes[i];
    memcpy(process->bytes, data, size);
    LINK_ASSERT(tuple_read(&process->tuple, process->bytes, size));
    process->state = TUPLES_RUNNING;
    process->function = function;
}

unsigned tuples_processes_run(struct tuples *space) {
    const struct tuples_config *config = &space->config;
    unsigned moved = 0;
    for (unsigned i = 0; i < config->processes; i++) {
        struct tuples_process *process = &space->processes[i];
        unsigned out = config->operations + i;
        if (process->state == TUPLES_RUNNING) {
            if (config->functions[process->function](config->context,
                                                     &process->tuple)) {
                LINK_ASSERT(tuples_operation_put(space, out, &process->tuple));
                space->operations[out].closed = true;
                process->state = TUPLES_LEAVING;
                moved++;
            }
        } else if (process->state == TUPLES_LEAVING &&
                   space->operations[out].phase == TUPLES_FREE) {
            process->state = TUPLES_IDLE;
            tuples_request_promise(space);
            moved++;
        }
    }
    return moved;
}
