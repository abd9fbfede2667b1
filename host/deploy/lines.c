#include "lines.h"

#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "host/base/clock.h"
#include "host/base/progress.h"
#include "host/base/text.h"

enum { EVERY_US = 100000, NAME_BYTES = HOST_SSH_MAX + 32 };

void host_deploy_lines_begin(struct host_deploy_lines *lines, unsigned boards,
                             bool quiet)
{
    struct winsize size;
    memset(lines, 0, sizeof *lines);
    lines->quiet = quiet;
    lines->live = !quiet && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 &&
                  boards < size.ws_row && size.ws_col > 40;
    lines->columns = lines->live ? size.ws_col - 1u : 0;
}

static void print_name(const struct host_deploy_board *board,
                       char name[NAME_BYTES])
{
    snprintf(name, NAME_BYTES, "node %u %s:", board->node, board->to);
}

static const char *text_of(const struct host_deploy_board *board)
{
    return !board->ended            ? board->step
           : board->error.code != 0 ? board->error.text
                                    : board->result;
}

static void draw(struct host_deploy_lines *lines,
                 const struct host_deploy_board *boards, unsigned count)
{
    char text[HOST_SAY_BYTES], name[NAME_BYTES], line[sizeof text];
    if (lines->drawn > 0) {
        printf("\033[%uA", lines->drawn);
    }
    for (unsigned i = 0; i < count; i++) {
        print_name(&boards[i], name);
        snprintf(text, sizeof text, "%s %s%s", name,
                 boards[i].ended && boards[i].error.code != 0 ? "failed: " : "",
                 boards[i].to == NULL ? "" : text_of(&boards[i]));
        host_text_printable(line, sizeof line, text);
        printf("\r%.*s\033[K\n", (int)lines->columns, line);
    }
    lines->drawn = count;
    (void)fflush(stdout);
}

void host_deploy_lines_show(struct host_deploy_lines *lines,
                            const struct host_deploy_board *boards,
                            unsigned count)
{
    uint64_t now = host_now_us();
    if (lines->live && now >= lines->next_us) {
        lines->next_us = now + EVERY_US;
        draw(lines, boards, count);
    }
}

/* A text of several lines, each set in. */
static void print_text(const char *text)
{
    while (*text != '\0') {
        int length = (int)strcspn(text, "\n");
        host_say(stdout, "    %.*s\n", length, text);
        text += length + (text[length] == '\n');
    }
}

void host_deploy_lines_end(struct host_deploy_lines *lines,
                           const struct host_deploy_board *boards,
                           unsigned count)
{
    char name[NAME_BYTES];
    if (lines->live) {
        draw(lines, boards, count);
    }
    for (unsigned i = 0; i < count; i++) {
        const struct host_deploy_board *board = &boards[i];
        print_name(board, name);
        if (board->error.code == 0 && !lines->quiet && !lines->live) {
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
