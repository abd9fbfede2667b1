/* The way from power on to bare_main, vectors, and what C cannot say. */

    .section .vectors, "ax"
    .global raspi3b_start
/* The firmware has left the caches off and empty, and lets the other processors
 * turn around until there is an address for each, at 0xE0, 0xE8 and 0xF0: they
 * are sent to sleep, as in an emulator they would take the machine's time. */
raspi3b_start:
    msr daifset, #15
    mrs x0, mpidr_el1
    tst x0, #0xFF
    b.ne raspi3b_park
    adr x0, raspi3b_park
    mov x1, #0xE0
    stp x0, x0, [x1]
    str x0, [x1, #16]
    dsb sy
    sev
    mrs x0, currentel
    cmp x0, #(2 << 2)
    b.ne raspi3b_program
/* From the hypervisor's level, which keeps nothing to itself. */
    mov x0, #(1 << 31)             /* HCR: 64 bits below */
    msr hcr_el2, x0
    mov x0, #0x33FF                /* no trap of floating point */
    msr cptr_el2, x0
    msr hstr_el2, xzr
    msr cntvoff_el2, xzr
    mov x0, #3                     /* the timers are the program's */
    msr cnthctl_el2, x0
    ldr x0, =0x30D00800            /* SCTLR: all off */
    msr sctlr_el1, x0
    mov x0, #0x3C4                 /* EL1 with SP_EL0, interrupts away */
    msr spsr_el2, x0
    adr x0, raspi3b_program
    msr elr_el2, x0
    eret

raspi3b_park:
    msr daifset, #15
1:  wfi
    b 1b

/* An exception begins on the handlers' stack.  What comes in a handler, and all
 * that is unexpected, is reported. */
    .balign 2048
raspi3b_vectors:
    .macro fault number
    .balign 128
    msr tpidr_el0, x0
    mov x0, sp
    msr tpidr_el1, x0
    ldr x0, =bare_fault_stack_end
    mov sp, x0
    mov x0, #\number
    b raspi3b_report
    .endm
    fault 0
    .balign 128
    b raspi3b_irq
    fault 2                        /* the guard's */
    fault 3
    fault 4
    fault 5
    fault 6
    fault 7
    fault 8                        /* there is no program below, 8 .. 15 */
    fault 9
    fault 10
    fault 11
    fault 12
    fault 13
    fault 14
    fault 15
    .balign 128

    .text

    .macro function name
    .global \name
    .type \name, %function
    .balign 4
\name:
    .endm

/* From \from on, up to \to: \with, four bytes at a time. */
    .macro fill from, to, with
    ldr x0, =\from
    ldr x1, =\to
    ldr w2, =\with
1:  cmp x0, x1
    b.hs 2f
    str w2, [x0], #4
    b 1b
2:
    .endm

/* The program's stack is SP_EL0, so that handlers have one of their own. */
function raspi3b_program
    mov x0, #(3 << 20)             /* floating point, rounding to nearest */
    msr cpacr_el1, x0
    isb
    msr fpcr, xzr
    adr x0, raspi3b_vectors
    msr vbar_el1, x0
    msr spsel, #1
    ldr x0, =bare_handler_stack_end
    mov sp, x0
    msr spsel, #0
    ldr x0, =bare_node_stack_end
    mov sp, x0
    fill bare_node_stack, bare_fault_stack_end, 0x5AC3A53C
    fill bare_bss, bare_bss_end, 0
    ldr x0, =bare_data
    ldr x1, =bare_data_end
    ldr x2, =bare_data_image
3:  cmp x0, x1
    b.hs 4f
    ldr w3, [x2], #4
    str w3, [x0], #4
    b 3b
4:  bl raspi3b_tables
    ldr x0, =0x44FF00              /* MAIR: a device, cached, uncached */
    msr mair_el1, x0
    ldr x0, =0x803521              /* TCR: 31 bits, of 4 KB, cached walks */
    msr tcr_el1, x0
    ldr x0, =raspi3b_level1
    msr ttbr0_el1, x0
    dsb sy
    tlbi vmalle1
    ic iallu
    dsb sy
    isb
    ldr x0, =0x30D0181D            /* SCTLR: MMU, caches, stacks aligned */
    msr sctlr_el1, x0
    isb
    msr daifclr, #4                /* errors of the bus are told */
    bl bare_main
    .ltorg

/* x0: the vector.  Lays down a struct raspi3b_frame. */
raspi3b_report:
    msr daifset, #15
    sub sp, sp, #304
    stp x1, x2, [sp, #8]
    stp x3, x4, [sp, #24]
    stp x5, x6, [sp, #40]
    stp x7, x8, [sp, #56]
    stp x9, x10, [sp, #72]
    stp x11, x12, [sp, #88]
    stp x13, x14, [sp, #104]
    stp x15, x16, [sp, #120]
    stp x17, x18, [sp, #136]
    stp x19, x20, [sp, #152]
    stp x21, x22, [sp, #168]
    stp x23, x24, [sp, #184]
    stp x25, x26, [sp, #200]
    stp x27, x28, [sp, #216]
    stp x29, x30, [sp, #232]
    mov x1, x0
    mrs x2, tpidr_el0
    str x2, [sp]
    mrs x2, sp_el0
    mrs x3, tpidr_el1
    stp x2, x3, [sp, #248]
    mrs x2, elr_el1
    mrs x3, spsr_el1
    stp x2, x3, [sp, #264]
    mrs x2, esr_el1
    mrs x3, far_el1
    stp x2, x3, [sp, #280]
    mov x0, sp
    ldr x2, =bare_handler_stack_end
    sub x2, x2, #40                /* struct raspi3b_interrupted */
    bl raspi3b_fault
    .ltorg

    .section .text.handlers, "ax"
/* The guard may interrupt it, and never comes back. */
raspi3b_irq:
    sub sp, sp, #192
    stp x0, x1, [sp]
    stp x2, x3, [sp, #16]
    stp x4, x5, [sp, #32]
    stp x6, x7, [sp, #48]
    stp x8, x9, [sp, #64]
    stp x10, x11, [sp, #80]
    stp x12, x13, [sp, #96]
    stp x14, x15, [sp, #112]
    stp x16, x17, [sp, #128]
    stp x18, x30, [sp, #144]
    mrs x0, elr_el1
    mrs x1, spsr_el1
    stp x0, x1, [sp, #160]
    msr daifclr, #1
    bl raspi3b_interrupt
    msr daifset, #1
    ldp x0, x1, [sp, #160]
    msr elr_el1, x0
    msr spsr_el1, x1
    ldp x0, x1, [sp]
    ldp x2, x3, [sp, #16]
    ldp x4, x5, [sp, #32]
    ldp x6, x7, [sp, #48]
    ldp x8, x9, [sp, #64]
    ldp x10, x11, [sp, #80]
    ldp x12, x13, [sp, #96]
    ldp x14, x15, [sp, #112]
    ldp x16, x17, [sp, #128]
    ldp x18, x30, [sp, #144]
    add sp, sp, #192
    eret

    .text
/* Runs the image at x0: as after a reset, no interrupt on or due, no memory
 * protected, caches written back and off.  From there on nothing is written
 * before each line of both memories has left the caches. */
function board_launch
    msr daifset, #15
    msr cntp_ctl_el0, xzr
    msr cntv_ctl_el0, xzr
    ldr x1, =0x3F00B21C            /* interrupts 0 .. 31, 32 .. 63: off */
    mov w2, #-1
    str w2, [x1]
    str w2, [x1, #4]
    ldr x1, =0x40000040            /* nor of a timer */
    str wzr, [x1]
    dsb sy
    ldr x1, =0x30D00800            /* SCTLR: all off */
    ldr x2, =0x400000
    ldr x3, =0x800000
    ldr x4, =0xC00000
    mrs x5, ctr_el0
    ubfx x5, x5, #16, #4           /* a line's words, by power of two */
    mov x6, #4
    lsl x5, x6, x5
    msr sctlr_el1, x1
    isb
    mov x1, xzr
1:  dc civac, x1
    add x1, x1, x5
    cmp x1, x2
    b.lo 1b
2:  dc civac, x3
    add x3, x3, x5
    cmp x3, x4
    b.lo 2b
    dsb sy
    tlbi vmalle1
    ic iallu
    dsb sy
    isb
    br x0
    .ltorg

function board_lock
    mrs x0, daif
    msr daifset, #2
    ret

function board_unlock
    tbnz w0, #7, 1f
    msr daifclr, #2
1:  ret

function raspi3b_guard_on
    msr daifclr, #1
    ret

function raspi3b_barrier
    dsb sy
    isb
    ret

function raspi3b_sleep
    dsb sy
    wfi
    ret

function raspi3b_count
    isb
    mrs x0, cntvct_el0
    ret

function raspi3b_hz
    mrs x0, cntfrq_el0
    ret

function raspi3b_tick_at
    msr cntp_cval_el0, x0
    mov x0, #1
    msr cntp_ctl_el0, x0
    isb
    ret

function board_interrupt
    msr cntp_cval_el0, xzr
    mov x0, #1
    msr cntp_ctl_el0, x0
    ret
    .size board_interrupt, . - board_interrupt /* tests/boards/trial asks */

function raspi3b_guard_at
    msr cntv_cval_el0, x0
    mov x0, #1
    msr cntv_ctl_el0, x0
    isb
    ret

function raspi3b_guard_off
    msr cntv_ctl_el0, xzr
    isb
    ret

    .section .text.handlers, "ax"
function raspi3b_tick_off
    msr cntp_ctl_el0, xzr
    isb
    ret
