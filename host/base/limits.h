/* How much memory a command may have resident: --host-memory and --scratch,
 * which all commands that read or make points or tetrahedra have.  What is
 * beyond it is put aside (scratch.h). */
#ifndef HOST_LIMITS_H
#define HOST_LIMITS_H

#include <sys/types.h>

#include "options.h"

enum { HOST_RESIDENT_MIN = 16 << 20 };

struct host_limits {
    uint64_t memory;    /* bytes; 0: half of what is available, where less than
                           all would fit, or the input's size is not known: then
                           arrays are put aside from a half of that on */
    const char *folder; /* NULL: $TMPDIR, else that of the output, else /tmp */
};

#define HOST_LIMITS_ROWS(type, memory, folder)                                 \
    {"host-memory",                                                            \
     0,                                                                        \
     "SIZE",                                                                   \
     "Memory that this process may use, as 2G, whatever nodes have; the rest " \
     "of points and tetrahedra is put aside on disk. 16M or more. Default: "   \
     "half of what is available, where a file is so large that it may not "    \
     "suffice, or a pipe brings so much",                                      \
     HOST_AT(type, memory),                                                    \
     .least = HOST_RESIDENT_MIN,                                               \
     .bytes = "give 16M or more, as in 2G"},                                   \
    {                                                                          \
        "scratch", 0, "DIR",                                                   \
            "Folder for what is put aside. Default: $TMPDIR, "                 \
            "else "                                                            \
            "that of the first output, else /tmp",                             \
            HOST_AT(type, folder)                                              \
    }

/* From now on all that this thread does is a call (parallel.h) of `threads`
 * threads (0: one a processor) within these limits: there is one at a time.
 * With a limit, a page of what is put aside that its disk does not give any
 * more (SIGBUS) ends the program with a message, as SIGTERM does.
 * input: the file that is read first, by whose size is judged whether all fits;
 * output: the first.  Both may be NULL or "-".  0, or HOST_INPUT: nothing can
 * be put aside there. */
int host_limits_enter(const struct host_limits *limits, unsigned threads,
                      const char *input, const char *output,
                      struct host_error *error);

/* The limit that is in force, in bytes; 0: none. */
uint64_t host_limits_memory(void);

/* Where so many bytes may be put aside in all: notes that, or HOST_INPUT if the
 * disk has no room for them.  Nothing without a limit. */
int host_limits_check(uint64_t need, bool noted, struct host_error *error);

/* Bytes that were checked to be free on this device. */
uint64_t host_limits_reserved(dev_t device);

/* Ends it, if one has begun.  The most bytes that were put aside at a time. */
uint64_t host_limits_leave(void);

#endif
