/* The line on the terminal that shows how far a command is: what it is at, a
 * bar, its rate and the time that is left, cut to the terminal's width.  There
 * is one terminal, so there is one line, and whatever else is said on standard
 * error goes through host_note.  No line where standard error is no terminal.
 *
 * Instead of the line there may be a table, a row for each of those that are at
 * it side by side.
 *
 * Memory: a screen of text, 17 KiB of stack to draw it.  Work: one at most ten
 * times a second; else one look at the clock. */
#ifndef HOST_PROGRESS_H
#define HOST_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

/* wanted: false for quiet. */
void host_progress_begin(bool wanted);

/* The same if standard error is no terminal: a line of progress every three
 * seconds. */
void host_progress_begin_anywhere(void);

/* What is done from now on, shown at once.  unit: of a million of what is
 * counted, as "MB"; NULL where nothing is.  Both have to stay.  Nothing happens
 * where no line has begun, so that each room may say what it does. */
void host_progress_phase(const char *what, const char *unit);

/* done of total (0: nobody knows), and the amount that is counted. */
void host_progress_show(uint64_t done, uint64_t total, uint64_t amount);

/* So much more in this phase, of which nobody knows the total. */
void host_progress_add(uint64_t amount);

/* The rows that a table may have here; 0: there is none where the program is
 * quiet, or standard error no terminal. */
unsigned host_progress_rows_max(void);

/* A table of so many rows instead of the line, 0: the line again; and one of
 * its rows: of whom, a bar of what is done, 0 to 1 (below 0: no bar), and what
 * else is to be said.  host_progress_draw shows it. */
void host_progress_rows(unsigned rows);
void host_progress_row(unsigned row, const char *head, double part,
                       const char *tail);
void host_progress_draw(void);

/* Takes the line away: for good; until the next time, also in a handler of
 * signals. */
void host_progress_end(void);
void host_progress_erase(void);

/* Prints "incode: " and the text, made printable, as a line of its own on
 * standard error, with the bar beneath it again. */
void host_note(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* From now on notes go there, made printable, for who has more on the terminal
 * than this line; NULL: no more. */
void host_note_to(void (*take)(const char *text));

#endif
