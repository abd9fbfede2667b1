#include "result.h"

#include <stdbool.h>
#include <string.h>

#include "incode/pages/bricks.h"
#include "incode/predicates/check.h"

enum { KIND_TETRAHEDRON, KIND_STAR, KIND_COMMIT, KIND_FINDER };
enum { FINDER_FOLLOWS = 63 /* in a finder's head */ };

static inline uint32_t zigzag(uint32_t difference) {
    return (difference << 1) ^ (0u - (difference >> 31));
}

static inline uint32_t unzigzag(uint32_t value) {
    return (value >> 1) ^ (0u - (value & 1));
}

/* Length of a value in bytes, less one. */
static inline uint32_t length_of(uint32_t value) {
    return (31u - (uint32_t)__builtin_clz(value | 1)) >> 3;
}

/* Writes all four bytes; the next value overwrites those not counted.  Hence
 * the slack at the end of a buffer. */
static inline uint8_t *put(uint8_t *at, uint32_t value, uint32_t length) {
    memcpy(at, &value, 4);
    return at + length + 1;
}

void node_result_begin(struct node_result_writer *writer, uint8_t *buffer,
                       size_t size_max, uint16_t sender) {
    writer->buffer = buffer;
    writer->size = 0;
    writer->size_max = size_max;
    writer->vertex = 0;
    writer->finder = sender;
}

static void put_single(struct node_result_writer *writer, uint32_t kind,
                       uint32_t difference) {
    uint32_t value = zigzag(difference);
    uint32_t length = length_of(value);
    uint8_t *at = writer->buffer + writer->size;
    *at = (uint8_t)(kind | length << 2);
    writer->size = (size_t)(put(at + 1, value, length) - writer->buffer);
}

int node_result_finder(struct node_result_writer *writer, uint16_t node) {
    if (node == writer->finder)
        return 1;
    if (writer->size_max - writer->size < NODE_RESULT_FINDER_MAX +
                                              NODE_RESULT_STAR_MAX +
                                              NODE_RESULT_TETRAHEDRON_MAX)
        return 0;
    uint8_t *at = writer->buffer + writer->size;
    bool follows = node >= FINDER_FOLLOWS;
    *at = (uint8_t)(KIND_FINDER | (follows ? FINDER_FOLLOWS : node) << 2);
    memcpy(at + 1, &node, sizeof node); /* bytes past size do not count */
    writer->size += follows ? 1 + sizeof node : 1;
    writer->finder = node;
    return 1;
}

size_t node_result_star(struct node_result_writer *writer, uint32_t vertex,
                        const uint32_t (*apexes)[3], size_t count) {
    size_t room = writer->size_max - writer->size;
    if (room < NODE_RESULT_STAR_MAX + NODE_RESULT_TETRAHEDRON_MAX || count == 0)
        return 0;
    room = (room - NODE_RESULT_STAR_MAX) / NODE_RESULT_TETRAHEDRON_MAX;
    if (count > room)
        count = room;
    put_single(writer, KIND_STAR, vertex - writer->vertex);
    writer->vertex = vertex;
    uint8_t *at = writer->buffer + writer->size;
    for (size_t i = 0; i < count; i++) {
        uint32_t a = zigzag(apexes[i][0] - vertex);
        uint32_t b = zigzag(apexes[i][1] - vertex);
        uint32_t c = zigzag(apexes[i][2] - vertex);
        uint32_t la = length_of(a), lb = length_of(b), lc = length_of(c);
        *at = (uint8_t)(KIND_TETRAHEDRON | la << 2 | lb << 4 | lc << 6);
        at = put(put(put(at + 1, a, la), b, lb), c, lc);
    }
    writer->size = (size_t)(at - writer->buffer);
    return count;
}

int node_result_commit(struct node_result_writer *writer, uint32_t brick) {
    if (writer->size_max - writer->size < NODE_RESULT_COMMIT_MAX)
        return 0;
    put_single(writer, KIND_COMMIT,
               brick - writer->vertex / INCODE_BRICK_POINTS);
    return 1;
}

