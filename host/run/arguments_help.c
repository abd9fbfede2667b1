#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arguments_parts.h"
#include "host/formats/formats.h"

static const char *link_help(unsigned i) {
    return host_link_row(i)->help;
}

static const char *board_help(unsigned i) {
    return host_board_row(i)->help;
}

/* Option's help with the rows of the table that its values are from; usual: the
 * default's name. */
static char *list_rows(const char *text, const char *(*name)(unsigned i),
                       const char *(*help)(unsigned i), const char *usual) {
    size_t size = strlen(text) + 1;
    for (unsigned i = 0; name(i) != NULL; i++) {
        size += strlen(name(i)) + strlen(help(i)) + sizeof " (; the default),";
    }
    char *whole = malloc(size);
    size_t used = 0;
    if (whole == NULL) {
        return NULL;
    }
    used += (size_t)snprintf(whole, size, "%s", text);
    for (unsigned i = 0; name(i) != NULL; i++) {
        used += (size_t)snprintf(whole + used, size - used, "%s %s (%s%s)",
                                 i == 0 ? "" : ",", name(i), help(i),
                                 strcmp(name(i), usual) == 0 ? "; the default"
                                                             : "");
    }
    return whole;
}

/* `text` with the formats of a use, as `put` has them, in the place of its %s.
 */
static char *list_formats(const char *text, enum host_use use,
                          void (*put)(enum host_use use, char *text,
                                      size_t size)) {
    char list[HOST_FORMAT_LIST_MAX], *whole = NULL;
    const char *place = strstr(text, "%s");
    put(use, list, sizeof list);
    return asprintf(&whole, "%.*s%s%s", (int)(place - text), text, list,
                    place + strlen("%s")) < 0
               ? NULL
               : whole;
}

char *host_arguments_help(int key, const char *text, void *input) {
    (void)input;
    switch (key) {
    case 'o':
        return list_formats(text, HOST_WRITE_TETRAHEDRA, host_format_help);
    case KEY_FORMAT:
        return list_formats(text, HOST_READ_POINTS, host_format_list);
    case ARGP_KEY_HELP_POST_DOC:
        return list_formats(text, HOST_READ_POINTS, host_format_help);
    case KEY_STRATEGY:
        return list_rows(text, host_strategy_name, host_strategy_help, "auto");
    case KEY_LINK:
        return list_rows(text, host_link_name, link_help, host_link_name(0));
    case KEY_BOARD:
        return list_rows(text, host_board_name, board_help, host_board_name(0));
    default:
        return (char *)text;
    }
}
