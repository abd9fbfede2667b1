#include "csv.h"

#include <string.h>
#include <strings.h>

/* What stands between two delimiters, without blanks and quotes around it. */
struct field {
    const char *first, *last;
};

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r';
}

static bool is_mark(char c) {
    return c == ',' || c == ';';
}

static bool begins_number(char c) {
    return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.';
}

static const char *line_end(const struct host_scan *s) {
    const char *end = memchr(s->at, '\n', (size_t)(s->end - s->at));
    return end == NULL ? s->end : end;
}

/* Where the line begins whose first word is at hand: a first field may be
 * empty. */
static const char *line_begin(const struct host_scan *s) {
    const char *at = s->at;
    while (at > s->start && (is_blank(at[-1]) || is_mark(at[-1])))
        at--;
    return at;
}

bool host_csv_begins_empty(const struct host_scan *s) {
    const char *at = s->at;
    while (at > s->start && is_blank(at[-1]))
        at--;
    return at > s->start && is_mark(at[-1]);
}

/* Where blanks part fields, any of them does. */
static bool is_delimiter(char c, char delimiter) {
    return c == delimiter || (delimiter == ' ' && is_blank(c));
}

static const char *skip_blanks(const char *c, const char *end, char delimiter) {
    while (c < end && is_blank(*c) && (delimiter == ' ' || *c != delimiter))
        c++;
    return c;
}

/* Where the field behind the one that ends at c begins; NULL: nowhere. */
static const char *behind(const char *c, const char *end, char delimiter) {
    if (c == end)
        return NULL;
    c++;
    if (delimiter == ' ') { /* many are one */
        c = skip_blanks(c, end, delimiter);
        return c == end ? NULL : c;
    }
    return c;
}

/* Takes a field off the line; *at is NULL behind the last. */
static struct field next_field(const char **at, const char *end,
                               char delimiter) {
    bool quoted = false;
    const char *c = skip_blanks(*at, end, delimiter);
    struct field f = {c, c};
    for (; c < end && (quoted || !is_delimiter(*c, delimiter)); c++)
        quoted = quoted != (*c == '"');
    *at = behind(c, end, delimiter);
    while (c > f.first && is_blank(c[-1]))
        c--;
    f.last = c;
    if (c - f.first >= 2 && *f.first == '"' && c[-1] == '"') {
        f.first++;
        f.last--;
    }
    return f;
}

/* The first of these that is on the line out of quotes, or a blank. */
static char delimiter_of(const char *at, const char *end) {
    static const char delimiters[] = ",;\t";
    for (const char *d = delimiters; *d != '\0'; d++) {
        bool quoted = false;
        for (const char *c = at; c < end; c++) {
            quoted = quoted != (*c == '"');
            if (*c == *d && !quoted)
                return *d;
        }
    }
    return ' ';
}

/* 0, 1, 2 for x, y, z, alone or with a unit after it; else 3. */
static unsigned axis_of(struct field f) {
    while (f.first < f.last && is_blank(*f.first))
        f.first++;
    if (f.first == f.last ||
        (f.last - f.first > 1 && strchr(" \t[({/", f.first[1]) == NULL))
        return 3;
    char c = (char)(*f.first | 0x20);
    return c >= 'x' && c <= 'z' ? (unsigned)(c - 'x') : 3;
}

/* Whether a word begins like a number, or is one that is not finite: such a
 * line is a point that is wrong, and no header. */
static bool is_numeric(const char *word) {
    static const char *const others[] = {"nan", "inf", "infinity"};
    bool quoted = word[0] == '"';
    size_t n = strlen(word += quoted);
    if (begins_number(word[0]))
        return true;
    n -= quoted && n > 0 && word[n - 1] == '"';
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        if (n == strlen(others[i]) && strncasecmp(word, others[i], n) == 0)
            return true;
    return false;
}

/* Whether no word of the line is a number. */
static bool names_columns(struct host_scan s) {
    while (host_scan_more(&s)) {
        char word[64];
        host_scan_word(&s, word, sizeof word);
        if (is_numeric(word))
            return false;
    }
    return true;
}

int host_csv_header(struct host_csv *csv, struct host_scan *s,
                    struct host_error *error) {
    unsigned found[4] = {0};
    *csv = (struct host_csv){.column = {0, 1, 2}};
    if (!host_scan_skip_blank_lines(s) || !names_columns(*s))
        return 0;
    const char *at = line_begin(s), *end = line_end(s);
    csv->delimiter = delimiter_of(at, end);
    while (at != NULL) {
        struct field f = next_field(&at, end, csv->delimiter);
        unsigned axis = axis_of(f);
        found[axis]++;
        if (axis < 3)
            csv->column[axis] = csv->fields;
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
                                  "columns x, y and z, or put # before a line "
                                  "that names none");
        }
        memcpy(csv->column, (uint64_t[3]){0, 1, 2}, sizeof csv->column);
    }
    host_scan_next_line(s);
    return 0;
}

/* The number in the field at *at, which is part of s.  Goes to the next field;
 * behind the last, or a comment, *at is NULL. */
static int take_number(const struct host_scan *s, const char **at,
                       const char *end, char delimiter, double *value,
                       struct host_error *error) {
    struct host_scan part = *s;
    part.at = skip_blanks(*at, end, delimiter);
    part.end = end;
    if (part.at < end && begins_number(*part.at)) {
        if (host_scan_double(&part, value, error) != 0)
            return error->code;
        const char *c = part.at;
        while (c < end && is_blank(*c) && !is_delimiter(*c, delimiter))
            c++;
        if (c == end || *c == '#' || is_delimiter(*c, delimiter)) {
            *at = c < end && *c == '#' ? NULL : behind(c, end, delimiter);
            return 0;
        }
    }
    struct field f = next_field(at, end, delimiter);
    part.at = f.first;
    part.end = f.last;
    if (f.first == f.last)
        return host_scan_fail(s, f.first, error, HOST_CSV_EMPTY);
    if (host_scan_double(&part, value, error) != 0)
        return error->code;
    return host_scan_more(&part)
               ? host_scan_fail(&part, part.at, error,
                                "more than one number in a column; correct "
                                "it, and write decimal points where the comma "
                                "is a decimal one")
               : 0;
}

/* Whether what stands at `at`, behind the last column, is none more: a comment,
 * or nothing behind a delimiter that ends the line. */
static bool is_end(const char *at, const char *end, char delimiter) {
    struct field f = next_field(&at, end, delimiter);
    return f.first == f.last ? at == NULL : *f.first == '#';
}

int host_csv_row(const struct host_csv *csv, struct host_scan *s, double xyz[3],
                 struct host_error *error) {
    const char *at = line_begin(s), *end = line_end(s), *field = at;
    char delimiter = csv->delimiter;
    uint64_t columns = 0;
    if (memchr(at, delimiter, (size_t)(end - at)) == NULL)
        delimiter = delimiter_of(at, end); /* rows may have one of their own */
    for (; at != NULL && columns < csv->fields; columns++) {
        unsigned d = 0;
        field = at;
        while (d < 3 && csv->column[d] != columns)
            d++;
        if (d == 3)
            (void)next_field(&at, end, delimiter);
        else if (take_number(s, &at, end, delimiter, &xyz[d], error) != 0)
            return error->code;
    }
    if (columns < csv->fields || (at != NULL && !is_end(at, end, delimiter))) {
        return host_scan_fail(s, at == NULL ? field : at, error,
                              "more or fewer columns than the first line "
                              "names; correct this line or that");
    }
    s->at = end;
    return 0;
}
