/* Tetrahedra as bytes: how finished stars and committed bricks travel from a
 * node to the host.
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
 * Memory: the caller's.  Work: about 3 ns a tetrahedron each way; a batch is
 * read whatever its bytes are, without reading past its end.
 *
 *     node_result_begin(&writer, buffer, sizeof buffer - NODE_RESULT_SLACK, 1);
 *     if (node_result_finder(&writer, 5))
 *         written = node_result_star(&writer, vertex, apexes, count);
 *     node_result_open(&reader, buffer, writer.size, vertices, 1, nodes);
 *     while (node_result_read(&reader, rows, 64, &count) == NODE_RESULT_ROWS)
 *         tetrahedra += count;
 */
#ifndef NODE_RESULT_H
#define NODE_RESULT_H

#include <stddef.h>
#include <stdint.h>

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

/* Returns 1, or 0 where it might not fit. */
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
    NODE_RESULT_GARBAGE /* not such a batch; reading is over */
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

#endif
