#include "pause.h"

#include "check.h"

void incode_pause_look(struct incode_pause *pause)
{
    uint32_t units = INCODE_PAUSE_UNITS_MAX;
    if (pause->look != NULL)
        units = pause->look(pause->context);
    INCODE_ASSERT(units >= 1 && units <= INCODE_PAUSE_UNITS_MAX);
    pause->left = (int32_t)units;
}
