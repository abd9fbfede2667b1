/* What a node may reach: its code to read and run, its 4 MB of data, and the
 * devices; nothing before or behind its data.  The loader writes images behind
 * itself, and runs nothing there; no image reaches the loader.  Blocks of 2 MB,
 * and pages of 4 KB where the data end, the last of which is .noinit's: it is
 * not cached, as a reset leaves nothing of a cache. */
#include "boards/bare/bare.h"
#include "boards/bare/sections.h"
#include "registers.h"

enum {
    BLOCK = 1 << 21,
    PAGE = 1 << 12,
    ENTRIES = 512,
    CODE_BLOCKS = 2,
    IMAGE = 1, /* of these, and of one that a loader has started its only */
    DATA = 0x00800000 / BLOCK, /* as in board.ld */
    DEVICES = 0x3F000000 / BLOCK
};

/* Of an entry.  Which memory it is, MAIR in start.S says. */
enum {
    A_BLOCK = 1,
    A_TABLE = 3,
    A_PAGE = 3,
    DEVICE = 0 << 2,
    CACHED = 1 << 2,
    UNCACHED = 2 << 2,
    READ_ONLY = 2 << 6,
    SHARED = 3 << 8,
    USED = 1 << 10
};
#define NEVER_RUN (UINT64_C(3) << 53)

/* raspi3b_level1 covers 2 GB: the second is that of the processors' own
 * devices. */
uint64_t raspi3b_level1[2] __attribute__((aligned(64)));
static uint64_t level2[ENTRIES] __attribute__((aligned(4096)));
static uint64_t data_end[ENTRIES] __attribute__((aligned(4096)));

/* Before the MMU is on. */
void raspi3b_tables(void) {
    const uint64_t data = CACHED | SHARED | USED | NEVER_RUN;
    const uint64_t device = DEVICE | USED | NEVER_RUN;
    bool image = (uintptr_t)bare_code == board_facts.image_at;
    bool loader = (uintptr_t)bare_code_room == board_facts.image_at;
    for (uint64_t i = image ? IMAGE : 0; i < CODE_BLOCKS; i++)
        level2[i] = i * BLOCK | A_BLOCK | CACHED | SHARED | USED | READ_ONLY;
    if (loader)
        level2[IMAGE] = (uint64_t)IMAGE * BLOCK | A_BLOCK | data;
    for (uint64_t i = DEVICES; i < ENTRIES; i++)
        level2[i] = i * BLOCK | A_BLOCK | device;
    uint64_t end = (uint64_t)(DATA + 1) * BLOCK;
    level2[DATA] = (uint64_t)DATA * BLOCK | A_BLOCK | data;
    level2[DATA + 1] = (uintptr_t)data_end | A_TABLE;
    for (uint64_t i = 0; i < ENTRIES - 1; i++)
        data_end[i] = (end + i * PAGE) | A_PAGE | data;
    data_end[ENTRIES - 1] = (end + (ENTRIES - 1) * (uint64_t)PAGE) | A_PAGE |
                            UNCACHED | SHARED | USED | NEVER_RUN;
    raspi3b_level1[0] = (uintptr_t)level2 | A_TABLE;
    raspi3b_level1[1] = UINT64_C(0x40000000) | A_BLOCK | device;
}
