/* The common part of all tetrahedron builders, with any carrier of lists
 * (lists.h): a maker that answers them (incode/paper/builder.h), and its page
 * requests.  The functions of such a role call these. */
#ifndef NODE_TETRA_BUILDER_H
#define NODE_TETRA_BUILDER_H

#include "lists.h"
#include "incode/paper/builder.h"
#include "node/common.h"
#include "requests.h"

struct node_tetra_builder {
    struct node_fault *fault;
    struct node_carrier carrier;
    struct node_requests requests;
    uint64_t bytes_in;
    struct incode_builder builder;
};

/* Bytes beside the struct that suffice for this setup. */
size_t node_tetra_builder_min(const struct node_setup_message *setup);

/* memory: aligned to NODE_ALIGNMENT.  counted and fault must outlive it.
 * False: *fault is set. */
bool node_tetra_builder_start(struct node_tetra_builder *t, void *memory,
                              size_t bytes,
                              const struct node_setup_message *setup,
                              const struct node_carrier *carrier,
                              struct node_counted *counted,
                              struct node_fault *fault);

/* Messages of the host or a holder: a page.  Credit is ignored, because the
 * role has no results.  False: another message. */
bool node_tetra_builder_message(struct node_tetra_builder *t,
                                const struct cube_message *message);

/* Steps that did something. */
unsigned node_tetra_builder_work(struct node_tetra_builder *t,
                                 struct node_pace *pace);

/* As in a role: lists that it has, and a page that it waits for. */
uint32_t node_tetra_builder_held(const struct node_tetra_builder *t);
uint32_t node_tetra_builder_awaited(const struct node_tetra_builder *t);

/* The first two tables, and pages: maker, page frames. */
void node_tetra_builder_map(const struct node_tetra_builder *t,
                            struct node_map *map);

/* All but the bytes of the carrier, the role's own memory, and its time. */
void node_tetra_builder_gauge(const struct node_tetra_builder *t,
                              struct incode_gauge *gauge);
void node_tetra_builder_totals(const struct node_tetra_builder *t,
                               struct node_finished_message *totals);

#endif
