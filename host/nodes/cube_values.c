#include "cube_reader.h"

#include <netdb.h>
#include <stdio.h>
#include <string.h>

#include "resolve.h"

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
        for (unsigned k = 0; names[k] != NULL; k++) {
            known = known || strcmp(names[k], name) == 0;
        }
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
        n > hi) {
        return false;
    }
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
    if (name == NULL || name[0] == '\0') {
        return -1;
    }
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
