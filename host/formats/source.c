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

enum {
    ALWAYS = 16 << 20,     /* bytes that a file may always take */
    PLAIN_SHARE = 2,       /* of the available memory for a plain file, */
    PACKED_SHARE = 4,      /* and for a packed one, held whole */
    WINDOW = 1 << 20,      /* of a file that is unpacked piece by piece */
    WINDOW_MAX = 16 << 20, /* the same, with long lines */
    READ_MAX = 1 << 18,    /* bytes at a time */
    PACKED_BYTES = 1 << 16
};

#define DAMAGED                                                                \
    "the packed data is damaged; test it with gzip -t and get it again"

/* The state of unpacking a file. */
struct host_feed {
    int file;       /* -1: z has all packed bytes */
    uint64_t size;  /* packed; 0: not known */
    uint64_t taken; /* packed bytes read so far */
    size_t most;    /* unpacked bytes that may be held; 0: not yet known */
    z_stream z;
    bool between, ended; /* after a member, after the last */
    struct host_error fault;
    uint8_t *window;
    size_t capacity;
    uint8_t packed[PACKED_BYTES];
};

bool host_is_packed(const char *path) {
    size_t length = strlen(path), n = strlen(".gz");
    return length > n && strcasecmp(path + length - n, ".gz") == 0;
}

int host_source_fail(const struct host_source *source, struct host_error *error,
                     const char *what) {
    return host_fail(error, HOST_INPUT, "%s: %s", source->path, what);
}

/* How many bytes a file may take that needs `bytes` now.  The available memory
 * is looked up once, and only for a large file; share: the part of it. */
