/* Those who watch the cube from other programs: what they ask goes to the
 * nodes as any counted message, and only while they ask.
 *
 * Memory: struct host_watching, 0.4 KB.  Work: constant a message; where
 * nobody looks, a call every 50 ms. */
#ifndef HOST_WATCHERS_H
#define HOST_WATCHERS_H

#include "host/base/node_set.h"
#include "machine.h"
#include "node/message.h"

/* The tag of their questions; who else asks takes another. */
#define HOST_WATCHERS_TAG UINT32_MAX

struct host_watchers_question {
    enum node_question what;
    struct host_node_set nodes;
};

/* How far a run is; all 0: there is none. */
struct host_watchers_progress {
    uint64_t committed, bricks, tetrahedra;
};

/* Where they are: host/watch/. */
struct host_watchers {
    void *context;
    /* The next question, once the one before is answered; false: none. */
    bool (*ask)(void *context, uint64_t now_us,
                struct host_watchers_question *question);
    /* What a node has answered, and that no more comes to this question. */
    void (*answer)(void *context, unsigned node, const uint8_t *data,
                   size_t size);
    void (*answered)(void *context, uint64_t now_us,
                     const struct host_watchers_progress *progress);
    /* Who has the cube, where it is another program of this machine: until the
     * next call; NULL: not known. */
    const char *(*holder)(void *context);
};

/* All zero: nobody looks. */
struct host_watching {
    bool asked;
    struct host_watchers_question question;
    struct host_node_set due, waited;
    uint64_t look_us, asked_us;
};

/* Takes the next question, or ends one whose answers are here, or late. */
void host_watching_look(struct host_watching *watching,
                        const struct host_machine *machine, uint64_t now_us,
                        const struct host_watchers_progress *progress);

/* Whether the node is to be asked now. */
bool host_watching_due(const struct host_watching *watching, unsigned node,
                       struct node_question_message *question);
void host_watching_sent(struct host_watching *watching, unsigned node);

/* The node will not answer. */
void host_watching_leave_out(struct host_watching *watching, unsigned node);

/* NODE_ANSWER: whether it was theirs. */
bool host_watching_take(struct host_watching *watching,
                        const struct host_machine *machine,
                        const struct cube_message *message);

/* What was under way may be lost: who has not answered is asked again. */
void host_watching_again(struct host_watching *watching);

#endif
