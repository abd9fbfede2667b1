/* Batches of tetrahedra: what is written is read, whatever the numbers; and
 * no bytes at all make the reader leave its buffer or invent vertices. */

#include "node/result.h"
#include "tests/unit/test.h"

enum { BATCH = 1592, STARS = 4000, APEXES = 40, NODES = 1000, SENDER = 3 };

static uint64_t state = 88172645463325252u;

static uint32_t draw(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32);
}

/* A vertex near `v` or anywhere below `vertices`. */
static uint32_t draw_near(uint32_t v, uint32_t vertices) {
    uint32_t bits = draw() % 33;
    uint32_t step = bits == 0 ? 0 : draw() >> (32 - bits);
    return (uint32_t)(((uint64_t)v + step) % vertices);
}

struct expected {
    uint32_t rows[STARS * APEXES][4];
    uint16_t finder[STARS * APEXES];
    size_t rows_count;
    uint32_t bricks[STARS];
    size_t bricks_at[STARS], bricks_count;
};

struct seen {
    size_t rows, bricks;
};

/* Reads a batch and compares it with what was written. */
static void compare(const struct expected *e, struct seen *seen,
                    const uint8_t *data, size_t size, uint32_t vertices,
                    size_t rows_max) {
    /* A copy without slack, so that a sanitizer sees reads past the end. */
    uint8_t *copy = malloc(size + 1);
    struct node_result_reader reader;
    uint32_t rows[64][4];
    size_t count;
    enum node_result_event event;
    assert_non_null(copy);
    memcpy(copy, data, size);
    node_result_open(&reader, copy, size, vertices, SENDER, NODES);
    do {
        event = node_result_read(&reader, rows, rows_max, &count);
        assert_int_not_equal(event, NODE_RESULT_GARBAGE);
        assert_true(count <= rows_max);
        assert_memory_equal(rows, e->rows[seen->rows], count * sizeof rows[0]);
        for (size_t i = 0; i < count; i++)
            assert_int_equal(reader.finder, e->finder[seen->rows + i]);
        seen->rows += count;
        if (event == NODE_RESULT_COMMIT) {
            assert_int_equal(reader.brick, e->bricks[seen->bricks]);
            assert_int_equal(seen->rows, e->bricks_at[seen->bricks]);
            seen->bricks++;
        }
    } while (event != NODE_RESULT_END);
    free(copy);
}

static void round_trip(uint32_t vertices, size_t rows_max) {
    static struct expected e;
    static uint8_t buffer[BATCH + NODE_RESULT_SLACK];
    struct node_result_writer writer;
    struct seen seen = {0, 0};
    uint16_t finder = SENDER;
    e.rows_count = e.bricks_count = 0;
    node_result_begin(&writer, buffer, BATCH, SENDER);
    for (size_t s = 0; s < STARS; s++) {
        uint32_t vertex = draw_near(0, vertices);
        uint32_t apexes[APEXES][3];
        size_t count = draw() % (APEXES + 1), done = 0;
        finder = draw() % 4 == 0 ? (uint16_t)(draw() % NODES) : finder;
        for (size_t i = 0; i < count; i++) {
            e.finder[e.rows_count] = finder;
            uint32_t *row = e.rows[e.rows_count++];
            row[0] = vertex;
            for (size_t k = 0; k < 3; k++)
                row[k + 1] = apexes[i][k] = draw_near(vertex, vertices);
        }
        while (done < count) {
            if (node_result_finder(&writer, finder)) {
                done += node_result_star(
                    &writer, vertex,
                    (const uint32_t(*)[3])(const void *)&apexes[done],
                    count - done);
            }
            if (done < count) {
                assert_true(writer.size <= BATCH);
                compare(&e, &seen, buffer, writer.size, vertices, rows_max);
                node_result_begin(&writer, buffer, BATCH, SENDER);
            }
        }
        e.bricks[e.bricks_count] = draw_near(vertex, vertices) / 64;
        e.bricks_at[e.bricks_count] = e.rows_count;
        e.bricks_count++;
        if (!node_result_commit(&writer, e.bricks[e.bricks_count - 1]))
            e.bricks_count--;
    }
    compare(&e, &seen, buffer, writer.size, vertices, rows_max);
    assert_int_equal(seen.rows, e.rows_count);
    assert_int_equal(seen.bricks, e.bricks_count);
}

TEST(test_round_trip) {
    static const uint32_t sizes[] = {1,       64,         1000,
                                     1 << 20, UINT32_MAX, 0x80000001u};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        round_trip(sizes[i], 64);
        round_trip(sizes[i], 1);
        round_trip(sizes[i], 7);
    }
}

