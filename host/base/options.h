/* The options of a command, from one table: where each value goes, and what
 * --help says of it.  Whatever is wrong is a host_error, which names the option
 * that may have been meant.
 *
 * Memory: 24 KB of stack. */
#ifndef HOST_OPTIONS_H
#define HOST_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"

enum { HOST_OPTIONS_MAX = 64 }; /* rows of a command, headings included */

enum host_option_kind {
    HOST_OPTION_TAKEN,   /* by the row's `take` */
    HOST_OPTION_FLAG,    /* bool: becomes true */
    HOST_OPTION_TEXT,    /* const char * */
    HOST_OPTION_NUMBER,  /* uint64_t */
    HOST_OPTION_UNSIGNED /* unsigned, or an enum */
};

/* Takes a value for `into`, the struct of a command's options; value: NULL
 * where the option has none.  Tells what is wrong with host_fail. */
typedef void host_take(void *into, const char *value, struct host_error *error);

/* Row i of what an option may name; NULL past the last. */
typedef const char *host_row_name(unsigned i);

struct host_option {
    const char *name;     /* NULL: a heading.  The last row is {0}. */
    char letter;          /* as in -o; 0: none */
    const char *argument; /* as --help names it; NULL: it takes none */
    const char *help;
    enum host_option_kind kind; /* by HOST_AT, as is */
    size_t at;                  /* of the member in the command's struct */
    uint64_t least, most;       /* of a number */
    uint64_t unit;              /* a number is multiplied by it; 0: by 1 */
    const char *bytes;          /* a number of bytes, `least` or more, as 2G;
                                   what an error says to give; or NULL */
    host_row_name *names;       /* an unsigned is the index of one of these */
    const char *powers;         /* an unsigned is a power of two up to `most`;
                                   what an error says behind them; or NULL */
    const char *omitted;        /* the value without an argument; NULL: the
                                   argument may not be left out */
    host_take *take;            /* takes the value instead */
    char *(*fill)(const char *text); /* makes `help` longer, by malloc */
};

/* Is nowhere: HOST_AT asks for the type of what would be there. */
extern char host_option_nowhere[];

/* Of a row: the member that its value goes to. */
#define HOST_AT(type, member)                                                  \
    .at = offsetof(type, member),                                              \
    .kind = _Generic(((type *)(void *)host_option_nowhere)->member,            \
                     bool: HOST_OPTION_FLAG, const char *: HOST_OPTION_TEXT,   \
                     uint64_t: HOST_OPTION_NUMBER,                             \
                     unsigned: HOST_OPTION_UNSIGNED)

struct host_options {
    const struct host_option *rows; /* NULL: none */
    /* Rows that --help prints before them, or NULL.  Their struct is at
     * `more_at` of the command's. */
    const struct host_option *more;
    size_t more_at;
    const char *arguments;           /* as --help names them */
    const char *about;               /* behind \v: below the options */
    char *(*fill)(const char *text); /* makes that part longer, by malloc */
    /* A command takes arguments in one of four ways.  First: it takes one,
     * whose name is `one` and which goes to the const char * at `one_at`. */
    const char *one;
    size_t one_at;
    bool needed; /* that one may not be left out */
    /* Second: `argument` takes each, in order. */
    host_take *argument;
    /* Third: the options end before the first argument, whose index in argv
     * becomes the command's struct, an int. */
    bool first;
    /* Fourth: it takes none; an error says "ARGUMENT: REFUSAL". */
    const char *refusal;
};

/* argv[0] is the name for messages ("incode run"), and argv is put in order:
 * options before arguments.  silent: --help prints nothing, and is an error.
 * given: NULL, or bits of the rows that were given.  Not 0: the command ends
 * now with error->code.  --help, -h, --usage and --version end the program
 * themselves.  If this program is installed, --help names README.md by the path
 * of the installed one. */
int host_options_parse(const struct host_options *options, int argc,
                       char **argv, bool silent, void *into, uint64_t *given,
                       struct host_error *error);

/* Whether the row of that name was. */
bool host_option_given(const struct host_option *rows, uint64_t given,
                       const char *name);

/* For `take`: the value of --`option`, a whole number from least to most as
 * host_parse_number has it.  0, or HOST_USAGE: *number stays as it is. */
int host_option_number(const char *option, const char *value, uint64_t least,
                       uint64_t most, uint64_t *number,
                       struct host_error *error);

/* For `take`: which of the rows the value is, or -1 with the error: what is
 * allowed, and what may have been meant. */
int host_option_choose(const char *option, const char *value,
                       host_row_name *names, struct host_error *error);

#endif
