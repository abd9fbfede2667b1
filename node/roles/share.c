#include "share.h"

#include <string.h>

#include "incode/paper/list.h"
#include "incode/predicates/check.h"
#include "node/common.h"

enum {
    HEAD = 2 + 2 + 4 + 2, /* bytes of a tuple (kind, bytes) beside them */
    WORKERS_EACH = 2      /* small tuples a worker: an end, and its own */
};

static_assert(HEAD + sizeof(struct incode_answers) <= TUPLES_TUPLE_MAX,
              "answers fit a tuple");

/* ---- the places ---- */

static bool is_place(const struct node_setup_message *setup, unsigned node) {
    return node == setup->manager || node_is_builder(setup, node);
}

/* How many there are, and which: where node_of is not NULL. */
static uint16_t find_places(const struct node_setup_message *setup,
                            uint16_t *node_of) {
    uint16_t places = 0;
    for (unsigned i = 0; i < NODE_BUILDERS_MAX + 1; i++) {
        if (is_place(setup, i)) {
            if (node_of != NULL)
                node_of[places] = (uint16_t)i;
            places++;
        }
    }
    return places;
}

/* The place of a node, or `places`. */
static uint16_t place_of(const struct node_share *s, uint16_t node) {
    uint16_t first = 0, last = s->places;
    while (first < last) {
        uint16_t middle = (uint16_t)((first + last) / 2);
        if (s->node_of[middle] < node)
            first = (uint16_t)(middle + 1);
        else
            last = middle;
    }
    return first < s->places && s->node_of[first] == node ? first : s->places;
}

/* ---- the space ---- */

static int write_message(void *context, uint16_t place, const void *data,
                         size_t size) {
    struct node_share *s = context;
    int status = node_counted_write(s->counted, s->node_of[place], NODE_TUPLES,
                                    data, size);
    s->bytes_out += status == 0 ? size : 0;
    return status;
}

static bool run(void *context, struct tuple *tuple) {
    struct node_share *s = context;
    return s->process(s->role, tuple);
}

static tuples_function *const functions[] = {[NODE_SHARE_FUNCTION] = run};

/* Bytes that the largest tuple takes in a store. */
static uint32_t record_bytes(const struct tuples_config *config) {
    return TUPLES_RECORD_BYTES + (config->tuple_bytes + 3u) / 4 * 4;
}

/* All but who it is, and the jobs that may be out; store: the tuples' as well,
 * as the manager has it. */
static struct tuples_config configure(const struct node_setup_message *setup,
                                      uint16_t places, bool store,
                                      uint32_t *jobs) {
    struct tuples_config config;
    memset(&config, 0, sizeof config);
    uint32_t most = setup->faces_per_job < INCODE_LIST_COUNTED
                        ? INCODE_LIST_COUNTED
                        : setup->faces_per_job;
    size_t tuple = HEAD + incode_answers_bytes(most);
    uint32_t workers = places > 1 ? places - 1u : 1;
    config.places = places;
    config.operations = NODE_SHARE_OPERATIONS;
    config.processes = 1;
    config.tuple_bytes = (uint16_t)tuple;
    config.functions = functions;
    config.function_count = sizeof functions / sizeof functions[0];
    config.write = write_message;
    uint32_t record = record_bytes(&config);
    uint32_t wanted = setup->jobs_per_worker * workers;
    *jobs = wanted < NODE_SHARE_STORE_MAX / record
                ? wanted
                : NODE_SHARE_STORE_MAX / record;
    config.store_bytes = record;
    if (store)
        config.store_bytes += *jobs * record + WORKERS_EACH * workers * 32;
    return config;
}

static bool is_sound(const struct node_setup_message *setup) {
    return setup->faces_per_job >= 1 &&
           setup->faces_per_job <= INCODE_LIST_MAX &&
           setup->jobs_per_worker >= 1 && setup->manager <= NODE_BUILDERS_MAX;
}

size_t node_share_bytes(const struct node_setup_message *setup) {
    uint32_t jobs;
    if (!is_sound(setup))
        return 0;
    struct tuples_config config =
        configure(setup, find_places(setup, NULL), true, &jobs);
    return node_aligned(tuples_arena_bytes(&config));
}

/* The first numbers that have their tuples live at that place; one in `places`
 * does. */
