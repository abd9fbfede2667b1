#include "source.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "host/base/memory.h"
#include "host/base/progress.h"

bool host_is_packed(const char *path)
{
    size_t length = strlen(path), n = strlen(".gz");
    return length > n && strcasecmp(path + length - n, ".gz") == 0;
}

int host_source_fail(const struct host_source *source, struct host_error *error,
                     const char *what)
{
    return host_fail(error, HOST_INPUT, "%s: %s", source->path, what);
}

/* To how many bytes it may grow, now that it is to have so many: looked up
 * once, and not for what never matters. */
static size_t most_bytes(struct host_source *source, size_t bytes)
{
    const size_t always = (size_t)16 << 20;
    if (bytes <= always) {
        return always;
    }
    if (source->most == 0) {
        uint64_t half = host_memory_available() / 2 + source->capacity / 2;
        source->most = (size_t)(half > always ? half : always);
    }
    return source->most;
}

static int too_long(const struct host_source *source, struct host_error *error)
{
    return host_fail(error, HOST_INPUT,
                     "%s: more than %zu bytes, the most that %s has; give "
                     "another file",
                     source->path, source->bound, source->what);
}

static int too_large(const struct host_source *source, size_t bytes,
                     struct host_error *error)
{
    const double mb = 1e6;
    if (source->packed > 0) {
        return host_fail(error, HOST_INPUT,
                         "%s: %.1f MB that become more than %.1f MB unpacked, "
                         "half of the memory available; unpack it to see what "
                         "it holds, free some memory or take a machine with "
                         "more",
                         source->path, (double)source->packed / mb,
                         (double)source->most / mb);
    }
    return host_fail(error, HOST_INPUT,
                     "%s: %.1f MB or more, which is above half of the memory "
                     "available (%.1f MB); free some memory or take a machine "
                     "with more",
                     source->path, (double)bytes / mb,
                     (double)source->most / mb);
}

int host_source_unpacks(const struct host_source *source, uint64_t packed,
                        uint64_t bytes, struct host_error *error)
{
    struct host_source part = {.path = source->path, .packed = (size_t)packed};
    return bytes > most_bytes(&part, (size_t)bytes)
               ? too_large(&part, (size_t)bytes, error)
               : 0;
}

/* Room for `more` bytes, or for as many as it may have, if for any. */
static int reserve(struct host_source *source, size_t more,
                   struct host_error *error)
{
    if (source->capacity - source->bytes >= more) {
        return 0;
    }
    size_t wanted = 2 * source->capacity + more;
    size_t most = most_bytes(source, wanted);
    if (source->bytes >= most) {
        return too_large(source, source->bytes, error);
    }
    size_t capacity = wanted < most ? wanted : most;
    if (capacity == source->capacity) {
        return 0;
    }
    void *owned = host_remap(source->owned, source->capacity, capacity);
    if (owned == NULL) {
        return host_fail_memory(error, source->path);
    }
    source->owned = owned;
    source->data = owned;
    source->capacity = capacity;
    return 0;
}

static int read_all(struct host_source *source, int file,
                    struct host_error *error)
{
    struct stat status;
    size_t hint = (size_t)1 << 20;
    if (fstat(file, &status) == 0) {
        if (S_ISDIR(status.st_mode)) {
            return host_source_fail(source, error,
                                    "it is a directory; name a file in it");
        }
        if (S_ISREG(status.st_mode) && status.st_size > 0) {
            hint = (size_t)status.st_size + 1;
            if (source->bound > 0 && hint - 1 > source->bound) {
                return too_long(source, error);
            }
            if (hint > most_bytes(source, hint)) {
                return too_large(source, hint - 1, error);
            }
        }
    }
    for (;;) {
        if (reserve(source, hint, error) != 0) {
            return error->code;
        }
        ssize_t n = read(file, (char *)source->owned + source->bytes,
                         source->capacity - source->bytes);
        if (n < 0 && errno == EINTR) {
            continue;
        }
        if (n < 0) {
            return host_fail(error, HOST_INPUT,
                             "%s: cannot be read (%s); check the disk",
                             source->path, strerror(errno));
        }
        if (n == 0) {
            return 0;
        }
        source->bytes += (size_t)n;
        if (source->bound > 0 && source->bytes > source->bound) {
            return too_long(source, error);
        }
        host_progress_add((uint64_t)n);
        hint = (size_t)1 << 16;
    }
}

