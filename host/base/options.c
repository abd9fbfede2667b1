#include "options.h"

#include <assert.h>
#include <getopt.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "text.h"

enum {
    KEY_ANSWER = 1,
    KEY_LONG = 256, /* and beyond: getopt takes names of one key for one */
    SHORT_MAX = 3 * HOST_OPTIONS_MAX + 8,
    NAMES_MAX = 160
};

/* A table as getopt has it. */
struct table {
    struct option name[HOST_OPTIONS_MAX + 4];
    char letters[SHORT_MAX];
};

static void fill(struct table *t, const struct argp_option *options,
                 unsigned flags) {
    /* Those that argp answers, and ends the program. */
    static const char *const answered[] = {"help", "usage", "version"};
    size_t n = 0, letters = 0;
    memset(t, 0, sizeof *t);
    if ((flags & ARGP_IN_ORDER) != 0)
        t->letters[letters++] = '+';
    t->letters[letters++] = ':';
    t->letters[letters++] = 'V';
    t->letters[letters++] = 'h';
    for (; n < sizeof answered / sizeof answered[0]; n++)
        t->name[n] = (struct option){answered[n], 0, NULL, KEY_ANSWER};
    for (size_t i = 0; options != NULL; i++) {
        const struct argp_option *o = &options[i];
        if (o->name == NULL && o->key == 0 && o->doc == NULL)
            break;
        assert(i < HOST_OPTIONS_MAX - 1);
        int value = o->arg == NULL                          ? no_argument
                    : (o->flags & OPTION_ARG_OPTIONAL) != 0 ? optional_argument
                                                            : required_argument;
        if (o->name != NULL) {
            t->name[n++] =
                (struct option){o->name, value, NULL, KEY_LONG + (int)i};
        }
        if (o->key > ' ' && o->key < 0x7f) {
            t->letters[letters++] = (char)o->key;
            for (int colons = 0; colons < value; colons++) /* or two */
                t->letters[letters++] = ':';
        }
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

static char *(*filter_of_table)(int key, const char *text, void *input);

/* A filter of argp's help text: gives the path of README.md. */
static char *name_readme(int key, const char *text, void *input) {
    static const char name[] = "README.md";
    char *mine = filter_of_table == NULL ? (char *)text
                                         : filter_of_table(key, text, input);
    char path[PATH_MAX], *whole = NULL;
    char *at = mine == NULL ? NULL : strstr(mine, name);
    if (at == NULL || !find_readme(path) ||
        asprintf(&whole, "%.*s%s%s", (int)(at - mine), mine, path,
                 at + strlen(name)) < 0)
        return mine;
    if (mine != text)
        free(mine);
    return whole;
}

/* Ends the program, as --help does, unless argp is not to. */
static void answer_help(const struct argp *argp, char *command, unsigned flags,
                        void *input) {
    static char help[] = "--help";
    char *words[] = {command, help, NULL};
    if ((flags & ARGP_NO_HELP) == 0)
        (void)argp_parse(argp, 2, words, 0, NULL, input);
}

/* What getopt, which argp works with, would say of itself. */
static int check(const struct argp *argp, int argc, char **argv, unsigned flags,
                 void *input, struct host_error *error) {
    struct table table;
    int found;
    fill(&table, argp->options, flags);
    optind = 0; /* GNU's way to begin anew */
    opterr = 0;
    do {
        optopt = 0;
        found = getopt_long(argc, argv, table.letters, table.name, NULL);
        if (found == ':') {
            return host_fail(error, HOST_USAGE,
                             "%s: wants a value; see %s --help",
                             argv[optind - 1], argv[0]);
        }
        if (found == 'h') {
            answer_help(argp, argv[0], flags, input);
            return -1;
        }
        if (found == '?' && optopt == '?')
            break;
        if (found == '?')
            return refuse(&table, argv, error);
    } while (found != -1 && found != KEY_ANSWER && found != 'V');
    return 0;
}

int host_options_parse(const struct argp *argp, int argc, char **argv,
                       unsigned flags, void *input, struct host_error *error) {
    struct argp named = *argp;
    filter_of_table = argp->help_filter;
    named.help_filter = name_readme;
    int status = check(&named, argc, argv, flags, input, error);
    if (status == 0 &&
        argp_parse(&named, argc, argv, flags, NULL, input) != 0) {
        status = host_fail(error, HOST_USAGE, "%s: wrong usage; see %s --help",
                           argv[0], argv[0]);
    }
    return status != 0 ? status : error->code;
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

int host_option_argument(int key, const char *name, const char *value,
                         const char **argument, struct host_error *error) {
    if (key == ARGP_KEY_END) {
        return *argument != NULL
                   ? 0
                   : host_fail(error, HOST_USAGE,
                               "%s: not given; give its file, see --help",
                               name);
    }
    if (*argument != NULL) {
        return host_fail(error, HOST_USAGE,
                         "%s: one argument too many; give %s alone", value,
                         name);
    }
    *argument = value;
    return 0;
}
