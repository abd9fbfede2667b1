#include "cube_key.h"

#include <errno.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/base/create.h"
#include "transport/secure.h"
#include "transport/secure_wipe.h"

enum { TEXT_BYTES = 2 * SECURE_KEY_BYTES + 1 };

static bool draw_digits(char text[TEXT_BYTES]) {
    static const char digits[] = "0123456789abcdef";
    uint8_t key[SECURE_KEY_BYTES];
    if (getrandom(key, sizeof key, 0) != (ssize_t)sizeof key) {
        return false;
    }
    for (unsigned i = 0; i < SECURE_KEY_BYTES; i++) {
        text[2 * i] = digits[key[i] >> 4];
        text[2 * i + 1] = digits[key[i] & 15];
    }
    text[TEXT_BYTES - 1] = '\n';
    secure_wipe(key, sizeof key);
    return true;
}

static bool write_all(int fd, const char *text, size_t size) {
    while (size > 0) {
        ssize_t written = write(fd, text, size);
        if (written < 0 && errno != EINTR) {
            return false;
        }
        text += written > 0 ? written : 0;
        size -= written > 0 ? (size_t)written : 0;
    }
    return true;
}

/* False: errno says why. */
static bool fill(int fd, const char *text, size_t size, mode_t mode) {
    return fchmod(fd, mode) == 0 && write_all(fd, text, size) && fsync(fd) == 0;
}

int host_key_write(const char *path, const char *text, size_t size, mode_t mode,
                   struct host_error *error) {
    int fd = host_create(path, mode & 0600);
    if (fd < 0 && errno == EEXIST) {
        return host_fail(error, HOST_INPUT,
                         "%s: is there already, and may be a key in use; give "
                         "another name",
                         path);
    }
    bool good = fd >= 0 && fill(fd, text, size, mode);
    int reason = errno;
    if (fd >= 0 && close(fd) != 0 && good) {
        reason = errno;
        good = false;
    }
    if (good) {
        return 0;
    }
    if (fd >= 0) {
        (void)unlink(path);
    }
    return host_fail(error, HOST_INPUT,
                     "%s: %s; give a name where a file can be written", path,
                     strerror(reason));
}

int host_key_make(const char *path, struct host_error *error) {
    char text[TEXT_BYTES];
    int status =
        draw_digits(text)
            ? host_key_write(path, text, sizeof text, 0600, error)
            : host_fail(error, HOST_BROKEN,
                        "%s: %s; the kernel gives no random numbers, try again",
                        path, strerror(errno));
    secure_wipe(text, sizeof text);
    return status;
}
