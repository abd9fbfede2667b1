/* One board of `incode deploy`: a process of ssh, the script that it runs there
 * (script.h), and what that says.  All boards are at work at once: the caller
 * polls, and says which file has something.
 *
 * Memory: 6 KiB, and while it is at work the text of its unit. */
#ifndef HOST_BOARD_H
#define HOST_BOARD_H

#include <poll.h>
#include <stdbool.h>
#include <sys/types.h>

#include "deploy.h"
#include "script.h"
#include "host/nodes/cube_file.h"

enum {
    HOST_BOARD_FILES = 3,
    HOST_BOARD_TEXT = 400,
    HOST_BOARD_SILENT_US = 120000000 /* then it is given up */
};

enum host_deploy_order { HOST_DEPLOY, HOST_STATUS, HOST_REMOVE };

/* What is done to all of them. */
struct host_deploy_job {
    const struct host_cube_file *file;
    struct host_programs *programs;
    enum host_deploy_order order;
    bool dry_run;           /* says what it would do, and does nothing */
    const char *ssh_config; /* NULL: the user's own */
};

struct host_deploy_board {
    unsigned node;
    const char *to; /* as ssh takes it */
    bool ended;
    struct host_error error; /* code 0: it did what was asked for */
    bool running;            /* its node, in the end */
    char step[64];           /* what it is at */
    char result[HOST_BOARD_TEXT];
    char note[HOST_BOARD_TEXT]; /* "": none */
    char *unit;                 /* what would start it; NULL: not asked for */

    pid_t pid;
    uint64_t heard_us; /* when anything came or went */
    int in, out, err;  /* of ssh; -1: closed */
    char line[HOST_BOARD_TEXT], said[HOST_BOARD_TEXT]; /* as they come */
    size_t line_bytes, said_bytes;
    char fact[HOST_FACTS][HOST_BOARD_TEXT];
    bool ready, done;
    char *reply;
    size_t reply_bytes, reply_sent, program_sent;
    const struct host_program *program; /* to send; NULL: none */
};

/* Starts ssh to the board of a node that has one.  0, or HOST_BROKEN. */
int host_board_begin(struct host_deploy_board *board,
                     const struct host_deploy_job *job, unsigned node);

/* Those to poll, up to HOST_BOARD_FILES. */
unsigned host_board_files(const struct host_deploy_board *board,
                          struct pollfd files[HOST_BOARD_FILES]);

/* After poll, and once a second at least.  In the end it takes ssh's status,
 * and frees what it has. */
void host_board_step(struct host_deploy_board *board,
                     const struct host_deploy_job *job,
                     const struct pollfd *files, unsigned count);

void host_board_free(struct host_deploy_board *board);

/* The boards' lines: on a terminal that has room for all of them a row a board
 * shows what it is at; what came of it is printed once, when all are done. */

struct host_deploy_lines {
    bool quiet, live;
};

void host_deploy_lines_begin(struct host_deploy_lines *lines, unsigned boards,
                             bool quiet);
/* When anything may have changed. */
void host_deploy_lines_show(const struct host_deploy_lines *lines,
                            const struct host_deploy_board *boards,
                            unsigned count);
/* When all is done: last lines, what is wrong, and notes. */
void host_deploy_lines_end(const struct host_deploy_lines *lines,
                           const struct host_deploy_board *boards,
                           unsigned count);

#endif
