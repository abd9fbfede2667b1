/* What a node may reach: its code to read and run, its 4 MB of data, and the
 * devices; nothing before or behind its data.  The loader writes images, and
 * runs nothing there; no image reaches the loader. */
#include "boards/bare/bare.h"
#include "boards/bare/sections.h"
#include "registers.h"

/* Of a region whose size is a power of two, at a multiple of it. */
enum { READ = 1, WRITE = 2, RUN = 4, WHOLE = 3 << 3 };

struct icicle_protection icicle_protection;

static void add(unsigned i, uint64_t from, uint64_t bytes, unsigned rights) {
    icicle_protection.address[i] = from >> 2 | (bytes / 8 - 1);
    icicle_protection.settings |= (uint64_t)(rights | WHOLE) << 8 * i;
}

/* In machine mode, before bare_main. */
void icicle_protect(void) {
    bool image = (uintptr_t)bare_code == board_facts.image_at;
    add(0, ICICLE_DATA, 4u << 20, READ | WRITE);
    add(1, board_facts.image_at, board_facts.image_bytes,
        image ? READ | RUN : READ | WRITE);
    add(2, ICICLE_CLINT, 64u << 10, READ | WRITE);
    add(3, ICICLE_PLIC, 4u << 20, READ | WRITE);
    add(4, UINT64_C(0x20000000), 2u << 20, READ | WRITE); /* UARTs, card */
    if (!image)
        add(5, ICICLE_ENVM, 128u << 10, READ | RUN);
}
