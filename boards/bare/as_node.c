#include "as_node.h"

#include <assert.h>
#include <string.h>

#include "bare.h"
#include "console.h"
#include "fault_text.h"
#include "node/answers.h"
#include "node/version.h"
#include "sections.h"
#include "stack.h"

enum {
    GUARD_US = 20000000, /* the longest piece of work takes 3 s on an M3 */
    FLUSH_US = 500000,   /* of farewells, when a run is over */
    LOOK_US = 50000,     /* at who greets, or types */
    SAID = 600           /* bytes of a record, at most */
};

/* --- what it says --------------------------------------------------------- */

static void tell(struct cube_text *text, const char *what, size_t number) {
    cube_text_put(text, what);
    cube_text_number(text, (uint32_t)number);
}

static void put_hex(struct cube_text *text, const uint8_t *bytes, size_t size) {
    for (size_t i = 0; i < size; i++) {
        char pair[3] = {"0123456789abcdef"[bytes[i] >> 4],
                        "0123456789abcdef"[bytes[i] & 15], '\0'};
        cube_text_put(text, pair);
    }
}

static void put_name(struct cube_text *text, const struct bare_node *bare) {
    cube_text_put(text, "incode: ");
    cube_text_put(text, board_facts.name);
    cube_text_put(text, bare->loader ? ": loader" : ": program");
}

static void put_memory(struct cube_text *text) {
    tell(text, "bytes: code ", bare_bytes(bare_code, bare_code_end));
    tell(text, ", stack ", BARE_STACK_BYTES);
    tell(text, ", tables ", bare_bytes(bare_tables, bare_tables_end));
    tell(text, ", arena ", bare_bytes(bare_arena, bare_arena_end));
    tell(text, " of ", board_facts.data_bytes);
    cube_text_put(text, "\r\n");
}

static void put_start(struct cube_text *text, const struct bare_node *bare) {
    cube_text_put(text, bare_reason_name(bare->reason.kind));
    if (board_facts.flash == NULL) {
        cube_text_put(text, "; no flash, a neighbour tells the epoch");
    } else if (bare->boot == 0) {
        cube_text_put(text, "; the flash takes no record of it: ");
        cube_text_put(text, board_facts.flash->worn);
        cube_text_put(text, "; a neighbour tells the epoch");
    } else {
        tell(text, "; boot ", bare->boot);
    }
    cube_text_put(text, "\r\n");
}

static void put_faults(struct cube_text *text, const struct bare_node *bare) {
    tell(text, "faults since power on: ", bare->reason.faults);
    if (bare->reason.faults > 0) {
        cube_text_put(text, "; the last: ");
        cube_text_put(text, bare->reason.text);
    }
    cube_text_put(text, "\r\n");
}

/* Lines end in \n alone there. */
static size_t tell_log(void *context, char *text, size_t size) {
    const struct bare_node *bare = context;
    char room[SAID];
    struct cube_text words = cube_text_in(room, sizeof room);
    size_t used = 0;
    cube_text_put(&words, "started after ");
    put_start(&words, bare);
    put_faults(&words, bare);
    for (size_t i = 0; i < words.size && used < size; i++)
        if (room[i] != '\r')
            text[used++] = room[i];
    return used;
}

/* --- what a node asks of its board ---------------------------------------- */

static uint64_t now_us(void *context) {
    (void)context;
    return board_now_us();
}

static uint64_t busy_us(void *context) {
    const struct bare_node *bare = context;
    return board_now_us() - bare->idle_us;
}

static bool anything(void) {
    for (unsigned i = 0; i <= board_facts.ports; i++)
        if (bare_uart_ready(&bare_uart[i]))
            return true;
    return false;
}

void bare_node_idle(struct bare_node *bare, uint64_t wait_us) {
    uint64_t begun_us = board_now_us(), now = begun_us;
    board_feed();
    while (!anything() && now - begun_us < wait_us) {
        uint32_t before = board_lock();
        if (!anything())
            board_wait(wait_us - (now - begun_us));
        board_unlock(before);
        board_feed();
        now = board_now_us();
    }
    bare->idle_us += now - begun_us;
}

static void idle(void *context, uint64_t wait_us) {
    bare_node_idle(context, wait_us);
}

static void gauges(void *context, struct node_gauges *gauges) {
    (void)context;
    gauges->stack_bytes = BARE_STACK_BYTES;
    gauges->stack_high_water = bare_stack_high_water();
    gauges->overruns = bare_uarts_overruns();
}

void bare_node_restart(enum bare_reason_kind reason) {
    bare_uarts_flush(FLUSH_US);
    bare_reason_keep(reason, NULL);
    board_restart();
}

void bare_node_end(enum node_reset why) {
    bare_node_restart(why == NODE_RESET_STAY    ? BARE_STAY
                      : why == NODE_RESET_AGAIN ? BARE_ASKED
                                                : BARE_RUN_OVER);
}

