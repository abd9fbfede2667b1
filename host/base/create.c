#include "create.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SAFE = O_NOFOLLOW | O_CLOEXEC, PRIVATE = 0700, OTHERS = 0077 };

int host_create(const char *path, mode_t mode) {
    return open(path, O_WRONLY | O_CREAT | O_EXCL | SAFE, mode);
}

FILE *host_create_over(const char *path) {
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | SAFE, 0666);
    FILE *file = fd < 0 ? NULL : fdopen(fd, "w");
    if (fd >= 0 && file == NULL)
        (void)close(fd);
    return file;
}

/* Why not to use the folder; NULL: it is this user's alone. */
static const char *fault_of(int folder) {
    struct stat about;
    if (fstat(folder, &about) != 0)
        return "cannot be examined; give another place";
    return about.st_uid != geteuid()
               ? "belongs to another user; remove it, or give another place"
           : (about.st_mode & OTHERS) != 0
               ? "can be entered by other users; chmod 700 it, if what is in "
                 "it is yours, or give another place"
               : NULL;
}

int host_folder_open(const char *path, struct host_error *error) {
    const int flags = O_RDONLY | O_DIRECTORY | SAFE;
    int folder =
        mkdir(path, PRIVATE) != 0 && errno != EEXIST ? -1 : open(path, flags);
    if (folder < 0) {
        host_fail(error, HOST_INPUT, "%s: %s; give another place", path,
                  errno == ENOTDIR ? "is a link, or no folder"
                                   : strerror(errno));
        return -1;
    }
    const char *fault = fault_of(folder);
    if (fault != NULL) {
        host_fail(error, HOST_INPUT, "%s: %s", path, fault);
        (void)close(folder);
        return -1;
    }
    return folder;
}

int host_folder_open_all(const char *path, struct host_error *error) {
    char above[PATH_MAX];
    size_t length = strlen(path);
    if (length >= sizeof above) {
        host_fail(error, HOST_INPUT, "%s: too long; give a shorter name", path);
        return -1;
    }
    memcpy(above, path, length + 1);
    for (char *p = above + 1; (p = strchr(p, '/')) != NULL; p++) {
        *p = '\0';
        (void)mkdir(above, PRIVATE); /* a failure shows at the last folder */
        *p = '/';
    }
    return host_folder_open(path, error);
}

static bool is_own_file(int fd) {
    struct stat about;
    return fstat(fd, &about) == 0 && S_ISREG(about.st_mode) &&
           about.st_uid == geteuid() && about.st_nlink == 1;
}

int host_folder_file(int folder, const char *name, int flags) {
    /* Opening a pipe must not wait for a program at its other end. */
    int fd = openat(folder, name, flags | SAFE | O_NONBLOCK, 0600);
    if (fd >= 0 && !is_own_file(fd)) {
        (void)close(fd);
        errno = EPERM;
        return -1;
    }
    return fd;
}
