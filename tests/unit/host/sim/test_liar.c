/* A node that lies: in each way it alters what that way is about, as often as
 * it is to, nothing else, and always so that what leaves is a message. */

#include "host/sim/liar.h"
#include "node/common.h"
#include "transport/drivers/sim.h"
#include "transport/tuples/tuples.h"
#include "tests/unit/test.h"

enum {
    STARS = 10,
    EACH = 12, /* tetrahedra of a star */
    ROWS = STARS * EACH,
    MESSAGES = 200,
    ONE_IN = 5,
    LISTED = 20, /* rows of lists, answers and loans */
    SELF = 1,
    PEER = 3
};

/* --- a link, in the place of transport/cube.c ----------------------------- */

struct cube {
    unsigned room, count;
    uint16_t size;
    uint8_t type, data[CUBE_PAYLOAD_MAX];
};

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    assert_int_equal(dest, CUBE_HOST);
    assert_true(size <= CUBE_PAYLOAD_MAX);
    if (cube->room == 0)
        return CUBE_AGAIN;
    cube->room--;
    cube->count++;
    cube->type = type;
    cube->size = (uint16_t)size;
    memcpy(cube->data, data, size);
    return 0;
}

/* --- messages ------------------------------------------------------------- */

static struct host_liar liar;

static void begin(enum host_lie way, uint32_t one_in) {
    memset(&liar, 0, sizeof liar);
    liar.way = way;
    liar.one_in = one_in;
    liar.random = sim_seed(7, way);
}

/* Message k has vertices of its own. */
static void row_of(uint32_t k, uint32_t i, uint32_t v[4]) {
    uint32_t base = 64 * k;
    v[0] = base + i / EACH;
    for (uint32_t j = 1; j < 4; j++)
        v[j] = base + STARS + (3 * i + j) % 50;
}

/* Every fourth star has been found by another node. */
static uint16_t finder_of(uint32_t star) {
    return star % 4 == 2 ? PEER : SELF;
}

/* Results with a commit behind each second star; their size. */
static size_t results(uint32_t k, uint8_t data[CUBE_PAYLOAD_MAX + 4]) {
    const struct node_result_header head = {9, k};
    struct node_result_writer writer;
    memcpy(data, &head, sizeof head);
    node_result_begin(&writer, data + sizeof head,
                      CUBE_PAYLOAD_MAX - sizeof head, SELF);
    for (uint32_t star = 0; star < STARS; star++) {
        uint32_t apexes[EACH][3], v[4] = {0};
        for (uint32_t i = 0; i < EACH; i++) {
            row_of(k, star * EACH + i, v);
            memcpy(apexes[i], v + 1, sizeof apexes[i]);
        }
        assert_int_equal(node_result_finder(&writer, finder_of(star)), 1);
        assert_int_equal(node_result_star(&writer, v[0], apexes, EACH), EACH);
        if (star % 2 == 1)
            assert_int_equal(node_result_commit(&writer, k), 1);
    }
    return sizeof head + writer.size;
}

struct seen {
    uint32_t row[2 * ROWS][4], finder[2 * ROWS];
    size_t rows, commits;
};

static void read_back(const uint8_t *data, size_t size, uint32_t k,
                      struct seen *seen) {
    struct node_result_reader reader;
    enum node_result_event event;
    size_t count;
    seen->rows = seen->commits = 0;
    node_result_open(&reader, data + sizeof(struct node_result_header),
                     size - sizeof(struct node_result_header), UINT32_MAX, SELF,
                     2 * PEER);
    do {
        event = node_result_read(&reader, seen->row + seen->rows,
                                 2 * ROWS - seen->rows, &count);
        assert_int_not_equal(event, NODE_RESULT_GARBAGE);
        for (; count > 0; count--)
            seen->finder[seen->rows++] = reader.finder;
        if (event == NODE_RESULT_COMMIT) {
            assert_int_equal(reader.brick, k);
            seen->commits++;
        }
    } while (event != NODE_RESULT_END);
}

