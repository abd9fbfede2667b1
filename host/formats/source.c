#include "source.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/progress.h"
#include "host/base/scratch.h"

enum {
    ALWAYS = 16 << 20,     /* bytes that a file may always take */
    PLAIN_SHARE = 2,       /* of the available memory for a plain file, */
    PACKED_SHARE = 4,      /* and for a packed one, held whole */
    WINDOW = 1 << 20,      /* of a file that is read piece by piece */
    WINDOW_MAX = 16 << 20, /* the same, with long lines */
    PIECE = 1 << 18,       /* bytes at a time */
    PACKED_BYTES = 1 << 16
};

#define DAMAGED                                                                \
    "the packed data is damaged; test it with gzip -t and get it again"

/* The state of reading a file. */
struct host_feed {
    int file;       /* -1: z has all packed bytes */
    bool packed;    /* else its bytes are read as they are, and z is unused */
    uint64_t size;  /* of the file; 0: not known */
    uint64_t taken; /* bytes read of it so far */
    size_t most;    /* bytes that may be held; 0: not yet known */
    z_stream z;
    bool between, ended; /* after a member, after the last */
    struct host_error fault;
    uint8_t *window;
    size_t capacity;
    uint8_t input[PACKED_BYTES];
};

bool host_is_packed(const char *path) {
    size_t length = strlen(path), n = strlen(".gz");
    return length > n && strcasecmp(path + length - n, ".gz") == 0;
}

int host_source_fail(const struct host_source *source, struct host_error *error,
                     const char *what) {
    return host_fail(error, HOST_INPUT, "%s: %s", source->path, what);
}

/* Where this thread's call puts arrays aside; NULL: nowhere. */
static const struct host_scratch *aside(void) {
    const struct host_call *call = host_call();
    return call == NULL ? NULL : call->scratch;
}

/* How many bytes a file may take that needs `bytes` now and has `held`.  What
 * is available is looked up once, and only for a large file; share: the part of
 * the memory, where it is held there. */
static size_t most_bytes(size_t *most, size_t bytes, size_t held,
                         unsigned share) {
    const struct host_scratch *scratch = aside();
    if (bytes <= ALWAYS && scratch == NULL)
        return ALWAYS;
    if (*most == 0 && scratch != NULL) {
        uint64_t room = host_scratch_free(scratch);
        *most = room > SIZE_MAX - held ? SIZE_MAX : (size_t)room + held;
    } else if (*most == 0) {
        uint64_t part = (host_memory_available() + held) / share;
        *most = (size_t)(part > ALWAYS ? part : ALWAYS);
    }
    return *most;
}

static int too_long(const struct host_source *source,
                    struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s: more than %zu bytes, the most that %s has; give "
                     "another file",
                     source->path, source->bound, source->what);
}

static const double mb = 1e6;

/* Where it is put aside: pieces say that other formats need no such room. */
static int too_large_aside(const char *path, size_t bytes, size_t most,
                           struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s: %.1f MB or more to put aside, and %s has %.1f MB "
                     "free; free some there, give another folder as --scratch "
                     "DIR, or convert it to .npy, which is read piece by piece",
                     path, (double)bytes / mb, aside()->directory,
                     (double)most / mb);
}

static int too_large(const char *path, size_t bytes, size_t most,
                     struct host_error *error) {
    if (aside() != NULL)
        return too_large_aside(path, bytes, most, error);
    return host_fail(error, HOST_INPUT,
                     "%s: %.1f MB or more, which is above half of the memory "
                     "available (%.1f MB); free some memory or take a machine "
                     "with more, or give it --host-memory",
                     path, (double)bytes / mb, (double)most / mb);
}

static int unpacks_too_large(const char *path, uint64_t packed, size_t most,
                             const char *share, struct host_error *error) {
    if (aside() != NULL)
        return too_large_aside(path, most, most, error);
    return host_fail(error, HOST_INPUT,
                     "%s: %.1f MB that become more than %.1f MB unpacked, %s "
                     "of the memory available; unpack it to see what it holds, "
                     "free some memory, take a machine with more, or give it "
                     "--host-memory",
                     path, (double)packed / mb, (double)most / mb, share);
}

int host_source_unpacks(const struct host_source *source, uint64_t packed,
                        uint64_t bytes, struct host_error *error) {
    size_t most = 0;
    (void)most_bytes(&most, (size_t)bytes, 0, PLAIN_SHARE);
    return bytes > ALWAYS && bytes > most
               ? unpacks_too_large(source->path, packed, most, "half", error)
               : 0;
}

