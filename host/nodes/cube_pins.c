/* The lines that reset boards and have them wait in their loader. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cube_reader.h"

static const char *const kinds[HOST_LINES] = {
    [HOST_LINE_RESET] = "reset", [HOST_LINE_BOOT] = "boot"};

const char *host_line_name(enum host_line_kind kind) {
    return kinds[kind];
}

const struct host_cube_pin *host_cube_pin(const struct host_cube_file *file,
                                          unsigned node,
                                          enum host_line_kind kind) {
    for (unsigned i = 0; i < file->pins; i++) {
        if (file->pin[i].node == node && file->pin[i].kind == kind) {
            return &file->pin[i];
        }
    }
    return NULL;
}

int host_cube_make_pins(struct host_cube_file *file, unsigned entries,
                        struct host_error *error) {
    /* Beside them, DTR and RTS of the host's two wires: no more are read, as
     * each is a node's that has none. */
    size_t most = (size_t)HOST_LINES * entries + 4;
    file->pin = calloc(most, sizeof *file->pin);
    return file->pin == NULL ? host_fail_memory(error, "the cube file") : 0;
}

/* "reset: WHAT" */
static int wrong(const struct host_cube_file *file,
                 const config_setting_t *where, const char *name,
                 const char *what, struct host_error *error) {
    char text[200];
    snprintf(text, sizeof text, "%s: %s", name, what);
    return host_cube_wrong(file, where, error, text);
}

static bool is_same(const struct host_cube_pin *a,
                    const struct host_cube_pin *b) {
    return a->wire == b->wire &&
           (a->wire >= 0
                ? a->rts == b->rts
                : strcmp(a->chip, b->chip) == 0 &&
                      strcmp(a->name, b->name) == 0 && a->offset == b->offset);
}

/* Adds it, if it is the only one to do that, and does only that. */
static int add(struct host_cube_file *file, const config_setting_t *where,
               const struct host_cube_pin *pin, struct host_error *error) {
    const char *name = kinds[pin->kind];
    char text[160];
    for (unsigned i = 0; i < file->pins; i++) {
        const struct host_cube_pin *other = &file->pin[i];
        bool again = other->node == pin->node && other->kind == pin->kind;
        if (again || is_same(other, pin)) {
            snprintf(text, sizeof text,
                     again ? "node %u has one in line %u; leave one of them out"
                           : "node %u has that line as well, by line %u of "
                             "this file; give each its own",
                     other->node, other->line);
            return wrong(file, where, name, text, error);
        }
    }
    file->pin[file->pins] = *pin;
    file->pin[file->pins++].line = config_setting_source_line(where);
    return 0;
}

/* --- of a GPIO chip ------------------------------------------------------- */

/* A name that fits, and is one. */
static bool take_name(const config_setting_t *setting,
                      char name[HOST_PIN_NAME_MAX]) {
    const char *text =
        setting == NULL ? NULL : config_setting_get_string(setting);
    if (text == NULL || *text == '\0' || strlen(text) >= HOST_PIN_NAME_MAX) {
        return false;
    }
    memcpy(name, text, strlen(text) + 1);
    return true;
}

/* Its name, or its number on the chip. */
static bool take_line(const config_setting_t *setting,
                      struct host_cube_pin *pin) {
    int offset = 0;
    if (take_name(setting, pin->name)) {
        return true;
    }
    bool good =
        setting != NULL && host_cube_is_number(setting, 0, 65535, &offset);
    pin->offset = (unsigned)offset;
    return good;
}

/* What may be left out: false. */
static bool take_bool(const config_setting_t *group, const char *name,
                      bool *value) {
    const config_setting_t *setting = config_setting_get_member(group, name);
    *value = setting != NULL && config_setting_get_bool(setting) != 0;
    return setting == NULL || config_setting_type(setting) == CONFIG_TYPE_BOOL;
}

