#include "liar.h"

#include <string.h>

#include "node/common.h"
#include "sim_draw.h"
#include "transport/tuples/tuples.h"

enum {
    AT_ONCE = 8, /* messages of a flood, as the link takes them */
    TRIES = 16,  /* to draw a vertex that differs */
    STAR = 64    /* tetrahedra of a star's record */
};

const char *const host_lies[HOST_LIES] = {
    [HOST_LIE_DROP] = "drop",     [HOST_LIE_EXCHANGE] = "exchange",
    [HOST_LIE_REPEAT] = "repeat", [HOST_LIE_INVENT] = "invent",
    [HOST_LIE_PAGE] = "page",     [HOST_LIE_LOAN] = "loan",
    [HOST_LIE_FLOOD] = "flood",   [HOST_LIE_SPILLS] = "spill-flood",
};

static uint32_t draw(struct host_liar *l, uint32_t lo, uint32_t hi) {
    return (uint32_t)host_sim_draw(&l->random, lo, hi);
}

static bool is_due(struct host_liar *l) {
    return draw(l, 1, l->one_in) == 1;
}

/* ---- a lie about a row --------------------------------------------------- */

/* What a message tells: rows of three or four vertices. */
struct table {
    const uint32_t *v;
    uint32_t rows, width;
    uint32_t face; /* vertices of a row that were not for the node to find */
    bool fixed;    /* the receiver knows how many rows come */
};

/* A vertex of another row, or INCODE_NONE: none differs from those of v. */
static uint32_t another(struct host_liar *l, const struct table *t,
                        const uint32_t *v, uint32_t width) {
    for (unsigned i = 0; i < TRIES; i++) {
        uint32_t other = t->v[draw(l, 0, t->rows * t->width - 1)];
        bool differs = other != INCODE_NONE;
        for (uint32_t k = 0; k < width; k++)
            differs = differs && other != v[k];
        if (differs)
            return other;
    }
    return INCODE_NONE;
}

/* Puts another vertex in the place of v[k]; false: there is none. */
static bool replace(struct host_liar *l, const struct table *t, uint32_t *v,
                    uint32_t k) {
    uint32_t other = another(l, t, v, t->width);
    v[k] = other != INCODE_NONE ? other : v[k];
    return other != INCODE_NONE;
}

static bool take_next(const struct table *t, uint32_t i, uint32_t v[4]) {
    uint32_t next = i + 1 < t->rows ? i + 1 : 0;
    bool differs = memcmp(v, t->v + next * t->width, t->width * sizeof *v) != 0;
    memcpy(v, t->v + next * t->width, t->width * sizeof *v);
    return differs;
}

/* The lies, each about row i, of which *said is a copy: how many rows are said
 * in its place.  Where the receiver counts rows, that is one.  A face whose
 * apex is left out is said to be one of the hull. */
static uint32_t drop(struct host_liar *l, const struct table *t, uint32_t i,
                     uint32_t (*said)[4]) {
    bool lies = true;
    if (t->fixed && t->face == 3) {
        lies = said[0][3] != INCODE_NONE;
        said[0][3] = INCODE_NONE;
    } else if (t->fixed) {
        lies = take_next(t, i, said[0]);
    }
    l->pending += lies;
    return t->fixed;
}

static uint32_t exchange(struct host_liar *l, const struct table *t,
                         uint32_t (*said)[4]) {
    uint32_t *v = said[0], k = draw(l, t->face, 3);
    if (v[k] == INCODE_NONE || !replace(l, t, v, k))
        return 1;
    if (t->face < 3 && v[3] != INCODE_NONE && draw(l, 0, 1) == 1) {
        uint32_t second = v[2];
        v[2] = v[3];
        v[3] = second;
    }
    l->pending++;
    return 1;
}

static uint32_t repeat(struct host_liar *l, const struct table *t, uint32_t i,
                       uint32_t (*said)[4]) {
    if (t->fixed) {
        l->pending += take_next(t, i, said[0]);
        return 1;
    }
    bool before = l->keeps && t->face == 1 && draw(l, 0, 1) == 1;
    memcpy(said[1], before ? l->kept : said[0], sizeof said[1]);
    l->pending++;
    return 2;
}

static uint32_t invent(struct host_liar *l, const struct table *t,
                       uint32_t (*said)[4]) {
    bool hull = said[0][3] == INCODE_NONE, lies = hull || t->face < 3;
    memcpy(said[1], said[0], sizeof said[1]);
    for (uint32_t k = hull ? 3 : 1; k < 4; k++)
        lies = lies && replace(l, t, said[1], k);
    if (lies && t->fixed)
        memcpy(said[0], said[1], sizeof said[0]);
    l->pending += lies;
    return lies && !t->fixed ? 2 : 1;
}

