#include "scan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct host_scan host_scan_start(const char *path, const void *data,
                                 size_t bytes) {
    const char *text = data;
    struct host_scan s = {path, text, text, text + bytes, 0, NULL, NULL};
    if (bytes >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0)
        s.at += 3;
    return s;
}

/* Unpacks until the current line is whole, or the file has ended. */
static void fill(struct host_scan *s) {
    const uint8_t *at = (const uint8_t *)s->at, *end = (const uint8_t *)s->end;
    const char *last = NULL;
    for (const char *c = s->start; c < s->at; c++)
        s->lines_before += *c == '\n';
    while (last == NULL && host_source_more(s->source, &at, &end))
        last = memrchr(at, '\n', (size_t)(end - at));
    s->start = s->at = (const char *)at;
    s->end = (const char *)end;
    s->whole = last == NULL ? s->end : last + 1;
    if (last == NULL)
        s->source = NULL; /* the file has ended */
}

struct host_scan host_scan_source(const struct host_source *source) {
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    if (source->feed != NULL) {
        const char *last = memrchr(s.start, '\n', source->bytes);
        s.source = source;
        s.whole = last == NULL ? s.start : last + 1;
        if (s.at >= s.whole)
            fill(&s);
    }
    return s;
}

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == ';';
}

static bool is_end(char c) {
    return c == '\n' || c == '#';
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

bool host_scan_is_comment(const char *at, const char *end) {
    return *at == '#' || (*at == '/' && end - at > 1 && at[1] == '/');
}

bool host_scan_more(struct host_scan *s) {
    while (s->at < s->end && is_blank(*s->at))
        s->at++;
    return s->at < s->end && *s->at != '\n' &&
           !host_scan_is_comment(s->at, s->end);
}

void host_scan_next_line(struct host_scan *s) {
    const char *line = memchr(s->at, '\n', (size_t)(s->end - s->at));
    s->at = line == NULL ? s->end : line + 1;
    if (s->source != NULL && s->at >= s->whole)
        fill(s);
}

bool host_scan_skip_blank_lines(struct host_scan *s) {
    while (!host_scan_more(s)) {
        if (s->at == s->end)
            return false;
        host_scan_next_line(s);
    }
    return true;
}

int host_scan_fail(const struct host_scan *s, const char *at,
                   struct host_error *error, const char *what) {
    uint64_t line = s->lines_before + 1;
    const char *begin = s->start;
    for (const char *c = s->start; c < at; c++) {
        if (*c == '\n') {
            line++;
            begin = c + 1;
        }
    }
    return host_fail(error, HOST_INPUT, "%s:%llu:%llu: %s", s->path,
                     (unsigned long long)line,
                     (unsigned long long)(at - begin) + 1, what);
}

int host_scan_end(struct host_scan *s, struct host_error *error,
                  const char *what) {
    return host_scan_skip_blank_lines(s) ? host_scan_fail(s, s->at, error, what)
                                         : 0;
}

/* --- Numbers -------------------------------------------------------------- */

static const uint64_t power10[20] = {1,
                                     10,
                                     100,
                                     1000,
                                     10000,
                                     100000,
                                     1000000,
                                     10000000,
                                     100000000,
                                     1000000000,
                                     10000000000,
                                     100000000000,
                                     1000000000000,
                                     10000000000000,
                                     100000000000000,
                                     1000000000000000,
                                     10000000000000000,
                                     100000000000000000,
                                     1000000000000000000,
                                     10000000000000000000u};

/* The double nearest to (q + a bit more if `sticky`) * 2^exponent, ties to
 * even; the result is a normal number by the ranges of the caller. */
static double rounded(uint64_t q, bool sticky, int exponent) {
    int shift = 11 - __builtin_clzll(q);
    if (shift <= 0)
        return ldexp((double)q, exponent); /* 53 bits or fewer; sticky = 0 */
    uint64_t mantissa = q >> shift;
    uint64_t rest = q & ((UINT64_C(1) << shift) - 1);
    uint64_t half = UINT64_C(1) << (shift - 1);
    if (rest > half || (rest == half && (sticky || (mantissa & 1) != 0)))
        mantissa++;
    return ldexp((double)mantissa, exponent + shift);
}

/* m * 10^power, exactly rounded, for 0 < m and |power| <= 19: products and
 * quotients of 64-bit integers are exact in 128 bits. */
static double scaled(uint64_t m, int power) {
    if (m <= UINT64_C(1) << 53 && power >= -19 && power <= 19) {
        /* Both are exact doubles (10^19 = 5^19 * 2^19): one rounding. */
        return power < 0 ? (double)m / (double)power10[-power]
                         : (double)m * (double)power10[power];
    }
    if (power >= 0) {
        unsigned __int128 p = (unsigned __int128)m * power10[power];
        uint64_t high = (uint64_t)(p >> 64);
        if (high == 0)
            return rounded((uint64_t)p, false, 0);
        int lead = __builtin_clzll(high);
        uint64_t q = (uint64_t)((p << lead) >> 64);
        return rounded(q, (uint64_t)(p << lead) != 0, 64 - lead);
    }
    uint64_t d = power10[-power];
    int lead_m = __builtin_clzll(m), lead_d = __builtin_clzll(d);
    unsigned __int128 n = (unsigned __int128)(m << lead_m) << 63;
    d <<= lead_d;
    uint64_t q = (uint64_t)(n / d); /* 2^62 < q <= 2^64 - 1 */
    return rounded(q, n % d != 0, lead_d - lead_m - 63);
}

/* The slow way: a copy, since the text need not end and may hold Fortran's D
 * for E. */
static double slow_double(const char *first, const char *last) {
    char buffer[512];
    size_t n = (size_t)(last - first);
    char *copy = n < sizeof buffer ? buffer : malloc(n + 1);
    if (copy == NULL)
        return NAN;
    for (size_t i = 0; i < n; i++)
        copy[i] = first[i] == 'd' || first[i] == 'D' ? 'e' : first[i];
    copy[n] = '\0';
    double value = strtod(copy, NULL);
    if (copy != buffer)
        free(copy);
    return value;
}

/* What the grammar of a decimal number finds. */
struct decimal {
    const char *end; /* just past it, or NULL */
    uint64_t mantissa;
    int power;
    bool exact; /* the value is mantissa * 10^power */
    bool negative;
};

static const char *take_digits(const char *c, const char *end,
                               struct decimal *n, int *taken) {
    while (c < end && is_digit(*c)) {
        if (*taken < 19) {
            n->mantissa = 10 * n->mantissa + (uint64_t)(*c - '0');
            *taken += n->mantissa != 0;
        } else {
            n->exact = false;
        }
        c++;
    }
    return c;
}

static struct decimal parse_decimal(const char *c, const char *end) {
    struct decimal n = {.exact = true};
    if (c < end && (*c == '-' || *c == '+'))
        n.negative = *c++ == '-';
    int taken = 0;
    const char *integer = c;
    c = take_digits(c, end, &n, &taken);
    ptrdiff_t digits = c - integer;
    if (c < end && *c == '.') {
        const char *fraction = ++c;
        c = take_digits(c, end, &n, &taken);
        digits += c - fraction;
        ptrdiff_t places = c - fraction;
        n.power = places < 10000 ? -(int)places : -10000;
    }
    if (digits == 0)
        return n;
    if (c < end && (*c == 'e' || *c == 'E' || *c == 'd' || *c == 'D')) {
        c++;
        bool down = c < end && *c == '-';
        c += c < end && (*c == '-' || *c == '+');
        if (c == end || !is_digit(*c))
            return n;
        int power = 0;
        while (c < end && is_digit(*c)) {
            power = power < 100000 ? 10 * power + (*c - '0') : power;
            c++;
        }
        n.power += down ? -power : power;
    }
    n.end = c;
    return n;
}

static size_t word_length(struct host_scan *s);

/* Whether the word at hand has a NUL byte in it, which no text has. */
static bool is_binary(struct host_scan *s, struct host_error *error) {
    size_t n = word_length(s);
    const char *nul = n > 0 ? memchr(s->at, '\0', n) : NULL;
    if (nul == NULL)
        return false;
    host_scan_fail(s, nul, error,
                   "a NUL byte where text is due: the file is binary or UTF-16 "
                   "perhaps; give it the extension of its format, or say it "
                   "with --format, or save it as UTF-8");
    return true;
}

static int no_number(struct host_scan *s, struct host_error *error) {
    char word[48], text[160];
    const char *at = s->at;
    if (is_binary(s, error))
        return error->code;
    host_scan_word(s, word, sizeof word);
    const char *bare = word + (word[0] == '-' || word[0] == '+');
    if (word[0] == '\0') {
        return host_scan_fail(s, at, error,
                              "a number is missing; give three a point");
    }
    if (strcasecmp(bare, "nan") == 0) {
        return host_scan_fail(s, at, error,
                              "NaN is no coordinate; remove the point");
    }
    if (strcasecmp(bare, "inf") == 0 || strcasecmp(bare, "infinity") == 0) {
        return host_scan_fail(s, at, error,
                              "infinity is no coordinate; remove the point");
    }
    (void)snprintf(text, sizeof text,
                   "'%s' is no number; correct it, or put # before a line "
                   "that holds none",
                   word);
    return host_scan_fail(s, at, error, text);
}

int host_scan_double(struct host_scan *s, double *value,
                     struct host_error *error) {
    if (!host_scan_more(s)) {
        return host_scan_fail(s, s->at, error,
                              "the line ends where a number is due; complete "
                              "or remove it");
    }
    struct decimal n = parse_decimal(s->at, s->end);
    if (n.end == NULL ||
        (n.end < s->end && !is_blank(*n.end) && !is_end(*n.end)))
        return no_number(s, error);
    if (!n.exact || (n.mantissa != 0 && (n.power < -19 || n.power > 19))) {
        *value = slow_double(s->at, n.end);
        if (!isfinite(*value)) {
            return host_scan_fail(s, s->at, error,
                                  "the number is too large for a double; "
                                  "scale the points");
        }
    } else {
        double magnitude = n.mantissa == 0 ? 0 : scaled(n.mantissa, n.power);
        *value = n.negative ? -magnitude : magnitude;
    }
    s->at = n.end;
    return 0;
}

int host_scan_double_anywhere(struct host_scan *s, double *value,
                              struct host_error *error) {
    if (!host_scan_skip_blank_lines(s)) {
        return host_scan_fail(s, s->at, error,
                              "the file ends where a number is due; it is cut "
                              "short, get it whole");
    }
    return host_scan_double(s, value, error);
}

int host_scan_unsigned(struct host_scan *s, uint64_t most, uint64_t *value,
                       struct host_error *error) {
    if (!host_scan_skip_blank_lines(s)) {
        return host_scan_fail(s, s->at, error,
                              "the file ends where a whole number is due; it "
                              "is cut short, get it whole");
    }
    const char *c = s->at;
    uint64_t n = 0;
    while (c < s->end && is_digit(*c) && n <= (UINT64_MAX - 9) / 10)
        n = 10 * n + (uint64_t)(*c++ - '0');
    if (c == s->at || (c < s->end && !is_blank(*c) && !is_end(*c))) {
        if (is_binary(s, error))
            return error->code;
        return host_scan_fail(s, s->at, error,
                              "a whole number is due here; correct it");
    }
    if (n > most) {
        return host_scan_fail(s, s->at, error,
                              "the number is larger than it can be here; "
                              "correct it");
    }
    *value = n;
    s->at = c;
    return 0;
}

/* --- Words ---------------------------------------------------------------- */

static size_t word_length(struct host_scan *s) {
    if (!host_scan_more(s))
        return 0;
    const char *c = s->at;
    while (c < s->end && !is_blank(*c) && !is_end(*c))
        c++;
    return (size_t)(c - s->at);
}

void host_scan_word(struct host_scan *s, char *word, size_t size) {
    size_t n = word_length(s);
    size_t kept = n < size ? n : size - 1;
    memcpy(word, s->at, kept);
    word[kept] = '\0';
    s->at += n;
}

bool host_scan_take(struct host_scan *s, const char *word) {
    size_t n = word_length(s);
    if (n != strlen(word) || strncasecmp(s->at, word, n) != 0)
        return false;
    s->at += n;
    return true;
}
