/* What those who look on may ask, as look.h names it.
 *
 * Memory: none.  Work: a few comparisons.
 *
 *     enum node_question what = host_look_question("top");
 *     puts(host_look_name(what));
 */
#ifndef HOST_LOOK_NAMES_H
#define HOST_LOOK_NAMES_H

#include "node/questions.h"

/* Of a question's line, every second node of the largest cube named. */
enum { HOST_LOOK_QUESTION_BYTES = 4096 };

/* 0: no question by that name, or of NULL; NULL: it is not to be asked. */
enum node_question host_look_question(const char *name);
const char *host_look_name(enum node_question what);

#endif
