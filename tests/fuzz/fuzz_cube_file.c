/* Any bytes as a cube file: a cube, and the lines that start its nodes, or an
 * error that says where. */
#include <dlfcn.h>
#include <netdb.h>
#include <stdlib.h>
#include <string.h>

#include "host/nodes/cube_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
const char *__lsan_default_suppressions(void); /* NOLINT: the sanitizer's */

/* Where its syntax is wrong, libconfig 1.5 forgets the string that it was
 * reading; the program ends there. */
const char *__lsan_default_suppressions(void) /* NOLINT */
{
    return "leak:libconfig";
}

/* Names of hosts are looked up nowhere: numbers alone are known here. */
int getaddrinfo(const char *restrict node, const char *restrict service,
                const struct addrinfo *restrict hints,
                struct addrinfo **restrict found) {
    typedef int look_up(const char *, const char *, const struct addrinfo *,
                        struct addrinfo **);
    struct addrinfo numbers = *hints;
    look_up *system;
    *(void **)&system = dlsym(RTLD_NEXT, "getaddrinfo");
    numbers.ai_flags |= AI_NUMERICHOST | AI_NUMERICSERV;
    return system(node, service, &numbers, found);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static struct host_cube_file file;
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    struct host_error error = {0};
    char *text = malloc(size + 1);
    if (text == NULL)
        return 0;
    memcpy(text, data, size);
    text[size] = '\0';
    int code = host_cube_file_parse(&file, "/nowhere/a.cube", text, &error);
    if (code != error.code || (code != 0) != (error.text[0] != '\0') ||
        (code != 0 && strncmp(error.text, "/nowhere/a.cube:", 16) != 0))
        abort();
    for (unsigned i = 0; code == 0 && i < file.nodes; i++) {
        unsigned count = host_cube_node_options(&file, i, options);
        if (count < 4 || count > HOST_NODE_OPTIONS_MAX)
            abort();
    }
    host_cube_file_free(&file);
    free(text);
    return 0;
}
