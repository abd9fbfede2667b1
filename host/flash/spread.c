#include "spread.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/text.h"

enum {
    GRACE_US = 3000000,   /* nodes that are there are known within */
    ARRIVAL_US = 1500000, /* where none has come for so long, none does soon */
    LOOK_US = 50000
};

static void look_at_clock(struct host_spread *spread) {
    struct host_machine *machine = spread->session->machine;
    spread->now_us = machine->now_us(machine->context);
}

static void spread_hear(struct host_spread *spread, unsigned i,
                        const struct loader_state_message *state);

static void take(void *context, const struct cube_message *message) {
    struct host_spread *spread = context;
    struct loader_state_message state = {0};
    bool good = message->type == NODE_IMAGE_STATE &&
                message->size >= sizeof state - sizeof state.map &&
                message->size <= sizeof state &&
                message->source < spread->session->machine->nodes;
    if (good) {
        memcpy(&state, message->data, message->size);
        spread_hear(spread, message->source, &state);
    }
}

int host_spread_open(struct host_spread *spread, struct host_session *session,
                     const struct host_spread_options *options,
                     struct host_error *error) {
    *spread = (struct host_spread){.session = session,
                                   .options = *options,
                                   .transfer = session->machine->epoch,
                                   .generation = session->generation};
    spread->blocks = (uint32_t)((options->bytes + LOADER_BLOCK_BYTES - 1) /
                                LOADER_BLOCK_BYTES);
    assert(options->bytes >= LOADER_HEADER_BYTES &&
           spread->blocks <= LOADER_BLOCKS_MAX);
    (void)loader_image_unpack(&spread->image, options->image);
    spread->node = calloc(session->machine->nodes, sizeof *spread->node);
    if (spread->node == NULL)
        return host_fail_memory(error, "what is known of the nodes");
    look_at_clock(spread);
    spread->began_us = spread->arrived_us = spread->now_us;
    for (unsigned i = 0; i < session->machine->nodes; i++) {
        spread->node[i].moved_us = spread->began_us;
        spread->node[i].blocks = spread->blocks;
    }
    session->take = take;
    session->context = spread;
    return 0;
}

void host_spread_close(struct host_spread *spread) {
    spread->session->take = NULL;
    free(spread->node);
}

/* --- a look --------------------------------------------------------------- */

static bool has_looked(const struct host_spread *spread) {
    uint64_t now = spread->now_us;
    bool all = true;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        all = all && (!spread_wanted(spread, i) ||
                      spread->node[i].phase != HOST_SPREAD_AWAITED);
    }
    return all || (now - spread->began_us >= GRACE_US &&
                   now - spread->arrived_us >= ARRIVAL_US);
}

static void spread_judge(struct host_spread *spread, unsigned i);

static void judge_all(struct host_spread *spread) {
    look_at_clock(spread);
    for (unsigned i = 0; i < spread->session->machine->nodes; i++)
        if (spread_wanted(spread, i))
            spread_judge(spread, i);
}

int host_spread_look(struct host_spread *spread, struct host_error *error) {
    int status = 0;
    judge_all(spread);
    while (status == 0 && !has_looked(spread)) {
        status = host_session_round(spread->session, LOOK_US, error);
        judge_all(spread);
    }
    spread->looked = true;
    return status;
}

/* --- steps ---------------------------------------------------------------- */

static void say(const struct host_spread *spread, const char *line) {
    if (spread->options.say != NULL)
        spread->options.say(spread->options.context, line);
}

/* Says once of each absence whom it waits for. */
static void say_who_is_awaited(struct host_spread *spread) {
    struct host_node_set set = {{0}};
    char nodes[HOST_SPREAD_TEXT + 8], why[HOST_SPREAD_TEXT],
        line[2 * HOST_SPREAD_TEXT + 80];
    unsigned first = spread->session->machine->nodes;
    for (unsigned i = spread->session->machine->nodes; i-- > 0;) {
        struct host_spread_node *n = &spread->node[i];
        if (spread_wanted(spread, i) && n->phase == HOST_SPREAD_AWAITED &&
            !n->said && spread->now_us - n->moved_us >= GRACE_US) {
            host_node_set_add(&set, i);
            n->said = true;
            first = i;
        }
    }
    if (first == spread->session->machine->nodes)
        return;
    host_node_set_name(&set, nodes, sizeof nodes);
    const char *reason =
        host_session_reason(spread->session, first, why, sizeof why);
    snprintf(line, sizeof line, "%s: %.*s; waits for up to %llu s", nodes,
             (int)strcspn(reason, ";"), reason,
             (unsigned long long)(spread->options.patience_us / 1000000));
    say(spread, line);
}