/* How many rows of message k or the one before are as v. */
static unsigned times(uint32_t k, const uint32_t v[4]) {
    unsigned same = 0;
    for (uint32_t m = k > 0 ? k - 1 : 0; m <= k; m++) {
        for (uint32_t i = 0; i < ROWS; i++) {
            uint32_t row[4];
            row_of(m, i, row);
            same += memcmp(row, v, sizeof row) == 0;
        }
    }
    return same;
}

/* --- results -------------------------------------------------------------- */

/* Rows of the true ones that are not there, and rows that are not of them, a
 * lie, for each way. */
TEST(results_are_altered) {
    static const struct {
        enum host_lie way;
        int more, strange; /* rows a lie */
    } ways[] = {{HOST_LIE_DROP, -1, 0},
                {HOST_LIE_EXCHANGE, 0, 1},
                {HOST_LIE_REPEAT, 1, 0},
                {HOST_LIE_INVENT, 1, 1}};
    for (unsigned w = 0; w < sizeof ways / sizeof ways[0]; w++) {
        uint64_t lies = 0;
        begin(ways[w].way, ONE_IN);
        for (uint32_t k = 0; k < MESSAGES; k++) {
            uint8_t data[CUBE_PAYLOAD_MAX + NODE_RESULT_SLACK];
            struct seen seen;
            size_t size = results(k, data);
            size = host_liar_alter(&liar, CUBE_HOST, NODE_RESULT, data, size);
            assert_memory_equal(liar.out, data,
                                sizeof(struct node_result_header));
            read_back(liar.out, size, k, &seen);
            int strange = 0, said = (int)liar.pending;
            for (size_t i = 0; i < seen.rows; i++) {
                uint32_t star = seen.row[i][0] % 64;
                strange += times(k, seen.row[i]) == 0;
                assert_true(seen.finder[i] == finder_of(star) ||
                            ways[w].way == HOST_LIE_REPEAT);
            }
            assert_int_equal(seen.commits, STARS / 2);
            assert_int_equal((int)seen.rows, ROWS + said * ways[w].more);
            assert_int_equal(strange, said * ways[w].strange);
            lies += liar.pending;
        }
        assert_in_range(lies, MESSAGES * ROWS / ONE_IN * 9 / 10,
                        MESSAGES * ROWS / ONE_IN * 11 / 10);
    }
}

/* An exchanged apex turns half of the tetrahedra over, or may. */
TEST(both_orientations_are_told) {
    uint8_t data[CUBE_PAYLOAD_MAX + NODE_RESULT_SLACK];
    unsigned swapped = 0, kept = 0;
    struct seen seen;
    begin(HOST_LIE_EXCHANGE, 1);
    size_t size = results(1, data);
    size = host_liar_alter(&liar, CUBE_HOST, NODE_RESULT, data, size);
    read_back(liar.out, size, 1, &seen);
    for (uint32_t i = 0; i < ROWS; i++) {
        uint32_t v[4];
        row_of(1, i, v);
        swapped += seen.row[i][2] == v[3] || seen.row[i][3] == v[2];
        kept += seen.row[i][2] == v[2] || seen.row[i][3] == v[3];
    }
    assert_true(swapped > ROWS / 4 && kept > ROWS / 4);
}

/* What is full stays as it is, and so does what is no batch. */
TEST(what_does_not_fit_is_not_told) {
    uint8_t data[CUBE_PAYLOAD_MAX + NODE_RESULT_SLACK] = {0};
    struct node_result_writer writer;
    uint32_t v = 5;
    size_t head = sizeof(struct node_result_header);
    node_result_begin(&writer, data + head, CUBE_PAYLOAD_MAX - head, SELF);
    const uint32_t far[1][3] = {{1u << 30, 1u << 31, 3u << 30}};
    while (node_result_star(&writer, v, far, 1) == 1)
        v += 1u << 29;
    size_t size = head + writer.size;
    begin(HOST_LIE_REPEAT, 1);
    assert_int_equal(host_liar_alter(&liar, CUBE_HOST, NODE_RESULT, data, size),
                     size);
    assert_int_equal(liar.pending, 0);
    assert_memory_equal(liar.out, data, size);
    memset(data, 0xff, sizeof data);
    begin(HOST_LIE_DROP, 1);
    assert_int_equal(host_liar_alter(&liar, CUBE_HOST, NODE_RESULT, data, 99),
                     99);
    assert_int_equal(liar.pending, 0);
    assert_memory_equal(liar.out, data, 99);
}

