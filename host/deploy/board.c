#include "board.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "answer.h"
#include "host/base/error.h"
#include "transport/secure_wipe.h"
#include "host/base/progress.h"
#include "host/base/text.h"

/* --- ssh ------------------------------------------------------------------ */

static _Noreturn void become_ssh(const struct host_deploy_job *job,
                                 const char *to, const char *command,
                                 int files[3], pid_t host) {
    const char *argv[24] = {"ssh", "-T", "-x", "-o", "BatchMode=yes", "-o",
                            "ConnectTimeout=10", "-o", "ServerAliveInterval=5",
                            "-o", "ServerAliveCountMax=3", "-o",
                            "LogLevel=ERROR",
                            /* A master that stays would hold the pipes. */
                            "-o", "ControlPath=none"};
    size_t n = 15;
    if (job->ssh_config != NULL) {
        argv[n++] = "-F";
        argv[n++] = job->ssh_config;
    }
    argv[n++] = "--";
    argv[n++] = to;
    argv[n++] = command;
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() == host) {
        for (int i = 0; i < 3; i++)
            dup2(files[i], i);
        (void)signal(SIGPIPE, SIG_DFL);
        execvp("ssh", (char *const *)argv);
        (void)fprintf(stderr, "ssh: %s\n", strerror(errno));
    }
    _exit(127);
}

static const char *order_of(const struct host_deploy_job *job) {
    return job->dry_run || job->order == HOST_STATUS ? "look"
           : job->order == HOST_REMOVE               ? "remove"
                                                     : "deploy";
}

static void close_one(int *file) {
    if (*file >= 0)
        close(*file);
    *file = -1;
}

/* Three pipes; false: errno says why, and none is open. */
static bool open_pipes(int near[3], int far[3]) {
    bool good = true;
    for (int i = 0; i < 3; i++)
        near[i] = far[i] = -1;
    for (int i = 0; i < 3 && good; i++) {
        int ends[2];
        good = pipe2(ends, O_CLOEXEC) == 0;
        if (good) {
            near[i] = ends[i == 0 ? 1 : 0];
            far[i] = ends[i == 0 ? 0 : 1];
            good = fcntl(near[i], F_SETFL, O_NONBLOCK) == 0;
        }
    }
    int reason = errno;
    for (int i = 0; i < 3 && !good; i++) {
        close_one(&near[i]);
        close_one(&far[i]);
    }
    errno = reason;
    return good;
}

int host_board_begin(struct host_deploy_board *board,
                     const struct host_deploy_job *job, unsigned node) {
    const struct host_cube_ssh *ssh = host_cube_ssh(job->file, node);
    int near[3], far[3];
    memset(board, 0, sizeof *board);
    board->node = node;
    board->to = ssh->to;
    board->in = board->out = board->err = -1;
    snprintf(board->step, sizeof board->step, "connecting");
    char *command = host_script_command(order_of(job), node, ssh->folder);
    if (command == NULL) {
        board->ended = true;
        return host_fail_memory(&board->error, "a board's command");
    }
    if (!open_pipes(near, far)) {
        free(command);
        board->ended = true;
        return host_fail(&board->error, HOST_BROKEN,
                         "%s; name fewer with --nodes", strerror(errno));
    }
    pid_t host = getpid();
    board->heard_us = host_now_us();
    board->pid = fork();
    if (board->pid == 0)
        become_ssh(job, board->to, command, far, host);
    free(command);
    for (int i = 0; i < 3; i++)
        close_one(&far[i]);
    board->in = near[0];
    board->out = near[1];
    board->err = near[2];
    if (board->pid < 0) {
        int reason = errno;
        host_board_free(board);
        board->ended = true;
        return host_fail(&board->error, HOST_BROKEN,
                         "%s; name fewer with --nodes", strerror(reason));
    }
    return 0;
}

void host_board_free(struct host_deploy_board *board) {
    close_one(&board->in);
    close_one(&board->out);
    close_one(&board->err);
    if (board->reply != NULL)
        secure_wipe(board->reply, board->reply_bytes);
    free(board->reply);
    free(board->unit);
    board->reply = board->unit = NULL;
}

