#include <stdio.h>
#include <string.h>

#include "cube_reader.h"
#include "host/base/text.h"

#define NEVER UINT64_MAX

static void print_wire(const struct host_cube_wire *wire, unsigned link,
                       bool first, char text[HOST_NODE_OPTION_BYTES]) {
    char address[HOST_NODE_OPTION_BYTES / 2];
    if (wire->serial) {
        snprintf(text, HOST_NODE_OPTION_BYTES, "%u=serial:%s:%u%s", link,
                 wire->device[first ? 0 : 1], wire->baud,
                 wire->rts_cts ? ":rtscts" : "");
        return;
    }
    host_cube_print_address(first ? &wire->at : &wire->via, address,
                            sizeof address);
    snprintf(text, HOST_NODE_OPTION_BYTES, "%u=%s%s:%s", link,
             tcp_address_path(&wire->at) != NULL ? "unix-" : "",
             first ? "listen" : "call", address);
}

unsigned host_cube_node_options(
    const struct host_cube_file *file, unsigned node,
    char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES]) {
    unsigned n = 0, count;
    const struct host_cube_wire *second = host_cube_host_wire(file, 1);
    const struct host_cube_wire *host = node == 0 ? host_cube_host_wire(file, 0)
                                        : second != NULL && second->node == node
                                            ? second
                                            : NULL;
    const struct {
        const char *name;
        uint64_t value, usual; /* the program's default; NEVER: always given */
    } numbers[] = {{"--node", node, NEVER},
                   {"--dimension", file->dimension, NEVER},
                   {"--memory", file->memory, 4u << 20},
                   {"--window", file->window, 0},
                   {"--dead", UINT64_C(1000000) * file->dead_s, 0},
                   {"--serial-baud", file->serial_baud, 0},
                   {"--host-port", node != 0 && host != NULL ? 1 : 0, 0}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        if (numbers[i].value == numbers[i].usual) {
            continue;
        }
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%s", numbers[i].name);
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%llu",
                 (unsigned long long)numbers[i].value);
    }
    if (file->has_key) {
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--key");
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%.*s",
                 HOST_NODE_OPTION_BYTES - 1, file->key_path);
    }
    char *insecure = NULL;
    for (unsigned d = 0; d <= file->dimension; d++) {
        const struct host_cube_wire *wire =
            d == file->dimension
                ? host
                : host_cube_between(file, node, node ^ 1u << d, &count);
        if (wire == NULL) {
            continue;
        }
        if (wire->insecure && insecure == NULL) {
            snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--insecure");
            insecure = options[n++];
            insecure[0] = '\0';
        }
        if (wire->insecure) {
            size_t used = strlen(insecure);
            snprintf(insecure + used, HOST_NODE_OPTION_BYTES - used, "%s%u",
                     used == 0 ? "" : ",", d);
        }
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--wire");
        print_wire(wire, d, wire->node == node, options[n++]);
    }
    if (file->board_of[node] != host_board_row(0)) {
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--board");
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%s",
                 file->board_of[node]->name);
    }
    return n;
}

const char *host_cube_start_line(const struct host_cube_file *file,
                                 unsigned node, char *line, size_t size) {
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    unsigned count = host_cube_node_options(file, node, options);
    const char *program = file->board_of[node]->program;
    if (program == NULL || host_text_quote(line, size, program) != 0) {
        return NULL;
    }
    for (unsigned k = 0; k < count; k++) {
        size_t used = strlen(line);
        if (size - used < 2 || host_text_quote(line + used + 1, size - used - 1,
                                               options[k]) != 0) {
            return NULL;
        }
        line[used] = ' ';
    }
    return line;
}

const char *host_cube_wire_name(const struct host_cube_wire *wire, char *name,
                                size_t size) {
    if (wire->serial) {
        snprintf(name, size, "%s", wire->device[1]);
    } else {
        host_cube_print_address(&wire->via, name, size);
    }
    return name;
}

/* What a person does who has a board in the hand. */
static void print_bare(const struct host_cube_file *file, unsigned node) {
    const struct host_board *board = file->board_of[node];
    char name[HOST_NODE_OPTION_BYTES];
    unsigned count;
    printf("# node %u (%s): put its firmware on it, %s of make firmware, by "
           "incode flash; UART 0: ",
           node, board->name, board->bare->image);
    for (unsigned k = 0; k < 2; k++) {
        const struct host_cube_wire *wire = host_cube_host_wire(file, k);
        if (wire != NULL && wire->node == node) {
            printf("host, ");
        }
    }
    printf("console");
    for (unsigned d = 0; d < file->dimension; d++) {
        const struct host_cube_wire *wire =
            host_cube_between(file, node, node ^ 1u << d, &count);
        printf("; %u: node %u", d + 1, node ^ 1u << d);
        if (wire != NULL) {
            print_wire(wire, d, wire->node == node, name);
            printf(" (%s)", strchr(name, '=') + 1);
        }
    }
    printf("\n");
}

int host_cube_print(const char *path, struct host_error *error) {
    /* A byte becomes "$(printf '\\377')" at most. */
    static char line[20 * HOST_NODE_OPTIONS_MAX * HOST_NODE_OPTION_BYTES];
    static struct host_cube_file file;
    if (host_cube_file_read(&file, path, error) != 0) {
        return error->code;
    }
    for (unsigned i = 0; i < file.nodes; i++) {
        if (host_cube_is_bare(&file, i)) {
            print_bare(&file, i);
        } else {
            (void)host_cube_start_line(&file, i, line, sizeof line);
            printf("%s\n", line);
        }
    }
    host_cube_file_free(&file);
    return 0;
}
