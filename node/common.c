#include "common.h"

#include <string.h>

#include "transport/text.h"
#include "incode/predicates/check.h"

void node_fault_set(struct node_fault *fault, const char *words, uint32_t a,
                    uint32_t b) {
    struct cube_text text;
    if (node_fault_is_set(fault))
        return;
    text = cube_text_in(fault->text, sizeof fault->text);
    for (uint32_t figure = a; *words != '\0'; words++) {
        char character[2] = {*words, '\0'};
        if (*words == '#') {
            cube_text_number(&text, figure);
            figure = b;
        } else {
            cube_text_put(&text, character);
        }
    }
    fault->size = text.size;
}

/* --- setup ---------------------------------------------------------------- */

bool node_setup_read(struct node_setup_message *setup,
                     const struct cube_message *message, unsigned nodes,
                     struct node_fault *fault) {
    uint32_t protocol = NODE_PROTOCOL;
    if (message->size >= sizeof protocol)
        memcpy(&protocol, message->data, sizeof protocol);
    if (protocol != NODE_PROTOCOL) {
        node_fault_set(fault, "protocol version #, expected #", protocol,
                       NODE_PROTOCOL);
        return false;
    }
    if (message->size != sizeof *setup) {
        node_fault_set(fault, "setup in # bytes, expected #", message->size,
                       sizeof *setup);
        return false;
    }
    memcpy(setup, message->data, sizeof *setup);
    if (setup->nodes != nodes) {
        node_fault_set(fault, "invalid setup: # nodes, expected #",
                       setup->nodes, nodes);
        return false;
    }
    for (unsigned i = 0; i < sizeof setup->reserved; i++) {
        if (setup->reserved[i] != 0) {
            node_fault_set(fault, "invalid setup: reserved byte # is #", i,
                           setup->reserved[i]);
            return false;
        }
    }
    if (setup->reserved2 != 0) {
        node_fault_set(fault, "invalid setup: what is reserved is #",
                       setup->reserved2, 0);
        return false;
    }
    return true;
}

/* --- counted -------------------------------------------------------------- */

int node_counted_write(struct node_counted *counted, uint16_t dest,
                       uint8_t type, const void *data, size_t size) {
    int status =
        counted->write == NULL
            ? cube_write(counted->cube, dest, type, data, size)
            : counted->write(counted->context, counted, dest, type, data, size);
    counted->sent += status == 0 && dest == CUBE_HOST;
    return status;
}

void node_counted_put(struct node_counted *counted, uint16_t dest, uint8_t type,
                      const void *data, size_t size) {
    int status = node_counted_write(counted, dest, type, data, size);
    INCODE_ASSERT(status == 0);
}

/* --- keepers -------------------------------------------------------------- */

bool node_keepers_fit(const struct node_setup_message *setup, unsigned self,
                      bool keeps, struct node_fault *fault) {
    bool among = self >= 1 && self <= setup->holders;
    if (setup->holders >= setup->nodes) {
        node_fault_set(fault, "invalid setup: # holders of # nodes",
                       setup->holders, setup->nodes);
        return false;
    }
    if (keeps != among) {
        node_fault_set(fault,
                       keeps ? "invalid setup: node # is none of # holders"
                             : "invalid setup: node # works, and is one of # "
                               "holders",
                       self, setup->holders);
        return false;
    }
    return true;
}

/* --- pace ----------------------------------------------------------------- */

void node_pace_init(struct node_pace *pace, uint64_t (*now_us)(void *context),
                    void *context) {
    *pace = (struct node_pace){.now_us = now_us, .context = context};
    pace->units = 1;
    pace->unit_ns = NODE_PACE_STEP_US * UINT64_C(1000);
}

void node_pace_begin(struct node_pace *pace, uint64_t now_us) {
    pace->begun_us = pace->looked_us = now_us;
}

/* How long a unit takes: what was measured first; then twice as long as was
 * thought, at most, as the clock goes on while others have the processor; and
 * less by and by, as units differ, by the time that they took: many that take
 * next to none do not hide those that take long. */
static void look(struct node_pace *pace, uint32_t units) {
    uint64_t now = pace->now_us(pace->context);
    uint64_t passed_us = now - pace->looked_us;
    uint64_t unit_ns = passed_us * 1000 / (units > 0 ? units : 1);
    uint64_t most_ns = pace->measured ? 2 * pace->unit_ns + 1 : UINT64_MAX / 2;
    uint64_t weight_us = passed_us < NODE_PACE_FALL_US && pace->measured
                             ? passed_us
                             : NODE_PACE_FALL_US;
    pace->looked_us = now;
    pace->measured = pace->measured || passed_us > 0;
    if (unit_ns >= pace->unit_ns) {
        pace->unit_ns = unit_ns < most_ns ? unit_ns : most_ns;
    } else {
        pace->unit_ns -=
            (pace->unit_ns - unit_ns) * weight_us / NODE_PACE_STEP_US;
    }
    uint64_t fit = NODE_PACE_STEP_US * UINT64_C(1000) / (pace->unit_ns + 1);
    uint32_t most =
        pace->measured ? NODE_PACE_UNITS_MAX : NODE_PACE_UNITS_UNMEASURED_MAX;
    pace->units = fit < NODE_PACE_UNITS_MIN ? NODE_PACE_UNITS_MIN
                  : fit > most              ? most
                                            : (uint32_t)fit;
}

/* Looks at it.  False: it is time to look at the links. */
static bool node_pace_goes_on(struct node_pace *pace, uint32_t units) {
    look(pace, units);
    return pace->looked_us - pace->begun_us < NODE_PACE_LAST_US;
}

/* Work ends with so many, that is, fewer. */
static void node_pace_end(struct node_pace *pace, uint32_t units) {
    look(pace, units);
}

unsigned node_pace_work(struct node_pace *pace,
                        bool (*step)(void *context, uint32_t units,
                                     uint32_t *spent),
                        void *context) {
    unsigned worked = 0;
    uint32_t units = 0; /* since the last look at the clock */
    bool goes_on = true;
    while (goes_on && worked < NODE_STEPS) {
        uint32_t spent = 0;
        goes_on = step(context, pace->units, &spent);
        worked += goes_on;
        units += goes_on ? spent : 0; /* who only waits tells nothing */
        if (goes_on && node_pace_is_due(pace, units)) {
            goes_on = node_pace_goes_on(pace, units);
            units = 0;
        }
    }
    if (units > 0)
        node_pace_end(pace, units);
    return worked;
}