static uint32_t lend(struct host_liar *l, const struct table *t,
                     uint32_t (*said)[4]) {
    bool hull = t->width == 4 && said[0][3] == INCODE_NONE;
    l->pending += replace(l, t, said[0], draw(l, 0, hull ? 2 : t->width - 1));
    return 1;
}

/* What is said instead of row i: 0 to 2 rows. */
static uint32_t say(struct host_liar *l, const struct table *t, uint32_t i,
                    uint32_t (*said)[4]) {
    memcpy(said[0], t->v + i * t->width, t->width * sizeof said[0][0]);
    if (!is_due(l))
        return 1;
    switch (l->way) {
    case HOST_LIE_DROP:
        return drop(l, t, i, said);
    case HOST_LIE_EXCHANGE:
        return exchange(l, t, said);
    case HOST_LIE_REPEAT:
        return repeat(l, t, i, said);
    case HOST_LIE_INVENT:
        return invent(l, t, said);
    case HOST_LIE_LOAN:
        return lend(l, t, said);
    default:
        return 1;
    }
}

/* ---- results ------------------------------------------------------------- */

static bool read_results(struct host_liar *l, const uint8_t *data,
                         size_t size) {
    const size_t head = sizeof(struct node_result_header);
    struct node_result_reader reader;
    enum node_result_event event = NODE_RESULT_ROWS;
    l->rows = l->commits = 0;
    if (size < head)
        return false;
    node_result_open(&reader, data + head, size - head, UINT32_MAX,
                     HOST_LIAR_SELF, HOST_LIAR_SELF);
    while (event == NODE_RESULT_ROWS || event == NODE_RESULT_COMMIT) {
        size_t count;
        event = node_result_read(&reader, l->row + l->rows,
                                 HOST_LIAR_ROWS - l->rows, &count);
        for (; count > 0; count--)
            l->finder[l->rows++] = (uint16_t)reader.finder;
        if (event == NODE_RESULT_COMMIT) {
            l->commit[l->commits].after = l->rows;
            l->commit[l->commits++].brick = reader.brick;
        }
    }
    return event == NODE_RESULT_END;
}

/* Writes rows as they come, those of a vertex as one star. */
struct stars {
    struct node_result_writer writer;
    uint32_t vertex, count;
    uint32_t apex[STAR][3];
    bool full; /* something did not fit */
};

static void end_star(struct stars *s) {
    size_t written = node_result_star(&s->writer, s->vertex, s->apex, s->count);
    s->full = s->full || written != s->count;
    s->count = 0;
}

static void put_row(struct stars *s, const uint32_t v[4], uint16_t finder) {
    if (v[0] != s->vertex || s->count == STAR || finder != s->writer.finder)
        end_star(s);
    s->full = s->full || !node_result_finder(&s->writer, finder);
    s->vertex = v[0];
    memcpy(s->apex[s->count++], v + 1, sizeof s->apex[0]);
}

static void put_commit(struct stars *s, uint32_t brick) {
    end_star(s);
    s->full = s->full || !node_result_commit(&s->writer, brick);
}

static void begin_results(struct host_liar *l, struct stars *s,
                          const uint8_t *data) {
    const size_t head = sizeof(struct node_result_header);
    memcpy(l->out, data, head);
    s->vertex = s->count = 0;
    s->full = false;
    node_result_begin(&s->writer, l->out + head, CUBE_PAYLOAD_MAX - head,
                      HOST_LIAR_SELF);
}

/* The size of what is written; 0: it did not fit. */
static size_t end_results(struct stars *s) {
    end_star(s);
    return s->full ? 0 : sizeof(struct node_result_header) + s->writer.size;
}

static size_t alter_results(struct host_liar *l, const uint8_t *data,
                            size_t size) {
    struct stars stars;
    uint32_t said[2][4], commits = 0;
    if (!read_results(l, data, size) || l->rows == 0)
        return 0;
    const struct table table = {l->row[0], l->rows, 4, 1, false};
    begin_results(l, &stars, data);
    for (uint32_t i = 0; i <= l->rows; i++) {
        while (commits < l->commits && l->commit[commits].after == i)
            put_commit(&stars, l->commit[commits++].brick);
        uint32_t count = i < l->rows ? say(l, &table, i, said) : 0;
        for (uint32_t k = 0; k < count; k++)
            put_row(&stars, said[k], l->finder[i]);
    }
    memcpy(l->kept, l->row[draw(l, 0, l->rows - 1)], sizeof l->kept);
    l->keeps = true;
    return end_results(&stars);
}

/* ---- what nodes send each other ------------------------------------------ */

/* Says the table anew from liar->out + at on, rows_max rows at most; how many.
 */
