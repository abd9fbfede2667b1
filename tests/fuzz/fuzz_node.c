/* What a host and a neighbour that cannot be trusted say to a node: right
 * messages, changed in places and in any order.  It never traps, and works
 * afterwards as before. */
#include "tests/unit/node/node_talk.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    talk_run(data, size);
    return 0;
}
