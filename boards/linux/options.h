/* The arguments of incode-node. */
#ifndef BOARDS_LINUX_OPTIONS_H
#define BOARDS_LINUX_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "fault.h"
#include "transport/cube.h"

#define LINUX_UNNAMED UINT64_MAX /* as a node: it is to learn who it is */

struct linux_options {
    uint64_t node;        /* its number, or LINUX_UNNAMED */
    uint64_t dimension;   /* of the cube */
    uint64_t memory;      /* bytes of data memory in all, stack included */
    uint64_t stack;       /* bytes of it */
    uint64_t window;      /* frames a link and direction; 0: by memory */
    uint64_t epoch;       /* of this start; 0: it draws one */
    uint64_t serial_baud; /* of the slowest serial wire; 0: there is none */
    uint64_t host_port;   /* 1: it has a host port although not node 0 */
    uint64_t host_ports;  /* nodes before this one have; 0: as with 1 */
    uint64_t dead;        /* microseconds until a link is given up; 0: never */
    uint64_t awake;       /* microseconds to stay awake with nothing to do */
    int links[CUBE_LINKS_MAX]; /* open files, given by who starts the node */
    unsigned links_count;
    /* Wires that it opens itself: the arguments, as "2=call:10.0.0.1:7001". */
    const char *wire[CUBE_LINKS_MAX];
    unsigned wires_count;
    const char *key;   /* a file, or NULL */
    uint32_t insecure; /* a bit for each link that goes over TCP without it */
};

/* False: *fault says which argument is wrong. */
bool linux_options_read(char **argv, struct linux_options *options,
                        struct linux_fault *fault);

/* Prints what --help or --version asks for; false: neither is asked for. */
bool linux_options_answer(const char *argument);

#endif
