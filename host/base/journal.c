#include "journal.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "create.h"
#include "parallel.h"
#include "transport/frame.h"

#define MAGIC UINT64_C(0x316c6e726a636e69)

enum {
    STEP = 64, /* where heads are */
    SEARCH = 1 << 14,
    BLOCK = 1 << 20
};

_Static_assert(sizeof(struct host_journal_head) == STEP, "a head has no gaps");

static uint32_t head_crc(const struct host_journal_head *head) {
    return frame_crc32c(0, head, offsetof(struct host_journal_head, crc));
}

/* As pread, without interruptions; what lies past the end counts as failed, and
 * errno is 0 then. */
static bool read_at(int file, void *to, size_t bytes, uint64_t at) {
    char *next = to;
    while (bytes > 0) {
        ssize_t n = pread(file, next, bytes, (off_t)at);
        if (n < 0 && errno == EINTR)
            continue;
        if (n == 0)
            errno = 0;
        if (n <= 0)
            return false;
        next += n, at += (uint64_t)n, bytes -= (size_t)n;
    }
    return true;
}

static bool write_at(int file, const void *from, size_t bytes, uint64_t at) {
    const char *next = from;
    while (bytes > 0) {
        ssize_t n = pwrite(file, next, bytes, (off_t)at);
        if (n < 0 && errno == EINTR)
            continue;
        if (n == 0)
            errno = ENOSPC;
        if (n <= 0)
            return false;
        next += n, at += (uint64_t)n, bytes -= (size_t)n;
    }
    return true;
}

static uint64_t whole_steps(uint64_t bytes) {
    return (bytes + STEP - 1) / STEP * STEP;
}

/* --- finding records ------------------------------------------------------ */

static bool is_head(const struct host_journal_head *head, uint64_t at,
                    uint64_t size) {
    return head->magic == MAGIC && head->crc == head_crc(head) &&
           head->bytes <= size - at - STEP;
}

/* As read_at; a disk that fails is the journal's failure. */
static bool read_place(struct host_journal *j, void *to, size_t bytes,
                       uint64_t at) {
    bool is_read = read_at(j->file, to, bytes, at);
    if (!is_read && errno != 0)
        j->failure = errno;
    return is_read;
}

/* The place of the next sound head from `at` on; `size`: there is none. */
static uint64_t find_head(struct host_journal *j, uint64_t at, uint64_t size,
                          struct host_journal_head *head) {
    char bytes[SEARCH];
    if (at + STEP <= size && read_place(j, head, sizeof *head, at) &&
        is_head(head, at, size))
        return at;
    for (at += STEP; at + STEP <= size; at += SEARCH) {
        size_t n = size - at < SEARCH ? (size_t)(size - at) : SEARCH;
        if (!read_place(j, bytes, n, at))
            return size;
        for (size_t i = 0; i + STEP <= n; i += STEP) {
            memcpy(head, bytes + i, sizeof *head);
            if (is_head(head, at + i, size))
                return at + i;
        }
    }
    return size;
}

static int add_record(struct host_journal *j,
                      const struct host_journal_head *head, uint64_t at,
                      struct host_error *error) {
    if ((j->records & (j->records - 1)) == 0) { /* a power of two: it is full */
        size_t more = j->records == 0 ? 1 : 2 * j->records;
        void *moved = realloc(j->record, more * sizeof *j->record);
        if (moved == NULL)
            return host_fail_memory(error, "the list of records");
        j->record = moved;
    }
    j->record[j->records++] = (struct host_journal_record){*head, at + STEP};
    return 0;
}

static int list_records(struct host_journal *j, uint64_t size,
                        struct host_error *error) {
    struct host_journal_head head;
    uint64_t at;
    while ((at = find_head(j, j->end, size, &head)) < size) {
        j->damaged += at - j->end;
        if (add_record(j, &head, at, error) != 0)
            return error->code;
        j->end = at + STEP + whole_steps(head.bytes);
        j->sequence = head.sequence + 1;
    }
    return j->failure == 0
               ? 0
               : host_fail(error, HOST_INPUT,
                           "%s: cannot be read (%s); check the disk, and give "
                           "the same command again",
                           j->path, strerror(j->failure));
}

