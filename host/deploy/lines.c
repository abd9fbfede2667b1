#include "lines.h"

#include <stdio.h>
#include <string.h>

#include "host/base/progress.h"
#include "host/base/text.h"

enum { NAME_BYTES = HOST_SSH_MAX + 32 };

void host_deploy_lines_begin(struct host_deploy_lines *lines, unsigned boards,
                             bool quiet) {
    host_progress_begin(!quiet);
    lines->quiet = quiet;
    lines->live = boards <= host_progress_rows_max();
    if (lines->live) {
        host_progress_rows(boards);
    } else {
        host_progress_end();
    }
}

static void print_name(const struct host_deploy_board *board,
                       char name[NAME_BYTES]) {
    snprintf(name, NAME_BYTES, "node %u %s:", board->node, board->to);
}

static const char *text_of(const struct host_deploy_board *board) {
    return !board->ended            ? board->step
           : board->error.code != 0 ? board->error.text
                                    : board->result;
}

void host_deploy_lines_show(const struct host_deploy_lines *lines,
                            const struct host_deploy_board *boards,
                            unsigned count) {
    char text[HOST_SAY_BYTES], name[NAME_BYTES], line[sizeof text];
    for (unsigned i = 0; i < count && lines->live; i++) {
        const struct host_deploy_board *board = &boards[i];
        print_name(board, name);
        snprintf(text, sizeof text, "%s%s",
                 board->ended && board->error.code != 0 ? "failed: " : "",
                 text_of(board));
        host_text_printable(line, sizeof line, text);
        host_progress_row(i, name, -1.0, line);
    }
    host_progress_draw();
}

/* A text of several lines, each set in. */
static void print_text(const char *text) {
    while (*text != '\0') {
        int length = (int)strcspn(text, "\n");
        host_say(stdout, "    %.*s\n", length, text);
        text += length + (text[length] == '\n');
    }
}

void host_deploy_lines_end(const struct host_deploy_lines *lines,
                           const struct host_deploy_board *boards,
                           unsigned count) {
    char name[NAME_BYTES];
    host_progress_end();
    for (unsigned i = 0; i < count; i++) {
        const struct host_deploy_board *board = &boards[i];
        print_name(board, name);
        if (board->error.code == 0 && !lines->quiet) {
            host_say(stdout, "%s %s\n", name, board->result);
        }
        if (board->error.code == 0 && board->unit != NULL && !lines->quiet) {
            print_text(board->unit);
        }
    }
    (void)fflush(stdout);
    for (unsigned i = 0; i < count; i++) {
        if (boards[i].error.code != 0) {
            host_note("node %u (%s): %s", boards[i].node, boards[i].to,
                      boards[i].error.text);
        } else if (boards[i].note[0] != '\0') {
            host_note("node %u (%s): %s", boards[i].node, boards[i].to,
                      boards[i].note);
        }
    }
}
