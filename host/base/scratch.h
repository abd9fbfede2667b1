/* Large arrays of a call whose resident memory is limited (parallel.h): each is
 * a file of its own in the scratch directory, without a name, that is mapped.
 * Its pages leave the process when there are too many, and come back from the
 * kernel's cache of files, or from the disk, when they are touched.
 *
 * A call whose `scratch` is set gets such arrays from host_map (memory.h).  A
 * loop over them calls host_call_trim (parallel.h) after each block.
 *
 * An array is unmapped by a thread of the call that mapped it.  A file is
 * reserved whole, so that a full disk is an error of host_map and never a
 * signal.
 *
 * Memory: 24 KiB.  Of arrays, what threads touch between two trims is resident
 * beyond three quarters of the limit: a 32nd of it in all.  Work: 2 us a trim
 * that looks, 60 ns a page that leaves, about 1 us a page that comes back. */
#ifndef HOST_SCRATCH_H
#define HOST_SCRATCH_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"

enum { HOST_SCRATCH_ARRAYS = 1024 };

struct host_scratch_array {
    char *at;
    size_t bytes; /* of its file, in whole pages */
    int file;
};

struct host_scratch {
    const char *directory;
    uint64_t resident_max; /* bytes of this process, or of the call's own */
    bool own;
    size_t array_min;      /* bytes of an array that becomes a file */
    uint64_t memory_first; /* bytes of arrays of the call that stay in memory
                              before any becomes a file */
    size_t step;           /* bytes that a thread touches between two looks */
    int statm;             /* tells how much is resident; -1: nothing does */
    int pagemap;           /* and of these arrays; -1: is not asked */
    uint64_t resident_seen,
        trims;            /* then: the most, and how often pages left */
    pthread_mutex_t lock; /* of all that follows */
    struct host_scratch_array array[HOST_SCRATCH_ARRAYS];
    unsigned arrays;
    uint64_t bytes, bytes_max; /* of all files, now and at most */
    uint64_t wanted;           /* bytes that were not to be had, */
    int failure;               /* and errno; 0: there was no failure */
    _Atomic uint64_t touched;  /* by threads that have ended */
    _Atomic uint64_t since;    /* with `own`: touched since pages left */
};

/* directory outlives the scratch.  HOST_INPUT: no file can be made there.
 * HOST_USAGE: this process has too much resident already, whatever is put
 * aside. */
int host_scratch_begin(struct host_scratch *scratch, const char *directory,
                       uint64_t resident_max, unsigned threads,
                       struct host_error *error);
/* The same where the limit is of what the call itself has resident, in a
 * process with other memory and other calls.  The kernel does not report that.
 * So pages leave when threads have touched half of the limit, unless all files
 * that the process has mapped have less resident.  `failure` is errno if no
 * file can be made there. */
int host_scratch_begin_own(struct host_scratch *scratch, const char *directory,
                           uint64_t resident_max, unsigned threads,
                           struct host_error *error);
/* The same for one thread of the simulation, in whose process nodes are, too:
 * pages of arrays count alone, nearly all arrays are files, and all their pages
 * leave at every look. */
int host_scratch_begin_small(struct host_scratch *scratch,
                             const char *directory, uint64_t resident_max,
                             struct host_error *error);
/* Closes the files of arrays that are still there. */
void host_scratch_end(struct host_scratch *scratch);

/* Bytes that the file system of the directory leaves to this user. */
uint64_t host_scratch_free(const struct host_scratch *scratch);

/* Whether that file system is itself in memory, as tmpfs is. */
bool host_scratch_in_memory(const struct host_scratch *scratch);

/* Lets all arrays' pages leave where more than three quarters of the limit are
 * resident.  A thread has touched so many bytes since it called this. */
void host_scratch_trim(struct host_scratch *scratch, size_t touched);

/* Adds what a thread that ends has touched since it looked. */
void host_scratch_ended(struct host_scratch *scratch, size_t touched);

/* The rest is for host_map and its kin.  space: address space that is reserved,
 * where the array comes to stand. */

bool host_scratch_has(struct host_scratch *scratch, const void *array);
/* Copies a part of an array through its file: its pages stay away.  False:
 * there is no such array, or the disk failed. */
bool host_scratch_read(struct host_scratch *scratch, void *to, const void *from,
                       size_t bytes);
bool host_scratch_write(struct host_scratch *scratch, void *to,
                        const void *from, size_t bytes);
bool host_scratch_map(struct host_scratch *scratch, void *space, size_t bytes);
/* The array stands at `space`, too, from then on.  False: it is as it was. */
bool host_scratch_move(struct host_scratch *scratch, const void *array,
                       void *space, size_t bytes);
/* Gives back what the file has beyond `bytes`. */
void host_scratch_cut(struct host_scratch *scratch, const void *array,
                      size_t bytes);
/* Closes its file; false: it has none. */
bool host_scratch_unmap(struct host_scratch *scratch, const void *array);

#endif
