/* A name with one of the extensions that the table of formats reads; packed
 * for the highest quarter of the choices.  What is read in a process of its own
 * is left out: the library's breakdowns there are errors, and each costs 20 ms.
 */
#ifndef FUZZ_FILE_NAME_H
#define FUZZ_FILE_NAME_H

#include <stdio.h>
#include <string.h>

#include "host/formats/formats.h"

enum { FILE_NAME_MAX = 32, FILE_NAME_PACKED = 192 };

/* choice: of 256. */
static inline void file_name(enum host_use use, unsigned choice,
                             char name[FILE_NAME_MAX]) {
    char list[HOST_FORMAT_LIST_MAX];
    unsigned count = 1;
    host_format_list(use, list, sizeof list);
    for (const char *c = list; *c != '\0'; c++)
        count += *c == ' ';
    const char *at = list;
    for (unsigned skip = choice % count; skip > 0; skip--)
        at = strchr(at, ' ') + 1;
    (void)snprintf(name, FILE_NAME_MAX, "a%.*s", (int)strcspn(at, " "), at);
    if (host_format_named(name)->apart)
        (void)snprintf(name, FILE_NAME_MAX, "a%.*s", (int)strcspn(list, " "),
                       list);
    if (choice >= FILE_NAME_PACKED)
        strcat(name, ".gz");
}

#endif
