/* The console as a person uses it, with nothing but a terminal: a line that is
 * typed is taken out of what UART 0 brings, and what is said goes between two
 * frames, as a record of console.h.  No frame is mistaken for a line: its
 * second byte is its kind (transport/PROTOCOL.md), which is no letter.  While
 * somebody types, and no frame comes, none is sent, for they are unreadable.
 */
#ifndef BOARDS_BARE_SHELL_H
#define BOARDS_BARE_SHELL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transport/link.h"

enum {
    BARE_SHELL_LINE = 31,   /* letters, at most */
    BARE_SHELL_LINES = 8,   /* that wait for an answer */
    BARE_SHELL_TEXT = 1024, /* that wait to be sent */
    BARE_SHELL_BYTES = 64,  /* that are read at a time */
    BARE_SHELL_SILENCE_US = 100000,
    BARE_SHELL_HUSH_US = 60000000
};

struct bare_shell {
    struct link_pipe beneath;
    enum { BARE_SHELL_BETWEEN, BARE_SHELL_TYPED, BARE_SHELL_FRAME } at;
    uint8_t held[BARE_SHELL_LINE]; /* what may become a line, */
    unsigned held_size;
    char line[BARE_SHELL_LINES][BARE_SHELL_LINE + 1]; /* and those that have */
    unsigned lines, lines_taken;                      /* so far */
    bool ended;                                       /* just now, by CR */
    uint8_t passed[BARE_SHELL_BYTES + BARE_SHELL_LINE + 1]; /* to the link, */
    unsigned passed_size, passed_taken;
    char said[BARE_SHELL_TEXT]; /* what waits to be sent, records and all, */
    unsigned said_size, said_sent;
    bool within;       /* a frame that the link has begun */
    uint64_t heard_us; /* the last byte, */
    uint64_t hush_us;  /* and until when no frame is sent */
};

void bare_shell_init(struct bare_shell *shell, struct link_pipe beneath);

/* The pipe beneath, without what is typed, and with what is said. */
struct link_pipe bare_shell_pipe(struct bare_shell *shell);

/* For a UART that no link reads: what comes is read, and frames are dropped. */
void bare_shell_alone(struct bare_shell *shell);

/* Sends what was said, where no frame is under way.  True: all was sent, and
 * here is a line, which was ended by CR or LF; an empty one too. */
bool bare_shell_line(struct bare_shell *shell, char line[BARE_SHELL_LINE + 1],
                     uint64_t now_us);

/* A record more; what finds no room is dropped, from its end. */
void bare_shell_say(struct bare_shell *shell, const char *text);

#endif
