#include "fold.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SET_TEXT = 48, LINE = 1024, ROWS_FIRST = 16 };

static struct host_fold_row *row_of(struct host_fold *fold, bool of_host,
                                    const char *text)
{
    for (unsigned i = 0; i < fold->count; i++) {
        struct host_fold_row *row = &fold->row[i];
        if (row->of_host == of_host && strcmp(row->text, text) == 0) {
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

void host_fold_add(struct host_fold *fold, unsigned node, const char *text)
{
    bool of_host = node == CUBE_HOST;
    struct host_fold_row *row = row_of(fold, of_host, text);
    fold->broken = fold->broken || row == NULL;
    if (row != NULL && !of_host) {
        host_node_set_add(&row->set, node);
    }
}

static void name_row(const struct host_fold_row *row, char text[SET_TEXT])
{
    if (row->of_host) {
        snprintf(text, SET_TEXT, "host");
    } else {
        host_node_set_print(&row->set, text, SET_TEXT);
    }
}

/* Its lines, each behind four blanks. */
static void print_lines(const char *text,
                        void (*line)(void *context, const char *text),
                        void *context)
{
    char whole[LINE];
    while (*text != '\0') {
        const char *end = strchrnul(text, '\n');
        snprintf(whole, sizeof whole, "    %.*s", (int)(end - text), text);
        line(context, whole);
        text = *end == '\0' ? end : end + 1;
    }
}

void host_fold_print(const struct host_fold *fold, const char *heading,
                     void (*line)(void *context, const char *text),
                     void *context)
{
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
            snprintf(whole, sizeof whole, "%-*s  %s", width, set, row->text);
            line(context, whole);
        }
    }
}

void host_fold_free(struct host_fold *fold)
{
    for (unsigned i = 0; i < fold->count; i++) {
        free(fold->row[i].text);
    }
    free(fold->row);
    memset(fold, 0, sizeof *fold);
}
