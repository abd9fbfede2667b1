#include <string.h>

#include "spread.h"
#include "transport/frame.h"

enum {
    ASK_US = 500000,
    REPLY_BYTES = 96, /* on a wire, and the map */
    ASKS_A_PATIENCE = 4,
    ANSWER_US = 2000000, /* within which an answer comes, */
    QUEUE_BYTES = 20480, /* with so much before the question on its way, */
    SLOWER = 6, /* on a wire that carries so much less than is said of it */
    LEAVE_US = 10000000, /* a board restarts within */
    MESSAGE_MAX = sizeof(struct loader_block_message) + LOADER_BLOCK_BYTES
};

static bool send(struct host_spread *spread, uint16_t dest, uint8_t type,
                 const void *data, size_t size) {
    return host_session_send(spread->session, dest, type, data, size);
}

static bool order(struct host_spread *spread, unsigned i,
                  enum loader_order what) {
    const struct loader_do_message message = {.transfer = spread->transfer,
                                              .what = what};
    return send(spread, (uint16_t)i, NODE_IMAGE_DO, &message, sizeof message);
}

/* Whether it is time to tell it again. */
static bool is_due(const struct host_spread *spread,
                   const struct host_spread_node *n) {
    return n->told_us == 0 || spread->now_us - n->told_us >= SPREAD_AGAIN_US;
}

/* --- to the loader, and to begin ------------------------------------------ */

static int restart_those_that_run(struct host_spread *spread,
                                  struct host_error *error) {
    struct host_node_set set = {{0}};
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        struct host_spread_node *n = &spread->node[i];
        bool runs =
            spread->session->node[i].there && spread->session->node[i].heard;
        if (n->phase == HOST_SPREAD_LEAVES && runs && is_due(spread, n)) {
            host_node_set_add(&set, i);
            n->told_us = spread->now_us;
            n->left = true;
        }
    }
    return host_node_set_count(&set) == 0
               ? 0
               : host_session_restart(spread->session, &set, NODE_RESTART_STAY,
                                      error);
}

/* To all at once, unless it is for one alone. */
static void begin(struct host_spread *spread) {
    struct loader_begin_message message = {
        .transfer = spread->transfer, .bytes = (uint32_t)spread->options.bytes};
    unsigned count = 0, last = 0;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        const struct host_spread_node *n = &spread->node[i];
        if (spread_in_loader(spread, i) && n->begin_due &&
            n->phase < HOST_SPREAD_STARTS && is_due(spread, n)) {
            message.nodes[i / 8] |= (uint8_t)(1u << i % 8);
            count++;
            last = i;
        }
    }
    memcpy(message.header, spread->options.image, LOADER_HEADER_BYTES);
    if (count == 0 || !send(spread, count == 1 ? (uint16_t)last : CUBE_ALL,
                            NODE_IMAGE_BEGIN, &message, sizeof message))
        return;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++)
        if ((message.nodes[i / 8] >> i % 8 & 1) != 0)
            spread->node[i].told_us = spread->now_us;
    spread->ask_due = true;
}

static bool has_answered(const struct host_spread_node *n) {
    return n->asks > 0 && n->replies == n->asks;
}

/* Within the transfer, once the board has proved the image's signature. */
static void name(struct host_spread *spread, unsigned i) {
    static const uint8_t nobody[NODE_SERIAL_BYTES];
    const struct host_spread_options *options = &spread->options;
    struct host_spread_node *n = &spread->node[i];
    struct loader_do_message message = {.transfer = spread->transfer,
                                        .what = LOADER_NAME};
    bool proved = n->phase >= HOST_SPREAD_TAKES &&
                  n->phase <= HOST_SPREAD_VERIFIED && has_answered(n);
    bool nameless =
        memcmp(spread->session->node[i].who.serial, nobody, sizeof nobody) == 0;
    if (proved && nameless && !n->named && options->serial != NULL &&
        options->serial(options->context, message.serial)) {
        n->named =
            send(spread, (uint16_t)i, NODE_IMAGE_DO, &message, sizeof message);
    }
}

/* --- what each lacks ------------------------------------------------------ */

