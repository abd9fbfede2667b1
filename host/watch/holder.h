/* Who has a wire on this machine.
 *
 * Memory: the struct.  Work: a call of a socket, and two files of /proc.
 *
 *     struct host_holder holder;
 *     char text[HOST_HOLDER_TEXT];
 *     if (host_holder_find(&holder, "tcp:10.0.0.11:7000"))
 *         return host_fail(&error, HOST_CUBE, "%s",
 *                          host_holder_text(&holder, text, sizeof text));
 */
#ifndef HOST_HOLDER_H
#define HOST_HOLDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/un.h>

#include "host/base/error.h"

enum {
    HOST_WIRE_NAME = 4400, /* bytes of a wire's name: KIND:PATH */
    HOST_HOLDER_TEXT = 320
};

struct host_holder {
    pid_t pid; /* 0: not known, it takes no calls */
    uid_t uid;
    char user[40];     /* its name, or number */
    char command[200]; /* line, printable, as much of it as fits */
    int64_t since_s;   /* of the epoch, when it began; 0: not known */
};

/* The program that is using a wire.  False: none, this process, or one that is
 * not believed. */
bool host_holder_find(struct host_holder *holder, const char *wire);

/* "incode run bunny.xyz --cube lab.cube, process 4711 of alice, since 19:02" */
const char *host_holder_text(const struct host_holder *holder, char *text,
                             size_t size);

/* For look.h and offer.h: the meeting place of a wire, and the process at the
 * other end of a socket there. */
socklen_t host_holder_address(const char *wire, struct sockaddr_un *address);
bool host_holder_of(struct host_holder *holder, int file);

/* Any user may take a meeting place.  A holder is believed if it belongs to
 * this user or to root.  Root also believes another user's process that has the
 * wire open. */
bool host_holder_believed(const struct host_holder *holder, const char *wire);

#endif
