#include "options.h"

#include <argp.h>
#include <assert.h>
#include <getopt.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "text.h"

enum {
    KEY_ANSWER = 1, /* by argp, which ends the program */
    KEY_LONG = 256, /* and beyond, a row's */
    SHORT_MAX = 3 * HOST_OPTIONS_MAX + 8,
    NAMES_MAX = 160
};

/* The rows of a command, as getopt and argp have them. */
struct table {
    const struct host_option *row[HOST_OPTIONS_MAX];
    unsigned rows, more; /* of them before the command's own */
    struct option name[HOST_OPTIONS_MAX + 4];
    char letters[SHORT_MAX];
    struct argp_option help[HOST_OPTIONS_MAX + 1];
};

static bool is_last(const struct host_option *row) {
    return row->name == NULL && row->help == NULL;
}

/* Headings begin a group, and argp prints one after the other. */
static void add_rows(struct table *t, const struct host_option *row) {
    int group = t->rows == 0 ? 0 : t->help[t->rows - 1].group;
    for (; row != NULL && !is_last(row); row++) {
        unsigned i = t->rows++;
        assert(i < HOST_OPTIONS_MAX);
        group += row->name == NULL ? 1 : 0;
        int key = row->name == NULL  ? 0
                  : row->letter != 0 ? row->letter
                                     : KEY_LONG + (int)i;
        t->row[i] = row;
        t->help[i] = (struct argp_option){
            row->name,     key,
            row->argument, row->omitted == NULL ? 0 : OPTION_ARG_OPTIONAL,
            row->help,     group};
    }
}

static void fill_table(struct table *t, const struct host_options *options) {
    static const char *const answered[] = {"help", "usage", "version"};
    size_t n = 0, letters = 0;
    memset(t, 0, sizeof *t);
    add_rows(t, options->more);
    t->more = t->rows;
    add_rows(t, options->rows);
    if (options->first)
        t->letters[letters++] = '+';
    t->letters[letters++] = ':';
    t->letters[letters++] = 'V';
    t->letters[letters++] = 'h';
    for (unsigned i = 0; i < t->rows; i++) {
        const struct host_option *row = t->row[i];
        int value = row->argument == NULL  ? no_argument
                    : row->omitted != NULL ? optional_argument
                                           : required_argument;
        if (row->name == NULL)
            continue;
        t->name[n++] =
            (struct option){row->name, value, NULL, KEY_LONG + (int)i};
        if (row->letter != 0) {
            t->letters[letters++] = row->letter;
            for (int colons = 0; colons < value; colons++) /* or two */
                t->letters[letters++] = ':';
        }
    }
    /* A command may have one of these names itself, as sign has --version. */
    size_t own = n;
    for (size_t i = 0; i < sizeof answered / sizeof answered[0]; i++) {
        size_t k = 0;
        while (k < own && strcmp(t->name[k].name, answered[i]) != 0)
            k++;
        if (k == own)
            t->name[n++] = (struct option){answered[i], 0, NULL, KEY_ANSWER};
    }
}

/* The options that begin with `word`, as a list; how many there are. */
static unsigned begin_with(const struct table *t, const char *word,
                           char list[NAMES_MAX]) {
    unsigned count = 0;
    size_t used = 0;
    list[0] = '\0';
    for (const struct option *o = t->name; o->name != NULL; o++) {
        if (strncmp(o->name, word, strlen(word)) == 0 && used < NAMES_MAX) {
            used += (size_t)snprintf(list + used, NAMES_MAX - used, "%s--%s",
                                     count++ == 0 ? "" : " or ", o->name);
        }
    }
    return count;
}

static const char *name_of(const void *table, unsigned i) {
    return ((const struct table *)table)->name[i].name;
}

static int refuse_long(const struct table *t, const char *command,
                       const char *word, bool known, struct host_error *error) {
    char list[NAMES_MAX], name[NAMES_MAX];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(word + 2, "="), word + 2);
    const char *nearest = host_text_nearest(name, name_of, t);
    if (known) {
        return host_fail(error, HOST_USAGE,
                         "%s: an option of %s that takes no value; write --%s",
                         word, command, name);
    }
    if (begin_with(t, name, list) > 1) {
        return host_fail(error, HOST_USAGE,
                         "--%s: more than one option of %s; write %s", name,
                         command, list);
    }
    return nearest == NULL
               ? host_fail(error, HOST_USAGE,
                           "--%s: no such option of %s; see %s --help", name,
                           command, command)
               : host_fail(error, HOST_USAGE,
                           "--%s: no such option of %s; did you mean --%s?",
                           name, command, nearest);
}