bool host_source_inflate(
    const uint8_t *from, size_t packed,
    /* zlib writes it.  NOLINTNEXTLINE(readability-non-const-parameter) */
    uint8_t *to, size_t bytes) {
    z_stream z = {.next_in = (z_const Bytef *)from, .next_out = to};
    int status = inflateInit(&z);
    while (status == Z_OK) {
        const uint8_t *end = from + packed, *room = to + bytes;
        size_t in = (size_t)(end - z.next_in);
        size_t out = (size_t)(room - z.next_out);
        z.avail_in = (uInt)(in < PIECE ? in : PIECE);
        z.avail_out = (uInt)(out < PIECE ? out : PIECE);
        host_call_trim(z.avail_in + z.avail_out);
        status = inflate(&z, Z_NO_FLUSH);
    }
    (void)inflateEnd(&z);
    return status == Z_STREAM_END && z.next_out == to + bytes;
}

/* --- pieces --------------------------------------------------------------- */

static bool fault(struct host_feed *feed, const char *path, const char *what) {
    host_fail(&feed->fault, HOST_INPUT, "%s: %s", path, what);
    return false;
}

/* Bytes of the file as they are there: 0 at its end, or at a fault. */
static size_t read_bytes(struct host_feed *feed, const char *path, uint8_t *to,
                         size_t room) {
    ssize_t n = 0;
    do {
        n = read(feed->file, to, room);
    } while (n < 0 && errno == EINTR);
    if (n < 0) {
        host_fail(&feed->fault, HOST_INPUT, "%s: cannot be read (%s); check %s",
                  path, strerror(errno),
                  feed->size > 0 ? "the disk" : "what writes to it");
    } else if (n == 0 && feed->taken < feed->size) {
        host_fail(&feed->fault, HOST_INPUT,
                  "%s: it has become shorter while it was read, %llu bytes "
                  "instead of %llu; let nothing write to it, and run again",
                  path, (unsigned long long)feed->taken,
                  (unsigned long long)feed->size);
    }
    feed->taken += n > 0 ? (uint64_t)n : 0;
    return n > 0 ? (size_t)n : 0;
}

/* Whether there are packed bytes left. */
static bool take_packed(struct host_feed *feed, const char *path) {
    if (feed->z.avail_in > 0 || feed->file < 0)
        return feed->z.avail_in > 0;
    feed->z.avail_in =
        (uInt)read_bytes(feed, path, feed->input, sizeof feed->input);
    feed->z.next_in = feed->input;
    return feed->z.avail_in > 0;
}

/* After a member: whether another one follows.  Else the file ends here,
 * perhaps after zeros with which a tape or a disk has filled it up. */
static bool begins_another(struct host_feed *feed, const char *path) {
    bool padded = false;
    while (take_packed(feed, path) && *feed->z.next_in == 0) {
        feed->z.next_in++;
        feed->z.avail_in--;
        padded = true;
    }
    feed->between = false;
    feed->ended = feed->z.avail_in == 0;
    return !feed->ended && (padded ? fault(feed, path, DAMAGED)
                                   : inflateReset(&feed->z) == Z_OK);
}

/* Unpacks at most `room` bytes.  0: the file has ended, or has a fault. */
static size_t unpack(struct host_feed *feed, const char *path, uint8_t *to,
                     size_t room) {
    feed->z.next_out = to;
    feed->z.avail_out = (uInt)room;
    while (!feed->ended && feed->fault.code == 0 && feed->z.avail_out == room) {
        if (feed->between && !begins_another(feed, path))
            break;
        if (!take_packed(feed, path)) {
            if (feed->fault.code == 0)
                (void)fault(feed, path,
                            "the packed data is cut short; get the file whole");
            break;
        }
        int status = inflate(&feed->z, Z_NO_FLUSH);
        feed->between = status == Z_STREAM_END;
        if (status != Z_OK && status != Z_BUF_ERROR && status != Z_STREAM_END)
            (void)fault(feed, path, DAMAGED);
    }
    return room - feed->z.avail_out;
}

/* Makes the window so large, if it can: else the feed has a fault. */
static void grow_window(const struct host_source *source, size_t wanted) {
    struct host_feed *feed = source->feed;
    void *window = host_remap(feed->window, feed->capacity, wanted);
    if (window == NULL) {
        host_fail_memory(&feed->fault, source->path);
    } else {
        feed->window = window;
        feed->capacity = wanted;
    }
}

/* Moves the bytes kept to the beginning of the window, and appends a piece. */
static bool move_window(const struct host_source *source, const uint8_t **at,
                        const uint8_t **end) {
    struct host_feed *feed = source->feed;
    size_t kept = (size_t)(*end - *at), got = 0;
    if (*at != feed->window)
        memmove(feed->window, *at, kept);
    size_t room = feed->capacity - kept;
    room = room < PIECE ? room : PIECE;
    if (feed->fault.code == 0) {
        got = (feed->packed ? unpack : read_bytes)(feed, source->path,
                                                   feed->window + kept, room);
    }
    host_call_trim(got);
    *at = feed->window;
    *end = feed->window + kept + got;
    return got > 0;
}

