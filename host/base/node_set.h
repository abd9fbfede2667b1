/* A set of nodes as a person writes it, "0-3,7", or "all", and as answers are
 * told of several at once.
 *
 * Memory: 128 bytes. */
#ifndef HOST_NODE_SET_H
#define HOST_NODE_SET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"
#include "transport/cube.h"

struct host_node_set {
    uint8_t bits[CUBE_NODES_MAX / 8]; /* node i in bit i % 8 of byte i / 8 */
};

static inline bool host_node_set_has(const struct host_node_set *set,
                                     unsigned node) {
    return (set->bits[node / 8] >> node % 8 & 1) != 0;
}

static inline void host_node_set_add(struct host_node_set *set, unsigned node) {
    set->bits[node / 8] |= (uint8_t)(1u << node % 8);
}

static inline void host_node_set_remove(struct host_node_set *set,
                                        unsigned node) {
    set->bits[node / 8] &= (uint8_t) ~(1u << node % 8);
}

/* Of a cube of so many nodes.  0, or HOST_USAGE: what is wrong, and what is
 * allowed; *set is empty then. */
int host_node_set_parse(struct host_node_set *set, const char *text,
                        unsigned nodes, struct host_error *error);
void host_node_set_all(struct host_node_set *set, unsigned nodes);
unsigned host_node_set_count(const struct host_node_set *set);

/* As little as says it: "0-3,7"; what does not fit ends in "..". */
void host_node_set_print(const struct host_node_set *set, char *text,
                         size_t size);

/* The same for a sentence: "node 3", "nodes 4-7". */
void host_node_set_name(const struct host_node_set *set, char *text,
                        size_t size);

#endif