/* Somebody may have written -nodes. */
static int refuse_letter(const struct table *t, const char *command,
                         const char *word, int letter,
                         struct host_error *error) {
    const char *nearest =
        strlen(word) < 4 ? NULL : host_text_nearest(word + 1, name_of, t);
    return nearest == NULL
               ? host_fail(error, HOST_USAGE,
                           "-%c: no such option of %s; see %s --help", letter,
                           command, command)
               : host_fail(error, HOST_USAGE,
                           "%s: no such option of %s; did you mean --%s?", word,
                           command, nearest);
}

/* Where getopt has found none that it knows. */
static int refuse(const struct table *t, char **argv,
                  struct host_error *error) {
    const char *word = argv[optind - 1], *next = argv[optind];
    if (optopt == 0 || optopt >= KEY_LONG || optopt == KEY_ANSWER)
        return refuse_long(t, argv[0], word, optopt != 0, error);
    /* Before the last letter of a word, it is still at that word. */
    if (next != NULL && next[0] == '-' && next[1] != '-' &&
        strchr(next, optopt) != NULL)
        word = next;
    return refuse_letter(t, argv[0], word, optopt, error);
}

/* The path of README.md as make install has put it; false: this program is not
 * installed. */
static bool find_readme(char path[PATH_MAX]) {
    static const char readme[] = "/../share/doc/incode/README.md";
    ssize_t n = readlink("/proc/self/exe", path, PATH_MAX - sizeof readme);
    if (n <= 0)
        return false;
    path[n] = '\0';
    *strrchr(path, '/') = '\0';
    strcat(path, readme);
    char *whole = realpath(path, NULL);
    snprintf(path, PATH_MAX, "%s", whole == NULL ? "" : whole);
    free(whole);
    return path[0] != '\0';
}

/* Whose help it is, and argp's filter of its texts. */
static const struct host_options *helped;
static const struct table *helped_table;

/* Each text as it is, or longer, and to be freed. */
static char *longer(int key, const char *text) {
    if (key == ARGP_KEY_HELP_POST_DOC)
        return helped->fill == NULL ? (char *)text : helped->fill(text);
    for (unsigned i = 0; i < helped_table->rows; i++)
        if (helped_table->help[i].key == key && key != 0 &&
            helped_table->row[i]->fill != NULL)
            return helped_table->row[i]->fill(text);
    return (char *)text;
}

/* The same, with the path of README.md. */
static char *name_readme(int key, const char *text, void *input) {
    static const char name[] = "README.md";
    char *mine = longer(key, text);
    char path[PATH_MAX], *whole = NULL;
    char *at = mine == NULL ? NULL : strstr(mine, name);
    (void)input;
    if (at == NULL || !find_readme(path) ||
        asprintf(&whole, "%.*s%s%s", (int)(at - mine), mine, path,
                 at + strlen(name)) < 0)
        return mine;
    if (mine != text)
        free(mine);
    return whole;
}

/* --help and its kin, which argp answers: it ends the program. */
static int answer(const struct host_options *options, const struct table *t,
                  char **argv, const char *word, bool silent,
                  struct host_error *error) {
    const struct argp argp = {t->rows == 0 ? NULL : t->help,
                              NULL,
                              options->arguments,
                              options->about,
                              NULL,
                              name_readme,
                              NULL};
    char text[16];
    char *words[] = {argv[0], text, NULL};
    snprintf(text, sizeof text, "%s", word);
    helped = options;
    helped_table = t;
    if (!silent)
        (void)argp_parse(&argp, 2, words, 0, NULL, NULL);
    return host_fail(error, HOST_USAGE,
                     "%s: no help is given here; leave it out", word);
}

/* --- values --------------------------------------------------------------- */

static void take_row(const struct host_option *row, void *into,
                     const char *value, struct host_error *error) {
    char *member = (char *)into + row->at;
    uint64_t n = 0;
    int named = 0;
    if (value == NULL)
        value = row->omitted;
    if (row->take != NULL) {
        row->take(into, value, error);
        return;
    }
    if (row->names != NULL) {
        named = host_option_choose(row->name, value, row->names, error);
        if (named < 0)
            return;
    } else if (row->powers != NULL) {
        char option[NAMES_MAX];
        unsigned nodes = 0;
        snprintf(option, sizeof option, "--%s", row->name);
        if (host_parse_nodes(option, value, (unsigned)row->most, row->powers,
                             &nodes, error) != 0)
            return;
        n = nodes;
    } else if (row->bytes != NULL) {
        if (host_parse_bytes(value, &n) != 0 || n < row->least) {
            host_fail(error, HOST_USAGE,
                      "--%s %s: not a size of memory that is allowed; %s",
                      row->name, value, row->bytes);
            return;
        }
    } else if (row->kind == HOST_OPTION_NUMBER ||
               row->kind == HOST_OPTION_UNSIGNED) {
        if (host_option_number(row->name, value, row->least, row->most, &n,
                               error) != 0)
            return;
        n *= row->unit == 0 ? 1 : row->unit;
    }
    switch (row->kind) {
    case HOST_OPTION_FLAG:
        *(bool *)(void *)member = true;
        return;
    case HOST_OPTION_TEXT:
        *(const char **)(void *)member = value;
        return;
    case HOST_OPTION_NUMBER:
        *(uint64_t *)(void *)member = n;
        return;
    case HOST_OPTION_UNSIGNED:
        *(unsigned *)(void *)member =
            row->names == NULL ? (unsigned)n : (unsigned)named;
        return;
    case HOST_OPTION_TAKEN:
        assert(row->take != NULL);
    }
}

