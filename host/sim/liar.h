/* A faulty node for tests: it works correctly, but some of its messages are
 * altered as they leave.  Altered are tetrahedra that it has found, pages that
 * it sends to other nodes, or work that it lends: once in so many chances, in
 * one of the ways of enum host_lie.  The simulator uses it, and so do the
 * processes of tests/system/liar.
 *
 * Memory: the struct, 16 KB. */
#ifndef HOST_SIM_LIAR_H
#define HOST_SIM_LIAR_H

#include "node/message.h"
#include "node/result.h"

struct node_counted;

enum host_lie {
    HOST_LIE_DROP,     /* a tetrahedron is left out */
    HOST_LIE_EXCHANGE, /* an apex is another vertex, and may be turned over */
    HOST_LIE_REPEAT,   /* a tetrahedron comes twice */
    HOST_LIE_INVENT,   /* one is made up of the vertices of others */
    HOST_LIE_PAGE,     /* another node gets a page with a point moved */
    HOST_LIE_LOAN,     /* faces lent or given back, or shared tetrahedra, have
                          another vertex */
    HOST_LIE_FLOOD,    /* one tetrahedron comes without end */
    HOST_LIE_SPILLS,   /* one spilled face does */
    HOST_LIES
};

/* As users write them. */
extern const char *const host_lies[HOST_LIES];

enum {
    HOST_LIAR_ROWS = CUBE_PAYLOAD_MAX / 4 + 1, /* of four bytes at least */
    HOST_LIAR_COMMITS = CUBE_PAYLOAD_MAX / 2,  /* of two */
    HOST_LIAR_SELF = UINT16_MAX                /* the node that lies, where it
                                                  need not know its number */
};

/* Zeros but for the first three, which the caller gives. */
struct host_liar {
    enum host_lie way;
    uint32_t one_in; /* 1 or more: a lie in so many tetrahedra, answers, lent
                        faces or pages */
    uint64_t random;
    uint64_t told;    /* lies sent so far */
    unsigned pending; /* lies in the current message */
    bool floods;
    /* A tetrahedron of a message before. */
    bool keeps;
    uint32_t kept[4];
    /* The message at hand, as it is read and as it leaves. */
    uint32_t row[HOST_LIAR_ROWS][4];
    uint16_t finder[HOST_LIAR_ROWS]; /* of a result's; HOST_LIAR_SELF */
    struct {
        uint32_t after, brick; /* rows before it */
    } commit[HOST_LIAR_COMMITS];
    uint32_t rows, commits;
    uint8_t out[CUBE_PAYLOAD_MAX + NODE_RESULT_SLACK];
};

/* Makes the message that leaves in place of that one: liar->out, with
 * liar->pending lies.  Returns its bytes. */
size_t host_liar_alter(struct host_liar *liar, uint16_t dest, uint8_t type,
                       const void *data, size_t size);

/* For struct node_board: sends the message altered, or keeps it back and floods
 * the host with others. */
int host_liar_write(struct host_liar *liar, struct node_counted *counted,
                    uint16_t dest, uint8_t type, const void *data, size_t size);

#endif
