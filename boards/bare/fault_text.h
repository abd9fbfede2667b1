/* Registers in words, for a fault's report. */
#ifndef BOARDS_BARE_FAULT_TEXT_H
#define BOARDS_BARE_FAULT_TEXT_H

#include "transport/text.h"

struct bare_register {
    const char *name;
    uint64_t value;
};

/* With so many digits at least, 1 .. 16. */
void bare_text_hex(struct cube_text *text, uint64_t number, unsigned digits);

/* " name 0x...", each behind the other. */
void bare_text_registers(struct cube_text *text,
                         const struct bare_register *registers, unsigned count);

/* What an address is that was not to be reached, and the address.  below: bytes
 * beneath the node's stack that it alone can have run into. */
void bare_text_place(struct cube_text *text, uint64_t address, size_t below);

/* Reports over the console, keeps it for the next start, and restarts.  where:
 * short, with the place; registers: all that helps. */
_Noreturn void bare_fault(const char *where,
                          const struct bare_register *registers, unsigned count,
                          int hung);

#endif
