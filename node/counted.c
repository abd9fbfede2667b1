#include "counted.h"

int node_letters_write(struct node_letters *letters, uint16_t dest,
                       uint8_t type, const void *data, size_t size)
{
    int status = cube_write(letters->cube, dest, type, data, size);
    letters->sent += status == 0 && dest == CUBE_HOST;
    return status;
}