bool host_spread_over(const struct host_spread *spread) {
    for (unsigned i = 0; i < spread->session->machine->nodes; i++)
        if (spread_wanted(spread, i) &&
            (!spread_ended(&spread->node[i]) || spread_goes_home(spread, i)))
            return false;
    return true;
}

/* With a generation goes what was on its way: it is said again, and nobody
 * waits for answers to it. */
static void look_at_generation(struct host_spread *spread) {
    if (spread->generation == spread->session->generation)
        return;
    spread->generation = spread->session->generation;
    spread->ask_lost = true;
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        struct host_spread_node *n = &spread->node[i];
        if (n->phase >= HOST_SPREAD_BEGINS && n->phase < HOST_SPREAD_STARTS)
            n->told_us = 0;
    }
}

static void spread_expire(struct host_spread *spread, unsigned i);

int host_spread_step(struct host_spread *spread, uint64_t wait_us,
                     struct host_error *error) {
    look_at_generation(spread);
    judge_all(spread);
    if (spread_orders(spread, error) != 0)
        return error->code;
    spread_blocks(spread);
    int status = host_session_round(spread->session, wait_us, error);
    for (unsigned i = 0; i < spread->session->machine->nodes; i++)
        if (spread_wanted(spread, i) && !spread_ended(&spread->node[i]))
            spread_expire(spread, i);
    say_who_is_awaited(spread);
    return status;
}

static void spread_explain(struct host_spread *spread, unsigned i);

/* The last that a board that has fallen back says for itself. */
static int ask_for_logs(struct host_spread *spread, struct host_error *error) {
    enum { LOG_US = 3000000 };
    struct host_node_set set = {{0}};
    for (unsigned i = 0; i < spread->session->machine->nodes; i++)
        if (spread->node[i].phase == HOST_SPREAD_FELL_BACK)
            host_node_set_add(&set, i);
    if (host_node_set_count(&set) == 0)
        return 0;
    int status =
        host_session_ask(spread->session, &set, NODE_LOG, 0, LOG_US, error);
    for (unsigned i = 0; status == 0 && i < spread->session->machine->nodes;
         i++)
        if (host_node_set_has(&set, i))
            spread_explain(spread, i);
    return status;
}

int host_spread_run(struct host_spread *spread, struct host_error *error) {
    int status = spread->looked ? 0 : host_spread_look(spread, error);
    while (status == 0 && !host_spread_over(spread))
        status = host_spread_step(spread, LOOK_US, error);
    return status == 0 ? ask_for_logs(spread, error) : status;
}

/* --- what has come of it -------------------------------------------------- */

static bool has_failed(const struct host_spread *spread, unsigned i) {
    return spread_wanted(spread, i) &&
           spread->node[i].phase >= HOST_SPREAD_REFUSED;
}

/* Those with which the same is wrong as with the first that is not `told`. */
static unsigned gather(const struct host_spread *spread,
                       struct host_node_set *told, struct host_node_set *set) {
    unsigned first = spread->session->machine->nodes;
    *set = (struct host_node_set){{0}};
    for (unsigned i = 0; i < spread->session->machine->nodes; i++) {
        if (!has_failed(spread, i) || host_node_set_has(told, i))
            continue;
        first = first == spread->session->machine->nodes ? i : first;
        if (strcmp(spread->node[i].text, spread->node[first].text) == 0) {
            host_node_set_add(set, i);
            host_node_set_add(told, i);
        }
    }
    return first;
}

int host_spread_result(struct host_spread *spread, struct host_error *error) {
    struct host_node_set told = {{0}}, set;
    char nodes[HOST_SPREAD_TEXT + 8], line[2 * HOST_SPREAD_TEXT + 16] = "";
    unsigned all = spread->session->machine->nodes, i;
    int code = 0;
    while ((i = gather(spread, &told, &set)) < all) {
        if (code != 0)
            say(spread, line);
        host_node_set_name(&set, nodes, sizeof nodes);
        snprintf(line, sizeof line, "%s: %s", nodes, spread->node[i].text);
        bool refused = spread->node[i].phase == HOST_SPREAD_REFUSED;
        code = refused && code != HOST_CUBE ? HOST_INPUT : HOST_CUBE;
    }
    return code == 0 ? 0 : host_fail(error, code, "%s", line);
}