static bool is_asked(const struct host_spread *spread, unsigned i) {
    return spread_in_loader(spread, i) &&
           spread->node[i].phase < HOST_SPREAD_VERIFIED;
}

/* Answers take a tenth of the slowest wire at most, by what it is said to
 * carry, and are waited for a third of the time, by what they took the last
 * time. */
static uint64_t ask_interval(const struct host_spread *spread, unsigned nodes) {
    uint32_t baud = spread->session->machine->serial_baud;
    uint64_t took_us = spread->answered_us > spread->asked_us
                           ? spread->answered_us - spread->asked_us
                           : 0;
    uint64_t bits = UINT64_C(10) * nodes * (REPLY_BYTES + spread->blocks / 8);
    uint64_t us = baud == 0 ? 0 : UINT64_C(10) * bits * 1000000 / baud;
    uint64_t most = spread->options.patience_us / ASKS_A_PATIENCE;
    us = us < 3 * took_us ? 3 * took_us : us;
    us = us < most ? us : most;
    return us < ASK_US ? ASK_US : us;
}

/* Within which an answer comes, if it does. */
static uint64_t answer_time(const struct host_spread *spread) {
    uint32_t baud = spread->session->machine->serial_baud;
    return ANSWER_US +
           (baud == 0 ? 0
                      : UINT64_C(10) * QUEUE_BYTES * SLOWER * 1000000 / baud);
}

static bool send_ask(struct host_spread *spread, unsigned count,
                     unsigned last) {
    const struct loader_ask_message message = {spread->transfer};
    if (!send(spread, count == 1 ? (uint16_t)last : CUBE_ALL, NODE_IMAGE_ASK,
              &message, sizeof message))
        return false;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        struct host_spread_node *n = &spread->node[i];
        if (is_asked(spread, i)) {
            n->silent += n->replies < n->asks;
            n->replies = n->asks++;
            n->begin_due = n->begin_due || n->silent > 2;
        }
    }
    spread->asked_us = spread->now_us;
    spread->ask_due = spread->ask_lost = false;
    return true;
}

static void ask(struct host_spread *spread) {
    unsigned count = 0, silent = 0, last = 0;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        if (is_asked(spread, i)) {
            count++;
            silent += spread->node[i].asks > spread->node[i].replies;
            last = i;
        }
    }
    uint64_t passed = spread->now_us - spread->asked_us;
    bool open = silent > 0 && !spread->ask_lost && passed < answer_time(spread);
    bool due = spread->ask_due || (spread->ask_lost && silent > 0) ||
               passed >= ask_interval(spread, count);
    if (count > 0 && due && !open)
        (void)send_ask(spread, count, last);
}

/* --- blocks --------------------------------------------------------------- */

/* Whether the others wait for what it says it lacks. */
static bool is_waited_for(const struct host_spread *spread, unsigned i) {
    const struct host_spread_node *n = &spread->node[i];
    uint64_t passed = spread->now_us - n->moved_us;
    if (n->phase == HOST_SPREAD_LEAVES)
        return spread_wanted(spread, i) && passed < LEAVE_US;
    bool silent = n->phase == HOST_SPREAD_BEGINS || !has_answered(n);
    return is_asked(spread, i) && n->phase <= HOST_SPREAD_TAKES && silent &&
           passed < answer_time(spread);
}

/* A pass begins once all who will be in it have said what they lack. */
static bool may_plan(const struct host_spread *spread) {
    for (unsigned i = 0; i < spread->session->machine->nodes; i++)
        if (is_waited_for(spread, i))
            return false;
    return !spread->ask_due;
}

/* Whether there is, or may come, a node of which it is not known what it lacks.
 */
static bool is_any_unknown(const struct host_spread *spread) {
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        const struct host_spread_node *n = &spread->node[i];
        bool known = n->phase > HOST_SPREAD_TAKES ||
                     (n->phase == HOST_SPREAD_TAKES && has_answered(n));
        if (spread_wanted(spread, i) && !known)
            return true;
    }
    return false;
}

