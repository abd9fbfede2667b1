/* A session of the host with a cube, without a run: which nodes are up, what
 * nodes answer to questions, what boards' loaders receive.  Nodes may come, go
 * and start again meanwhile.  Messages are routed around wires that are dead or
 * were never there.
 *
 * Memory: struct host_session, and what the cube and the answers take, some 8
 * KB a node. */
#ifndef HOST_SESSION_H
#define HOST_SESSION_H

#include "host/base/node_set.h"
#include "host/service/in_use.h"
#include "host/service/watchers.h"
#include "node/message.h"

enum { HOST_SESSION_ANSWER_BYTES = CUBE_PAYLOAD_MAX };

/* What is known of a node. */
struct host_session_node {
    bool there;          /* it has answered NODE_WHO since it started last */
    bool heard;          /* something came of it lately: 2 s, or the time in
                            which all have been pinged twice */
    uint32_t starts;     /* that were seen during this session */
    struct node_who who; /* of the present start; zeros: none yet */
    uint32_t links;      /* bit d: up since its start, as it or a neighbour says
                          */
    /* The last answer to host_session_ask. */
    bool answered;
    size_t size;
    uint8_t *answer; /* HOST_SESSION_ANSWER_BYTES */
    uint32_t rtt_us; /* of that answer, from here and back */
    /* Private. */
    uint32_t start;                 /* its epoch; 0: not heard of */
    uint32_t received;              /* counted messages of this generation */
    uint32_t seen, silent, refused; /* links, as its last pong says, */
    uint64_t pong_us, silent_us;    /* and since when; 0: none came */
    uint64_t heard_us;              /* 0: nothing came of it */
    bool who_due, ping_due, question_due;
    bool pinged; /* and has not answered */
    uint64_t who_us, ping_us, question_us, who_again_us;
    uint64_t born_us; /* of the present start, as its answer says */
};

struct host_session {
    struct host_machine *machine;
    struct cube *cube;
    void *cube_memory;
    struct host_session_node *node; /* [machine->nodes] */
    bool in_use;                    /* another host has the cube */
    /* Wires to the wrong place, and whatever else does not fit, as links have
     * last said it. */
    struct cube_wrong wrong[CUBE_WRONG_MAX];
    unsigned wrong_count;
    /* Is given all messages that are no answers (NODE_IMAGE_STATE); NULL: they
     * are passed over. */
    void (*take)(void *context, const struct cube_message *message);
    void *context;
    /* Private. */
    uint32_t tag, what, target;
    struct host_node_set wanted; /* who is asked, and has not answered */
    uint8_t *answers;            /* of all nodes */
    struct host_in_use use;
    struct host_watching watching;
    uint64_t now_us, check_us, ping_us, opened_us;
    uint64_t pong_rtt_us; /* from ping to pong, of late */
    unsigned turn;        /* who is served next, */
    unsigned ping_turn;   /* and pinged */
    uint32_t generation;  /* that is followed, */
    uint64_t began_us;    /* and since when */
    uint32_t *dead;       /* its dead links: bit d of [i] */
    uint64_t renewed_us, pause_us, evidence_us, wire_us;
};

/* 0, or HOST_BROKEN.  The machine stays the caller's. */
int host_session_open(struct host_session *session,
                      struct host_machine *machine, struct host_error *error);

/* One round; sleeps up to wait_us if nothing moved.  0, or HOST_CUBE: the cube
 * is with another host, or the machine cannot go on. */
int host_session_round(struct host_session *session, uint64_t wait_us,
                       struct host_error *error);

/* Until all of the set are there, or wait_us have passed: 0 in both cases.  The
 * time does not count while another host has the cube, which may have ended. */
int host_session_wait(struct host_session *session,
                      const struct host_node_set *set, uint64_t wait_us,
                      struct host_error *error);

/* The same, and for what each says of its links; but who is behind wires that
 * are known to be dead, or on them, is not waited for: 6 s, more or less, where
 * a node is off, 4 where nobody is at the host's wire. */
int host_session_settle(struct host_session *session,
                        const struct host_node_set *set, uint64_t wait_us,
                        struct host_error *error);

/* Until no wire is wrong or down, or the nodes at such wires have told of them
 * when they, and the session, were old enough for wires to be up: 3 s. */
int host_session_settle_wires(struct host_session *session, uint64_t wait_us,
                              struct host_error *error);

/* Asks each of the set, and returns when all have answered or wait_us have
 * passed: 0 in both cases; node[i].answered tells.  Who is behind a wire that
 * is known to be dead is not waited for. */
int host_session_ask(struct host_session *session,
                     const struct host_node_set *set, enum node_question what,
                     unsigned target, uint64_t wait_us,
                     struct host_error *error);

/* Sends to a node, or CUBE_ALL.  False: there is no room now; after a round. */
bool host_session_send(struct host_session *session, uint16_t dest,
                       uint8_t type, const void *data, size_t size);

/* Has each of the set restart; does not wait for it. */
int host_session_restart(struct host_session *session,
                         const struct host_node_set *set,
                         enum node_restart what, struct host_error *error);

/* Why a node is not there, and what to do next: "WHAT; NEXT". */
const char *host_session_reason(const struct host_session *session,
                                unsigned node, char *text, size_t size);

/* Wires between nodes that are there, and to the host, that are wrong or not
 * up, as their ends say: how many.  tell: each, "WHAT; NEXT", node and link the
 * lower end's as far as it is known; or NULL.  A wire of nodes that have just
 * begun may be about to come up: host_session_settle_wires. */
unsigned host_session_faults(const struct host_session *session,
                             void (*tell)(void *context, unsigned node,
                                          unsigned link, const char *text),
                             void *context);

/* Links of a node that are up now, and that it should have. */
unsigned host_session_links_up(const struct host_session *session,
                               unsigned node);
unsigned host_session_links(const struct host_session *session, unsigned node);

/* Whether the nodes at wires that are not up have told so later than age_us
 * after their start, and that of the session. */
bool host_session_faults_are_old(const struct host_session *session,
                                 uint64_t age_us);

/* Leaves the cube as it is, free for the next host. */
void host_session_close(struct host_session *session);

#endif
