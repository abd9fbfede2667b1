/* Any bytes as a node's results: vertices in range, and an end. */
#include <stdlib.h>

#include "node/result.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* The first byte sets how many vertices there are, and nodes. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0)
        return 0;
    uint32_t vertices = 1u << data[0] % 32;
    uint32_t rows[16][4];
    struct node_result_reader reader;
    enum node_result_event event;
    size_t count, events = 0;
    uint32_t nodes = 1 + data[0] % 7;
    node_result_open(&reader, data + 1, size - 1, vertices, 0, nodes);
    do {
        event = node_result_read(&reader, rows, 16, &count);
        if (++events > size + 1 ||
            (event != NODE_RESULT_GARBAGE && reader.finder >= nodes))
            abort();
        for (size_t i = 0; event != NODE_RESULT_GARBAGE && i < 4 * count; i++)
            if (rows[i / 4][i % 4] >= vertices)
                abort();
    } while (event == NODE_RESULT_ROWS || event == NODE_RESULT_COMMIT);
    return 0;
}
