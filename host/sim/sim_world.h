/* A cube in virtual time: its nodes run the real code on boards that are no
 * more than memory and wires, one step at a time, in the order of their clocks.
 * The host is who calls: whenever it asks for the time or sleeps, the rest of
 * the world runs until then.  No clock of this machine takes part. */
#ifndef HOST_SIM_WORLD_H
#define HOST_SIM_WORLD_H

#include "host/service/machine.h"
#include "liar.h"
#include "node/identity.h"
#include "node/node.h"
#include "sim_cube.h"
#include "stand_in.h"

enum {
    HOST_WORLD_STACK = 64 * 1024, /* of a node's memory, outside its arena */
    HOST_WORLD_STATIC = 16 * 1024
};

struct host_world_options {
    struct host_sim_cube_options cube; /* `wake` and its context are the
                                          world's */
    uint64_t memory;                   /* bytes a node, stack included */
    uint8_t window;                    /* frames; 0: the node's choice */
    uint32_t dead_us;                  /* as in struct node_identity */
    uint32_t step_us; /* a step of a node that has work, more or less */
    uint32_t host_us; /* a round of the host's loop */
    /* Instead of step_us: nanoseconds of processor time that a node has used
     * since its start, by what it has counted; i: its number.  A step is
     * charged when it is done, and what it has sent leaves when that time is
     * over; its clock goes on within a step.  NULL: chance decides. */
    uint64_t (*used_ns)(void *context, unsigned i, const struct node *node);
    void *used_context;
    /* Microseconds by which a node's clock goes on within a step, each time
     * that it looks at it, more or less; 0: it stands still. */
    uint32_t look_us;
    /* As on bare boards: a node is not told who it is, asks its neighbours, and
     * has its epoch from what they knew of it. */
    bool bare;
    uint32_t serial_baud;   /* as in struct node_identity */
    struct host_liar *liar; /* what alters the messages of that node; or NULL */
    unsigned liar_node;
    bool routers; /* and links pass on messages while a processor is busy */
    uint64_t time_us_max, steps_max; /* then it counts as hanging */
    uint8_t absent_s;                /* as in struct host_machine */
    /* Called whenever strike_us of the world is reached; sets the next. */
    void (*strike)(void *context);
    void *context;
    /* And this at second_us: the second host's round. */
    void (*second)(void *context);
    void *second_context;
};

enum host_world_state { HOST_WORLD_UP, HOST_WORLD_OFF, HOST_WORLD_ENDED };

struct host_world;

/* A host connects to node 0 as over TCP: the newest connection takes the place
 * of the one before, whose end connects again.  There is one at a time. */
struct host_world_connection {
    bool wanted, connected;
    uint64_t next_us;  /* the next attempt, while it is not connected, */
    uint64_t pause_us; /* and what follows one that nobody answers */
};

struct host_world_node {
    struct host_world *world;
    struct node_board board;
    struct node *node;
    struct host_stand_in_orders orders; /* of the starts to come */
    struct host_stand_in *stand_in;     /* instead of the node, or NULL */
    enum host_world_state state;
    bool unplugged; /* its wires were cut while it is off */
    uint64_t wake_us, busy_until_us, busy_us, offset_us;
    uint64_t used_ns; /* at the begin of a step, where work is charged */
    bool stepping;
    bool learning; /* who it is: there is no node yet */
    struct learner learner;
    uint32_t starts, place; /* in the heap */
    unsigned links;
};

struct host_world {
    struct host_world_options options;
    struct host_sim_cube cube;
    unsigned nodes;
    uint64_t now_us, steps, strike_us, second_us;
    uint64_t random, look_random;
    uint64_t looks;   /* by which clocks went on within steps */
    uint64_t learned; /* starts whose neighbours knew one before */
    uint32_t epoch;   /* of the next start of anything */
    uint64_t host_pause_us;
    const char *fault; /* why nothing moves any more, or NULL */
    unsigned fault_node;
    unsigned ended;
    struct host_world_node *node;
    bool *named;    /* wires that the user was told of as missing */
    uint32_t *heap; /* nodes by wake_us */
    struct host_world_connection connection[2];
};

int host_world_open(struct host_world *world,
                    const struct host_world_options *options,
                    struct host_error *error);
void host_world_close(struct host_world *world);

/* What the host's service takes it for: sim_machine.c. */
struct host_machine host_world_machine(struct host_world *world);

/* Runs the world until that time, or until the host has something to do; ends
 * its nodes' steps for good. */
void host_world_run(struct host_world *world, uint64_t until, bool for_host);
void host_world_halt(struct host_world *world);

/* When a host, 0 or 1, has something to read, or room that it had not. */
uint64_t host_world_host_due(const struct host_world *world, unsigned host);

/* A second host comes to node 0, or comes no more; and rests. */
void host_world_second_host(struct host_world *world, bool comes);
void host_world_rest(struct host_world *world, uint64_t rest_us);

/* Before the world begins: the node starts when `us` have passed. */
void host_world_late(struct host_world *world, unsigned node, uint64_t us);

/* The node does nothing for so long, as if its processor stood still. */
void host_world_pause(struct host_world *world, unsigned node, uint64_t us);

/* The node forgets all at once, and starts anew after `us`.  Meanwhile what is
 * sent to it is lost, or its wires are seen to be closed. */
void host_world_crash(struct host_world *world, unsigned node, uint64_t us,
                      bool unplugged);

/* The same, and what starts is a stand-in: see stand_in.h.  NULL: the node
 * again.  Of a node that is off, its next start. */
void host_world_replace(struct host_world *world, unsigned node, uint64_t us,
                        const struct host_stand_in_orders *orders);

/* The node forgets all at once, and answers and never works from then on. */
void host_world_idle(struct host_world *world, unsigned node);

/* The node never comes back. */
void host_world_kill(struct host_world *world, unsigned node);

/* Nothing moves any more, for that reason: the first that is given. */
void host_world_give_up(struct host_world *world, unsigned node,
                        const char *why);

/* NULL, or what a node left behind that was not its own. */
const char *host_world_damage(const struct host_world *world);

/* How a node of a simulated cube starts: told who it is, or, as on a bare
 * board, asking its neighbours. */

/* What its memory holds before is chance. */
void host_sim_boot(struct host_world *world, unsigned node);

/* Asks, if it is time, and listens: one that has been told starts as who it
 * is. */
void host_sim_learn(struct host_world *world, unsigned node);

#endif
