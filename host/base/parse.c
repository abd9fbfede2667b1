#include "parse.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

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
    while (good && is_digit(*at)) {
        good = append(number, (unsigned)(*at++ - '0'));
    }
    *text = at;
    return good;
}

/* The fraction and exponent of a whole number, as ".5e3". */
static bool read_exponent(const char *text, uint64_t *number) {
    uint64_t exponent = 0, places = 0;
    if (*text == '.') {
        const char *point = text++;
        if (!read_digits(&text, number)) {
            return false;
        }
        places = (uint64_t)(text - point - 1);
    }
    if (*text != 'e' && *text != 'E') {
        return false;
    }
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
        value < lo || value > hi) {
        return -1;
    }
    *number = value;
    return 0;
}

int host_parse_bytes(const char *text, uint64_t *bytes) {
    static const char units[] = "KMG";
    uint64_t value = 0;
    unsigned shift = 0;
    if (!read_digits(&text, &value)) {
        return -1;
    }
    text += *text == ' ' && text[1] != '\0' ? 1 : 0;
    if (*text != '\0') {
        const char *unit = strchr(units, *text >= 'a' ? *text - 32 : *text);
        if (unit == NULL ||
            (text[1] != '\0' && strcasecmp(text + 1, "b") != 0 &&
             strcasecmp(text + 1, "ib") != 0)) {
            return -1;
        }
        shift = 10 * (unsigned)(unit - units + 1);
    }
    if (value > UINT64_MAX >> 20 >> shift) {
        return -1;
    }
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