/* --- what nodes send each other ------------------------------------------- */

/* Rows of so many vertices, every fourth of four at the hull. */
static void fill(uint32_t *v, uint32_t rows, uint32_t width) {
    for (uint32_t i = 0; i < rows * width; i++) {
        bool hull = width == 4 && i % 16 == 15;
        v[i] = hull ? INCODE_NONE : 7 * i + 1;
    }
}

/* Alters a message whose rows begin at word `at`: how many rows differ; what is
 * before the rows, and of each row its first `same` vertices, does not. */
static unsigned differ(uint8_t type, const void *data, size_t size, size_t at,
                       uint32_t width, uint32_t same) {
    uint32_t before[CUBE_PAYLOAD_MAX / 4], after[CUBE_PAYLOAD_MAX / 4];
    unsigned rows = 0;
    assert_int_equal(host_liar_alter(&liar, PEER, type, data, size), size);
    memcpy(before, data, size);
    memcpy(after, liar.out, size);
    assert_memory_equal(before, after, at * 4);
    for (size_t i = at; i < size / 4; i += width) {
        assert_memory_equal(&before[i], &after[i], same * 4);
        rows += memcmp(&before[i], &after[i], width * 4) != 0;
    }
    assert_int_equal(rows, liar.pending);
    return rows;
}

static struct incode_answers answers_of(void) {
    struct incode_answers answers = {INCODE_LIST_FACES, PEER, LISTED, {{0}}};
    fill(answers.v[0], LISTED, 4);
    return answers;
}

TEST(answers_are_altered) {
    const struct incode_answers answers = answers_of();
    const size_t size = incode_answers_bytes(LISTED);
    unsigned hull = LISTED / 4;
    begin(HOST_LIE_DROP, 1);
    assert_int_equal(differ(NODE_ANSWERS, &answers, size, 2, 4, 3),
                     LISTED - hull);
    begin(HOST_LIE_EXCHANGE, 1);
    assert_int_equal(differ(NODE_ANSWERS, &answers, size, 2, 4, 3),
                     LISTED - hull);
    begin(HOST_LIE_INVENT, 1);
    assert_int_equal(differ(NODE_ANSWERS, &answers, size, 2, 4, 3), hull);
    begin(HOST_LIE_REPEAT, 1);
    assert_int_equal(differ(NODE_ANSWERS, &answers, size, 2, 4, 0), LISTED);
    for (int way = HOST_LIE_PAGE; way < HOST_LIES; way++) {
        begin((enum host_lie)way, 1);
        assert_int_equal(differ(NODE_ANSWERS, &answers, size, 2, 4, 4), 0);
    }
}

TEST(what_is_lent_is_altered) {
    struct incode_list list = {INCODE_LIST_FACES, LISTED, {{0}}};
    struct incode_loan loan = {1, 2, LISTED, {{0}}};
    fill(list.v[0], LISTED, 3);
    fill(loan.v[0], LISTED, 3);
    for (int way = 0; way < HOST_LIES; way++) {
        unsigned lies = way == HOST_LIE_LOAN ? LISTED : 0;
        begin((enum host_lie)way, 1);
        assert_int_equal(
            differ(NODE_LIST, &list, incode_list_bytes(LISTED), 2, 3, 0), lies);
        assert_int_equal(
            differ(NODE_LOAN, &loan, incode_loan_bytes(&loan), 3, 3, 0), lies);
    }
}

