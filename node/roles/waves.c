#include "waves.h"

#include <string.h>

void node_waves_init(struct node_waves *waves,
                     const struct node_setup_message *setup,
                     struct node_counted *counted, struct node_fault *fault) {
    memset(waves, 0, sizeof *waves);
    waves->counted = counted;
    waves->fault = fault;
    for (unsigned d = 0; 1u << d < setup->nodes; d++) {
        if ((counted->self & ((2u << d) - 1)) == 0) {
            waves->children |= (uint16_t)(1u << d);
        }
    }
}

static void begin(struct node_waves *w, uint32_t number, uint8_t command) {
    w->number = number;
    w->command = command;
    w->open = true;
    w->to_tell = w->to_answer = w->children;
    w->begun = w->begun || command != NODE_WAVE_READY;
    memset(&w->sum, 0, sizeof w->sum);
    w->sum.number = number;
}

void node_waves_begin(struct node_waves *waves) {
    begin(waves, 1, NODE_WAVE_READY);
}

static bool take_wave(struct node_waves *w,
                      const struct cube_message *message) {
    struct node_wave_message wave;
    unsigned parent = w->counted->self & (w->counted->self - 1u);
    if (message->size != sizeof wave || message->source != parent ||
        w->counted->self == 0 || w->open) {
        node_fault_set(w->fault, "a wave of # bytes from node #", message->size,
                       message->source);
        return false;
    }
    memcpy(&wave, message->data, sizeof wave);
    if (wave.number != w->number + 1 || wave.command < NODE_WAVE_READY ||
        wave.command > NODE_WAVE_SEED) {
        node_fault_set(w->fault, "wave # after wave #", wave.number, w->number);
        return false;
    }
    begin(w, wave.number, (uint8_t)wave.command);
    return true;
}

static void take_answer(struct node_waves *w,
                        const struct cube_message *message) {
    struct node_wave_answer_message answer = {.number = 0};
    uint32_t bit = message->source ^ w->counted->self;
    if (message->size == sizeof answer) {
        memcpy(&answer, message->data, sizeof answer);
    }
    if (message->size != sizeof answer || (bit & (bit - 1)) != 0 ||
        (w->to_answer & bit) == 0 || answer.number != w->number) {
        node_fault_set(w->fault, "an answer to wave # from node #", w->number,
                       message->source);
        return;
    }
    w->to_answer &= (uint16_t)~bit;
    w->sum.sent += answer.sent;
    w->sum.received += answer.received;
    w->sum.left += answer.left;
}

bool node_waves_take(struct node_waves *waves,
                     const struct cube_message *message) {
    if (message->type == NODE_WAVE) {
        return take_wave(waves, message);
    }
    take_answer(waves, message);
    return false;
}

/* At node 0: whether what was sent does not come, however long it is waited
 * for. */
static bool is_missing(struct node_waves *w, bool unchanged) {
    if (!unchanged || w->sum.sent == w->sum.received) {
        w->unchanged = 0;
        w->unchanged_us = w->now_us;
        return false;
    }
    w->unchanged++;
    return w->unchanged >= NODE_WAVES_UNCHANGED &&
           w->now_us - w->unchanged_us >= NODE_WAVES_UNCHANGED_US;
}

/* At node 0: all have answered.  What is next? */
static uint8_t conclude(struct node_waves *w) {
    const struct node_wave_answer_message *now = &w->sum;
    bool unchanged =
        now->sent == w->before.sent && now->received == w->before.received;
    bool same = unchanged && now->sent == now->received;
    uint8_t next = NODE_WAVE_COUNT;
    if (w->command == NODE_WAVE_READY) {
        same = false;
    } else if (now->left == 0) {
        w->over = true;
        return 0;
    }
    if (is_missing(w, unchanged)) {
        node_fault_set(w->fault,
                       "the exchange is stuck: all nodes are quiet, and of # "
                       "sent to others # have come",
                       (uint32_t)now->sent, (uint32_t)now->received);
        return 0;
    }
    if (same && w->command == NODE_WAVE_COUNT && w->before.number != 0) {
        if (w->seeded) {
            node_fault_set(w->fault,
                           "the exchange is stuck: all nodes are quiet, and # "
                           "bricks are not closed",
                           (uint32_t)now->left, 0);
            return 0;
        }
        w->seeded = true;
        next = NODE_WAVE_SEED;
    }
    w->before = *now;
    begin(w, w->number + 1, next);
    return next;
}

static unsigned tell_children(struct node_waves *w) {
    const struct node_wave_message wave = {w->number, w->command};
    unsigned sent = 0;
    for (unsigned d = 0; w->to_tell >> d != 0; d++) {
        uint16_t child = (uint16_t)(w->counted->self | 1u << d);
        if ((w->to_tell >> d & 1) != 0 &&
            node_counted_write(w->counted, child, NODE_WAVE, &wave,
                               sizeof wave) == 0) {
            w->to_tell &= (uint16_t) ~(1u << d);
            sent++;
        }
    }
    return sent;
}

unsigned node_waves_send(struct node_waves *waves,
                         const struct node_waves_state *state,
                         uint8_t *command) {
    struct node_waves *w = waves;
    unsigned sent = tell_children(w);
    bool may_answer =
        w->command == NODE_WAVE_READY ? state->ready : state->quiet;
    *command = 0;
    if (!w->open || w->to_answer != 0 || w->to_tell != 0 || !may_answer) {
        return sent;
    }
    struct node_wave_answer_message answer = w->sum;
    answer.sent += state->sent;
    answer.received += state->received;
    answer.left += state->left;
    if (w->counted->self == 0) {
        w->open = false;
        w->sum = answer;
        *command = conclude(w);
        return sent + 1;
    }
    uint16_t parent = w->counted->self & (uint16_t)(w->counted->self - 1);
    if (node_counted_write(w->counted, parent, NODE_WAVE_ANSWER, &answer,
                           sizeof answer) == 0) {
        w->open = false;
        sent++;
    }
    return sent;
}
