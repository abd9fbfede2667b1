#include "cube_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cube_reader.h"
#include "host/base/parse.h"
#include "host/base/progress.h"
#include "transport/drivers/key_file.h"
#include "transport/secure_wipe.h"

enum { TEXT_MAX = 4 << 20 }; /* that of 1,024 nodes has half a MiB */

static int read_key(struct host_cube_file *file, const config_setting_t *where,
                    struct host_error *error) {
    char message[HOST_NODE_OPTION_BYTES + 200];
    if (config_setting_get_string(where) == NULL) {
        return host_cube_wrong(file, where, error,
                               "key: not a file's name; write it in "
                               "quotes");
    }
    if (host_cube_beside(file, where, file->key_path, sizeof file->key_path) !=
        0) {
        return host_cube_wrong(file, where, error,
                               "key: none, or too long a path; make one with: "
                               "incode key FILE");
    }
    enum key_file_state state = key_file_read(file->key_path, file->key);
    int reason = state == KEY_FILE_UNREADABLE ? errno : 0;
    struct key_file_text fault = key_file_text(state);
    file->has_key = state == KEY_FILE_GOOD || state == KEY_FILE_SEEN;
    if (fault.what == NULL) {
        return 0;
    }
    snprintf(message, sizeof message, "key %s: %s%s%s; %s", file->key_path,
             fault.what, reason == 0 ? "" : ": ",
             reason == 0 ? "" : strerror(reason), fault.next);
    if (!file->has_key) {
        return host_cube_wrong(file, where, error, message);
    }
    host_note("%s:%u: %s", file->path, config_setting_source_line(where),
              message);
    return 0;
}

/* The nodes that the host starts. */
static int read_start(struct host_cube_file *file, const config_setting_t *root,
                      struct host_error *error) {
    const config_setting_t *start = config_setting_get_member(root, "start");
    bool many = start != NULL && (config_setting_is_array(start) ||
                                  config_setting_is_list(start));
    bool good = start == NULL || many;
    for (int i = 0; good && many && i < config_setting_length(start); i++) {
        int node = 0;
        good = host_cube_is_number(config_setting_get_elem(start, (unsigned)i),
                                   0, (int)file->nodes - 1, &node);
        if (good && file->local[node]) {
            return host_cube_wrong(file, start, error,
                                   "start: a node twice; name each once");
        }
        file->local[node] |= good;
    }
    return good ? 0
                : host_cube_wrong(
                      file, start, error,
                      "start: not numbers of nodes; write [0, 1, 2]");
}

static int read_memory(struct host_cube_file *file,
                       const config_setting_t *root, struct host_error *error) {
    const config_setting_t *memory = config_setting_get_member(root, "memory");
    const char *text =
        memory == NULL ? "4M" : config_setting_get_string(memory);
    return text != NULL && host_parse_bytes(text, &file->memory) == 0 &&
                   file->memory >= 256 * 1024 &&
                   file->memory <= UINT64_C(1) << 30
               ? 0
               : host_cube_wrong(
                     file, memory, error,
                     "memory: not a size; write \"4M\", from 640K to "
                     "1G, or less to a small cube");
}

static int read_nodes(struct host_cube_file *file, const config_setting_t *root,
                      struct host_error *error) {
    const config_setting_t *key = config_setting_get_member(root, "key");
    int dimension = -1, window = 0, dead = 30;
    if (!host_cube_take_number(root, "dimension", 0, CUBE_DIMENSION_MAX,
                               &dimension) ||
        dimension < 0) {
        return host_cube_wrong(
            file, config_setting_get_member(root, "dimension"), error,
            "dimension: not given or not 0 to 10; a cube of 8 nodes "
            "has dimension = 3;");
    }
    if (!host_cube_take_number(root, "window", 1, LINK_WINDOW_MAX, &window)) {
        return host_cube_wrong(file, config_setting_get_member(root, "window"),
                               error,
                               "window: not a number of frames; give 1 to 64");
    }
    if (!host_cube_take_number(root, "dead", 0, 3600, &dead)) {
        return host_cube_wrong(
            file, config_setting_get_member(root, "dead"), error,
            "dead: not seconds of silence; give 0 (never) to "
            "3600");
    }
    file->dimension = (unsigned)dimension;
    file->nodes = 1u << dimension;
    file->window = (unsigned)window;
    file->dead_s = (unsigned)dead;
    if (read_memory(file, root, error) != 0 ||
        host_cube_read_boards(file, root, error) != 0 ||
        read_start(file, root, error) != 0) {
        return error->code;
    }
    return key == NULL ? 0 : read_key(file, key, error);
}

