/* Where nodes put the part of their active face lists that does not fit: lists
 * of faces by node and brick, in memory first, then in a temporary file that
 * has no name and is gone when the program is.
 *
 * The mark that a vertex was reached comes many times over.  A list keeps it
 * once, as one bit for the vertex.
 *
 * Memory: blocks of 512 bytes up to blocks_memory, and 48 bytes a list;
 * beyond it, disk.  In a call that puts arrays aside (host/base/scratch.h) all
 * of it may be on disk. */
#ifndef HOST_SPILL_H
#define HOST_SPILL_H

#include <stdint.h>

#include "host/base/error.h"
#include "host/mesh/tetrahedra.h"
#include "incode/triangulator.h"

enum { HOST_SPILL_BLOCK_FACES = 42 };

#define HOST_SPILL_END UINT32_MAX

/* A list taken out of the store: its first block, and the marks. */
struct host_spill_list {
    uint32_t head, tail;
    uint64_t faces; /* marks included */
    uint64_t marks; /* bit i: vertex 64 * brick + i was reached */
    uint32_t brick;
};

struct host_spill {
    struct host_spill_block *blocks; /* the first of them */
    uint32_t blocks_memory;          /* most that are kept in memory */
    uint32_t blocks_mapped;          /* capacity of `blocks` */
    uint32_t blocks_used, free;      /* high water; list of free blocks */
    int file;                        /* -1, or the blocks past memory */
    struct host_spill_entry *table;  /* open addressing by node and brick */
    uint32_t table_size, table_used;
    uint64_t faces, faces_max, faces_total;
};

/* blocks_memory: 0 for the default, 64 MiB, or all of them where the call puts
 * arrays aside. */
int host_spill_init(struct host_spill *spill, uint32_t blocks_memory,
                    struct host_error *error);
/* Drops all lists. */
void host_spill_clear(struct host_spill *spill);
void host_spill_free(struct host_spill *spill);

/* Appends faces to the lists of their bricks, v[0] / 64; those whose v[1] and
 * v[2] are INCODE_NONE are marks. */
int host_spill_put(struct host_spill *spill, uint32_t node,
                   const struct incode_face *faces, uint32_t count,
                   struct host_error *error);

/* Takes a list out; what is put later starts a new one.  Empty if none. */
struct host_spill_list host_spill_detach(struct host_spill *spill,
                                         uint32_t node, uint32_t brick);

/* Appends all faces of a node that are in the store, but no marks, to a list:
 * rows whose last number is INCODE_NONE. */
int host_spill_copy(const struct host_spill *spill, uint32_t node,
                    struct host_tetrahedra *faces, struct host_error *error);

/* Moves up to max faces from the list's front, oldest first, to `faces`, sets
 * *count; the list is used up when list->faces is 0. */
int host_spill_take(struct host_spill *spill, struct host_spill_list *list,
                    struct incode_face *faces, uint32_t max, uint32_t *count,
                    struct host_error *error);

#endif
