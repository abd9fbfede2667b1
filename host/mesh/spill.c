#include "spill.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

enum { BLOCKS_MEMORY_DEFAULT = 131072, TABLE_START = 1024 };

struct host_spill_block {
    uint32_t next;
    uint16_t first, end; /* faces [first, end) are there */
    struct incode_face faces[HOST_SPILL_BLOCK_FACES];
};

struct host_spill_entry {
    uint32_t node, brick;
    struct host_spill_list list;
    bool used;
};

int host_spill_init(struct host_spill *spill, uint32_t blocks_memory,
                    struct host_error *error) {
    bool aside = host_call_share() < SIZE_MAX;
    memset(spill, 0, sizeof *spill);
    spill->blocks_memory = blocks_memory != 0 ? blocks_memory
                           : aside            ? UINT32_MAX
                                              : BLOCKS_MEMORY_DEFAULT;
    spill->free = HOST_SPILL_END;
    spill->file = -1;
    spill->table_size = TABLE_START;
    spill->table = host_map(TABLE_START * sizeof *spill->table);
    return spill->table == NULL ? host_fail_memory(error, "spilled faces") : 0;
}

void host_spill_clear(struct host_spill *spill) {
    for (uint32_t i = 0; i < spill->table_size; i++) {
        host_call_trim(sizeof *spill->table);
        spill->table[i] = (struct host_spill_entry){0};
    }
    spill->table_used = 0;
    spill->blocks_used = 0;
    spill->free = HOST_SPILL_END;
    spill->faces = 0;
}

void host_spill_free(struct host_spill *spill) {
    host_unmap(spill->blocks, spill->blocks_mapped * sizeof *spill->blocks);
    host_unmap(spill->table, spill->table_size * sizeof *spill->table);
    if (spill->file >= 0)
        close(spill->file);
    memset(spill, 0, sizeof *spill);
    spill->file = -1;
}

static int file_failed(struct host_error *error) {
    return host_fail(error, HOST_BROKEN,
                     "temporary file of spilled faces: %s; make room in the "
                     "directory for temporary files or set TMPDIR to another",
                     strerror(errno));
}

static off_t offset_of(const struct host_spill *s, uint32_t block) {
    return (off_t)(block - s->blocks_memory) *
           (off_t)sizeof(struct host_spill_block);
}

static int load(const struct host_spill *s, uint32_t block,
                struct host_spill_block *copy, struct host_error *error) {
    if (block < s->blocks_memory) {
        host_call_trim(HOST_CALL_AROUND);
        *copy = s->blocks[block];
        return 0;
    }
    errno = EIO;
    return pread(s->file, copy, sizeof *copy, offset_of(s, block)) ==
                   (ssize_t)sizeof *copy
               ? 0
               : file_failed(error);
}

static int store(struct host_spill *s, uint32_t block,
                 const struct host_spill_block *copy,
                 struct host_error *error) {
    if (block < s->blocks_memory) {
        host_call_trim(sizeof *copy); /* beside what was loaded */
        s->blocks[block] = *copy;
        return 0;
    }
    errno = ENOSPC;
    return pwrite(s->file, copy, sizeof *copy, offset_of(s, block)) ==
                   (ssize_t)sizeof *copy
               ? 0
               : file_failed(error);
}

/* A file without a name: it goes when the program goes. */
static int open_file(struct host_spill *s, struct host_error *error) {
    const char *directory = getenv("TMPDIR");
    char name[512];
    if (directory == NULL || strlen(directory) > 400)
        directory = "/tmp";
    strcpy(name, directory);
    strcat(name, "/incode-XXXXXX");
    s->file = mkostemp(name, O_CLOEXEC);
    if (s->file < 0)
        return file_failed(error);
    unlink(name);
    return 0;
}

/* A block without faces that no list has. */
static int new_block(struct host_spill *s, uint32_t *block,
                     struct host_error *error) {
    struct host_spill_block copy = {HOST_SPILL_END, 0, 0, {{{0}}}};
    *block = s->free;
    if (s->free != HOST_SPILL_END) {
        struct host_spill_block old;
        if (load(s, s->free, &old, error) != 0)
            return error->code;
        s->free = old.next;
        return store(s, *block, &copy, error);
    }
    *block = s->blocks_used;
    if (*block < s->blocks_memory && *block >= s->blocks_mapped) {
        uint32_t grown = s->blocks_mapped == 0 ? 256 : 2 * s->blocks_mapped;
        grown = grown > s->blocks_memory ? s->blocks_memory : grown;
        void *moved =
            host_remap(s->blocks, s->blocks_mapped * sizeof *s->blocks,
                       grown * sizeof *s->blocks);
        if (moved == NULL)
            return host_fail_memory(error, "spilled faces");
        s->blocks = moved;
        s->blocks_mapped = grown;
    }
    if (*block >= s->blocks_memory && s->file < 0 && open_file(s, error) != 0)
        return error->code;
    s->blocks_used++;
    return store(s, *block, &copy, error);
}

static struct host_spill_entry *find(const struct host_spill *s, uint32_t node,
                                     uint32_t brick) {
    uint32_t at = (brick * 2654435761u ^ node * 40503u) % s->table_size;
    host_call_trim(HOST_CALL_AROUND);
    while (s->table[at].used &&
           (s->table[at].node != node || s->table[at].brick != brick))
        at = (at + 1) % s->table_size;
    return &s->table[at];
}

