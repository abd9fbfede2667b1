#include "flash_cut.h"

#include <signal.h>
#include <string.h>

#include "host/base/text.h"
#include "spread_internal.h"

enum { LINE = 2048, LIST = 160 };

static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
enum { SIGNALS = sizeof signals / sizeof signals[0] };

static struct sigaction before[SIGNALS];
static volatile sig_atomic_t came;

static void keep(int number) {
    came = number;
}

void host_flash_cut_begin(void) {
    const struct sigaction action = {.sa_handler = keep,
                                     .sa_flags = (int)SA_RESETHAND};
    came = 0;
    for (int i = 0; i < SIGNALS; i++) {
        if (sigaction(signals[i], NULL, &before[i]) == 0 &&
            before[i].sa_handler != SIG_IGN) { /* as nohup has it */
            (void)sigaction(signals[i], &action, NULL);
        }
    }
}

void host_flash_cut_end(void) {
    for (int i = 0; i < SIGNALS; i++) {
        (void)sigaction(signals[i], &before[i], NULL);
    }
}

int host_flash_cut(void) {
    return came;
}

/* What a node does now that nobody sends it anything; of several as well. */
static const char *state_of(const struct host_spread *spread, unsigned i) {
    const struct host_spread_node *n = &spread->node[i];
    switch (n->phase) {
    case HOST_SPREAD_BEGINS:
    case HOST_SPREAD_TAKES:
    case HOST_SPREAD_WHOLE:
        return "in the loader, and what has come is kept; turned off and on, "
               "what was there before runs";
    case HOST_SPREAD_VERIFIED:
        return "in the loader; turned off and on, the new image runs";
    case HOST_SPREAD_STARTS:
    case HOST_SPREAD_DONE:
    case HOST_SPREAD_HAS:
        return "with the new image";
    default:
        return n->left ? "on the way into the loader; turned off and on, "
                         "what was there before runs"
                       : "as before";
    }
}

static void tell_states(FILE *out, const struct host_spread *spread) {
    struct host_node_set told = {{0}};
    unsigned nodes = spread->visit->machine->nodes;
    for (unsigned i = 0; i < nodes; i++) {
        struct host_node_set set = {{0}};
        char name[LIST];
        if (!spread_wanted(spread, i) || host_node_set_has(&told, i)) {
            continue;
        }
        for (unsigned k = i; k < nodes; k++) {
            if (spread_wanted(spread, k) &&
                state_of(spread, k) == state_of(spread, i)) {
                host_node_set_add(&set, k);
                host_node_set_add(&told, k);
            }
        }
        host_node_set_name(&set, name, sizeof name);
        host_say(out, "incode: flash: %s: %s\n", name, state_of(spread, i));
    }
}

void host_flash_cut_tell(FILE *out, const struct host_spread *spread, int argc,
                         char *const *argv) {
    char line[LINE];
    int used = snprintf(line, sizeof line, "incode flash");
    tell_states(out, spread);
    for (int i = 1; i < argc && used + 2 < LINE; i++) {
        line[used++] = ' ';
        if (host_text_quote(line + used, sizeof line - (size_t)used, argv[i]) !=
            0) {
            snprintf(line, sizeof line, "the same command");
            break;
        }
        used += (int)strlen(line + used);
    }
    host_say(out, "incode: flash: interrupted; go on with: %s\n", line);
}

void host_flash_cut_finish(void) {
    if (came != 0) {
        (void)signal(came, SIG_DFL);
        (void)raise(came);
    }
}