static int take_arguments(const struct host_options *o, int argc, char **argv,
                          void *into, struct host_error *error) {
    const char **one = (const char **)(void *)((char *)into + o->one_at);
    if (o->first && optind < argc)
        *(int *)into = optind;
    for (int i = optind; i < argc && !o->first && error->code == 0; i++) {
        if (o->argument != NULL) {
            o->argument(into, argv[i], error);
        } else if (o->one == NULL) {
            host_fail(error, HOST_USAGE, "%s: %s", argv[i], o->refusal);
        } else if (*one != NULL) {
            host_fail(error, HOST_USAGE,
                      "%s: one argument too many; give %s alone", argv[i],
                      o->one);
        } else {
            *one = argv[i];
        }
    }
    if (error->code == 0 && o->needed && *one == NULL) {
        host_fail(error, HOST_USAGE, "%s: not given; give its file, see --help",
                  o->one);
    }
    return error->code;
}

int host_options_parse(const struct host_options *options, int argc,
                       char **argv, bool silent, void *into, uint64_t *given,
                       struct host_error *error) {
    struct table table;
    uint64_t bits = 0;
    int found;
    fill_table(&table, options);
    optind = 0; /* GNU's way to begin anew */
    opterr = 0;
    while (optopt = 0, (found = getopt_long(argc, argv, table.letters,
                                            table.name, NULL)) != -1) {
        unsigned i = 0;
        if (found == ':') {
            return host_fail(error, HOST_USAGE,
                             "%s: wants a value; see %s --help",
                             argv[optind - 1], argv[0]);
        }
        if (found == 'h' || (found == '?' && optopt == '?'))
            return answer(options, &table, argv, "--help", silent, error);
        if (found == KEY_ANSWER || found == 'V') {
            return answer(options, &table, argv,
                          found == 'V' ? "--version" : argv[optind - 1], silent,
                          error);
        }
        if (found == '?')
            return refuse(&table, argv, error);
        const struct host_option *row = table.row[0];
        while (assert(row != NULL),
               found != KEY_LONG + (int)i && found != row->letter)
            row = table.row[++i];
        bool more = i < table.more;
        take_row(row, (char *)into + (more ? options->more_at : 0), optarg,
                 error);
        if (error->code != 0)
            return error->code;
        bits |= more ? 0 : UINT64_C(1) << (i - table.more);
    }
    if (given != NULL)
        *given = bits;
    return error->code != 0 ? error->code
                            : take_arguments(options, argc, argv, into, error);
}

bool host_option_given(const struct host_option *rows, uint64_t given,
                       const char *name) {
    unsigned i = 0;
    while (rows[i].name == NULL || strcmp(rows[i].name, name) != 0) {
        assert(!is_last(&rows[i]));
        i++;
    }
    return (given >> i & 1) != 0;
}

int host_option_number(const char *option, const char *value, uint64_t least,
                       uint64_t most, uint64_t *number,
                       struct host_error *error) {
    if (host_parse_number(value, least, most, number) == 0)
        return 0;
    return most == UINT64_MAX
               ? host_fail(error, HOST_USAGE,
                           "--%s %s: not a number; give %llu or more", option,
                           value, (unsigned long long)least)
               : host_fail(error, HOST_USAGE,
                           "--%s %s: not a number that is allowed; give %llu "
                           "to %llu",
                           option, value, (unsigned long long)least,
                           (unsigned long long)most);
}

static const char *name_at(const void *context, unsigned i) {
    return (*(host_row_name *const *)context)(i);
}

int host_option_choose(const char *option, const char *value,
                       host_row_name *names, struct host_error *error) {
    char allowed[sizeof error->text] = "";
    size_t used = 0;
    for (unsigned i = 0; names(i) != NULL; i++) {
        if (strcmp(value, names(i)) == 0)
            return (int)i;
        if (used < sizeof allowed) { /* what the error has room for */
            used += (size_t)snprintf(allowed + used, sizeof allowed - used,
                                     "%s%s", i == 0 ? "" : ", ", names(i));
        }
    }
    const char *nearest = host_text_nearest(value, name_at, &names);
    host_fail(error, HOST_USAGE, "--%s %s: no such name; %s%s%sallowed: %s",
              option, value, nearest == NULL ? "" : "did you mean ",
              nearest == NULL ? "" : nearest, nearest == NULL ? "" : "? ",
              allowed);
    return -1;
}
