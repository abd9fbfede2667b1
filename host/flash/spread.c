#include "spread.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "spread_internal.h"

enum {
    GRACE_US = 3000000,   /* nodes that are there are known within */
    ARRIVAL_US = 1500000, /* where none has come for so long, none does soon */
    LOOK_US = 50000
};

static void look_at_clock(struct host_spread *spread) {
    struct host_machine *machine = spread->visit->machine;
    spread->now_us = machine->now_us(machine->context);
}

static void take(void *context, const struct cube_message *message) {
    struct host_spread *spread = context;
    struct loader_state_message state = {0};
    bool good = message->type == NODE_IMAGE_STATE &&
                message->size >= sizeof state - sizeof state.map &&
                message->size <= sizeof state &&
                message->source < spread->visit->machine->nodes;
    if (good) {
        memcpy(&state, message->data, message->size);
        spread_hear(spread, message->source, &state);
    }
}

int host_spread_open(struct host_spread *spread, struct host_visit *visit,
                     const struct host_spread_options *options,
                     struct host_error *error) {
    *spread = (struct host_spread){.visit = visit,
                                   .options = *options,
                                   .transfer = visit->machine->epoch,
                                   .generation = visit->generation};
    spread->blocks = (uint32_t)((options->bytes + LOADER_BLOCK_BYTES - 1) /
                                LOADER_BLOCK_BYTES);
    assert(options->bytes >= LOADER_HEADER_BYTES &&
           spread->blocks <= LOADER_BLOCKS_MAX);
    (void)loader_image_unpack(&spread->image, options->image);
    spread->node = calloc(visit->machine->nodes, sizeof *spread->node);
    if (spread->node == NULL) {
        return host_fail_memory(error, "what is known of the nodes");
    }
    look_at_clock(spread);
    spread->began_us = spread->arrived_us = spread->now_us;
    for (unsigned i = 0; i < visit->machine->nodes; i++) {
        spread->node[i].moved_us = spread->began_us;
        spread->node[i].blocks = spread->blocks;
    }
    visit->take = take;
    visit->context = spread;
    return 0;
}

void host_spread_close(struct host_spread *spread) {
    spread->visit->take = NULL;
    free(spread->node);
}

/* --- a look --------------------------------------------------------------- */

static bool has_looked(const struct host_spread *spread) {
    uint64_t now = spread->now_us;
    bool all = true;
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        all = all && (!spread_wanted(spread, i) ||
                      spread->node[i].phase != HOST_SPREAD_AWAITED);
    }
    return all || (now - spread->began_us >= GRACE_US &&
                   now - spread->arrived_us >= ARRIVAL_US);
}

static void judge_all(struct host_spread *spread) {
    look_at_clock(spread);
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        if (spread_wanted(spread, i)) {
            spread_judge(spread, i);
        }
    }
}

int host_spread_look(struct host_spread *spread, struct host_error *error) {
    int status = 0;
    judge_all(spread);
    while (status == 0 && !has_looked(spread)) {
        status = host_visit_round(spread->visit, LOOK_US, error);
        judge_all(spread);
    }
    spread->looked = true;
    return status;
}

/* --- steps ---------------------------------------------------------------- */

static void say(const struct host_spread *spread, const char *line) {
    if (spread->options.say != NULL) {
        spread->options.say(spread->options.context, line);
    }
}

/* Says once of each absence whom it waits for. */
static void say_who_is_awaited(struct host_spread *spread) {
    struct host_node_set set = {{0}};
    char nodes[HOST_SPREAD_TEXT + 8], why[HOST_SPREAD_TEXT],
        line[2 * HOST_SPREAD_TEXT + 80];
    unsigned first = spread->visit->machine->nodes;
    for (unsigned i = spread->visit->machine->nodes; i-- > 0;) {
        struct host_spread_node *n = &spread->node[i];
        if (spread_wanted(spread, i) && n->phase == HOST_SPREAD_AWAITED &&
            !n->said && spread->now_us - n->moved_us >= GRACE_US) {
            host_node_set_add(&set, i);
            n->said = true;
            first = i;
        }
    }
    if (first == spread->visit->machine->nodes) {
        return;
    }
    host_node_set_name(&set, nodes, sizeof nodes);
    const char *reason =
        host_visit_reason(spread->visit, first, why, sizeof why);
    snprintf(line, sizeof line, "%s: %.*s; waits for up to %llu s", nodes,
             (int)strcspn(reason, ";"), reason,
             (unsigned long long)(spread->options.patience_us / 1000000));
    say(spread, line);
}

bool host_spread_over(const struct host_spread *spread) {
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        if (spread_wanted(spread, i) &&
            (!spread_ended(&spread->node[i]) || spread_goes_home(spread, i))) {
            return false;
        }
    }
    return true;
}

/* With a generation goes what was on its way: it is said again, and nobody
 * waits for answers to it. */
static void look_at_generation(struct host_spread *spread) {
    if (spread->generation == spread->visit->generation) {
        return;
    }
    spread->generation = spread->visit->generation;
    spread->ask_lost = true;
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        struct host_spread_node *n = &spread->node[i];
        if (n->phase >= HOST_SPREAD_BEGINS && n->phase < HOST_SPREAD_STARTS) {
            n->told_us = 0;
        }
    }
}

int host_spread_step(struct host_spread *spread, uint64_t wait_us,
                     struct host_error *error) {
    look_at_generation(spread);
    judge_all(spread);
    if (spread_orders(spread, error) != 0) {
        return error->code;
    }
    spread_blocks(spread);
    int status = host_visit_round(spread->visit, wait_us, error);
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        if (spread_wanted(spread, i) && !spread_ended(&spread->node[i])) {
            spread_expire(spread, i);
        }
    }
    say_who_is_awaited(spread);
    return status;
}

/* The last that a board that has fallen back says for itself. */
static int ask_for_logs(struct host_spread *spread, struct host_error *error) {
    enum { LOG_US = 3000000 };
    struct host_node_set set = {{0}};
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        if (spread->node[i].phase == HOST_SPREAD_FELL_BACK) {
            host_node_set_add(&set, i);
        }
    }
    if (host_node_set_count(&set) == 0) {
        return 0;
    }
    int status =
        host_visit_ask(spread->visit, &set, NODE_LOG, 0, LOG_US, error);
    for (unsigned i = 0; status == 0 && i < spread->visit->machine->nodes;
         i++) {
        if (host_node_set_has(&set, i)) {
            spread_explain(spread, i);
        }
    }
    return status;
}

int host_spread_run(struct host_spread *spread, struct host_error *error) {
    int status = spread->looked ? 0 : host_spread_look(spread, error);
    while (status == 0 && !host_spread_over(spread)) {
        status = host_spread_step(spread, LOOK_US, error);
    }
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
    unsigned first = spread->visit->machine->nodes;
    *set = (struct host_node_set){{0}};
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        if (!has_failed(spread, i) || host_node_set_has(told, i)) {
            continue;
        }
        first = first == spread->visit->machine->nodes ? i : first;
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
    unsigned all = spread->visit->machine->nodes, i;
    int code = 0;
    while ((i = gather(spread, &told, &set)) < all) {
        if (code != 0) {
            say(spread, line);
        }
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