void node_result_open(struct node_result_reader *reader, const uint8_t *data,
                      size_t size, uint32_t vertices, uint32_t sender,
                      uint32_t nodes) {
    reader->next = data;
    reader->end = data + size;
    reader->vertex = 0;
    reader->vertices = vertices;
    reader->brick = 0;
    reader->finder = sender;
    reader->nodes = nodes;
    reader->in_star = 0;
}

static inline uint32_t get(const uint8_t *at, uint32_t length) {
    static const uint32_t mask[4] = {0xff, 0xffff, 0xffffff, 0xffffffff};
    uint32_t value;
    memcpy(&value, at, 4);
    return unzigzag(value & mask[length]);
}

/* A tetrahedron whose head is at `at`, four readable bytes beyond each value.
 * Returns the address of the next record. */
static inline const uint8_t *get_row(const uint8_t *at, uint32_t vertex,
                                     uint32_t row[4]) {
    uint32_t head = *at++;
    uint32_t la = head >> 2 & 3, lb = head >> 4 & 3, lc = head >> 6;
    row[0] = vertex;
    row[1] = vertex + get(at, la);
    row[2] = vertex + get(at + la + 1, lb);
    row[3] = vertex + get(at + la + lb + 2, lc);
    return at + la + lb + lc + 3;
}

static inline bool row_in_range(const uint32_t row[4], uint32_t vertices) {
    return (row[1] < vertices) & (row[2] < vertices) & (row[3] < vertices);
}

/* Size of the record with this head, or 0 where no record has such a head. */
static size_t record_size(uint32_t head) {
    size_t first = 2 + (head >> 2 & 3);
    if ((head & 3) == KIND_TETRAHEDRON)
        return first + 2 + (head >> 4 & 3) + (head >> 6);
    if ((head & 3) == KIND_FINDER)
        return head >> 2 == FINDER_FOLLOWS ? 3 : 1;
    return head >> 4 == 0 ? first : 0;
}

/* One record near the end of the batch, by way of a padded copy.  Returns its
 * size, 0 for garbage; *rows_read becomes 1 for a tetrahedron. */
static size_t read_slowly(struct node_result_reader *reader, uint32_t row[4],
                          size_t *rows_read, int *committed) {
    uint8_t copy[NODE_RESULT_TETRAHEDRON_MAX + 4] = {0};
    size_t left = (size_t)(reader->end - reader->next);
    size_t size = record_size(*reader->next);
    if (size == 0 || size > left)
        return 0;
    memcpy(copy, reader->next, size);
    uint32_t kind = copy[0] & 3;
    if (kind == KIND_TETRAHEDRON) {
        if (!reader->in_star)
            return 0;
        (void)get_row(copy, reader->vertex, row);
        *rows_read = 1;
        return row_in_range(row, reader->vertices) ? size : 0;
    }
    if (kind == KIND_FINDER) {
        reader->finder =
            size == 1 ? copy[0] >> 2 : copy[1] | (uint32_t)copy[2] << 8;
        return reader->finder < reader->nodes ? size : 0;
    }
    uint32_t difference = get(copy + 1, copy[0] >> 2 & 3);
    if (kind == KIND_STAR) {
        reader->vertex += difference;
        reader->in_star = 1;
        return reader->vertex < reader->vertices ? size : 0;
    }
    reader->brick = reader->vertex / INCODE_BRICK_POINTS + difference;
    *committed = 1;
    return reader->brick <= (reader->vertices - 1) / INCODE_BRICK_POINTS ? size
                                                                         : 0;
}

/* Tetrahedra one after another while none can reach past the end. */
static size_t read_fast(struct node_result_reader *reader, uint32_t (*rows)[4],
                        size_t rows_max, bool *good) {
    const uint8_t *at = reader->next;
    const uint8_t *safe = reader->end - (NODE_RESULT_TETRAHEDRON_MAX + 3);
    size_t count = 0;
    while (count < rows_max && at < safe && (*at & 3) == KIND_TETRAHEDRON) {
        at = get_row(at, reader->vertex, rows[count]);
        *good &= row_in_range(rows[count], reader->vertices);
        count++;
    }
    reader->next = at;
    return count;
}

