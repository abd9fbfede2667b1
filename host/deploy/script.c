#include "script.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/text.h"

/* board.sh as it is. */
__asm__(".section .rodata\n"
        "host_deploy_script:\n"
        ".incbin \"host/deploy/board.sh\"\n"
        ".byte 0\n"
        ".previous\n");
extern const char host_deploy_script[] __attribute__((visibility("hidden")));

const char *host_fact_name(enum host_fact fact) {
    static const char *const names[HOST_FACTS] = {
        "machine", "manager", "user", "folder", "file",
        "program", "key",     "unit", "state",  "since"};
    return names[fact];
}

char *host_script_command(const char *order, unsigned node,
                          const char *folder) {
    /* A byte becomes four at most: '\'' */
    size_t size = 4 * (strlen(host_deploy_script) + strlen(folder)) + 128, used;
    char *command = malloc(size), number[16];
    const char *const words[] = {host_deploy_script, "incode-deploy", order,
                                 number, folder};
    if (command == NULL)
        return NULL;
    snprintf(number, sizeof number, "%u", node);
    used = (size_t)snprintf(command, size, "exec sh -c");
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        command[used++] = ' ';
        if (host_text_quote(command + used, size - used, words[i]) != 0) {
            free(command);
            return NULL;
        }
        used += strlen(command + used);
    }
    return command;
}
