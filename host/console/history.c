#include "history.h"

#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "host/base/create.h"
#include "host/base/progress.h"

#define NAME "history"

static int folder = -1; /* -1: there is none */

static void find_folder(void) {
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    struct host_error error = {0};
    char path[PATH_MAX];
    int n = -1;
    if (state != NULL && state[0] == '/') {
        n = snprintf(path, sizeof path, "%s/incode", state);
    } else if (home != NULL && home[0] == '/') {
        n = snprintf(path, sizeof path, "%s/.local/state/incode", home);
    }
    if (n > 0 && n < (int)sizeof path) {
        folder = host_folder_open_all(path, &error);
    }
    if (error.code != 0) {
        host_note("no history is kept: %s", error.text);
    }
}

/* The newest lines alone, in place of all, once there are too many. */
static void shorten(FILE *file, size_t lines) {
    char other[64], *line = NULL;
    size_t room = 0, at = 0;
    snprintf(other, sizeof other, NAME ".%ld", (long)getpid());
    int fd = host_folder_file(folder, other, O_WRONLY | O_CREAT | O_EXCL);
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
    if (fclose(out) != 0 || renameat(folder, other, folder, NAME) != 0) {
        (void)unlinkat(folder, other, 0);
    }
}

static void load(History *list) {
    HistEvent event;
    char *line = NULL;
    size_t room = 0, lines = 0;
    int fd = folder < 0 ? -1 : host_folder_file(folder, NAME, O_RDONLY);
    FILE *file = fd < 0 ? NULL : fdopen(fd, "r");
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

History *host_history_open(void) {
    HistEvent event;
    History *list = history_init();
    if (list == NULL) {
        return NULL;
    }
    (void)history(list, &event, H_SETSIZE, HOST_HISTORY_LINES);
    (void)history(list, &event, H_SETUNIQUE, 1);
    find_folder();
    load(list);
    return list;
}

void host_history_add(History *list, const char *line) {
    HistEvent event;
    bool same =
        history(list, &event, H_FIRST) == 0 && strcmp(event.str, line) == 0;
    if (same || line[strspn(line, " \t")] == '\0') {
        return;
    }
    (void)history(list, &event, H_ENTER, line);
    int fd = folder < 0 ? -1
                        : host_folder_file(folder, NAME,
                                           O_WRONLY | O_CREAT | O_APPEND);
    if (fd >= 0) {
        (void)dprintf(fd, "%s\n", line);
        (void)close(fd);
    }
}

void host_history_close(History *list) {
    history_end(list);
    if (folder >= 0) {
        (void)close(folder);
        folder = -1;
    }
}
