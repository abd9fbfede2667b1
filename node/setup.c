#include "setup.h"

#include <string.h>

bool node_setup_read(struct node_setup_message *setup,
                     const struct cube_message *message, unsigned nodes,
                     struct node_fault *fault) {
    uint32_t protocol = NODE_PROTOCOL;
    if (message->size >= sizeof protocol) {
        memcpy(&protocol, message->data, sizeof protocol);
    }
    if (protocol != NODE_PROTOCOL) {
        node_fault_set(fault, "protocol version #, expected #", protocol,
                       NODE_PROTOCOL);
        return false;
    }
    if (message->size != sizeof *setup) {
        node_fault_set(fault, "setup in # bytes, expected #", message->size,
                       sizeof *setup);
        return false;
    }
    memcpy(setup, message->data, sizeof *setup);
    if (setup->nodes != nodes) {
        node_fault_set(fault, "invalid setup: # nodes, expected #",
                       setup->nodes, nodes);
        return false;
    }
    for (unsigned i = 0; i < sizeof setup->reserved; i++) {
        if (setup->reserved[i] != 0) {
            node_fault_set(fault, "invalid setup: reserved byte # is #", i,
                           setup->reserved[i]);
            return false;
        }
    }
    if (setup->reserved2 != 0) {
        node_fault_set(fault, "invalid setup: what is reserved is #",
                       setup->reserved2, 0);
        return false;
    }
    return true;
}
