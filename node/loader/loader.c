#include "loader.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "incoming.h"
#include "node/answers.h"
#include "node/common.h"
#include "node/looks.h"
#include "node/version.h"
#include "transport/text.h"
#include "transport/routes.h"

enum { IDLE_MAX_US = 100000 };

struct loader {
    struct loader_incoming incoming;
    const struct node_board *board;
    struct loader_slots *slots;
    struct cube *cube;
    struct cube_wiring followed; /* its generation is the one at work */
    struct node_counted counted;
    struct node_looks looks;
    struct node_answers answers;
    struct node_pong_message pong; /* the answer that is owed, or was last */
    bool pinged;                   /* in this generation */
    bool owes_pong, owes_state, owes_fault;
    uint32_t transfer;       /* 0: none */
    enum loader_phase phase; /* at the last step */
    uint64_t now_us;
};

struct loader *loader_start(const struct node_board *board,
                            struct loader_slots *slots, const char **why) {
    uint8_t *memory = board->arena;
    size_t own = node_aligned(sizeof(struct loader));
    struct cube_config config = node_configure(
        &board->identity, board->arena_bytes + board->fixed_bytes);
    memcpy(config.pipes, board->pipes, sizeof config.pipes);
    INCODE_ASSERT((uintptr_t)board->arena % NODE_ALIGNMENT == 0);
    *why = cube_config_fault(&config);
    if (*why != NULL)
        return NULL;
    size_t cube = node_aligned(cube_arena_bytes(&config));
    if (board->arena_bytes < own + cube) {
        *why = "the memory does not hold the links' windows";
        return NULL;
    }
    struct loader *loader = board->arena;
    memset(loader, 0, sizeof *loader);
    loader->board = board;
    loader->slots = slots;
    loader->cube = cube_init(memory + own, cube, &config);
    INCODE_ASSERT(loader->cube != NULL);
    loader->counted.cube = loader->cube;
    loader->counted.self = board->identity.self;
    node_looks_init(&loader->looks, board, loader->cube);
    node_answers_init(&loader->answers, board, &loader->counted);
    loader_incoming_init(&loader->incoming, slots);
    return loader;
}

/* --- what comes ----------------------------------------------------------- */

static void take_ping(struct loader *l, const struct cube_message *message) {
    struct node_ping_message ping;
    if (message->size == sizeof ping) {
        memcpy(&ping, message->data, sizeof ping);
        l->pong.pinged = ping.sent;
        l->pong.received = l->counted.received;
        l->pinged = l->owes_pong = true;
    }
}

static void take_begin(struct loader *l, const struct cube_message *message) {
    struct loader_begin_message begin;
    unsigned self = l->board->identity.self;
    if (message->size != sizeof begin)
        return;
    memcpy(&begin, message->data, sizeof begin);
    if (begin.transfer != 0 && (begin.nodes[self / 8] >> self % 8 & 1) != 0) {
        l->transfer = begin.transfer;
        loader_incoming_begin(&l->incoming, begin.header, begin.bytes);
    }
}

static void take_block(struct loader *l, const struct cube_message *message) {
    struct loader_block_message head;
    if (message->size < sizeof head)
        return;
    memcpy(&head, message->data, sizeof head);
    if (head.transfer == l->transfer) {
        loader_incoming_block(
            &l->incoming, head.block, message->data + sizeof head,
            (uint32_t)(message->size - sizeof head), head.crc);
    }
}

/* It restarts once what is on its way has been passed on. */
static void leave(struct loader *l) {
    if (l->answers.restart == 0) {
        l->answers.restart = NODE_RESTART_PLAIN;
        l->answers.restart_us = l->now_us;
    }
}

