#include "fault.h"

#include <stddef.h>
#include <string.h>
#include <unistd.h>

#include "transport/text.h"

/* A value may be as long as a path: what is wrong with it comes after it. */
enum { LINE_BYTES = 1024, PART_BYTES = 400 };

static void put(struct cube_text *line, const char *before, const char *words) {
    char part[PART_BYTES];
    struct cube_text printable = cube_text_in(part, sizeof part);
    if (words != NULL) {
        cube_text_printable(&printable, words);
        cube_text_put(line, before);
        cube_text_put(line, part);
    }
}

void fault_print(const struct linux_fault *fault) {
    char text[LINE_BYTES];
    struct cube_text line = cube_text_in(text, sizeof text - 1);
    put(&line, "incode-node: ", fault->where);
    put(&line, " ", fault->value);
    put(&line, ": ", fault->what);
    put(&line, ": ", fault->reason == 0 ? NULL : strerror(fault->reason));
    put(&line, "; ", fault->next);
    text[line.size] = '\n';
    (void)!write(STDERR_FILENO, text, line.size + 1);
}
