/* The Cortex-M3 needs nothing of its own. */
    .syntax unified
    .thumb
    .text
    .global board_processor_start, board_processor_stop
    .type board_processor_start, %function
    .type board_processor_stop, %function
    .thumb_func
board_processor_start:
    .thumb_func
board_processor_stop:
    bx lr
