/* Where a person's cube is, as the commands for it say: --cube FILE, --port
 * DEV, --tcp HOST:PORT, --unix PATH.  Without a file one wire to node 0 is all
 * that is known: the cube's dimension is what node 0 greets with, or
 * --cube-nodes. */
#ifndef HOST_SITE_H
#define HOST_SITE_H

#include "host/base/options.h"
#include "host/nodes/remote.h"
#include "host/service/machine.h"

struct host_site_options {
    const char *cube, *port, *tcp, *unix_path; /* one of them */
    unsigned nodes;  /* 0: as the file or node 0 says */
    uint64_t baud;   /* of --port; 0: 115,200 */
    const char *key; /* a file, of --tcp; NULL: --insecure */
    bool insecure;
};

struct host_site {
    char program[4096]; /* of nodes that are started here */
    char path[240];     /* what stands for a file's name, where there is none */
    char where[HOST_REMOTE_WHERE]; /* the machine's */
    struct host_cube_file file;    /* or what stands for one */
    struct host_remote remote;
    struct host_machine machine;
};

/* The rows of those options, for host_options.more. */
extern const struct host_option host_site_rows[];

/* The words of a command that name the same place, quoted for a shell, as in
 * "--port /dev/ttyUSB0 --baud 9600".  Where they do not fit: what to put there.
 */
void host_site_text(const struct host_site_options *options, char *text,
                    size_t size);

/* Whether one place is named, and what it needs: HOST_USAGE if not. */
int host_site_check(const struct host_site_options *options,
                    struct host_error *error);

/* Reads the cube file, or the key of --tcp, and forgets it again: HOST_INPUT if
 * that cannot be read, for who opens the wires later. */
int host_site_read(const struct host_site_options *options,
                   struct host_error *error);

/* Opens the wires; waits for node 0's greeting where it tells the dimension, 3
 * s at most.  Nodes that the file lists under `start` are started. */
int host_site_open(struct host_site *site,
                   const struct host_site_options *options,
                   struct host_error *error);
void host_site_close(struct host_site *site);

/* Who is at the other end of a wire of which nothing else is known: a node
 * greets with its number and the dimension of its cube where it is asked as
 * PROTOCOL.md says, whatever its link does meanwhile. */

struct host_greeting {
    bool found;
    bool learns;   /* a board that waits to be told who it is */
    uint16_t node; /* who greets, by this port of its */
    uint8_t port;
    uint16_t peer_node; /* whom it expects here */
    uint8_t dimension;
    uint16_t frame_payload; /* bytes */
};

#endif
