/* Where start.ld has laid things. */
#ifndef BOARDS_BARE_SECTIONS_H
#define BOARDS_BARE_SECTIONS_H

#include <stddef.h>
#include <stdint.h>

extern const uint8_t bare_code[], bare_code_end[];
extern const uint8_t bare_code_room[];    /* where the next program may begin */
extern uint32_t bare_node_stack[];        /* BARE_STACK_BYTES */
extern uint32_t bare_handler_stack_end[]; /* behind the former */
extern uint8_t bare_tables[], bare_tables_end[]; /* .data and .bss */
extern uint8_t bare_arena[], bare_arena_end[];

/* From one of these to its end. */
static inline size_t bare_bytes(const void *from, const void *to) {
    return (uintptr_t)to - (uintptr_t)from;
}

#endif