/* --- what is durable ------------------------------------------------------ */

static void sync_now(struct host_journal *j) {
    j->dirty = false;
    (void)pthread_mutex_unlock(&j->lock);
    int failure;
    do
        failure = fdatasync(j->file) == 0 || errno == EINVAL ? 0 : errno;
    while (failure == EINTR);
    (void)pthread_mutex_lock(&j->lock);
    j->failure = j->failure == 0 ? failure : j->failure;
}

static void *sync_often(void *context) {
    struct host_journal *j = context;
    struct timespec next;
    (void)pthread_mutex_lock(&j->lock);
    (void)clock_gettime(CLOCK_MONOTONIC, &next);
    while (!j->ending) {
        next.tv_sec++;
        while (!j->ending &&
               pthread_cond_timedwait(&j->change, &j->lock, &next) != ETIMEDOUT)
            ;
        if (!j->ending && j->dirty)
            sync_now(j);
        (void)clock_gettime(CLOCK_MONOTONIC, &next);
    }
    (void)pthread_mutex_unlock(&j->lock);
    return NULL;
}

static int tell(const struct host_journal *j, int failure,
                struct host_error *error) {
    return host_fail(
        error, HOST_INPUT,
        "%s: cannot be written (%s); %s, and give the same command again",
        j->path, strerror(failure),
        failure == ENOSPC || failure == EDQUOT || failure == EFBIG
            ? "make room"
            : "check the disk");
}

int host_journal_sync(struct host_journal *journal, struct host_error *error) {
    struct host_journal *j = journal;
    (void)pthread_mutex_lock(&j->lock);
    sync_now(j);
    int failure = j->failure;
    (void)pthread_mutex_unlock(&j->lock);
    return failure == 0 ? 0 : tell(j, failure, error);
}

/* --- the whole ------------------------------------------------------------ */

static void start_thread(struct host_journal *j) {
    pthread_condattr_t attributes;
    sigset_t all, before;
    (void)pthread_mutex_init(&j->lock, NULL);
    (void)pthread_condattr_init(&attributes);
    (void)pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    (void)pthread_cond_init(&j->change, &attributes);
    (void)pthread_condattr_destroy(&attributes);
    (void)sigfillset(&all);
    (void)pthread_sigmask(SIG_SETMASK, &all, &before);
    j->synced_by_thread = pthread_create(&j->thread, NULL, sync_often, j) == 0;
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
}

bool host_journal_is(int folder, const char *name) {
    struct stat about;
    static const char zeros[SEARCH];
    char head[SEARCH] = "";
    int file = host_folder_file(folder, name, O_RDONLY);
    bool is = file >= 0 && fstat(file, &about) == 0;
    if (is && about.st_size > 0) {
        const uint64_t magic = MAGIC;
        size_t n = about.st_size < SEARCH ? (size_t)about.st_size : SEARCH;
        is = read_at(file, head, n, 0) &&
             (memcmp(head, &magic, sizeof magic) == 0 ||
              memcmp(head, zeros, n) == 0);
    }
    if (file >= 0)
        (void)close(file);
    return is;
}

int host_journal_open(struct host_journal *journal, int folder,
                      const char *name, const char *path,
                      struct host_error *error) {
    struct host_journal *j = journal;
    struct stat about;
    *j = (struct host_journal){.path = path};
    j->file = host_folder_file(folder, name, O_RDWR | O_CREAT);
    if (j->file < 0 || fstat(j->file, &about) != 0) {
        host_fail(error, HOST_INPUT, "%s: %s; give another folder", path,
                  strerror(errno));
        if (j->file >= 0)
            (void)close(j->file);
        j->path = NULL;
        return error->code;
    }
    start_thread(j);
    if (list_records(j, (uint64_t)about.st_size, error) == 0 &&
        ftruncate(j->file, (off_t)j->end) != 0)
        tell(j, errno, error);
    if (error->code != 0)
        host_journal_close(j);
    return error->code;
}

