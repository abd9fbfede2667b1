/* Answers the questions of message.h in a node or a board's loader: keeps a
 * question until there is room for the answer, returns echoes and sends its
 * own, and decides when to restart.
 *
 * Memory: struct node_answers, a part of struct node; an answer is made on the
 * stack, CUBE_PAYLOAD_MAX bytes. */
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

/* Answers that only the user of this module has.  If a function is NULL, or
 * returns 0, the answer is empty. */
struct node_teller {
    void *context;
    /* Beside what the board fills in. */
    void (*who)(void *context, struct node_who *who);
    void (*top)(void *context, struct node_top *top);
    bool (*memory)(void *context, struct node_ready_message *map);
    void (*totals)(void *context, struct node_finished_message *totals);
    /* Appends to the board's own text; returns the number of bytes. */
    size_t (*log)(void *context, char *text, size_t size);
};

/* counted: of the same node; its cube exists. */
void node_answers_init(struct node_answers *answers,
                       const struct node_board *board,
                       struct node_counted *counted);

/* A new generation: questions of the old one are not answered. */
void node_answers_forget(struct node_answers *answers);

/* _is_for: whether a message is for this module. _take: takes such a message.
 */
bool node_answers_is_for(const struct cube_message *message);
void node_answers_take(struct node_answers *answers,
                       const struct cube_message *message, uint64_t now_us);

/* Sends what there is room for; returns the number of messages. */
unsigned node_answers_send(struct node_answers *answers,
                           const struct node_teller *teller, uint64_t now_us);

/* A field of struct node_who: the name, cut to `size`, zeros behind it. */
void node_who_name(uint8_t *field, size_t size, const char *name);

/* The answer to NODE_LINKS; returns the number of links. */
unsigned node_answers_links(const struct node_answers *answers,
                            struct node_link_state state[CUBE_LINKS_MAX]);

/* If not NODE_RESET_OVER, it is time to restart, with this value for
 * board.reset.  By then neighbours have received what was on its way, or had
 * the time to. */
enum node_reset node_answers_restart(const struct node_answers *answers,
                                     uint64_t now_us);

/* The cube as a node's identity and memory make it: the same for the node
 * program and a board's loader, so that they take each other's place. */

/* All but the pipes.  memory: of the node in all, arena and fixed. */
struct cube_config node_configure(const struct node_identity *identity,
                                  size_t memory);

#endif
