/* A cube in virtual time: its nodes run the real code on boards that are no
 * more than memory and wires, one step at a time, in the order of their clocks.
 * The host is who calls: whenever it asks for the time or sleeps, the rest of
 * the world runs until then.  No clock of this machine takes part.
 *
 * Memory: the nodes' arenas, and the bytes of each wire.  Work: a heap of
 * nodes, log n a step, besides the nodes' own.
 *
 *     host_world_open(&world, &options, &error);
 *     struct host_machine machine = host_world_machine(&world);
 *     ... host_service_start, host_service_run, host_service_end ...
 *     host_world_close(&world);
 */
#ifndef HOST_SIM_WORLD_H
#define HOST_SIM_WORLD_H

#include "node/node.h"
#include "transport/drivers/sim.h"
#include "host/service/machine.h"

enum {
    HOST_WORLD_STACK = 64 * 1024, /* of a node's memory, outside its arena */
    HOST_WORLD_STATIC = 16 * 1024
};

struct host_world_options {
    unsigned nodes, dimension;
    uint64_t memory; /* bytes a node, stack included */
    uint8_t window;  /* frames; 0: the node's choice */
    struct sim_quality wire, host_wire;
    uint32_t dead_us;   /* as in struct node_identity */
    uint32_t gather_us; /* bytes that come closer together wake a node once */
    uint32_t step_us;   /* a step of a node that has work, more or less */
    uint32_t host_us;   /* a round of the host's loop */
    uint64_t seed;
    uint64_t time_us_max, steps_max; /* then it counts as hanging */
    uint8_t absent_s;                /* as in struct host_machine */
    bool second_host;                /* there is a place for one */
    /* Called whenever strike_us of the world is reached; sets the next. */
    void (*strike)(void *context);
    void *context;
    /* And this at guest_us: the second host's round. */
    void (*guest)(void *context);
    void *guest_context;
};

enum host_world_state { HOST_WORLD_UP, HOST_WORLD_OFF, HOST_WORLD_ENDED };

struct host_world;

/* One end of a wire, as its link sees it. */
struct host_world_port {
    struct host_world *world;
    struct link_pipe pipe; /* of the simulated wire */
    struct sim_end *end;
    unsigned wire, side;
    unsigned owner, peer; /* node, or `nodes` for the host; one more for the
                             second host */
    bool replaced;        /* by a newer connection: seen to break once */
};

/* A host calls node 0 as over TCP: the newest connection takes the place of
 * the one before, whose end calls again.  There is one call at a time. */
struct host_world_door {
    struct host_world_port port;
    bool wanted, connected;
    uint64_t call_us;  /* the next call, while it is not connected, */
    uint64_t pause_us; /* and what follows one that nobody answers */
};

struct host_world_node {
    struct host_world *world;
    struct node_board board;
    struct node *node;
    enum host_world_state state;
    bool unplugged; /* its wires were cut while it is off */
    uint64_t wake_us, busy_until_us, busy_us, offset_us;
    uint32_t starts, place; /* in the heap */
    unsigned links;
    struct host_world_port port[CUBE_LINKS_MAX];
};

struct host_world_wire {
    struct sim_wire wire;
    uint32_t cuts, deaf[2]; /* reasons for it to be so */
    bool missing, named;    /* never there; told to the user */
};

struct host_world {
    struct host_world_options options;
    uint64_t now_us, steps, strike_us, guest_us;
    uint64_t random;
    uint32_t epoch; /* of the next start of anything */
    uint64_t trace; /* of all bytes sent, their times and wires */
    uint64_t host_pause_us;
    const char *fault; /* why nothing moves any more, or NULL */
    unsigned fault_node;
    unsigned ended;
    struct host_world_node *node;
    struct host_world_wire *wire;
    unsigned wires, host_wire; /* then perhaps the second host's */
    uint32_t *heap;            /* nodes by wake_us */
    struct host_world_door door[2];
    uint8_t *bytes; /* of all wires */
};

int host_world_open(struct host_world *world,
                    const struct host_world_options *options,
                    struct host_error *error);
void host_world_close(struct host_world *world);
struct host_machine host_world_machine(struct host_world *world);

/* The wire of a node's link. */
unsigned host_world_wire_of(const struct host_world *world, unsigned node,
                            unsigned link);

/* The bytes of a host, 0 or 1, and when it has something to read, or room that
 * it had not. */
struct link_pipe host_world_pipe(struct host_world *world, unsigned host);
uint64_t host_world_door_due(const struct host_world *world, unsigned host);

/* A second host comes to node 0, or comes no more; and rests. */
void host_world_knock(struct host_world *world, bool comes);
void host_world_rest(struct host_world *world, uint64_t rest_us);

/* A wire that was never there.  Before the world begins. */
void host_world_leave_out(struct host_world *world, unsigned wire);

/* Faults; those that last are taken back as often as they were made. */
void host_world_cut(struct host_world *world, unsigned wire, bool cut);
void host_world_deaf(struct host_world *world, unsigned wire, unsigned side,
                     bool deaf);
void host_world_pause(struct host_world *world, unsigned node, uint64_t us);

/* The node forgets all at once, and starts anew after `us`.  Meanwhile what is
 * sent to it is lost, or its wires are seen to be closed. */
void host_world_crash(struct host_world *world, unsigned node, uint64_t us,
                      bool unplugged);

/* The node never comes back. */
void host_world_kill(struct host_world *world, unsigned node);

/* NULL, or what a node left behind that was not its own. */
const char *host_world_damage(const struct host_world *world);

/* Uniform from lo to hi, both included; and over orders of magnitude. */
uint64_t host_world_draw(uint64_t *state, uint64_t lo, uint64_t hi);
uint64_t host_world_draw_log(uint64_t *state, uint64_t lo, uint64_t hi);

#endif