static void take_order(struct loader *l, const struct cube_message *message) {
    struct loader_do_message order;
    if (message->size != sizeof order)
        return;
    memcpy(&order, message->data, sizeof order);
    if (order.transfer != 0 && order.transfer != l->transfer)
        return;
    switch (order.what) {
    case LOADER_VERIFY:
        loader_incoming_verify(&l->incoming);
        break;
    case LOADER_BOOT:
        leave(l);
        break;
    case LOADER_NAME:
        if (order.transfer != 0 && loader_incoming_proved(&l->incoming))
            (void)loader_slots_name(l->slots->rules->flash, order.serial);
        break;
    default: /* of a later version */
        break;
    }
}

static void serve_message(struct loader *l,
                          const struct cube_message *message) {
    switch (message->type) {
    case NODE_PING:
        take_ping(l, message);
        break;
    case NODE_STOP:
        leave(l);
        break;
    case NODE_SETUP:
        l->owes_fault = true;
        break;
    case NODE_IMAGE_BEGIN:
        take_begin(l, message);
        break;
    case NODE_IMAGE_BLOCK:
        take_block(l, message);
        break;
    case NODE_IMAGE_ASK:
        l->owes_state = true;
        break;
    case NODE_IMAGE_DO:
        take_order(l, message);
        break;
    default: /* for a node program */
        break;
    }
}

static void take_message(struct loader *l, const struct cube_message *message) {
    if (node_answers_is_for(message))
        node_answers_take(&l->answers, message, l->now_us);
    else if (message->source == CUBE_HOST)
        serve_message(l, message);
    l->counted.received +=
        message->source == CUBE_HOST && message->type != NODE_STOP;
}

/* What the flash is too busy for holds up its link.  Nothing is known of an
 * image that begins, until it has begun. */
static bool may_take(const struct loader *l,
                     const struct cube_message *message) {
    enum loader_work work = l->incoming.work;
    switch (message->type) {
    case NODE_IMAGE_BEGIN:
    case NODE_IMAGE_BLOCK:
    case NODE_IMAGE_DO:
        return work == LOADER_NO_WORK;
    case NODE_IMAGE_ASK:
        return work == LOADER_NO_WORK || work >= LOADER_WRITES;
    default:
        return true;
    }
}

/* Reads a link up to what is not to be taken yet. */
static unsigned read_link(struct loader *l, unsigned d) {
    struct cube_message message;
    unsigned moved = 0;
    while (cube_read_from(l->cube, d, &message)) {
        if (!may_take(l, &message)) {
            cube_put_back(l->cube);
            break;
        }
        take_message(l, &message);
        cube_release(l->cube);
        moved++;
    }
    return moved;
}

/* The host begins again with all nodes; what has come of the image stays. */
static void follow_wiring(struct loader *l) {
    const struct cube_wiring *wiring = cube_wiring(l->cube);
    if (wiring_together(wiring, &l->followed))
        return;
    l->followed = *wiring;
    l->pinged = l->owes_pong = l->owes_state = l->owes_fault = false;
    l->counted.received = l->counted.sent = 0;
    node_answers_forget(&l->answers);
}

/* --- what it says --------------------------------------------------------- */

static bool say(struct loader *l, uint8_t type, const void *data, size_t size) {
    return node_counted_write(&l->counted, CUBE_HOST, type, data, size) == 0;
}

static bool send_pong(struct loader *l) {
    l->pong.start = l->board->identity.epoch;
    l->pong.sent = l->counted.sent;
    l->pong.links = node_looks_seen(&l->looks);
    l->pong.silent = l->looks.silent;
    l->pong.work = l->incoming.programmed + l->incoming.erased;
    l->pong.awaited = INCODE_NONE;
    l->pong.owing = CUBE_HOST;
    return say(l, NODE_PONG, &l->pong, sizeof l->pong);
}

static const char no_record[] =
    "the flash takes no record of a start, and no image is started or taken: ";

/* An image is no role's: the run ends, and tells its user this. */
static bool send_fault(struct loader *l) {
    char room[NODE_FAULT_TEXT_MAX + 1];
    struct cube_text text = cube_text_in(room, sizeof room);
    cube_text_put(&text, "waits in its boot loader: ");
    if (l->slots->worn) {
        cube_text_put(&text, no_record);
        cube_text_put(&text, l->slots->rules->flash->worn);
    } else {
        cube_text_put(&text, "no program is running");
    }
    return say(l, NODE_FAULT, text.data, text.size);
}

