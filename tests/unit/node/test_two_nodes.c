/* Two nodes and their host, with mailboxes in the place of links: a page that
 * the other node altered is not used, is reported and asked for again, and the
 * result is right; and of each tetrahedron the host learns who found it. */

#include "host/mesh/gen.h"
#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "node/page_check.h"
#include "node/result.h"
#include "node/roles/roles.h"
#include "tests/unit/test.h"

enum {
    NODES = 2,
    HOST = NODES, /* its mailbox */
    POINTS = 4000,
    ARENA = 1 << 20,
    MAIL = 64,
    WANTED = 512,
    FOUND = 20000,
    ROUNDS = 1000000,
    PAGE_KEY = 0x5eed
};

struct cube {
    uint16_t self;
};

static struct host_order order;
static struct host_digest right; /* of the result */

static struct {
    /* What is tested. */
    uint8_t role[NODES];
    uint32_t holders;
    bool to_all;           /* pages of boxes, unasked */
    uint16_t alters;       /* of this one's pages some come altered; */
    unsigned alters_every; /* 0: none does */
    unsigned slow;         /* node 0 works in one round of so many */
    uint8_t alters_type;   /* NODE_PAGE or NODE_PAGE_TO_ALL */
    bool lies;             /* answers name another builder */
    /* What became of it. */
    unsigned pages, altered, reports;
    unsigned found_by[NODES]; /* tetrahedra, by who found them */
    unsigned bytes;           /* of results */
    struct host_tetrahedra tets;
    /* At work. */
    struct box {
        struct mail {
            uint16_t source, size;
            uint8_t type;
            uint8_t data[CUBE_PAYLOAD_MAX];
        } mail[MAIL];
        unsigned first, count;
    } box[NODES + 1];
    struct node {
        struct cube cube;
        struct node_counted counted;
        struct node_fault fault;
        struct node_pace pace;
        const struct node_role *role;
        void *arena;
        bool done;
    } node[NODES];
    struct {
        uint16_t to;
        uint32_t page;
    } wanted[WANTED];
    unsigned wanted_count;
    uint32_t found[FOUND][4]; /* of stars that were lent, by the other node */
    uint16_t finder[FOUND];
    unsigned found_count;
    uint64_t now_us;
} world;

static uint64_t now_us(void *context) {
    (void)context;
    return world.now_us++;
}

/* --- mail ----------------------------------------------------------------- */

static struct box *box_of(uint16_t dest) {
    return &world.box[dest == CUBE_HOST ? HOST : dest];
}

static void sort_row(uint32_t v[4]) {
    for (unsigned i = 1; i < 4; i++) {
        for (unsigned k = i; k > 0 && v[k] < v[k - 1]; k--) {
            uint32_t t = v[k];
            v[k] = v[k - 1];
            v[k - 1] = t;
        }
    }
}

static void note_found(const struct mail *m) {
    struct node_found_message found;
    memcpy(&found, m->data, m->size);
    for (uint32_t i = 0; i < found.found.count; i++) {
        assert_true(world.found_count < FOUND);
        memcpy(world.found[world.found_count], found.found.v[i],
               sizeof found.found.v[i]);
        sort_row(world.found[world.found_count]);
        world.finder[world.found_count++] = m->source;
    }
}

/* The number of an altered page stays: what else it might answer is not known.
 */
static void alter(struct mail *m) {
    bool comes = m->type == world.alters_type && m->source == world.alters;
    unsigned at =
        comes && m->size > 4 ? 4 + (7 * world.altered + 1) % (m->size - 4u) : 0;
    world.pages += comes;
    if (comes && world.alters_every > 0 &&
        world.pages % world.alters_every == 0) {
        m->data[at] ^= (uint8_t)(1 << world.altered % 8);
        world.altered++;
    }
    if (world.lies && m->type == NODE_ANSWERS)
        memset(m->data + offsetof(struct incode_answers, builder), 0, 2);
}

static bool post(uint16_t source, uint16_t dest, uint8_t type, const void *data,
                 size_t size) {
    struct box *box = box_of(dest);
    if (box->count == MAIL)
        return false;
    struct mail *m = &box->mail[(box->first + box->count++) % MAIL];
    *m = (struct mail){.source = source, .type = type, .size = (uint16_t)size};
    if (size > 0) {
        memcpy(m->data, data, size);
        alter(m);
    }
    if (type == NODE_LOAN_FOUND)
        note_found(m);
    return true;
}

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    return post(cube->self, dest, type, data, size) ? 0 : CUBE_AGAIN;
}