/* A tuple is still a tuple, and another in its list or answers alone. */
TEST(tuples_are_altered) {
    const struct incode_answers answers = answers_of();
    uint8_t data[CUBE_PAYLOAD_MAX] = {4};
    struct tuple tuple = {.count = 2, .keyed = true};
    tuple.field[0] = TUPLE_UINT32(77);
    tuple.field[1] = TUPLE_BYTES(&answers, incode_answers_bytes(LISTED));
    size_t size = tuple_write(&tuple, data + TUPLES_HEADER_BYTES,
                              sizeof data - TUPLES_HEADER_BYTES);
    assert_true(size > 0);
    size += TUPLES_HEADER_BYTES;
    begin(HOST_LIE_DROP, 1);
    assert_int_equal(host_liar_alter(&liar, PEER, NODE_TUPLES, data, size),
                     size);
    assert_int_equal(liar.pending, LISTED - LISTED / 4);
    assert_memory_equal(liar.out, data, TUPLES_HEADER_BYTES + 10 + 8 + 12);
    assert_true(tuple_read(&tuple, liar.out + TUPLES_HEADER_BYTES,
                           size - TUPLES_HEADER_BYTES));
    assert_int_equal(tuple.field[1].size, incode_answers_bytes(LISTED));
    data[0] = 1; /* a template has no value to be altered */
    tuple.field[1] = TUPLE_FORMAL(TUPLE_TYPE_BYTES);
    size = TUPLES_HEADER_BYTES + tuple_write(&tuple, data + TUPLES_HEADER_BYTES,
                                             sizeof data - TUPLES_HEADER_BYTES);
    assert_int_equal(host_liar_alter(&liar, PEER, NODE_TUPLES, data, size),
                     size);
    assert_memory_equal(liar.out, data, size);
}

TEST(findings_are_altered) {
    static const int more[] = {
        [HOST_LIE_DROP] = -LISTED,  [HOST_LIE_EXCHANGE] = 0,
        [HOST_LIE_REPEAT] = LISTED, [HOST_LIE_INVENT] = LISTED / 4,
        [HOST_LIE_PAGE] = 0,        [HOST_LIE_LOAN] = 0};
    struct node_found_message found = {1, {LISTED, {{0}}}}, said;
    fill(found.found.v[0], LISTED, 4);
    for (int way = 0; way <= HOST_LIE_LOAN; way++) {
        size_t size = node_found_bytes(&found);
        begin((enum host_lie)way, 1);
        size = host_liar_alter(&liar, PEER, NODE_LOAN_FOUND, &found, size);
        memcpy(&said, liar.out, size);
        assert_int_equal(said.again, 1);
        assert_int_equal((int)said.found.count, LISTED + more[way]);
        assert_int_equal(size, node_found_bytes(&said));
        assert_int_equal(liar.pending > 0, way != HOST_LIE_PAGE);
        bool same = memcmp(&said, &found, size) == 0;
        assert_int_equal(same, way == HOST_LIE_PAGE);
    }
}

TEST(shared_ones_are_altered) {
    struct node_shared shared[LISTED];
    fill(shared[0].v, LISTED, 4);
    for (int way = 0; way < HOST_LIES; way++) {
        begin((enum host_lie)way, 1);
        unsigned lies = differ(NODE_SHARE, shared, sizeof shared, 0, 4, 0);
        bool tells = way <= HOST_LIE_INVENT || way == HOST_LIE_LOAN;
        assert_int_equal(lies >= LISTED - LISTED / 4, tells);
        assert_int_equal(lies > 0, tells);
    }
}

static size_t page_bytes(uint8_t *data, size_t bytes) {
    const size_t head = sizeof(struct node_page_head);
    for (size_t i = 0; i < bytes / sizeof(double); i++) {
        double x = i % INCODE_BRICK_POINTS < 10 ? 1 + (double)i / 64 : 7;
        memcpy(data + head + i * sizeof x, &x, sizeof x);
    }
    return head + bytes;
}

/* One coordinate of one of its ten points and the repeated one, whatever stands
 * before the points; never on its way to the host, nor that of a box. */
