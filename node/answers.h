/* What a node, or a board's loader, does about questions.h: it keeps what it is
 * asked until there is room for the answer, sends echoes back and its own out,
 * and knows when it is to restart.
 *
 * Memory: struct node_answers, a part of struct node; an answer is made on
 * the stack, CUBE_PAYLOAD_MAX bytes. */
#ifndef NODE_ANSWERS_H
#define NODE_ANSWERS_H

#include "board.h"
#include "common.h"
#include "message.h"

enum {
    NODE_ASKED_MAX = 4, /* questions that wait; of more the last are dropped */
    NODE_ECHOES_MAX = 4 /* likewise */
};

struct node_answers {
    const struct node_board *board;
    struct node_counted *counted;
    uint64_t start_us;
    struct node_question_message asked[NODE_ASKED_MAX];
    unsigned asked_count;
    struct {
        uint16_t source;
        uint32_t tag;
    } echo[NODE_ECHOES_MAX];
    unsigned echo_count;
    /* A probe is under way. */
    bool probing, probe_sent, probe_back;
    struct node_question_message probe;
    uint32_t probe_tag, probe_rtt_us;
    uint64_t probe_us;
    uint32_t restart; /* enum node_restart; 0: none */
    uint64_t restart_us;
};

/* What only its user knows.  A function that is NULL, or returns 0: it has
 * nothing to say, and the answer is empty. */
struct node_teller {
    void *context;
    /* Beside what the board fills in. */
    void (*who)(void *context, struct node_who *who);
    void (*top)(void *context, struct node_top *top);
    bool (*memory)(void *context, struct node_ready_message *map);
    void (*totals)(void *context, struct node_finished_message *totals);
    /* Text behind the board's own; how many bytes. */
    size_t (*log)(void *context, char *text, size_t size);
};

/* counted: of the same node, whose cube is there. */
void node_answers_init(struct node_answers *answers,
                       const struct node_board *board,
                       struct node_counted *counted);

/* A new generation: what was asked in another is not answered. */
void node_answers_forget(struct node_answers *answers);

/* Whether it is a message for this module; then it is taken. */
bool node_answers_is_for(const struct cube_message *message);
void node_answers_take(struct node_answers *answers,
                       const struct cube_message *message, uint64_t now_us);

/* Sends what there is room for; how many. */
unsigned node_answers_send(struct node_answers *answers,
                           const struct node_teller *teller, uint64_t now_us);

/* A field of struct node_who: the name, cut to `size`, zeros behind it. */
void node_who_name(uint8_t *field, size_t size, const char *name);

/* What is answered to NODE_LINKS: of how many links. */
unsigned node_answers_links(const struct node_answers *answers,
                            struct node_link_state state[CUBE_LINKS_MAX]);

/* Not NODE_RESET_OVER: it is time to restart, so that board.reset gets this.
 * Neighbours have, or had the time to get, what was on its way. */
enum node_reset node_answers_restart(const struct node_answers *answers,
                                     uint64_t now_us);

/* The cube as a node's identity and memory make it: the same for the node
 * program and a board's loader, so that they take each other's place. */

/* All but the pipes.  memory: of the node in all, arena and fixed. */
struct cube_config node_configure(const struct node_identity *identity,
                                  size_t memory);

#endif
