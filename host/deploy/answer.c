#include "answer.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/text.h"
#include "host/nodes/cluster.h"
#include "transport/secure_wipe.h"

/* Beside its data memory: the program itself, and what the kernel keeps for its
 * sockets. */
#define KERNEL_BYTES (UINT64_C(8) << 20)

/* A word of a command line of systemd (systemd.service(5), "Command lines"):
 * no escape of its shell-like quotes, no specifier, no variable. */
static void put_word(FILE *out, const char *word) {
    (void)fputs(" \"", out);
    for (const char *at = word; *at != '\0'; at++) {
        unsigned char byte = (unsigned char)*at;
        if (byte == '"' || byte == '\\')
            (void)fprintf(out, "\\%c", byte);
        else if (byte == '%' || byte == '$')
            (void)fprintf(out, "%c%c", byte, byte);
        else if (byte < ' ' || byte == 0x7f)
            (void)fprintf(out, "\\x%02x", byte);
        else
            (void)fputc(byte, out);
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
    if (system)
        (void)fprintf(out, "User=%s\n", unit->user);
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
    if (out == NULL)
        return NULL;
    if (strcmp(unit->manager, "none") == 0)
        put_start(out, unit);
    else
        put_service(out, unit);
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

/* --- answer --------------------------------------------------------------- */

enum { KEY_DIGITS = 2 * SECURE_KEY_BYTES };

static const char *fact(const struct host_deploy_board *board,
                        enum host_fact which) {
    return board->fact[which];
}

static bool is_there(const struct host_deploy_board *board) {
    return strcmp(fact(board, HOST_FACT_UNIT), "-") != 0;
}

/* Behind what is there; what does not fit is cut. */
static void say(struct host_deploy_board *board, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void say(struct host_deploy_board *board, const char *format, ...) {
    size_t used = strlen(board->result);
    va_list list;
    va_start(list, format);
    (void)vsnprintf(board->result + used, sizeof board->result - used, format,
                    list);
    va_end(list);
}

/* "running under systemd" */
static void say_running(struct host_deploy_board *board) {
    const char *manager = fact(board, HOST_FACT_MANAGER);
    if (strcmp(manager, "none") == 0) {
        say(board, "running by itself, and not again at boot");
    } else if (strcmp(manager, "user") == 0) {
        say(board, "running under systemd of %.40s",
            fact(board, HOST_FACT_USER));
    } else {
        say(board, "running under systemd");
    }
}

static void print_key(const struct host_cube_file *file,
                      char digits[KEY_DIGITS + 2]) {
    for (unsigned i = 0; i < SECURE_KEY_BYTES; i++)
        snprintf(digits + 2 * i, 3, "%02x", file->key[i]);
    strcpy(digits + KEY_DIGITS, "\n");
}

/* What the board lacks. */
struct lacks {
    bool program, key, unit;
};

static bool differs(const struct host_deploy_board *board, enum host_fact which,
                    const void *bytes, size_t size) {
    char digest[HOST_SHA256_DIGITS + 1];
    host_digest_bytes(bytes, size, digest);
    return strcmp(digest, fact(board, which)) != 0;
}

static int compare(struct host_deploy_board *board,
                   const struct host_deploy_job *job, struct lacks *lacks) {
    const struct host_unit unit = {.file = job->file,
                                   .node = board->node,
                                   .folder = fact(board, HOST_FACT_FOLDER),
                                   .manager = fact(board, HOST_FACT_MANAGER),
                                   .user = fact(board, HOST_FACT_USER)};
    char key[KEY_DIGITS + 2];
    board->program = host_programs_take(
        job->programs, fact(board, HOST_FACT_MACHINE), &board->error);
    if (board->program == NULL)
        return board->error.code;
    board->unit = host_unit_text(&unit);
    if (board->unit == NULL)
        return host_fail_memory(&board->error, "a unit's text");
    lacks->program =
        strcmp(board->program->digest, fact(board, HOST_FACT_PROGRAM)) != 0;
    lacks->unit =
        differs(board, HOST_FACT_UNIT, board->unit, strlen(board->unit));
    if (job->file->has_key) {
        print_key(job->file, key);
        lacks->key = differs(board, HOST_FACT_KEY, key, KEY_DIGITS + 1);
        secure_wipe(key, sizeof key);
    }
    return 0;
}

static unsigned count_lines(const char *text) {
    unsigned count = 0;
    for (; *text != '\0'; text++)
        count += *text == '\n';
    return count;
}

/* As script.h says. */
static int write_reply(struct host_deploy_board *board,
                       const struct host_deploy_job *job,
                       const struct lacks *lacks) {
    char key[KEY_DIGITS + 2] = "keep\n";
    FILE *out = open_memstream(&board->reply, &board->reply_bytes);
    if (out == NULL)
        return host_fail_memory(&board->error, "a board's answer");
    if (lacks->key)
        print_key(job->file, key);
    (void)fputs(key, out);
    secure_wipe(key, sizeof key);
    if (lacks->unit)
        (void)fprintf(out, "%u\n%s", count_lines(board->unit), board->unit);
    else
        (void)fputs("keep\n", out);
    (void)fprintf(out, "%s\n",
                  lacks->program ? board->program->digest : "keep");
    return fclose(out) == 0
               ? 0
               : host_fail_memory(&board->error, "a board's answer");
}

/* "program, key, unit" */
static void say_lacks(struct host_deploy_board *board,
                      const struct lacks *lacks) {
    bool none = strcmp(fact(board, HOST_FACT_MANAGER), "none") == 0;
    const char *between = "";
    if (lacks->program) {
        say(board, "program (%s, %zu bytes)", board->program->processor,
            board->program->size);
        between = ", ";
    }
    if (lacks->key) {
        say(board, "%skey", between);
        between = ", ";
    }
    if (lacks->unit)
        say(board, "%s%s", between, none ? "what starts it" : "unit");
}

static void answer_status(struct host_deploy_board *board) {
    const char *state = fact(board, HOST_FACT_STATE);
    const char *since = fact(board, HOST_FACT_SINCE);
    board->running = strcmp(state, "running") == 0;
    say(board, "%.16s, ", fact(board, HOST_FACT_MACHINE));
    if (!is_there(board)) {
        say(board, "nothing is deployed");
    } else if (board->running) {
        say_running(board);
        say(board, ", since %.60s", since);
    } else {
        say(board, "%.16s", state);
    }
}

static void answer_dry(struct host_deploy_board *board,
                       const struct host_deploy_job *job,
                       const struct lacks *lacks) {
    const char *folder = fact(board, HOST_FACT_FOLDER);
    bool lack = lacks->program || lacks->key || lacks->unit;
    bool running = strcmp(fact(board, HOST_FACT_STATE), "running") == 0;
    if (job->order == HOST_REMOVE) {
        say(board,
            is_there(board) ? "would stop the node and remove %.100s and %.100s"
                            : "nothing is deployed",
            folder, fact(board, HOST_FACT_FILE));
    } else if (!lack) {
        say(board, running ? "is up to date, and runs"
                           : "is up to date; would start the node");
    } else {
        say(board, "would copy ");
        say_lacks(board, lacks);
        say(board, " to %.100s, and %sstart the node", folder,
            running ? "re" : "");
    }
}

int host_answer(struct host_deploy_board *board,
                const struct host_deploy_job *job) {
    struct lacks lacks = {.program = false};
    if (job->order == HOST_STATUS) {
        answer_status(board);
        return 0;
    }
    if (job->order == HOST_DEPLOY && compare(board, job, &lacks) != 0)
        return board->error.code;
    if (job->dry_run) {
        answer_dry(board, job, &lacks);
        return 0;
    }
    if (job->order == HOST_REMOVE) {
        say(board, is_there(board) ? "removed" : "nothing was deployed");
        return 0;
    }
    bool lack = lacks.program || lacks.key || lacks.unit;
    bool running = strcmp(fact(board, HOST_FACT_STATE), "running") == 0;
    if (!lack) {
        say(board, running ? "up to date" : "started");
    } else {
        say(board, is_there(board) ? "updated: " : "deployed: ");
        say_lacks(board, &lacks);
    }
    say(board, "; ");
    if (!lacks.program)
        board->program = NULL;
    if (!lack && running) {
        free(board->unit);
        board->unit = NULL;
        board->reply = strdup("leave\n");
        board->reply_bytes = strlen("leave\n");
        return board->reply != NULL
                   ? 0
                   : host_fail_memory(&board->error, "a board's answer");
    }
    (void)write_reply(board, job, &lacks);
    free(board->unit); /* which is shown where nothing is done */
    board->unit = NULL;
    return board->error.code;
}

void host_answer_done(struct host_deploy_board *board, const char *state) {
    board->done = true;
    if (strcmp(state, "running") == 0) {
        board->running = true;
        say_running(board);
    }
}
