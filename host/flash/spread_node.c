#include "spread_internal.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "host/base/text.h"

static const uint8_t nothing[NODE_DIGEST_BYTES];

bool spread_in_loader(const struct host_spread *spread, unsigned i) {
    const struct host_visit_node *seen = &spread->visit->node[i];
    return spread_wanted(spread, i) && seen->there &&
           seen->who.kind == NODE_KIND_LOADER &&
           !spread_ended(&spread->node[i]);
}

bool spread_goes_home(const struct host_spread *spread, unsigned i) {
    enum { TRIES = 3 };
    const struct host_visit_node *seen = &spread->visit->node[i];
    const struct host_spread_node *n = &spread->node[i];
    return n->phase == HOST_SPREAD_REFUSED && n->left && seen->there &&
           seen->starts == n->start && n->homeward <= TRIES;
}

static void tell(const struct host_spread *spread, unsigned i) {
    const struct host_spread_options *options = &spread->options;
    if (options->changed != NULL) {
        options->changed(options->context, i);
    }
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
    const struct host_visit_node *seen = &spread->visit->node[i];
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
    if (known == NULL || strcmp(known, spread->image.board) == 0) {
        return false;
    }
    end(spread, i, HOST_SPREAD_PASSED, "is no %s but %s", spread->image.board,
        known);
    return true;
}

static void judge_program(struct host_spread *spread, unsigned i) {
    const struct node_who *who = &spread->visit->node[i].who;
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
    const struct node_who *who = &spread->visit->node[i].who;
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
    const struct host_visit_node *seen = &spread->visit->node[i];
    struct host_spread_node *n = &spread->node[i];
    if (seen->heard) {
        n->heard_us = spread->now_us;
    }
    return !seen->there || spread->now_us - n->heard_us > BUSY_US;
}

/* A node that is told to restart is not there for a while. */
static void judge_absent(struct host_spread *spread, unsigned i) {
    struct host_spread_node *n = &spread->node[i];
    if (n->phase > HOST_SPREAD_LEAVES && n->phase < HOST_SPREAD_STARTS) {
        spread_set(spread, i, HOST_SPREAD_AWAITED);
    }
}

void spread_judge(struct host_spread *spread, unsigned i) {
    const struct host_visit_node *seen = &spread->visit->node[i];
    struct host_spread_node *n = &spread->node[i];
    if (spread_ended(n) || pass_over(spread, i)) {
        return;
    }
    if (is_absent(spread, i)) {
        judge_absent(spread, i);
        return;
    }
    if (seen->starts != n->start || n->starts == 0) {
        begin_anew(spread, i);
    }
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
    for (uint32_t b = 0; b < spread->blocks; b++) {
        count += (map[b / 8] >> b % 8 & 1) == 0;
    }
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
    if (n->phase < phase) {
        spread_set(spread, i, phase);
    }
}

void spread_hear(struct host_spread *spread, unsigned i,
                 const struct loader_state_message *state) {
    struct host_spread_node *n = &spread->node[i];
    if (!spread_in_loader(spread, i) || n->phase >= HOST_SPREAD_STARTS) {
        return;
    }
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
void spread_explain(struct host_spread *spread, unsigned i) {
    enum { LOG_MAX = 120 };
    const struct host_visit_node *seen = &spread->visit->node[i];
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

void spread_expire(struct host_spread *spread, unsigned i) {
    struct host_spread_node *n = &spread->node[i];
    char text[HOST_SPREAD_TEXT];
    const char *reason = NULL;
    if (n->phase == HOST_SPREAD_VERIFIED) {
        return; /* it waits for others */
    }
    if (spread->now_us - n->moved_us <= spread->options.patience_us) {
        return;
    }
    switch (n->phase) {
    case HOST_SPREAD_AWAITED:
        reason = host_visit_reason(spread->visit, i, text, sizeof text);
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
