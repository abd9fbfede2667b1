/* An image that faults as it starts, before it knows its board's memory. */
#include "boards/bare/bare.h"

_Noreturn void bare_main(void) {
    __builtin_trap();
}
