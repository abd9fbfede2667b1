#include "keepers.h"

bool node_keepers_fit(const struct node_setup_message *setup,
                      struct node_fault *fault)
{
    if (setup->holders >= setup->nodes) {
        node_fault_set(fault, "invalid setup: # holders of # nodes",
                       setup->holders, setup->nodes);
        return false;
    }
    return true;
}