static uint32_t say_all(struct host_liar *l, const struct table *t, size_t at,
                        uint32_t rows_max) {
    uint32_t said[2][4], rows = 0;
    size_t bytes = t->width * sizeof said[0][0];
    for (uint32_t i = 0; i < t->rows; i++) {
        uint32_t count = say(l, t, i, said);
        for (uint32_t k = 0; k < count && rows < rows_max; k++)
            memcpy(l->out + at + rows++ * bytes, said[k], bytes);
    }
    return rows;
}

/* Reads rows of a message from byte `at` on. */
static struct table table_of(struct host_liar *l, const uint8_t *data,
                             size_t at, uint32_t rows, uint32_t width) {
    struct table t = {l->row[0], rows, width, 0, true};
    memcpy(l->row, data + at, rows * width * sizeof(uint32_t));
    return t;
}

static bool lies_of_findings(const struct host_liar *l) {
    return l->way <= HOST_LIE_INVENT;
}

/* Answers keep their number, in the order of the list. */
static void alter_answers(struct host_liar *l, const uint8_t *data, size_t size,
                          size_t at) {
    const size_t head = offsetof(struct incode_answers, v);
    uint16_t kind; /* in a list, the low half of it */
    uint32_t count;
    memcpy(&kind, data, sizeof kind);
    memcpy(&count, data + offsetof(struct incode_answers, count), sizeof count);
    if (lies_of_findings(l) && kind != INCODE_LIST_COUNT && count > 0 &&
        count <= INCODE_LIST_MAX && size == incode_answers_bytes(count)) {
        struct table t = table_of(l, data, head, count, 4);
        t.face = kind == INCODE_LIST_FACES ? 3 : 1;
        (void)say_all(l, &t, at + head, count);
    } else if (l->way == HOST_LIE_LOAN && kind == INCODE_LIST_FACES &&
               count > 0 && count <= INCODE_LIST_MAX &&
               size == incode_list_bytes(count)) {
        struct table t = table_of(l, data, head, count, 3);
        (void)say_all(l, &t, at + head, count);
    }
}

/* Of a list or answers in a tuple. */
static void alter_tuples(struct host_liar *l, const uint8_t *data,
                         size_t size) {
    struct tuple tuple;
    if (size <= TUPLES_HEADER_BYTES ||
        !tuple_read(&tuple, data + TUPLES_HEADER_BYTES,
                    size - TUPLES_HEADER_BYTES))
        return;
    const struct tuple_field *f = &tuple.field[tuple.count - 1];
    if (f->type == TUPLE_TYPE_BYTES && !f->formal &&
        f->size >= offsetof(struct incode_list, v)) {
        const uint8_t *bytes = f->as.bytes;
        alter_answers(l, bytes, f->size, (size_t)(bytes - data));
    }
}

static void alter_loan(struct host_liar *l, const uint8_t *data) {
    struct incode_loan loan;
    const size_t head = offsetof(struct incode_loan, v);
    memcpy(&loan, data, head);
    if (l->way == HOST_LIE_LOAN && loan.count > 0) {
        struct table t = table_of(l, data, head, loan.count, 3);
        (void)say_all(l, &t, head, loan.count);
    }
}

static size_t alter_found(struct host_liar *l, const uint8_t *data,
                          size_t size) {
    struct node_found_message found;
    const size_t head = offsetof(struct node_found_message, found.v);
    memcpy(&found, data, head);
    if (found.found.count == 0)
        return size;
    struct table t = table_of(l, data, head, found.found.count, 4);
    t.face = 3;
    t.fixed = l->way == HOST_LIE_LOAN;
    found.found.count = say_all(l, &t, head, INCODE_LOAN_FACES);
    memcpy(l->out, &found, head);
    return node_found_bytes(&found);
}

/* Who sends it counts what it sends: there are as many. */
static void alter_shared(struct host_liar *l, const uint8_t *data,
                         size_t size) {
    uint32_t rows = (uint32_t)(size / sizeof(struct node_shared));
    if (rows > 0) {
        struct table t = table_of(l, data, 0, rows, 4);
        (void)say_all(l, &t, 0, rows);
    }
}

static bool is_repeated(const double *x, uint32_t i) {
    uint64_t a, b;
    memcpy(&a, &x[i], sizeof a);
    memcpy(&b, &x[i - 1], sizeof b);
    return a == b;
}

/* The last point is repeated behind it. */
static uint32_t points_of(const struct incode_brick *brick) {
    uint32_t last = INCODE_BRICK_POINTS - 1;
    while (last > 0 && is_repeated(brick->x, last) &&
           is_repeated(brick->y, last) && is_repeated(brick->z, last))
        last--;
    return last + 1;
}

/* Moves a point of a brick, whose tag stays as it is: by a rounding, to another
 * point's coordinate, or far away. */
