#include "fold.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SET_TEXT = 48, LINE = 1024, ROWS_FIRST = 16, TIME_TEXT = 32 };

/* Whether a time is of those of a row: all within 2 s and a tenth. */
static bool is_near(const struct host_fold_row *row, const uint32_t *time_s) {
    if (time_s == NULL || !row->timed) {
        return time_s == NULL && !row->timed;
    }
    uint32_t least = row->least < *time_s ? row->least : *time_s;
    uint32_t most = row->most > *time_s ? row->most : *time_s;
    return most - least <= 2 + least / 10;
}

static struct host_fold_row *row_of(struct host_fold *fold, bool of_host,
                                    const char *text, const uint32_t *time_s) {
    for (unsigned i = 0; i < fold->count; i++) {
        struct host_fold_row *row = &fold->row[i];
        if (row->of_host == of_host && strcmp(row->text, text) == 0 &&
            is_near(row, time_s)) {
            return row;
        }
    }
    if (fold->count == fold->room) {
        unsigned room = fold->room == 0 ? ROWS_FIRST : 2 * fold->room;
        struct host_fold_row *more =
            realloc(fold->row, room * sizeof fold->row[0]);
        if (more == NULL) {
            return NULL;
        }
        fold->row = more;
        fold->room = room;
    }
    struct host_fold_row *row = &fold->row[fold->count];
    memset(row, 0, sizeof *row);
    row->text = strdup(text);
    row->of_host = of_host;
    fold->count += row->text != NULL;
    return row->text == NULL ? NULL : row;
}

static struct host_fold_row *add(struct host_fold *fold, unsigned node,
                                 const char *text, const uint32_t *time_s) {
    bool of_host = node == CUBE_HOST;
    struct host_fold_row *row = row_of(fold, of_host, text, time_s);
    fold->broken = fold->broken || row == NULL;
    if (row != NULL && !of_host) {
        host_node_set_add(&row->set, node);
    }
    return row;
}

void host_fold_add(struct host_fold *fold, unsigned node, const char *text) {
    (void)add(fold, node, text, NULL);
}

void host_fold_add_timed(struct host_fold *fold, unsigned node,
                         const char *text, uint32_t time_s) {
    struct host_fold_row *row = add(fold, node, text, &time_s);
    if (row == NULL) {
        return;
    }
    row->least = row->timed && row->least < time_s ? row->least : time_s;
    row->most = row->timed && row->most > time_s ? row->most : time_s;
    row->timed = true;
}

/* "61-64 s", "2 min": in the unit that suits the least. */
static void put_times(const struct host_fold_row *row, char text[TIME_TEXT]) {
    uint32_t s = row->least < 60 ? 1 : row->least < 3600 ? 60 : 3600;
    const char *unit = s == 1 ? "s" : s == 60 ? "min" : "h";
    if (row->least / s == row->most / s) {
        snprintf(text, TIME_TEXT, "%" PRIu32 " %s", row->least / s, unit);
    } else {
        snprintf(text, TIME_TEXT, "%" PRIu32 "-%" PRIu32 " %s", row->least / s,
                 row->most / s, unit);
    }
}

static void name_row(const struct host_fold_row *row, char text[SET_TEXT]) {
    if (row->of_host) {
        snprintf(text, SET_TEXT, "host");
    } else {
        host_node_set_print(&row->set, text, SET_TEXT);
    }
}

/* Its lines, each behind four blanks. */
static void print_lines(const char *text,
                        void (*line)(void *context, const char *text),
                        void *context) {
    char whole[LINE];
    while (*text != '\0') {
        const char *end = strchrnul(text, '\n');
        snprintf(whole, sizeof whole, "    %.*s", (int)(end - text), text);
        line(context, whole);
        text = *end == '\0' ? end : end + 1;
    }
}

static void print_row(const struct host_fold_row *row, const char *set,
                      int width, char whole[LINE]) {
    char times[TIME_TEXT];
    const char *mark = row->timed ? strchr(row->text, HOST_FOLD_TIME) : NULL;
    if (mark == NULL) {
        snprintf(whole, LINE, "%-*s  %s", width, set, row->text);
        return;
    }
    put_times(row, times);
    snprintf(whole, LINE, "%-*s  %.*s%*s%s", width, set,
             (int)(mark - row->text), row->text, HOST_FOLD_TIME_WIDTH, times,
             mark + 1);
}

void host_fold_print(const struct host_fold *fold, const char *heading,
                     void (*line)(void *context, const char *text),
                     void *context) {
    char set[SET_TEXT], whole[LINE];
    int width = heading == NULL ? 0 : (int)strlen("NODES");
    for (unsigned i = 0; i < fold->count; i++) {
        name_row(&fold->row[i], set);
        width = (int)strlen(set) > width ? (int)strlen(set) : width;
    }
    if (heading != NULL) {
        snprintf(whole, sizeof whole, "%-*s  %s", width, "NODES", heading);
        line(context, whole);
    }
    for (unsigned i = 0; i < fold->count; i++) {
        const struct host_fold_row *row = &fold->row[i];
        name_row(row, set);
        if (strchr(row->text, '\n') != NULL) {
            snprintf(whole, sizeof whole, "%s:", set);
            line(context, whole);
            print_lines(row->text, line, context);
        } else {
            print_row(row, set, width, whole);
            line(context, whole);
        }
    }
}

void host_fold_free(struct host_fold *fold) {
    for (unsigned i = 0; i < fold->count; i++) {
        free(fold->row[i].text);
    }
    free(fold->row);
    memset(fold, 0, sizeof *fold);
}
