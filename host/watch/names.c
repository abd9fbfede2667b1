#include "names.h"

#include <string.h>

/* NODE_PROBE has nodes send to each other: that is not to look. */
static const char *const names[NODE_QUESTIONS + 1] = {
    [NODE_WHO] = "who",       [NODE_LINKS] = "links",   [NODE_TOP] = "top",
    [NODE_MEMORY] = "memory", [NODE_TOTALS] = "totals", [NODE_LOG] = "log"};

const char *host_look_name(enum node_question what) {
    return (unsigned)what <= NODE_QUESTIONS ? names[what] : NULL;
}

enum node_question host_look_question(const char *name) {
    for (unsigned i = 0; name != NULL && i <= NODE_QUESTIONS; i++) {
        if (names[i] != NULL && strcmp(names[i], name) == 0) {
            return (enum node_question)i;
        }
    }
    return (enum node_question)0;
}
