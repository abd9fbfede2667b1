#include "text.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

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
    if (plain || *text == '\0')
        put(&q, plain ? text : "''", plain ? strlen(text) : 2);
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

/* --- what was meant ------------------------------------------------------- */

enum { WORD_MAX = 40 };

static unsigned least(unsigned a, unsigned b) {
    return a < b ? a : b;
}

/* Row i: from the first i letters of a to the first k of b, for every k. */
static unsigned distance(const char *a, const char *b) {
    unsigned row[3][WORD_MAX + 1];
    size_t n = strnlen(a, WORD_MAX), m = strnlen(b, WORD_MAX);
    for (unsigned k = 0; k <= m; k++)
        row[0][k] = k;
    for (unsigned i = 1; i <= n; i++) {
        unsigned *now = row[i % 3];
        const unsigned *before = row[(i + 2) % 3], *first = row[(i + 1) % 3];
        now[0] = i;
        for (unsigned k = 1; k <= m; k++) {
            now[k] = least(least(before[k], now[k - 1]) + 1,
                           before[k - 1] + (a[i - 1] != b[k - 1]));
            if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1])
                now[k] = least(now[k], first[k - 2] + 1);
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

/* --- for a terminal ------------------------------------------------------- */

void host_say(FILE *stream, const char *format, ...) {
    char raw[HOST_SAY_BYTES], line[HOST_SAY_BYTES];
    size_t size = strlen(format);
    bool ends = size > 0 && format[size - 1] == '\n';
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(raw, sizeof raw, format, arguments);
    va_end(arguments);
    size = strlen(raw);
    if (ends && raw[size - 1] == '\n')
        raw[size - 1] = '\0';
    host_text_printable(line, sizeof line, raw);
    (void)fprintf(stream, "%s%s", line, ends ? "\n" : "");
}

/* --- parse ---------------------------------------------------------------- */

enum { ALLOWED_MAX = 80 };

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/* 10 * *number + digit; false: it is too large. */
static bool append(uint64_t *number, unsigned digit) {
    uint64_t tens;
    return !__builtin_mul_overflow(*number, (uint64_t)10, &tens) &&
           !__builtin_add_overflow(tens, (uint64_t)digit, number);
}

/* Digits, moving *text past them; false: none, or too large a number. */
static bool read_digits(const char **text, uint64_t *number) {
    const char *at = *text;
    bool good = is_digit(*at);
    while (good && is_digit(*at))
        good = append(number, (unsigned)(*at++ - '0'));
    *text = at;
    return good;
}

/* The fraction and exponent of a whole number, as ".5e3". */
static bool read_exponent(const char *text, uint64_t *number) {
    uint64_t exponent = 0, places = 0;
    if (*text == '.') {
        const char *point = text++;
        if (!read_digits(&text, number))
            return false;
        places = (uint64_t)(text - point - 1);
    }
    if (*text != 'e' && *text != 'E')
        return false;
    text += text[1] == '+' ? 2 : 1;
    bool good = read_digits(&text, &exponent) && *text == '\0';
    while (good && *number != 0 && exponent > places) {
        good = append(number, 0);
        exponent--;
    }
    for (; good && places > exponent; places--) {
        good = *number % 10 == 0;
        *number /= 10;
    }
    return good;
}

/* "k" or "M" behind a count: thousands, or millions. */
static bool read_thousands(const char *text, uint64_t *value) {
    uint64_t by = strcasecmp(text, "k") == 0   ? 1000
                  : strcasecmp(text, "m") == 0 ? 1000000
                                               : 0;
    return by != 0 && !__builtin_mul_overflow(*value, by, value);
}

int host_parse_number(const char *text, uint64_t lo, uint64_t hi,
                      uint64_t *number) {
    uint64_t value = 0;
    if (!read_digits(&text, &value) ||
        (*text != '\0' && !read_thousands(text, &value) &&
         !read_exponent(text, &value)) ||
        value < lo || value > hi)
        return -1;
    *number = value;
    return 0;
}

int host_parse_bytes(const char *text, uint64_t *bytes) {
    static const char units[] = "KMG";
    uint64_t value = 0;
    unsigned shift = 0;
    if (!read_digits(&text, &value))
        return -1;
    text += *text == ' ' && text[1] != '\0' ? 1 : 0;
    if (*text != '\0') {
        const char *unit = strchr(units, *text >= 'a' ? *text - 32 : *text);
        if (unit == NULL ||
            (text[1] != '\0' && strcasecmp(text + 1, "b") != 0 &&
             strcasecmp(text + 1, "ib") != 0))
            return -1;
        shift = 10 * (unsigned)(unit - units + 1);
    }
    if (value > UINT64_MAX >> 20 >> shift)
        return -1;
    *bytes = value << shift;
    return 0;
}

int host_parse_nodes(const char *option, const char *text, unsigned most,
                     const char *more, unsigned *nodes,
                     struct host_error *error) {
    char allowed[ALLOWED_MAX] = "1";
    uint64_t n = 0;
    bool number = host_parse_number(text, 0, UINT64_MAX, &n) == 0;
    if (number && n > 0 && n <= most && (n & (n - 1)) == 0) {
        *nodes = (unsigned)n;
        return 0;
    }
    for (unsigned k = 2; k <= most; k *= 2) {
        size_t used = strlen(allowed);
        snprintf(allowed + used, sizeof allowed - used, ", %u", k);
    }
    return host_fail(error, HOST_USAGE, "%s %s: %s; allowed: %s%s", option,
                     text,
                     !number    ? "not a number"
                     : n > most ? "more nodes than there can be here"
                                : "not a power of two, as a cube has nodes",
                     allowed, number && n > most ? more : "");
}
