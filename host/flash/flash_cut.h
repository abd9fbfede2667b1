/* Ctrl-C, or another signal that ends the program, while boards are given an
 * image: the transfer ends at its next step, and the user is told what the
 * boards do now, and how to go on.  Then the program ends as by the signal; a
 * second one ends it at once.
 *
 * Memory: 4 KB of stack for a line.  Work: a pass over the nodes.
 *
 *     host_flash_cut_begin();
 *     if (host_flash_cut() != 0)
 *         host_flash_cut_tell(stderr, &spread, 1, words);
 *     host_flash_cut_end();
 *     host_flash_cut_finish();
 */
#ifndef HOST_FLASH_CUT_H
#define HOST_FLASH_CUT_H

#include <stdio.h>

#include "spread.h"

/* From here on signals are kept, and up to there. */
void host_flash_cut_begin(void);
void host_flash_cut_end(void);

/* The signal that came; 0: none has. */
int host_flash_cut(void);

/* argv: the command, argv[0] as "incode flash"; the same goes on. */
void host_flash_cut_tell(FILE *out, const struct host_spread *spread, int argc,
                         char *const *argv);

/* Returns where no signal came; else ends the program by it. */
void host_flash_cut_finish(void);

#endif
