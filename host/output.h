/* A file that appears under its name only when it is whole: written beside it
 * under another name, renamed at the end.
 *
 * Memory: a buffer of 1 MiB.  Work: one copy, a write a MiB.
 *
 *     if (host_output_open(&out, "a.ele", &error) != 0) ...
 *     host_output_unsigned(&out, 7); host_output_text(&out, "\n");
 *     host_output_close(&out, 1, &error);
 */
#ifndef HOST_OUTPUT_H
#define HOST_OUTPUT_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "error.h"

struct host_output {
    const char *path; /* as the user gave it */
    char *target;     /* what it is in the end, links followed */
    char *temporary;  /* NULL: written in place (a device, standard output) */
    int file;
    int failure; /* errno of the first write that failed */
    size_t used;
    char *buffer;
};

/* Lets a signal that ends the program (interrupt, termination, hang-up) remove
 * the parts of outputs first, and makes errors of those that writing raises
 * (a pipe without a reader, a file beyond the limit).  Once, at the start. */
void host_output_guard(void);

/* Removes what a process that was ended has left of this output: its parts, and
 * the whole where it is no older than since_ns of the clock. */
void host_output_clean(const char *path, pid_t writer, uint64_t since_ns);

/* "-" is standard output; what is there and is no plain file (a device, a
 * pipe) is written in place.  HOST_INPUT where no file can be made, or
 * nobody reads from the pipe. */
int host_output_open(struct host_output *out, const char *path,
                     struct host_error *error);

/* Whether the output can be made: opens it and takes it away again.  A pipe
 * stays open, for its reader would take that for the end. */
int host_output_probe(const char *path, struct host_error *error);

/* None of these fails at once: host_output_close tells. */
void host_output_bytes(struct host_output *out, const void *bytes, size_t n);
void host_output_text(struct host_output *out, const char *text);
void host_output_unsigned(struct host_output *out, uint64_t value);

/* So that reading it gives the same double. */
void host_output_double(struct host_output *out, double value);

/* Flushes n outputs and, if all are whole and error->code is 0, gives them
 * their names; else removes them all.  Returns error->code. */
int host_output_close(struct host_output *out, size_t n,
                      struct host_error *error);

#endif