/* The same, with room for half of the window. */
static bool widen_window(const struct host_source *source, const uint8_t **at,
                         const uint8_t **end) {
    struct host_feed *feed = source->feed;
    size_t kept = (size_t)(*end - *at);
    if (kept > feed->capacity / 2 && feed->capacity < WINDOW_MAX) {
        size_t from = (size_t)(*at - feed->window);
        grow_window(source, 2 * feed->capacity);
        *at = feed->window + from;
        *end = *at + kept;
    }
    return move_window(source, at, end);
}

bool host_source_more(const struct host_source *source, const uint8_t **at,
                      const uint8_t **end) {
    if (source->feed == NULL)
        return false;
    if (*end - *at >= WINDOW_MAX) {
        return fault(source->feed, source->path,
                     "a line of more than 16 MB; give a file of this format");
    }
    return widen_window(source, at, end);
}

/* Bytes of the file that are not yet read, as far as they are known. */
static size_t known_rest(const struct host_feed *feed) {
    return feed->packed || feed->taken > feed->size
               ? 0
               : (size_t)(feed->size - feed->taken);
}

/* Makes room for the rest of the file where the `have` bytes fill the window.
 */
static int make_room(const struct host_source *source, size_t have,
                     struct host_error *error) {
    struct host_feed *feed = source->feed;
    size_t rest = known_rest(feed);
    if (feed->capacity > have + rest)
        return 0;
    unsigned share = feed->packed ? PACKED_SHARE : PLAIN_SHARE;
    size_t most = most_bytes(&feed->most, have + rest + 1, have, share);
    if (have + rest >= most && feed->packed) {
        return unpacks_too_large(source->path,
                                 feed->size > 0 ? feed->size : feed->taken,
                                 most, "a quarter", error);
    }
    if (have + rest >= most)
        return too_large(source->path, have + rest, most, error);
    size_t wanted = rest > 0 ? have + rest + 1 : 2 * feed->capacity;
    grow_window(source, wanted < most ? wanted : most);
    return host_source_fault(source, error);
}

/* Reads all of the rest behind the bytes kept. */
static int read_rest(const struct host_source *source, const uint8_t **at,
                     const uint8_t **end, bool shown,
                     struct host_error *error) {
    struct host_feed *feed = source->feed;
    bool more = feed != NULL;
    while (more) {
        size_t have = (size_t)(*end - *at);
        size_t from = (size_t)(*at - feed->window);
        if (source->bound > 0 && have + known_rest(feed) > source->bound)
            return too_long(source, error);
        if (make_room(source, have, error) != 0)
            return error->code;
        *at = feed->window + from;
        *end = *at + have;
        more = move_window(source, at, end);
        if (shown)
            host_progress_add((uint64_t)(*end - *at) - have);
    }
    return host_source_fault(source, error);
}

int host_source_all(const struct host_source *source, const uint8_t **at,
                    const uint8_t **end, struct host_error *error) {
    return read_rest(source, at, end, false, error);
}

int host_source_fault(const struct host_source *source,
                      struct host_error *error) {
    if (source->feed != NULL && source->feed->fault.code != 0)
        *error = source->feed->fault;
    return error->code;
}

/* The size, modulo 2^32, that the last member of a file claims to unpack to: at
 * least as many bytes are to be held. */
static int check_end(const struct host_source *source,
                     struct host_error *error) {
    struct host_feed *feed = source->feed;
    uint8_t end[4];
    if (!feed->packed || feed->size < sizeof end ||
        pread(feed->file, end, sizeof end, (off_t)(feed->size - sizeof end)) !=
            (ssize_t)sizeof end)
        return 0;
    size_t bytes = (size_t)end[0] | (size_t)end[1] << 8 | (size_t)end[2] << 16 |
                   (size_t)end[3] << 24;
    size_t most = most_bytes(&feed->most, bytes, 0, PACKED_SHARE);
    return bytes <= most ? 0
                         : unpacks_too_large(source->path, feed->size, most,
                                             "a quarter", error);
}

static void end_feed(struct host_source *source) {
    struct host_feed *feed = source->feed;
    if (feed == NULL)
        return;
    if (feed->packed)
        (void)inflateEnd(&feed->z);
    host_unmap(feed->window, feed->capacity);
    if (feed->file > 0)
        (void)close(feed->file);
    free(feed);
    source->feed = NULL;
}

int host_source_hold(struct host_source *source, struct host_error *error) {
    struct host_feed *feed = source->feed;
    const uint8_t *at = source->data, *end = source->data + source->bytes;
    if (feed != NULL && check_end(source, error) == 0 &&
        read_rest(source, &at, &end, true, error) == 0) {
        source->owned = feed->window; /* which begins there */
        source->capacity = feed->capacity;
        source->data = at;
        source->bytes = (size_t)(end - at);
        feed->window = NULL;
        end_feed(source);
    }
    if (error->code != 0)
        host_source_close(source);
    return error->code;
}

