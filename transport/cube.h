/* A hypercube of nodes wired point to point, and a host.  The host is attached
 * to node 0, to node 0 and a spare node, or to each of the first 2, 4 or 8
 * nodes.  Messages of up to CUBE_PAYLOAD_MAX bytes travel hop by hop along the
 * e-cube path (lowest differing dimension first), in order between any two
 * ends; broadcasts run along binomial trees.  Link d of a node leads to node
 * self ^ (1 << d); link `dimension` of a node that has a host port, as node 0
 * has always, leads to the host.
 *
 * Generations make every loss survivable.  The host begins a new generation
 * (cube_renew) when something was lost, and all messages of the old one are
 * dropped everywhere.  The generation, the host gateway (the node by which the
 * host sends) and the dead links spread by gossip from link to link.  A node
 * that starts learns them from its neighbours, and neither sends nor reads
 * messages before.
 *
 * Memory: one arena of cube_arena_bytes(), with a send and a receive window for
 * each link.  Links share no buffers (Dally and Seitz, 1987: e-cube routing is
 * free of deadlock if each channel has its own buffers).  Work: cube_poll
 * handles at most one window of frames a link.
 *
 *     struct cube *cube = cube_init(arena, bytes, &config);
 *     while (cube_poll(cube, now_us) > 0 && cube_read(cube, &message))
 *         cube_release(cube);
 *     if (cube_write(cube, CUBE_HOST, type, data, size) == CUBE_AGAIN)
 *         return 0; // later */
#ifndef TRANSPORT_CUBE_H
#define TRANSPORT_CUBE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link.h"

enum {
    CUBE_DIMENSION_MAX = 10,
    CUBE_NODES_MAX = 1 << CUBE_DIMENSION_MAX,
    CUBE_LINKS_MAX = CUBE_DIMENSION_MAX + 1, /* node 0 has the host's too */
    CUBE_PAYLOAD_MAX = 1600,
    CUBE_DEAD_MAX = 16,     /* dead links and nodes that are remembered */
    CUBE_WRONG_MAX = 4,     /* wrong wires */
    CUBE_WHOLE_NODE = 0xff, /* as the dimension of struct cube_dead */
    CUBE_HOST = 0xfffe,
    CUBE_ALL = 0xffff,
    CUBE_HOST_PORTS_MAX = 8
};

/* A link that is dead for the run, named by its lower end (`dimension` of the
 * cube: the wire of that node to the host), or a node with all its links. */
struct cube_dead {
    uint16_t node;
    uint8_t dimension; /* or CUBE_WHOLE_NODE */
};

/* A link whose peer does not fit. */
struct cube_wrong {
    uint16_t node, peer_node; /* or CUBE_HOST */
    uint8_t link, peer_link;
    uint8_t refusal; /* enum link_refusal */
};

/* The state on which all ends of a cube come to agree. */
struct cube_wiring {
    uint32_t generation; /* 1 at the start; 0: unknown so far; wraps to 1 */
    uint32_t host_epoch; /* of the host that began it */
    uint16_t gateway;    /* the node by which the host sends */
    uint16_t settled;    /* dead[0 .. settled) were so when it began: routes
                            avoid them; the others were found since */
    uint16_t dead_count, wrong_count;
    uint8_t absent_s; /* seconds after which a link that never came up is dead
                         too; 0: it is waited for */
    struct cube_dead dead[CUBE_DEAD_MAX];
    struct cube_wrong wrong[CUBE_WRONG_MAX];
};

/* If a field, or one of struct link_config, is out of its limits,
 * cube_arena_bytes() is 0, cube_init returns NULL, and cube_config_fault()
 * names the field.  A field with a default takes it if it is 0.  Some fields
 * must be the same at all ends of a cube; their comments say so. */
struct cube_config {
    /* This node, 0 .. 2^dimension - 1; or CUBE_HOST. */
    uint16_t self;

    /* Of the cube: 2^dimension nodes; 0 .. CUBE_DIMENSION_MAX.  The same at all
     * ends. */
    uint8_t dimension;

    /* Frames a link and direction that may be under way.  No default; 1 ..
     * LINK_WINDOW_MAX, and enough for a message; cube_for_serial() makes it 7,
     * or 14 from 8 on. */
    uint16_t window;

    /* This start of this end.  No default; 1 .. 2^32 - 1, never repeated. */
    uint32_t epoch;

    /* The bytes of each link: pipes[d] of dimension d, then those of the host
     * port, if the node has one; at the host, those to node 0 and to the others
     * that have a host port.  No default. */
    struct link_pipe pipes[CUBE_LINKS_MAX];

    /* At the host: another node that has a host port, beside node 0; pipes[1]
     * leads there.  Default: none; 1 .. 2^dimension - 1, with host_ports 0. */
    uint16_t spare_node;

    /* Instead of a spare node: nodes 0 .. host_ports - 1 have host ports, and
     * pipes[i] of the host leads to node i.  Messages between the host and a
     * node use the port of that node, or of the node with the same low bits.
     * The same at all ends.  Default, as for 1: node 0 only; a power of two, up
     * to CUBE_HOST_PORTS_MAX and 2^dimension. */
    uint8_t host_ports;

    /* At the spare node: true, it has a host port.  Default: it has none; node
     * 0 always has one. */
    bool host_port;

    /* At the host: the host gateway of the first generation.  Default: node 0;
     * or a node that has a host port. */
    uint16_t gateway;

    /* Microseconds after which a link that was up, and then was down or silent,
     * is dead.  Default: never; no limit. */
    uint32_t dead_us;

    /* Frames a direction on links to the host.  The same at both ends of such a
     * link.  Default: window; limits as there. */
    uint16_t host_window;

