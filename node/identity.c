#include "identity.h"

enum { TRIES = 8 /* a draw is 0 once in 2^32 times */ };

static bool draw(struct secure_source *source, uint32_t *epoch) {
    *epoch = 0;
    for (int i = 0; i < TRIES && *epoch == 0; i++)
        if (source->random == NULL ||
            !source->random(source->context, (uint8_t *)epoch, sizeof *epoch))
            return false;
    return *epoch != 0;
}

bool node_identity_epoch(struct node_identity *identity,
                         struct secure_source *source) {
    uint32_t epoch;
    if (!draw(source, &epoch)) {
        /* 1 .. 2^32 - 1 in turn, for a number of 64 bits. */
        epoch = source->boot == 0
                    ? 0
                    : (uint32_t)((source->boot - 1) % UINT32_MAX + 1);
    }
    identity->epoch = epoch;
    return epoch != 0;
}

void node_identity_listen(struct learner *learner,
                          const struct node_board *board, unsigned links) {
    learner_init(learner, board->pipes, links);
}

void node_identity_listen_ports(struct learner *learner,
                                const struct node_board *board, unsigned ports,
                                bool host) {
    learner_init_ports(learner, board->pipes, ports, host);
}

void node_identity_ask(struct learner *learner, uint64_t now_us) {
    learner_ask(learner, now_us);
}

bool node_identity_hear(struct learner *learner,
                        struct node_identity *identity) {
    struct learned learned;
    if (!learner_poll(learner, &learned))
        return false;
    identity->self = learned.self;
    identity->dimension = learned.dimension;
    identity->host_port = learned.self != 0 &&
                          (learner->ports ? learned.host_port
                                          : learner->links > learned.dimension);
    return true;
}

bool node_identity_epoch_behind(const struct learner *learner,
                                struct node_identity *identity) {
    uint32_t known = learner->known.epoch;
    identity->epoch = known == UINT32_MAX ? 1 : known + 1;
    return known != 0;
}

const char *node_identity_doubt(const struct learner *learner) {
    if (learner->misfits > 0) {
        return "a neighbour takes this node for one with another number of "
               "wires";
    }
    return learner->misplaced > 0
               ? "a neighbour's wire is in another link than it should"
               : NULL;
}
