/* The way from power on to bare_main, traps, and what C cannot say.
 *
 * The program runs in supervisor mode, where memory protection holds.  Machine
 * mode has what the program must not keep away: faults, the timer that ends a
 * sleep and is the guard, and the jump to another program. */

    .macro function name
    .global \name
    .type \name, %function
    .balign 4
\name:
    .endm

/* struct icicle_frame: registers by their numbers, 0 being the program counter,
 * and behind them three of the trap. */
    .equ FRAME, 288
    .equ CAUSE, 256
    .equ VALUE, 264
    .equ STATUS, 272

    .equ MTIMECMP, 0x02004008      /* of hart 1 */
    .equ MTIME, 0x0200BFF8
    .equ TICK, 10000               /* of mtime: microseconds */

    .section .vectors, "ax"
/* All five processors begin here.  The first has no floating point, and one is
 * enough: the others sleep. */
function icicle_start
    csrw mie, zero
    csrw mstatus, zero
    csrr t0, mhartid
    li t1, 1
    bne t0, t1, icicle_park
    csrw satp, zero
    csrw mideleg, zero
    csrw medeleg, zero
    la t0, icicle_machine
    csrw mtvec, t0
    la t0, bare_fault_stack_end
    csrw mscratch, t0
    la sp, bare_node_stack_end
    j icicle_program
icicle_park:
    wfi
    j icicle_park

/* From \from on, up to \to: \with, four bytes at a time. */
    .macro fill from, to, with
    la a0, \from
    la a1, \to
    li a2, \with
1:  bgeu a0, a1, 2f
    sw a2, 0(a0)
    addi a0, a0, 4
    j 1b
2:
    .endm

    .text
function icicle_program
    fill bare_node_stack, bare_fault_stack_end, 0x5AC3A53C
    fill bare_bss, bare_bss_end, 0
    la a0, bare_data
    la a1, bare_data_end
    la a2, bare_data_image
3:  bgeu a0, a1, 4f
    lw a3, 0(a2)
    sw a3, 0(a0)
    addi a0, a0, 4
    addi a2, a2, 4
    j 3b
4:  fence.i                        /* a loader has written the code */
    call icicle_protect
    la t0, icicle_protection
    csrw pmpcfg0, zero
    ld t1, 8(t0)
    csrw pmpaddr0, t1
    ld t1, 16(t0)
    csrw pmpaddr1, t1
    ld t1, 24(t0)
    csrw pmpaddr2, t1
    ld t1, 32(t0)
    csrw pmpaddr3, t1
    ld t1, 40(t0)
    csrw pmpaddr4, t1
    ld t1, 48(t0)
    csrw pmpaddr5, t1
    ld t1, 0(t0)
    csrw pmpcfg0, t1
    sfence.vma
/* External interrupts are the program's own, the timer stays in machine mode. */
    li t0, 1 << 9
    csrw mideleg, t0
    la t0, icicle_trap
    csrw stvec, t0
    la t0, bare_handler_stack_end - 128
    csrw sscratch, t0
    li t0, -1
    li t1, MTIMECMP
    sd t0, 0(t1)
    li t0, 1 << 9 | 1 << 7
    csrw mie, t0
/* Floating point on, rounding to nearest; supervisor mode, its interrupts off. */
    li t0, 1 << 13 | 1 << 11
    csrw mstatus, t0
    csrw fcsr, zero
    la t0, bare_main
    csrw mepc, t0
    mret

/* A trap to machine mode: the timer, a jump that the program asks for, and all
 * faults.  Its stack is that of the report of a fault. */
    .balign 4
icicle_machine:
    csrrw sp, mscratch, sp
    addi sp, sp, -FRAME
    sd t0, 40(sp)
    sd t1, 48(sp)
    csrr t0, mcause
    bgez t0, 2f
    li t0, MTIME
    ld t0, 0(t0)
    la t1, icicle_guard_due
    ld t1, 0(t1)
    bgeu t0, t1, 3f
    li t1, TICK
    add t0, t0, t1
    li t1, MTIMECMP
    sd t0, 0(t1)
    ld t0, 40(sp)
    ld t1, 48(sp)
    addi sp, sp, FRAME
    csrrw sp, mscratch, sp
    mret
/* 8, 9 and 11 are calls; but for a call, machine mode has no fault: what went
 * wrong in a report restarts the board without another. */
2:  andi t1, t0, -4
    li t0, 8
    beq t1, t0, icicle_leave
    csrr t0, mstatus
    srli t0, t0, 11
    andi t0, t0, 3
    li t1, 3
    bne t0, t1, 3f
    li a0, 0x20220000
    j icicle_leave
/* Lays down a struct icicle_frame. */
3:  csrw mie, zero
    sd ra, 8(sp)
    sd gp, 24(sp)
    sd tp, 32(sp)
    sd t2, 56(sp)
    .irp n, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, \
        25, 26, 27, 28, 29, 30, 31
    sd x\n, 8 * \n(sp)
    .endr
    csrr t0, mepc
    sd t0, 0(sp)
    csrr t0, mscratch
    sd t0, 16(sp)
    la t1, bare_fault_stack_end
    csrw mscratch, t1
    csrr t0, mcause
    sd t0, CAUSE(sp)
    csrr t0, mtval
    sd t0, VALUE(sp)
    csrr t0, mstatus
    sd t0, STATUS(sp)
    mv a0, sp
    csrr a1, sepc
    call icicle_fault

/* As after a reset, to a0; nothing of the interrupts' controller is on. */
icicle_leave:
    csrw mie, zero
    csrw pmpcfg0, zero
    sfence.vma
    li t0, 0x0C002100              /* PLIC: the enables of 0 .. 95 */
    sw zero, 0(t0)
    sw zero, 4(t0)
    sw zero, 8(t0)
    fence
    fence.i
    jr a0

/* Of the program, and of the report of a fault. */
function icicle_jump
    ecall

    .section .text.handlers, "ax"
/* Interrupts of the program, on a stack of their own, of which 128 bytes are
 * its.  No floating point is used in it. */
function icicle_trap
    csrrw sp, sscratch, sp
    sd ra, 0(sp)
    sd t0, 8(sp)
    sd t1, 16(sp)
    sd t2, 24(sp)
    sd t3, 32(sp)
    sd t4, 40(sp)
    sd t5, 48(sp)
    sd t6, 56(sp)
    sd a0, 64(sp)
    sd a1, 72(sp)
    sd a2, 80(sp)
    sd a3, 88(sp)
    sd a4, 96(sp)
    sd a5, 104(sp)
    sd a6, 112(sp)
    sd a7, 120(sp)
    call icicle_interrupt
    ld ra, 0(sp)
    ld t0, 8(sp)
    ld t1, 16(sp)
    ld t2, 24(sp)
    ld t3, 32(sp)
    ld t4, 40(sp)
    ld t5, 48(sp)
    ld t6, 56(sp)
    ld a0, 64(sp)
    ld a1, 72(sp)
    ld a2, 80(sp)
    ld a3, 88(sp)
    ld a4, 96(sp)
    ld a5, 104(sp)
    ld a6, 112(sp)
    ld a7, 120(sp)
    csrrw sp, sscratch, sp
    sret
    .global icicle_trap_end
icicle_trap_end:

    .text
/* 0: interrupts were on. */
function board_lock
    csrrci a0, sstatus, 2
    andi a0, a0, 2
    xori a0, a0, 2
    ret

function board_unlock
    bnez a0, 1f
    csrsi sstatus, 2
1:  ret

function icicle_sleep
    fence
    wfi
    ret