const char *host_spread_phase_text(enum host_spread_phase phase) {
    static const char *const texts[] = {
        [HOST_SPREAD_AWAITED] = "is not there",
        [HOST_SPREAD_LEAVES] = "restarts into its loader",
        [HOST_SPREAD_BEGINS] = "is in its loader",
        [HOST_SPREAD_TAKES] = "takes blocks",
        [HOST_SPREAD_WHOLE] = "verifies",
        [HOST_SPREAD_VERIFIED] = "verified",
        [HOST_SPREAD_STARTS] = "starts it",
        [HOST_SPREAD_DONE] = "runs it",
        [HOST_SPREAD_HAS] = "had it already",
        [HOST_SPREAD_PASSED] = "passed over",
        [HOST_SPREAD_REFUSED] = "refused",
        [HOST_SPREAD_FELL_BACK] = "fell back",
        [HOST_SPREAD_LOST] = "given up"};
    return texts[phase];
}

/* --- spread node ---------------------------------------------------------- */

static const uint8_t nothing[NODE_DIGEST_BYTES];

bool spread_in_loader(const struct host_spread *spread, unsigned i) {
    const struct host_session_node *seen = &spread->session->node[i];
    return spread_wanted(spread, i) && seen->there &&
           seen->who.kind == NODE_KIND_LOADER &&
           !spread_ended(&spread->node[i]);
}

bool spread_goes_home(const struct host_spread *spread, unsigned i) {
    enum { TRIES = 3 };
    const struct host_session_node *seen = &spread->session->node[i];
    const struct host_spread_node *n = &spread->node[i];
    return n->phase == HOST_SPREAD_REFUSED && n->left && seen->there &&
           seen->starts == n->start && n->homeward <= TRIES;
}

static void tell(const struct host_spread *spread, unsigned i) {
    const struct host_spread_options *options = &spread->options;
    if (options->changed != NULL)
        options->changed(options->context, i);
}

void spread_set(struct host_spread *spread, unsigned i,
                enum host_spread_phase phase) {
    struct host_spread_node *n = &spread->node[i];
    if (n->phase != phase) {
        n->phase = phase;
        n->told_us = 0;
        n->moved_us = spread->now_us;
        tell(spread, i);
    }
}

__attribute__((format(printf, 4, 5))) static void
end(struct host_spread *spread, unsigned i, enum host_spread_phase phase,
    const char *format, ...) {
    struct host_spread_node *n = &spread->node[i];
    va_list list;
    va_start(list, format);
    (void)vsnprintf(n->text, sizeof n->text, format, list);
    va_end(list);
    spread_set(spread, i, phase);
}

static void refuse(struct host_spread *spread, unsigned i,
                   enum loader_fault fault) {
    static const char *const next[LOADER_FAULTS] = {
        [LOADER_TOO_LARGE] = "build a smaller one",
        [LOADER_WRONG_BOARD] = "give the image of its board",
        [LOADER_WRONG_ADDRESS] = "build it with make firmware, for the loader "
                                 "that the board has",
        [LOADER_TOO_OLD] = "sign it with a higher number: incode sign IMAGE "
                           "--key FILE --number N",
        [LOADER_UNSIGNED] = "sign it: incode sign IMAGE --key FILE",
        [LOADER_WRONG_KEY] = "sign it with the pair whose public half is in "
                             "the board's loader: incode sign IMAGE --key FILE",
        [LOADER_WORN] = "reset the board and flash again; if that does not "
                        "help, its log says why its flash takes nothing",
        [LOADER_TOO_OFTEN] = "flash again in a minute; if that does not help, "
                             "switch the board off and on"};
    const char *what = loader_fault_text(fault);
    bool known = (unsigned)fault < LOADER_FAULTS && next[fault] != NULL;
    end(spread, i, HOST_SPREAD_REFUSED, "refuses the image: %s; %s",
        what == NULL ? "it does not say why" : what,
        known ? next[fault] : "build or copy it anew");
}

/* --- by who it is --------------------------------------------------------- */

static void begin_anew(struct host_spread *spread, unsigned i) {
    const struct host_session_node *seen = &spread->session->node[i];
    struct host_spread_node *n = &spread->node[i];
    n->start = seen->starts;
    n->starts++;
    n->begin_due = true;
    n->named = n->said = false;
    n->asks = n->replies = n->silent = 0;
    n->told_us = 0;
    n->moved_us = spread->arrived_us = spread->now_us;
}

