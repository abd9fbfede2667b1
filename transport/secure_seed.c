#include "secure_seed.h"

#include <string.h>

#include "bytes.h"
#include "check.h"
#include "secure_wipe.h"

/* What is hashed: label, device, number of the start, number of the draw,
 * random bytes or zeros, and what it is for. */
enum {
    DEVICE = 8,
    BOOT = DEVICE + SECURE_DEVICE_BYTES,
    DRAW = BOOT + 8,
    RANDOM = DRAW + 8,
    PURPOSE = RANDOM + SECURE_KEY_BYTES,
    DRAWN_BYTES = PURPOSE + 1
};

static const uint8_t label[DEVICE] = {'i', 'n', 'c', 'o', 'd', 'e', 'd', 1};

static void put64(uint8_t *bytes, uint64_t value) {
    bytes_put32(bytes, (uint32_t)value);
    bytes_put32(bytes + 4, (uint32_t)(value >> 32));
}

bool secure_seed_draw(struct secure_source *source,
                      const struct secure_suite *suite,
                      const uint8_t key[SECURE_KEY_BYTES],
                      struct secure_seed *seed) {
    uint8_t drawn[DRAWN_BYTES] = {0}, made[SECURE_KEY_BYTES];
    bool random =
        source->random != NULL &&
        source->random(source->context, drawn + RANDOM, SECURE_KEY_BYTES);
    memset(seed, 0, sizeof *seed);
    if (!random && source->boot == 0) {
        return false;
    }
    LINK_ASSERT(source->draws < UINT64_MAX);
    memcpy(drawn, label, sizeof label);
    memcpy(drawn + DEVICE, source->device, SECURE_DEVICE_BYTES);
    put64(drawn + BOOT, source->boot);
    put64(drawn + DRAW, source->draws++);
    drawn[PURPOSE] = 'n';
    suite->hash(made, key, drawn, sizeof drawn);
    memcpy(seed->nonce, made, sizeof seed->nonce);
    drawn[PURPOSE] = 's';
    suite->hash(seed->secret, key, drawn, sizeof drawn);
    secure_wipe(drawn, sizeof drawn);
    secure_wipe(made, sizeof made);
    return true;
}
