#include "greeting.h"

#include <string.h>

#include "transport/bytes.h"
#include "transport/frame.h"
#include "transport/link_internal.h"

enum { ASK_US = 100000, IN_BYTES = 4096, OUT_BYTES = 192 };

struct listener {
    struct host_greeting *greeting;
    uint8_t in[IN_BYTES], out[OUT_BYTES];
    size_t heard, due, sent;
};

/* An acknowledgement of session 0, which is nobody's, has whoever hears it
 * greet.  A greeting of epoch 0 is passed over. */
static void make_question(struct listener *l, bool first_hello) {
    struct frame_header hello = {.kind = LINK_HELLO, .size = LINK_HELLO_SIZE};
    struct frame_header ask = {.kind = LINK_ACK};
    uint8_t payload[LINK_HELLO_SIZE] = {LINK_VERSION};
    l->sent = 0;
    l->due = 1;
    l->out[0] = 0;
    if (first_hello) {
        bytes_put16(payload + 2, CUBE_HOST);
        l->due += frame_encode(l->out + l->due, &hello, payload);
    }
    l->due += frame_encode(l->out + l->due, &ask, NULL);
}

static void take_frame(struct listener *l, const uint8_t *bytes, size_t size) {
    struct host_greeting *g = l->greeting;
    struct frame_header header;
    uint8_t hello[LINK_HELLO_SIZE];
    if (!frame_decode(bytes, size, &header, hello, sizeof hello)) {
        return;
    }
    g->learns = g->learns || (header.kind == LINK_ACK && header.session == 0);
    if (header.kind == LINK_HELLO && header.size == sizeof hello &&
        hello[7] != 0) {
        g->found = true;
        g->port = hello[1];
        g->node = bytes_get16(hello + 2);
        g->peer_node = bytes_get16(hello + 4);
        g->dimension = (uint8_t)(hello[7] - 1);
        g->frame_payload = bytes_get16(hello + 18);
    }
}

static void hear(struct listener *l, const struct link_pipe *pipe) {
    int got =
        pipe->receive(pipe->context, l->in + l->heard, sizeof l->in - l->heard);
    size_t begin = 0;
    if (got <= 0) {
        l->heard = got < 0 ? 0 : l->heard;
        return;
    }
    l->heard += (size_t)got;
    for (size_t i = 0; i < l->heard; i++) {
        if (l->in[i] == 0) {
            take_frame(l, l->in + begin, i - begin);
            begin = i + 1;
        }
    }
    l->heard -= begin;
    memmove(l->in, l->in + begin, l->heard);
    if (l->heard == sizeof l->in) {
        l->heard = 0; /* no frame is so long */
    }
}

void host_greeting_wait(struct host_greeting *greeting,
                        const struct host_machine *machine, bool first_hello,
                        uint64_t wait_us) {
    struct listener l;
    uint64_t begun_us = machine->now_us(machine->context), now_us = begun_us,
             asked_us = 0;
    memset(greeting, 0, sizeof *greeting);
    memset(&l, 0, sizeof l);
    l.greeting = greeting;
    while (!greeting->found && now_us - begun_us < wait_us) {
        if (asked_us == 0 || now_us - asked_us >= ASK_US) {
            make_question(&l, first_hello);
            asked_us = now_us;
        }
        if (l.sent < l.due) {
            int taken = machine->pipe.send(machine->pipe.context,
                                           l.out + l.sent, l.due - l.sent);
            l.sent = taken < 0 ? 0 : l.sent + (size_t)taken;
        }
        hear(&l, &machine->pipe);
        if (!greeting->found) {
            machine->idle(machine->context, ASK_US / 4);
        }
        now_us = machine->now_us(machine->context);
    }
}
