/* The Cortex-M3 needs nothing of its own. */
    .syntax unified
    .thumb
    .text
    .global board_processor_start
    .type board_processor_start, %function
    .thumb_func
board_processor_start:
    bx lr
