#include "lending.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/common.h"

/* ---- sets of nodes ---- */

static size_t words_of(uint32_t nodes) {
    return ((size_t)nodes + 63) / 64;
}

static bool has(const uint64_t *set, uint32_t node) {
    return (set[node / 64] >> node % 64 & 1) != 0;
}

static void add(uint64_t *set, uint32_t *count, uint32_t node) {
    *count += !has(set, node);
    set[node / 64] |= UINT64_C(1) << node % 64;
}

static void drop(uint64_t *set, uint32_t *count, uint32_t node) {
    *count -= has(set, node);
    set[node / 64] &= ~(UINT64_C(1) << node % 64);
}

/* The nearest node that is in the set, or is not: neighbours first, then others
 * by their number beside this one's, so that no two nodes have the same order.
 * There must be one. */
static uint16_t nearest(const struct node_loans *l, const uint64_t *set,
                        bool in) {
    uint32_t self = l->counted->self;
    for (uint32_t k = 1; k < l->nodes; k *= 2)
        if (has(set, self ^ k) == in)
            return (uint16_t)(self ^ k);
    uint32_t k = 1;
    while (has(set, self ^ k) != in) {
        k++;
        INCODE_ASSERT(k < l->nodes);
    }
    return (uint16_t)(self ^ k);
}

/* ---- memory ---- */

size_t node_loans_bytes(uint32_t nodes) {
    return node_aligned(3 * words_of(nodes) * sizeof(uint64_t));
}

void node_loans_init(struct node_loans *loans, void *memory,
                     const struct node_setup_message *setup,
                     struct node_counted *counted, struct node_fault *fault) {
    size_t words = words_of(setup->nodes);
    memset(loans, 0, sizeof *loans);
    memset(memory, 0, node_loans_bytes(setup->nodes));
    loans->counted = counted;
    loans->fault = fault;
    loans->nodes = setup->nodes;
    loans->bricks = setup->setup.bricks;
    loans->askers = memory;
    loans->asked = loans->askers + words;
    loans->back = loans->asked + words;
}

/* ---- places ---- */

static struct node_loan_out *out_in(struct node_loans *l,
                                    enum node_loan_state state) {
    for (unsigned i = 0; i < NODE_LOANS_OUT; i++)
        if (l->out[i].state == state)
            return &l->out[i];
    return NULL;
}

static struct node_loan_in *free_place(struct node_loans *l) {
    for (unsigned i = 0; i < NODE_LOANS_IN; i++)
        if (!l->in[i].open)
            return &l->in[i];
    return NULL;
}

static struct node_loan_in *oldest(struct node_loans *l) {
    struct node_loan_in *oldest = NULL;
    for (unsigned i = 0; i < NODE_LOANS_IN; i++) {
        struct node_loan_in *in = &l->in[i];
        if (in->open && (oldest == NULL || in->born < oldest->born))
            oldest = in;
    }
    return oldest;
}

/* Whether it should ask: it has nothing to do, and nothing comes back. */
static bool may_ask(struct node_loans *l, const struct incode_triangulator *t) {
    return incode_triangulator_may_borrow(t) &&
           out_in(l, NODE_LOAN_IS_MADE) == NULL &&
           out_in(l, NODE_LOAN_IS_OUT) == NULL &&
           out_in(l, NODE_LOAN_IS_BACK) == NULL;
}

uint16_t node_loans_owing(const struct node_loans *loans) {
    for (unsigned i = 0; i < NODE_LOANS_OUT; i++)
        if (loans->out[i].state == NODE_LOAN_IS_OUT)
            return loans->out[i].to;
    return CUBE_HOST;
}

/* ---- messages ---- */

static bool read_loan(const struct node_loans *l,
                      const struct cube_message *message,
                      struct incode_loan *loan) {
    size_t head = offsetof(struct incode_loan, v);
    loan->count = 0;
    if (message->size >= head && message->size <= sizeof *loan)
        memcpy(loan, message->data, message->size);
    return loan->count <= INCODE_LOAN_FACES &&
           message->size == incode_loan_bytes(loan) &&
           incode_loan_is_sound(loan, l->bricks);
}

static bool has_loan_of(const struct node_loans *l, uint16_t from) {
    bool open = has(l->back, from);
    for (unsigned i = 0; i < NODE_LOANS_IN; i++)
        open = open || (l->in[i].open && l->in[i].from == from);
    return open;
}

/* A loan comes after an ask, once. */
static bool take_loan(struct node_loans *l,
                      const struct cube_message *message) {
    struct incode_loan loan;
    struct node_loan_in *in = free_place(l);
    if (!has(l->asked, message->source) || has_loan_of(l, message->source) ||
        !read_loan(l, message, &loan))
        return false;
    if (in == NULL) {
        add(l->back, &l->back_count, message->source);
        return true;
    }
    in->open = true;
    in->from = message->source;
    in->born = ++l->clock;
    memcpy(&in->loan, &loan, incode_loan_bytes(&loan));
    return true;
}

static bool take_found(struct node_loans *l,
                       const struct cube_message *message) {
    struct node_found_message found;
    size_t head = offsetof(struct node_found_message, found.v);
    struct node_loan_out *out = NULL;
    for (unsigned i = 0; i < NODE_LOANS_OUT; i++)
        if (l->out[i].state == NODE_LOAN_IS_OUT &&
            l->out[i].to == message->source)
            out = &l->out[i];
    if (out == NULL || message->size < head || message->size > sizeof found)
        return false;
    memcpy(&found, message->data, message->size);
    if (found.found.count > INCODE_LOAN_FACES ||
        message->size != node_found_bytes(&found) ||
        !incode_found_is_sound(&found.found, l->bricks))
        return false;
    memcpy(&out->found, &found.found, incode_found_bytes(&found.found));
    out->used = 0;
    out->state = NODE_LOAN_IS_BACK;
    if (found.again != 0)
        add(l->askers, &l->askers_count, message->source);
    return true;
}

