/* A file of records that is appended to, and that a later process reads, after
 * whatever ended the earlier one.
 *
 * A record is a head of 64 bytes and a payload, each with a CRC-32C.  The head
 * is written last, so a record that has its head is whole, unless the power
 * failed or the file was damaged.  host_journal_open lists all records whose
 * heads are sound; behind a damaged head it goes on at the next sound one.
 * What follows the last sound record is cut off.
 *
 * A thread syncs the file once a second.  What was appended is kept when the
 * process is killed, and lost with the power if it was appended within the last
 * second, and the time that the disk takes to sync.
 *
 * Memory: 72 bytes a record.  Work: that of the file, and a CRC. */
#ifndef HOST_JOURNAL_H
#define HOST_JOURNAL_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"

struct host_journal_head {
    uint64_t magic;
    uint64_t key;     /* the caller's; the same for what belongs together */
    uint64_t bytes;   /* of the payload */
    uint64_t rows[2]; /* the caller's */
    uint32_t kind, number, part; /* the caller's */
    uint32_t sequence;           /* of records */
    uint32_t payload_crc, crc;   /* crc: of all before it */
};

struct host_journal_record {
    struct host_journal_head head;
    uint64_t at; /* of the payload */
};

struct host_bytes {
    const void *from;
    uint64_t bytes;
};

struct host_journal {
    const char *path; /* in messages */
    int file;
    uint64_t end;
    uint32_t sequence;                  /* of the next record */
    struct host_journal_record *record; /* [records] found when it was opened */
    size_t records;
    uint64_t damaged; /* bytes between records, where no sound head is */
    /* Of appending. */
    pthread_mutex_t lock;
    pthread_cond_t change;
    pthread_t thread;
    bool synced_by_thread, dirty, ending;
    int failure; /* errno; 0: there was none */
};

/* Opens, or makes, a plain file of a folder of host_folder_open.  path outlives
 * the journal.  HOST_INPUT: it cannot be opened or read. */
int host_journal_open(struct host_journal *journal, int folder,
                      const char *name, const char *path,
                      struct host_error *error);

/* Whether a file of that folder may be a journal: it is empty, or begins as one
 * does, or with zeros, as a loss of power may leave it. */
bool host_journal_is(int folder, const char *name);

/* Drops all records. */
void host_journal_clear(struct host_journal *journal);

/* Appends a record; sets the rest of the head.  Several threads may do so.
 * HOST_INPUT: the disk is full, or does not take it: the journal then stands as
 * before. */
int host_journal_append(struct host_journal *journal,
                        struct host_journal_head *head,
                        const struct host_bytes *part, unsigned parts,
                        struct host_error *error);

/* Waits until all that was appended is on the disk: 0, or HOST_INPUT. */
int host_journal_sync(struct host_journal *journal, struct host_error *error);

/* Reads a payload from its begin on. */
struct host_journal_reader {
    int file;
    uint64_t at, left;
    uint32_t crc, payload_crc;
};

void host_journal_read(struct host_journal_reader *reader,
                       const struct host_journal *journal,
                       const struct host_journal_record *record);
/* The next bytes; false: so many are not left, or the file cannot be read. */
bool host_journal_take(struct host_journal_reader *reader, void *to,
                       uint64_t bytes);
/* At the end: all was read, and is as it was written. */
bool host_journal_sound(const struct host_journal_reader *reader);

/* Nothing where it was never opened (all bytes 0). */
void host_journal_close(struct host_journal *journal);

#endif
