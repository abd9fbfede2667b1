/* An image that restarts as it starts, without a word, as one that a reset from
 * outside ends. */
#include "boards/bare/bare.h"

_Noreturn void bare_main(void) {
    board_start();
    board_restart();
}