static size_t most_bytes(size_t *most, size_t bytes, size_t held,
                         unsigned share) {
    if (bytes <= ALWAYS)
        return ALWAYS;
    if (*most == 0) {
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

static int too_large(const char *path, size_t bytes, size_t most,
                     struct host_error *error) {
    const double mb = 1e6;
    return host_fail(error, HOST_INPUT,
                     "%s: %.1f MB or more, which is above half of the memory "
                     "available (%.1f MB); free some memory or take a machine "
                     "with more",
                     path, (double)bytes / mb, (double)most / mb);
}

static int unpacks_too_large(const char *path, uint64_t packed, size_t most,
                             const char *share, struct host_error *error) {
    const double mb = 1e6;
    return host_fail(error, HOST_INPUT,
                     "%s: %.1f MB that become more than %.1f MB unpacked, %s "
                     "of the memory available; unpack it to see what it holds, "
                     "free some memory or take a machine with more",
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

/* Room for `more` bytes, or for as many as it may have, if for any. */
static int reserve(struct host_source *source, size_t more,
                   struct host_error *error) {
    if (source->capacity - source->bytes >= more)
        return 0;
    size_t wanted = 2 * source->capacity + more;
    size_t most =
        most_bytes(&source->most, wanted, source->capacity, PLAIN_SHARE);
    if (source->bytes >= most)
        return too_large(source->path, source->bytes, most, error);
    size_t capacity = wanted < most ? wanted : most;
    if (capacity == source->capacity)
        return 0;
    void *owned = host_remap(source->owned, source->capacity, capacity);
    if (owned == NULL)
        return host_fail_memory(error, source->path);
    source->owned = owned;
    source->data = owned;
    source->capacity = capacity;
    return 0;
}

static int read_all(struct host_source *source, int file,
                    struct host_error *error) {
    struct stat status;
    size_t hint = (size_t)1 << 20;
    if (fstat(file, &status) == 0) {
        if (S_ISDIR(status.st_mode)) {
            return host_source_fail(source, error,
                                    "it is a directory; name a file in it");
        }
        if (S_ISREG(status.st_mode) && status.st_size > 0) {
            hint = (size_t)status.st_size + 1;
            if (source->bound > 0 && hint - 1 > source->bound)
                return too_long(source, error);
            size_t most = most_bytes(&source->most, hint, 0, PLAIN_SHARE);
            if (hint > most)
                return too_large(source->path, hint - 1, most, error);
        }
    }
    for (;;) {
        if (reserve(source, hint, error) != 0)
            return error->code;
        size_t room = source->capacity - source->bytes;
        ssize_t n = read(file, (char *)source->owned + source->bytes,
                         room < READ_MAX ? room : READ_MAX);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0) {
            return host_fail(error, HOST_INPUT,
                             "%s: cannot be read (%s); check the disk",
                             source->path, strerror(errno));
        }
        if (n == 0)
            return 0;
        source->bytes += (size_t)n;
        host_call_trim((size_t)n);
        if (source->bound > 0 && source->bytes > source->bound)
            return too_long(source, error);
        host_progress_add((uint64_t)n);
        hint = (size_t)1 << 16;
    }
}

/* --- unpacking ------------------------------------------------------------ */

static bool fault(struct host_feed *feed, const char *path, const char *what) {
    host_fail(&feed->fault, HOST_INPUT, "%s: %s", path, what);
    return false;
}

/* Whether there are packed bytes left. */
static bool take_packed(struct host_feed *feed, const char *path) {
    ssize_t n = 0;
    if (feed->z.avail_in > 0 || feed->file < 0)
        return feed->z.avail_in > 0;
    do {
        n = read(feed->file, feed->packed, sizeof feed->packed);
    } while (n < 0 && errno == EINTR);
    if (n < 0) {
        host_fail(&feed->fault, HOST_INPUT,
                  "%s: cannot be read (%s); check the disk", path,
                  strerror(errno));
        return false;
    }
    feed->taken += (uint64_t)n;
    feed->z.next_in = feed->packed;
    feed->z.avail_in = (uInt)n;
    return n > 0;
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
    room = room > (size_t)1 << 30 ? (size_t)1 << 30 : room;
    feed->z.next_out = to;
    feed->z.avail_out = (uInt)room;
    while (!feed->ended && feed->fault.code == 0 && feed->z.avail_out == room) {
        if (feed->between && !begins_another(feed, path))
            break;
        if (!take_packed(feed, path)) {
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

/* Appends unpacked bytes to those kept, in a window of at most `most` bytes. */
static bool move_window(const struct host_source *source, const uint8_t **at,
                        const uint8_t **end, size_t most) {
    struct host_feed *feed = source->feed;
    size_t kept = (size_t)(*end - *at);
    memmove(feed->window, *at, kept);
    if (feed->capacity - kept < feed->capacity / 2 && feed->capacity < most) {
        size_t wanted = 2 * feed->capacity < most ? 2 * feed->capacity : most;
        void *window = host_remap(feed->window, feed->capacity, wanted);
        if (window == NULL) {
            host_fail_memory(&feed->fault, source->path);
        } else {
            feed->window = window;
            feed->capacity = wanted;
        }
    }
    size_t got =
        unpack(feed, source->path, feed->window + kept, feed->capacity - kept);
    *at = feed->window;
    *end = feed->window + kept + got;
    return got > 0;
}

bool host_source_more(const struct host_source *source, const uint8_t **at,
                      const uint8_t **end) {
    if (source->feed == NULL)
        return false;
    if (*end - *at >= WINDOW_MAX) {
        return fault(source->feed, source->path,
                     "a line of more than 16 MB; give a file of this format");
    }
    return move_window(source, at, end, WINDOW_MAX);
}

int host_source_all(const struct host_source *source, const uint8_t **at,
                    const uint8_t **end, struct host_error *error) {
    struct host_feed *feed = source->feed;
    bool more = feed != NULL;
    while (more) {
        size_t have = (size_t)(*end - *at);
        size_t most = most_bytes(&feed->most, have + 1, have, PACKED_SHARE);
        if (have >= most) {
            return unpacks_too_large(source->path,
                                     feed->size > 0 ? feed->size : feed->taken,
                                     most, "a quarter", error);
        }
        more = move_window(source, at, end, most);
    }
    return host_source_fault(source, error);
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
    if (feed->size < sizeof end ||
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

int host_source_hold(struct host_source *source, struct host_error *error) {
    const uint8_t *at = source->data, *end = source->data + source->bytes;
    if (source->feed != NULL && check_end(source, error) == 0 &&
        host_source_all(source, &at, &end, error) == 0) {
        source->data = at;
        source->bytes = (size_t)(end - at);
    }
    if (error->code != 0)
        host_source_close(source);
    return error->code;
}

/* --- opening -------------------------------------------------------------- */

/* Takes over the file, or the bytes. */
static int begin_unpacking(struct host_source *source, int file,
                           struct host_error *error) {
    struct stat status;
    struct host_feed *feed = calloc(1, sizeof *feed);
    if (feed == NULL || (feed->window = host_map(WINDOW)) == NULL ||
        inflateInit2(&feed->z, 15 + 16) != Z_OK) {
        if (feed != NULL)
            host_unmap(feed->window, WINDOW);
        free(feed);
        if (file > 0)
            (void)close(file);
        return host_fail_memory(error, "unpacking");
    }
    feed->capacity = WINDOW;
    feed->file = file;
    feed->z.next_in = (z_const Bytef *)source->data;
    feed->z.avail_in = (uInt)source->bytes;
    feed->taken = source->bytes;
    if (file >= 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode))
        feed->size = (uint64_t)status.st_size;
    source->feed = feed;
    const uint8_t *at = feed->window, *end = at;
    /* The first window is filled, as readers take headers from it. */
    for (bool more = take_packed(feed, source->path); more;) {
        more = (size_t)(end - at) < WINDOW &&
               move_window(source, &at, &end, WINDOW);
    }
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
    bool standard = strcmp(path, "-") == 0;
    source->path = standard ? "stdin" : path;
    host_progress_phase("reading", "MB");
    int file = standard ? 0 : open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        return host_fail(error, HOST_INPUT,
                         "%s: cannot be opened (%s); check name and rights",
                         path, strerror(errno));
    }
    if (packed) {
        begin_unpacking(source, file, error);
    } else {
        read_all(source, file, error);
        if (!standard)
            (void)close(file);
    }
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
    return open_source(source, path, false, error);
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
        begin_unpacking(source, -1, error);
    }
    return finish(source, error);
}

void host_source_close(struct host_source *source) {
    struct host_feed *feed = source->feed;
    if (feed != NULL) {
        (void)inflateEnd(&feed->z);
        host_unmap(feed->window, feed->capacity);
        if (feed->file > 0)
            (void)close(feed->file);
        free(feed);
    }
    host_unmap(source->owned, source->capacity);
    source->feed = NULL;
    source->owned = NULL;
    source->data = NULL;
    source->bytes = source->capacity = 0;
}