static void tell_who(void *context, struct node_who *who) {
    const struct bare_node *bare = context;
    const struct bare_handover *from = &bare->handover;
    who->kind = bare->loader ? NODE_KIND_LOADER : NODE_KIND_PROGRAM;
    node_who_name(who->board, sizeof who->board, board_facts.name);
    memcpy(who->loader, from->loader, sizeof who->loader);
    memcpy(who->serial, from->serial, sizeof who->serial);
    memcpy(who->digest, from->digest, sizeof who->digest);
    who->number = from->number;
    who->boot = bare->boot;
}

static uint32_t lost(void *context, unsigned d) {
    const struct bare_node *bare = context;
    bool host = d == bare->board.identity.dimension;
    return bare_uart[host ? 0 : d + 1].overruns;
}

/* --- its start ------------------------------------------------------------ */

static struct loader_budget kept __attribute__((section(".noinit.budget")));

static_assert(sizeof kept <= BARE_BUDGET_BYTES, "as start.ld has it");

void bare_node_begin(struct bare_node *bare, bool loader) {
    memset(bare, 0, sizeof *bare);
    bare->loader = loader;
    bare->budget = &kept;
    loader_budget_open(bare->budget);
    bare_uarts_init();
    bare_shell_init(&bare->shell, bare_uart_pipe(0));
    board_start();
    board_guard(GUARD_US);
    board_unlock(0);
}

void bare_node_may_start(struct bare_node *bare) {
    if (!loader_budget_has(bare->budget, LOADER_STARTS)) {
        bare_console_begin();
        bare_console_put("incode: too many starts since the board was switched "
                         "on; it waits for a minute at most\r\n");
        bare_console_end();
    }
    while (!loader_budget_take(bare->budget, LOADER_STARTS)) {
        bare_node_idle(bare, LOOK_US);
        loader_budget_pass(bare->budget, board_now_us());
    }
}

/* Its text is on the stack only now. */
__attribute__((noinline)) void
bare_node_tell_start(const struct bare_node *bare) {
    char room[SAID];
    struct cube_text text = cube_text_in(room, sizeof room);
    put_name(&text, bare);
    cube_text_put(&text, " started, version " NODE_VERSION ", after ");
    put_start(&text, bare);
    put_memory(&text);
    if (bare->reason.faults > 0)
        put_faults(&text, bare);
    bare_console_begin();
    bare_console_put(room);
    bare_console_end();
}

void bare_node_fill_in(struct bare_node *bare) {
    struct node_board *board = &bare->board;
    board->context = bare;
    board->now_us = now_us;
    board->busy_us = busy_us;
    board->idle = idle;
    board->gauges = gauges;
    board->who = tell_who;
    board->log = tell_log;
    board->lost = lost;
    board->arena = bare_arena;
    board->arena_bytes = bare_bytes(bare_arena, bare_arena_end);
    board->fixed_bytes = board_facts.data_bytes - board->arena_bytes;
    board->identity.serial_baud = board_facts.baud;
    board->source.boot = bare->boot;
    struct cube_text device =
        cube_text_in((char *)board->source.device, sizeof board->source.device);
    cube_text_put(&device, board_facts.name);
    for (unsigned d = 0; d < board_facts.ports; d++)
        board->pipes[d] = bare_uart_pipe(d + 1);
    (void)node_identity_epoch(&board->identity, &board->source);
}

void bare_node_learn(struct bare_node *bare) {
    struct node_board *board = &bare->board;
    struct node_identity *identity = &board->identity;
    struct link_pipe host = bare_shell_pipe(&bare->shell);
    board->pipes[board_facts.ports] = host;
    node_identity_listen_ports(&bare->learner, board, board_facts.ports, true);
    while (!node_identity_hear(&bare->learner, identity)) {
        node_identity_ask(&bare->learner, board_now_us());
        bare_node_console(bare);
        if (bare->waits != NULL)
            bare->waits();
        bare_node_idle(bare, LOOK_US);
    }
    bare->known = true;
    if (identity->epoch == 0)
        (void)node_identity_epoch_behind(&bare->learner, identity);
    for (unsigned d = identity->dimension; d <= board_facts.ports; d++)
        memset(&board->pipes[d], 0, sizeof board->pipes[d]);
    for (unsigned d = identity->dimension; d < board_facts.ports; d++)
        bare_uart_leave(d + 1);
    if (identity->self == 0 || identity->host_port)
        board->pipes[identity->dimension] = host;
    else
        bare_uart_leave(0);
}

/* --- what it is asked ----------------------------------------------------- */

static void answer_help(const struct bare_node *bare, struct cube_text *text) {
    (void)bare;
    cube_text_put(text, "who     board, version, image, number in its cube\r\n"
                        "links   its wires, and who is there\r\n"
                        "memory  what it is used for\r\n"
                        "fault   the last one, and why it started\r\n"
                        "help    these; more by incode console\r\n");
}

