#include "fault_text.h"

#include "bare.h"
#include "console.h"
#include "handover.h"
#include "sections.h"

void bare_text_hex(struct cube_text *text, uint64_t number, unsigned digits) {
    char all[19] = "0x";
    unsigned n = 2;
    for (unsigned i = 16; i-- > 0;) {
        unsigned digit = (unsigned)(number >> (4 * i) & 15);
        if (n > 2 || digit != 0 || i < digits)
            all[n++] = "0123456789abcdef"[digit];
    }
    all[n] = '\0';
    cube_text_put(text, all);
}

void bare_text_place(struct cube_text *text, uint64_t address, size_t below) {
    uint64_t lowest = (uintptr_t)bare_node_stack;
    uint64_t bytes = board_facts.data_bytes;
    if (address < lowest && lowest - address <= below)
        cube_text_put(text, "a stack overflow");
    else if (address >= lowest + bytes && address < lowest + 2 * bytes)
        cube_text_put(text, "an access behind the board's data memory");
    else
        cube_text_put(text, "an access to what is not there");
    cube_text_put(text, ", address ");
    bare_text_hex(text, address, 8);
}

void bare_text_registers(struct cube_text *text,
                         const struct bare_register *registers,
                         unsigned count) {
    for (unsigned i = 0; i < count; i++) {
        cube_text_put(text, " ");
        cube_text_put(text, registers[i].name);
        cube_text_put(text, " ");
        bare_text_hex(text, registers[i].value, 8);
    }
}

static const char again[] = "; restarting\r\n";

void bare_fault(const char *where, const struct bare_register *registers,
                unsigned count, int hung) {
    char room[512];
    struct cube_text text = cube_text_in(room, sizeof room);
    (void)board_lock(); /* nothing else is sent meanwhile */
    board_feed();
    bare_reason_keep(hung ? BARE_HUNG : BARE_FAULT, where);
    cube_text_put(&text, "incode: ");
    cube_text_put(&text, board_facts.name);
    cube_text_put(&text, ": ");
    cube_text_put(&text, where);
    cube_text_put(&text, again);
    bare_text_registers(&text, registers, count);
    cube_text_put(&text, "\r\n");
    bare_console_begin();
    bare_console_put(room);
    bare_console_end();
    board_restart();
}