static bool send_state(struct loader *l) {
    const struct loader_incoming *in = &l->incoming;
    struct loader_state_message state;
    memset(&state, 0, sizeof state);
    state.transfer = l->transfer;
    state.phase = in->phase;
    state.fault = in->fault;
    state.blocks = in->blocks;
    state.held = in->held;
    state.erased = in->erased;
    state.programmed = in->programmed;
    memcpy(state.map, in->map, sizeof state.map);
    return say(l, NODE_IMAGE_STATE, &state, loader_state_bytes(&state));
}

/* What it is itself, and what it would start. */
static void tell_who(void *context, struct node_who *who) {
    const struct loader *l = context;
    unsigned slot = l->slots->state.slot;
    who->kind = NODE_KIND_LOADER;
    node_who_name(who->version, sizeof who->version, NODE_VERSION);
    memcpy(who->loader, who->version, sizeof who->loader);
    (void)loader_slots_serial(l->slots->rules->flash, who->serial);
    memset(who->digest, 0, sizeof who->digest);
    who->number = 0;
    if (slot < LOADER_SLOTS && l->slots->known[slot] &&
        l->slots->fault[slot] == LOADER_GOOD) {
        memcpy(who->digest, l->slots->image[slot].digest, sizeof who->digest);
        who->number = l->slots->image[slot].number;
    }
    who->boot = l->slots->worn ? 0 : who->boot;
}

static size_t tell_log(void *context, char *text, size_t size) {
    const struct loader *l = context;
    struct cube_text log = cube_text_in(text, size);
    if (l->slots->worn) {
        cube_text_put(&log, no_record);
        cube_text_put(&log, l->slots->rules->flash->worn);
        cube_text_put(&log, "\n");
    }
    return log.size;
}

static void send(struct loader *l) {
    const struct node_teller teller = {
        .context = l, .who = tell_who, .log = tell_log};
    if (l->owes_fault)
        l->owes_fault = !send_fault(l);
    else if (l->owes_pong)
        l->owes_pong = !send_pong(l);
    if (l->owes_state)
        l->owes_state = !send_state(l);
    (void)node_answers_send(&l->answers, &teller, l->now_us);
}

/* --- a step --------------------------------------------------------------- */

/* What the host waits for to go on is said unasked. */
static void look_at_phase(struct loader *l) {
    enum loader_phase phase = l->incoming.phase;
    l->owes_state =
        l->owes_state || (phase != l->phase && phase >= LOADER_WHOLE);
    l->phase = phase;
}

enum node_event loader_step(struct loader *loader) {
    struct loader *l = loader;
    l->now_us = l->board->now_us(l->board->context);
    unsigned moved = node_looks_poll(&l->looks, l->now_us);
    follow_wiring(l);
    bool news = node_looks_silent(&l->looks, l->now_us);
    l->owes_pong = l->owes_pong || (news && l->pinged);
    for (unsigned d = 0; d < cube_links(l->cube); d++)
        moved += read_link(l, d);
    send(l);
    if (loader_incoming_busy(&l->incoming)) {
        loader_incoming_step(&l->incoming);
        moved++;
    }
    look_at_phase(l);
    if (loader_reset_why(l) != NODE_RESET_OVER)
        return NODE_STOPPED;
    return moved > 0 ? NODE_BUSY : NODE_IDLE;
}

enum node_reset loader_reset_why(const struct loader *loader) {
    return node_answers_restart(&loader->answers, loader->now_us);
}

unsigned loader_links(const struct loader *loader,
                      struct node_link_state state[CUBE_LINKS_MAX]) {
    return node_answers_links(&loader->answers, state);
}

uint64_t loader_wait_us(const struct loader *loader) {
    uint64_t due = cube_next_due_us(loader->cube, loader->now_us);
    return due < IDLE_MAX_US ? due : IDLE_MAX_US;
}
