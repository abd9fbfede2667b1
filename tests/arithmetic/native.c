/* Answers as a board does (talk.h), line by line from standard input. */
#include <stdio.h>

#include "talk.h"

static void put(void *context, const char *line) {
    (void)context;
    puts(line);
    fflush(stdout);
}

int main(void) {
    char asked[200];
    while (fgets(asked, sizeof asked, stdin) != NULL)
        talk_answer(asked, put, NULL);
    return 0;
}
