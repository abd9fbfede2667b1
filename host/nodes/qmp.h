/* QEMU's monitor, by which an emulated board is stopped, resumed and reset,
 * over a socket that it has inherited.  It is spoken to in lines of JSON;
 * events and answers to others are passed over.
 *
 * Memory: struct host_qmp.  Work: a request waits for its answer, which takes
 * milliseconds on a quiet machine, and never waits longer than wait_us.
 *
 *     host_qmp_init(&qmp, fd);
 *     if (host_qmp_ask(&qmp, HOST_QMP_RESET, &error) != 0)
 *         return error.code;
 *     host_qmp_forget(&qmp); // the board's process is another now
 */
#ifndef HOST_QMP_H
#define HOST_QMP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"

enum { HOST_QMP_US = 10000000, HOST_QMP_LINE = 4096 };

enum host_qmp_request { HOST_QMP_STOP, HOST_QMP_CONT, HOST_QMP_RESET };

struct host_qmp {
    int fd;           /* connected, non-blocking; stays the caller's */
    uint64_t wait_us; /* for an answer; at first HOST_QMP_US */
    bool ready;       /* it has heard the greeting, and been told so */
    size_t used;
    bool skipping; /* to the end of a line that is too long */
    char line[HOST_QMP_LINE];
};

void host_qmp_init(struct host_qmp *qmp, int fd);

/* 0, or HOST_CUBE: no answer in time, or the monitor refuses. */
int host_qmp_ask(struct host_qmp *qmp, enum host_qmp_request request,
                 struct host_error *error);

/* What was said so far was said by a process that is gone. */
void host_qmp_forget(struct host_qmp *qmp);

#endif
