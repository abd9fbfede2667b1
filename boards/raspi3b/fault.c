/* The report of a fault, of a hang, and of what nobody handles. */
#include "boards/bare/bare.h"
#include "boards/bare/fault_text.h"
#include "boards/bare/sections.h"
#include "registers.h"

/* What start.S has laid down. */
struct raspi3b_frame {
    uint64_t x[31];
    uint64_t sp_program, sp_handler, elr, spsr, esr, far;
};

/* The end of what raspi3b_irq pushes first onto the handlers' stack. */
struct raspi3b_interrupted {
    uint64_t lr, elr, spsr, unused[2];
};

/* Exception classes of ESR. */
enum { FETCH = 0x21, ACCESS = 0x25 };

/* Of the vectors: 0 .. 3 the program's, 4 .. 7 those in a handler. */
enum { SYNCHRONOUS = 0, FAST = 2 };

static void tell_place(struct cube_text *text,
                       const struct raspi3b_frame *frame, unsigned vector) {
    uint64_t class = frame->esr >> 26;
    if (vector % 4 == FAST) {
        cube_text_put(text, "the program hung");
    } else if (vector % 4 != SYNCHRONOUS) {
        cube_text_put(text, "an interrupt that nobody handles, vector ");
        cube_text_number(text, vector);
    } else if (class == ACCESS || class == FETCH) {
        bare_text_place(text, frame->far, board_facts.data_bytes / 2);
    } else {
        cube_text_put(text, "a fault of the program");
    }
}

_Noreturn void raspi3b_fault(const struct raspi3b_frame *frame, unsigned vector,
                             const struct raspi3b_interrupted *interrupted);
/* The report of a hang names the place in the program, also if the guard came
 * during a handler.  The place in the handler is reported as well. */
_Noreturn void raspi3b_fault(const struct raspi3b_frame *frame, unsigned vector,
                             const struct raspi3b_interrupted *interrupted) {
    const uint64_t *x = frame->x;
    bool in_handler = vector >= 4;
    uint64_t sp = in_handler ? frame->sp_handler : frame->sp_program;
    uint64_t pc = frame->elr, lr = x[30];
    if (in_handler && vector % 4 == FAST) {
        pc = interrupted->elr;
        lr = interrupted->lr;
        sp = frame->sp_program;
    }
    struct bare_register registers[] = {
        {"pc", pc},
        {"lr", lr},
        {"sp", sp},
        {"esr", frame->esr},
        {"far", frame->far},
        {"spsr", frame->spsr},
        {"x0", x[0]},
        {"x1", x[1]},
        {"x2", x[2]},
        {"x3", x[3]},
        {"x4", x[4]},
        {"x5", x[5]},
        {"x6", x[6]},
        {"x7", x[7]},
        {"x8", x[8]},
        {"x19", x[19]},
        {"x20", x[20]},
        {"x21", x[21]},
        {"x22", x[22]},
        {"x29", x[29]},
        {"handler", in_handler ? frame->elr : 0}};
    char room[128];
    struct cube_text text = cube_text_in(room, sizeof room);
    tell_place(&text, frame, vector);
    bare_text_registers(&text, registers, 2);
    bare_fault(room, registers, sizeof registers / sizeof registers[0],
               vector % 4 == FAST);
}
