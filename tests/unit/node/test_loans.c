/* Loans among nodes: who asks whom, what goes where on links that have room for
 * so many messages, and what is refused. */

#include "host/mesh/gen.h"
#include "node/roles/lending.h"
#include "tests/unit/incode/several.h"
#include "tests/unit/test.h"

enum { SENT_MAX = 64, NODES = 8, LENDER = 0, HELPER = 1 };

/* --- links, in the place of transport/cube.c ------------------------------ */

struct cube {
    unsigned room, count, from; /* messages before `from` have arrived */
    struct sent {
        uint16_t dest, size;
        uint8_t type;
        uint8_t data[CUBE_PAYLOAD_MAX];
    } sent[SENT_MAX];
};

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    if (cube->room == 0)
        return CUBE_AGAIN;
    assert_true(cube->count < SENT_MAX);
    struct sent *sent = &cube->sent[cube->count++];
    *sent = (struct sent){.dest = dest, .type = type, .size = (uint16_t)size};
    if (size > 0)
        memcpy(sent->data, data, size);
    cube->room--;
    return 0;
}

/* --- two nodes ------------------------------------------------------------ */

/* The lender works on its region; the helper has none, and all points. */
static struct one {
    struct cube cube;
    struct node_counted counted;
    struct node_fault fault;
    struct node_loans loans;
    _Alignas(64) uint64_t memory[64];
    struct incode_triangulator *t;
} one[2];
static struct several all;
static struct solo helper;

static void begin(struct one *n, uint16_t self, struct incode_triangulator *t) {
    struct node_setup_message setup = {
        .nodes = NODES, .setup = {.bricks = all.solo.order.bricks}};
    memset(n, 0, sizeof *n);
    n->counted.cube = &n->cube;
    n->counted.self = self;
    n->cube.room = SENT_MAX;
    n->t = t;
    assert_in_range(node_loans_bytes(NODES), 1, sizeof n->memory);
    node_loans_init(&n->loans, n->memory, &setup, &n->counted, &n->fault);
}

static int open_nodes(void **unused) {
    (void)unused;
    struct host_points p = {0};
    struct host_error error = {0};
    all =
        (struct several){.seed = 3, .solo = {.index = INCODE_KD, .regions = 1}};
    if (host_gen("uniform", 3000, 5, &p, &error) != 0)
        fail_msg("%s", error.text);
    several_open(&all, p.xyz, p.count);
    helper = (struct solo){
        .index = INCODE_KD, .regions = 1, .owner_rule = INCODE_OWNER_LOWEST};
    solo_open(&helper, p.xyz, p.count);
    helper.wanted = INCODE_NONE;
    host_points_free(&p);
    begin(&one[LENDER], LENDER, all.node[0].solo.t);
    begin(&one[HELPER], HELPER, helper.t);
    return 0;
}

static int close_nodes(void **unused) {
    (void)unused;
    several_close(&all);
    solo_close(&helper);
    return 0;
}

static void say(struct one *n, uint16_t source, uint8_t type, const void *data,
                size_t size) {
    const struct cube_message message = {
        .source = source, .type = type, .data = data, .size = (uint16_t)size};
    node_loans_take(&n->loans, &message);
}

/* What one has sent to the other arrives; others hear nothing. */
static void deliver(struct one *from, struct one *to) {
    for (; from->cube.from < from->cube.count; from->cube.from++) {
        const struct sent *s = &from->cube.sent[from->cube.from];
        if (s->dest == to->counted.self)
            say(to, from->counted.self, s->type, s->data, s->size);
    }
    assert_false(node_fault_is_set(&to->fault));
}

static void send_all(struct one *n) {
    while (node_loans_send(&n->loans, n->t) > 0)
        ;
}

/* Until the lender has lent so many times. */
static void lend(unsigned loans) {
    struct one *l = &one[LENDER];
    for (unsigned lent = 0; lent < loans;) {
        unsigned sent = node_loans_send(&l->loans, l->t);
        lent += sent;
        if (sent == 0)
            assert_false(solo_step(&all.node[0].solo, 1));
    }
}

static void help(void) {
    struct one *h = &one[HELPER];
    while (h->loans.at_work == NULL || !h->loans.borrower.done)
        if (!node_loans_help(&h->loans, h->t, 10))
            assert_true(solo_deliver(&helper));
}

static const struct sent *last_of(const struct one *n) {
    assert_true(n->cube.count > 0);
    return &n->cube.sent[n->cube.count - 1];
}

/* --- tests ---------------------------------------------------------------- */

/* Neighbours first, each node once, as the links take it. */
TEST_WITH(asks, open_nodes, close_nodes) {
    static const uint16_t order[] = {0, 3, 5, 2, 4, 7, 6};
    struct one *h = &one[HELPER];
    h->cube.room = 0;
    assert_int_equal(node_loans_send(&h->loans, h->t), 0);
    for (unsigned i = 0; i < NODES - 1; i++) {
        h->cube.room = 1;
        send_all(h);
        assert_int_equal(h->cube.count, i + 1);
        assert_int_equal(last_of(h)->type, NODE_LOAN_ASK);
        assert_int_equal(last_of(h)->dest, order[i]);
        assert_int_equal(last_of(h)->size, 0);
    }
    h->cube.room = 1;
    assert_int_equal(node_loans_send(&h->loans, h->t), 0);
}

/* Who has work of its own asks nobody, and lends to nobody unasked. */
TEST_WITH(works_by_itself, open_nodes, close_nodes) {
    struct one *l = &one[LENDER];
    for (unsigned i = 0; i < 300; i++) {
        assert_false(solo_step(&all.node[0].solo, 1));
        assert_int_equal(node_loans_send(&l->loans, l->t), 0);
    }
    assert_int_equal(node_loans_owing(&l->loans), CUBE_HOST);
}