void node_loans_take(struct node_loans *loans,
                     const struct cube_message *message) {
    struct node_loans *l = loans;
    bool sound =
        message->source < l->nodes && message->source != l->counted->self;
    l->bytes_in += message->size;
    if (sound && message->type == NODE_LOAN_ASK) {
        sound = message->size == 0;
        add(l->askers, &l->askers_count, message->source);
    } else if (sound && message->type == NODE_LOAN) {
        sound = take_loan(l, message);
    } else if (sound) {
        sound = take_found(l, message);
    }
    if (!sound) {
        node_fault_set(l->fault, "a loan of # bytes of node #", message->size,
                       message->source);
    }
}

/* ---- work ---- */

/* Whether a step did something; one that broke is a fault. */
static bool judge(struct node_loans *l, const struct incode_triangulator *t,
                  enum incode_step step) {
    if (step == INCODE_BROKEN)
        node_fault_set(l->fault, incode_triangulator_fault(t), 0, 0);
    return step == INCODE_WORKED || step == INCODE_FINISHED;
}

uint16_t node_loans_finder(const struct node_loans *loans) {
    for (unsigned i = 0; i < NODE_LOANS_OUT; i++)
        if (loans->out[i].state == NODE_LOAN_IS_BACK)
            return loans->out[i].to;
    return loans->counted->self;
}

bool node_loans_use(struct node_loans *loans, struct incode_triangulator *t,
                    uint32_t units) {
    struct node_loan_out *out = out_in(loans, NODE_LOAN_IS_BACK);
    if (out == NULL)
        return false;
    enum incode_step step =
        incode_triangulator_use(t, &out->loan, &out->found, &out->used, units);
    if (step == INCODE_FINISHED)
        out->state = NODE_LOAN_IS_FREE;
    return judge(loans, t, step);
}

bool node_loans_help(struct node_loans *loans, struct incode_triangulator *t,
                     uint32_t units) {
    struct node_loan_in *in = oldest(loans);
    if (in == NULL)
        return false;
    if (loans->at_work != in) {
        loans->at_work = in;
        incode_borrower_begin(&loans->borrower, t, &in->loan);
    }
    if (loans->borrower.done)
        return false; /* the link has no room for it yet */
    return judge(loans, t, incode_borrower_step(&loans->borrower, t, units));
}

/* ---- what leaves ---- */

static bool write(struct node_loans *l, uint16_t to, uint8_t type,
                  const void *data, size_t size) {
    bool sent = node_counted_write(l->counted, to, type, data, size) == 0;
    l->bytes_out += sent ? size : 0;
    return sent;
}

static unsigned lend(struct node_loans *l, struct incode_triangulator *t) {
    struct node_loan_out *out = out_in(l, NODE_LOAN_IS_MADE);
    if (out == NULL && l->askers_count > 0 &&
        (out = out_in(l, NODE_LOAN_IS_FREE)) != NULL) {
        if (!incode_triangulator_lend(t, &out->loan))
            return 0;
        out->state = NODE_LOAN_IS_MADE;
        out->to = nearest(l, l->askers, true);
        drop(l->askers, &l->askers_count, out->to);
    }
    if (out == NULL || !write(l, out->to, NODE_LOAN, &out->loan,
                              incode_loan_bytes(&out->loan)))
        return 0;
    out->state = NODE_LOAN_IS_OUT;
    return 1;
}

/* To whom a loan goes back as it was. */
static unsigned give_back(struct node_loans *l) {
    const struct node_found_message none = {.again = 0};
    unsigned sent = 0;
    while (l->back_count > 0) {
        uint16_t to = nearest(l, l->back, true);
        if (!write(l, to, NODE_LOAN_FOUND, &none, node_found_bytes(&none)))
            break;
        drop(l->back, &l->back_count, to);
        drop(l->asked, &l->asked_count, to);
        sent++;
    }
    return sent;
}

static unsigned answer(struct node_loans *l, struct incode_triangulator *t) {
    struct node_loan_in *in = l->at_work;
    if (in == NULL || !l->borrower.done)
        return 0;
    struct node_found_message found = {.again = may_ask(l, t)};
    memcpy(&found.found, &l->borrower.found,
           incode_found_bytes(&l->borrower.found));
    if (!write(l, in->from, NODE_LOAN_FOUND, &found, node_found_bytes(&found)))
        return 0;
    if (found.again == 0)
        drop(l->asked, &l->asked_count, in->from);
    in->open = false;
    l->at_work = NULL;
    l->stars += l->borrower.stars;
    return 1;
}

static unsigned ask(struct node_loans *l, struct incode_triangulator *t) {
    if (l->asked_count + 1 >= l->nodes || free_place(l) == NULL ||
        !may_ask(l, t))
        return 0;
    uint16_t to = nearest(l, l->asked, false);
    if (!write(l, to, NODE_LOAN_ASK, NULL, 0))
        return 0;
    add(l->asked, &l->asked_count, to);
    return 1;
}

unsigned node_loans_send(struct node_loans *loans,
                         struct incode_triangulator *t) {
    return lend(loans, t) + answer(loans, t) + give_back(loans) + ask(loans, t);
}
