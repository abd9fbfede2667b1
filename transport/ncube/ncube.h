/* For programs that were written for the nCUBE 2: its calls whoami, nwrite,
 * nread and ntest, with the vendor's names, arguments and special values, over
 * a struct cube.  A library of its own (make ncube: build/libncube.a): nothing
 * of incode is built on it.  The first argument is the library's, as there may
 * be many nodes in one process.  Who calls it is the only reader of the cube.
 *
 * The calls block, so a program reads from top to bottom.  nwrite waits for
 * room on the way, nread for a message that fits, in one loop: cube_poll, and
 * where that moved nothing config.idle, until the cube is due.  The loop ends
 * with -1 after patience_us, when the cube begins another generation, when the
 * other node is cut off, or when no message that fits can arrive.  ntest polls
 * once and never waits.
 *
 * A message that nobody has asked for yet waits in a slot.  While no slot is
 * free it waits on its link, of which it holds up what comes after; other links
 * go on.
 *
 * Memory: struct ncube (1.7 KB) and the slots (1.6 KB each) that the caller
 * gives.  Work: each round of the loop looks at all slots and the oldest
 * message of each link.
 *
 *     ncube_init(&n, &config);
 *     nwrite(&n, data, sizeof data, NCUBE_ALL, 7, NULL);
 *     int bytes = nread(&n, data, sizeof data, &source, &type, NULL);
 */
#ifndef TRANSPORT_NCUBE_NCUBE_H
#define TRANSPORT_NCUBE_NCUBE_H

#include "transport/cube.h"

enum {
    NCUBE_HEAD = 4,       /* bytes before a message's own */
    NCUBE_ANY = -1,       /* any source, any type */
    NCUBE_ALL = CUBE_ALL, /* every other node */
    NCUBE_BYTES_MAX = CUBE_PAYLOAD_MAX - NCUBE_HEAD, /* of a message */
    NCUBE_TYPE_MAX = 0x7fff
};

enum ncube_failure {
    NCUBE_FINE,
    NCUBE_LATE,     /* patience_us are over */
    NCUBE_RENEWED,  /* the cube began a new generation: what was under way is
                        lost, start again */
    NCUBE_FULL,     /* nothing that is asked for can arrive: the slots and the
                        oldest messages of all links are others */
    NCUBE_NO_WAY,   /* the node is dead, or cut off */
    NCUBE_NOT_SOUND /* an argument: no such node, type or size */
};

struct ncube_slot {
    uint16_t source, type, size;
    uint8_t data[NCUBE_BYTES_MAX];
};

struct ncube_config {
    struct cube *cube;                 /* read by this library alone */
    void *context;                     /* of the two functions */
    uint64_t (*now_us)(void *context); /* monotonic */
    /* Sleeps until a byte comes or may go, at most wait_us. */
    void (*idle)(void *context, uint64_t wait_us);
    uint16_t self; /* as the cube's config has them */
    uint8_t dimension;
    struct ncube_slot *slots;
    uint16_t slot_count;  /* 1 .. 65535 */
    uint32_t patience_us; /* most that a call waits; 0: for ever */
};

struct ncube {
    struct ncube_config config;
    enum ncube_failure failure; /* why the last call gave -1 */
    uint32_t generation;
    uint16_t used; /* slots, the oldest first */
    uint16_t used_max;
    uint8_t out[CUBE_PAYLOAD_MAX];
};

void ncube_init(struct ncube *n, const struct ncube_config *config);

/* This node, its process (always 0), the number that stands for the host, and
 * the dimension of the cube. */
void whoami(const struct ncube *n, int *node, int *process, int *host,
            int *dimension);

/* Sends size bytes to a node, the host's number, or 0xffff: all nodes but this.
 * The buffer is free again on return, which *flag (unless NULL) says with 0.
 * size, or -1. */
int nwrite(struct ncube *n, const void *buffer, int size, int dest, int type,
           int *flag);

/* Waits for the oldest message of that source and type, either of which may be
 * -1; they are set to its own.  A message longer than size is cut.  Its bytes
 * in the buffer, or -1. */
int nread(struct ncube *n, void *buffer, int size, int *source, int *type,
          int *flag);

/* The size of the message that nread would take now, with *source and *type set
 * to its own; or -1: there is none. */
int ntest(struct ncube *n, int *source, int *type);

/* --- for what is built on it (collect.c) --------------------------------- */

/* Types from here on are not the user's, and -1 does not stand for them. */
enum { NCUBE_INNER = 0x8000 };

/* What becomes of a message that was waited for. */
struct ncube_sink {
    void (*take)(void *context, const uint8_t *data, size_t size);
    void *context;
};

/* 0, or -1 and n->failure.  data may be n->out + NCUBE_HEAD. */
int ncube_send(struct ncube *n, const void *data, size_t size, unsigned dest,
               unsigned type);
int ncube_receive(struct ncube *n, int *source, int *type,
                  const struct ncube_sink *sink);

#endif