static bool is_known(const uint8_t *bytes, size_t size) {
    uint8_t all = 0;
    for (size_t i = 0; i < size; i++)
        all |= bytes[i];
    return all != 0;
}

/* What a loader has told, or has itself. */
static void put_image(struct cube_text *text, const struct bare_node *bare) {
    const struct bare_handover *from = &bare->handover;
    if (is_known(from->digest, sizeof from->digest)) {
        cube_text_put(text, ", image ");
        put_hex(text, from->digest, 8);
        tell(text, ", number ", from->number);
    } else if (bare->loader) {
        cube_text_put(text, ", no good image");
    }
    if (!bare->loader && is_known(from->loader, sizeof from->loader)) {
        cube_text_put(text, ", loader ");
        cube_text_printable(text, (const char *)from->loader);
    }
    if (is_known(from->serial, sizeof from->serial)) {
        cube_text_put(text, ", serial ");
        put_hex(text, from->serial, sizeof from->serial);
    }
}

static void answer_who(const struct bare_node *bare, struct cube_text *text) {
    put_name(text, bare);
    cube_text_put(text, ", version " NODE_VERSION);
    put_image(text, bare);
    if (bare->known) {
        tell(text, "\r\nnode ", bare->board.identity.self);
        tell(text, " of ", (size_t)1 << bare->board.identity.dimension);
        tell(text, ", epoch ", bare->board.identity.epoch);
    } else {
        cube_text_put(text, "\r\nno neighbour has said yet which node it is");
    }
    tell(text, ", up for ", (size_t)(board_now_us() / 1000000));
    cube_text_put(text, " s\r\n");
}

static void put_link(struct cube_text *text, const struct bare_node *bare,
                     unsigned d, const struct node_link_state *state) {
    static const char *const names[] = {"closed",     "not heard", "up",
                                        "silent",     "closing",   "left",
                                        "wired wrong"};
    bool host = d == bare->board.identity.dimension;
    tell(text, "UART ", host ? 0 : d + 1);
    if (host) {
        cube_text_put(text, ", host: ");
    } else {
        tell(text, ", node ", bare->board.identity.self ^ 1u << d);
        cube_text_put(text, ": ");
    }
    cube_text_put(text, state->state < sizeof names / sizeof names[0]
                            ? names[state->state]
                            : "?");
    tell(text, ", frames in ", state->frames_in);
    tell(text, ", out ", state->frames_out);
    tell(text, ", again ", state->retransmitted);
    tell(text, ", damaged ", state->bad);
    cube_text_put(text, "\r\n");
}

static void answer_links(const struct bare_node *bare, struct cube_text *text) {
    struct node_link_state state[CUBE_LINKS_MAX];
    unsigned links = bare->links == NULL ? 0 : bare->links(state);
    for (unsigned d = 0; d < links; d++)
        put_link(text, bare, d, &state[d]);
    if (links == 0) {
        cube_text_put(text, "no neighbour has said yet which node it is; wire "
                            "its UARTs 1 .. to those of others\r\n");
    }
}

static void answer_memory(const struct bare_node *bare,
                          struct cube_text *text) {
    (void)bare;
    put_memory(text);
    tell(text, "of the stack at most ", bare_stack_high_water());
    cube_text_put(text, " in use so far\r\n");
}

static void answer_fault(const struct bare_node *bare, struct cube_text *text) {
    cube_text_put(text, "started after ");
    put_start(text, bare);
    put_faults(text, bare);
}

static bool same(const char *a, const char *b) {
    while (*a != '\0' && (*a | 0x20) == *b) {
        a++;
        b++;
    }
    return *a == '\0' && *b == '\0';
}

static __attribute__((noinline)) void answer(struct bare_node *bare,
                                             const char *line) {
    static const struct {
        const char *word;
        void (*answer)(const struct bare_node *bare, struct cube_text *text);
    } words[] = {{"help", answer_help},
                 {"who", answer_who},
                 {"links", answer_links},
                 {"memory", answer_memory},
                 {"fault", answer_fault}};
    char room[SAID];
    struct cube_text text = cube_text_in(room, sizeof room);
    unsigned i = *line == '\0' ? 1 : 0; /* Enter alone: who is there? */
    while (*line != '\0' && i < sizeof words / sizeof words[0] &&
           !same(line, words[i].word))
        i++;
    cube_text_put(&text, "\r\n");
    if (i < sizeof words / sizeof words[0]) {
        words[i].answer(bare, &text);
    } else {
        cube_text_printable(&text, line);
        cube_text_put(&text, ": no such word; try help\r\n");
    }
    bare_shell_say(&bare->shell, room);
}

void bare_node_console(struct bare_node *bare) {
    char line[BARE_SHELL_LINE + 1];
    loader_budget_pass(bare->budget, board_now_us());
    if (bare_uart[0].unused)
        bare_shell_alone(&bare->shell);
    if (bare_shell_line(&bare->shell, line, board_now_us()))
        answer(bare, line);
}
