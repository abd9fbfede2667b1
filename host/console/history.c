#include "history.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH = 4096, PRIVATE = 0700, OWN = 0600 };

static char path[PATH]; /* "": there is none */

/* The folders of a path, as far as they are missing. */
static bool make_folders(char *whole)
{
    for (char *p = strchr(whole + 1, '/'); p != NULL; p = strchr(p + 1, '/')) {
        *p = '\0';
        int made = mkdir(whole, PRIVATE);
        *p = '/';
        if (made != 0 && errno != EEXIST) {
            return false;
        }
    }
    return true;
}

static void find_path(void)
{
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    int n = -1;
    path[0] = '\0';
    if (state != NULL && state[0] == '/') {
        n = snprintf(path, sizeof path, "%s/incode/history", state);
    } else if (home != NULL && home[0] == '/') {
        n = snprintf(path, sizeof path, "%s/.local/state/incode/history", home);
    }
    if (n < 0 || n >= (int)sizeof path || !make_folders(path)) {
        path[0] = '\0';
    }
}

/* The newest lines alone, in place of all, once there are too many. */
static void shorten(FILE *file, size_t lines)
{
    char other[PATH + 16], *line = NULL;
    size_t room = 0, at = 0;
    snprintf(other, sizeof other, "%s.%ld", path, (long)getpid());
    int fd = open(other, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, OWN);
    FILE *out = fd < 0 ? NULL : fdopen(fd, "w");
    if (out == NULL) {
        return;
    }
    rewind(file);
    while (getline(&line, &room, file) > 0) {
        if (at++ + HOST_HISTORY_LINES >= lines) {
            (void)fputs(line, out);
        }
    }
    free(line);
    if (fclose(out) != 0 || rename(other, path) != 0) {
        (void)unlink(other);
    }
}

static void load(History *list)
{
    HistEvent event;
    char *line = NULL;
    size_t room = 0, lines = 0;
    FILE *file = path[0] == '\0' ? NULL : fopen(path, "re");
    if (file == NULL) {
        return;
    }
    for (ssize_t n; (n = getline(&line, &room, file)) > 0; lines++) {
        line[n - 1] = line[n - 1] == '\n' ? '\0' : line[n - 1];
        (void)history(list, &event, H_ENTER, line);
    }
    free(line);
    if (lines > 2 * HOST_HISTORY_LINES) {
        shorten(file, lines);
    }
    (void)fclose(file);
}

History *host_history_open(void)
{
    HistEvent event;
    History *list = history_init();
    if (list == NULL) {
        return NULL;
    }
    (void)history(list, &event, H_SETSIZE, HOST_HISTORY_LINES);
    (void)history(list, &event, H_SETUNIQUE, 1);
    find_path();
    load(list);
    return list;
}

void host_history_add(History *list, const char *line)
{
    HistEvent event;
    bool same =
        history(list, &event, H_FIRST) == 0 && strcmp(event.str, line) == 0;
    if (same || line[strspn(line, " \t")] == '\0') {
        return;
    }
    (void)history(list, &event, H_ENTER, line);
    int fd = path[0] == '\0'
                 ? -1
                 : open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, OWN);
    if (fd >= 0) {
        (void)dprintf(fd, "%s\n", line);
        (void)close(fd);
    }
}

void host_history_close(History *list)
{
    history_end(list);
}
