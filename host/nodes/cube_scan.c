#include <stdio.h>
#include <string.h>

#include "cube_reader.h"

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
    if (*at == '#' || (at[0] == '/' && at[1] == '/')) {
        return at + strcspn(at, "\n");
    }
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
        if (s->depth == DEPTH_MAX) {
            return "too many brackets in each other; give three at most";
        }
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

int host_cube_scan(const char *path, const char *text,
                   struct host_error *error) {
    struct scan s = {.at = text, .line = 1};
    while (*s.at != '\0') {
        const char *end = skip(s.at);
        const char *why = end == s.at ? take(&s) : NULL;
        if (why != NULL) {
            return host_fail(error, HOST_INPUT, "%s:%u: %s", path, s.line, why);
        }
        end += end == s.at ? 1 : 0;
        for (; s.at < end; s.at++) {
            s.line += *s.at == '\n' ? 1 : 0;
        }
    }
    return 0;
}
