/* An image on its way to boards, all at once, over a session to their cube:
 * those that run another are told to wait in their loader, all are sent its
 * blocks along the cube's tree, each is asked what it lacks and sent that
 * again, until all have it verified; then they start it.  Nodes may be off,
 * restart, lose power or links meanwhile; what they have they keep, and are
 * sent the rest.
 *
 * Memory: struct host_spread, and 800 bytes a node. */
#ifndef HOST_SPREAD_H
#define HOST_SPREAD_H

#include "host/cube/session.h"
#include "node/loader/image.h"

enum { HOST_SPREAD_TEXT = 320, HOST_SPREAD_STARTS_MAX = 12 };

/* How far a node is. */
enum host_spread_phase {
    HOST_SPREAD_AWAITED, /* it is not there */
    HOST_SPREAD_LEAVES,  /* it runs another image, and has to restart */
    HOST_SPREAD_BEGINS,  /* its loader is to take this one */
    HOST_SPREAD_TAKES,   /* blocks */
    HOST_SPREAD_WHOLE,   /* has all of them, and verifies */
    HOST_SPREAD_VERIFIED,
    HOST_SPREAD_STARTS, /* is told to start it */
    HOST_SPREAD_DONE,   /* the first end: it runs the image, */
    HOST_SPREAD_HAS,    /* had it before, */
    HOST_SPREAD_PASSED, /* is another board, as is known, */
    HOST_SPREAD_REFUSED,
    HOST_SPREAD_FELL_BACK, /* did not come up with it, */
    HOST_SPREAD_LOST       /* or got no further */
};

struct host_spread_node {
    enum host_spread_phase phase;
    uint32_t blocks, held;       /* blocks 0: none is known to be lacking */
    char text[HOST_SPREAD_TEXT]; /* from PASSED on: why, and from REFUSED on,
                                    behind a semicolon, what to do next */
    /* Private. */
    uint32_t start, starts;   /* this one, and so many were seen */
    bool left, booted, named; /* was told to */
    bool begin_due, said;
    uint32_t boot_start;            /* the start that was told to */
    uint32_t asks, replies, silent; /* of this start */
    uint32_t homeward;              /* times it was told to start its own */
    uint64_t told_us, moved_us, heard_us;
    uint8_t map[LOADER_MAP_BYTES];
};

struct host_spread_options {
    const uint8_t *image; /* its header first; checked */
    size_t bytes;
    struct host_node_set nodes;
    uint64_t patience_us;
    bool again; /* also where the image is already: verified and started anew */
    void *context;
    /* The board that a node is known to be; NULL, or the result: it is not. */
    const char *(*board)(void *context, unsigned node);
    /* A serial number for a board that has none; NULL: it stays without. */
    bool (*serial)(void *context, uint8_t serial[NODE_SERIAL_BYTES]);
    /* Is told of a node whose phase or blocks have changed; may be NULL. */
    void (*changed)(void *context, unsigned node);
    /* Is told what the user should know, a line; may be NULL. */
    void (*say)(void *context, const char *line);
};

struct host_spread {
    struct host_session *session;
    struct host_spread_options options;
    struct loader_image image;
    struct host_spread_node *node; /* [machine->nodes] */
    uint32_t blocks, sent;         /* of the image; that went, again or not */
    /* Private. */
    uint32_t transfer, next; /* the next block of this pass */
    uint32_t generation;     /* of the cube, in which all was sent */
    uint64_t
        now_us; /* looked at once a step: in a simulation that takes time */
    uint64_t began_us, arrived_us, asked_us, answered_us;
    bool looked, passing, ask_due;
    bool ask_lost;                    /* it, or answers to it */
    uint16_t dest[LOADER_BLOCKS_MAX]; /* of a pass; CUBE_HOST: nobody */
};

/* Takes over what the session's `take` is given.  HOST_BROKEN: no memory. */
int host_spread_open(struct host_spread *spread, struct host_session *session,
                     const struct host_spread_options *options,
                     struct host_error *error);

/* Until all are there, or most likely will not be so soon: what would be done
 * with each stands in its phase.  Nothing is changed on any. */
int host_spread_look(struct host_spread *spread, struct host_error *error);

/* A step, which sleeps up to wait_us if nothing moves; whether all is at its
 * end; and all steps.  0, or HOST_CUBE where the cube is lost as a whole. */
int host_spread_step(struct host_spread *spread, uint64_t wait_us,
                     struct host_error *error);
bool host_spread_over(const struct host_spread *spread);
int host_spread_run(struct host_spread *spread, struct host_error *error);

/* 0: all of the set run the image, or are other boards by what is known.  Else
 * HOST_INPUT, where no node has more against it than to refuse the image, or
 * HOST_CUBE; *error names one kind of failure, `say` is told of the others. */
int host_spread_result(struct host_spread *spread, struct host_error *error);
void host_spread_close(struct host_spread *spread);

/* "takes blocks", for a person. */
const char *host_spread_phase_text(enum host_spread_phase phase);

/* What the parts of spread.h share: judging a node by what it answers, and
 * sending what is due. */

enum {
    SPREAD_AGAIN_US = 4000000 /* an order that had no effect is repeated */
};

static inline bool spread_wanted(const struct host_spread *spread, unsigned i) {
    return host_node_set_has(&spread->options.nodes, i);
}

static inline bool spread_ended(const struct host_spread_node *node) {
    return node->phase >= HOST_SPREAD_DONE;
}

/* Whether its loader is there, and has not come to its end. */
bool spread_in_loader(const struct host_spread *spread, unsigned i);

/* Whether it was told to start the program that it had, and has not yet. */
bool spread_goes_home(const struct host_spread *spread, unsigned i);

void spread_set(struct host_spread *spread, unsigned i,
                enum host_spread_phase phase);

/* Restarts, beginnings, questions, verifications and starts that are due; the
 * blocks that there is room for. */
int spread_orders(struct host_spread *spread, struct host_error *error);
void spread_blocks(struct host_spread *spread);

#endif