/* Any bytes: an end, and only vertices in range. */
TEST(test_garbage) {
    for (size_t round = 0; round < 100000; round++) {
        size_t size = draw() % 100;
        uint8_t *data = malloc(size + 1);
        struct node_result_reader reader;
        uint32_t rows[16][4];
        size_t count, events = 0;
        enum node_result_event event;
        assert_non_null(data);
        for (size_t i = 0; i < size; i++) {
            data[i] = (uint8_t)draw();
            if (draw() % 2 == 0)
                data[i] &= 0xd5; /* small numbers and valid kinds */
        }
        node_result_open(&reader, data, size, 5000, 0, 9);
        do {
            event = node_result_read(&reader, rows, 16, &count);
            assert_true(++events <= size + 1);
            assert_true(event == NODE_RESULT_GARBAGE || reader.finder < 9);
            for (size_t i = 0; event != NODE_RESULT_GARBAGE && i < count; i++)
                for (size_t k = 0; k < 4; k++)
                    assert_true(rows[i][k] < 5000);
            if (event == NODE_RESULT_COMMIT)
                assert_true(reader.brick < 79);
        } while (event == NODE_RESULT_ROWS || event == NODE_RESULT_COMMIT);
        free(data);
    }
}

/* A batch cut short is garbage or a shorter batch, never other tetrahedra. */
TEST(test_truncated) {
    uint8_t buffer[200 + NODE_RESULT_SLACK];
    struct node_result_writer writer;
    const uint32_t apexes[3][3] = {{1, 2, 3}, {70000, 4, 5}, {6, 900, 7}};
    node_result_begin(&writer, buffer, 200, 0);
    assert_int_equal(node_result_star(&writer, 500, apexes, 3), 3);
    assert_int_equal(node_result_commit(&writer, 7), 1);
    for (size_t size = 0; size < writer.size; size++) {
        struct node_result_reader reader;
        uint32_t rows[4][4];
        size_t count;
        uint8_t *copy = malloc(size + 1);
        assert_non_null(copy);
        memcpy(copy, buffer, size);
        node_result_open(&reader, copy, size, 100000, 0, 1);
        enum node_result_event event =
            node_result_read(&reader, rows, 4, &count);
        assert_true(event == NODE_RESULT_END || event == NODE_RESULT_GARBAGE);
        for (size_t i = 0; i < count; i++) {
            assert_int_equal(rows[i][0], 500);
            assert_memory_equal(&rows[i][1], apexes[i], sizeof apexes[i]);
        }
        free(copy);
    }
}

/* Who found what, as it stands on the wire: a record where that changes, and
 * none for the sender's own. */
TEST(test_finders) {
    /* Of the sender, vertex 5 and 6, 7, 8; of node 9, the same, and of the next
     * vertex; of node 1000. */
    static const uint8_t expected[] = {0x01, 10,  0, 2, 4, 6, /**/
                                       0x27, 1,   0, 0, 2, 4, 6, 1, 2,
                                       0,    2,   4, 6, /**/
                                       0xff, 232, 3, 1, 0, 0, 2, 4, 6};
    static const uint32_t apexes[1][3] = {{6, 7, 8}}, next[1][3] = {{7, 8, 9}};
    uint8_t buffer[100 + NODE_RESULT_SLACK];
    struct node_result_writer writer;
    struct node_result_reader reader;
    uint32_t rows[8][4];
    size_t count;
    node_result_begin(&writer, buffer, 100, SENDER);
    assert_int_equal(node_result_finder(&writer, SENDER), 1);
    assert_int_equal(node_result_star(&writer, 5, apexes, 1), 1);
    assert_int_equal(node_result_finder(&writer, 9), 1);
    assert_int_equal(node_result_star(&writer, 5, apexes, 1), 1);
    assert_int_equal(node_result_finder(&writer, 9), 1);
    assert_int_equal(node_result_star(&writer, 6, next, 1), 1);
    assert_int_equal(node_result_finder(&writer, 1000), 1);
    assert_int_equal(node_result_star(&writer, 6, next, 1), 1);
    assert_int_equal(writer.size, sizeof expected);
    assert_memory_equal(buffer, expected, sizeof expected);
    node_result_open(&reader, buffer, writer.size, 100, SENDER, 1001);
    static const uint32_t finders[] = {SENDER, 9, 1000};
    for (unsigned i = 0; i < 3; i++) {
        assert_int_equal(node_result_read(&reader, rows, 8, &count),
                         i < 2 ? NODE_RESULT_ROWS : NODE_RESULT_END);
        assert_int_equal(count, i == 1 ? 2 : 1);
        assert_int_equal(reader.finder, finders[i]);
    }
    /* A node that there is not. */
    node_result_open(&reader, buffer, writer.size, 100, SENDER, 1000);
    (void)node_result_read(&reader, rows, 8, &count);
    (void)node_result_read(&reader, rows, 8, &count);
    assert_int_equal(node_result_read(&reader, rows, 8, &count),
                     NODE_RESULT_GARBAGE);
    /* None without a tetrahedron behind it. */
    node_result_begin(&writer, buffer, 20, SENDER);
    assert_int_equal(node_result_finder(&writer, 9), 0);
    assert_int_equal(writer.size, 0);
}
