#include "keepers.h"

bool node_keepers_fit(const struct node_setup_message *setup, unsigned self,
                      bool keeps, struct node_fault *fault) {
    bool among = self >= 1 && self <= setup->holders;
    if (setup->holders >= setup->nodes) {
        node_fault_set(fault, "invalid setup: # holders of # nodes",
                       setup->holders, setup->nodes);
        return false;
    }
    if (keeps != among) {
        node_fault_set(fault,
                       keeps ? "invalid setup: node # is none of # holders"
                             : "invalid setup: node # works, and is one of # "
                               "holders",
                       self, setup->holders);
        return false;
    }
    return true;
}
