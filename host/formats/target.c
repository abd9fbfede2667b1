#include "target.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool host_is_file(const struct stat *file, const char *name) {
    struct stat named;
    return lstat(name, &named) == 0 && named.st_dev == file->st_dev &&
           named.st_ino == file->st_ino;
}

/* The name without links of what the kernel has opened as `path`. */
static char *name_of(int opened, const char *path) {
    struct stat status;
    char *name = realpath(path, NULL); /* by hand: believed where it agrees */
    if (name != NULL &&
        (fstat(opened, &status) != 0 || !host_is_file(&status, name))) {
        free(name);
        errno = EAGAIN; /* the links have changed meanwhile */
        return NULL;
    }
    return name;
}

/* Of a link to where nothing is.  A file without any rights is nobody else's:
 * it was made here. */
static char *name_of_nothing(const char *path) {
    struct stat made;
    int file = open(path, O_WRONLY | O_CREAT | O_NONBLOCK | O_CLOEXEC, 0);
    if (file < 0) {
        return NULL;
    }
    char *name = name_of(file, path);
    int reason = errno;
    if (name != NULL && fstat(file, &made) == 0 && S_ISREG(made.st_mode) &&
        (made.st_mode & 0777) == 0 && made.st_size == 0) {
        (void)unlink(name);
    }
    (void)close(file);
    errno = reason;
    return name;
}

char *host_target(const char *path) {
    struct stat status;
    int file = open(path, O_PATH | O_CLOEXEC);
    if (file < 0 && errno == ENOENT) {
        return lstat(path, &status) == 0 ? name_of_nothing(path)
                                         : strdup(path); /* not there yet */
    }
    if (file < 0) {
        return NULL;
    }
    char *name = name_of(file, path);
    int reason = errno;
    (void)close(file);
    errno = reason;
    return name;
}
