/* What a board says to a person, on the wire that also carries the frames of
 * its link: a record is 00 FF text 00.  One who reads frames drops it, as no
 * frame begins with FF and ends in such text; a terminal shows the text.
 *
 * Work: waits for the UART, 100 ms a byte at most, and gives up at the first
 * that is not taken. */
#ifndef BOARDS_BARE_CONSOLE_H
#define BOARDS_BARE_CONSOLE_H

enum { BARE_CONSOLE_MARK = 0xff };

void bare_console_begin(void);
void bare_console_put(const char *text);
void bare_console_end(void);

#endif
