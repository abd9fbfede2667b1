#include "console.h"

#include "bare.h"

void bare_console_begin(void) {
    if (board_console_put(0))
        (void)board_console_put(BARE_CONSOLE_MARK);
}

void bare_console_put(const char *text) {
    while (*text != '\0' && board_console_put((uint8_t)*text))
        text++;
}

void bare_console_end(void) {
    (void)board_console_put(0);
}
