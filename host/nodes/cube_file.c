#include "cube_file.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/base/text.h"
#include "host/base/progress.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/secure_wipe.h"
#include "port.h"
#include "host/base/create.h"
#include "transport/secure.h"

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
    if (fault.what == NULL)
        return 0;
    snprintf(message, sizeof message, "key %s: %s%s%s; %s", file->key_path,
             fault.what, reason == 0 ? "" : ": ",
             reason == 0 ? "" : strerror(reason), fault.next);
    if (!file->has_key)
        return host_cube_wrong(file, where, error, message);
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
        read_start(file, root, error) != 0)
        return error->code;
    return key == NULL ? 0 : read_key(file, key, error);
}

static int host_cube_check_ssh(const struct host_cube_file *file,
                               struct host_error *error);

static int read_settings(struct host_cube_file *file, const config_t *config,
                         struct host_error *error) {
    static const char *const names[] = {
        "dimension", "board", "memory", "window", "key",
        "start",     "dead",  "links",  "nodes",  NULL};
    const config_setting_t *root = config_root_setting(config);
    const config_setting_t *links = config_setting_get_member(root, "links");
    if (host_cube_check_names(file, root, names, error) != 0 ||
        read_nodes(file, root, error) != 0)
        return error->code;
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
    if (file->wire == NULL)
        return host_fail_memory(error, "the cube file");
    for (unsigned i = 0; i < count; i++) {
        config_setting_t *group = config_setting_get_elem(links, i);
        if (!config_setting_is_group(group)) {
            return host_cube_wrong(file, links, error,
                                   "links: not a list of groups in braces; "
                                   "write links = ( { node = 0; to = "
                                   "\"host\"; .. }, .. );");
        }
        if (host_cube_read_wire(file, group, error) != 0)
            return error->code;
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
    if (fd >= 0)
        close(fd);
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
    if (fd < 0)
        return NULL;
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

static int host_cube_scan(const char *path, const char *text,
                          struct host_error *error);

int host_cube_file_parse(struct host_cube_file *file, const char *path,
                         const char *text, struct host_error *error) {
    config_t config;
    int status;
    memset(file, 0, sizeof *file);
    file->path = path;
    if (host_cube_scan(path, text, error) != 0)
        return error->code;
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
    if (status != 0)
        host_cube_file_free(file);
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

/* --- cube scan ------------------------------------------------------------ */

/* A cube file has three brackets in each other and nine settings side by side.
 * The library bounds neither, compares each setting's name with all beside it,
 * and opens what @include names, be it a pipe; where it cannot go on it ends
 * the program. */
enum { DEPTH_MAX = 16, BESIDE_MAX = 64 };

struct scan {
    const char *at;
    unsigned line, depth;
    unsigned settings[DEPTH_MAX + 1]; /* beside each other, at each depth */
};

/* Past a text in quotes or a comment; `at` where there is none. */
static const char *skip(const char *at) {
    if (*at == '"') {
        do {
            at += *at == '\\' && at[1] != '\0' ? 2 : 1;
        } while (*at != '\0' && *at != '"');
        return at + (*at == '"');
    }
    if (*at == '#' || (at[0] == '/' && at[1] == '/'))
        return at + strcspn(at, "\n");
    if (at[0] == '/' && at[1] == '*') {
        const char *end = strstr(at + 2, "*/");
        return end == NULL ? at + strlen(at) : end + 2;
    }
    return at;
}

/* What is wrong with the character there, or NULL. */
static const char *take(struct scan *s) {
    switch (*s->at) {
    case '(':
    case '[':
    case '{':
        if (s->depth == DEPTH_MAX)
            return "too many brackets in each other; give three at most";
        s->settings[++s->depth] = 0;
        return NULL;
    case ')':
    case ']':
    case '}':
        s->depth -= s->depth > 0 ? 1 : 0;
        return NULL;
    case '=':
    case ':':
        return ++s->settings[s->depth] > BESIDE_MAX
                   ? "more settings beside each other than there are; see "
                     "host/nodes/README.md for those"
                   : NULL;
    case '@':
        return "@: a cube file stands alone; write what it would @include in "
               "its place";
    default:
        return NULL;
    }
}

/* Whether the library can be given a text: HOST_INPUT with the line where it
 * asks for other files, or for more than any cube file has.  Work: a pass. */
static int host_cube_scan(const char *path, const char *text,
                          struct host_error *error) {
    struct scan s = {.at = text, .line = 1};
    while (*s.at != '\0') {
        const char *end = skip(s.at);
        const char *why = end == s.at ? take(&s) : NULL;
        if (why != NULL)
            return host_fail(error, HOST_INPUT, "%s:%u: %s", path, s.line, why);
        end += end == s.at ? 1 : 0;
        for (; s.at < end; s.at++)
            s.line += *s.at == '\n' ? 1 : 0;
    }
    return 0;
}

/* --- cube values ---------------------------------------------------------- */

int host_cube_wrong(const struct host_cube_file *file,
                    const config_setting_t *where, struct host_error *error,
                    const char *what) {
    return host_fail(error, HOST_INPUT, "%s:%u: %s", file->path,
                     where == NULL ? 1 : config_setting_source_line(where),
                     what);
}

int host_cube_check_names(const struct host_cube_file *file,
                          const config_setting_t *group,
                          const char *const names[], struct host_error *error) {
    for (int i = 0; i < config_setting_length(group); i++) {
        const config_setting_t *member =
            config_setting_get_elem(group, (unsigned)i);
        const char *name = config_setting_name(member);
        bool known = false;
        for (unsigned k = 0; names[k] != NULL; k++)
            known = known || strcmp(names[k], name) == 0;
        if (!known) {
            char text[160];
            snprintf(text, sizeof text,
                     "%.60s: no such setting here; see host/nodes/README.md "
                     "for those that there are",
                     name);
            return host_cube_wrong(file, member, error, text);
        }
    }
    return 0;
}

/* What libconfig reads of a setting of another
 * type, or of one beyond an int, is 0. */
bool host_cube_is_number(const config_setting_t *setting, int lo, int hi,
                         int *value) {
    long long n = config_setting_get_int64(setting);
    int type = config_setting_type(setting);
    if ((type != CONFIG_TYPE_INT && type != CONFIG_TYPE_INT64) || n < lo ||
        n > hi)
        return false;
    *value = (int)n;
    return true;
}

bool host_cube_take_number(const config_setting_t *group, const char *name,
                           int lo, int hi, int *value) {
    const config_setting_t *member = config_setting_get_member(group, name);
    return member == NULL || host_cube_is_number(member, lo, hi, value);
}

int host_cube_resolve(const struct host_cube_file *file,
                      const config_setting_t *where,
                      struct tcp_address *address, struct host_error *error) {
    const char *text = config_setting_get_string(where);
    char why[400];
    int code = host_resolve(text == NULL ? "" : text, address, why, sizeof why);
    return code == 0 ? 0
                     : host_fail(error, code, "%s:%u: %s", file->path,
                                 config_setting_source_line(where), why);
}

int host_cube_beside(const struct host_cube_file *file,
                     const config_setting_t *where, char *path, size_t size) {
    const char *name = config_setting_get_string(where);
    const char *slash = strrchr(file->path, '/');
    if (name == NULL || name[0] == '\0')
        return -1;
    int folder =
        name[0] == '/' || slash == NULL ? 0 : (int)(slash - file->path) + 1;
    int length = snprintf(path, size, "%.*s%s", folder, file->path, name);
    return length < (int)size ? 0 : -1;
}

void host_cube_print_address(const struct tcp_address *address, char *text,
                             size_t size) {
    if (tcp_address_path(address) != NULL) {
        snprintf(text, size, "%s", tcp_address_path(address));
        return;
    }
    char host[NI_MAXHOST], port[NI_MAXSERV];
    if (getnameinfo(&address->to.any, address->size, host, sizeof host, port,
                    sizeof port, NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        snprintf(text, size, "?");
        return;
    }
    snprintf(text, size, strchr(host, ':') != NULL ? "[%s]:%s" : "%s:%s", host,
             port);
}

/* Boards with Linux that the host reaches over ssh: `ssh` and `folder` of a
 * cube file's nodes. */

/* A word that no shell, and no option of ssh, takes for anything else. */
static bool is_destination(const char *text) {
    bool good = text[0] != '\0' && text[0] != '-';
    for (const char *at = text; *at != '\0'; at++) {
        good =
            good && *at > ' ' && *at < 0x7f && strchr("'\"\\`$", *at) == NULL;
    }
    return good;
}

/* A line feed would end a line of a unit of systemd. */
static bool is_folder(const char *text) {
    bool good = text[0] != '\0';
    for (const char *at = text; *at != '\0'; at++)
        good = good && (uint8_t)*at >= ' ' && *at != 0x7f;
    return good;
}

int host_cube_read_ssh(struct host_cube_file *file,
                       const config_setting_t *group, unsigned node,
                       struct host_error *error) {
    const config_setting_t *to = config_setting_get_member(group, "ssh");
    const config_setting_t *folder = config_setting_get_member(group, "folder");
    const char *text = to == NULL ? NULL : config_setting_get_string(to);
    const char *path = folder == NULL ? "" : config_setting_get_string(folder);
    if (to == NULL && folder == NULL)
        return 0;
    if (text == NULL || strlen(text) >= HOST_SSH_MAX || !is_destination(text)) {
        return host_cube_wrong(file, to == NULL ? folder : to, error,
                               "ssh: not who and where; write \"pi@10.0.0.11\" "
                               "or \"ssh://pi@10.0.0.11:2222\"");
    }
    if (path == NULL || strlen(path) >= HOST_SSH_MAX ||
        (folder != NULL && !is_folder(path))) {
        return host_cube_wrong(file, folder, error,
                               "folder: not a folder of the board; write "
                               "\"/opt/incode\", or leave it out");
    }
    if (file->ssh == NULL)
        file->ssh = calloc(file->nodes, sizeof *file->ssh);
    if (file->ssh == NULL)
        return host_fail_memory(error, "the cube file");
    strcpy(file->ssh[node].to, text);
    strcpy(file->ssh[node].folder, path);
    file->ssh[node].line = config_setting_source_line(group);
    return 0;
}

static int host_cube_check_ssh(const struct host_cube_file *file,
                               struct host_error *error) {
    for (unsigned i = 0; i < file->nodes && error->code == 0; i++) {
        const struct host_cube_ssh *ssh = host_cube_ssh(file, i);
        if (ssh != NULL && (file->local[i] || host_cube_is_bare(file, i))) {
            host_fail(error, HOST_INPUT, "%s:%u: ssh: node %u %s", file->path,
                      ssh->line, i,
                      file->local[i]
                          ? "is started by the host itself; take it out of "
                            "start, or leave ssh out"
                          : "has no system to log in to; leave ssh out");
        }
    }
    return error->code;
}

const struct host_cube_ssh *host_cube_ssh(const struct host_cube_file *file,
                                          unsigned node) {
    return file->ssh != NULL && node < file->nodes &&
                   file->ssh[node].to[0] != '\0'
               ? &file->ssh[node]
               : NULL;
}

/* --- cube key ------------------------------------------------------------- */

enum { TEXT_BYTES = 2 * SECURE_KEY_BYTES + 1 };

static bool draw_digits(char text[TEXT_BYTES]) {
    static const char digits[] = "0123456789abcdef";
    uint8_t key[SECURE_KEY_BYTES];
    if (getrandom(key, sizeof key, 0) != (ssize_t)sizeof key)
        return false;
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
        if (written < 0 && errno != EINTR)
            return false;
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
    if (good)
        return 0;
    if (fd >= 0)
        (void)unlink(path);
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
