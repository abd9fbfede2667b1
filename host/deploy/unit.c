#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/text.h"
#include "host/nodes/cluster.h"

/* Beside its data memory: the program itself, and what the kernel keeps for its
 * sockets. */
#define KERNEL_BYTES (UINT64_C(8) << 20)

/* A word of a command line of systemd (systemd.service(5), "Command lines"):
 * no escape of its shell-like quotes, no specifier, no variable. */
static void put_word(FILE *out, const char *word) {
    (void)fputs(" \"", out);
    for (const char *at = word; *at != '\0'; at++) {
        unsigned char byte = (unsigned char)*at;
        if (byte == '"' || byte == '\\') {
            (void)fprintf(out, "\\%c", byte);
        } else if (byte == '%' || byte == '$') {
            (void)fprintf(out, "%c%c", byte, byte);
        } else if (byte < ' ' || byte == 0x7f) {
            (void)fprintf(out, "\\x%02x", byte);
        } else {
            (void)fputc(byte, out);
        }
    }
    (void)fputc('"', out);
}

static void put_quoted(FILE *out, const char *word) {
    char quoted[20 * HOST_NODE_OPTION_BYTES + 4096];
    (void)host_text_quote(quoted, sizeof quoted, word);
    (void)fprintf(out, " %s", quoted);
}

/* The program and its arguments; the key is beside it. */
static void put_command(FILE *out, const struct host_unit *unit,
                        void (*put)(FILE *out, const char *word)) {
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    unsigned count = host_cube_node_options(unit->file, unit->node, options);
    char path[4096];
    snprintf(path, sizeof path, "%s/incode-node", unit->folder);
    put(out, path);
    snprintf(path, sizeof path, "%s/key", unit->folder);
    for (unsigned i = 0; i < count; i++) {
        bool key = i > 0 && strcmp(options[i - 1], "--key") == 0;
        put(out, key ? path : options[i]);
    }
    (void)fputc('\n', out);
}

static void put_start(FILE *out, const struct host_unit *unit) {
    char path[4096];
    snprintf(path, sizeof path, "%s/pid", unit->folder);
    (void)fprintf(out, "#!/bin/sh\n# Node %u, by incode deploy.\necho $$ >",
                  unit->node);
    put_quoted(out, path);
    (void)fputs("\nexec", out);
    put_command(out, unit, put_quoted);
}

/* LimitDATA and LimitSTACK are the node's memory, to the byte, as the host sets
 * them for nodes that it starts; MemoryMax also counts what the kernel has for
 * it. */
static void put_service(FILE *out, const struct host_unit *unit) {
    uint64_t memory = unit->file->memory;
    bool system = strcmp(unit->manager, "system") == 0;
    (void)fprintf(out,
                  "# Written by incode deploy, which writes it anew.\n"
                  "[Unit]\nDescription=Node %u of an incode cube\n",
                  unit->node);
    if (system) {
        (void)fputs("Wants=network-online.target\n"
                    "After=network-online.target\n",
                    out);
    }
    (void)fputs("StartLimitIntervalSec=0\n\n[Service]\nExecStart=", out);
    put_command(out, unit, put_word);
    if (system) {
        (void)fprintf(out, "User=%s\n", unit->user);
    }
    (void)fprintf(out,
                  "Restart=always\nRestartSec=1\n"
                  "LimitDATA=%llu\nLimitSTACK=%d\nLimitCORE=0\n"
                  "MemoryMax=%llu\nNoNewPrivileges=yes\n\n"
                  "[Install]\nWantedBy=%s.target\n",
                  (unsigned long long)(memory - HOST_STACK_BYTES),
                  (int)HOST_STACK_BYTES,
                  (unsigned long long)(memory + KERNEL_BYTES),
                  system ? "multi-user" : "default");
}

char *host_unit_text(const struct host_unit *unit) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        return NULL;
    }
    if (strcmp(unit->manager, "none") == 0) {
        put_start(out, unit);
    } else {
        put_service(out, unit);
    }
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}
