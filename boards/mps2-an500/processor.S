/* The Cortex-M7: its floating-point unit on, both caches empty and on; and what
 * the data cache holds written back, both off. */
    .syntax unified
    .thumb
    .text

/* Each line of the data cache to \register. */
    .macro each_line register
    ldr r0, =0xE000ED84            /* CSSELR: the data cache, level 1 */
    movs r1, #0
    str r1, [r0]
    dsb
    ldr r0, =0xE000ED80            /* CCSIDR */
    ldr r0, [r0]
    ubfx r1, r0, #13, #15          /* sets less one */
    ubfx r2, r0, #3, #10           /* ways less one */
    ldr r0, =\register
1:  mov r3, r2
2:  lsls r12, r3, #30
    orr r12, r12, r1, lsl #5
    str r12, [r0]
    subs r3, r3, #1
    bhs 2b
    subs r1, r1, #1
    bhs 1b
    .endm

    .global board_processor_start
    .type board_processor_start, %function
    .thumb_func
board_processor_start:
    ldr r0, =0xE000ED88            /* CPACR: CP10, CP11 */
    ldr r1, [r0]
    orr r1, r1, #0xF00000
    str r1, [r0]
    dsb
    isb
    ldr r0, =0xE000EF50            /* ICIALLU */
    movs r1, #0
    str r1, [r0]
    each_line 0xE000EF60           /* DCISW */
    dsb
    ldr r0, =0xE000ED14            /* CCR: IC, DC */
    ldr r1, [r0]
    orr r1, r1, #0x30000
    str r1, [r0]
    dsb
    isb
    bx lr
    .ltorg

    .global board_processor_stop
    .type board_processor_stop, %function
    .thumb_func
board_processor_stop:
    ldr r0, =0xE000ED14            /* CCR: IC, DC */
    ldr r1, [r0]
    bic r1, r1, #0x30000
    str r1, [r0]
    dsb
    isb
    each_line 0xE000EF74           /* DCCISW */
    dsb
    isb
    bx lr
    .ltorg