static void alter_page(struct host_liar *l, size_t size) {
    struct incode_brick brick;
    const size_t head = offsetof(struct node_page_message, data);
    if (size != head + sizeof brick || !is_due(l))
        return;
    memcpy(&brick, l->out + head, sizeof brick);
    uint32_t last = points_of(&brick) - 1, slot = draw(l, 0, last);
    double *const axes[3] = {brick.x, brick.y, brick.z};
    double *x = axes[draw(l, 0, 2)], before = x[slot];
    uint64_t bits;
    switch (draw(l, 0, 2)) {
    case 0:
        memcpy(&bits, &before, sizeof bits);
        bits ^= 1;
        memcpy(&x[slot], &bits, sizeof bits);
        break;
    case 1:
        x[slot] = x[draw(l, 0, last)];
        break;
    default:
        x[slot] = 2 * before + 1;
    }
    l->pending += x[slot] < before || x[slot] > before;
    memcpy(l->out + head, &brick, sizeof brick);
}

size_t host_liar_alter(struct host_liar *liar, uint16_t dest, uint8_t type,
                       const void *data, size_t size) {
    struct host_liar *l = liar;
    size_t altered = size;
    l->pending = 0;
    if (type == NODE_RESULT && lies_of_findings(l))
        altered = alter_results(l, data, size);
    if (type != NODE_RESULT || altered == 0 || l->pending == 0) {
        l->pending = 0;
        altered = size;
        if (size > 0)
            memcpy(l->out, data, size);
    }
    if (type == NODE_LIST || type == NODE_ANSWERS)
        alter_answers(l, data, size, 0);
    else if (type == NODE_TUPLES)
        alter_tuples(l, data, size);
    else if (type == NODE_LOAN)
        alter_loan(l, data);
    else if (type == NODE_LOAN_FOUND)
        altered = alter_found(l, data, size);
    else if (type == NODE_SHARE)
        alter_shared(l, data, size);
    else if (type == NODE_PAGE && dest != CUBE_HOST && l->way == HOST_LIE_PAGE)
        alter_page(l, size);
    return altered;
}

/* ---- floods -------------------------------------------------------------- */

/* A message full of the first tetrahedron, or of a face of it. */
static size_t flood(struct host_liar *l, const struct node_counted *counted,
                    const uint8_t *data) {
    struct node_result_header head;
    struct stars stars;
    memcpy(&head, data, sizeof head);
    head.sent = counted->sent;
    l->pending = 0;
    if (l->way == HOST_LIE_SPILLS) {
        struct node_spill_header spill = {.epoch = head.epoch,
                                          .count = NODE_FACES_A_MESSAGE};
        memcpy(l->out, &spill, sizeof spill);
        for (; l->pending < spill.count; l->pending++) {
            memcpy(l->out + sizeof spill +
                       l->pending * sizeof(struct incode_face),
                   l->kept, sizeof(struct incode_face));
        }
        return sizeof spill + spill.count * sizeof(struct incode_face);
    }
    begin_results(l, &stars, (const uint8_t *)&head);
    while (stars.writer.size + (STAR + 2) * NODE_RESULT_TETRAHEDRON_MAX <=
           stars.writer.size_max) {
        do {
            put_row(&stars, l->kept, HOST_LIAR_SELF);
            l->pending++;
        } while (stars.count < STAR);
        end_star(&stars);
    }
    return end_results(&stars);
}

/* Whether the host is flooded from this message on. */
static bool begins_flood(struct host_liar *l, const uint8_t *data,
                         size_t size) {
    if (read_results(l, data, size) && l->rows > 0) {
        memcpy(l->kept, l->row[0], sizeof l->kept);
        l->keeps = true;
        for (uint32_t i = 0; i < l->rows && !l->floods; i++)
            l->floods = is_due(l);
    }
    return l->floods && l->keeps;
}

int host_liar_write(struct host_liar *liar, struct node_counted *counted,
                    uint16_t dest, uint8_t type, const void *data,
                    size_t size) {
    struct host_liar *l = liar;
    bool floods = l->way == HOST_LIE_FLOOD || l->way == HOST_LIE_SPILLS;
    if (!floods || type != NODE_RESULT || !begins_flood(l, data, size)) {
        size_t altered = host_liar_alter(l, dest, type, data, size);
        int status = cube_write(counted->cube, dest, type, l->out, altered);
        l->told += status == 0 ? l->pending : 0;
        return status;
    }
    uint8_t lie = l->way == HOST_LIE_FLOOD ? NODE_RESULT : NODE_SPILL;
    for (unsigned i = 0; i < AT_ONCE; i++) {
        size_t bytes = flood(l, counted, data);
        if (cube_write(counted->cube, CUBE_HOST, lie, l->out, bytes) != 0)
            break;
        counted->sent++;
        l->told += l->pending;
    }
    return CUBE_AGAIN;
}
