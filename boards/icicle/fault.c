/* The report of a fault and of a hang. */
#include "boards/bare/bare.h"
#include "boards/bare/fault_text.h"
#include "boards/bare/sections.h"
#include "registers.h"

/* What start.S has laid down. */
struct icicle_frame {
    uint64_t x[32]; /* 0: the program counter */
    uint64_t cause, value, status;
};

enum { RA = 1, SP = 2, GP = 3, TP = 4, T0 = 5, S0 = 8, A0 = 10, S2 = 18 };

/* Causes: of an access that the protection refuses. */
enum { FETCH = 1, LOAD = 5, STORE = 7 };
#define INTERRUPT (UINT64_C(1) << 63)

extern const uint8_t icicle_trap[], icicle_trap_end[];

static bool within(uint64_t at, const void *from, const void *to) {
    return at >= (uintptr_t)from && at < (uintptr_t)to;
}

static void tell_place(struct cube_text *text,
                       const struct icicle_frame *frame) {
    if ((frame->cause & INTERRUPT) != 0)
        cube_text_put(text, "the program hung");
    else if (frame->cause == FETCH || frame->cause == LOAD ||
             frame->cause == STORE)
        bare_text_place(text, frame->value, board_facts.data_bytes / 2);
    else
        cube_text_put(text, "a fault of the program");
}

_Noreturn void icicle_fault(const struct icicle_frame *frame,
                            uint64_t interrupted);
/* The report of a hang names the place in the program, also if the guard came
 * during a handler, which has interrupted it there.  The place in the handler
 * is reported as well. */
_Noreturn void icicle_fault(const struct icicle_frame *frame,
                            uint64_t interrupted) {
    const uint64_t *x = frame->x;
    bool in_handler = within(x[0], icicle_trap, icicle_trap_end) ||
                      within(x[SP] - 1, bare_node_stack + BARE_STACK_BYTES / 4,
                             bare_handler_stack_end);
    bool hung = (frame->cause & INTERRUPT) != 0;
    struct bare_register registers[] = {
        {"pc", hung && in_handler ? interrupted : x[0]},
        {"ra", x[RA]},
        {"sp", x[SP]},
        {"cause", frame->cause},
        {"value", frame->value},
        {"status", frame->status},
        {"a0", x[A0]},
        {"a1", x[A0 + 1]},
        {"a2", x[A0 + 2]},
        {"a3", x[A0 + 3]},
        {"a4", x[A0 + 4]},
        {"a5", x[A0 + 5]},
        {"s0", x[S0]},
        {"s1", x[S0 + 1]},
        {"s2", x[S2]},
        {"s3", x[S2 + 1]},
        {"s4", x[S2 + 2]},
        {"t0", x[T0]},
        {"gp", x[GP]},
        {"tp", x[TP]},
        {"handler", in_handler ? x[0] : 0}};
    char room[128];
    struct cube_text text = cube_text_in(room, sizeof room);
    tell_place(&text, frame);
    bare_text_registers(&text, registers, 2);
    bare_fault(room, registers, sizeof registers / sizeof registers[0], hung);
}