TEST(pages_are_altered) {
    uint8_t data[CUBE_PAYLOAD_MAX] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    unsigned kinds[3] = {0}, lies = 0;
    const size_t head = sizeof(struct node_page_head);
    begin(HOST_LIE_PAGE, 1);
    for (unsigned k = 0; k < MESSAGES; k++) {
        size_t size = page_bytes(data, INCODE_BRICK_BYTES);
        assert_int_equal(host_liar_alter(&liar, PEER, NODE_PAGE, data, size),
                         size);
        assert_memory_equal(liar.out, data, head);
        for (size_t at = head; at < size; at += sizeof(double)) {
            double was, is;
            memcpy(&was, data + at, sizeof was);
            memcpy(&is, liar.out + at, sizeof is);
            if (was < is || was > is) {
                double by = was < is ? is - was : was - is;
                assert_true((at - head) / 8 % INCODE_BRICK_POINTS <= 10);
                kinds[by < 1e-12 ? 0 : is <= 7 ? 1 : 2]++;
                lies++;
            }
        }
    }
    assert_true(lies > MESSAGES / 2);
    assert_true(kinds[0] > 9 && kinds[1] > 9 && kinds[2] > 9);
    size_t size = page_bytes(data, INCODE_BRICK_BYTES);
    (void)host_liar_alter(&liar, CUBE_HOST, NODE_PAGE, data, size);
    assert_memory_equal(liar.out, data, size);
    size = page_bytes(data, INCODE_PAGE_BYTES);
    (void)host_liar_alter(&liar, PEER, NODE_PAGE, data, size);
    assert_memory_equal(liar.out, data, size);
}

TEST(other_messages_are_true) {
    const struct node_finished_message finished = {.epoch = 3};
    for (int way = 0; way < HOST_LIES; way++) {
        begin((enum host_lie)way, 1);
        assert_int_equal(host_liar_alter(&liar, PEER, NODE_LOAN_ASK, NULL, 0),
                         0);
        assert_int_equal(host_liar_alter(&liar, CUBE_HOST, NODE_FINISHED,
                                         &finished, sizeof finished),
                         sizeof finished);
        assert_memory_equal(liar.out, &finished, sizeof finished);
        assert_int_equal(liar.pending, 0);
    }
}

/* --- what leaves ---------------------------------------------------------- */

/* A lie counts once its message has left. */
TEST(lies_are_counted) {
    uint8_t data[CUBE_PAYLOAD_MAX + NODE_RESULT_SLACK];
    struct cube cube = {.room = 0};
    struct node_counted counted = {.cube = &cube};
    size_t size = results(0, data);
    begin(HOST_LIE_DROP, 1);
    assert_int_equal(
        host_liar_write(&liar, &counted, CUBE_HOST, NODE_RESULT, data, size),
        CUBE_AGAIN);
    assert_int_equal(liar.told, 0);
    cube.room = 1;
    assert_int_equal(
        host_liar_write(&liar, &counted, CUBE_HOST, NODE_RESULT, data, size),
        0);
    assert_int_equal(liar.told, ROWS);
    assert_true(cube.size < size);
}

/* As many messages as the link takes, the true one never; each counted. */
TEST(floods_have_no_end) {
    uint8_t data[CUBE_PAYLOAD_MAX + NODE_RESULT_SLACK];
    struct cube cube = {.room = MESSAGES};
    struct node_counted counted = {.cube = &cube};
    struct node_spill_header spill;
    size_t size = results(0, data);
    struct seen seen;
    uint32_t v[4];
    row_of(0, 0, v);
    for (int way = HOST_LIE_FLOOD; way <= HOST_LIE_SPILLS; way++) {
        begin((enum host_lie)way, 1);
        cube.room = MESSAGES;
        cube.count = counted.sent = 0;
        while (cube.room > 0) {
            assert_int_equal(host_liar_write(&liar, &counted, CUBE_HOST,
                                             NODE_RESULT, data, size),
                             CUBE_AGAIN);
        }
        assert_int_equal(cube.count, MESSAGES);
        assert_int_equal(counted.sent, MESSAGES);
        if (way == HOST_LIE_FLOOD) {
            assert_int_equal(cube.type, NODE_RESULT);
            read_back(cube.data, cube.size, 0, &seen);
            assert_true(seen.rows >= ROWS && seen.commits == 0);
            assert_memory_equal(seen.row[seen.rows - 1], v, sizeof v);
        } else {
            assert_int_equal(cube.type, NODE_SPILL);
            memcpy(&spill, cube.data, sizeof spill);
            assert_int_equal(spill.epoch, 9);
            assert_int_equal(cube.size,
                             sizeof spill +
                                 spill.count * sizeof(struct incode_face));
            assert_memory_equal(cube.data + sizeof spill, v,
                                sizeof(struct incode_face));
        }
    }
}
