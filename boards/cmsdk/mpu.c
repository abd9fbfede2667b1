/* What a node may reach: code to read and run, its 4 MB of data, the board's
 * registers; and nothing before or behind its data, or behind the code, where
 * the bus shows the same memory again.  The loader writes images behind itself,
 * and runs nothing there; nobody writes to the loader. */
#include "boards/bare/bare.h"
#include "boards/bare/sections.h"
#include "registers.h"

enum { RNR = 2, RBAR, RASR };           /* words behind CORTEX_MPU, */
enum { CTRL = 1, ON_WITH_DEFAULT = 5 }; /* privileged: all else as ever */
enum { SHCSR = 9, FAULTS = 7 << 16 };   /* behind CORTEX_SCB */

struct region {
    uint32_t base, attributes;
};

/* 4 MB each, but for the last. */
enum { CODE }; /* the first of these */
static const struct region regions[] = {
    {0x00000000, 0x060B002B}, /* code: read only, cached */
    {0x20400000, 0x1000002B}, /* no access: behind the data */
    {0x00400000, 0x1000002B}, /* behind the code */
    {0x1FC00000, 0x1000002B}, /* below the stack */
    {0x20000000, 0x130B002B}, /* data: not to be run, cached */
    {0x203FFE00, 0x13080011}, /* .noinit, 512 bytes: not cached, as a reset
                                 leaves nothing of a cache */
};
enum { FLASH = 0x1308002B }; /* 4 MB, not cached either */

/* In a loader: code of images, to be written and not to be run; and its own, of
 * 64 KB. */
enum { IMAGES = 0x130B002B, LOADER = 0x060B001F };

static void set(uint32_t number, struct region region) {
    volatile uint32_t *mpu = cmsdk_at(CORTEX_MPU);
    mpu[RNR] = number;
    mpu[RBAR] = region.base;
    mpu[RASR] = region.attributes;
}

void cmsdk_mpu_start(void) {
    volatile uint32_t *mpu = cmsdk_at(CORTEX_MPU);
    bool loader = (uintptr_t)bare_code_room == board_facts.image_at;
    uint32_t n = 0;
    for (; n < sizeof regions / sizeof regions[0]; n++)
        set(n, regions[n]);
    if (board_facts.flash != NULL) {
        set(n++, (struct region){
                     (uint32_t)(uintptr_t)board_facts.flash->context, FLASH});
    }
    if (loader) {
        set(CODE, (struct region){0, IMAGES});
        set(n, (struct region){0, LOADER});
    }
    cortex_barrier();
    mpu[CTRL] = ON_WITH_DEFAULT;
    cmsdk_at(CORTEX_SCB)[SHCSR] |= FAULTS;
    cortex_barrier();
}
