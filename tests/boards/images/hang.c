/* An image that comes up, and hangs before it has heard a neighbour. */
#include "boards/bare/bare.h"

enum { GUARD_US = 1000000 };

/* Volatile, so that a compiler takes it for a loop that may end. */
static volatile bool hanging = true;

_Noreturn void bare_main(void) {
    bare_uarts_init();
    board_start();
    board_guard(GUARD_US);
    board_unlock(0);
    while (hanging) {
    }
    board_restart();
}