static void choose_numbers(struct node_share *s, uint16_t place) {
    uint32_t number = 0;
    for (unsigned k = 0; k < NODE_SHARE_KINDS; k++) {
        struct tuple tuple = {.count = 2, .keyed = true};
        tuple.field[1] =
            k == NODE_SHARE_WORKER ? TUPLE_UINT32(0) : TUPLE_BYTES(NULL, 0);
        do {
            tuple.field[0] = TUPLE_UINT32(++number);
        } while (tuples_home(s->space, &tuple) != place);
        s->number[k] = number;
    }
}

bool node_share_init(struct node_share *share, void *memory,
                     const struct node_setup_message *setup,
                     tuples_function *process, void *role,
                     struct node_counted *counted, struct node_fault *fault) {
    struct node_share *s = share;
    memset(s, 0, sizeof *s);
    s->counted = counted;
    s->fault = fault;
    s->process = process;
    s->role = role;
    for (unsigned i = 0; i < NODE_SHARE_TAKES_MAX; i++)
        s->taking[i] = -1;
    s->places = find_places(setup, s->node_of);
    uint16_t self = place_of(s, counted->self);
    if (!is_sound(setup) || s->node_of[s->places - 1] >= setup->nodes ||
        self == s->places) {
        node_fault_set(fault,
                       "invalid setup: node # of # has a share of no tuple "
                       "space",
                       counted->self, setup->nodes);
        return false;
    }
    struct tuples_config config = configure(
        setup, s->places, counted->self == setup->manager, &s->out_max);
    config.self = self;
    config.context = s;
    s->space = tuples_init(memory, tuples_arena_bytes(&config), &config, 0);
    INCODE_ASSERT(s->space != NULL);
    choose_numbers(s, place_of(s, setup->manager));
    return true;
}

void node_share_take(struct node_share *share,
                     const struct cube_message *message) {
    struct node_share *s = share;
    uint16_t place = place_of(s, message->source);
    s->bytes_in += message->size;
    if (place == s->places ||
        !tuples_take(s->space, place, message->data, message->size)) {
        node_fault_set(s->fault,
                       "message of # bytes from node #, which is none of the "
                       "tuple space",
                       message->size, message->source);
    }
}

/* ---- tuples ---- */

static struct tuple tuple_of(const struct node_share *s,
                             enum node_share_kind kind,
                             struct tuple_field second) {
    struct tuple tuple = {.count = 2, .keyed = true};
    tuple.field[0] = TUPLE_UINT32(s->number[kind]);
    tuple.field[1] = second;
    return tuple;
}

/* Whether one more of what is due once for each other place may begin. */
static bool may_begin(const struct node_share *s, uint32_t count,
                      unsigned kept) {
    return count + 1 < s->places && tuples_room(s->space) > kept;
}

bool node_share_eval_all(struct node_share *share, uint32_t *count,
                         unsigned kept) {
    struct tuple tuple = tuple_of(share, NODE_SHARE_WORKER, TUPLE_UINT32(0));
    bool moved = false;
    for (; may_begin(share, *count, kept); ++*count) {
        tuples_close(share->space,
                     tuples_eval(share->space, NODE_SHARE_FUNCTION, &tuple));
        moved = true;
    }
    return moved;
}

bool node_share_end_all(struct node_share *share, uint32_t *count,
                        unsigned kept) {
    bool moved = false;
    while (may_begin(share, *count, kept)) {
        moved = node_share_out_bytes(share, NODE_SHARE_JOB, NULL, 0);
        ++*count;
    }
    return moved;
}

/* Whether the tuple has come that is asked for, or is from now on. */
static bool has_come(struct node_share *s, int *operation,
                     const struct tuple *pattern, struct tuple *tuple) {
    if (*operation < 0)
        *operation = tuples_in(s->space, pattern);
    return *operation >= 0 &&
           tuples_poll(s->space, *operation, tuple) == TUPLES_DONE;
}

static void close(struct node_share *s, int *operation) {
    tuples_close(s->space, *operation);
    *operation = -1;
}

bool node_share_in_worker(struct node_share *share, int *operation) {
    struct tuple tuple, pattern = tuple_of(share, NODE_SHARE_WORKER,
                                           TUPLE_FORMAL(TUPLE_TYPE_UINT32));
    bool came = has_come(share, operation, &pattern, &tuple);
    if (came)
        close(share, operation);
    return came;
}

