/* Outputs that appear under their names only when all of them are whole: each
 * is written beside its name, as its part, and all get their names together at
 * the end of a command that has succeeded.  Until then, and where it fails,
 * what was there before stays as it was.
 *
 * Memory: a buffer of 1 MiB an output that is open; its names until the end.
 */
#ifndef HOST_OUTPUT_H
#define HOST_OUTPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/types.h>

#include "host/base/error.h"

struct host_part;

struct host_output {
    const char *path;       /* as the user gave it */
    struct host_part *part; /* NULL: in place (a device, standard output) */
    int file;
    int failure;      /* errno of the first write that failed */
    uint64_t written; /* bytes, beside those in the buffer */
    size_t used;
    char *buffer;
    bool silent; /* it is no part of the progress that is shown */
};

/* Lets a signal that ends the program (interrupt, termination, hang-up) remove
 * the parts of outputs first, and makes errors of those that writing raises
 * (a pipe without a reader, a file beyond the limit).  Once, at the start. */
void host_output_guard(void);

/* Removes what a process that was ended has left of this output: its part, and
 * the whole where it had its name already; what was there before has it back.
 * A file that is not that process's stays as it is. */
void host_output_clean(const char *path, pid_t writer);

/* "-" is standard output; what is there and is no plain file (a device, a
 * pipe) is written in place.  HOST_INPUT where no file can be made, or
 * nobody reads from the pipe. */
int host_output_open(struct host_output *out, const char *path,
                     struct host_error *error);

/* Whether the output can be made: opens it and takes it away again.  A pipe
 * stays open, for its reader would take that for the end. */
int host_output_probe(const char *path, struct host_error *error);

/* An output was asked for, and is another process's to make: a signal that ends
 * this one says that there is none. */
void host_output_expect(void);

/* A line for the user if a signal ends the program, with its newline; NULL:
 * none.  It outlives the command. */
void host_output_advice(const char *line);

/* None of these fails at once: host_output_close tells. */
void host_output_bytes(struct host_output *out, const void *bytes, size_t n);
void host_output_unsigned(struct host_output *out, uint64_t value);
static inline void host_output_text(struct host_output *out, const char *text) {
    host_output_bytes(out, text, strlen(text)); /* known of most, here */
}

/* Where the next byte goes, and the way back there to write other bytes in the
 * place of as many: of a file that is written beside its name (part). */
static inline uint64_t host_output_place(const struct host_output *out) {
    return out->written + out->used;
}
void host_output_return(struct host_output *out, uint64_t place);

/* Ends the writing of n outputs; where one of them is not whole or error->code
 * is not 0, removes their parts.  Returns error->code. */
int host_output_close(struct host_output *out, size_t n,
                      struct host_error *error);

/* The last act of a command.  Gives all outputs that were closed their names if
 * error->code is 0, else removes their parts.  Where one cannot have its name,
 * those that had theirs lose them again to what was there before.  Returns
 * error->code; once it is 0, no signal of host_output_guard ends the program.
 */
int host_output_commit(struct host_error *error);

/* Waits until a plain file and its name are on the disk: 0, or HOST_INPUT. */
int host_output_sync(const char *path, struct host_error *error);

/* Flushes what was printed on standard output.  HOST_INPUT, and the rest of it
 * is dropped, where that does not arrive. */
int host_output_printed(struct host_error *error);

#endif
