/* The side of look.h that has the cube: lets others find it, takes their
 * questions, and gives them the answers.
 *
 * It never waits, and needs neither threads nor signals. */
#ifndef HOST_OFFER_H
#define HOST_OFFER_H

#include <jansson.h>

#include "look.h"
#include "host/service/watchers.h"

struct host_looker {
    int file; /* -1: none */
    bool asks;
    struct host_watchers_question question;
    char line[HOST_LOOK_QUESTION_BYTES];
    size_t used;
    char *out; /* to be freed */
    size_t out_size, out_at;
    uint64_t moved_us; /* when it last read */
};

struct host_offer {
    struct host_watchers watchers;
    char wire[HOST_WIRE_NAME], holder[HOST_HOLDER_TEXT];
    unsigned nodes, dimension;
    uint32_t serial_baud;
    int listener; /* -1: another has the place still, or there is none */
    uint64_t tried_us;
    struct host_looker looker[HOST_LOOKERS_MAX];
    unsigned turn;   /* of whom to take a question next */
    int asked;       /* whose question is out; -1: none */
    json_t *answers; /* to it */
    struct host_watchers_progress progress;
};

/* Before the wire is opened: of two that begin at once, one has the place.  Who
 * has none is not found, which is no error.  An offer that is all zero has not
 * begun, which host_offer_end may be told. */
void host_offer_begin(struct host_offer *offer, const char *wire);
void host_offer_end(struct host_offer *offer);

/* What there is to look at; nobody looks before. */
void host_offer_machine(struct host_offer *offer,
                        const struct host_machine *machine);

#endif