/* Of what it is known to be, nothing has to be heard. */
static bool pass_over(struct host_spread *spread, unsigned i) {
    const struct host_spread_options *options = &spread->options;
    const char *known =
        options->board == NULL ? NULL : options->board(options->context, i);
    if (known == NULL || strcmp(known, spread->image.board) == 0)
        return false;
    end(spread, i, HOST_SPREAD_PASSED, "is no %s but %s", spread->image.board,
        known);
    return true;
}

static void judge_program(struct host_spread *spread, unsigned i) {
    const struct node_who *who = &spread->session->node[i].who;
    struct host_spread_node *n = &spread->node[i];
    bool same =
        memcmp(who->digest, spread->image.digest, sizeof who->digest) == 0;
    if (memcmp(who->loader, nothing, sizeof who->loader) == 0) {
        end(spread, i, HOST_SPREAD_REFUSED,
            "has no loader in it; copy its image to where the board "
            "starts from: boards/README.md says how");
    } else if (same && n->booted) {
        spread_set(spread, i, HOST_SPREAD_DONE);
    } else if (same && !spread->options.again) {
        spread_set(spread, i, n->left ? HOST_SPREAD_DONE : HOST_SPREAD_HAS);
    } else if (n->booted && n->start != n->boot_start) {
        end(spread, i, HOST_SPREAD_FELL_BACK,
            "did not come up with the image, and went back to the old");
    } else {
        spread_set(spread, i, HOST_SPREAD_LEAVES);
    }
}

static void judge_loader(struct host_spread *spread, unsigned i) {
    struct host_spread_node *n = &spread->node[i];
    if (n->booted && n->start != n->boot_start) {
        end(spread, i, HOST_SPREAD_FELL_BACK,
            "did not come up with the image, and waits in its loader");
    } else if (n->phase < HOST_SPREAD_BEGINS) {
        spread_set(spread, i, HOST_SPREAD_BEGINS);
    }
}

static void judge_kind(struct host_spread *spread, unsigned i) {
    const struct node_who *who = &spread->session->node[i].who;
    char board[NODE_BOARD_BYTES + 1] = "";
    memcpy(board, who->board, sizeof who->board);
    if (who->kind == NODE_KIND_PROCESS) {
        end(spread, i, HOST_SPREAD_REFUSED,
            "is a process of a system; incode deploy brings its program "
            "there, or leave it out with --nodes");
    } else if (strcmp(board, spread->image.board) != 0) {
        end(spread, i, HOST_SPREAD_REFUSED,
            "is no %s but %s; give an image for that, or leave it out "
            "with --nodes",
            spread->image.board, board);
    } else if (who->kind == NODE_KIND_PROGRAM) {
        judge_program(spread, i);
    } else {
        judge_loader(spread, i);
    }
}

/* Not heard for as long as a loader may be busy with its flash, or its answers
 * wait on a slow wire behind those of others. */
static bool is_absent(const struct host_spread *spread, unsigned i) {
    enum { BUSY_US = 15000000 };
    const struct host_session_node *seen = &spread->session->node[i];
    struct host_spread_node *n = &spread->node[i];
    if (seen->heard)
        n->heard_us = spread->now_us;
    return !seen->there || spread->now_us - n->heard_us > BUSY_US;
}

/* A node that is told to restart is not there for a while. */
static void judge_absent(struct host_spread *spread, unsigned i) {
    struct host_spread_node *n = &spread->node[i];
    if (n->phase > HOST_SPREAD_LEAVES && n->phase < HOST_SPREAD_STARTS)
        spread_set(spread, i, HOST_SPREAD_AWAITED);
}

/* By what the session knows of it; by what its loader says. */
static void spread_judge(struct host_spread *spread, unsigned i) {
    const struct host_session_node *seen = &spread->session->node[i];
    struct host_spread_node *n = &spread->node[i];
    if (spread_ended(n) || pass_over(spread, i))
        return;
    if (is_absent(spread, i)) {
        judge_absent(spread, i);
        return;
    }
    if (seen->starts != n->start || n->starts == 0)
        begin_anew(spread, i);
    if (n->starts > HOST_SPREAD_STARTS_MAX) {
        end(spread, i, HOST_SPREAD_LOST,
            "restarts again and again; look at its console, and at its "
            "power");
    } else if (seen->who.protocol != NODE_PROTOCOL) {
        end(spread, i, HOST_SPREAD_REFUSED,
            "speaks another version, %u, than this program, %d; take "
            "the program of that version",
            seen->who.protocol, NODE_PROTOCOL);
    } else {
        judge_kind(spread, i);
    }
}