    /* Bytes of a message in a frame.  The same at both ends of a wire.
     * Default: a whole message; limits: see link.h.  Ignored with serial_baud:
     * then 408. */
    uint16_t frame_payload;

    /* Frames encoded ahead of the pipe.  Default and limits: see link.h.
     * Ignored with serial_baud: then 2. */
    uint16_t staging;

    /* Of the slowest serial wire of the cube: cube_for_serial() sets it.  The
     * same at all ends.  Default: there is none; what is below 300 counts as
     * 300. */
    uint32_t serial_baud;
};

struct cube_message {
    uint16_t source; /* node, or CUBE_HOST */
    uint16_t size;   /* bytes of data */
    uint8_t type;    /* the application's */
    const uint8_t *data;
};

struct cube_statistics {
    uint64_t written, read; /* messages of this node */
    uint64_t passed_on;     /* copies of messages of others */
    uint64_t misrouted;     /* dropped: no such node, too many hops, or by
                               another link than its source's messages come */
    uint64_t blocked;       /* polls in which a message found no room ahead */
    uint64_t unreachable;   /* written to where no way leads: dropped */
    uint64_t outdated;      /* dropped: of an older generation */
    uint64_t outdone;       /* generations of others that the host answered */
};

/* Settings, and a fitting window, for a cube whose slowest serial wire has that
 * baud rate: the same on all nodes and the host.  0: there are no serial wires,
 * and nothing changes. */
void cube_for_serial(struct cube_config *config, uint32_t baud);

/* The first field that breaks its limit, and which, as in "dimension is above
 * 10" (`window` stands for host_window too); NULL: the config is sound. */
const char *cube_config_fault(const struct cube_config *config);

/* The end to which link d of an end leads, a node or CUBE_HOST.  Of the config,
 * only the fields about host ports are read. */
struct link_end cube_peer_of(const struct cube_config *config, unsigned self,
                             unsigned d);

struct cube; /* opaque: lives at the start of its arena */

size_t cube_arena_bytes(const struct cube_config *config);
struct cube *cube_init(void *arena, size_t bytes,
                       const struct cube_config *config);

/* Moves bytes and frames on all links; now_us: monotonic microseconds. Returns
 * the number of frames handled (0: nothing to do until bytes or time come). */
int cube_poll(struct cube *cube, uint64_t now_us);

/* The same for a caller between cube_read and cube_release, or between
 * cube_room and cube_write.  It enters no generation, and room for a message of
 * this node stays: neighbours' datagrams and BYEs wait for cube_poll, and
 * messages of other nodes are forwarded only if they leave room for one of this
 * node. */
int cube_tend(struct cube *cube, uint64_t now_us);

/* Queues a message.  dest: a node, CUBE_HOST or CUBE_ALL (every node but the
 * sender, along the binomial tree rooted at the sender; the host's goes by
 * the host gateway, or by all host ports where host_ports is given).  0, or
 * CUBE_AGAIN while the first link has no room. */
int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size);
#define CUBE_AGAIN (-1)

/* Messages cube_write would take now towards dest. */
unsigned cube_room(const struct cube *cube, uint16_t dest);

/* The next message for this node, valid until cube_release; false: none.  An
 * unread message keeps its buffer, and so holds back its link only. */
bool cube_read(struct cube *cube, struct cube_message *message);
void cube_release(struct cube *cube);

/* For a reader that takes some messages before others. _read_from: the same
 * from link d only. _put_back, instead of cube_release: leaves the message
 * unread. */
bool cube_read_from(struct cube *cube, unsigned d,
                    struct cube_message *message);
void cube_put_back(struct cube *cube);

/* State of link d: counters, and whether its peer is up. */
const struct link_statistics *cube_link_statistics(const struct cube *cube,
                                                   unsigned d);
enum link_state cube_link_state(const struct cube *cube, unsigned d);
const struct link_peer *cube_link_peer(const struct cube *cube, unsigned d);
unsigned cube_links(const struct cube *cube);
const struct cube_statistics *cube_statistics(const struct cube *cube);

/* The wiring as this end knows it.  The generation changes in cube_poll and
 * cube_renew only.  A caller that checks it after them, and drops what it was
 * about to write, never sends in one generation what it decided in another. */
const struct cube_wiring *cube_wiring(const struct cube *cube);

/* At the host: begins a generation with next's gateway and dead links, and
 * drops all messages of the old one, here at once and elsewhere as it spreads.
 * Its number is next's if that is later than the present one, and otherwise the
 * number after the present one. */
void cube_renew(struct cube *cube, const struct cube_wiring *next);

/* Whether a node can be reached, with the links that were dead when the
 * generation began. */
bool cube_reaches(const struct cube *cube, uint16_t node);

/* Whether link d is dead, settled or found since. */
bool cube_link_is_dead(const struct cube *cube, unsigned d);

/* The first wrong wire as a sentence, "node 5 link 2 is wired to node 3,
 * expected node 1", wherever in the cube it was found; false: none is known. */
enum { CUBE_FAULT_BYTES = 80 };
bool cube_wiring_fault(const struct cube *cube, char text[CUBE_FAULT_BYTES]);

/* The same text for a given wrong wire, in a cube with the config's dimension
 * and host ports. */
void cube_wrong_text(const struct cube_wrong *wrong,
                     const struct cube_config *config,
                     char text[CUBE_FAULT_BYTES]);

/* True when the neighbours have acknowledged everything that was written here,
 * and no message waits to be forwarded: then a node may leave. */
bool cube_idle(const struct cube *cube);

/* Sends BYE on all links once they are idle, or at deadline_us. */
void cube_close(struct cube *cube, uint64_t deadline_us);

/* Microseconds until cube_poll must be called again even if no byte comes. */
uint64_t cube_next_due_us(const struct cube *cube, uint64_t now_us);

#endif