unsigned cube_room(const struct cube *cube, uint16_t dest) {
    (void)cube;
    return MAIL - box_of(dest)->count;
}

static void drop(struct box *box) {
    box->first = (box->first + 1) % MAIL;
    box->count--;
}

/* --- the host ------------------------------------------------------------- */

static void want(uint16_t to, const uint8_t *data, size_t size) {
    for (size_t at = 0; at + 4 <= size; at += 4) {
        assert_true(world.wanted_count < WANTED);
        memcpy(&world.wanted[world.wanted_count].page, data + at, 4);
        world.wanted[world.wanted_count++].to = to;
    }
}

static void send_page(uint16_t to, uint8_t type, uint32_t page) {
    struct node_page_message body = {.head.page = page};
    size_t bytes = host_page(&order, page, body.data);
    assert_true(bytes > 0);
    assert_true(post(CUBE_HOST, to, type, &body,
                     node_page_seal(&body, PAGE_KEY, bytes)));
}

/* That node has told this one's lender of it. */
static bool was_found(const uint32_t row[4], uint16_t finder) {
    uint32_t v[4];
    bool was = false;
    memcpy(v, row, sizeof v);
    sort_row(v);
    for (unsigned i = 0; i < world.found_count && !was; i++) {
        was = world.finder[i] == finder &&
              memcmp(world.found[i], v, sizeof v) == 0;
    }
    return was;
}

static void take_results(const struct mail *m) {
    struct node_result_reader reader;
    struct host_error error = {0};
    enum node_result_event event;
    size_t count;
    world.bytes += m->size;
    node_result_open(&reader, m->data + 8, m->size - 8u,
                     order.bricks * INCODE_BRICK_POINTS, m->source, NODES);
    do {
        uint32_t(*rows)[4] = host_tetrahedra_room(&world.tets, 500, &error);
        assert_non_null(rows);
        event = node_result_read(&reader, rows, 500, &count);
        assert_int_not_equal(event, NODE_RESULT_GARBAGE);
        world.found_by[reader.finder] += (unsigned)count;
        for (size_t i = 0; i < count; i++)
            if (world.role[0] == NODE_EXCHANGE && reader.finder != m->source)
                assert_true(was_found(rows[i], (uint16_t)reader.finder));
        host_tetrahedra_keep(&world.tets, count);
    } while (event != NODE_RESULT_END);
}

static void take_report(const struct mail *m) {
    struct node_wrong_page_message wrong;
    assert_int_equal(m->size, sizeof wrong);
    memcpy(&wrong, m->data, sizeof wrong);
    assert_int_equal(wrong.sender, world.alters);
    assert_true(wrong.page < order.tree.pages);
    world.reports++;
}

static void host_takes(const struct mail *m) {
    uint32_t node;
    switch (m->type) {
    case NODE_PAGE_REQUEST:
        want(m->source, m->data, m->size);
        break;
    case NODE_PAGE_PASSED:
        memcpy(&node, m->data, sizeof node);
        want((uint16_t)node, m->data + 4, m->size - 4u);
        break;
    case NODE_RESULT:
        take_results(m);
        break;
    case NODE_WRONG_PAGE:
        take_report(m);
        break;
    default:
        fail_msg("message of type %u", m->type);
    }
}

static void host_step(void) {
    struct box *box = &world.box[HOST];
    for (; box->count > 0; drop(box))
        host_takes(&box->mail[box->first]);
    while (world.wanted_count > 0 &&
           box_of(world.wanted[world.wanted_count - 1].to)->count < MAIL) {
        world.wanted_count--;
        send_page(world.wanted[world.wanted_count].to, NODE_PAGE,
                  world.wanted[world.wanted_count].page);
    }
}

/* --- nodes ---------------------------------------------------------------- */

static void node_step(unsigned i, bool works) {
    struct node *n = &world.node[i];
    for (struct box *box = &world.box[i]; box->count > 0; drop(box)) {
        const struct mail *m = &box->mail[box->first];
        const struct cube_message message = {m->source, m->size, m->type,
                                             m->data};
        if (n->role->may_take != NULL && !n->role->may_take(n->arena, &message))
            break;
        n->role->message(n->arena, &message, world.now_us);
        n->counted.received += m->source == CUBE_HOST;
    }
    node_pace_begin(&n->pace, world.now_us);
    if (works)
        (void)n->role->work(n->arena, &n->pace);
    (void)n->role->send(n->arena);
    n->fault.text[n->fault.size] = '\0';
    assert_string_equal(n->fault.text, "");
    if (n->role->done(n->arena) != 0) {
        n->role->end(n->arena, world.now_us);
        n->done = true;
    }
}

