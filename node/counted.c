#include "counted.h"

#include "incode/predicates/check.h"

int node_counted_write(struct node_counted *counted, uint16_t dest,
                       uint8_t type, const void *data, size_t size) {
    int status =
        counted->write == NULL
            ? cube_write(counted->cube, dest, type, data, size)
            : counted->write(counted->context, counted, dest, type, data, size);
    counted->sent += status == 0 && dest == CUBE_HOST;
    return status;
}

void node_counted_put(struct node_counted *counted, uint16_t dest, uint8_t type,
                      const void *data, size_t size) {
    int status = node_counted_write(counted, dest, type, data, size);
    INCODE_ASSERT(status == 0);
}
