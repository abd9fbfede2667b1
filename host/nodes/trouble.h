/* For tests: emulated boards that are reset, stopped for a while or killed, one
 * after the other, each once, so many microseconds apart.
 *
 * Memory: struct host_troubled.  Work: a look at the clock a call; a request to
 * an emulator's monitor now and then.
 *
 *     troubled.trouble.every_us[HOST_TROUBLE_RESET] = 300000;
 *     if (host_trouble_due(&troubled, now_us, &kind, &node))
 *         status = reset_stop_or_kill(kind, node);
 */
#ifndef HOST_TROUBLE_H
#define HOST_TROUBLE_H

#include <stdbool.h>
#include <stdint.h>

enum host_trouble_kind {
    HOST_TROUBLE_RESET,
    HOST_TROUBLE_STOP,
    HOST_TROUBLE_KILL,
    HOST_TROUBLES,
    HOST_TROUBLE_CONT = HOST_TROUBLES /* the end of a stop */
};

struct host_trouble {
    uint64_t every_us[HOST_TROUBLES]; /* 0: never.  A stop lasts half of it. */
};

struct host_troubled {
    struct host_trouble trouble;
    unsigned nodes;
    uint64_t last_us[HOST_TROUBLES]; /* 0: not begun */
    unsigned turn[HOST_TROUBLES];
    bool stopped;
    unsigned stopped_node;
};

/* Whether one is due, which, and whose. */
bool host_trouble_due(struct host_troubled *troubled, uint64_t now_us,
                      enum host_trouble_kind *kind, unsigned *node);

#endif
