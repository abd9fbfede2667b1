/* The report of a fault, of a hang, and of an interrupt that nobody handles. */
#include "boards/bare/bare.h"
#include "boards/bare/fault_text.h"
#include "boards/bare/sections.h"
#include "boards/bare/stack.h"
#include "registers.h"

/* Words behind CORTEX_SCB. */
enum { AIRCR = 3, CFSR = 10, HFSR = 11, MMFAR = 13, BFAR = 14 };
enum { RESET = 0x05FA0004 };
enum { NMI = 2 };
enum { HELD_BITS = 3 * 10 }; /* in a UART: two bytes, and the time to be sure */
enum { MMAR_VALID = 1 << 7, BFAR_VALID = 1 << 15 };

/* The frame could not be laid down, or only in part. */
enum { NO_FRAME = 1 << 4 | 1 << 5 | 1 << 12 | 1 << 13 };

enum { OF_PROGRAM = 1 << 2 }; /* in EXC_RETURN: the program was interrupted */
enum { FRAME_LR = 5, FRAME_PC = 6, FRAME_XPSR = 7, FRAME_WORDS = 8 };

/* What a UART has of its own is the end of a report, or of a farewell. */
static void see_off(void) {
    uint64_t begun_us = board_now_us();
    while (board_now_us() - begun_us <=
           HELD_BITS * 1000000u / board_facts.baud) {
    }
}

void board_restart(void) {
    (void)board_lock();
    see_off();
    cortex_barrier();
    cmsdk_at(CORTEX_SCB)[AIRCR] = RESET;
    for (;;)
        cortex_barrier();
}

static bool sound(const uint32_t *frame, uint32_t status) {
    return (status & NO_FRAME) == 0 && (uintptr_t)frame % 4 == 0 &&
           frame >= bare_node_stack &&
           frame + FRAME_WORDS <= bare_handler_stack_end;
}

static void tell_place(struct cube_text *text, uint32_t exception,
                       uint32_t status, uint32_t address) {
    bool known = (status & (MMAR_VALID | BFAR_VALID)) != 0;
    if (exception == NMI) {
        cube_text_put(text, "the program hung");
    } else if (exception > 6) {
        cube_text_put(text, "an interrupt that nobody handles, ");
        cube_text_number(text, exception);
    } else if (known) {
        bare_text_place(text, address, board_facts.data_bytes);
    } else if ((status & NO_FRAME) != 0) {
        cube_text_put(text, "a stack overflow");
    } else {
        cube_text_put(text, "a fault of the program");
    }
}

/* What start.S has pushed. */
struct cmsdk_pushed {
    const uint32_t *program, *handlers; /* stack pointers */
    uint32_t r4_r11[8];
};

_Noreturn void cmsdk_fault(const struct cmsdk_pushed *pushed,
                           uint32_t exc_return, uint32_t exception);
/* The report of a hang names the place in the program, also if the watchdog
 * came during a handler.  The place in the handler is reported as well. */
_Noreturn void cmsdk_fault(const struct cmsdk_pushed *pushed,
                           uint32_t exc_return, uint32_t exception) {
    static const uint32_t none[FRAME_WORDS];
    volatile uint32_t *scb = cmsdk_at(CORTEX_SCB);
    uint32_t status = scb[CFSR];
    uint32_t address = (status & MMAR_VALID) != 0 ? scb[MMFAR] : scb[BFAR];
    bool in_handler = (exc_return & OF_PROGRAM) == 0;
    const uint32_t *frame =
        in_handler && exception != NMI ? pushed->handlers : pushed->program;
    const uint32_t *saved = pushed->r4_r11;
    const uint32_t *f = sound(frame, status) ? frame : none;
    bool both = in_handler && sound(pushed->handlers, status);
    struct bare_register registers[] = {
        {"pc", f[FRAME_PC]},
        {"lr", f[FRAME_LR]},
        {"xpsr", f[FRAME_XPSR]},
        {"sp", (uintptr_t)frame},
        {"r0", f[0]},
        {"r1", f[1]},
        {"r2", f[2]},
        {"r3", f[3]},
        {"r4", saved[0]},
        {"r5", saved[1]},
        {"r6", saved[2]},
        {"r7", saved[3]},
        {"r8", saved[4]},
        {"r9", saved[5]},
        {"r10", saved[6]},
        {"r11", saved[7]},
        {"r12", f[4]},
        {"exc", exc_return},
        {"cfsr", status},
        {"hfsr", scb[HFSR]},
        {"mmfar", scb[MMFAR]},
        {"bfar", scb[BFAR]},
        {"handler", both ? pushed->handlers[FRAME_PC] : 0}};
    char room[128];
    struct cube_text text = cube_text_in(room, sizeof room);
    tell_place(&text, exception, status, address);
    bare_text_registers(&text, registers, f == none ? 0 : 2);
    bare_fault(room, registers, sizeof registers / sizeof registers[0],
               exception == NMI);
}
