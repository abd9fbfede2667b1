#include "read_csv.h"

#include <string.h>
#include <strings.h>

/* What stands between two delimiters, without blanks and quotes around it. */
struct field {
    const char *first, *last;
};

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

static const char *line_end(const struct host_scan *s)
{
    const char *end = memchr(s->at, '\n', (size_t)(s->end - s->at));
    return end == NULL ? s->end : end;
}

/* Where the line begins whose first word is at hand: a first field may be
 * empty. */
static const char *line_begin(const struct host_scan *s)
{
    const char *at = s->at;
    while (at > s->start && at[-1] != '\0' &&
           strchr(" \t\r,;", at[-1]) != NULL) {
        at--;
    }
    return at;
}

/* Takes a field off the line; *at is NULL behind the last. */
static struct field next_field(const char **at, const char *end, char delimiter)
{
    bool quoted = false;
    const char *c = *at;
    while (c < end && is_blank(*c) && (delimiter == ' ' || *c != delimiter)) {
        c++;
    }
    struct field f = {c, c};
    for (; c < end && (quoted || *c != delimiter); c++) {
        quoted = quoted != (*c == '"');
    }
    *at = c < end ? c + 1 : NULL;
    while (delimiter == ' ' && *at != NULL && (*at == end || is_blank(**at))) {
        *at = *at < end ? *at + 1 : NULL; /* many are one */
    }
    while (c > f.first && is_blank(c[-1])) {
        c--;
    }
    f.last = c;
    if (c - f.first >= 2 && *f.first == '"' && c[-1] == '"') {
        f.first++;
        f.last--;
    }
    return f;
}

/* The first of these that is on the line out of quotes, or a blank. */
static char delimiter_of(const char *at, const char *end)
{
    static const char delimiters[] = ",;\t";
    for (const char *d = delimiters; *d != '\0'; d++) {
        bool quoted = false;
        for (const char *c = at; c < end; c++) {
            quoted = quoted != (*c == '"');
            if (*c == *d && !quoted) {
                return *d;
            }
        }
    }
    return ' ';
}

/* 0, 1, 2 for x, y, z, alone or with a unit after it; else 3. */
static unsigned axis_of(struct field f)
{
    while (f.first < f.last && is_blank(*f.first)) {
        f.first++;
    }
    if (f.first == f.last ||
        (f.last - f.first > 1 && strchr(" \t[({/", f.first[1]) == NULL)) {
        return 3;
    }
    char c = (char)(*f.first | 0x20);
    return c >= 'x' && c <= 'z' ? (unsigned)(c - 'x') : 3;
}

/* Whether a word begins like a number, or is one that is not finite: such a
 * line is a point that is wrong, and no header. */
static bool is_numeric(const char *word)
{
    static const char *const others[] = {"nan", "inf", "infinity"};
    bool quoted = word[0] == '"';
    size_t n = strlen(word += quoted);
    if (n > 0 && strchr("+-.0123456789", word[0]) != NULL) {
        return true;
    }
    n -= quoted && n > 0 && word[n - 1] == '"';
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        if (n == strlen(others[i]) && strncasecmp(word, others[i], n) == 0) {
            return true;
        }
    }
    return false;
}

/* Whether no word of the line is a number. */
static bool names_columns(struct host_scan s)
{
    while (host_scan_more(&s)) {
        char word[64];
        host_scan_word(&s, word, sizeof word);
        if (is_numeric(word)) {
            return false;
        }
    }
    return true;
}

int host_csv_header(struct host_csv *csv, struct host_scan *s,
                    struct host_error *error)
{
    unsigned found[4] = {0};
    *csv = (struct host_csv){.column = {0, 1, 2}};
    if (!host_scan_skip_blank_lines(s) || !names_columns(*s)) {
        return 0;
    }
    const char *at = line_begin(s), *end = line_end(s);
    csv->delimiter = delimiter_of(at, end);
    while (at != NULL) {
        struct field f = next_field(&at, end, csv->delimiter);
        unsigned axis = axis_of(f);
        found[axis]++;
        if (axis < 3) {
            csv->column[axis] = csv->fields;
        }
        csv->fields +=
            at != NULL || f.first < f.last; /* a last one is no more */
    }
    if (found[0] > 1 || found[1] > 1 || found[2] > 1) {
        return host_scan_fail(s, s->at, error,
                              "two columns are named x, y or z alike; rename "
                              "one");
    }
    if (found[0] + found[1] + found[2] < 3) {
        if (csv->fields != 3) {
            return host_scan_fail(s, s->at, error,
                                  "the names of columns are not three, and x, "
                                  "y and z are not among them; name the "
                                  "columns x, y and z");
        }
        memcpy(csv->column, (uint64_t[3]){0, 1, 2}, sizeof csv->column);
    }
    host_scan_next_line(s);
    return 0;
}

/* The number in a field, which is part of s. */
static int take_number(const struct host_scan *s, struct field f, double *value,
                       struct host_error *error)
{
    struct host_scan part = *s;
    part.at = f.first;
    part.end = f.last;
    if (host_scan_double(&part, value, error) != 0) {
        return error->code;
    }
    return host_scan_more(&part)
               ? host_scan_fail(&part, part.at, error,
                                "more than one number in a column; correct it")
               : 0;
}

int host_csv_row(const struct host_csv *csv, struct host_scan *s, double xyz[3],
                 struct host_error *error)
{
    const char *at = line_begin(s), *end = line_end(s);
    for (uint64_t i = 0; at != NULL; i++) {
        struct field f = next_field(&at, end, csv->delimiter);
        bool last = at == NULL;
        if (last && i == csv->fields && f.first == f.last) {
            break; /* a delimiter ends the line */
        }
        if (i >= csv->fields || (last && i + 1 < csv->fields)) {
            return host_scan_fail(s, f.first, error,
                                  "more or fewer columns than the first line "
                                  "names; correct this line or that");
        }
        for (int d = 0; d < 3; d++) {
            if (csv->column[d] == i && take_number(s, f, &xyz[d], error) != 0) {
                return error->code;
            }
        }
    }
    s->at = end;
    return 0;
}
