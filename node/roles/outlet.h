/* The messages of a role with a front to the host: finished tetrahedra and
 * commits under credit, and spilled faces, which come back.  It is the front's
 * struct incode_front_outside (incode/front/job.h). */
#ifndef NODE_OUTLET_H
#define NODE_OUTLET_H

#include "incode/front/job.h"
#include "node/common.h"
#include "node/result.h"

struct node_outlet {
    struct node_counted *counted;
    struct node_fault *fault;
    uint32_t epoch;             /* of the job */
    uint16_t finder;            /* of the tetrahedra emitted now */
    struct node_outbox results; /* leave under credit */
    uint32_t credit, sent;      /* results allowed, results sent */
    struct node_result_writer writer;
    bool open;                 /* writer fills a slot of results */
    struct node_outbox spills; /* leave as the link takes them */
    uint32_t spill_count;      /* faces in the open message of spills */
    uint64_t bytes_out;
};

/* Bytes for a role whose arena, or whole memory, has so many bytes. */
size_t node_outlet_bytes(size_t bytes);

/* memory: aligned to NODE_ALIGNMENT, node_outlet_bytes(bytes) of it.  counted
 * and fault stay. */
void node_outlet_init(struct node_outlet *outlet, void *memory, size_t bytes,
                      const struct node_setup_message *setup,
                      struct node_counted *counted, struct node_fault *fault);

/* As a front sees it. */
struct incode_front_outside node_outlet_outside(struct node_outlet *outlet);

/* A job begins: messages from now on have its epoch. */
void node_outlet_begin(struct node_outlet *outlet, uint32_t epoch);

/* The tetrahedra that the front emits from now on were found by that node;
 * before the first call, by this node. */
void node_outlet_found_by(struct node_outlet *outlet, uint16_t node);

/* Whether there is room for the results of a step.  Without room, a front
 * waits. */
bool node_outlet_has_room(const struct node_outlet *outlet);

/* There are no more results: their last message may leave. */
void node_outlet_close(struct node_outlet *outlet);

/* NODE_CREDIT; an unsound message is a fault. */
void node_outlet_take_credit(struct node_outlet *outlet, const uint8_t *data,
                             size_t size);

/* NODE_UNSPILL: true with *header and its faces, for incode_front_unspill.
 * False: it is of another job, or unsound, which is a fault. */
bool node_outlet_take_unspill(struct node_outlet *outlet, const uint8_t *data,
                              size_t size, struct node_spill_header *header,
                              struct incode_face faces[NODE_FACES_A_MESSAGE]);

/* The front has refused the faces: a fault. */
void node_outlet_refuse_unspill(struct node_outlet *outlet, uint32_t brick);

/* Whether the messages that may leave are so few that they can wait for more:
 * only results, with room for as many again. */
bool node_outlet_few(const struct node_outlet *outlet);

/* Sends what may leave; the number of messages. */
unsigned node_outlet_send(struct node_outlet *outlet);

/* Messages and faces that have not left. */
uint32_t node_outlet_held(const struct node_outlet *outlet);

#endif