const char *host_source_find(const struct host_source *source,
                             const char *word) {
    const char *data = (const char *)source->data, *found = NULL;
    size_t n = strlen(word), bytes = source->bytes;
    for (size_t at = 0; found == NULL && at < bytes; at += PIECE) {
        size_t some = bytes - at < PIECE + n ? bytes - at : PIECE + n;
        found = memmem(data + at, some, word, n);
        host_call_trim(some);
    }
    return found;
}

/* --- opening -------------------------------------------------------------- */

/* What is known of the file that is read. */
static void look_at_file(struct host_feed *feed, int file) {
    struct stat status;
    feed->file = file;
    if (file >= 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode)) {
        off_t at = lseek(file, 0, SEEK_CUR);
        feed->size = (uint64_t)status.st_size;
        feed->taken = at > 0 ? (uint64_t)at : 0;
    }
}

/* Takes over the file, or the bytes, which are packed. */
static int begin_feed(struct host_source *source, int file, bool packed,
                      struct host_error *error) {
    struct host_feed *feed = calloc(1, sizeof *feed);
    if (feed == NULL || (feed->window = host_map(WINDOW)) == NULL ||
        (packed && inflateInit2(&feed->z, 15 + 16) != Z_OK)) {
        if (feed != NULL)
            host_unmap(feed->window, WINDOW);
        free(feed);
        if (file > 0)
            (void)close(file);
        return host_fail_memory(error, "a file");
    }
    feed->capacity = WINDOW;
    feed->packed = packed;
    feed->taken = source->bytes;
    look_at_file(feed, file);
    if (packed) {
        feed->z.next_in = (z_const Bytef *)source->data;
        feed->z.avail_in = (uInt)source->bytes;
    }
    source->feed = feed;
    const uint8_t *at = feed->window, *end = at;
    /* The first window is filled, as readers take headers from it. */
    for (bool more = !packed || take_packed(feed, source->path); more;)
        more = (size_t)(end - at) < WINDOW && move_window(source, &at, &end);
    source->data = at;
    source->bytes = (size_t)(end - at);
    return host_source_fault(source, error);
}

static int finish(struct host_source *source, struct host_error *error) {
    if (error->code == 0 && source->bytes == 0)
        host_source_fail(source, error, "the file is empty; give another");
    if (error->code != 0)
        host_source_close(source);
    return error->code;
}

static int open_source(struct host_source *source, const char *path,
                       bool packed, struct host_error *error) {
    struct stat status;
    bool standard = strcmp(path, "-") == 0;
    source->path = standard ? "stdin" : path;
    host_progress_phase("reading", "MB");
    int file = standard ? 0 : open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        return host_fail(error, HOST_INPUT,
                         "%s: cannot be opened (%s); check name and rights",
                         path, strerror(errno));
    }
    if (fstat(file, &status) == 0 && S_ISDIR(status.st_mode)) {
        if (!standard)
            (void)close(file);
        return host_source_fail(source, error,
                                "it is a directory; name a file in it");
    }
    if (begin_feed(source, file, packed, error) == 0 && !packed &&
        aside() == NULL)
        (void)host_source_hold(source, error);
    return finish(source, error);
}

int host_source_begin(struct host_source *source, const char *path, bool packed,
                      struct host_error *error) {
    *source = (struct host_source){.bound = 0};
    return open_source(source, path, packed, error);
}

int host_source_open(struct host_source *source, const char *path, bool packed,
                     struct host_error *error) {
    return host_source_begin(source, path, packed, error) == 0
               ? host_source_hold(source, error)
               : error->code;
}

int host_source_open_bounded(struct host_source *source, const char *path,
                             size_t most, const char *what,
                             struct host_error *error) {
    *source = (struct host_source){.bound = most, .what = what};
    return open_source(source, path, false, error) == 0
               ? host_source_hold(source, error)
               : error->code;
}

int host_source_wrap(struct host_source *source, const char *path,
                     const void *data, size_t bytes, struct host_error *error) {
    bool standard = strcmp(path, "-") == 0;
    *source = (struct host_source){
        .path = standard ? "stdin" : path, .data = data, .bytes = bytes};
    if (bytes > 0 && host_is_packed(path)) {
        if (bytes > UINT32_MAX) {
            return host_source_fail(source, error,
                                    "more than 4 GiB packed; unpack it first");
        }
        begin_feed(source, -1, true, error);
    }
    return finish(source, error);
}

void host_source_close(struct host_source *source) {
    end_feed(source);
    host_unmap(source->owned, source->capacity);
    source->owned = NULL;
    source->data = NULL;
    source->bytes = source->capacity = 0;
}