/* Entries stay once made: a brick that spilled will often spill again. */
static int grow_table(struct host_spill *s, struct host_error *error) {
    struct host_spill old = *s;
    s->table_size = 2 * old.table_size;
    s->table = host_map(s->table_size * sizeof *s->table);
    if (s->table == NULL) {
        *s = old;
        return host_fail_memory(error, "spilled faces");
    }
    for (uint32_t i = 0; i < old.table_size; i++)
        if (old.table[i].used) /* find trims */
            *find(s, old.table[i].node, old.table[i].brick) = old.table[i];
    host_unmap(old.table, old.table_size * sizeof *old.table);
    return 0;
}

static uint64_t in_blocks(const struct host_spill_list *list) {
    return list->faces - (uint64_t)__builtin_popcountll(list->marks);
}

static int append(struct host_spill *s, struct host_spill_list *list,
                  struct incode_face face, struct host_error *error) {
    struct host_spill_block tail;
    bool empty = in_blocks(list) == 0;
    tail.end = 0;
    if (!empty && load(s, list->tail, &tail, error) != 0)
        return error->code;
    if (empty || tail.end == HOST_SPILL_BLOCK_FACES) {
        uint32_t block;
        if (new_block(s, &block, error) != 0)
            return error->code;
        if (empty) {
            list->head = block;
        } else {
            tail.next = block;
            if (store(s, list->tail, &tail, error) != 0)
                return error->code;
        }
        list->tail = block;
        memset(&tail, 0, sizeof tail);
        tail.next = HOST_SPILL_END;
    }
    tail.faces[tail.end++] = face;
    list->faces++;
    s->faces++;
    return store(s, list->tail, &tail, error);
}

static void mark(struct host_spill *s, struct host_spill_list *list,
                 uint32_t vertex) {
    uint64_t bit = UINT64_C(1) << (vertex % INCODE_BRICK_POINTS);
    s->faces += (list->marks & bit) == 0;
    list->faces += (list->marks & bit) == 0;
    list->marks |= bit;
}

static struct host_spill_list empty_list(uint32_t brick) {
    return (struct host_spill_list){
        .head = HOST_SPILL_END, .tail = HOST_SPILL_END, .brick = brick};
}

int host_spill_put(struct host_spill *spill, uint32_t node,
                   const struct incode_face *faces, uint32_t count,
                   struct host_error *error) {
    for (uint32_t i = 0; i < count; i++) {
        uint32_t brick = faces[i].v[0] / INCODE_BRICK_POINTS;
        struct host_spill_entry *entry = find(spill, node, brick);
        if (!entry->used) {
            if (2 * (spill->table_used + 1) > spill->table_size &&
                grow_table(spill, error) != 0)
                return error->code;
            entry = find(spill, node, brick);
            spill->table_used++;
            *entry =
                (struct host_spill_entry){node, brick, empty_list(brick), true};
        }
        if (faces[i].v[1] == INCODE_NONE)
            mark(spill, &entry->list, faces[i].v[0]);
        else if (append(spill, &entry->list, faces[i], error) != 0)
            return error->code;
    }
    spill->faces_total += count;
    if (spill->faces > spill->faces_max)
        spill->faces_max = spill->faces;
    return 0;
}

struct host_spill_list host_spill_detach(struct host_spill *spill,
                                         uint32_t node, uint32_t brick) {
    struct host_spill_entry *entry = find(spill, node, brick);
    struct host_spill_list list = entry->used ? entry->list : empty_list(brick);
    entry->list = empty_list(brick);
    return list;
}

int host_spill_take(struct host_spill *spill, struct host_spill_list *list,
                    struct incode_face *faces, uint32_t max, uint32_t *count,
                    struct host_error *error) {
    *count = 0;
    for (; list->marks != 0 && *count < max; list->marks &= list->marks - 1) {
        uint32_t slot = (uint32_t)__builtin_ctzll(list->marks);
        faces[(*count)++] =
            (struct incode_face){{list->brick * INCODE_BRICK_POINTS + slot,
                                  INCODE_NONE, INCODE_NONE}};
        list->faces--;
        spill->faces--;
    }
    while (list->faces > 0 && *count < max) {
        struct host_spill_block block;
        uint32_t at = list->head;
        if (load(spill, at, &block, error) != 0)
            return error->code;
        while (block.first < block.end && *count < max) {
            faces[(*count)++] = block.faces[block.first++];
            list->faces--;
            spill->faces--;
        }
        if (block.first == block.end) {
            list->head = block.next;
            block.next = spill->free;
            spill->free = at;
        }
        if (store(spill, at, &block, error) != 0)
            return error->code;
    }
    return 0;
}

/* Appends the faces of a list's blocks. */
static int copy_list(const struct host_spill *s,
                     const struct host_spill_list *list,
                     struct host_tetrahedra *faces, struct host_error *error) {
    struct host_spill_block block;
    uint64_t left = in_blocks(list);
    for (uint32_t at = list->head; left > 0; at = block.next) {
        uint32_t(*row)[4] =
            host_tetrahedra_room(faces, HOST_SPILL_BLOCK_FACES, error);
        if (row == NULL || load(s, at, &block, error) != 0)
            return error->code;
        for (unsigned i = block.first; i < block.end; i++, left--) {
            memcpy(*row, block.faces[i].v, sizeof block.faces[i].v);
            (*row++)[3] = INCODE_NONE;
        }
        host_tetrahedra_keep(faces, block.end - block.first);
        host_call_trim(sizeof block);
    }
    return 0;
}

int host_spill_copy(const struct host_spill *spill, uint32_t node,
                    struct host_tetrahedra *faces, struct host_error *error) {
    for (uint32_t i = 0; i < spill->table_size && error->code == 0; i++) {
        const struct host_spill_entry *entry = &spill->table[i];
        host_call_trim(sizeof *entry);
        if (entry->used && entry->node == node)
            copy_list(spill, &entry->list, faces, error);
    }
    return error->code;
}