static bool all_zero(const uint8_t *bytes, size_t n)
{
    while (n > 0 && bytes[n - 1] == 0) {
        n--;
    }
    return n == 0;
}

static int inflate_members(struct host_source *out, z_stream *z,
                           struct host_error *error)
{
    for (;;) {
        if (reserve(out, (size_t)1 << 16, error) != 0) {
            return error->code;
        }
        size_t room = out->capacity - out->bytes;
        room = room > (size_t)1 << 30 ? (size_t)1 << 30 : room;
        z->next_out = (uint8_t *)out->owned + out->bytes;
        z->avail_out = (uInt)room;
        int status = inflate(z, Z_NO_FLUSH);
        out->bytes += room - z->avail_out;
        if (status == Z_STREAM_END) {
            if (all_zero(z->next_in, z->avail_in)) {
                return 0; /* padding of a tape or a disk, if any */
            }
            status = inflateReset(z); /* another member follows */
        }
        if (status == Z_BUF_ERROR && z->avail_in == 0) {
            return host_source_fail(out, error,
                                    "the packed data is cut short; get the "
                                    "file whole");
        }
        if (status != Z_OK && status != Z_BUF_ERROR) {
            return host_source_fail(out, error,
                                    "the packed data is damaged; test it with "
                                    "gzip -t and get it again");
        }
    }
}

/* Replaces packed bytes by what they hold. */
static int unpack(struct host_source *source, struct host_error *error)
{
    struct host_source out = {.path = source->path, .packed = source->bytes};
    z_stream z;
    memset(&z, 0, sizeof z);
    if (source->bytes > UINT32_MAX) {
        return host_source_fail(source, error,
                                "more than 4 GiB packed; unpack it first");
    }
    z.next_in = (z_const Bytef *)source->data;
    z.avail_in = (uInt)source->bytes;
    if (inflateInit2(&z, 15 + 16) != Z_OK) {
        return host_fail_memory(error, "unpacking");
    }
    int code = inflate_members(&out, &z, error);
    (void)inflateEnd(&z);
    host_source_close(source);
    *source = out;
    return code;
}

static int finish(struct host_source *source, bool packed,
                  struct host_error *error)
{
    if (error->code == 0 && source->bytes > 0 && packed) {
        unpack(source, error);
    }
    if (error->code == 0 && source->bytes == 0) {
        host_source_fail(source, error, "the file is empty; give another");
    }
    if (error->code != 0) {
        host_source_close(source);
    }
    return error->code;
}

static int open_source(struct host_source *source, const char *path,
                       bool packed, struct host_error *error)
{
    bool standard = strcmp(path, "-") == 0;
    source->path = standard ? "stdin" : path;
    host_progress_phase("reading", "MB");
    int file = standard ? 0 : open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        return host_fail(error, HOST_INPUT,
                         "%s: cannot be opened (%s); check name and rights",
                         path, strerror(errno));
    }
    read_all(source, file, error);
    if (!standard) {
        (void)close(file);
    }
    return finish(source, packed, error);
}

int host_source_open(struct host_source *source, const char *path, bool packed,
                     struct host_error *error)
{
    *source = (struct host_source){.bound = 0};
    return open_source(source, path, packed, error);
}

int host_source_open_bounded(struct host_source *source, const char *path,
                             size_t most, const char *what,
                             struct host_error *error)
{
    *source = (struct host_source){.bound = most, .what = what};
    return open_source(source, path, false, error);
}

int host_source_wrap(struct host_source *source, const char *path,
                     const void *data, size_t bytes, struct host_error *error)
{
    bool standard = strcmp(path, "-") == 0;
    *source = (struct host_source){
        .path = standard ? "stdin" : path, .data = data, .bytes = bytes};
    return finish(source, host_is_packed(path), error);
}

void host_source_close(struct host_source *source)
{
    host_unmap(source->owned, source->capacity);
    source->owned = NULL;
    source->data = NULL;
    source->bytes = source->capacity = 0;
}
