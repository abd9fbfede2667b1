/* A cube in memory and in virtual time: the wires of a hypercube and of its
 * hosts, made of transport/drivers/sim.h, and what breaks them.  The simulated
 * world puts nodes and a host on it; the tests of links, cubes, nodes and the
 * service borrow it.
 *
 * Places are counted: the nodes, then the host, then a second host.  Link d of
 * a node leads to node ^ 1 << d, link `dimension` to the host; link k of the
 * host to the k-th node that has a wire to it.
 *
 * Memory: sim_wire_bytes() and two ports a wire, once. */
#ifndef HOST_SIM_CUBE_H
#define HOST_SIM_CUBE_H

#include "host/base/error.h"
#include "transport/cube.h"
#include "transport/drivers/sim.h"

struct host_sim_cube_options {
    unsigned dimension; /* 0 .. CUBE_DIMENSION_MAX; 0: node 0 and its host */
    uint64_t seed;      /* of what befalls the wires by chance */
    struct sim_quality wire, host_wire; /* host_wire.bytes 0: as `wire` */
    struct sim_faults faults;           /* of chance, on all wires */
    unsigned host_ports; /* nodes 0 .. host_ports - 1 have one, 1 (as 0) to
                            CUBE_HOST_PORTS_MAX; see cube.h */
    uint16_t spare_node; /* has the host's second wire; 0: none */
    bool second_host;    /* there is a place for one, at node 0 */
    bool shared;         /* all wires are one medium, as on one Ethernet */
    uint32_t gather_us;  /* bytes that come closer together wake a place once */
    /* What comes to a place, or room that it waited for, will be there at
     * `us`; NULL: nobody need be told. */
    void (*wake)(void *context, unsigned place, uint64_t us);
    void *context;
};

struct host_sim_cube;

/* One end of a wire, as its link sees it. */
struct host_sim_port {
    struct host_sim_cube *cube;
    struct link_pipe pipe; /* of the wire itself */
    struct sim_end *end;
    unsigned wire, side;
    unsigned peer; /* the place at the other end */
    bool replaced; /* by a newer connection: seen to break once */
};

struct host_sim_wire {
    struct sim_wire wire;
    uint32_t cuts, deaf[2]; /* reasons for it to be so */
    bool missing;           /* never there, */
    bool dead;              /* or cut for good since */
};

struct host_sim_cube {
    struct host_sim_cube_options options;
    const uint64_t *now_us;
    unsigned nodes, places;
    unsigned wires, host_wire; /* from there on those of hosts */
    struct host_sim_wire *wire;
    struct host_sim_port *port; /* links_max a place */
    unsigned links_max;
    uint64_t medium_ns; /* when it is free */
    uint64_t trace;     /* of all bytes sent, their times and wires */
    uint8_t *bytes;     /* of all wires */
};

/* The clock is the caller's, and stays where it is. */
int host_sim_cube_open(struct host_sim_cube *cube,
                       const struct host_sim_cube_options *options,
                       const uint64_t *now_us, struct host_error *error);
void host_sim_cube_close(struct host_sim_cube *cube);

/* The links of a place; the wire, the port and the bytes of one. */
unsigned host_sim_cube_links(const struct host_sim_cube *cube, unsigned place);
unsigned host_sim_cube_wire(const struct host_sim_cube *cube, unsigned place,
                            unsigned link);
struct host_sim_port *host_sim_cube_port(const struct host_sim_cube *cube,
                                         unsigned place, unsigned link);
struct link_pipe host_sim_cube_pipe(const struct host_sim_cube *cube,
                                    unsigned place, unsigned link);

/* A direction of a wire: 0 from its lower end on, 1 towards it. */
struct sim_direction *host_sim_cube_direction(const struct host_sim_cube *cube,
                                              unsigned wire, unsigned side);

/* Chance on all wires from now on; NULL: none any more. */
void host_sim_cube_faults(struct host_sim_cube *cube,
                          const struct sim_faults *faults);

/* Times that a fault of enum sim_fault struck, on all wires. */
uint64_t host_sim_cube_struck(const struct host_sim_cube *cube,
                              enum sim_fault fault);

/* A wire that is closed, or a direction that brings nothing: taken back as
 * often as it was made. */
void host_sim_cube_cut(struct host_sim_cube *cube, unsigned wire, bool cut);
void host_sim_cube_deaf(struct host_sim_cube *cube, unsigned wire,
                        unsigned side, bool deaf);

/* A wire that was never there.  Before the first byte. */
void host_sim_cube_leave_out(struct host_sim_cube *cube, unsigned wire);

/* From now on node 0 has the wire of that host, 0 or 1; the connection before
 * is seen to break. */
void host_sim_cube_connect(struct host_sim_cube *cube, unsigned host);

#endif