static struct node_setup_message setup_of(unsigned i) {
    struct node_setup_message setup = {
        .nodes = NODES,
        .holders = (uint16_t)world.holders,
        .credits = 1u << 30,
        .role = world.role[i],
        .faces_per_job = 16,
        .jobs_per_worker = 2,
        .page_key = PAGE_KEY,
        .setup = {.bricks = order.bricks,
                  .index = INCODE_KD,
                  .build = INCODE_BUILD_FACES,
                  .owner_rule = INCODE_OWNER_LOWEST}};
    bool has_builders =
        world.role[0] == NODE_MANAGER || world.role[0] == NODE_LINDA_MANAGER;
    if (has_builders)
        node_add_builder(&setup, 1);
    memcpy(setup.setup.lo, order.lo, sizeof order.lo);
    memcpy(setup.setup.hi, order.hi, sizeof order.hi);
    return setup;
}

static void give_job(unsigned i, uint32_t first, uint32_t last,
                     const double lo[3], const double hi[3]) {
    struct node_job_message job = {.epoch = i + 1,
                                   .job = {.first = first, .last = last}};
    memcpy(job.job.lo, lo, sizeof job.job.lo);
    memcpy(job.job.hi, hi, sizeof job.job.hi);
    assert_true(post(CUBE_HOST, (uint16_t)i, NODE_JOB, &job, sizeof job));
}

/* Of an exchange: regions, and a job each. */
static void give_regions(void) {
    struct {
        struct node_regions_message head;
        uint32_t first[NODES + 1];
    } message = {.head = {.count = NODES + 1, .to_all = order.tree.pages}};
    if (world.to_all)
        message.head.to_all = order.tree.base[1];
    for (unsigned i = 0; i < NODES; i++)
        message.first[i] = order.region[i].first;
    message.first[NODES] = order.bricks;
    for (unsigned k = 0; k < NODES; k++) {
        const uint16_t i = (uint16_t)k;
        const struct host_region *r = &order.region[i];
        assert_true(post(CUBE_HOST, i, NODE_REGIONS, &message, sizeof message));
        give_job(i, r->first, r->last, r->lo, r->hi);
    }
}

static void start(void) {
    for (unsigned i = 0; i < NODES; i++) {
        struct node *n = &world.node[i];
        const struct node_setup_message setup = setup_of(i);
        n->cube.self = n->counted.self = (uint16_t)i;
        n->counted.cube = &n->cube;
        n->role = node_role_named(setup.role);
        n->arena = aligned_alloc(NODE_ALIGNMENT, ARENA);
        assert_non_null(n->arena);
        node_pace_init(&n->pace, now_us, NULL);
        if (!n->role->start(n->arena, ARENA, &setup, &n->counted, &n->fault))
            fail_msg("%.*s", (int)n->fault.size, n->fault.text);
        /* What has no job is done when the other one is. */
        n->done = i > 0 && world.role[0] != NODE_EXCHANGE;
    }
    if (world.role[0] == NODE_EXCHANGE)
        give_regions();
    else
        give_job(0, 0, order.bricks, order.lo, order.hi);
}

static void run(void) {
    uint32_t next = order.tree.pages;
    start();
    for (unsigned round = 0; !world.node[0].done || !world.node[1].done;
         round++) {
        assert_in_range(round, 0, ROUNDS);
        node_step(0, world.slow == 0 || round % world.slow == 0);
        node_step(1, true);
        host_step();
        if (world.to_all && round > 10 && next > order.tree.base[1] &&
            world.box[0].count < MAIL && world.box[1].count < MAIL) {
            next--;
            send_page(0, NODE_PAGE_TO_ALL, next);
            send_page(1, NODE_PAGE_TO_ALL, next);
        }
    }
    for (unsigned i = 0; i < NODES; i++) {
        assert_int_equal(world.node[i].role->held(world.node[i].arena), 0);
        free(world.node[i].arena);
    }
}

static void expect_right(void) {
    struct host_digest digest;
    host_tetrahedra_map(&world.tets, order.row);
    host_tetrahedra_sort(&world.tets);
    host_digest(&world.tets, &digest);
    assert_string_equal(digest.text, right.text);
    host_tetrahedra_free(&world.tets);
}