bool node_share_in_bytes(struct node_share *share, enum node_share_kind kind,
                         int *operation, void *into, size_t size) {
    struct tuple tuple,
        pattern = tuple_of(share, kind, TUPLE_FORMAL(TUPLE_TYPE_BYTES));
    if (!has_come(share, operation, &pattern, &tuple))
        return false;
    bool whole = tuple.field[1].size == size;
    if (whole) {
        memcpy(into, tuple.field[1].as.bytes, size);
    } else {
        node_fault_set(share->fault, "a tuple of # bytes, expected #",
                       tuple.field[1].size, (uint32_t)size);
    }
    close(share, operation);
    return whole;
}

bool node_share_out_bytes(struct node_share *share, enum node_share_kind kind,
                          const void *data, size_t size) {
    struct tuple tuple = tuple_of(share, kind, TUPLE_BYTES(data, size));
    int put = tuples_out(share->space, &tuple);
    if (put >= 0)
        tuples_close(share->space, put);
    return put >= 0;
}

/* Whoever has a share answers at once, where its own program goes on; one who
 * has taken a list may wait for that other, or for pages. */
uint16_t node_share_owing(const struct node_share *share) {
    uint16_t owing = CUBE_HOST;
    for (uint16_t i = 0; i < share->places; i++) {
        struct tuples_account account = tuples_account(share->space, i);
        if (share->node_of[i] == share->counted->self)
            continue;
        if (tuples_due(share->space, i) > 0)
            return share->node_of[i];
        if (owing == CUBE_HOST && account.taken != account.put)
            owing = share->node_of[i];
    }
    return owing;
}

/* ---- the carrier ---- */

/* Operations are kept for what it takes. */
static bool has_room(void *context) {
    const struct node_share *s = context;
    return tuples_room(s->space) > s->takes_max &&
           (s->puts != NODE_SHARE_JOB || s->out < s->out_max);
}

/* There is room in the space: nobody needs to wait for it. */
static void send(void *context, const void *data, size_t size) {
    struct node_share *s = context;
    bool put = node_share_out_bytes(s, s->puts, data, size);
    INCODE_ASSERT(put);
    s->out += s->puts == NODE_SHARE_JOB;
}

/* Of what has come, the tuple of taking[next] is that which is looked at. */
static void drop(void *context) {
    struct node_share *s = context;
    tuples_close(s->space, s->taking[s->next]);
    s->taking[s->next] = -1;
    s->next = (s->next + 1) % s->takes_max;
    s->taken++;
    s->out -= s->puts == NODE_SHARE_JOB;
}

static void ask(struct node_share *s) {
    struct tuple pattern =
        tuple_of(s, s->takes, TUPLE_FORMAL(TUPLE_TYPE_BYTES));
    for (uint32_t i = 0; i < s->takes_max; i++)
        if (s->taking[i] < 0)
            s->taking[i] = tuples_in(s->space, &pattern);
}

static const void *first(void *context, size_t *size) {
    struct node_share *s = context;
    struct tuple tuple;
    uint32_t looked = 0;
    if (s->ended)
        return NULL;
    ask(s);
    while (s->taking[s->next] < 0 ||
           tuples_poll(s->space, s->taking[s->next], &tuple) != TUPLES_DONE) {
        s->next = (s->next + 1) % s->takes_max;
        if (++looked == s->takes_max)
            return NULL;
    }
    *size = tuple.field[1].size;
    if (*size == 0 && s->takes == NODE_SHARE_JOB) { /* EndMessage */
        node_share_stop(s);
        s->ended = true;
        return NULL;
    }
    return tuple.field[1].as.bytes;
}

void node_share_stop(struct node_share *share) {
    for (uint32_t i = 0; i < share->takes_max; i++) {
        if (share->taking[i] >= 0) {
            tuples_close(share->space, share->taking[i]);
            share->taking[i] = -1;
        }
    }
}

struct node_carrier node_share_carrier(struct node_share *share,
                                       enum node_share_kind puts,
                                       enum node_share_kind takes,
                                       uint32_t takes_max) {
    INCODE_ASSERT(takes_max >= 1 && takes_max <= NODE_SHARE_TAKES_MAX);
    share->puts = puts;
    share->takes = takes;
    share->takes_max = takes_max;
    return (struct node_carrier){share, has_room, send, first, drop};
}
