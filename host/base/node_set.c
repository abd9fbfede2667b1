#include "node_set.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "text.h"

enum { PART_BYTES = 16 };

/* A number or a range up to `end`, which is a comma or the text's end. */
static bool add_part(struct host_node_set *set, const char *text,
                     const char *end, unsigned nodes) {
    char part[PART_BYTES], *dash;
    uint64_t first, last;
    if (end == text || end - text >= PART_BYTES)
        return false;
    snprintf(part, sizeof part, "%.*s", (int)(end - text), text);
    if (part[strspn(part, "0123456789-")] != '\0')
        return false; /* a number here has no exponent and no unit */
    dash = strchr(part, '-');
    if (dash != NULL)
        *dash = '\0';
    if (host_parse_number(part, 0, nodes - 1, &first) != 0 ||
        host_parse_number(dash == NULL ? part : dash + 1, first, nodes - 1,
                          &last) != 0)
        return false;
    for (uint64_t node = first; node <= last; node++)
        host_node_set_add(set, (unsigned)node);
    return true;
}

int host_node_set_parse(struct host_node_set *set, const char *text,
                        unsigned nodes, struct host_error *error) {
    const char *at = text, *end;
    memset(set, 0, sizeof *set);
    if (strcmp(text, "all") == 0) {
        host_node_set_all(set, nodes);
        return 0;
    }
    do {
        end = strchrnul(at, ',');
        if (!add_part(set, at, end, nodes)) {
            memset(set, 0, sizeof *set);
            return host_fail(error, HOST_USAGE,
                             "%s: not nodes of this cube; give numbers from 0 "
                             "to %u and ranges of them, as in 0-3,7, or all",
                             *text == '\0' ? "an empty set" : text, nodes - 1);
        }
        at = end + 1;
    } while (*end == ',');
    return 0;
}

void host_node_set_all(struct host_node_set *set, unsigned nodes) {
    memset(set, 0, sizeof *set);
    for (unsigned node = 0; node < nodes; node++)
        host_node_set_add(set, node);
}

unsigned host_node_set_count(const struct host_node_set *set) {
    unsigned count = 0;
    for (size_t i = 0; i < sizeof set->bits; i++)
        count += (unsigned)__builtin_popcount(set->bits[i]);
    return count;
}

void host_node_set_print(const struct host_node_set *set, char *text,
                         size_t size) {
    size_t used = 0;
    unsigned left = host_node_set_count(set);
    snprintf(text, size, "%s", "");
    for (unsigned first = 0, last; left > 0; first = last + 1) {
        char part[PART_BYTES];
        last = first;
        if (!host_node_set_has(set, first))
            continue;
        while (last + 1 < CUBE_NODES_MAX && host_node_set_has(set, last + 1))
            last++;
        left -= last - first + 1;
        snprintf(part, sizeof part, last == first ? "%s%u" : "%s%u-%u",
                 used == 0 ? "" : ",", first, last);
        /* Behind every part but the last there is room for two dots. */
        if (used + strlen(part) + (left == 0 ? 1 : sizeof "..") > size) {
            snprintf(text + used, size - used, "..");
            return;
        }
        used += (size_t)snprintf(text + used, size - used, "%s", part);
    }
}

void host_node_set_name(const struct host_node_set *set, char *text,
                        size_t size) {
    int used =
        snprintf(text, size, "node%s ", host_text_s(host_node_set_count(set)));
    assert((size_t)used < size);
    host_node_set_print(set, text + used, size - (size_t)used);
}
