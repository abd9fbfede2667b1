#include "key_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { DIGITS = 2 * SECURE_KEY_BYTES };

/* As many as there are, up to size; -1 and errno. */
static ssize_t read_all(int fd, char *text, size_t size)
{
    size_t have = 0;
    ssize_t got = 1;
    while (have < size && got > 0) {
        got = read(fd, text + have, size - have);
        have += got > 0 ? (size_t)got : 0;
    }
    return got < 0 ? -1 : (ssize_t)have;
}

static bool read_digits(const char text[DIGITS], uint8_t *key)
{
    static const char digits[] = "0123456789abcdef";
    for (unsigned i = 0; i < DIGITS; i++) {
        const char *at = memchr(digits, text[i], sizeof digits - 1);
        if (at == NULL) {
            return false;
        }
        key[i / 2] = (uint8_t)(key[i / 2] << 4 | (at - digits));
    }
    return true;
}

enum key_file_state key_file_read(const char *path, uint8_t *key)
{
    char text[DIGITS];
    struct stat about;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    ssize_t got =
        fd < 0 || fstat(fd, &about) != 0 ? -1 : read_all(fd, text, sizeof text);
    int reason = errno;
    if (fd >= 0) {
        close(fd);
    }
    errno = reason;
    if (got < 0) {
        return KEY_FILE_UNREADABLE;
    }
    if ((about.st_mode & S_IWOTH) != 0) {
        return KEY_FILE_WRITABLE;
    }
    if (got < DIGITS || !read_digits(text, key)) {
        return KEY_FILE_NO_KEY;
    }
    return (about.st_mode & (S_IRGRP | S_IROTH)) != 0 ? KEY_FILE_SEEN
                                                      : KEY_FILE_GOOD;
}

struct key_file_text key_file_text(enum key_file_state state)
{
    static const struct key_file_text texts[] = {
        [KEY_FILE_SEEN] = {"can be read by others, who can join the cube then",
                           "chmod 600 it"},
        [KEY_FILE_WRITABLE] = {"can be written by others",
                               "chmod 600 it, and see that it is still yours"},
        [KEY_FILE_UNREADABLE] = {"cannot be read",
                                 "give the key's file, or make one with: "
                                 "incode key FILE"},
        [KEY_FILE_NO_KEY] = {"not a file of 64 hexadecimal digits",
                             "make one with: incode key FILE"}};
    return texts[state];
}