enum node_result_event node_result_read(struct node_result_reader *reader,
                                        uint32_t (*rows)[4], size_t rows_max,
                                        size_t *count) {
    *count = 0;
    while (reader->next != reader->end) {
        size_t rows_read = 0;
        int committed = 0;
        bool good = true;
        if (*count == rows_max)
            return NODE_RESULT_ROWS;
        if (reader->in_star &&
            reader->end - reader->next > NODE_RESULT_TETRAHEDRON_MAX + 3) {
            *count +=
                read_fast(reader, rows + *count, rows_max - *count, &good);
            if (!good)
                return NODE_RESULT_GARBAGE;
            if (*count == rows_max)
                continue;
        }
        if (*count > 0 && (*reader->next & 3) == KIND_FINDER)
            return NODE_RESULT_ROWS; /* they have the finder before */
        size_t size = read_slowly(reader, rows[*count], &rows_read, &committed);
        if (size == 0)
            return NODE_RESULT_GARBAGE;
        reader->next += size;
        *count += rows_read;
        if (committed)
            return NODE_RESULT_COMMIT;
    }
    return NODE_RESULT_END;
}

/* --- outbox --------------------------------------------------------------- */

void node_outbox_init(struct node_outbox *box, void *memory, uint32_t slots) {
    box->slots = memory;
    box->slot_count = slots;
    box->first = 0;
    box->used = 0;
    box->used_max = 0;
}

uint8_t *node_outbox_open(struct node_outbox *box) {
    INCODE_ASSERT(box->used < box->slot_count);
    return box->slots[(box->first + box->used) % box->slot_count].data;
}

void node_outbox_close(struct node_outbox *box, uint8_t type, size_t size) {
    INCODE_ASSERT(box->used < box->slot_count);
    INCODE_ASSERT(size <= CUBE_PAYLOAD_MAX);
    struct node_outbox_slot *slot =
        &box->slots[(box->first + box->used) % box->slot_count];
    slot->type = type;
    slot->size = (uint16_t)size;
    box->used++;
    if (box->used > box->used_max)
        box->used_max = box->used;
}

struct node_outbox_slot *node_outbox_first(const struct node_outbox *box) {
    return box->used == 0 ? NULL : &box->slots[box->first];
}

void node_outbox_drop(struct node_outbox *box) {
    INCODE_ASSERT(box->used > 0);
    box->first = (box->first + 1) % box->slot_count;
    box->used--;
}

/* --- totals --------------------------------------------------------------- */

enum { WORDS = sizeof(struct incode_statistics) / sizeof(uint64_t) };

static_assert(sizeof(struct incode_statistics) == WORDS * sizeof(uint64_t),
              "statistics are counters of 64 bits");

static uint64_t higher(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

static uint32_t most(uint32_t a, uint32_t b) {
    return a > b ? a : b;
}

static void add_statistics(struct incode_statistics *sum,
                           const struct incode_statistics *more) {
    uint64_t a[WORDS], b[WORDS];
    uint64_t afl_max = higher(sum->afl_max, more->afl_max);
    uint64_t high_water =
        higher(sum->memory_high_water, more->memory_high_water);
    memcpy(a, sum, sizeof a);
    memcpy(b, more, sizeof b);
    for (unsigned i = 0; i < WORDS; i++)
        a[i] += b[i];
    memcpy(sum, a, sizeof a);
    sum->afl_max = afl_max;
    sum->memory_high_water = high_water;
}

void node_totals_add(struct node_finished_message *sum,
                     const struct node_finished_message *more) {
    sum->wall_us += more->wall_us;
    sum->busy_us += more->busy_us;
    sum->bytes_in += more->bytes_in;
    sum->bytes_out += more->bytes_out;
    sum->pages_held += more->pages_held;
    sum->pages_forwarded += more->pages_forwarded;
    sum->retransmitted += more->retransmitted;
    sum->memory_high_water =
        higher(sum->memory_high_water, more->memory_high_water);
    sum->stack_bytes = most(sum->stack_bytes, more->stack_bytes);
    sum->stack_high_water = most(sum->stack_high_water, more->stack_high_water);
    sum->overruns += more->overruns;
    sum->look_us_max = most(sum->look_us_max, more->look_us_max);
    add_statistics(&sum->statistics, &more->statistics);
}