/* There and back, again and again, until nothing is left. */
TEST_WITH(there_and_back, open_nodes, close_nodes) {
    struct one *l = &one[LENDER], *h = &one[HELPER];
    unsigned loans = 0;
    send_all(h);
    deliver(h, l);
    for (bool finished = false; !finished;) {
        l->cube.count = l->cube.from = h->cube.count = h->cube.from = 0;
        l->cube.room = h->cube.room = SENT_MAX;
        send_all(l);
        if (l->cube.count == 0) {
            finished = solo_step(&all.node[0].solo, 1);
            continue;
        }
        assert_int_equal(last_of(l)->type, NODE_LOAN);
        assert_int_equal(node_loans_owing(&l->loans), HELPER);
        deliver(l, h);
        help();
        h->cube.room = 0;
        send_all(h);
        assert_false(node_loans_help(&h->loans, h->t, 10));
        h->cube.room = 1;
        send_all(h);
        assert_int_equal(last_of(h)->type, NODE_LOAN_FOUND);
        assert_int_equal(node_loans_finder(&l->loans), LENDER);
        deliver(h, l);
        assert_int_equal(node_loans_finder(&l->loans), HELPER);
        while (node_loans_use(&l->loans, l->t, 10))
            ;
        assert_int_equal(node_loans_finder(&l->loans), LENDER);
        assert_int_equal(node_loans_owing(&l->loans), CUBE_HOST);
        loans++;
    }
    assert_true(loans > 5);
    assert_int_equal(l->t->front.counts.kept, all.node[0].solo.tets.count);
    several_finish(&all, 0);
    assert_true(h->loans.stars > 0);
}

/* A loan for which there is no place goes back as it was, and may be asked for
 * again. */
TEST_WITH(no_place, open_nodes, close_nodes) {
    struct one *l = &one[LENDER], *h = &one[HELPER];
    send_all(h);
    say(l, HELPER, NODE_LOAN_ASK, NULL, 0);
    lend(1);
    const struct sent loan = *last_of(l);
    for (unsigned from = 2; from < 2 + NODE_LOANS_IN; from++)
        say(h, (uint16_t)from, NODE_LOAN, loan.data, loan.size);
    unsigned before = h->cube.count;
    assert_int_equal(node_loans_send(&h->loans, h->t), 0);
    deliver(l, h);
    send_all(h);
    assert_int_equal(h->cube.count, before + 1);
    assert_int_equal(last_of(h)->type, NODE_LOAN_FOUND);
    h->cube.from = before;
    deliver(h, l);
    assert_int_equal(l->t->front.exchange.lent, 1);
    assert_true(node_loans_use(&l->loans, l->t, 10));
    assert_int_equal(l->t->front.exchange.lent, 0);
    assert_int_equal(l->t->front.counts.late, 0);
    assert_int_equal(l->loans.askers_count, 0);
    help();
    send_all(h);
    assert_int_equal(last_of(h)->type, NODE_LOAN_ASK);
    assert_int_equal(last_of(h)->dest, LENDER);
}

/* So many loans are out at most, each with another node. */
TEST_WITH(so_many, open_nodes, close_nodes) {
    struct one *l = &one[LENDER];
    uint32_t seen = 0;
    for (unsigned i = 1; i < NODES; i++)
        say(l, (uint16_t)i, NODE_LOAN_ASK, NULL, 0);
    lend(NODE_LOANS_OUT);
    for (unsigned i = 0; i < NODE_LOANS_OUT; i++)
        seen |= UINT32_C(1) << l->cube.sent[i].dest;
    assert_int_equal(seen, 1 << 1 | 1 << 2 | 1 << 4 | 1 << 3);
    for (unsigned i = 0; i < 50; i++) {
        (void)solo_step(&all.node[0].solo, 1);
        assert_int_equal(node_loans_send(&l->loans, l->t), 0);
    }
}

static void expect_fault(uint16_t source, uint8_t type, const void *data,
                         size_t size) {
    struct one *h = &one[HELPER];
    say(h, source, type, data, size);
    assert_true(node_fault_is_set(&h->fault));
    h->fault.size = 0;
}

TEST_WITH(refusals, open_nodes, close_nodes) {
    const struct incode_loan loan = {0, 4, 1, {{70, 80, 90}}};
    struct incode_loan false_count = loan, no_run = loan;
    const struct node_found_message found = {0, {1, {{1, 2, 3, 4}}}};
    struct one *h = &one[HELPER];
    expect_fault(0, NODE_LOAN, &loan, incode_loan_bytes(&loan));
    expect_fault(0, NODE_LOAN_FOUND, &found, node_found_bytes(&found));
    expect_fault(0, NODE_LOAN_ASK, &loan, 4);
    expect_fault(HELPER, NODE_LOAN_ASK, NULL, 0);
    expect_fault(NODES, NODE_LOAN_ASK, NULL, 0);
    send_all(h);
    false_count.count = 2;
    expect_fault(0, NODE_LOAN, &false_count, incode_loan_bytes(&loan));
    expect_fault(0, NODE_LOAN, &loan, 3);
    no_run.v[0][0] = 4 * INCODE_BRICK_POINTS;
    expect_fault(0, NODE_LOAN, &no_run, incode_loan_bytes(&no_run));
    say(h, 0, NODE_LOAN, &loan, incode_loan_bytes(&loan));
    assert_false(node_fault_is_set(&h->fault));
    expect_fault(0, NODE_LOAN, &loan, incode_loan_bytes(&loan));
}
