/* What a node may reach: its code to read and run, its 4 MB of data, the
 * board's registers; and nothing before or behind its data, or behind its
 * code, where the bus shows the same memory again. */
#include "boards/bare/bare.h"
#include "registers.h"

enum { RNR = 2, RBAR, RASR };           /* words behind CORTEX_MPU, */
enum { CTRL = 1, ON_WITH_DEFAULT = 5 }; /* privileged: all else as ever */
enum { SHCSR = 9, FAULTS = 7 << 16 };   /* behind CORTEX_SCB */

struct region {
    uint32_t base, attributes;
};

/* 4 MB each, but for the last. */
static const struct region regions[] = {
    {0x20400000, 0x1000002B}, /* no access: behind the data */
    {0x00400000, 0x1000002B}, /* behind the code */
    {0x00000000, 0x060B002B}, /* code: read only, cached */
    {0x1FC00000, 0x1000002B}, /* below the stack */
    {0x20000000, 0x130B002B}, /* data: not to be run, cached */
    {0x203FFF00, 0x1308000F}, /* .noinit, 256 bytes: not cached, as a reset
                                 leaves nothing of a cache */
};
enum { FLASH = 0x1308001B }; /* 16 KB, not cached either */

static void set(uint32_t number, struct region region)
{
    volatile uint32_t *mpu = cmsdk_at(CORTEX_MPU);
    mpu[RNR] = number;
    mpu[RBAR] = region.base;
    mpu[RASR] = region.attributes;
}

void cmsdk_mpu_start(void)
{
    volatile uint32_t *mpu = cmsdk_at(CORTEX_MPU);
    uint32_t n = 0;
    for (; n < sizeof regions / sizeof regions[0]; n++) {
        set(n, regions[n]);
    }
    set(n, (struct region){(uint32_t)(uintptr_t)board_facts.flash->context,
                           FLASH});
    cortex_barrier();
    mpu[CTRL] = ON_WITH_DEFAULT;
    cmsdk_at(CORTEX_SCB)[SHCSR] |= FAULTS;
    cortex_barrier();
}