static void begin(uint8_t role0, uint8_t role1) {
    memset(&world, 0, sizeof world);
    world.role[0] = role0;
    world.role[1] = role1;
    world.holders = role1 == NODE_HOLDER;
    world.alters = 1;
    world.alters_type = NODE_PAGE;
}

/* --- tests ---------------------------------------------------------------- */

/* Of one that works alone, with the host's pages; all others have the same. */
static int set_up(void **unused) {
    struct host_points points = {0};
    struct host_error error = {0};
    (void)unused;
    if (host_gen("uniform", POINTS, 5, &points, &error) != 0 ||
        host_order_make(&order, "test", points.xyz, POINTS, HOST_ADAPTIVE,
                        NODES, false, &error) != 0)
        return -1;
    host_points_free(&points);
    begin(NODE_WORKER, NODE_WORKER);
    run();
    assert_int_equal(world.found_by[0], world.tets.count);
    host_tetrahedra_map(&world.tets, order.row);
    host_tetrahedra_sort(&world.tets);
    host_digest(&world.tets, &right);
    host_tetrahedra_free(&world.tets);
    return 0;
}

static int tear_down(void **unused) {
    (void)unused;
    host_order_free(&order);
    return 0;
}

static void expect_altered(void) {
    assert_true(world.altered > 3);
    assert_in_range(world.reports, 1, world.altered);
    expect_right();
}

TEST(pages_of_a_holder) {
    begin(NODE_WORKER, NODE_HOLDER);
    world.alters_every = 5;
    run();
    expect_altered();
    /* Each of them: the host sends all. */
    begin(NODE_WORKER, NODE_HOLDER);
    world.alters_every = 1;
    run();
    expect_altered();
}

TEST(pages_of_the_host) {
    static const uint8_t roles[][2] = {{NODE_WORKER, NODE_WORKER},
                                       {NODE_WORKER, NODE_HOLDER},
                                       {NODE_MANAGER, NODE_BUILDER},
                                       {NODE_LINDA_MANAGER, NODE_LINDA_BUILDER},
                                       {NODE_EXCHANGE, NODE_EXCHANGE}};
    for (size_t i = 0; i < sizeof roles / sizeof roles[0]; i++) {
        begin(roles[i][0], roles[i][1]);
        world.alters = CUBE_HOST;
        world.alters_every = 5;
        run();
        expect_altered();
    }
}

TEST(pages_that_are_lent) {
    for (unsigned every = 2; every > 0; every--) {
        begin(NODE_EXCHANGE, NODE_EXCHANGE);
        world.alters_every = every;
        run();
        expect_altered();
    }
}

TEST(pages_to_all) {
    for (unsigned every = 2; every > 0; every--) {
        begin(NODE_EXCHANGE, NODE_EXCHANGE);
        world.to_all = true;
        world.alters = CUBE_HOST;
        world.alters_type = NODE_PAGE_TO_ALL;
        world.alters_every = every;
        run();
        assert_true(world.altered > 0 && world.reports > 0);
        expect_right();
    }
}

/* Whatever a list says: the one that it came from.  In a tuple it says so. */
TEST(found_by_a_builder) {
    static const uint8_t roles[][2] = {
        {NODE_MANAGER, NODE_BUILDER}, {NODE_LINDA_MANAGER, NODE_LINDA_BUILDER}};
    for (unsigned i = 0; i < 2; i++) {
        begin(roles[i][0], roles[i][1]);
        world.lies = true;
        run();
        assert_int_equal(world.found_by[0], 0);
        assert_int_equal(world.found_by[1], world.tets.count);
        expect_right();
    }
}

/* What was found at stars that were lent: take_results. */
TEST(found_by_a_borrower) {
    begin(NODE_EXCHANGE, NODE_EXCHANGE);
    world.slow = 16;
    run();
    assert_int_equal(world.found_by[0] + world.found_by[1], world.tets.count);
    assert_true(world.found_count > 20);
    uint32_t own = order.region[0].last * INCODE_BRICK_POINTS;
    unsigned of_node_0 = 0;
    for (uint64_t i = 0; i < world.tets.count; i++) {
        uint32_t v[4];
        memcpy(v, world.tets.v[i], sizeof v);
        sort_row(v);
        of_node_0 += v[0] < own;
    }
    /* It has sent more than it has found. */
    assert_true(of_node_0 > world.found_by[0] + 10);
    expect_right();
}

TEST_GROUP(set_up, tear_down)