static void plan(struct host_spread *spread) {
    uint16_t *dest = spread->dest;
    bool unknown = is_any_unknown(spread);
    for (uint32_t b = 0; b < spread->blocks; b++)
        dest[b] = CUBE_HOST;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        const struct host_spread_node *n = &spread->node[i];
        if (!spread_in_loader(spread, i) || n->phase != HOST_SPREAD_TAKES ||
            !has_answered(n))
            continue;
        for (uint32_t b = 0; b < spread->blocks; b++) {
            if ((n->map[b / 8] >> b % 8 & 1) == 0) {
                dest[b] =
                    dest[b] == CUBE_HOST && !unknown ? (uint16_t)i : CUBE_ALL;
                spread->passing = true;
            }
        }
    }
    spread->next = 0;
}

static bool send_block(struct host_spread *spread, uint32_t block) {
    uint8_t bytes[MESSAGE_MAX];
    size_t at = (size_t)block * LOADER_BLOCK_BYTES;
    size_t size = spread->options.bytes - at;
    size = size < LOADER_BLOCK_BYTES ? size : LOADER_BLOCK_BYTES;
    const struct loader_block_message head = {
        .transfer = spread->transfer,
        .block = block,
        .crc = frame_crc32c(0, spread->options.image + at, size)};
    memcpy(bytes, &head, sizeof head);
    memcpy(bytes + sizeof head, spread->options.image + at, size);
    return send(spread, spread->dest[block], NODE_IMAGE_BLOCK, bytes,
                sizeof head + size);
}

void spread_blocks(struct host_spread *spread) {
    if (!spread->passing && may_plan(spread))
        plan(spread);
    while (spread->passing) {
        if (spread->next == spread->blocks) {
            spread->passing = false;
            spread->ask_due = true;
        } else if (spread->dest[spread->next] == CUBE_HOST) {
            spread->next++;
        } else if (send_block(spread, spread->next)) {
            spread->next++;
            spread->sent++;
        } else {
            return;
        }
    }
}

/* --- verify, and start ---------------------------------------------------- */

static void verify(struct host_spread *spread, unsigned i) {
    struct host_spread_node *n = &spread->node[i];
    if (n->phase == HOST_SPREAD_WHOLE && spread_in_loader(spread, i) &&
        is_due(spread, n) && order(spread, i, LOADER_VERIFY)) {
        n->told_us = spread->now_us;
        spread->ask_due = true;
    }
}

/* None is on its way any more that will be there soon: starts take the way to
 * others away for a while. */
static bool may_boot(const struct host_spread *spread) {
    uint64_t now = spread->now_us;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        const struct host_spread_node *n = &spread->node[i];
        bool off = n->phase == HOST_SPREAD_AWAITED &&
                   (!n->left || now - n->moved_us >= LEAVE_US);
        if (spread_wanted(spread, i) && n->phase < HOST_SPREAD_VERIFIED && !off)
            return false;
    }
    return true;
}

static bool boot(struct host_spread *spread, unsigned i) {
    struct host_spread_node *n = &spread->node[i];
    bool starts = spread_in_loader(spread, i) &&
                  (n->phase == HOST_SPREAD_VERIFIED ||
                   (n->phase == HOST_SPREAD_STARTS && is_due(spread, n)));
    bool home = spread_goes_home(spread, i) && is_due(spread, n);
    if (!starts && !home)
        return true;
    if (!order(spread, i, LOADER_BOOT))
        return false;
    if (home) {
        n->homeward++;
    } else {
        n->booted = true;
        n->boot_start = n->start;
        spread_set(spread, i, HOST_SPREAD_STARTS);
    }
    n->told_us = spread->now_us;
    return true;
}

/* The farthest ones first: their way leads over the others. */
static void boot_all(struct host_spread *spread) {
    struct host_machine *machine = spread->session->machine;
    if (!may_boot(spread))
        return;
    for (unsigned far = machine->dimension + 1; far-- > 0;) {
        for (unsigned i = 0; i < machine->nodes; i++)
            if ((unsigned)__builtin_popcount(i) == far && !boot(spread, i))
                return;
    }
}

int spread_orders(struct host_spread *spread, struct host_error *error) {
    if (restart_those_that_run(spread, error) != 0)
        return error->code;
    begin(spread);
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        if (spread_in_loader(spread, i)) {
            name(spread, i);
            verify(spread, i);
        }
    }
    ask(spread);
    boot_all(spread);
    return 0;
}
