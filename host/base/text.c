#include "text.h"

#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include "transport/text.h"

void host_text_printable(char *out, size_t size, const char *text) {
    struct cube_text printable = cube_text_in(out, size);
    cube_text_printable(&printable, text);
}

/* --- for a shell ---------------------------------------------------------- */

/* What no shell reads as anything but itself; zsh reads = at the start. */
static bool is_plain(const char *text) {
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                "abcdefghijklmnopqrstuvwxyz"
                                "0123456789_@%+:,./-=";
    return text[0] != '\0' && text[0] != '=' &&
           text[strspn(text, plain)] == '\0';
}

struct quoting {
    char *out;
    size_t size, used; /* used > size: it does not fit */
    bool open;         /* within '..' */
};

static void put(struct quoting *q, const char *words, size_t bytes) {
    if (q->used + bytes < q->size) {
        memcpy(q->out + q->used, words, bytes);
        q->used += bytes;
    } else {
        q->used = q->size;
    }
}

static void set_open(struct quoting *q, bool open) {
    if (q->open != open) {
        put(q, "'", 1);
        q->open = open;
    }
}

/* The bytes of one character, of which a terminal would obey some.  `$'..'` is
 * younger than most shells: printf makes them. */
static void put_character(struct quoting *q, const char *at, size_t bytes,
                          bool shown) {
    char octal[sizeof "\"$(printf '\\377')\""];
    if (*at == '\'') {
        set_open(q, false);
        put(q, "\\'", 2);
        return;
    }
    set_open(q, shown || *at == '\n');
    if (q->open) {
        put(q, at, bytes);
        return;
    }
    for (size_t i = 0; i < bytes; i++) {
        put(q, octal,
            (size_t)snprintf(octal, sizeof octal, "\"$(printf '\\%03o')\"",
                             (unsigned)(unsigned char)at[i]));
    }
}

int host_text_quote(char *out, size_t size, const char *text) {
    struct quoting q = {out, size, 0, false};
    bool plain = is_plain(text);
    if (plain || *text == '\0') {
        put(&q, plain ? text : "''", plain ? strlen(text) : 2);
    }
    while (!plain && *text != '\0') {
        size_t shown = cube_text_shown(text);
        put_character(&q, text, shown > 0 ? shown : 1, shown > 0);
        text += shown > 0 ? shown : 1;
    }
    set_open(&q, false);
    bool fits = q.used < size;
    out[fits ? q.used : 0] = '\0';
    return fits ? 0 : -1;
}

/* --- what was meant ---------------------------------------------------------
 */

enum { WORD_MAX = 40 };

static unsigned least(unsigned a, unsigned b) {
    return a < b ? a : b;
}

/* Row i: from the first i letters of a to the first k of b, for every k. */
static unsigned distance(const char *a, const char *b) {
    unsigned row[3][WORD_MAX + 1];
    size_t n = strnlen(a, WORD_MAX), m = strnlen(b, WORD_MAX);
    for (unsigned k = 0; k <= m; k++) {
        row[0][k] = k;
    }
    for (unsigned i = 1; i <= n; i++) {
        unsigned *now = row[i % 3];
        const unsigned *before = row[(i + 2) % 3], *first = row[(i + 1) % 3];
        now[0] = i;
        for (unsigned k = 1; k <= m; k++) {
            now[k] = least(least(before[k], now[k - 1]) + 1,
                           before[k - 1] + (a[i - 1] != b[k - 1]));
            if (i > 1 && k > 1 && a[i - 1] == b[k - 2] &&
                a[i - 2] == b[k - 1]) {
                now[k] = least(now[k], first[k - 2] + 1);
            }
        }
    }
    return row[n % 3][m];
}

const char *host_text_nearest(const char *word,
                              const char *(*name)(const void *context,
                                                  unsigned i),
                              const void *context) {
    const char *nearest = NULL;
    unsigned best = (unsigned)(strlen(word) + 2) / 3 + 1;
    for (unsigned i = 0; name(context, i) != NULL; i++) {
        unsigned far = distance(word, name(context, i));
        if (far < best) {
            best = far;
            nearest = name(context, i);
        }
    }
    return nearest;
}

/* --- for a terminal --------------------------------------------------------
 */

void host_say(FILE *stream, const char *format, ...) {
    char raw[HOST_SAY_BYTES], line[HOST_SAY_BYTES];
    size_t size = strlen(format);
    bool ends = size > 0 && format[size - 1] == '\n';
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(raw, sizeof raw, format, arguments);
    va_end(arguments);
    size = strlen(raw);
    if (ends && raw[size - 1] == '\n') {
        raw[size - 1] = '\0';
    }
    host_text_printable(line, sizeof line, raw);
    (void)fprintf(stream, "%s%s", line, ends ? "\n" : "");
}