void host_journal_clear(struct host_journal *journal) {
    if (ftruncate(journal->file, 0) != 0)
        journal->failure = errno;
    journal->end = 0;
    journal->records = 0;
    journal->damaged = 0;
    journal->sequence = 0;
    free(journal->record);
    journal->record = NULL;
}

/* Payload first: 0 or errno. */
static int write_record(const struct host_journal *j,
                        struct host_journal_head *head,
                        const struct host_bytes *part, unsigned parts) {
    uint64_t at = j->end + STEP;
    head->payload_crc = 0;
    for (unsigned i = 0; i < parts; i++) {
        const char *from = part[i].from;
        for (uint64_t done = 0; done < part[i].bytes;) {
            uint64_t left = part[i].bytes - done;
            size_t n = left < BLOCK ? (size_t)left : BLOCK;
            head->payload_crc = frame_crc32c(head->payload_crc, from + done, n);
            if (!write_at(j->file, from + done, n, at))
                return errno;
            host_call_trim(n);
            done += n, at += n;
        }
    }
    head->bytes = at - j->end - STEP;
    head->magic = MAGIC;
    head->sequence = j->sequence;
    head->crc = head_crc(head);
    return write_at(j->file, head, sizeof *head, j->end) ? 0 : errno;
}

int host_journal_append(struct host_journal *journal,
                        struct host_journal_head *head,
                        const struct host_bytes *part, unsigned parts,
                        struct host_error *error) {
    struct host_journal *j = journal;
    (void)pthread_mutex_lock(&j->lock);
    int failure = j->failure;
    if (failure == 0) {
        failure = write_record(j, head, part, parts);
        if (failure != 0)
            (void)ftruncate(j->file, (off_t)j->end);
    }
    if (failure == 0) {
        j->end += STEP + whole_steps(head->bytes);
        j->sequence++;
        j->dirty = true;
        if (!j->synced_by_thread)
            sync_now(j);
    }
    if (failure != 0)
        j->failure = failure;
    failure = j->failure; /* of the sync as well */
    (void)pthread_mutex_unlock(&j->lock);
    return failure == 0 ? 0 : tell(j, failure, error);
}

void host_journal_read(struct host_journal_reader *reader,
                       const struct host_journal *journal,
                       const struct host_journal_record *record) {
    *reader =
        (struct host_journal_reader){.file = journal->file,
                                     .at = record->at,
                                     .left = record->head.bytes,
                                     .payload_crc = record->head.payload_crc};
}

bool host_journal_take(struct host_journal_reader *reader, void *to,
                       uint64_t bytes) {
    struct host_journal_reader *r = reader;
    char *next = to;
    if (bytes > r->left)
        return false;
    while (bytes > 0) {
        size_t n = bytes < BLOCK ? (size_t)bytes : BLOCK;
        if (!read_at(r->file, next, n, r->at))
            return false;
        r->crc = frame_crc32c(r->crc, next, n);
        host_call_trim(n);
        next += n, bytes -= n, r->at += n, r->left -= n;
    }
    return true;
}

bool host_journal_sound(const struct host_journal_reader *reader) {
    return reader->left == 0 && reader->crc == reader->payload_crc;
}

void host_journal_close(struct host_journal *journal) {
    struct host_journal *j = journal;
    if (j->path == NULL)
        return;
    if (j->synced_by_thread) {
        (void)pthread_mutex_lock(&j->lock);
        j->ending = true;
        (void)pthread_cond_signal(&j->change);
        (void)pthread_mutex_unlock(&j->lock);
        (void)pthread_join(j->thread, NULL);
    }
    (void)pthread_cond_destroy(&j->change);
    (void)pthread_mutex_destroy(&j->lock);
    (void)close(j->file);
    free(j->record);
    *j = (struct host_journal){.path = NULL};
}
