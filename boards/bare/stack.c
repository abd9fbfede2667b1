#include "stack.h"

#include "bare.h"
#include "sections.h"

size_t bare_stack_used(const uint32_t *lowest, size_t bytes) {
    size_t painted = 0;
    while (painted < bytes / sizeof *lowest && lowest[painted] == BARE_PAINT)
        painted++;
    return bytes - painted * sizeof *lowest;
}

uint32_t bare_stack_high_water(void) {
    return (uint32_t)bare_stack_used(bare_node_stack, BARE_STACK_BYTES);
}