/* --- what it says --------------------------------------------------------- */

/* Whether the text begins with the words, which *text is behind then. */
static bool begins(const char **text, const char *words) {
    size_t size = strlen(words);
    bool same = strncmp(*text, words, size) == 0;
    *text += same ? size : 0;
    return same;
}

static void take_fact(struct host_deploy_board *board, const char *text) {
    for (int i = 0; i < HOST_FACTS; i++) {
        const char *name = host_fact_name((enum host_fact)i);
        const char *value = text;
        if (begins(&value, name) && *value == ' ')
            snprintf(board->fact[i], HOST_BOARD_TEXT, "%s", value + 1);
    }
}

/* A board that leaves a fact out has another script's answers. */
static bool has_all(const struct host_deploy_board *board) {
    bool all = true;
    for (int i = 0; i < HOST_FACTS; i++)
        all = all && board->fact[i][0] != '\0';
    return all;
}

static void take_line(struct host_deploy_board *board,
                      const struct host_deploy_job *job, const char *text) {
    if (!begins(&text, HOST_SCRIPT_MARK) || board->error.code != 0)
        return;
    if (begins(&text, "fact ")) {
        take_fact(board, text);
    } else if (begins(&text, "step ")) {
        snprintf(board->step, sizeof board->step, "%s", text);
    } else if (begins(&text, "note ")) {
        snprintf(board->note, sizeof board->note, "%s", text);
    } else if (begins(&text, "failed ")) {
        host_fail(&board->error, HOST_CUBE, "%s", text);
    } else if (begins(&text, "done ")) {
        host_answer_done(board, text);
    } else if (strcmp(text, "ready") == 0 && !board->ready && has_all(board)) {
        board->ready = true;
        (void)host_answer(board, job);
        if (board->reply == NULL)
            close_one(&board->in);
    }
}

/* Appends a byte; a line's end is passed on.  What is too long is cut. */
static bool put_byte(char line[HOST_BOARD_TEXT], size_t *bytes, char byte) {
    if (byte == '\n') {
        line[*bytes] = '\0';
        *bytes = 0;
        return true;
    }
    if (byte != '\r' && *bytes < HOST_BOARD_TEXT - 1)
        line[(*bytes)++] = byte;
    return false;
}

static void receive(struct host_deploy_board *board,
                    const struct host_deploy_job *job, int *file) {
    char bytes[4096];
    ssize_t got = read(*file, bytes, sizeof bytes);
    board->heard_us = host_now_us();
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR))
        close_one(file);
    for (ssize_t i = 0; i < got; i++) {
        if (file == &board->out) {
            if (put_byte(board->line, &board->line_bytes, bytes[i]))
                take_line(board, job, board->line);
        } else {
            (void)put_byte(board->said, &board->said_bytes, bytes[i]);
        }
    }
}

/* --- what it is sent ------------------------------------------------------ */

static void send_some(struct host_deploy_board *board) {
    bool head = board->reply_sent < board->reply_bytes;
    const char *from =
        head ? board->reply + board->reply_sent
             : (const char *)board->program->bytes + board->program_sent;
    size_t left = head ? board->reply_bytes - board->reply_sent
                       : board->program->size - board->program_sent;
    ssize_t sent = write(board->in, from, left);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) {
        close_one(&board->in); /* its status says why */
        return;
    }
    board->heard_us = host_now_us();
    *(head ? &board->reply_sent : &board->program_sent) +=
        sent > 0 ? (size_t)sent : 0;
    if (board->program != NULL && board->reply_sent == board->reply_bytes) {
        snprintf(board->step, sizeof board->step, "copying %3zu %%",
                 100 * board->program_sent / board->program->size);
    }
    if (board->reply_sent == board->reply_bytes &&
        (board->program == NULL || board->program_sent == board->program->size))
        close_one(&board->in);
}

/* --- its end -------------------------------------------------------------- */

