/* The order of a board's start. */
#include "boards/bare/bare.h"
#include "registers.h"

void board_start(void) {
    cmsdk_mpu_start();
    cmsdk_time_start();
    cmsdk_uarts_start();
}