static int read_settings(struct host_cube_file *file, const config_t *config,
                         struct host_error *error) {
    static const char *const names[] = {
        "dimension", "board", "memory", "window", "key",
        "start",     "dead",  "links",  "nodes",  NULL};
    const config_setting_t *root = config_root_setting(config);
    const config_setting_t *links = config_setting_get_member(root, "links");
    if (host_cube_check_names(file, root, names, error) != 0 ||
        read_nodes(file, root, error) != 0) {
        return error->code;
    }
    if (links == NULL || !config_setting_is_list(links)) {
        return host_cube_wrong(
            file, links, error,
            "links: no list; write links = ( { node = 0; to = "
            "\"host\"; .. }, .. );");
    }
    unsigned count = (unsigned)config_setting_length(links);
    if (count > file->nodes * (file->dimension + 2) + 8) {
        return host_cube_wrong(file, links, error,
                               "links: many more than the cube has; name each "
                               "once");
    }
    file->wire = calloc(count + 1, sizeof *file->wire);
    if (file->wire == NULL) {
        return host_fail_memory(error, "the cube file");
    }
    for (unsigned i = 0; i < count; i++) {
        config_setting_t *group = config_setting_get_elem(links, i);
        if (!config_setting_is_group(group)) {
            return host_cube_wrong(file, links, error,
                                   "links: not a list of groups in braces; "
                                   "write links = ( { node = 0; to = "
                                   "\"host\"; .. }, .. );");
        }
        if (host_cube_read_wire(file, group, error) != 0) {
            return error->code;
        }
    }
    return host_cube_check_wires(file, links, error) != 0 ||
                   host_cube_check_boards(file, root, error) != 0 ||
                   host_cube_check_ssh(file, error) != 0
               ? error->code
               : host_cube_check_ends(file, error);
}

/* Read here, as libconfig ends the program where it cannot.  The name may be
 * that of a pipe, which would be waited for. */
static int open_text(const char *path, struct host_error *error) {
    struct stat about;
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (fd < 0 || fstat(fd, &about) != 0) {
        host_fail(error, HOST_INPUT, "%s: %s; check name and rights", path,
                  strerror(errno));
    } else if (!S_ISREG(about.st_mode)) {
        host_fail(error, HOST_INPUT, "%s: %s; give the cube's file", path,
                  S_ISDIR(about.st_mode) ? "a directory" : "a pipe or device");
    } else {
        return fd;
    }
    if (fd >= 0) {
        close(fd);
    }
    return -1;
}

/* NULL: as the error says. */
static char *read_text(const char *path, struct host_error *error) {
    int fd = open_text(path, error);
    char *text = fd < 0 ? NULL : malloc(TEXT_MAX + 1);
    size_t size = 0;
    ssize_t got = text == NULL ? 0 : 1;
    while (got > 0 && size <= TEXT_MAX) {
        got = read(fd, text + size, TEXT_MAX + 1 - size);
        size += got > 0 ? (size_t)got : 0;
    }
    if (fd < 0) {
        return NULL;
    }
    if (text == NULL) {
        host_fail_memory(error, "the cube file");
    } else if (got < 0) {
        host_fail(error, HOST_INPUT, "%s: %s; check name and rights", path,
                  strerror(errno));
    } else if (size > TEXT_MAX || memchr(text, '\0', size) != NULL) {
        host_fail(error, HOST_INPUT,
                  "%s: not a text of at most %d MiB; give the cube's file",
                  path, TEXT_MAX >> 20);
    } else {
        text[size] = '\0';
    }
    close(fd);
    if (error->code != 0) {
        free(text);
        text = NULL;
    }
    return text;
}

int host_cube_file_parse(struct host_cube_file *file, const char *path,
                         const char *text, struct host_error *error) {
    config_t config;
    int status;
    memset(file, 0, sizeof *file);
    file->path = path;
    if (host_cube_scan(path, text, error) != 0) {
        return error->code;
    }
    config_init(&config);
    if (config_read_string(&config, text) == CONFIG_TRUE) {
        status = read_settings(file, &config, error);
    } else {
        status =
            host_fail(error, HOST_INPUT,
                      "%s:%d: %s; correct it as in boards/linux/examples", path,
                      config_error_line(&config), config_error_text(&config));
    }
    config_destroy(&config);
    if (status != 0) {
        host_cube_file_free(file);
    }
    return status;
}

int host_cube_file_read(struct host_cube_file *file, const char *path,
                        struct host_error *error) {
    char *text = read_text(path, error);
    int status = text == NULL ? error->code
                              : host_cube_file_parse(file, path, text, error);
    free(text);
    return status;
}

void host_cube_file_free(struct host_cube_file *file) {
    free(file->wire);
    free(file->pin);
    free(file->ssh);
    file->wire = NULL;
    file->pin = NULL;
    file->ssh = NULL;
    secure_wipe(file->key, sizeof file->key);
}
