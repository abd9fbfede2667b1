#include "learn.h"

#include <string.h>

#include "bytes.h"
#include "check.h"
#include "link_internal.h"

void learner_init(struct learner *learner, const struct link_pipe *pipes,
                  unsigned links)
{
    LINK_ASSERT(links <= CUBE_LINKS_MAX);
    memset(learner, 0, sizeof *learner);
    memcpy(learner->pipes, pipes, links * sizeof *pipes);
    learner->links = links;
}

/* Whether such a wire may be in a cube of that dimension. */
static bool sensible(const struct learned *l, unsigned expected_link)
{
    if (l->dimension > CUBE_DIMENSION_MAX || l->self >= 1u << l->dimension) {
        return false;
    }
    if (l->teacher == CUBE_HOST) {
        return expected_link == l->dimension;
    }
    return expected_link < l->dimension &&
           l->teacher == (l->self ^ 1u << expected_link);
}

/* Whether this node has the links of that one: to its neighbours, and to the
 * host from node 0 and perhaps another. */
static bool fits(const struct learner *learner, const struct learned *l)
{
    return learner->links == l->dimension + 1u ||
           (l->self != 0 && learner->links == l->dimension);
}

static bool take_hello(struct learner *learner, unsigned d,
                       const uint8_t *hello, struct learned *learned)
{
    unsigned expected = hello[6];
    if (hello[0] != LINK_VERSION || hello[7] == 0) {
        return false;
    }
    learned->teacher = bytes_get16(hello + 2);
    learned->self = bytes_get16(hello + 4);
    learned->dimension = (uint8_t)(hello[7] - 1);
    learned->link = (uint8_t)d;
    learned->host_port = learned->teacher == CUBE_HOST && learned->self != 0;
    if (!sensible(learned, expected)) {
        return false;
    }
    if (expected != d) {
        learner->misplaced++;
        learner->misplaced_link = (uint8_t)d;
        learner->misplaced_expected = (uint8_t)expected;
        return false;
    }
    if (!fits(learner, learned)) {
        learner->misfits++;
        return false;
    }
    return true;
}

static bool take_frame(struct learner *learner, unsigned d,
                       const uint8_t *bytes, size_t size,
                       struct learned *learned)
{
    struct frame_reader reader;
    struct frame_header header;
    uint8_t hello[LINK_HELLO_SIZE];
    return frame_open(&reader, bytes, size, &header) == FRAME_GOOD &&
           header.kind == LINK_HELLO && header.size == LINK_HELLO_SIZE &&
           frame_take(&reader, &header, hello) == FRAME_GOOD &&
           take_hello(learner, d, hello, learned);
}

/* Reads what there is room for, and takes the frames that are whole. */
static bool hear(struct learner *learner, unsigned d, struct learned *learned)
{
    const struct link_pipe *pipe = &learner->pipes[d];
    uint8_t *bytes = learner->heard[d].bytes;
    unsigned size = learner->heard[d].size, begin = 0;
    int got = pipe->receive(pipe->context, bytes + size, LEARN_BYTES - size);
    bool found = false;
    if (got <= 0) {
        return false;
    }
    LINK_ASSERT((unsigned)got <= LEARN_BYTES - size);
    size += (unsigned)got;
    for (unsigned i = 0; i < size && !found; i++) {
        if (bytes[i] == 0) {
            found = !learner->heard[d].skipping && i > begin &&
                    take_frame(learner, d, bytes + begin, i - begin, learned);
            learner->heard[d].skipping = false;
            begin = i + 1;
        }
    }
    size -= begin;
    memmove(bytes, bytes + begin, size);
    if (size == LEARN_BYTES) { /* no greeting is so long */
        size = 0;
        learner->heard[d].skipping = true;
    }
    learner->heard[d].size = (uint8_t)size;
    return found;
}

bool learner_poll(struct learner *learner, struct learned *learned)
{
    for (unsigned d = 0; d < learner->links; d++) {
        if (hear(learner, d, learned)) {
            return true;
        }
    }
    return false;
}
