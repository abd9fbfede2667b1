/* Boards with Linux that the host reaches over ssh: `ssh` and `folder` of a
 * cube file's nodes. */
#include <stdlib.h>
#include <string.h>

#include "cube_reader.h"

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
    for (const char *at = text; *at != '\0'; at++) {
        good = good && (uint8_t)*at >= ' ' && *at != 0x7f;
    }
    return good;
}

int host_cube_read_ssh(struct host_cube_file *file,
                       const config_setting_t *group, unsigned node,
                       struct host_error *error) {
    const config_setting_t *to = config_setting_get_member(group, "ssh");
    const config_setting_t *folder = config_setting_get_member(group, "folder");
    const char *text = to == NULL ? NULL : config_setting_get_string(to);
    const char *path = folder == NULL ? "" : config_setting_get_string(folder);
    if (to == NULL && folder == NULL) {
        return 0;
    }
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
    if (file->ssh == NULL) {
        file->ssh = calloc(file->nodes, sizeof *file->ssh);
    }
    if (file->ssh == NULL) {
        return host_fail_memory(error, "the cube file");
    }
    strcpy(file->ssh[node].to, text);
    strcpy(file->ssh[node].folder, path);
    file->ssh[node].line = config_setting_source_line(group);
    return 0;
}

int host_cube_check_ssh(const struct host_cube_file *file,
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
