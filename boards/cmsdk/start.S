/* Vectors, the way from reset to bare_main, and what C cannot say. */
    .syntax unified
    .thumb

    .section .vectors, "a"
    .global cmsdk_vectors
cmsdk_vectors:
    .word bare_handler_stack_end
    .word cmsdk_start
    .word cmsdk_fault_entry        /* NMI: the watchdog */
    .word cmsdk_fault_entry        /* HardFault */
    .word cmsdk_fault_entry        /* MemManage */
    .word cmsdk_fault_entry        /* BusFault */
    .word cmsdk_fault_entry        /* UsageFault */
    .word 0, 0, 0, 0
    .word cmsdk_fault_entry        /* SVCall: nobody calls it */
    .word cmsdk_fault_entry        /* DebugMon */
    .word 0
    .word cmsdk_fault_entry        /* PendSV */
    .word cmsdk_tick
    .word cmsdk_uart0_receive      /* interrupt 0 */
    .word cmsdk_uart0_send
    .word cmsdk_uart1_receive
    .word cmsdk_uart1_send
    .word cmsdk_uart2_receive
    .word cmsdk_uart2_send
    .rept 12
    .word cmsdk_fault_entry
    .endr
    .word cmsdk_uart3_receive      /* 18 */
    .word cmsdk_uart3_send
    .word cmsdk_uart4_receive
    .word cmsdk_uart4_send
    .rept 10
    .word cmsdk_fault_entry
    .endr

    .text

    .macro function name
    .global \name
    .type \name, %function
    .thumb_func
\name:
    .endm

/* From \from on, up to \to: \with, a word at a time. */
    .macro fill from, to, with
    ldr r0, =\from
    ldr r1, =\to
    ldr r2, =\with
1:  cmp r0, r1
    it lo
    strlo r2, [r0], #4
    blo 1b
    .endm

/* The processor's own part first, as C may use its floating-point unit; then
 * the node's stack for the program, so that handlers keep one of their own. */
function cmsdk_start
    cpsid i
    ldr r0, =bare_handler_stack_end
    msr msp, r0
    bl board_processor_start
    ldr r0, =0xE000ED08            /* VTOR */
    ldr r1, =cmsdk_vectors
    str r1, [r0]
    fill bare_node_stack, bare_fault_stack_end, 0x5AC3A53C
    fill bare_bss, bare_bss_end, 0
    ldr r0, =bare_data
    ldr r1, =bare_data_end
    ldr r2, =bare_data_image
2:  cmp r0, r1
    itt lo
    ldrlo r3, [r2], #4
    strlo r3, [r0], #4
    blo 2b
    ldr r0, =bare_node_stack_end
    msr psp, r0
    movs r0, #2
    msr control, r0
    isb
    bl bare_main
    .ltorg

/* An exception without a handler.  It goes on with a stack of its own.  Pushed
 * are the registers that the processor has not saved, and both stack pointers:
 * a frame lies at each where the watchdog comes during a handler. */
function cmsdk_fault_entry
    cpsid i
    mrs r0, psp
    mrs r1, msp
    ldr r2, =bare_fault_stack_end
    mov sp, r2
    push {r0, r1, r4-r11}
    mov r0, sp
    mov r1, lr
    mrs r2, ipsr
    bl cmsdk_fault
    .ltorg

function cortex_barrier
    dsb
    isb
    bx lr

function cortex_wait
    dsb
    wfi
    bx lr

function board_lock
    mrs r0, primask
    cpsid i
    bx lr

function board_unlock
    msr primask, r0
    isb
    bx lr

/* Runs the image whose vectors lie at r0: as after a reset, caches written back
 * and off, nothing protected, no interrupt on or due. */
function board_launch
    cpsid i
    mov r4, r0
    bl board_processor_stop
    movs r0, #0
    ldr r1, =0xE000ED94            /* MPU: CTRL */
    str r0, [r1]
    ldr r1, =0xE000E010            /* SysTick */
    str r0, [r1]
    mvns r0, r0
    ldr r1, =0xE000E180            /* interrupts 0 .. 31: off, */
    str r0, [r1]
    ldr r1, =0xE000E280            /* and not due, */
    str r0, [r1]
    ldr r1, =0xE000ED04            /* ICSR: nor a tick */
    mov r0, #0x02000000
    str r0, [r1]
    ldr r1, =0xE000ED08            /* VTOR */
    str r4, [r1]
    dsb
    isb
    ldr r0, [r4]
    msr msp, r0
    movs r0, #0
    msr control, r0
    isb
    ldr r0, [r4, #4]
    bx r0
    .ltorg
