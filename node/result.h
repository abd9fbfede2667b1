/* Tetrahedra as bytes: the form in which finished stars and committed bricks
 * travel from a node to the host.
 *
 * A batch is a row of records.  The first byte of a record is its head: bits
 * 0-1 the kind (0 tetrahedron, 1 star, 2 commit, 3 finder), then two bits for
 * each value that follows, its length in bytes less one; unused length bits are
 * 0.  Values are little-endian zigzag differences: a star's vertex from the
 * vertex before it in the batch (0 at its start), a tetrahedron's three apexes
 * from the star's vertex, a committed brick from the brick of that vertex.
 *
 * A finder record names the node that found the tetrahedra after it, up to the
 * next finder record or the end of the batch.  Tetrahedra before the first one
 * were found by the sender.  The node's number is in bits 2-7 of the head; 63
 * there means that it is in the two bytes behind.
 *
 * Work: about 3 ns a tetrahedron each way; a batch is read whatever its bytes
 * are, without reading past its end. */
#ifndef NODE_RESULT_H
#define NODE_RESULT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "message.h"

enum {
    NODE_RESULT_TETRAHEDRON_MAX = 13, /* bytes of a record, at most */
    NODE_RESULT_STAR_MAX = 5,
    NODE_RESULT_COMMIT_MAX = 5,
    NODE_RESULT_FINDER_MAX = 3,
    NODE_RESULT_SLACK = 4 /* bytes of a writer's buffer beyond its use */
};

struct node_result_writer {
    uint8_t *buffer;
    size_t size, size_max; /* bytes written; most that may be written */
    uint32_t vertex;
    uint16_t finder; /* of the tetrahedra written next */
};

/* buffer: size_max + NODE_RESULT_SLACK bytes; sender: the node whose batch it
 * is. */
void node_result_begin(struct node_result_writer *writer, uint8_t *buffer,
                       size_t size_max, uint16_t sender);

/* The tetrahedra written next were found by `node`.  Returns 1, or 0 if a
 * tetrahedron might not fit behind the record. */
int node_result_finder(struct node_result_writer *writer, uint16_t node);

/* Writes as many of the star's tetrahedra (vertex, apexes[i]) as are sure to
 * fit; returns how many. */
size_t node_result_star(struct node_result_writer *writer, uint32_t vertex,
                        const uint32_t (*apexes)[3], size_t count);

/* Returns 1, or 0 if the record might not fit. */
int node_result_commit(struct node_result_writer *writer, uint32_t brick);

struct node_result_reader {
    const uint8_t *next, *end;
    uint32_t vertex, vertices; /* vertex numbers must be below `vertices` */
    uint32_t brick;            /* after NODE_RESULT_COMMIT */
    uint32_t finder, nodes;    /* of the rows read last; below `nodes` */
    int in_star;
};

enum node_result_event {
    NODE_RESULT_ROWS,   /* `*count` rows, perhaps few or 0; read on */
    NODE_RESULT_COMMIT, /* `*count` rows, and then reader->brick committed */
    NODE_RESULT_END,    /* `*count` rows, the last */
    NODE_RESULT_GARBAGE /* not a batch; reading is over */
};

/* sender: below `nodes`. */
void node_result_open(struct node_result_reader *reader, const uint8_t *data,
                      size_t size, uint32_t vertices, uint32_t sender,
                      uint32_t nodes);

/* Reads up to rows_max tetrahedra as rows of four vertex numbers, all of them
 * found by the node reader->finder. */
enum node_result_event node_result_read(struct node_result_reader *reader,
                                        uint32_t (*rows)[4], size_t rows_max,
                                        size_t *count);

/* The outbox: messages of a node that wait for credit or for room on their
 * link, in a ring of buffers that are filled in place and leave in order.
 *
 * Memory: NODE_OUTBOX_BYTES(slots), from the node's arena. */

struct node_outbox_slot {
    uint16_t size;
    uint8_t type;
    uint8_t reserved;
    uint8_t data[CUBE_PAYLOAD_MAX + 4]; /* 4: slack of result.h's writer */
};

struct node_outbox {
    struct node_outbox_slot *slots;
    uint32_t slot_count, first, used; /* closed slots, in order from first */
    uint32_t used_max;
};

#define NODE_OUTBOX_BYTES(slots) ((slots) * sizeof(struct node_outbox_slot))

void node_outbox_init(struct node_outbox *box, void *memory, uint32_t slots);

/* Slots that are neither closed nor waiting. */
static inline uint32_t node_outbox_free(const struct node_outbox *box) {
    return box->slot_count - box->used;
}

/* The buffer of the next message, the same until it is closed.  There must be a
 * free slot. */
uint8_t *node_outbox_open(struct node_outbox *box);
void node_outbox_close(struct node_outbox *box, uint8_t type, size_t size);

/* The oldest closed message, or NULL. */
struct node_outbox_slot *node_outbox_first(const struct node_outbox *box);
void node_outbox_drop(struct node_outbox *box);

/* Sums of statistics: over the jobs, the roles and the starts of a node. */

/* Counters add up; high waters are those of the higher.  `epoch` and `start`
 * stay. */
void node_totals_add(struct node_finished_message *sum,
                     const struct node_finished_message *more);

#endif
