/* Shared by the files of a cube: config.c (checks and defaults), cube.c
 * (memory, messages), gossip.c (the wiring), fault.c (wrong wires as text).
 * For these files only, and for host/sim/stand_in.c, which plays a false end of
 * a cube.
 *
 * Memory and work: see cube.h. */
#ifndef TRANSPORT_CUBE_INTERNAL_H
#define TRANSPORT_CUBE_INTERNAL_H

#include "routes.h"

enum {
    CUBE_GOSSIP_US = 50000, /* between datagrams that are not answered */
    CUBE_HEAD = 8,          /* bytes of a message before the application's */
    CUBE_MESSAGE_MAX = CUBE_HEAD + CUBE_PAYLOAD_MAX
};

/* The oldest message of a link, while it is under way. */
struct cube_arrival {
    struct link_message message;
    uint32_t ways; /* bits of links that still need a copy, and of this node */
    bool there;
};

/* The state of a neighbour. */
struct cube_neighbour {
    uint64_t comings;  /* times that the link came up, as of the last look */
    uint64_t told_us;  /* when our wiring was last sent to it */
    bool agreed;       /* it has sent the same wiring */
    bool together;     /* it is known to have been in our generation when it */
    uint16_t since;    /* was to send this frame next */
    uint64_t frames;   /* received, as of the last look */
    uint32_t quiet_us; /* time that the link is down or silent */
};

struct cube {
    struct cube_config config;
    struct cube_statistics statistics;
    struct cube_wiring wiring;
    struct routes routes;
    struct link *links[CUBE_LINKS_MAX];
    struct cube_arrival arrivals[CUBE_LINKS_MAX];
    struct cube_neighbour neighbours[CUBE_LINKS_MAX];
    unsigned count;
    unsigned turn;      /* link that is served first */
    unsigned held;      /* link of the message being read, or CUBE_LINKS_MAX */
    uint32_t kept_back; /* links whose last slot is left to this node once */
    uint16_t stamp;     /* of messages: wiring_stamp */
    bool tending;       /* messages of others leave some room to this node's */
    bool again;         /* a message waits only for that turn to pass */
    uint8_t datagram[WIRING_BYTES_MAX]; /* the wiring, as it is sent */
    size_t datagram_size;
    uint64_t now_us;    /* of the last poll */
    uint64_t looked_us; /* when links were looked at last */
};

/* config.c: links of the config's own end, and the config of each. */
unsigned cube_links_of(const struct cube_config *config);
struct link_config cube_link_config(const struct cube_config *config,
                                    unsigned d);

/* cube.c: the messages of the generation before go. */
void cube_drop_all(struct cube *cube);

/* gossip.c: the neighbour at link d was in this end's generation when that
 * frame was the next that it would send. */
void cube_is_together(struct cube *cube, unsigned d, uint16_t sequence);

/* gossip.c: a neighbour that came again may be in another generation. */
void cube_note_comings(struct cube *cube, uint64_t now_us);

void cube_gossip_start(struct cube *cube);
void cube_gossip(struct cube *cube, uint64_t now_us);
uint64_t cube_gossip_due_us(const struct cube *cube, uint64_t now_us);

#endif