static int read_chip_line(struct host_cube_file *file,
                          const config_setting_t *group, unsigned node,
                          enum host_line_kind kind, struct host_error *error) {
    static const char *const names[] = {"chip", "line", "active_low",
                                        "open_drain", NULL};
    struct host_cube_pin pin = {
        .node = (uint16_t)node, .kind = kind, .wire = -1};
    const char *what = NULL;
    if (!config_setting_is_group(group)) {
        return wrong(file, group, kinds[kind],
                     "no group in braces; write { chip = \"gpiochip0\"; line = "
                     "17; active_low = true; }",
                     error);
    }
    if (host_cube_check_names(file, group, names, error) != 0) {
        return error->code;
    }
    if (!take_name(config_setting_get_member(group, "chip"), pin.chip)) {
        what = "chip: not given, or no name of 1 to 63 bytes; write chip = "
               "\"gpiochip0\"; or its label, as gpioinfo shows it";
    } else if (!take_line(config_setting_get_member(group, "line"), &pin)) {
        what = "line: not given, or neither a number nor a name; write line = "
               "17; or its name in quotes, as gpioinfo shows it";
    } else if (!take_bool(group, "active_low", &pin.active_low)) {
        what = "active_low: neither true nor false; give one of them";
    } else if (!take_bool(group, "open_drain", &pin.open_drain)) {
        what = "open_drain: neither true nor false; give one of them";
    } else if (pin.open_drain && !pin.active_low) {
        what = "open_drain: such a line can only pull low; add active_low = "
               "true; or leave it out";
    }
    return what == NULL ? add(file, group, &pin, error)
                        : wrong(file, group, kinds[kind], what, error);
}

int host_cube_read_pins(struct host_cube_file *file,
                        const config_setting_t *group, unsigned node,
                        struct host_error *error) {
    for (int k = 0; k < HOST_LINES && error->code == 0; k++) {
        const config_setting_t *line =
            config_setting_get_member(group, kinds[k]);
        if (line != NULL) {
            (void)read_chip_line(file, line, node, (enum host_line_kind)k,
                                 error);
        }
    }
    return error->code;
}

/* --- of the host's port --------------------------------------------------- */

static int read_modem_line(struct host_cube_file *file,
                           const config_setting_t *setting,
                           const struct host_cube_wire *wire, bool rts,
                           struct host_error *error) {
    struct host_cube_pin pin = {.node = wire->node, .rts = rts};
    const char *text = config_setting_get_string(setting), *what = NULL;
    for (unsigned i = 0; i < file->wires; i++) {
        pin.wire += file->wire[i].to == CUBE_HOST ? 1 : 0;
    }
    if (text != NULL && strcmp(text, kinds[HOST_LINE_BOOT]) == 0) {
        pin.kind = HOST_LINE_BOOT;
    } else if (text == NULL || strcmp(text, kinds[HOST_LINE_RESET]) != 0) {
        what = "does neither; give \"reset\" or \"boot\"";
    }
    if (wire->to != CUBE_HOST || pin.wire > 1) {
        what = "not at a wire of the host, which sets its own ports alone; "
               "leave it out";
    } else if (rts && wire->rts_cts) {
        what = "holds the other end back where rtscts = true; leave one of "
               "them out";
    }
    return what == NULL
               ? add(file, setting, &pin, error)
               : wrong(file, setting, rts ? "rts" : "dtr", what, error);
}

int host_cube_read_modem(struct host_cube_file *file,
                         const config_setting_t *group,
                         struct host_cube_wire *wire,
                         struct host_error *error) {
    const config_setting_t *dtr = config_setting_get_member(group, "dtr");
    const config_setting_t *rts = config_setting_get_member(group, "rts");
    wire->dtr_low = dtr != NULL;
    wire->rts_low = rts != NULL;
    if (dtr != NULL && read_modem_line(file, dtr, wire, false, error) != 0) {
        return error->code;
    }
    return rts == NULL ? 0 : read_modem_line(file, rts, wire, true, error);
}
