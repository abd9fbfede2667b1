/* Messages in the manner of the nCUBE's own system: whoami, nwrite, nread and
 * ntest, with the vendor's names, arguments and special values, over a struct
 * cube.  The first argument is this module's, as there may be many nodes in one
 * process; the calls wait by themselves, so a program reads from top to bottom.
 *
 * A message that nobody has asked for yet waits in a slot.  While no slot is
 * free it waits on its link, of which it holds up what comes after; other links
 * go on.
 *
 * Memory: struct vertex (1.7 KB) and the slots (1.6 KB each).  Work: nread and
 * ntest look at each slot and the oldest message of each link; nread and nwrite
 * wait, through config.idle, for no longer than patience_us.
 *
 *     vertex_init(&v, &config);
 *     nwrite(&v, data, sizeof data, 0xffff, 7, NULL);
 *     size = nread(&v, data, sizeof data, &source, &type, NULL);
 */
#ifndef TRANSPORT_VERTEX_H
#define TRANSPORT_VERTEX_H

#include "cube.h"

enum {
    VERTEX_HEAD = 4,       /* bytes before a message's own */
    VERTEX_ANY = -1,       /* any source, any type */
    VERTEX_ALL = CUBE_ALL, /* every other node */
    VERTEX_BYTES_MAX = CUBE_PAYLOAD_MAX - VERTEX_HEAD, /* of a message */
    VERTEX_TYPE_MAX = 0x7fff
};

enum vertex_failure {
    VERTEX_FINE,
    VERTEX_LATE,     /* patience_us are over */
    VERTEX_RENEWED,  /* the cube began a new generation: what was under way is
                        lost, start again */
    VERTEX_FULL,     /* nothing that is asked for can arrive: the slots and the
                        oldest messages of all links are others */
    VERTEX_NO_WAY,   /* the node is dead, or cut off */
    VERTEX_NOT_SOUND /* an argument: no such node, type or size */
};

struct vertex_slot {
    uint16_t source, type, size;
    uint8_t data[VERTEX_BYTES_MAX];
};

struct vertex_config {
    struct cube *cube; /* read by this module alone */
    void *context;
    uint64_t (*now_us)(void *context); /* monotonic */
    /* Sleeps until a byte comes or may go, at most wait_us. */
    void (*idle)(void *context, uint64_t wait_us);
    uint16_t self; /* as the cube's config has them */
    uint8_t dimension;
    struct vertex_slot *slots;
    uint16_t slot_count;  /* at least 1 */
    uint32_t patience_us; /* 0: for ever */
};

struct vertex {
    struct vertex_config config;
    enum vertex_failure failure; /* why the last call gave -1 */
    uint32_t generation;
    uint16_t used; /* slots, the oldest first */
    uint16_t used_max;
    uint8_t out[CUBE_PAYLOAD_MAX];
};

void vertex_init(struct vertex *v, const struct vertex_config *config);

/* This node, its process (always 0), the number that stands for the host, and
 * the dimension of the cube. */
void whoami(const struct vertex *v, int *node, int *process, int *host,
            int *dimension);

/* Sends size bytes to a node, the host's number, or 0xffff: all nodes but this.
 * The buffer is free again on return, which *flag (unless NULL) says with 0.
 * size, or -1. */
int nwrite(struct vertex *v, const void *buffer, int size, int dest, int type,
           int *flag);

/* Waits for the oldest message of that source and type, either of which may be
 * -1; they are set to its own.  A message longer than size is cut.  Its bytes
 * in the buffer, or -1. */
int nread(struct vertex *v, void *buffer, int size, int *source, int *type,
          int *flag);

/* The size of the message that nread would take now, with *source and *type set
 * to its own; or -1: there is none. */
int ntest(struct vertex *v, int *source, int *type);

/* --- for what is built on it (collect.c) --------------------------------- */

/* Types from here on are not the user's, and -1 does not stand for them. */
enum { VERTEX_INNER = 0x8000 };

/* What becomes of a message that was waited for. */
struct vertex_sink {
    void (*take)(void *context, const uint8_t *data, size_t size);
    void *context;
};

/* 0, or -1 and v->failure.  data may be v->out + VERTEX_HEAD. */
int vertex_send(struct vertex *v, const void *data, size_t size, unsigned dest,
                unsigned type);
int vertex_receive(struct vertex *v, int *source, int *type,
                   const struct vertex_sink *sink);

#endif