/* --- by what its loader says ---------------------------------------------- */

static uint32_t lacking(const struct host_spread *spread, const uint8_t *map) {
    uint32_t count = 0;
    for (uint32_t b = 0; b < spread->blocks; b++)
        count += (map[b / 8] >> b % 8 & 1) == 0;
    return count;
}

static void take_map(struct host_spread *spread, unsigned i,
                     const struct loader_state_message *state) {
    struct host_spread_node *n = &spread->node[i];
    uint32_t held = n->held;
    memcpy(n->map, state->map, sizeof n->map);
    n->blocks = spread->blocks;
    n->held = spread->blocks - lacking(spread, n->map);
    spread_set(spread, i, HOST_SPREAD_TAKES);
    if (n->held != held) {
        n->moved_us = spread->now_us;
        tell(spread, i);
    }
}

static void take_whole(struct host_spread *spread, unsigned i,
                       enum host_spread_phase phase) {
    struct host_spread_node *n = &spread->node[i];
    n->held = n->blocks = spread->blocks;
    if (n->phase < phase)
        spread_set(spread, i, phase);
}

static void spread_hear(struct host_spread *spread, unsigned i,
                        const struct loader_state_message *state) {
    struct host_spread_node *n = &spread->node[i];
    if (!spread_in_loader(spread, i) || n->phase >= HOST_SPREAD_STARTS)
        return;
    n->replies += n->replies < n->asks;
    n->silent = 0;
    spread->answered_us = spread->now_us;
    if (state->transfer != spread->transfer || state->phase == LOADER_WAITS) {
        n->begin_due = true; /* it has not had it, or forgotten */
        return;
    }
    n->begin_due = false;
    switch (state->phase) {
    case LOADER_TAKES:
        take_map(spread, i, state);
        break;
    case LOADER_WHOLE:
        take_whole(spread, i, HOST_SPREAD_WHOLE);
        break;
    case LOADER_THERE:
    case LOADER_VERIFIED:
        take_whole(spread, i, HOST_SPREAD_VERIFIED);
        break;
    case LOADER_REFUSES:
        refuse(spread, i, (enum loader_fault)state->fault);
        break;
    default:
        break;
    }
}

/* Its lines, the last ones if they are too many, as one. */
static void spread_explain(struct host_spread *spread, unsigned i) {
    enum { LOG_MAX = 120 };
    const struct host_session_node *seen = &spread->session->node[i];
    struct host_spread_node *n = &spread->node[i];
    char log[2 * LOG_MAX + 1] = "", what[HOST_SPREAD_TEXT];
    size_t size = seen->answered ? seen->size : 0, used = 0;
    for (size_t at = size > LOG_MAX ? size - LOG_MAX : 0; at < size; at++) {
        char c = (char)seen->answer[at];
        bool end = c == '\n';
        if (!end || at + 1 < size) {
            log[used++] = (char)(end || c == ';' ? ',' : c);
            log[used] = ' ';
            used += end;
        }
    }
    log[used] = '\0';
    snprintf(what, sizeof what, "%s", n->text);
    snprintf(n->text, sizeof n->text, "%.100s%s%.*s; %s", what,
             used == 0 ? "" : ": ", LOG_MAX, log,
             "look at its console, and flash another image");
}

/* --- no further ----------------------------------------------------------- */

/* A node that has got no further for too long. */
static void spread_expire(struct host_spread *spread, unsigned i) {
    struct host_spread_node *n = &spread->node[i];
    char text[HOST_SPREAD_TEXT];
    const char *reason = NULL;
    if (n->phase == HOST_SPREAD_VERIFIED)
        return; /* it waits for others */
    if (spread->now_us - n->moved_us <= spread->options.patience_us)
        return;
    switch (n->phase) {
    case HOST_SPREAD_AWAITED:
        reason = host_session_reason(spread->session, i, text, sizeof text);
        break;
    case HOST_SPREAD_LEAVES:
        reason = "does not restart into its loader; turn the board off and on, "
                 "or reset it with --reset";
        break;
    case HOST_SPREAD_STARTS:
        reason = "was told to start the image, and is not heard since; look at "
                 "its console, or turn it off and on";
        break;
    default:
        snprintf(text, sizeof text,
                 "its loader got no further than %u of %u block%s; flash "
                 "again, it keeps what it has",
                 n->held, spread->blocks, host_text_s(spread->blocks));
        reason = text;
        break;
    }
    end(spread, i, HOST_SPREAD_LOST, "%s", reason);
}
