#include "trouble.h"

bool host_trouble_due(struct host_troubled *troubled, uint64_t now_us,
                      enum host_trouble_kind *kind, unsigned *node) {
    struct host_troubled *t = troubled;
    if (t->stopped && now_us - t->last_us[HOST_TROUBLE_STOP] >=
                          t->trouble.every_us[HOST_TROUBLE_STOP] / 2) {
        t->stopped = false;
        *kind = HOST_TROUBLE_CONT;
        *node = t->stopped_node;
        return true;
    }
    for (unsigned k = 0; k < HOST_TROUBLES; k++) {
        uint64_t every_us = t->trouble.every_us[k];
        if (t->last_us[k] == 0) {
            t->last_us[k] = now_us;
        }
        if (every_us == 0 || t->turn[k] == t->nodes ||
            now_us - t->last_us[k] < every_us) {
            continue;
        }
        t->last_us[k] = now_us;
        *kind = (enum host_trouble_kind)k;
        *node = t->turn[k]++;
        if (k == HOST_TROUBLE_STOP) {
            t->stopped = true;
            t->stopped_node = *node;
        }
        return true;
    }
    return false;
}