/* What OpenSSH says, and what helps. */
static const char *next_step(const char *said) {
    static const struct {
        const char *words, *next;
    } known[] = {
        {"Permission denied", "let it know your key, with: ssh-copy-id"},
        {"Host key verification", "look at its key once, with: ssh"},
        {"REMOTE HOST IDENTIFICATION", "look at its key, with: ssh"},
        {"Could not resolve", "correct the name in the cube file, then try: "
                              "ssh"},
        {"refused", "start its ssh service, then try: ssh"},
        {"No space left", "free some space there; look with: ssh"},
        {"timed out", "see that it is on, and on the network; then try: ssh"},
        {"No route", "see that it is on, and on the network; then try: ssh"},
        {"No such file or directory",
         "install the package openssh-client, then try: ssh"}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strstr(said, known[i].words) != NULL)
            return known[i].next;
    return "try: ssh";
}

static void end(struct host_deploy_board *board) {
    int status = 0;
    pid_t got;
    do {
        got = waitpid(board->pid, &status, 0);
    } while (got < 0 && errno == EINTR);
    board->ended = true;
    if (board->said_bytes > 0)
        (void)put_byte(board->said, &board->said_bytes, '\n');
    bool good = WIFEXITED(status) && WEXITSTATUS(status) == 0 && board->ready;
    if (board->error.code == 0 && !good) {
        host_fail(&board->error, HOST_CUBE, "%s; %s %s",
                  board->said[0] != '\0' ? board->said
                  : board->ready         ? "the connection broke"
                                         : "its shell did not answer",
                  next_step(board->said), board->to);
    }
    if (board->error.code == 0 && !board->done && board->reply != NULL) {
        host_fail(&board->error, HOST_CUBE,
                  "its shell ended too early; deploy again");
    }
    char *unit = board->unit;
    board->unit = NULL;
    host_board_free(board);
    board->unit = unit;
}

unsigned host_board_files(const struct host_deploy_board *board,
                          struct pollfd files[HOST_BOARD_FILES]) {
    unsigned n = 0;
    if (board->in >= 0 && board->reply != NULL)
        files[n++] = (struct pollfd){.fd = board->in, .events = POLLOUT};
    if (board->out >= 0)
        files[n++] = (struct pollfd){.fd = board->out, .events = POLLIN};
    if (board->err >= 0)
        files[n++] = (struct pollfd){.fd = board->err, .events = POLLIN};
    return n;
}

void host_board_step(struct host_deploy_board *board,
                     const struct host_deploy_job *job,
                     const struct pollfd *files, unsigned count) {
    for (unsigned i = 0; i < count; i++) {
        if (files[i].revents == 0 || files[i].fd < 0)
            continue;
        if (files[i].fd == board->in)
            send_some(board);
        else if (files[i].fd == board->out)
            receive(board, job, &board->out);
        else if (files[i].fd == board->err)
            receive(board, job, &board->err);
    }
    if (!board->ended &&
        host_now_us() - board->heard_us > HOST_BOARD_SILENT_US) {
        host_fail(&board->error, HOST_CUBE,
                  "nothing came for %d s (%s); try: ssh %s",
                  HOST_BOARD_SILENT_US / 1000000, board->step, board->to);
        (void)kill(board->pid, SIGTERM);
        close_one(&board->out);
        close_one(&board->err);
    }
    if (!board->ended && board->out < 0 && board->err < 0)
        end(board);
}

/* --- lines ---------------------------------------------------------------- */

enum { NAME_BYTES = HOST_SSH_MAX + 32 };

void host_deploy_lines_begin(struct host_deploy_lines *lines, unsigned boards,
                             bool quiet) {
    host_progress_begin(!quiet);
    lines->quiet = quiet;
    lines->live = boards <= host_progress_rows_max();
    if (lines->live)
        host_progress_rows(boards);
    else
        host_progress_end();
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
        if (board->error.code == 0 && !lines->quiet)
            host_say(stdout, "%s %s\n", name, board->result);
        if (board->error.code == 0 && board->unit != NULL && !lines->quiet)
            print_text(board->unit);
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
