/* The node program on a bare board, from its start to its restart. */
#include <string.h>

#include "bare.h"
#include "boots.h"
#include "console.h"
#include "fault_text.h"
#include "node/identity.h"
#include "node/node.h"
#include "node/version.h"
#include "reason.h"
#include "sections.h"
#include "stack.h"

enum {
    GUARD_US = 20000000, /* the longest piece of work takes 3 s on an M3 */
    FLUSH_US = 500000    /* of farewells, when a run is over */
};

static struct {
    struct node_board board;
    struct learner learner;
    uint64_t idle_us;
} program;

/* --- what a node asks of its board ---------------------------------------- */

static uint64_t now_us(void *context)
{
    (void)context;
    return board_now_us();
}

static uint64_t busy_us(void *context)
{
    (void)context;
    return board_now_us() - program.idle_us;
}

static bool anything(void)
{
    for (unsigned i = 0; i <= board_facts.ports; i++) {
        if (bare_uart_ready(&bare_uart[i])) {
            return true;
        }
    }
    return false;
}

static void idle(void *context, uint64_t wait_us)
{
    uint64_t begun_us = board_now_us(), now = begun_us;
    (void)context;
    board_feed();
    while (!anything() && now - begun_us < wait_us) {
        uint32_t before = board_lock();
        if (!anything()) {
            board_wait(wait_us - (now - begun_us));
        }
        board_unlock(before);
        board_feed();
        now = board_now_us();
    }
    program.idle_us += now - begun_us;
}

static void gauges(void *context, struct node_gauges *gauges)
{
    (void)context;
    gauges->stack_bytes = BARE_STACK_BYTES;
    gauges->stack_high_water = bare_stack_high_water();
    gauges->overruns = bare_uarts_overruns();
}

static void reset(void *context, int status)
{
    (void)context;
    (void)status;
    bare_uarts_flush(FLUSH_US);
    bare_reason_keep(BARE_RUN_OVER, NULL);
    board_restart();
}

/* --- its start -------------------------------------------------------------
 */

static void tell(struct cube_text *text, const char *what, size_t number)
{
    cube_text_put(text, what);
    cube_text_number(text, (uint32_t)number);
}

/* Who and why, and the memory map.  Its text is on the stack only now. */
static __attribute__((noinline)) void
tell_start(const struct bare_reason *reason, uint32_t boot)
{
    char room[512];
    struct cube_text text = cube_text_in(room, sizeof room);
    cube_text_put(&text, "incode: ");
    cube_text_put(&text, board_facts.name);
    cube_text_put(&text, ": started, version " NODE_VERSION ", after ");
    cube_text_put(&text, bare_reason_name(reason->kind));
    if (board_facts.flash == NULL) {
        cube_text_put(&text, "; no flash, a neighbour tells the epoch");
    } else {
        tell(&text, "; boot ", boot);
    }
    tell(&text, "\r\nbytes: code ", bare_bytes(bare_code, bare_code_end));
    tell(&text, ", stack ", BARE_STACK_BYTES);
    tell(&text, ", tables ", bare_bytes(bare_tables, bare_tables_end));
    tell(&text, ", arena ", bare_bytes(bare_arena, bare_arena_end));
    tell(&text, " of ", board_facts.data_bytes);
    if (reason->faults > 0) {
        tell(&text, "\r\nfaults since power on: ", reason->faults);
        cube_text_put(&text, "; the last: ");
        cube_text_put(&text, reason->text);
    }
    cube_text_put(&text, "\r\n");
    bare_console_begin();
    bare_console_put(room);
    bare_console_end();
}

/* Its number, from who has greeted it; ends with the pipes in their places. */
static void learn(struct node_board *board)
{
    struct node_identity *identity = &board->identity;
    struct link_pipe host = bare_uart_pipe(0);
    board->pipes[board_facts.ports] = host;
    node_identity_listen_ports(&program.learner, board, board_facts.ports,
                               true);
    while (!node_identity_hear(&program.learner, identity)) {
        node_identity_ask(&program.learner, board_now_us());
        idle(NULL, 50000);
    }
    if (identity->epoch == 0) {
        (void)node_identity_epoch_behind(&program.learner, identity);
    }
    for (unsigned d = identity->dimension; d <= board_facts.ports; d++) {
        memset(&board->pipes[d], 0, sizeof board->pipes[d]);
    }
    for (unsigned d = identity->dimension; d < board_facts.ports; d++) {
        bare_uart_leave(d + 1);
    }
    if (identity->self == 0 || identity->host_port) {
        board->pipes[identity->dimension] = host;
    } else {
        bare_uart_leave(0);
    }
}

static void fill_in(struct node_board *board, uint32_t boot)
{
    board->now_us = now_us;
    board->busy_us = busy_us;
    board->idle = idle;
    board->reset = reset;
    board->gauges = gauges;
    board->arena = bare_arena;
    board->arena_bytes = bare_bytes(bare_arena, bare_arena_end);
    board->fixed_bytes = board_facts.data_bytes - board->arena_bytes;
    board->identity.serial_baud = board_facts.baud;
    board->source.boot = boot;
    struct cube_text device =
        cube_text_in((char *)board->source.device, sizeof board->source.device);
    cube_text_put(&device, board_facts.name);
    for (unsigned d = 0; d < board_facts.ports; d++) {
        board->pipes[d] = bare_uart_pipe(d + 1);
    }
}

_Noreturn void bare_main(void)
{
    struct node_board *board = &program.board;
    const char *why = NULL;
    uint32_t boot = 0;
    bare_uarts_init();
    board_start();
    board_guard(GUARD_US);
    board_unlock(0);
    struct bare_reason reason = bare_reason_take();
    if (board_facts.flash != NULL &&
        !bare_boots_next(board_facts.flash, &boot)) {
        bare_fault("the flash takes no record of this start", NULL, 0, 0);
    }
    tell_start(&reason, boot);
    fill_in(board, boot);
    (void)node_identity_epoch(&board->identity, &board->source);
    learn(board);
    struct node *node = node_start(board, &why);
    if (node == NULL) {
        bare_fault(why, NULL, 0, 0);
    }
    for (enum node_event event = NODE_BUSY; event != NODE_STOPPED;) {
        event = node_step(node);
        board_feed();
        if (event == NODE_IDLE) {
            idle(NULL, node_wait_us(node));
        }
    }
    board->reset(board->context, 0);
    board_restart();
}
